"""All FRFs of every route against the reference's, a block of lines at a time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fbs import SecondOrderSystem, real_modes
from mbs_models.modal.mode_kinds import rigid_body_count, scaled_singular_values

from ..routes.routes import Model, Route, kernel_condition
from .check import Check
from .diagnosis import in_words, locate
from .metrics import frac, scaled_error

FloatArray = NDArray[np.float64]
Progress = Callable[[str, int, int], None]
Curves = dict[tuple[str, str], dict[str, NDArray[np.complex128]]]

LINES_PER_BLOCK = 500  # 7 MB per route at 30 DoFs: memory does not grow with the band
FRF_TOLERANCE = 1e-8
FRF_REASON = (
    "two solutions of the same system differ by round-off times its conditioning; a model error "
    "of 1e-6 in one spring already shows"
)
MEDIAN_TOLERANCE = 1e-12
MEDIAN_REASON = (
    "half of the lines are far from any pole, where nothing amplifies round-off (where the band "
    "leaves no such lines: the median of what rounding the stiffness explains)"
)
MODAL_REASON = (
    "each mode's frequency carries eps × the condition of the scaled stiffness, which is allowed "
    "on top of the direct solve's 1e-12"
)


@dataclass
class _Tally:
    """Running statistics of one route over blocks of lines."""

    line_max: list[FloatArray] = field(default_factory=list)
    line_median: list[FloatArray] = field(default_factory=list)
    pair_max: FloatArray | None = None
    worst: tuple[float, str, str] = (0.0, "", "")
    worst_value: float = -1.0

    def add(self, frequency: FloatArray, error: FloatArray, dofs: Sequence[str]) -> None:
        flat = error.reshape(len(error), -1)
        self.line_max.append(flat.max(axis=1))
        self.line_median.append(np.median(flat, axis=1))
        block = error.max(axis=0)
        self.pair_max = block if self.pair_max is None else np.maximum(self.pair_max, block)
        line, i, j = np.unravel_index(int(np.argmax(error)), error.shape)
        if not error[line, i, j] <= self.worst_value:
            self.worst_value = float(error[line, i, j])
            self.worst = (float(frequency[line]), dofs[int(i)], dofs[int(j)])


def compare_frfs(
    model: Model,
    reference: Route,
    routes: Sequence[Route],
    dofs: tuple[str, ...],
    pairs: Sequence[tuple[str, str]],
    frequency: FloatArray,
    report: Progress,
) -> tuple[tuple[FrfComparison, ...], Curves, FloatArray]:
    """Compare every route with the reference over the band.

    Parameters
    ----------
    model
        Whose stages' kernel is reported.
    reference, routes
        What is compared with what.
    dofs
        Labels: all FRFs between them are compared.
    pairs
        (response, excitation) of the curves to keep.
    frequency
        (n_frequency,) Hz.
    report
        Progress, in lines.

    Returns
    -------
    comparisons, curves, kernel_condition
        As in `CrossCheck`.
    """
    tallies = {route.name: _Tally() for route in routes}
    pieces: dict[tuple[str, str], dict[str, list[NDArray[np.complex128]]]] = {
        pair: {route.name: [] for route in (reference, *routes)} for pair in pairs
    }
    kernel: list[FloatArray] = []
    for start in range(0, len(frequency), LINES_PER_BLOCK):
        report("comparing FRFs", start, len(frequency))
        lines = frequency[start : start + LINES_PER_BLOCK]
        ours = reference.frf(lines).select(dofs, dofs)
        for route in (reference, *routes):
            frf = ours if route is reference else route.frf(lines).select(dofs, dofs)
            if route is not reference:
                tallies[route.name].add(lines, scaled_error(ours.values, frf.values), dofs)
            for pair in pairs:
                pieces[pair][route.name].append(frf.between(*pair).copy())
        if model.joints:
            kernel.append(kernel_condition(model, lines))
    report("comparing FRFs", len(frequency), len(frequency))
    curves = {
        pair: {name: np.concatenate(parts) for name, parts in by_route.items()}
        for pair, by_route in pieces.items()
    }
    comparisons = tuple(
        _summary(route, tallies[route.name], curves, reference.name) for route in routes
    )
    return comparisons, curves, np.concatenate(kernel) if kernel else np.empty(0)


def _summary(
    route: Route,
    tally: _Tally,
    curves: Curves,
    reference: str,
) -> FrfComparison:
    assert tally.pair_max is not None
    fracs = [
        (frac(by_route[reference], by_route[route.name]), f"{response} ← {excitation}")
        for (response, excitation), by_route in curves.items()
    ]
    return FrfComparison(
        route=route.name,
        line_max=np.concatenate(tally.line_max),
        line_median=np.concatenate(tally.line_median),
        pair_max=tally.pair_max,
        worst=tally.worst,
        frac=min(fracs),
    )


def round_off_floor(system: SecondOrderSystem, frequency: FloatArray) -> FloatArray:
    """Scaled error that rounding K alone can cause: max_r eps |φ|ᵀ|K||φ| / |λ_r − ω² + jωγ_r|.

    An undamped pole, and 0 Hz of a free system, amplify the last digit of K without limit; this
    is by how much.
    """
    modes = real_modes(system)
    shapes = np.abs(modes.shapes)
    spread = np.einsum("im,ij,jm->m", shapes, np.abs(system.stiffness), shapes)
    decay = np.einsum("im,ij,jm->m", modes.shapes, system.damping, modes.shapes)
    omega = 2.0 * np.pi * frequency[:, None]
    distance = np.abs(modes.angular_frequency**2 - omega**2 + 1j * omega * decay)
    floor: FloatArray = np.max(np.finfo(float).eps * spread / distance, axis=1)
    return floor


def frf_checks(
    comparison: FrfComparison,
    reference: Route,
    route: Route,
    floor: FloatArray,
    frequency: FloatArray,
    system: SecondOrderSystem,
) -> list[Check]:
    """Verdicts on one route's FRFs: the worst line, and the median line.

    Where a line exceeds its tolerance, both FRFs' own bound of their round-off counts.
    """
    allowed = np.maximum(FRF_TOLERANCE, floor)
    excess = comparison.line_max / allowed
    doubtful = np.flatnonzero(~(excess <= 1.0))
    worst = int(np.argmax(excess))
    if doubtful.size and comparison.line_max[worst] <= line_round_off(
        reference, route, frequency[[worst]]
    ):  # else the others do not matter any more
        own = line_round_off(reference, route, frequency[doubtful])
        allowed[doubtful] = np.maximum(allowed[doubtful], own)
    excess = comparison.line_max / allowed
    worst = int(np.argmax(excess))
    findings: tuple[str, ...] = ()
    if not excess[worst] <= 1.0:
        findings = _frf_findings(comparison, reference, route, frequency, system)
    raised = int(np.sum(floor > FRF_TOLERANCE))
    note = (
        f"{raised} lines lie so close to an undamped pole (or to 0 Hz) that round-off alone may "
        f"exceed {FRF_TOLERANCE:g}; each is judged by its own round-off"
        if raised
        else ""
    )
    routes = (reference.name, route.name)
    every = f"all {len(comparison.pair_max) ** 2} FRFs"
    median, median_allowed = float(np.median(comparison.line_max)), MEDIAN_TOLERANCE
    median_allowed = max(median_allowed, float(np.median(floor)))
    if route.modal:
        median_allowed += np.finfo(float).eps * scaled_condition(system.stiffness)
    if not median <= median_allowed:
        own = line_round_off(reference, route, _spread_lines(frequency))
        median_allowed = max(median_allowed, float(np.median(own)))
    off = (
        () if median <= median_allowed else (f"half of all lines are off by {median:.1e} or more",)
    )
    return [
        Check(
            "FRFs, worst line", every, routes, "largest scaled error",
            float(comparison.line_max[worst]), float(allowed[worst]), FRF_REASON, findings, note,
        ),
        Check(
            "FRFs, median line", every, routes, "median over lines of the largest scaled error",
            median, median_allowed, MODAL_REASON if route.modal else MEDIAN_REASON, off,
        ),
    ]  # fmt: skip


def line_round_off(reference: Route, route: Route, frequency: FloatArray) -> FloatArray:
    """Largest scaled error, by line, that the bounds of two routes' round-off leave room for.

    Zero where that is one or more: round-off that may be anything explains nothing.
    """
    ours = reference.frf(frequency)
    theirs = route.frf(frequency).select(ours.responses, ours.excitations)
    error = scaled_error(ours.values, ours.values + ours.round_off + theirs.round_off)
    largest = error.reshape(len(error), -1).max(axis=1)
    return np.where(largest < 1.0, largest, 0.0)


def scaled_condition(stiffness: FloatArray) -> float:
    """Largest over smallest non-zero singular value of K scaled to a unit diagonal."""
    values = scaled_singular_values(stiffness)
    return float(values[0] / values[len(values) - rigid_body_count(stiffness) - 1])


def _frf_findings(
    comparison: FrfComparison,
    reference: Route,
    route: Route,
    frequency: FloatArray,
    system: SecondOrderSystem,
) -> tuple[str, ...]:
    at, response, excitation = comparison.worst
    worst = f"largest at {at:g} Hz: response {response}, excitation {excitation}"
    lines = _spread_lines(frequency)
    dofs = system.dofs
    ours, theirs = (r.frf(lines).select(dofs, dofs).values for r in (reference, route))
    return (worst, *in_words(locate(lines, ours, theirs, dofs)))


def _spread_lines(frequency: FloatArray, count: int = 24) -> FloatArray:
    picks = np.unique(np.linspace(0, len(frequency) - 1, count).round().astype(int))
    lines: FloatArray = frequency[picks]
    return lines


@dataclass(frozen=True)
class FrfComparison:
    """All FRFs of a route against the reference's.

    Attributes
    ----------
    route
        The route compared.
    line_max, line_median
        (n_frequency,) largest and median scaled error over all FRFs, by line.
    pair_max
        (n_dof, n_dof) largest scaled error over all lines, by response and excitation.
    worst
        Frequency (Hz), response and excitation of the largest scaled error.
    frac
        Smallest FRAC of the report's curves, and the curve it belongs to.
    """

    route: str
    line_max: FloatArray
    line_median: FloatArray
    pair_max: FloatArray
    worst: tuple[float, str, str]
    frac: tuple[float, str]
