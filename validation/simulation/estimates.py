"""FRFs estimated from a run, beside those of FBS: which estimator, and how well they agree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import stdtrit

from fbs import Estimate, Frf, Quantity, Record, averaged_frf, impulse_frf, periodic_frf
from fbs.errors import FbsError
from fbs.signal.estimation import THRESHOLD
from mbs_models.gears.operating_point import OperatingPoint
from mbs_models.integration.integrators import TRAPEZOIDAL, Integrator
from mbs_models.model.excitation import Excitation
from mbs_models.model.parameters import Drivetrain
from mbs_models.signals.lines import Harmonic, Multisine, Signal
from mbs_models.signals.sines import HalfSine
from mbs_models.system.harmonic_response import harmonic_response
from mbs_models.system.linearization import LinearizedSystem

from ..arrays import BoolArray, ComplexArray, FloatArray
from ..checks.check import Check
from ..routes.comparable_lines import DYNAMIC_RANGE_DB, KNOWN_TO, describe, known, within_range
from ..routes.routes import fbs_route
from ..routes.source import exudyn_source, loaded_source
from ..routes.time_domain import ZERO

# An impact fills its band up to where its spectrum has fallen by 10 dB (ISO 7626-5 allows 20).
IMPACT = 0.3
LEAST_PERIODS = 10
SEGMENTS = 8  # of a record of noise, half overlapping: 15 averages
# Samples of all channels together that are transformed at once (64 MiB; complex spectra, windowed
# copies and sums take five times that): of a record that is longer, more segments are averaged.
LONGEST_SEGMENT = 1 << 23
# And of a record that is transformed whole, as one that ends must be.
LONGEST_TRANSIENT = 1 << 25
LINES_AT_ONCE = 4096  # of FBS, all DoFs by all DoFs
LOOKED_AT = 200  # lines of a band, to tell what moves

AVERAGED = ("H1", "H2", "Hv")
ROUTE = "exudyn in time"
FBS = "FBS of exudyn stages"

DECIBEL_TOLERANCE = 0.1
DEGREE_TOLERANCE = 1.0
REASON = (
    "RK44 bends frequencies by up to 1e-4 at the band's end, a few hundredths of a dB and a few "
    "tenths of a degree at the flanks of a 1 % damped mode; the trapezoidal rule's bend is known "
    "and taken out; what is left is geometry, which is not quite linear, and what a transient "
    "keeps at its end"
)
# An averaged estimate scatters by ε = √((1 − γ²)/(2 n γ²)) (Bendat & Piersol 2010, ch. 9), with
# several inputs times √(G_yy/|H|²G_ff) for the response to the others. With ε itself estimated the
# ratio is Student's t of 2(n − n_inputs) degrees of freedom: one run in so many has a single line
# beyond what is allowed.
ONE_RUN_IN = 1000.0
LOST = 0.5  # of |H|: where an estimate may scatter by more it says nothing, and is not compared
# What is left of a response at the end of a record that is transformed whole, of its peak: cut
# off, it would leak by as much.
REMAINDER = 1e-3


@dataclass(frozen=True, eq=False)
class EstimatedFrfs:
    """FRFs from a run beside FBS', at the estimator's lines.

    Attributes
    ----------
    estimate
        (n_line, n_response, n_excitation) with its coherence.
    reference
        The same FRFs by FBS.
    compared
        (n_line, n_response, n_excitation) lines compared, by the `rule`.
    allowed_db
        (n_line, n_response, n_excitation) the tolerance, with the estimator's own scatter.
    """

    estimate: Estimate
    reference: Frf
    compared: BoolArray
    allowed_db: FloatArray

    @property
    def judged(self) -> str:
        """On how many lines a verdict on them rests, and where it leaves out half of the band."""
        frf = self.reference
        names = [f"{i} ← {j}" for i in frf.responses for j in frf.excitations]
        return describe(names, frf.frequency, self.compared.reshape(len(frf.frequency), -1))

    @property
    def rule(self) -> str:
        """Which lines are compared."""
        words = (
            f"A line is compared within {DYNAMIC_RANGE_DB:g} dB of its FRF’s own peak, which in a "
            "free drivetrain is the rise towards 0 Hz"
        )
        if _known_by_scatter(self.estimate) is not None:
            words += (
                "; and below, where the periods of the steady state scatter by less than "
                f"{100.0 * KNOWN_TO:g} % of it, there and on the lines about it"
            )
        if self.estimate.kind in AVERAGED:
            words += ", and where the estimate scatters by less than half of it"
        return words

    @property
    def decibels(self) -> FloatArray:
        """|ΔH| of magnitudes, dB; 0 on lines not compared."""
        return np.asarray(np.abs(20.0 * np.log10(np.abs(self._ratio))))

    @property
    def median_db(self) -> float:
        """Median difference over the lines compared (dB); NaN where there are none."""
        differences = self.decibels[self.compared]
        return float(np.median(differences)) if differences.size else np.nan

    @property
    def median_difference(self) -> str:
        """The same, in words."""
        median = self.median_db
        return "no line is compared" if np.isnan(median) else f"median difference {median:.2g} dB"

    @property
    def degrees(self) -> FloatArray:
        """Differences of phase; 0 on lines not compared."""
        return np.asarray(np.degrees(np.abs(np.angle(self._ratio))))

    @property
    def _ratio(self) -> ComplexArray:
        reference = np.where(self.compared, self.reference.values, 1.0)
        return np.where(self.compared, self.estimate.frf.values / reference, 1.0)


def responding(
    linear: LinearizedSystem,
    responses: Sequence[str],
    excitations: Sequence[str],
    band: tuple[float, float],
) -> tuple[str, ...]:
    """The responses that move at all: symmetry keeps the others still but for round-off.

    Parameters
    ----------
    linear
        The linearised system.
    responses, excitations
        DoFs.
    band
        First and last frequency (Hz).
    """
    lines = np.geomspace(max(band[0], 1e-3 * band[1]), band[1], LOOKED_AT)
    largest = np.abs(harmonic_response(linear, lines, linear.labels, excitations)).max(axis=(0, 2))
    size = dict(zip(linear.labels, largest, strict=True))
    return tuple(label for label in responses if size[label] > ZERO * largest.max())


def estimate_frfs(
    record: Record, excitations: Sequence[Excitation[Signal]]
) -> tuple[Estimate, ...]:
    """The FRFs of a record by the estimator that its excitations allow.

    - Multisines, whole periods on the periodic orbit: `periodic_frf`, no leakage, every input at
      the lines that are its own;
    - signals that end before the record does: the record is transformed whole, no leakage;
    - signals without end: H1 over Hann-windowed segments, with coherence.

    Raises
    ------
    FbsError
        The record is too short, has not died away, or its inputs cannot be told apart.
    """
    signals = [excitation.signal for excitation in excitations]
    fmin = min(signal.band[0] for signal in signals)
    fmax = max(signal.band[1] for signal in signals)
    size = record.inputs.size + record.outputs.size
    multisines = [signal for signal in signals if isinstance(signal, Multisine)]
    if len(multisines) == len(signals):
        return _multisine_frfs(record, multisines)
    if all(signal.duration is not None for signal in signals):
        if size > LONGEST_TRANSIENT:
            raise FbsError(
                f"a record of {record.n_sample} samples in {size // record.n_sample} channels is "
                f"too long to be transformed whole, {LONGEST_TRANSIENT} are allowed in all: record "
                "fewer responses, or excite with noise"
            )
        # What a mode keeps at the record's end leaks most to lines it shows but a few periods of.
        shortest = LEAST_PERIODS * record.sampling_frequency / record.n_sample
        if shortest >= fmax:
            raise FbsError(
                f"a record of {record.n_sample / record.sampling_frequency:.3g} s shows fewer than "
                f"{LEAST_PERIODS} periods of any line up to {fmax:g} Hz; run longer"
            )
        struck = any(isinstance(signal, HalfSine) for signal in signals)
        return (
            impulse_frf(
                record,
                max_remainder=REMAINDER,
                fmin=max(fmin, shortest),
                fmax=fmax,
                threshold=IMPACT if struck else THRESHOLD,
            ),
        )
    if any(isinstance(signal, Harmonic) for signal in signals):
        raise FbsError("a sine excites but one line; multisines, sweeps, impacts and noise a band")
    segment = min(record.n_sample // SEGMENTS, LONGEST_SEGMENT * record.n_sample // size)
    return (averaged_frf(record, segment, fmin=fmin, fmax=fmax),)


def _multisine_frfs(record: Record, signals: Sequence[Multisine]) -> tuple[Estimate, ...]:
    """One estimate per input: at a line only one of them is excited."""
    if len(record.excitations) != len(signals):
        raise FbsError("several multisines at one DoF: their lines do not tell which is which")
    lines = np.concatenate([signal.frequency for signal in signals])
    if len(np.unique(np.round(lines, 9))) < len(lines):
        raise FbsError(
            "several multisines excite the same lines: one record does not tell them apart; let "
            'them share their lines (lines = "shared", one df), or run them one by one'
        )
    return tuple(
        multisine_frf(
            replace(record, inputs=record.inputs[:, [i]], excitations=(record.excitations[i],)),
            signal,
        )
        for i, signal in enumerate(signals)
    )


def multisine_frf(record: Record, signal: Multisine) -> Estimate:
    """The FRFs of whole periods under one multisine, at all its lines.

    Its lines may differ by any number of decades: they are the force's own, not a sensor's noise.
    """
    return periodic_frf(
        record,
        round(signal.period * record.sampling_frequency),
        frequency=signal.frequency,
        threshold=0.1 * float(signal.amplitudes.min() / signal.amplitudes.max()),
    )


def unbent(estimate: Estimate, integrator: Integrator) -> Estimate:
    """The estimate as receptance at the frequencies that the integrator's stand for.

    The trapezoidal rule's difference equations at f are the differential equations at
    f′ = tan(π f h)/(π h), exactly (Tustin): H(f′) is what was estimated on line f.
    """
    frf = estimate.frf
    if integrator.name == TRAPEZOIDAL:
        half = np.pi * integrator.step
        frf = replace(frf, frequency=np.tan(half * frf.frequency) / half)
    variance = estimate.variance
    if variance is not None:
        factor = (2.0 * np.pi * frf.frequency) ** (-2 * frf.quantity.derivative)
        variance = variance * factor[:, None, None]
    return replace(estimate, frf=frf.to(Quantity.RECEPTANCE), variance=variance)


def compare_with_fbs(
    estimate: Estimate,
    drivetrain: Drivetrain,
    power: FloatArray | None = None,
    point: OperatingPoint | None = None,
) -> EstimatedFrfs:
    """FBS' FRFs at the lines of a receptance, and where the two are compared.

    Parameters
    ----------
    estimate
        The receptance.
    drivetrain
        As it was run.
    power
        (n_excitation,) of the inputs, in any unit, all in one band: how much of the scatter each
        has; equal if not given.
    point
        Where it was run: the stages are linearised about their loaded state. None: at rest.
    """
    frf = estimate.frf
    reference = replace(frf, values=_by_fbs(frf, drivetrain, point))
    size = np.abs(reference.values)
    peak = size.max(axis=0)
    # What symmetry keeps still is zero: what moves it is not linear.
    responding = peak > ZERO * peak.max(axis=0)
    judgeable = within_range(size)
    quiet = _known_by_scatter(estimate)
    if quiet is not None:  # or else: what is not linear makes periods differ as well
        judgeable = judgeable | quiet
    scatter = _scatter(
        estimate, reference.values, np.ones(len(frf.excitations)) if power is None else power
    )
    return EstimatedFrfs(
        estimate,
        reference,
        responding & judgeable & (scatter < LOST),
        np.asarray(DECIBEL_TOLERANCE + 20.0 / np.log(10.0) * scatter),
    )


def _known_by_scatter(estimate: Estimate) -> BoolArray | None:
    """Where the periods of a steady state differ by less than `KNOWN_TO`; None of other estimates.

    (n_line, n_response, n_excitation), of a receptance.
    """
    if estimate.kind != "periodic" or estimate.variance is None:
        return None
    return known(estimate.frf.frequency, np.abs(estimate.frf.values), np.sqrt(estimate.variance))


def _by_fbs(frf: Frf, drivetrain: Drivetrain, point: OperatingPoint | None) -> ComplexArray:
    """The same receptances by FBS, some lines at a time: coupling takes all DoFs by all DoFs."""
    source = loaded_source(drivetrain, point) if point else exudyn_source(drivetrain)
    route = fbs_route(source)
    starts = range(LINES_AT_ONCE, len(frf.frequency), LINES_AT_ONCE)
    return np.concatenate(
        [
            route.frf(lines, frf.responses, frf.excitations).values
            for lines in np.split(frf.frequency, starts)
        ]
    )


def _scatter(estimate: Estimate, reference: ComplexArray, power: FloatArray) -> FloatArray:
    """What an averaged estimate may scatter by, relative; 0 of others (n_line, n_resp., n_exc.)."""
    if estimate.kind not in AVERAGED or estimate.coherence is None:
        return np.zeros(reference.shape)
    tiny, n = np.finfo(float).tiny, estimate.n_averages
    coherence = np.maximum(estimate.coherence, tiny)[:, :, None]
    # Σ_k |H_ik|² G_kk / (|H_ij|² G_jj): the responses to other inputs are noise to this one's.
    parts = np.abs(reference) ** 2 * power
    others = parts.sum(axis=2, keepdims=True) / np.maximum(parts, tiny)
    freedom = 2 * (n - reference.shape[2])
    largest = stdtrit(freedom, 1.0 - 1.0 / (2.0 * ONE_RUN_IN * reference.size))
    return np.asarray(largest * np.sqrt((1.0 - coherence) / (2.0 * n * coherence) * others))


def estimator(estimate: Estimate) -> str:
    """What to call it: sweeps are transformed as impacts are."""
    return "whole record" if estimate.kind == "impulse" else estimate.kind


def estimate_checks(estimated: EstimatedFrfs) -> list[Check]:
    """Verdicts on estimated FRFs: magnitude and phase, in units of what is allowed."""
    frf = estimated.estimate.frf
    count = len(frf.responses) * len(frf.excitations)
    subject = f"{count} FRF{'s' if count > 1 else ''} from {', '.join(frf.excitations)}"
    share = estimated.allowed_db / DECIBEL_TOLERANCE
    magnitude, phase = estimated.decibels / share, estimated.degrees / share
    reason = REASON
    if estimated.estimate.kind in AVERAGED:
        reason += (
            "; an averaged estimate is allowed the scatter that its coherence explains on top, as "
            f"one run in {ONE_RUN_IN:g} has it on a single line"
        )
    kind = estimator(estimated.estimate)
    check = Check(
        f"FRFs from time integration ({kind}), magnitude", subject, (FBS, ROUTE),
        "largest difference, dB", float(magnitude.max()), DECIBEL_TOLERANCE, reason,
        _findings(estimated, magnitude, DECIBEL_TOLERANCE, "dB"), estimated.judged,
    )  # fmt: skip
    return [
        check,
        replace(
            check,
            name=f"FRFs from time integration ({kind}), phase",
            measure="largest difference, degrees",
            value=float(phase.max()),
            tolerance=DEGREE_TOLERANCE,
            findings=_findings(estimated, phase, DEGREE_TOLERANCE, "°"),
        ),
    ]


def _findings(
    estimated: EstimatedFrfs, values: FloatArray, allowed: float, unit: str
) -> tuple[str, ...]:
    frf = estimated.estimate.frf
    worst = values.max(axis=0)
    return tuple(
        f"{response} ← {excitation}: {worst[i, j]:.3g} {unit} at "
        f"{frf.frequency[values[:, i, j].argmax()]:g} Hz"
        for i, response in enumerate(frf.responses)
        for j, excitation in enumerate(frf.excitations)
        if not worst[i, j] <= allowed
    )
