"""All FRFs of every route against the reference's, a block of lines at a time."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from fbs import Frf, SecondOrderSystem, SingularLineError, real_modes
from mbs_models.modal.mode_kinds import rigid_body_count, scaled_singular_values

from ..arrays import ComplexArray, FloatArray
from ..routes.routes import MatrixRoute, Route, kernel_condition
from ..routes.source import Source
from ..runtime.progress import Progress
from .check import ROUTE_ERRORS, Check
from .metrics import error_scale, frac, row_norms, squared_errors
from .tracing import NO_CHANGE, single_lines, traced

Pair = tuple[str, str]

VALUES_PER_BLOCK = 2**19  # 8 MB a route and thread: memory does not grow with the band
THREADS = 4  # at most: so many blocks are held at once
MOST_LINES = 5  # that a finding names
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


@dataclass(frozen=True)
class Candidate:
    """A route to compare, and the labels between which it has FRFs."""

    route: MatrixRoute
    responses: tuple[str, ...]
    excitations: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class FrfComparison:
    """All FRFs of a route against the reference's.

    Attributes
    ----------
    route
        The route compared.
    line_max, line_median
        (n_frequency,) largest and median scaled error over all FRFs, by line.
    pair_max
        (n_response, n_excitation) largest scaled error over all lines.
    worst
        Frequency (Hz), response and excitation of the largest scaled error.
    frac
        Smallest FRAC of the curves kept, and the curve it belongs to.
    failure
        Why the route cannot be computed; empty: it can. Its errors are NaN then.
    """

    route: str
    line_max: FloatArray
    line_median: FloatArray
    pair_max: FloatArray
    worst: tuple[float, str, str]
    frac: tuple[float, str]
    failure: str = ""

    @property
    def largest(self) -> float:
        """Largest scaled error, infinite where it is not a number."""
        return float(np.nan_to_num(self.line_max, nan=np.inf).max())


@dataclass(frozen=True, eq=False)
class FrfComparisons:
    """What `compare_frfs` finds.

    Attributes
    ----------
    by_route
        Route → how it compares.
    curves
        (response, excitation) → route → (n_frequency,) receptance (m/N), the reference's too.
    norms
        (n_frequency, n_dof) norms h_i of the reference's rows.
    kernel_condition
        (n_frequency,) amplification in the interface kernel, or empty if nothing is coupled.
    """

    by_route: Mapping[str, FrfComparison]
    curves: Mapping[Pair, Mapping[str, ComplexArray]]
    norms: FloatArray
    kernel_condition: FloatArray


def compare_frfs(
    source: Source,
    reference: MatrixRoute,
    candidates: Sequence[Candidate],
    pairs: Sequence[Pair],
    frequency: FloatArray,
    report: Progress,
) -> FrfComparisons:
    """Compare every route with the reference over the band.

    Parameters
    ----------
    source
        Whose labels are compared, and whose stages' kernel is reported.
    reference, candidates
        What is compared with what.
    pairs
        (response, excitation) of the curves to keep, of every route that has them.
    frequency
        (n_frequency,) Hz.
    report
        Progress, in lines.
    """
    dofs = source.whole.labels
    step = max(VALUES_PER_BLOCK // len(dofs) ** 2, 1)
    blocks = [frequency[start : start + step] for start in range(0, len(frequency), step)]
    found: list[_Block] = []
    # Blocks share the cores; threads of BLAS would only wait for each other's.
    threads = min(os.cpu_count() or 1, THREADS, len(blocks))
    with threadpool_limits(1, "blas"), ThreadPoolExecutor(threads) as pool:
        report("comparing FRFs", 0, len(frequency))
        for block in pool.map(
            lambda lines: _compare_block(source, reference, candidates, pairs, lines), blocks
        ):
            found.append(block)
            report("comparing FRFs", min(len(found) * step, len(frequency)), len(frequency))
    curves = {
        pair: {name: np.concatenate([b.curves[pair][name] for b in found]) for name in by_route}
        for pair, by_route in found[0].curves.items()
    }
    comparisons = {
        candidate.route.name: _comparison(candidate, reference.name, frequency, found, curves)
        for candidate in candidates
    }
    return FrfComparisons(
        comparisons,
        curves,
        np.concatenate([block.norms for block in found]),
        np.concatenate([block.kernel for block in found]),
    )


@dataclass(frozen=True, eq=False)
class _Block:
    """Some lines: of each route its scaled errors' statistics, and the curves."""

    errors: Mapping[str, _Errors]
    curves: Mapping[Pair, Mapping[str, ComplexArray]]
    norms: FloatArray
    kernel: FloatArray


@dataclass(frozen=True, eq=False)
class _Errors:
    line_max: FloatArray
    line_median: FloatArray
    pair_max: FloatArray
    worst: int  # response and excitation of the worst line, as one index
    failure: str = ""

    @classmethod
    def of(cls, squares: FloatArray) -> _Errors:
        """Of (n_response, n_excitation, n_line) squares of scaled errors."""
        flat = squares.reshape(-1, squares.shape[2])
        largest = flat.max(axis=0)
        return cls(
            np.sqrt(largest),
            np.where(np.isnan(largest), np.nan, _root_medians(flat)),
            np.sqrt(squares.max(axis=2)),
            int(flat[:, largest.argmax()].argmax()),
        )


def _root_medians(squares: FloatArray) -> FloatArray:
    """The median of the roots of each column."""
    rows = np.array(squares.T, order="C")  # a copy: it is sorted in part
    middle = rows.shape[1] // 2
    rows.partition(middle, axis=1)
    upper = np.sqrt(rows[:, middle])
    if rows.shape[1] % 2:
        return np.asarray(upper)
    return np.asarray((upper + np.sqrt(rows[:, :middle].max(axis=1))) / 2.0)


def _compare_block(
    source: Source,
    reference: MatrixRoute,
    candidates: Sequence[Candidate],
    pairs: Sequence[Pair],
    lines: FloatArray,
) -> _Block:
    dofs = source.whole.labels
    ours = reference.frf(lines).select(dofs, dofs)  # lines last in memory, as of other routes
    norms = row_norms(ours)
    curves: dict[Pair, dict[str, ComplexArray]] = {pair: {} for pair in pairs}
    errors = {}

    def keep(name: str, frf: Frf) -> None:
        for pair in pairs:
            if pair[0] in frf.responses and pair[1] in frf.excitations:
                curves[pair][name] = frf.between(*pair).copy()

    keep(reference.name, ours)
    norm = dict(zip(dofs, norms.T, strict=True))
    scales: dict[tuple[tuple[str, ...], tuple[str, ...]], FloatArray] = {}
    for candidate in candidates:
        labels = candidate.responses, candidate.excitations
        if labels not in scales:
            rows, columns = (np.stack([norm[label] for label in each]) for each in labels)
            scales[labels] = error_scale(rows, columns)
        try:
            theirs = candidate.route.frf(lines, *labels)
        except SingularLineError:  # the axis is at fault: leave these lines out
            raise
        except ROUTE_ERRORS as error:
            shape = (len(labels[0]), len(labels[1]), len(lines))
            why = f"{candidate.route.name}: {error} ({type(error).__name__})"
            errors[candidate.route.name] = replace(_Errors.of(np.full(shape, np.nan)), failure=why)
            for pair in pairs:
                curves[pair][candidate.route.name] = np.full(len(lines), complex(np.nan, np.nan))
            continue
        same = ours if labels == (dofs, dofs) else ours.select(*labels)
        difference = (theirs.values - same.values).transpose(1, 2, 0)
        errors[candidate.route.name] = _Errors.of(squared_errors(difference, scales[labels]))
        keep(candidate.route.name, theirs)
    kernel = np.empty(0)
    if source.drivetrain.couplings:
        try:
            kernel = kernel_condition(source, lines)
        except SingularLineError:
            raise
        except ROUTE_ERRORS:  # told with FBS' FRFs, which fail alike
            kernel = np.full(len(lines), np.nan)
    return _Block(errors, curves, norms, kernel)


def _comparison(
    candidate: Candidate,
    reference: str,
    frequency: FloatArray,
    blocks: Sequence[_Block],
    curves: Mapping[Pair, Mapping[str, ComplexArray]],
) -> FrfComparison:
    name = candidate.route.name
    errors = [block.errors[name] for block in blocks]
    worst = int(np.argmax([error.line_max.max() for error in errors]))
    line_max = np.concatenate([error.line_max for error in errors])
    failure = next((error.failure for error in errors if error.failure), "")
    i, j = divmod(errors[worst].worst, len(candidate.excitations))
    fracs = [
        (frac(by_route[reference], by_route[name]), named(*pair))
        for pair, by_route in curves.items()
        if name in by_route and not failure
    ]
    return FrfComparison(
        route=name,
        line_max=line_max,
        line_median=np.concatenate([error.line_median for error in errors]),
        pair_max=np.max([error.pair_max for error in errors], axis=0),
        worst=(
            float(frequency[line_max.argmax()]), candidate.responses[i], candidate.excitations[j]
        ),
        frac=min(fracs, default=(np.nan, "")),
        failure=failure,
    )  # fmt: skip


def named(response: str, excitation: str) -> str:
    """What an FRF is called: ``response ← excitation``."""
    return f"{response} ← {excitation}"


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
    reference: MatrixRoute,
    route: MatrixRoute,
    floor: FloatArray,
    frequency: FloatArray,
    system: SecondOrderSystem,
) -> list[Check]:
    """Verdicts on one route's FRFs: the worst line, and the median line.

    Where a line exceeds its tolerance, both FRFs' own bound of their round-off counts.
    """
    routes = (reference.name, route.name)
    every = f"all {len(comparison.pair_max) ** 2} FRFs"
    if comparison.failure:
        return [
            Check(
                "FRFs, worst line", every, routes, "a route that cannot be computed",
                np.inf, 0.0, f"{reference.name} computes the same FRFs", (comparison.failure,),
            )
        ]  # fmt: skip
    allowed = with_round_off(
        np.maximum(FRF_TOLERANCE, floor), comparison.line_max, reference, route, frequency
    )
    excess = comparison.line_max / allowed
    worst = int(np.argmax(excess))
    findings: tuple[str, ...] = ()
    if not excess[worst] <= 1.0:
        findings = _frf_findings(comparison, reference, route, frequency, system)
    raised = int(np.sum(floor > FRF_TOLERANCE))
    note = (
        f"{raised} lines lie so close to an undamped pole (or to 0 Hz) that round-off alone may "
        f"exceed {FRF_TOLERANCE:g}; each is allowed its own round-off"
        if raised
        else ""
    )
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


def with_round_off(
    allowed: FloatArray,
    line_max: FloatArray,
    reference: Route,
    route: Route,
    frequency: FloatArray,
) -> FloatArray:
    """What is allowed of each line, with two routes' own bound of their round-off where it counts.

    That is where a line exceeds what is allowed, and if it explains the worst one; else the others
    do not matter any more.
    """
    excess = line_max / allowed
    doubtful = np.flatnonzero(~(excess <= 1.0))
    worst = int(np.argmax(excess))
    if not doubtful.size or not line_max[worst] <= line_round_off(
        reference, route, frequency[[worst]]
    ):
        return allowed
    raised = allowed.copy()
    own = line_round_off(reference, route, frequency[doubtful])
    raised[doubtful] = np.maximum(raised[doubtful], own)
    return raised


def line_round_off(reference: Route, route: Route, frequency: FloatArray) -> FloatArray:
    """Largest scaled error, by line, that the bounds of two routes' round-off leave room for.

    Between the labels that both have. Zero where that is one or more: round-off that may be
    anything explains nothing.
    """
    ours, theirs = reference.frf(frequency), route.frf(frequency)
    norm = dict(zip(ours.responses, row_norms(ours).T, strict=True))
    labels = [
        [label for label in have if label in norm]
        for have in (theirs.responses, theirs.excitations)
    ]
    bound = (ours.select(*labels).round_off + theirs.select(*labels).round_off).transpose(1, 2, 0)
    rows, columns = (np.array([norm[label] for label in some]) for some in labels)
    largest = np.sqrt(squared_errors(bound, error_scale(rows, columns)).max(axis=(0, 1)))
    return np.where(largest < 1.0, largest, 0.0)


def scaled_condition(stiffness: FloatArray) -> float:
    """Largest over smallest non-zero singular value of K scaled to a unit diagonal."""
    values = scaled_singular_values(stiffness)
    return float(values[0] / values[len(values) - rigid_body_count(stiffness) - 1])


def _frf_findings(
    comparison: FrfComparison,
    reference: MatrixRoute,
    route: MatrixRoute,
    frequency: FloatArray,
    system: SecondOrderSystem,
) -> tuple[str, ...]:
    at, response, excitation = comparison.worst
    worst = f"largest at {at:g} Hz: response {response}, excitation {excitation}"
    alone = single_lines(frequency, comparison.line_max)
    if at in alone:
        named = ", ".join(f"{line:g}" for line in alone[:MOST_LINES])
        return worst, f"{NO_CHANGE}: single lines differ from those beside them ({named} Hz)"
    lines = _spread_lines(frequency)
    dofs = system.dofs
    ours, theirs = (r.frf(lines, dofs, dofs) for r in (reference, route))
    round_off = ours.round_off + theirs.round_off
    return (worst, *traced(lines, ours.values, theirs.values, round_off, dofs))


def _spread_lines(frequency: FloatArray, count: int = 24) -> FloatArray:
    picks = np.unique(np.linspace(0, len(frequency) - 1, count).round().astype(int))
    lines: FloatArray = frequency[picks]
    return lines
