"""Poles by three routes: exudyn's eigensolution, the equations' modes, and FBS' coupled FRFs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fbs import RealModes, real_modes
from fbs.damped_modes import is_proportional, modal_damping
from mbs_models.mode_kinds import Modes, mode_groups

from .diagnosis import MAX_FINDINGS
from .metrics import subspace_mac
from .modes import damped_modes
from .poles import FilteredPole, filtered_poles
from .results import Check, PoleRow
from .routes import Model, couple_stages

FloatArray = NDArray[np.float64]

POLE_TOLERANCE = 1e-6
POLE_REASON = (
    "relative; where the eigensolution's own round-off (eps × largest λ) is larger, that, as "
    "listed for each mode"
)
MAC_TOLERANCE = 1e-6


def pole_checks(
    model: Model, witness: Model, modes: Modes
) -> tuple[list[Check], tuple[PoleRow, ...]]:
    """exudyn's eigensolution against the equations' modes and the poles FBS' FRFs have."""
    names, filtered = [witness.source], {}
    own = real_modes(model.whole)
    if is_proportional(modal_damping(own, model.whole.damping)):
        names.append(f"FBS of {model.source} stages")
        filtered = _fbs_poles(model, own)
    rows = _pole_rows(model, witness, modes, filtered)
    checks = [check for name in names for check in _pole_checks_of(model.source, name, rows)]
    return checks, tuple(rows)


def _fbs_poles(model: Model, modes: RealModes) -> dict[int, FilteredPole]:
    """Poles of the coupled FRFs by mode; the damping must be proportional."""
    dofs = model.whole.dofs
    groups = mode_groups(modes.natural_frequencies, modes.n_rigid)
    found = filtered_poles(
        lambda f: couple_stages(model, f).frf.select(dofs, dofs).values,
        model.whole.mass,
        [(modes.natural_frequencies[g[0]], modes.shapes[:, g]) for g in groups],
    )
    return dict(zip((mode for group in groups for mode in group), found, strict=True))


def _pole_rows(
    model: Model, witness: Model, modes: Modes, filtered: dict[int, FilteredPole]
) -> list[PoleRow]:
    real = real_modes(witness.whole)
    frequencies, ratios = damped_modes(witness.whole, real)
    shapes = modes.shapes[[modes.labels.index(dof) for dof in real.dofs]]
    groups = mode_groups(real.natural_frequencies, real.n_rigid)
    macs = _eigensolution_macs(shapes, real, groups, witness.whole.mass)
    ours, theirs, fbs = model.source, witness.source, f"FBS of {model.source} stages"
    rows = []
    for number, mode in enumerate(modes.modes):
        frequency = {ours: mode.frequency_hz, theirs: float(frequencies[number])}
        damping = {ours: mode.damping_ratio, theirs: float(ratios[number])}
        mac = {theirs: macs[number]}
        if number in filtered:  # a rigid-body motion is no pole that an FRF could be filtered for
            frequency[fbs] = filtered[number].frequency_hz
            damping[fbs] = filtered[number].damping_ratio
            mac[fbs] = filtered[number].subspace_mac
        rows.append(PoleRow(mode.kind, frequency, damping, mac, mode.round_off_hz))
    return rows


def _eigensolution_macs(
    shapes: NDArray[np.float64], real: RealModes, groups: list[list[int]], mass: FloatArray
) -> dict[int, float]:
    rigid = [list(range(real.n_rigid))] if real.n_rigid else []
    return {
        mode: subspace_mac(shapes[:, group], real.shapes[:, group], mass)
        for group in rigid + groups
        for mode in group
    }


def _pole_checks_of(reference: str, route: str, rows: Sequence[PoleRow]) -> list[Check]:
    compared = [row for row in rows if route in row.frequency_hz]
    subject, routes = "whole drivetrain", (reference, route)
    frequency = [_frequency_error(row, reference, route) for row in compared]
    damping = [_damping_error(row, reference, route) for row in compared]
    shape = [1.0 - row.subspace_mac[route] for row in compared]

    def found(errors: Sequence[float], allowed: float, value: str) -> tuple[str, ...]:
        odd = [row for row, error in zip(compared, errors, strict=True) if not error <= allowed]
        return tuple(_in_words(row, reference, route, value) for row in odd[:MAX_FINDINGS])

    return [
        Check(
            "Natural frequencies", subject, routes, "largest difference / what is allowed",
            max(frequency), 1.0, f"{POLE_TOLERANCE:g} {POLE_REASON}",
            found(frequency, 1.0, "frequency_hz"),
        ),
        Check(
            "Damping ratios", subject, routes, "largest difference / what is allowed",
            max(damping), 1.0,
            f"{POLE_TOLERANCE:g} of critical damping (of ζ where ζ > 1), or the frequency's own "
            "round-off",
            found(damping, 1.0, "damping_ratio"),
        ),
        Check(
            "Mode shapes", subject, routes, "1 − smallest subspace MAC", max(shape), MAC_TOLERANCE,
            "shapes of a group are known to round-off over its distance from the next group; its "
            "square is compared",
            found(shape, MAC_TOLERANCE, "subspace_mac"),
        ),
    ]  # fmt: skip


def _allowed(row: PoleRow, reference: str) -> float:
    """What a relative difference may be: more only where the eigensolution's round-off is."""
    return max(POLE_TOLERANCE, row.round_off_hz / row.frequency_hz[reference])


def _frequency_error(row: PoleRow, reference: str, route: str) -> float:
    ours, theirs = row.frequency_hz[reference], row.frequency_hz[route]
    if ours == 0.0:  # a rigid-body mode here must be one there
        return theirs / row.round_off_hz
    return abs(theirs - ours) / ours / _allowed(row, reference)


def _damping_error(row: PoleRow, reference: str, route: str) -> float:
    ours, theirs = row.damping_ratio[reference], row.damping_ratio[route]
    if row.frequency_hz[reference] == 0.0:
        return 0.0
    return abs(theirs - ours) / max(ours, 1.0) / _allowed(row, reference)


def _in_words(row: PoleRow, reference: str, route: str, value: str) -> str:
    where = f"{row.kind} mode at {row.frequency_hz[reference]:.6g} Hz"
    if value == "subspace_mac":
        return f"{where}: 1 − MAC = {1.0 - row.subspace_mac[route]:.1e} by {route}"
    name, unit = ("", " Hz") if value == "frequency_hz" else (" damping ratio", "")
    by_route = getattr(row, value)
    return f"{where}:{name} {by_route[reference]:.6g}{unit} against {by_route[route]:.6g}{unit}"
