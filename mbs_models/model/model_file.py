"""Model files: TOML to a drivetrain and back.

Reading is strict, and whatever is wrong with a file ends in one `ModelError`: one line with the
file, the place in it, the key, its value and what is allowed.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, cast

from pydantic import TypeAdapter, ValidationError
from pydantic_core import ErrorDetails

from ..errors import ModelError
from ..text_files import read_text
from .excitation_tables import ExcitationTable
from .messages import Location, not_toml, one_message, suggest
from .parameters import Drivetrain
from .toml_text import document
from .tooth_numbers import refuse_impossible

LARGEST = 16_000_000  # bytes of a model file: a thousand parts take 150 kB
MOST_PARTS = 10_000

# Presets


def preset_names() -> tuple[str, ...]:
    """Names of the drivetrains that come with the package, in alphabetical order."""
    entries = (files(__package__) / "presets").iterdir()
    return tuple(sorted(e.name.removesuffix(".toml") for e in entries if e.name.endswith(".toml")))


def template(preset: str = "paper") -> str:
    """The commented text of a preset's model file, to start a new one from."""
    if preset not in preset_names():
        raise ModelError(f"{preset}: no preset of that name; {suggest(preset, preset_names())}")
    return (files(__package__) / "presets" / f"{preset}.toml").read_text(encoding="utf-8")


def describe(preset: str) -> str:
    """One line on a preset: its name, title and source."""
    drivetrain = load(preset)
    return f"{preset}: {drivetrain.name} ({drivetrain.source})"


# Reading and writing


def load(model: str | Path) -> Drivetrain:
    """The drivetrain of a preset's name or of a model file's path.

    Raises
    ------
    ModelError
        If there is neither, or if the file does not describe a drivetrain.
    """
    origin = f"preset {model}" if str(model) in preset_names() else str(model)
    return loads(model_text(model), origin=origin)


def model_text(model: str | Path) -> str:
    """The text of a preset, or of a model file.

    Raises
    ------
    ModelError
        There is neither.
    """
    return template(str(model)) if str(model) in preset_names() else _read(Path(model))


def loads(text: str, origin: str = "<string>") -> Drivetrain:
    """The drivetrain that a model file's text describes.

    Parameters
    ----------
    text
        TOML.
    origin
        What error messages call the text, a file's name as a rule.
    """
    try:
        data = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # ValueError: also a number of 5000 digits
        raise ModelError(f"{origin}: not valid TOML: {not_toml(error, text)}") from error
    if not data:
        raise ModelError(
            f"{origin}: the file is empty; it needs a name and at least one [[stage]] or "
            "[[inertia]] table"
        )
    try:
        _refuse_too_many(data)
        drivetrain = Drivetrain.model_validate(data, by_alias=True, by_name=False)
        refuse_impossible(drivetrain)
    except ValidationError as error:
        raise ModelError(f"{origin}: {one_message(error.errors(), data)}") from error
    except ModelError as error:
        raise ModelError(f"{origin}: {error}") from error
    return drivetrain


def _refuse_too_many(data: Mapping[str, Any]) -> None:
    """Refuse more tables than anybody waits for."""
    for key in ("stage", "inertia", "coupling", "excitation"):
        tables = data.get(key)
        if isinstance(tables, list) and len(tables) > MOST_PARTS:
            raise ModelError(f"[[{key}]]: {len(tables)} tables; at most {MOST_PARTS} are possible")


def folder_of(model: str | Path) -> Path:
    """Where a model's relative paths start: its file's folder; a preset's the working directory."""
    return Path() if str(model) in preset_names() else Path(model).parent


def excitation_table(data: Mapping[str, Any]) -> ExcitationTable:
    """One [[excitation]] table from its keys and values.

    Raises
    ------
    ModelError
        Naming the key, its value and what is allowed.
    """
    try:
        return _excitation_adapter().validate_python(data)
    except ValidationError as error:
        first: Location = ("excitation", 0)
        details = [{**detail, "loc": (*first, *detail["loc"])} for detail in error.errors()]
        message = one_message(cast("list[ErrorDetails]", details), {"excitation": [data]})
        raise ModelError(message.replace("excitation[0]: ", "")) from error


def dumps(drivetrain: Drivetrain) -> str:
    """Model file text that loads to an equal drivetrain, with the keys that were given."""
    data = drivetrain.model_dump(by_alias=True, exclude_unset=True, exclude_none=True)
    return "\n".join(document(data)) + "\n"


def write_new(path: str | Path, text: str) -> None:
    """Write a new file; an existing one is refused, and so is a link of its name."""
    path = Path(path)
    try:
        file = path.open("x", encoding="utf-8")
        with _removed_unless_written(path), file:
            file.write(text)
    except FileExistsError as error:
        raise ModelError(
            f"{path}: exists already and is not overwritten; give another name"
        ) from error
    except OSError as error:
        raise ModelError(f"{path}: cannot be written: {error.strerror}") from error


@contextmanager
def _removed_unless_written(path: Path) -> Iterator[None]:
    try:
        yield
    except BaseException:
        path.unlink()
        raise


def _read(path: Path) -> str:
    try:
        return read_text(path, LARGEST, "model file")
    except FileNotFoundError as error:
        raise ModelError(
            f"{path}: neither a file nor a preset; {suggest(str(path), preset_names())}"
        ) from error


@cache
def _excitation_adapter() -> TypeAdapter[ExcitationTable]:
    return TypeAdapter(ExcitationTable)
