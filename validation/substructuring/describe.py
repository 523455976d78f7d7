"""Coupling, decoupling and identification in sentences and tables."""

from __future__ import annotations

import numpy as np

from ..report.digits import grouped
from ..report.page import Table
from ..routes.substitution_checks import where
from .result import SubstructuringResult


def parts_table(result: SubstructuringResult) -> Table:
    """The files."""
    rows = tuple(
        (
            part.name,
            str(part.path),
            f"{len(part.frf.responses)} × {len(part.frf.excitations)}",
            grouped(part.frf.frequency.size),
            "; ".join(part.quality) or "nothing that a passive, reciprocal structure does not have",
        )
        for part in result.parts
    )
    return Table(("part", "file", "FRFs", "lines", "quality"), rows, frozenset({2, 3}))


def lost_table(result: SubstructuringResult) -> Table:
    """Where the result has no digit."""
    rows = tuple(
        (curve.name, where(result.frequency, curve.lost))
        for curve in result.curves
        if curve.lost.any()
    )
    return Table(
        ("result", "no digit"), rows, empty="Every line of what is drawn has a digit at least."
    )


def spring_table(result: SubstructuringResult) -> Table:
    """Springs and dampers, whether the data tell them first."""
    rows = tuple(
        (
            " – ".join(pair),
            found.form,
            "yes" if spring.tells_stiffness else "no",
            f"{spring.stiffness:.5g}",
            f"± {spring.stiffness_interval:.2g}",
            "yes" if spring.tells_damping else "no",
            f"{spring.damping:.4g}",
            f"± {spring.damping_interval:.2g}",
            f"{spring.residual:.2g}",
        )
        for found in result.identified
        for pair, spring in zip(found.joint.at, found.springs, strict=True)
    )
    headings = (
        "joint", "form", "k told", "k, N/m", "95 %", "c told", "c, N s/m", "95 %", "misfit/spread",
    )  # fmt: skip
    return Table(headings, rows, frozenset({3, 4, 6, 7, 8}))


def condition_words(result: SubstructuringResult) -> tuple[str, str]:
    """The largest condition, and where it is."""
    assert result.condition is not None
    worst = int(np.argmax(result.condition))
    return f"{result.condition[worst]:.2g}", f"at {result.frequency[worst]:.6g} Hz"
