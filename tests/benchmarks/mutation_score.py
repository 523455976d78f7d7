"""Would tests notice? ``python -m tests.benchmarks.mutation_score PACKAGE [--sample 200]``.

A mutant is the package with one operator, comparison or number changed. It is killed where a quick
test of its mirror, or one that imports the module, fails. The sample is drawn from all mutants of
the package by the seed; survivors are printed with file and line.
"""

from __future__ import annotations

import argparse
import ast
import random
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("fbs", "mbs_models", "validation")
COPIED = (*PACKAGES, "tests", "pyproject.toml", "README.md", "CHANGELOG.md")
SECONDS = 300  # a mutant that takes longer is killed: it does not come to an end
SWAPS: dict[type[ast.AST], type[ast.AST]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult,
    ast.Lt: ast.GtE, ast.GtE: ast.Lt, ast.Gt: ast.LtE, ast.LtE: ast.Gt,
    ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.And: ast.Or, ast.Or: ast.And,
}  # fmt: skip


@dataclass(frozen=True)
class Mutant:
    """A node of a file, by its number in the walk of the tree, and what is done to it."""

    path: Path
    node: int
    line: int
    words: str


def mutants(package: str) -> Iterator[Mutant]:
    """Every mutant of a package."""
    for path in sorted((ROOT / package).rglob("*.py")):
        for number, node in enumerate(ast.walk(ast.parse(path.read_text(encoding="utf-8")))):
            if words := _change(node, write=False):
                yield Mutant(path.relative_to(ROOT), number, getattr(node, "lineno", 0), words)


def _change(node: ast.AST, *, write: bool) -> str:
    """Change a node in place where ``write``; what is done in words, empty where nothing can be."""
    if isinstance(node, ast.BinOp | ast.BoolOp) and type(node.op) in SWAPS:
        new = SWAPS[type(node.op)]
        words = f"{type(node.op).__name__} → {new.__name__}"
        if write:
            node.op = new()  # type: ignore[assignment]
        return words
    if isinstance(node, ast.Compare) and type(node.ops[0]) in SWAPS:
        new = SWAPS[type(node.ops[0])]
        words = f"{type(node.ops[0]).__name__} → {new.__name__}"
        if write:
            node.ops[0] = new()  # type: ignore[call-overload]
        return words
    if isinstance(node, ast.Constant) and not isinstance(node.value, bool):
        value = node.value
        if isinstance(value, int | float):
            new_value = 1.5 * value if isinstance(value, float) else value + 1
            if write:
                node.value = new_value
            return f"{value!r} → {new_value!r}"
    return ""


def tests_of(path: Path) -> list[str]:
    """Quick tests in the module's mirror folder, and those that import it."""
    module = ".".join(path.with_suffix("").parts).removesuffix(".__init__")
    mirror = ROOT / "tests" / path.parent
    found = set(mirror.glob("test_*.py"))
    for test in (ROOT / "tests").rglob("test_*.py"):
        text = test.read_text(encoding="utf-8")
        if f"from {module} import" in text or f"import {module}" in text:
            found.add(test)
    return sorted(str(test.relative_to(ROOT)) for test in found)


@cache
def _green(path: Path, folder: Path) -> bool:
    """Whether the tests of a module pass as it is: else nothing is known of its mutants."""
    return _passes(path, folder)


def _passes(path: Path, folder: Path) -> bool:
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-m", "not slow"]
    command += ["-p", "no:cacheprovider", *tests_of(path)]
    try:
        ended = subprocess.run(
            command, cwd=folder, capture_output=True, timeout=SECONDS, check=False
        )
    except subprocess.TimeoutExpired:
        return False
    return ended.returncode == 0


def killed(mutant: Mutant, folder: Path) -> bool:
    """Whether a test notices; the folder is a copy of the repository."""
    if not _green(mutant.path, folder):
        sys.exit(f"{mutant.path}: its tests do not pass as it is")
    original = (ROOT / mutant.path).read_text(encoding="utf-8")
    tree = ast.parse(original)
    _change(list(ast.walk(tree))[mutant.node], write=True)
    (folder / mutant.path).write_text(ast.unparse(tree), encoding="utf-8")
    try:
        return not _passes(mutant.path, folder)
    finally:
        (folder / mutant.path).write_text(original, encoding="utf-8")


def main() -> None:
    """Draw, try, and print the score with its survivors."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("package", choices=PACKAGES)
    parser.add_argument("--sample", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    known = list(mutants(asked.package))
    drawn = random.Random(asked.seed).sample(known, min(asked.sample, len(known)))
    survivors = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for item in COPIED:
            source = ROOT / item
            copy = shutil.copytree if source.is_dir() else shutil.copy
            copy(source, folder / item)
        for number, mutant in enumerate(drawn, start=1):
            if not killed(mutant, folder):
                survivors.append(mutant)
                print(f"survived: {mutant.path}:{mutant.line}: {mutant.words}", flush=True)
            print(f"{number} of {len(drawn)}, {len(survivors)} survived", file=sys.stderr)
    score = 100.0 * (1.0 - len(survivors) / len(drawn))
    print(f"{asked.package}: {score:.1f} % of {len(drawn)}, of {len(known)} mutants, killed")


if __name__ == "__main__":
    main()
