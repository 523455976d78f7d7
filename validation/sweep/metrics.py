"""Scalar metrics of a sweep's samples: what ``--metric`` asks for.

| metric | columns |
| --- | --- |
| ``peak[:F1:F2]`` | highest resonance peak: level (dB re 1 m/N) and frequency (Hz) |
| ``rms[:F1:F2]`` | root mean square of |H| over the lines (m/N) |
| ``mean[:F1:F2]`` | mean level: the average of the lines' dB (dB re 1 m/N) |
| ``level:F`` | |H| at a line (dB re 1 m/N) |
| ``drop:F`` | how far |H| at a line is below that of the model as it is (dB) |
| ``frequency:N``, ``frequency:KIND:N`` | N-th natural frequency, of all modes or of a kind's (Hz) |

Without F1 and F2 the whole band counts. Nothing is interpolated: a peak is a line above both its
neighbours (if a band has none, the highest line), and ``level`` and ``drop`` take a line of the
axis. The rise towards 0 Hz of a drivetrain that is free to turn is no peak.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mbs_models.modal.mode_kinds import Kind

from ..arrays import FloatArray
from ..errors import CommandError

FoundModes = tuple[FloatArray, tuple[str, ...]]  # natural frequencies (Hz) and kinds

FORMS = "peak[:F1:F2], rms[:F1:F2], mean[:F1:F2], level:F, drop:F, frequency:N or frequency:KIND:N"
KINDS = {str(kind).replace(" ", "-"): str(kind) for kind in Kind}


@dataclass(frozen=True, eq=False)
class Findings:
    """What metrics are computed from.

    Attributes
    ----------
    frequency
        (n_frequency,) Hz.
    magnitude
        (n_sample, n_frequency) |H| (m/N).
    modes
        Of each sample: all natural frequencies (Hz, ascending) and kinds.
    nominal
        Line (Hz) → |H| of the model as it is (m/N).
    """

    frequency: FloatArray
    magnitude: FloatArray
    modes: Sequence[FoundModes]
    nominal: Callable[[float], float]


@dataclass(frozen=True)
class BandMetric:
    """A measure (a key of `OVER_BAND`) of |H| over the lines from ``start`` to before ``stop``."""

    columns: tuple[str, ...]
    labels: tuple[str, ...]
    measure: str
    start: int
    stop: int

    def values(self, findings: Findings) -> FloatArray:
        """(n_sample, n_column)."""
        lines, (measure, _) = slice(self.start, self.stop), OVER_BAND[self.measure]
        return measure(findings.magnitude[:, lines], findings.frequency[lines])


@dataclass(frozen=True)
class LineMetric:
    """The level at a line, or how far it is below that of the model as it is."""

    columns: tuple[str, ...]
    labels: tuple[str, ...]
    line: int
    drop: bool

    def values(self, findings: Findings) -> FloatArray:
        """(n_sample, 1)."""
        level = decibels(findings.magnitude[:, self.line, None])
        if not self.drop:
            return level
        nominal = findings.nominal(float(findings.frequency[self.line]))
        return np.asarray(decibels(np.array(nominal)) - level)


@dataclass(frozen=True)
class ModeMetric:
    """A natural frequency by its number from 1, of all modes (kind "") or of a kind's."""

    columns: tuple[str, ...]
    labels: tuple[str, ...]
    number: int
    kind: str

    def values(self, findings: Findings) -> FloatArray:
        """(n_sample, 1); NaN where there are fewer modes."""
        return np.array([[self._of(*modes)] for modes in findings.modes])

    def _of(self, frequencies: FloatArray, kinds: Sequence[str]) -> float:
        own = [f for f, k in zip(frequencies, kinds, strict=True) if self.kind in ("", k)]
        return float(own[self.number - 1]) if len(own) >= self.number else math.nan


Metric = BandMetric | LineMetric | ModeMetric


def decibels(magnitude: FloatArray) -> FloatArray:
    """Level of |H| (dB re 1 m/N); −inf where it is zero."""
    with np.errstate(divide="ignore"):
        return np.asarray(20.0 * np.log10(magnitude))


def peak(magnitude: FloatArray, frequency: FloatArray) -> FloatArray:
    """(n, 2) level of the highest line above both its neighbours (dB re 1 m/N), and the line (Hz).

    The highest line of all where |H| only rises or falls, or has one peak at either end.
    """
    inner = magnitude[:, 1:-1]
    stands_out = (inner > magnitude[:, :-2]) & (inner >= magnitude[:, 2:])
    resonance = np.argmax(np.where(stands_out, inner, -1.0), axis=1) + 1 if inner.size else 0
    at = np.where(stands_out.any(axis=1), resonance, np.argmax(magnitude, axis=1))
    return np.column_stack([decibels(magnitude[np.arange(len(at)), at]), frequency[at]])


def rms(magnitude: FloatArray, frequency: FloatArray) -> FloatArray:
    """(n, 1) root mean square over the lines (m/N)."""
    return np.asarray(np.sqrt(np.mean(magnitude**2, axis=1, keepdims=True)))


def mean_level(magnitude: FloatArray, frequency: FloatArray) -> FloatArray:
    """(n, 1) average of the lines' levels (dB re 1 m/N)."""
    return np.asarray(decibels(magnitude).mean(axis=1, keepdims=True))


LEVEL = "dB re 1 m/N"
# Measure → how it is computed, and of its columns the ending, the words and the unit.
OVER_BAND: Mapping[
    str,
    tuple[Callable[[FloatArray, FloatArray], FloatArray], tuple[tuple[str, str, str], ...]],
] = {
    "peak": (peak, (("db", "Highest peak", LEVEL), ("hz", "Peak frequency", "Hz"))),
    "rms": (rms, (("m_per_n", "RMS", "m/N"),)),
    "mean": (mean_level, (("db", "Mean level", LEVEL),)),
}
AT_LINE = {"level": ("Level at", LEVEL), "drop": ("Below the model as it is, at", "dB")}


def metrics(given: Sequence[str], frequency: FloatArray | None) -> tuple[Metric, ...]:
    """The metrics that ``--metric`` options ask for; of an FRF's whole band peak and rms if none.

    Parameters
    ----------
    given
        The options.
    frequency
        (n_frequency,) lines of the FRF (Hz); None if no FRF is asked for.

    Raises
    ------
    CommandError
        An option cannot be read, is given twice, needs an FRF where there is none, or lines that
        the axis does not have.
    """
    if not given:
        given = () if frequency is None else ("peak", "rms")
    asked = tuple(_metric(text, frequency) for text in given)
    for text, metric in zip(given, asked, strict=True):
        times = [other.columns for other in asked].count(metric.columns)
        if times > 1:
            raise CommandError(f"--metric {text}: is given {times} times")
    return asked


def columns(asked: Sequence[Metric]) -> tuple[str, ...]:
    """Names of all values of some metrics."""
    return tuple(name for metric in asked for name in metric.columns)


def labels(asked: Sequence[Metric]) -> dict[str, str]:
    """What every column is, with its unit, for axes."""
    return {
        name: words
        for metric in asked
        for name, words in zip(metric.columns, metric.labels, strict=True)
    }


def _metric(text: str, frequency: FloatArray | None) -> Metric:
    name, *rest = (part.strip() for part in text.split(":"))
    if name == "frequency":
        return _of_modes(text, rest)
    if name not in (*OVER_BAND, *AT_LINE):
        raise CommandError(f"--metric {text}: there is no such metric; must be {FORMS}")
    if frequency is None:
        raise CommandError(f"--metric {text}: needs an FRF; give --response and --excitation")
    limits = [_hertz(text, part) for part in rest]
    if name in AT_LINE:
        return _at_line(text, name, limits, frequency)
    return _over_band(text, name, limits, frequency)


def _of_modes(text: str, rest: Sequence[str]) -> ModeMetric:
    *kind, number = rest or [""]
    if len(kind) > 1 or not number.isdecimal() or int(number) < 1:
        raise CommandError(f"--metric {text}: must be frequency:N or frequency:KIND:N, N from 1")
    if kind and kind[0] not in KINDS:
        raise CommandError(f"--metric {text}: KIND must be one of {', '.join(KINDS)}")
    column = "_".join(("frequency", *(k.replace("-", "_") for k in kind), number, "hz"))
    name = KINDS[kind[0]] if kind else ""
    words = (
        f"{name.capitalize()} mode {number} (Hz)" if name else f"Natural frequency {number} (Hz)"
    )
    return ModeMetric((column,), (words,), int(number), name)


def _over_band(text: str, name: str, limits: Sequence[float], frequency: FloatArray) -> BandMetric:
    if len(limits) not in (0, 2):
        raise CommandError(f"--metric {text}: must be {name} or {name}:F1:F2, in Hz")
    low, high = limits or (frequency[0], frequency[-1])
    start = int(np.searchsorted(frequency, low, side="left"))
    stop = int(np.searchsorted(frequency, high, side="right"))
    if start >= stop or low < frequency[0] or high > frequency[-1]:
        raise CommandError(
            f"--metric {text}: {low:g} to {high:g} Hz must hold a line and lie within the FRF's "
            f"{frequency[0]:g} to {frequency[-1]:g} Hz; see --fmin, --fmax and --df"
        )
    _, own = OVER_BAND[name]
    stem = "_".join((name, *(f"{limit:g}" for limit in limits)))
    band = f", {low:g}–{high:g} Hz" if limits else ""
    return BandMetric(
        tuple(f"{stem}_{ending}" for ending, _, _ in own),
        tuple(f"{words}{band} ({unit})" for _, words, unit in own),
        name, start, stop,
    )  # fmt: skip


def _at_line(text: str, name: str, limits: Sequence[float], frequency: FloatArray) -> LineMetric:
    if len(limits) != 1:
        raise CommandError(f"--metric {text}: must be {name}:F, in Hz")
    (at,) = limits
    line = int(np.argmin(np.abs(frequency - at)))
    if not math.isclose(frequency[line], at, rel_tol=1e-9):  # lines are rounded multiples of df
        raise CommandError(
            f"--metric {text}: {at:g} Hz is no line of the FRF; the nearest is "
            f"{frequency[line]:g} Hz; see --fmin, --fmax and --df"
        )
    words, unit = AT_LINE[name]
    label = f"{words} {at:g} Hz ({unit})"
    return LineMetric((f"{name}_{at:g}_db",), (label,), line, drop=name == "drop")


def _hertz(text: str, part: str) -> float:
    try:
        value = float(part)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise CommandError(f"--metric {text}: {part!r} is no frequency; must be {FORMS}")
    return value
