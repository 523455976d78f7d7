"""Today's options, files, keys, columns and headings are those in ``expected/``."""

from __future__ import annotations

import importlib
import json
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from .faces import command_names, option_names
from .pins import (
    MODELS,
    PACKAGES,
    PINS,
    Sections,
    call,
    difference,
    library_example,
    library_sections,
    option_sections,
)


def holds(name: str, sections: Sections) -> None:
    """Fails with what was lost and added."""
    changed = difference(name, sections)
    assert not changed, (
        f"the public face of '{name}' changed, lost (-) and added (+):\n{changed}\n"
        f"If this is meant: python -m tests.contracts.renew {name}"
    )


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[pytest.mark.slow] * pin.slow) for n, pin in PINS.items()]
)
def test_what_commands_write(name: str, tmp_path: Path) -> None:
    holds(name, PINS[name].sections(tmp_path))
    for path in (tmp_path / "out").glob("*.json"):
        for model in MODELS.glob("*.toml"):
            if model.name in PINS[name].lines[-1]:
                given = tomllib.loads(model.read_text(encoding="utf-8"))
                assert_repeated(given, json.loads(path.read_text(encoding="utf-8"))["parameters"])


def assert_repeated(given: Any, found: Any, where: str = "parameters") -> None:
    """Every key and value of a model file is found again."""
    if isinstance(given, dict):
        for key, value in given.items():
            assert key in found, f"{where}.{key} is gone"
            assert_repeated(value, found[key], f"{where}.{key}")
    elif isinstance(given, list):
        assert len(found) == len(given), where
        for number, (value, other) in enumerate(zip(given, found, strict=True)):
            assert_repeated(value, other, f"{where}[{number}]")
    else:
        assert found == given, where


def test_options() -> None:
    holds("options", option_sections())


@pytest.mark.parametrize("name", command_names())
def test_help_names_every_option(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    called = call(name, "--help")
    assert (called.code, called.err) == (0, "")
    assert [option for option in option_names(name) if option not in called.out] == []
    assert name in call("--help").out


def test_names_for_use_as_a_library() -> None:
    sections = library_sections()
    holds("library", sections)
    for path in sections["README, As a library"]:
        module, _, name = path.rpartition(".")
        assert hasattr(importlib.import_module(module), name)
    for package in PACKAGES:
        assert [name for name in package.__all__ if not hasattr(package, name)] == []


def test_the_example_of_the_readme_runs() -> None:
    names: dict[str, Any] = {}
    exec(library_example(), names)
    frf = names["whole"].frf.between("planetary.sun.w", "reducer.pinion.w")
    assert frf.shape == (4000,)
    assert np.iscomplexobj(frf)
    assert names["whole"].kernel_condition.shape == (4000,)
