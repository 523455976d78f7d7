"""Model files: TOML to a drivetrain and back.

Reading is strict, and whatever is wrong with a file ends in one `ModelError`: one line with the
file, the place in it, the key, its value and what is allowed. What is allowed is read from the
JSON schema of the parameters, so that bounds and units are written down once, there.
"""

from __future__ import annotations

import difflib
import json
import os
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, cast

import numpy as np
from pydantic import TypeAdapter, ValidationError
from pydantic_core import ErrorDetails

from .errors import ModelError
from .excitation_tables import ExcitationTable
from .parameters import Drivetrain

Schema = Mapping[str, Any]
Location = tuple[int | str, ...]

LONGEST_VALUE = 60  # characters of a wrong value shown in a message
BOUNDS = {
    "exclusiveMinimum": "greater than",
    "minimum": "at least",
    "exclusiveMaximum": "less than",
    "maximum": "at most",
}
TYPES = {
    "number": "a number",
    "integer": "a whole number",
    "string": "text",
    "array": "a list",
    "object": "a table",
}


# Presets


def preset_names() -> tuple[str, ...]:
    """Names of the drivetrains that come with the package, in alphabetical order."""
    entries = (files(__package__) / "presets").iterdir()
    return tuple(sorted(e.name.removesuffix(".toml") for e in entries if e.name.endswith(".toml")))


def template(preset: str = "paper") -> str:
    """The commented text of a preset's model file, to start a new one from."""
    if preset not in preset_names():
        raise ModelError(f"{preset}: no preset of that name; {_suggest(preset, preset_names())}")
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
    if str(model) in preset_names():
        return loads(template(str(model)), origin=f"preset {model}")
    return loads(_read(Path(model)), origin=str(model))


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
        raise ModelError(f"{origin}: not valid TOML: {error}") from error
    if not data:
        raise ModelError(
            f"{origin}: the file is empty; it needs a name and at least one [[stage]] or "
            "[[inertia]] table"
        )
    try:
        return Drivetrain.model_validate(data, by_alias=True, by_name=False)
    except ValidationError as error:
        raise ModelError(f"{origin}: {_one_message(error.errors(), data)}") from error


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
        message = _one_message(cast("list[ErrorDetails]", details), {"excitation": [data]})
        raise ModelError(message.replace("excitation[0]: ", "")) from error


def dumps(drivetrain: Drivetrain) -> str:
    """Model file text that loads to an equal drivetrain, with the keys that were given."""
    data = drivetrain.model_dump(by_alias=True, exclude_unset=True, exclude_none=True)
    return "\n".join(_document(data)) + "\n"


def write_new(path: str | Path, text: str) -> None:
    """Write a new file, whole or not at all; an existing one is refused."""
    path = Path(path)
    if path.exists():
        raise ModelError(f"{path}: exists already and is not overwritten; give another name")
    partial = path.with_name(f".{path.name}.{os.getpid()}.partial")
    try:
        partial.write_text(text, encoding="utf-8")
        partial.rename(path)
    except OSError as error:
        raise ModelError(f"{path}: cannot be written: {error.strerror}") from error
    finally:
        partial.unlink(missing_ok=True)


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8-sig")
    except FileNotFoundError as error:
        raise ModelError(
            f"{path}: neither a file nor a preset; {_suggest(str(path), preset_names())}"
        ) from error
    except OSError as error:
        raise ModelError(f"{path}: cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise ModelError(f"{path}: not a text file in UTF-8 (byte {error.start} is not)") from error


# TOML text


def _document(data: Mapping[str, Any]) -> Iterator[str]:
    """Lines of a model file: keys, then [tables] and [[arrays of tables]]; inline below those."""
    tables: list[tuple[str, Mapping[str, Any]]] = []
    for key, value in data.items():
        if isinstance(value, Mapping):
            tables.append((f"[{key}]", value))
        elif isinstance(value, Sequence) and not isinstance(value, str):
            tables.extend((f"[[{key}]]", table) for table in value)
        else:
            yield f"{key} = {_toml(value)}"
    for header, table in tables:
        yield ""
        yield header
        yield from (f"{key} = {_toml(value)}" for key, value in table.items())


def _toml(value: object) -> str:
    """A value as TOML writes it."""
    match value:
        case str():
            return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
        case bool():
            return str(value).lower()
        case float():
            return _float(value)
        case Mapping():
            pairs = ", ".join(f"{_key(key)} = {_toml(item)}" for key, item in value.items())
            return f"{{ {pairs} }}"
        case list() | tuple():
            return f"[{', '.join(map(_toml, value))}]"
        case _:
            return str(value)


def _float(value: float) -> str:
    """The shortest digits that read back as ``value``: 24.6, 2.0e8, 4.48e-8."""
    if value == 0.0 or 1e-3 <= abs(value) < 1e5 or not np.isfinite(value):
        return repr(value)
    return np.format_float_scientific(value, trim="0", exp_digits=1).replace("e+", "e")


def _key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else _toml(key)


# Messages


@dataclass(frozen=True)
class Place:
    """Where in a model file something is wrong, and the part of the schema that governs it."""

    path: Location
    schema: Schema
    parent: Schema

    def written(self, data: Mapping[str, Any]) -> str:
        """The place as a reader finds it: ``stage[0] 'reducer': pinion.mass``."""
        if len(self.path) < 2 or not isinstance(self.path[1], int):
            return _dotted(self.path)
        table = data[str(self.path[0])][self.path[1]]
        name = table.get("name") if isinstance(table, dict) else None
        label = f" {name!r}" if isinstance(name, str) else ""
        key = _dotted(self.path[2:])
        return _dotted(self.path[:2]) + label + (f": {key}" if key else "")


def _one_message(errors: Sequence[ErrorDetails], data: Mapping[str, Any]) -> str:
    """The first problem in full and the places of the others.

    Unknown keys come first: where a key is mistyped, the missing one follows from it. A list that
    is too short for want of a good item is left out in favour of the item.
    """
    details = sorted(errors, key=lambda detail: detail["type"] != "extra_forbidden")
    above = {detail["loc"][:n] for detail in details for n in range(len(detail["loc"]))}
    details = [d for d in details if d["type"] != "too_short" or d["loc"] not in above]
    problems: dict[str, str] = {}
    mistyped: set[Location] = set()
    for detail in details:
        place = _place(detail)
        if detail["type"] == "extra_forbidden":
            nearest = _nearest(str(place.path[-1]), place.parent["properties"])
            mistyped.update((*place.path[:-1], key) for key in nearest)
        elif detail["type"] == "missing" and place.path in mistyped:
            continue
        problems.setdefault(place.written(data), _problem(detail, place, data))
    first, *others = problems
    more = f" (and {len(others)} more: {', '.join(others)})" if others else ""
    return problems[first] + more


def _problem(detail: ErrorDetails, place: Place, data: Mapping[str, Any]) -> str:
    """One problem as ``where.key = value: what is allowed``."""
    where = place.written(data)
    match detail["type"]:
        case "value_error":
            return f"{where}: {detail['ctx']['error']}" if where else str(detail["ctx"]["error"])
        case "missing" | "union_tag_not_found":
            return f"{where}: missing; must be {_allowed(place.schema)}"
    value = _shown(_value_at(data, place.path))
    if detail["type"] == "extra_forbidden":
        suggestion = _suggest(str(place.path[-1]), place.parent["properties"])
        return f"{where} = {value}: unknown key; {suggestion}"
    return f"{where} = {value}: must be {_allowed(place.schema)}"


def _place(detail: ErrorDetails) -> Place:
    """Follow an error's location through the schema, past the names of union branches."""
    schema = parent = _drivetrain_schema()
    path: Location = ()
    for step in detail["loc"]:
        schema = _table(schema)
        if isinstance(step, int):
            path, parent, schema = (*path, step), schema, schema["items"]
        elif "discriminator" in schema:
            schema = {"$ref": schema["discriminator"]["mapping"][step]}
        elif step in schema.get("properties", ()):
            path, parent, schema = (*path, step), schema, schema["properties"][step]
        elif detail["type"] == "extra_forbidden":
            path, parent, schema = (*path, step), schema, {}
    if detail["type"].startswith("union_tag"):
        tag = schema["discriminator"]
        path, parent = (*path, tag["propertyName"]), schema
        schema = {"anyOf": [{"const": name} for name in tag["mapping"]]}
    return Place(path, schema, parent)


@cache
def _excitation_adapter() -> TypeAdapter[ExcitationTable]:
    return TypeAdapter(ExcitationTable)


@cache
def _drivetrain_schema() -> Schema:
    return Drivetrain.model_json_schema(by_alias=True)


def _table(schema: Schema) -> Schema:
    """The schema behind a reference, or behind an optional one."""
    branches = [b for b in schema.get("anyOf", ()) if b.get("type") != "null"]
    if len(branches) == 1:
        schema = branches[0]
    if "$ref" in schema:
        definition: Schema = _drivetrain_schema()["$defs"][schema["$ref"].rpartition("/")[2]]
        return definition
    return schema


def _allowed(schema: Schema) -> str:
    """What a schema allows, in words: "a number, greater than 0 (kg)"."""
    schema = _table(schema)
    if "const" in schema:
        return _toml(schema["const"])
    if "discriminator" in schema:
        tag = schema["discriminator"]
        return f"a table with {tag['propertyName']} {' or '.join(map(_toml, tag['mapping']))}"
    if "enum" in schema:
        return " or ".join(map(_toml, schema["enum"]))
    if "anyOf" in schema:
        return " or ".join(_allowed(branch) for branch in schema["anyOf"])
    if schema["type"] == "object":
        return f"a table with {', '.join(schema['properties'])}"
    bounds = " and ".join(f"{BOUNDS[key]} {schema[key]:g}" for key in BOUNDS if key in schema)
    words: str = schema.get("description", TYPES[schema["type"]])
    unit = f" ({schema['unit']})" if "unit" in schema else ""
    return (f"{words}, {bounds}" if bounds else words) + unit


def _suggest(wrong: str, right: Iterable[str]) -> str:
    """The nearest right name, and all of them."""
    nearest = "".join(f"did you mean {name!r}? " for name in _nearest(wrong, right))
    return f"{nearest}allowed: {', '.join(right)}"


def _nearest(wrong: str, right: Iterable[str]) -> list[str]:
    return difflib.get_close_matches(wrong, list(right), n=1)


def _dotted(path: Location) -> str:
    """``stage[0].pinion.mass`` for the path ("stage", 0, "pinion", "mass")."""
    steps = (f"[{step}]" if isinstance(step, int) else f".{_key(step)}" for step in path)
    return "".join(steps).removeprefix(".")


def _value_at(data: Any, path: Location) -> object:
    for step in path:
        data = data[step]
    return data


def _shown(value: object) -> str:
    text = _toml(value)
    return text if len(text) <= LONGEST_VALUE else f"{text[: LONGEST_VALUE - 1]}…"
