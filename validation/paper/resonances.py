"""Natural frequencies to mark in a figure: kind, multiplicity, and whether an FRF sees them."""

from __future__ import annotations

import numpy as np

from fbs import RealModes
from mbs_models.modal.mode_kinds import (
    FAMILY_SHARE,
    Kind,
    family_bases,
    label_inertias,
    mode_groups,
)

from ..arrays import FloatArray
from .bench import Bench
from .case import PaperCase
from .item import Resonance

SEEN = 1e-12
"""√(m_i m_j)|φ_i φ_j| of a mode an FRF does not see is round-off, below this."""

HUB_SHARE = 0.5
"""A mode with most of its kinetic energy in the hub is the hub's (the paper's coupling mode)."""

HUB_KIND = "hub"


def resonances(
    bench: Bench,
    part: str,
    shaft: float | None,
    pair: tuple[str, str],
    end_hz: float,
    name: str,
) -> tuple[Resonance, ...]:
    """Elastic natural frequencies of the whole (``part`` empty) or of a stage, up to ``end_hz``.

    Parameters
    ----------
    bench, part, shaft
        Which system.
    pair
        Response and excitation of the FRF that may see them.
    end_hz
        Upper end of the band.
    name
        What the figure calls the system.
    """
    modes = bench.modes(part, shaft)
    kinds = bench.once(mode_kinds, part, shaft)
    inertias = label_inertias(bench.case.drivetrain)
    rows = [modes.dofs.index(label) for label in pair]
    weight = np.sqrt(inertias[pair[0]] * inertias[pair[1]])
    marks = []
    for group in repeated(modes):
        frequency = float(modes.natural_frequencies[group[0]])
        if frequency <= end_hz:
            residue = float(np.abs(modes.shapes[rows[0], group] @ modes.shapes[rows[1], group]))
            seen = bool(weight * residue > SEEN)
            marks.append(Resonance(name, frequency, len(group), kinds[group[0]], seen))
    return tuple(marks)


def repeated(modes: RealModes) -> list[list[int]]:
    """Elastic modes in groups of equal frequency."""
    return mode_groups(modes.natural_frequencies, modes.n_rigid)


def mode_kinds(bench: Bench, part: str, shaft: float | None = None) -> list[str]:
    """The kind of every mode of the whole, or of one stage with its half hub."""
    case, modes = bench.case, bench.modes(part, shaft)
    if not part:
        return _kinds_of_whole(bench.with_shaft(shaft))
    energy, mass = kinetic_energy(case, modes), _masses(case, modes)
    hub = modes.dofs.index(case.hub)
    kinds: list[str] = [Kind.RIGID_BODY] * modes.n_rigid
    for mode in range(modes.n_rigid, modes.shapes.shape[1]):
        if energy[hub, mode] > HUB_SHARE:
            kinds.append(HUB_KIND)
        elif part == case.a:
            kinds.append(Kind.PARALLEL_STAGE)
        else:
            kinds.append(_family(case, modes, mode, np.sqrt(mass)))
    return kinds


def kinetic_energy(case: PaperCase, modes: RealModes) -> FloatArray:
    """(n_dof, n_mode) share of each DoF of a stage in each mode's kinetic energy."""
    energy = _masses(case, modes)[:, None] * modes.shapes**2
    shares: FloatArray = energy / energy.sum(axis=0)
    return shares


def _masses(case: PaperCase, modes: RealModes) -> FloatArray:
    """(n_dof,) kg of a stage with its half hub."""
    inertias = label_inertias(case.drivetrain)
    mass = np.array([inertias[label] for label in modes.dofs])
    mass[modes.dofs.index(case.hub)] /= 2.0
    return mass


def _kinds_of_whole(case: PaperCase) -> list[str]:
    return [mode.kind for mode in case.exudyn.modes.modes]


def _family(case: PaperCase, modes: RealModes, mode: int, root: FloatArray) -> str:
    """The family that holds a planetary mode's kinetic energy."""
    weighted = root * modes.shapes[:, mode]
    total = float(np.sum(weighted**2)) - float(weighted[modes.dofs.index(case.hub)] ** 2)
    planets = total
    for family, (labels, basis) in family_bases(case.planetary.planet_set).items():
        inside = weighted[[modes.dofs.index(label) for label in labels]]
        energy = float(np.sum((basis.T @ inside) ** 2))
        if energy >= FAMILY_SHARE * total:
            return Kind(family)
        planets -= energy
    return Kind.PLANET if planets >= FAMILY_SHARE * total else Kind.MIXED
