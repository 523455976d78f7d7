"""M, C and K by two routes, entry by entry, and the stages put together."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from fbs import SecondOrderSystem

from ..routes.source import Source
from .check import Check, or_failed
from .diagnosis import describe, differing_entries

ENTRIES, TOGETHER = "entry by entry", "stages put together"
MATRIX_TOLERANCE = 1e-12
MATRIX_REASON = (
    "both are sums of the same few springs in double precision; geometry and equations differ by "
    "the rounding of sines and positions, 1e-15 here"
)


def matrix_checks(reference: Source, other: Source) -> list[Check]:
    """Two sources' matrices, of the whole and of every stage."""
    routes = (reference.name, other.name)
    found = _compared(ENTRIES, "whole drivetrain", routes, lambda: (reference.whole, other.whole))
    for part in reference.drivetrain.parts:
        found += _compared(
            ENTRIES, f"part {part.name}", routes, partial(_stages, reference, other, part.name)
        )
    return found


def _stages(
    reference: Source, other: Source, name: str
) -> tuple[SecondOrderSystem, SecondOrderSystem]:
    return reference.stage(name), other.stage(name)


def assembly_checks(*sources: Source) -> list[Check]:
    """The stages' matrices put together, against the whole's: nothing lost in the split."""
    found = []
    for source in sources:
        if source.drivetrain.couplings:
            routes = (sources[0].name, f"{source.name} stages")
            both = partial(_assembly, sources[0], source)
            found += _compared(TOGETHER, "whole drivetrain", routes, both)
    return found


def _assembly(reference: Source, source: Source) -> tuple[SecondOrderSystem, SecondOrderSystem]:
    return reference.whole, assembled(source)


def assembled(source: Source) -> SecondOrderSystem:
    """The parts' matrices and their flexible joints, added up over the labels: what FBS must equal.

    Only independent DoFs are added; a hub welded to bodies is the derived label of one stage's DoF
    and of another's, which the whole's own reduction joins.
    """
    whole = source.whole
    size = len(whole.dofs)
    mass, damping, stiffness = (np.zeros((size, size)) for _ in range(3))
    for stage in source.stages.values():
        index, factor = whole.locate(stage.dofs)
        spread = np.zeros((size, len(stage.dofs)))
        spread[index, np.arange(len(stage.dofs))] = factor
        mass += spread @ stage.mass @ spread.T
        damping += spread @ stage.damping @ spread.T
        stiffness += spread @ stage.stiffness @ spread.T
    for joint in source.joints:
        if joint.stiffness is not None:
            index, factor = whole.locate([joint.first[1], joint.second[1]])
            v = np.zeros(size)
            np.add.at(v, index, factor * np.array([1.0, -joint.ratio]))
            k, c = joint.spring
            damping += c * np.outer(v, v)
            stiffness += k * np.outer(v, v)
    return SecondOrderSystem(mass, damping, stiffness, whole.dofs)


def _compared(
    name: str,
    subject: str,
    routes: tuple[str, str],
    systems: Callable[[], tuple[SecondOrderSystem, SecondOrderSystem]],
) -> list[Check]:
    """Two systems against each other, or that the second cannot be built."""
    return or_failed(
        f"M, C, K {name}", subject, routes,
        lambda: _compare_systems(name, subject, routes, *systems()),
    )  # fmt: skip


def _compare_systems(
    name: str,
    subject: str,
    routes: tuple[str, str],
    ours: SecondOrderSystem,
    theirs: SecondOrderSystem,
) -> list[Check]:
    if set(ours.dofs) != set(theirs.dofs):
        single = sorted(set(ours.dofs) ^ set(theirs.dofs))
        finding = f"these DoFs are in one of the two only: {', '.join(single)}"
        return [
            Check(
                f"M, C, K {name}", subject, routes, "DoFs in one route only",
                float(len(single)), 0.0, "the routes describe the same DoFs", (finding,),
            )
        ]  # fmt: skip
    order = [theirs.dofs.index(dof) for dof in ours.dofs]
    checks = []
    for matrix in ("mass", "damping", "stiffness"):
        reference = getattr(ours, matrix)
        other = getattr(theirs, matrix)[np.ix_(order, order)]
        largest = float(np.abs(reference).max())
        if largest == 0.0 and not other.any():
            continue  # an undamped drivetrain has no C to compare
        # The largest entry rules (10 kg against a hub of 1e-8 kg would hide half a hub), so mass
        # and damping are held against each entry's own DoFs as well.
        scale = np.sqrt(np.outer(np.diag(reference), np.diag(reference)))
        own = np.divide(np.abs(other - reference), scale, out=np.zeros_like(scale), where=scale > 0)
        value = max(float(np.abs(other - reference).max()) / max(largest, 1e-300), float(own.max()))
        findings: tuple[str, ...] = ()
        if value > MATRIX_TOLERANCE:
            found = differing_entries(matrix, reference, other, ours.dofs, MATRIX_TOLERANCE * scale)
            findings = describe(found)
        checks.append(
            Check(
                f"{matrix.capitalize()} matrix, {name}", subject, routes,
                "largest difference, relative",
                value, MATRIX_TOLERANCE, MATRIX_REASON, findings,
            )
        )  # fmt: skip
    return checks
