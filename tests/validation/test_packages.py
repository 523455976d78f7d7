"""What the three packages are from outside: version, public names, what importing them loads."""

from __future__ import annotations

import ast
import importlib
import re
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from matplotlib import pyplot

import mbs_models
import validation
from tests.validation.command_line import call
from validation.cli import app

ROOT = Path(validation.__file__).parents[1]
COMMANDS = [
    command.name or command.callback.__name__
    for command in app.registered_commands
    if command.callback is not None
]
LAZY = [mbs_models, validation]


def python(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Run this Python on the packages tested."""
    return subprocess.run(
        [sys.executable, *arguments], capture_output=True, text=True, cwd=ROOT, check=False
    )


@pytest.mark.parametrize("name", ["fbs", "mbs_models", "validation"])
def test_version(name: str) -> None:
    assert importlib.import_module(name).__version__ == version("drivetrain-crosscheck")


def test_version_of_the_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("--version") == 0
    assert capsys.readouterr().out == f"crosscheck {version('drivetrain-crosscheck')}\n"


def test_version_where_nothing_is_installed(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def missing(name: str) -> str:
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr("importlib.metadata.version", missing)
    assert call("--version") == 0
    assert capsys.readouterr().out == "crosscheck, not installed (run from source)\n"


def test_the_citation_is_of_this_version() -> None:
    lines = (ROOT / "CITATION.cff").read_text(encoding="utf-8").splitlines()
    (given,) = (line for line in lines if line.startswith("version:"))
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    assert f'\nversion = "{given.split()[1]}"\n' in project


def test_the_readme_of_the_library() -> None:
    """The library's lines in the README run, and give what they say."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"## As a library\n\n```python\n(.*?)```", text, re.DOTALL)
    names: dict[str, Any] = {}
    exec(compile(block, "README.md", "exec"), names)
    through = names["whole"].frf.between("planetary.sun.w", "reducer.pinion.w")
    assert through.shape == (4000,)
    magnitude, _ = (axes for axes in pyplot.gcf().axes)
    np.testing.assert_array_equal(magnitude.lines[0].get_ydata(), np.abs(through))
    pyplot.close("all")


@pytest.mark.parametrize("command", [None, *COMMANDS])
def test_help_by_either_name(command: str | None, capsys: pytest.CaptureFixture[str]) -> None:
    before = () if command is None else (command,)
    assert call(*before, "--help") == 0
    long = capsys.readouterr().out
    assert call(*before, "-h") == 0
    assert capsys.readouterr().out == long
    assert "Usage: crosscheck" in long


def test_python_m_validation() -> None:
    done = python("-m", "validation", "presets")
    assert done.returncode == 0
    assert "paper-table2" in done.stdout
    wrong = python("-m", "validation", "presents")
    assert wrong.returncode == 2
    assert wrong.stderr.startswith("crosscheck: no such command 'presents'")


@pytest.mark.parametrize("package", LAZY, ids=lambda package: package.__name__)
def test_every_public_name_is_there(package: ModuleType) -> None:
    names = package.__all__
    assert len(names) == len(set(names))
    assert set(names) <= set(dir(package))
    for name in names:
        value = getattr(package, name)
        # its home, not a module that happens to be called like it
        assert not isinstance(value, type(sys))
        assert name in (package.__doc__ or "") or name == "__version__"
    with pytest.raises(AttributeError, match="has no attribute 'no_such_name'"):
        _ = package.no_such_name


@pytest.mark.parametrize("package", LAZY, ids=lambda package: package.__name__)
def test_types_see_the_same_names(package: ModuleType) -> None:
    """What a type checker is told to import is what is loaded."""
    tree = ast.parse(Path(str(package.__file__)).read_text(encoding="utf-8"))
    told = {
        (node.module, alias.name)
        for block in tree.body
        if isinstance(block, ast.If) and ast.unparse(block.test) == "TYPE_CHECKING"
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert told == {(module, name) for name, module in package._MODULE_OF.items()}
    assert {name for _, name in told} | {"__version__"} == set(package.__all__)


@pytest.mark.parametrize(
    ("use", "loaded"),
    [
        ("import mbs_models, validation; dir(mbs_models), dir(validation)", []),
        ("from mbs_models import load, Drivetrain; load('paper')", ["numpy", "pydantic"]),
        ("from validation import Check, Route, Source", ["numpy", "pydantic"]),
        ("import fbs; fbs.Frf([1.0], [[[1.0]]], ['a'], ['a'])", ["numpy"]),
    ],
)
def test_a_name_loads_what_it_needs(use: str, loaded: list[str]) -> None:
    """exudyn and matplotlib are loaded where they are used."""
    heavy = "[m for m in ('exudyn', 'matplotlib', 'numpy', 'pydantic') if m in sys.modules]"
    done = python("-c", f"import sys; {use}; print({heavy})")
    assert done.stdout.strip() == str(loaded), done.stderr
