"""Poles by three routes: exudyn's eigensolution, the equations' modes, and FBS' coupled FRFs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fbs import RealModes, real_modes
from fbs.damped_modes import is_proportional, modal_damping
from mbs_models.modal.mode_kinds import Kind, Modes, mode_groups

from ..arrays import FloatArray
from ..routes.modes import damped_modes
from ..routes.routes import fbs_route
from ..routes.source import Source
from .check import ROUTE_ERRORS, Check, failed
from .diagnosis import MAX_FINDINGS
from .metrics import subspace_mac
from .poles import FilteredPole, filtered_poles

WHOLE = "whole drivetrain"
POLE_TOLERANCE = 1e-6
POLE_REASON = (
    "relative; where the eigensolution's own round-off (eps × largest λ) is larger, that, as "
    "listed for each mode"
)
MAC_TOLERANCE = 1e-6
MAC_REASON = (
    "; where that is larger, (δ/(g − δ))²: the eigensolution's round-off δ turns the shapes of a "
    "group by no more than δ/(g − δ), g its distance from the next ω²"
)
# What round-off leaves less known than this is not judged: whatever is found there would agree, or
# disagree, by chance. A tenth of a frequency; shapes of MAC < 0.9 count as different modes.
KNOWN = 0.1


@dataclass(frozen=True)
class PoleChecks:
    """Verdicts on poles, the poles themselves, and what no verdict can be given on."""

    checks: list[Check]
    rows: tuple[PoleRow, ...]
    warnings: tuple[str, ...]


def pole_checks(reference: Source, other: Source, modes: Modes) -> PoleChecks:
    """exudyn's eigensolution against the equations' modes and the poles FBS' FRFs have."""
    from mbs_models.modal.modes import eigenvalue_error  # exudyn takes its time to load

    fbs = f"FBS of {reference.name} stages"
    names, filtered = [other.name], {}
    checks: list[Check] = []
    own = real_modes(reference.whole)
    if is_proportional(modal_damping(own, reference.whole.damping)):
        try:
            filtered = _fbs_poles(reference, own)
            names.append(fbs)
        except ROUTE_ERRORS as error:
            checks.append(failed("Poles", WHOLE, (reference.name, fbs), error))
    try:
        rows = _pole_rows(reference, other, modes, filtered)
        exact = real_modes(other.whole)
    except ROUTE_ERRORS as error:
        checks.append(failed("Poles", WHOLE, (reference.name, other.name), error))
        names.remove(other.name)
        rows, exact = _pole_rows(reference, None, modes, filtered), own
    # A filter's shapes are not the eigensolution's: no round-off of it is in them.
    allowed = {name: [MAC_TOLERANCE] * len(rows) for name in names}
    allowed[other.name] = allowed_mac_defects(exact, eigenvalue_error(modes))
    for name in names:
        checks += _pole_checks_of(reference.name, name, rows, allowed[name])
    unjudged = _unjudged(reference.name, rows, allowed[other.name])
    return PoleChecks(checks, tuple(rows), unjudged)


def allowed_mac_defects(exact: RealModes, eigenvalue_error: float) -> list[float]:
    """What 1 − MAC of each mode's group may be: (δ/(g − δ))², or `MAC_TOLERANCE` if larger.

    A symmetric eigenproblem solved to a backward error of norm δ turns a group's subspace by
    sin θ ≤ δ/(g − δ), g the distance of its exact eigenvalues ω² from all others, which the
    computed ones come nearer by no more than δ (Davis & Kahan 1970, sin θ theorem; Weyl), and
    1 − MAC = sin² θ. At g ≤ 2δ the shape may be any.

    Parameters
    ----------
    exact
        Modes without that error.
    eigenvalue_error
        δ, (rad/s)².
    """
    eigenvalues = exact.angular_frequency**2
    rigid = [list(range(exact.n_rigid))] if exact.n_rigid else []
    allowed = np.empty(len(eigenvalues))
    for group in rigid + mode_groups(exact.natural_frequencies, exact.n_rigid):
        others = np.delete(eigenvalues, group)
        gap = np.abs(others[:, None] - eigenvalues[group]).min(initial=np.inf)
        sine = eigenvalue_error / (gap - eigenvalue_error) if gap > 2.0 * eigenvalue_error else 1.0
        allowed[group] = max(MAC_TOLERANCE, sine**2)
    return [float(value) for value in allowed]


def _unjudged(
    reference: str, rows: Sequence[PoleRow], allowed_macs: Sequence[float]
) -> tuple[str, ...]:
    """Which frequencies and shapes the eigensolver's round-off leaves open."""
    frequencies = [n for n, row in enumerate(rows, 1) if not _known(row, reference)]
    shapes = [n for n, allowed in enumerate(allowed_macs, 1) if allowed > KNOWN]
    told = []
    if frequencies:
        told.append(f"natural frequencies of {_numbers(frequencies)}")
    if shapes:
        told.append(f"mode shapes of {_numbers(shapes)}")
    if not told:
        return ()
    return (
        f"{' and '.join(told)} are not compared: the round-off of {reference}'s eigensolution "
        "leaves them unknown (poles of FBS' FRFs and the matrices are compared without it)",
    )


def _numbers(modes: Sequence[int]) -> str:
    """``modes 1–3 and 7``."""
    runs: list[list[int]] = []
    for mode in modes:
        if runs and mode == runs[-1][1] + 1:
            runs[-1][1] = mode
        else:
            runs.append([mode, mode])
    told = [f"{a}" if a == b else f"{a}–{b}" for a, b in runs]
    listed = " and ".join([", ".join(told[:-1]), told[-1]] if len(told) > 1 else told)
    return f"mode{'s' if len(modes) > 1 else ''} {listed}"


def _fbs_poles(source: Source, modes: RealModes) -> dict[int, FilteredPole]:
    """Poles of the coupled FRFs by mode; the damping must be proportional."""
    dofs, route = source.whole.dofs, fbs_route(source)
    groups = mode_groups(modes.natural_frequencies, modes.n_rigid)
    found = filtered_poles(
        lambda lines: route.frf(lines, dofs, dofs).values,
        source.whole.mass,
        [(modes.natural_frequencies[g[0]], modes.shapes[:, g]) for g in groups],
    )
    return dict(zip((mode for group in groups for mode in group), found, strict=True))


def _pole_rows(
    reference: Source, other: Source | None, modes: Modes, filtered: dict[int, FilteredPole]
) -> list[PoleRow]:
    ours, fbs = reference.name, f"FBS of {reference.name} stages"
    theirs = None if other is None else _eigensolution(other, modes)
    rows = []
    for number, mode in enumerate(modes.modes):
        frequency, damping = {ours: mode.frequency_hz}, {ours: mode.damping_ratio}
        mac: dict[str, float] = {}
        if other is not None and theirs is not None:
            by_mode = (found[number] for found in theirs)
            frequency[other.name], damping[other.name], mac[other.name] = map(float, by_mode)
        if number in filtered:  # a rigid-body motion is no pole that an FRF could be filtered for
            frequency[fbs] = filtered[number].frequency_hz
            damping[fbs] = filtered[number].damping_ratio
            mac[fbs] = filtered[number].subspace_mac
        rows.append(PoleRow(mode.kind, frequency, damping, mac, mode.round_off_hz))
    return rows


def _eigensolution(other: Source, modes: Modes) -> tuple[FloatArray, FloatArray, dict[int, float]]:
    """Frequencies (Hz), damping ratios and MACs with the reference's modes, by mode."""
    real = real_modes(other.whole)
    frequencies, ratios = damped_modes(other.whole, real)
    shapes = modes.shapes[[modes.labels.index(dof) for dof in real.dofs]]
    groups = mode_groups(real.natural_frequencies, real.n_rigid)
    macs = _eigensolution_macs(shapes, real, groups, other.whole.mass)
    return frequencies, ratios, macs


def _eigensolution_macs(
    shapes: NDArray[np.float64], real: RealModes, groups: list[list[int]], mass: FloatArray
) -> dict[int, float]:
    rigid = [list(range(real.n_rigid))] if real.n_rigid else []
    return {
        mode: subspace_mac(shapes[:, group], real.shapes[:, group], mass)
        for group in rigid + groups
        for mode in group
    }


def _pole_checks_of(
    reference: str, route: str, rows: Sequence[PoleRow], allowed_macs: Sequence[float]
) -> list[Check]:
    subject, routes = WHOLE, (reference, route)
    known = [row for row in rows if route in row.frequency_hz and _known(row, reference)]
    frequency = [_frequency_error(row, reference, route) for row in known]
    damping = [_damping_error(row, reference, route) for row in known]
    shaped = [
        (row, allowed)
        for row, allowed in zip(rows, allowed_macs, strict=True)
        if route in row.subspace_mac and allowed <= KNOWN
    ]
    shape = [(1.0 - row.subspace_mac[route]) / allowed for row, allowed in shaped]
    like = [row for row, _ in shaped]

    def found(judged: Sequence[PoleRow], errors: Sequence[float], value: str) -> tuple[str, ...]:
        odd = [row for row, error in zip(judged, errors, strict=True) if not error <= 1.0]
        return tuple(_in_words(row, reference, route, value) for row in odd[:MAX_FINDINGS])

    def note(judged: Sequence[PoleRow]) -> str:
        count = sum(route in row.frequency_hz for row in rows)
        return f"{len(judged)} of {count} modes compared" if len(judged) < count else ""

    found_checks = [
        Check(
            "Natural frequencies", subject, routes, "largest difference / what is allowed",
            max(frequency, default=0.0), 1.0, f"{POLE_TOLERANCE:g} {POLE_REASON}",
            found(known, frequency, "frequency_hz"), note(known),
        ),
        Check(
            "Damping ratios", subject, routes, "largest difference / what is allowed",
            max(damping, default=0.0), 1.0,
            f"{POLE_TOLERANCE:g} of critical damping (of ζ where ζ > 1), or the frequency's own "
            "round-off",
            found(known, damping, "damping_ratio"), note(known),
        ),
        Check(
            "Mode shapes", subject, routes, "largest 1 − MAC of subspaces / what is allowed",
            max(shape, default=0.0), 1.0, f"{MAC_TOLERANCE:g} {MAC_REASON}",
            found(like, shape, "subspace_mac"), note(like),
        ),
    ]  # fmt: skip
    judged = (known, known, like)  # what nothing is judged of is no agreement
    return [check for check, rows in zip(found_checks, judged, strict=True) if rows]


def _known(row: PoleRow, reference: str) -> bool:
    """Whether round-off leaves enough of a frequency to compare; zero is known by K's rank."""
    return row.kind == Kind.RIGID_BODY or _allowed(row, reference) <= KNOWN


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


@dataclass(frozen=True)
class PoleRow:
    """One pole by three routes: exudyn's eigensolution, the equations, and FBS' coupled FRFs."""

    kind: str
    frequency_hz: Mapping[str, float]
    damping_ratio: Mapping[str, float]
    subspace_mac: Mapping[str, float]
    round_off_hz: float
