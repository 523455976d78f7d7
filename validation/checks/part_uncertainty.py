"""How well FRFs of an assembly are known whose parts were measured: by repeats or stated noise."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fbs import Frf, direct_frf
from fbs.measured.uncertainty import Scatter, coupled_uncertainty

from ..arrays import FloatArray
from ..errors import CommandError
from ..routes.source import Source
from ..routes.substitution import Substitution

Pair = tuple[str, str]

DECIBEL = 20 / np.log(10)  # dB of one neper
NORMAL_95 = 1.959963984540054  # standard deviations on either side that hold 95 %
NOISE = re.compile(r"([\d.eE+-]+)\s*%\s*(?:,\s*([\d.eE+-]+)\s*(?:deg|°))?")


@dataclass(frozen=True)
class Noise:
    """Of every measured FRF, one standard deviation: of its magnitude (1), its phase (rad)."""

    amplitude: float
    phase: float = 0.0


@dataclass(frozen=True, eq=False)
class Known:
    """How well one FRF of the assembly is known.

    Attributes
    ----------
    level
        (n_frequency,) dB on either side that hold 95 %, to first order.
    main
        The measured FRF that most of it comes from, as (part, response, excitation), and
    share
        its mean share over the lines.
    """

    level: FloatArray
    main: tuple[str, str, str]
    share: float


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
    """Errors of a part's FRFs: the noise stated, else the scatter of its runs; None if neither."""
    if noise is not None:
        return Scatter.relative(substitution.frf, noise.amplitude, noise.phase)
    if len(substitution.repeats) > 1:
        return Scatter.of_repeats(substitution.repeats)
    return None


def how_well_known(
    source: Source,
    substitutions: Sequence[Substitution],
    pairs: Sequence[Pair],
    noise: Noise | None = None,
) -> Mapping[Pair, Known]:
    """Carry the errors of measured parts through the coupling, to first order.

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
        Stated noise of all parts (None: the scatter of each one's runs).

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
    found = {}
    for response, excitation in pairs:
        level = np.zeros(frequency.size)
        main: tuple[tuple[str, str, str], float] = (("", "", ""), -1.0)
        for part, one in carried.items():
            level = level + one.deviations(response, excitation)[0] ** 2
            share = one.shares(response, excitation).mean(axis=0)
            main = max(main, _largest(part, stages[part], share), key=lambda known: known[1])
        found[response, excitation] = Known(NORMAL_95 * DECIBEL * np.sqrt(level), *main)
    return found


def _largest(part: str, frf: Frf, share: FloatArray) -> tuple[tuple[str, str, str], float]:
    i, j = np.unravel_index(int(np.argmax(share)), share.shape)
    return (part, frf.responses[i], frf.excitations[j]), float(share[i, j])
