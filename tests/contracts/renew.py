"""``python -m tests.contracts.renew [NAME …]``: the public face is meant to be as it is now.

Writes the texts in ``expected/`` anew, all or those named, and prints what changed: lost (-) and
added (+). Each such line is a change for people and scripts, and belongs in the changelog.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from .pins import (
    EXPECTED,
    PINS,
    Sections,
    difference,
    library_sections,
    option_sections,
    written,
)


def ran(name: str) -> Sections:
    """What its command lines give."""
    with tempfile.TemporaryDirectory() as folder:
        return PINS[name].sections(Path(folder))


def main(names: list[str]) -> None:
    """Renew all expectations, or those named."""
    quick: dict[str, Callable[[], Sections]] = {
        "options": option_sections,
        "library": library_sections,
    }
    known = [*quick, *PINS]
    if unknown := [name for name in names if name not in known]:
        sys.exit(f"{unknown[0]}: must be one of {', '.join(known)}")
    EXPECTED.mkdir(exist_ok=True)
    for name in names or known:
        sections = quick[name]() if name in quick else ran(name)
        changed = difference(name, sections)
        print(f"{name}: {'changed' if changed else 'as before'}\n{changed}".rstrip())
        (EXPECTED / f"{name}.txt").write_text(written(sections), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
