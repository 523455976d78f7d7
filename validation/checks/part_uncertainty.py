"""How well FRFs of an assembly are known whose parts were measured.

By the noise stated, by the scatter of a part's runs, or by its coherence.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from fbs import Frf, Joint, couple, direct_frf
from fbs.measured.uncertainty import Scatter, UncertainFrf, coupled_uncertainty, sampled

from ..arrays import FloatArray
from ..errors import CommandError
from ..routes.source import Source
from ..routes.substitution import Substitution
from .metrics import decibel_difference

Pair = tuple[str, str]

DECIBEL = 20 / np.log(10)  # dB of one neper
FIRST_ORDER = 6.0  # dB at 95 %: σ = 0.35 of H, whose second order is a sixth of the first
FEWEST, MOST_VALUES = 100, 2e8  # repetitions for quantiles of 2.5 %; numbers kept (0.8 GB)
NOTHING_LEFT = 1e-50  # of an FRF: −1000 dB, beyond any frame
DIGITS = 1e-5  # dB: a millionth, which twelve digits of a file may become
NOISE = re.compile(r"([\d.eE+-]+)\s*%\s*(?:,\s*([\d.eE+-]+)\s*(?:deg|°))?")


@dataclass(frozen=True)
class Noise:
    """Of every measured FRF, one standard deviation: of its magnitude (1), its phase (rad)."""

    amplitude: float
    phase: float = 0.0


@dataclass(frozen=True)
class Share:
    """How much of an FRF's error one measured FRF causes."""

    part: str
    response: str
    excitation: str
    share: float

    def __str__(self) -> str:
        return f"{self.share:.0%} of it by {self.part}'s {self.response} ← {self.excitation}"


@dataclass(frozen=True, eq=False)
class Known:
    """How well one FRF of the assembly is known.

    Attributes
    ----------
    low, high
        (n_frequency,) dB relative to the FRF, which hold it with 95 %.
    shares
        Of every measured FRF in E |dY|², to first order, the mean over the lines; the largest
        first. They add up to 1.
    repetitions
        Whose quantiles the band is; 0: it is of first order.
    """

    low: FloatArray
    high: FloatArray
    shares: tuple[Share, ...]
    repetitions: int = 0

    @property
    def level(self) -> FloatArray:
        """(n_frequency,) dB on either side that hold 95 % or more."""
        return np.maximum(self.high, -self.low)

    @property
    def told(self) -> float:
        """What is beyond so many dB is no more than wide."""
        return np.inf if self.repetitions else FIRST_ORDER

    @property
    def method(self) -> str:
        """In words."""
        return f"{self.repetitions} repetitions" if self.repetitions else "first order"

    def exceeded(self, decibel: FloatArray) -> NDArray[np.bool_]:
        """Lines at which the FRF before a change (dB) lies outside the band of the one after.

        And the change is beyond what a file's digits are. Where the band is not told, nothing is
        said to be outside.
        """
        outside = (-decibel < self.low) | (-decibel > self.high)  # NaN is not
        return np.asarray(outside & (np.abs(decibel) > DIGITS) & (self.level <= self.told))

    def split(self, part: str, responses: Sequence[str], excitations: Sequence[str]) -> FloatArray:
        """The shares of a part's FRFs, (n_response, n_excitation); 0 where it is certain."""
        own = {(s.response, s.excitation): s.share for s in self.shares if s.part == part}
        return np.array([[own.get((r, e), 0.0) for e in excitations] for r in responses])


def parse_noise(text: str | None) -> Noise | None:
    """What ``--noise 1%,1deg`` says.

    Raises
    ------
    CommandError
        It is not of this form, or beyond what is noise.
    """
    if text is None:
        return None
    match = NOISE.fullmatch(text.strip())
    try:
        amplitude, phase = (float(part or 0.0) for part in match.groups()) if match else (-1.0, 0.0)
    except ValueError:
        amplitude, phase = -1.0, 0.0
    if not (0 < amplitude <= 50 and 0 <= phase <= 45):
        raise CommandError(
            f"--noise = {text!r}: give a percentage up to 50 and, after a comma, degrees up to 45, "
            "such as 1%,1deg"
        )
    return Noise(amplitude / 100, np.deg2rad(phase))


def scatter_of(substitution: Substitution, noise: Noise | None) -> Scatter | None:
    """Errors of a part's FRFs: the noise stated, else what its runs or its coherence say.

    With what their interpolation adds. None: nothing is known of them.
    """
    scatter = _measured(substitution, noise)
    added = substitution.interpolation
    if scatter is None or added is None:
        return scatter
    return replace(scatter, variance=scatter.variance + added)


def _measured(substitution: Substitution, noise: Noise | None) -> Scatter | None:
    if noise is not None:
        return Scatter.relative(substitution.frf, noise.amplitude, noise.phase)
    if len(substitution.repeats) > 1:
        return Scatter.of_repeats(substitution.repeats)
    if substitution.coherence is not None and substitution.averages is not None:
        return Scatter.of_coherence(
            substitution.frf, substitution.coherence, substitution.averages - 1
        )
    return None


def require_errors(
    repetitions: int, substitutions: Sequence[Substitution], noise: Noise | None
) -> None:
    """Refuse ``--samples`` where there is nothing to draw.

    Raises
    ------
    CommandError
        Fewer repetitions than quantiles need, or nothing is known of any file's errors.
    """
    if repetitions == 0:
        return
    if repetitions < FEWEST:
        raise CommandError(f"--samples = {repetitions}: must be at least {FEWEST}")
    if all(scatter_of(one, noise) is None for one in substitutions):
        raise CommandError(
            f"--samples = {repetitions}: nothing is known of any file's errors; --noise or "
            "--averages says it, or a file of several runs (--replace)"
        )


def how_well_known(
    source: Source,
    substitutions: Sequence[Substitution],
    pairs: Sequence[Pair],
    noise: Noise | None = None,
    repetitions: int = 0,
) -> Mapping[Pair, Known]:
    """Carry the errors of measured parts through the coupling, to first order or by sampling.

    Errors of different parts are independent: their variances add up.

    Parameters
    ----------
    source
        Whose other stages the files' are coupled with.
    substitutions
        The parts from files, on their lines.
    pairs
        (response, excitation) of the assembly.
    noise
        Stated noise of all parts (None: the scatter of each one's runs, or its coherence).
    repetitions
        How often to couple with errors drawn, for bands that first order does not tell (0: none).

    Raises
    ------
    CommandError
        More repetitions than memory is taken for.

    Returns
    -------
    mapping
        Empty where nothing is known of any part's errors.
    """
    errors = {r.part: s for r in substitutions if (s := scatter_of(r, noise)) is not None}
    if not (errors and pairs):
        return {}
    frequency = substitutions[0].frf.frequency
    stages = {name: direct_frf(system, frequency) for name, system in source.stages.items()}
    stages |= {r.part: r.frf for r in substitutions}
    rows, columns = (list(dict.fromkeys(labels)) for labels in zip(*pairs, strict=True))
    carried = {
        part: coupled_uncertainty(stages, source.joints, part, scatter, rows, columns)
        for part, scatter in errors.items()
    }
    known = {pair: known_of(carried, pair) for pair in pairs}
    if not repetitions:
        return known
    if repetitions * frequency.size * len(known) > MOST_VALUES:
        raise CommandError(
            f"--samples = {repetitions}: with {frequency.size} lines and {len(known)} FRFs at most "
            f"{int(MOST_VALUES / frequency.size / len(known))}"
        )
    return _sampled(known, stages, source.joints, errors, repetitions)


def _sampled(
    known: Mapping[Pair, Known],
    stages: Mapping[str, Frf],
    joints: Sequence[Joint],
    errors: Mapping[str, Scatter],
    count: int,
) -> Mapping[Pair, Known]:
    """The bands by quantiles of repetitions, without errors that reach none of the FRFs."""
    rows, columns = (list(dict.fromkeys(labels)) for labels in zip(*known, strict=True))
    ends = {end for joint in joints for end in (joint.first, joint.second)}
    few, drawn = dict(stages), {}
    for part, scatter in errors.items():
        frf = stages[part]
        at, by = (
            [n for n, label in enumerate(own) if (part, label) in ends or label in wanted]
            for own, wanted in ((frf.responses, rows), (frf.excitations, columns))
        )
        labels = [frf.responses[n] for n in at], [frf.excitations[n] for n in by]
        few[part], drawn[part] = frf.select(*labels), scatter.select(at, by)
    places = [(rows.index(r), columns.index(e)) for r, e in known]
    levels = np.empty((count, len(places), next(iter(stages.values())).frequency.size), np.float32)
    exact = couple(few, joints, rows, columns).frf.values
    draws = sampled(few, joints, drawn, count, 0, rows, columns)
    for level, frf in zip(levels, draws, strict=True):
        with np.errstate(divide="ignore", invalid="ignore"):
            for number, place in enumerate(places):
                level[number] = decibel_difference(exact[:, *place], frf.values[:, *place])
    low, high = np.quantile(levels, [0.025, 0.975], axis=0)
    return {
        pair: Known(low[n], high[n], one.shares, count)
        for n, (pair, one) in enumerate(known.items())
    }


def known_of(carried: Mapping[str, UncertainFrf], pair: Pair) -> Known:
    """How well an FRF is known under the errors of all parts."""
    level = sum(
        (stdtrit(one.errors.degrees, 0.975) * one.deviations(*pair)[0]) ** 2  # 1.96, or more
        for one in carried.values()
    )
    variances = {part: _between(one, pair) for part, one in carried.items()}
    total = np.sum(list(variances.values()), axis=0)
    erring = total > 0
    shares = []
    for part, one in carried.items():
        of_part = np.divide(variances[part], total, out=np.zeros(total.size), where=erring)
        split = np.einsum("f,fij->ij", of_part, one.shares(*pair)) / max(1, erring.sum())
        shares += [
            Share(part, response, excitation, float(split[i, j]))
            for i, response in enumerate(one.part.responses)
            for j, excitation in enumerate(one.part.excitations)
        ]
    shares.sort(key=lambda share: share.share, reverse=True)
    width = np.sqrt(level)
    if all(np.isinf(one.errors.degrees) for one in carried.values()):
        low, high = -width, width  # of ln |H|: noise is stated as a share of H
    else:  # |H| within |Ĥ| (1 ± width): errors that add up with H do not grow with it
        low, high = np.log(np.maximum(1.0 - width, NOTHING_LEFT)), np.log1p(width)
    return Known(DECIBEL * low, DECIBEL * high, tuple(shares))


def _between(found: UncertainFrf, pair: Pair) -> FloatArray:
    response, excitation = pair
    i, j = found.frf.responses.index(response), found.frf.excitations.index(excitation)
    return found.variance[:, i, j]
