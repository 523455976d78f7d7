"""What a sweep varies: parameters by their place in the model file, and the values they take."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from itertools import product

import numpy as np

from mbs_models.model.parameters import Drivetrain

from ..arrays import FloatArray
from ..errors import CommandError
from ..routes.model_parameters import known_parameters

Values = tuple[float, ...]

DEFAULT_SAMPLES = 200
MOST_SAMPLES = 1_000_000
LARGEST = 1e100  # of a range's ends, whose difference must be a number
FORMS = "from:to:N, from:to:Nlog, v1,v2,v3, v±p% (uniform) or v~s% (normal)"
SAMPLINGS = ("lhs", "random")


@dataclass(frozen=True)
class Tolerance:
    """How a parameter is distributed: uniform within ``spread``, or normal with that deviation.

    A normal distribution is not truncated: what the model refuses is a sample that fails.
    """

    centre: float
    spread: float
    normal: bool

    def quantile(self, probability: FloatArray) -> FloatArray:
        """Values below which a share of the parameter's values lie."""
        if not self.normal:
            return self.centre + self.spread * (2.0 * probability - 1.0)
        from scipy.special import ndtri  # takes its time to load

        return np.asarray(self.centre + self.spread * ndtri(probability))


@dataclass(frozen=True)
class Variation:
    """One varied parameter: the values of a grid, or a tolerance to sample."""

    path: str
    values: Values = ()
    tolerance: Tolerance | None = None


@dataclass(frozen=True)
class Samples:
    """The samples of a sweep.

    Attributes
    ----------
    paths
        The varied parameters.
    rows
        Their values, sample by sample.
    sampled
        Whether some of them are sampled at random from tolerances.
    """

    paths: tuple[str, ...]
    rows: tuple[Values, ...]
    sampled: bool


def samples_of(
    drivetrain: Drivetrain,
    given: Sequence[str],
    samples: int | None = None,
    seed: int = 0,
    sampling: str | None = None,
) -> Samples:
    """The samples that ``PATH=SPEC`` options describe: a full grid of the values given.

    Parameters with a tolerance are sampled together, from a Latin hypercube (``sampling`` lhs, the
    default) or each by itself (random); beside a grid, the same samples are taken at every point.

    Raises
    ------
    CommandError
        An option cannot be read, or no such parameter exists.
    """
    variations = [variation(drivetrain, text) for text in given]
    if not variations:
        raise CommandError("--vary is missing: give PATH=SPEC, such as reducer.pinion.mass=1:3:50")
    paths = [v.path for v in variations]
    for path in paths:
        if paths.count(path) > 1:
            raise CommandError(f"--vary {path}: is given {paths.count(path)} times")
    grid = [v for v in variations if v.tolerance is None]
    sampled = [v for v in variations if v.tolerance is not None]
    for option, value in (("--samples", samples), ("--sampling", sampling)):
        if value is not None and not sampled:
            raise CommandError(
                f"{option} = {value}: needs a --vary with a tolerance (v±p% or v~s%)"
            )
    tolerances = [v.tolerance for v in sampled if v.tolerance is not None]
    taken = _sampled(tolerances, DEFAULT_SAMPLES if samples is None else samples, seed, sampling)
    total = math.prod(len(v.values) for v in grid) * len(taken)
    if total > MOST_SAMPLES:
        raise CommandError(f"--vary: {total} samples; at most {MOST_SAMPLES} are possible")
    order = [[*grid, *sampled].index(v) for v in variations]
    rows = [(*p, *d) for p in product(*(v.values for v in grid)) for d in taken]
    return Samples(
        tuple(paths), tuple(tuple(row[k] for k in order) for row in rows), sampled=bool(sampled)
    )


def _sampled(
    tolerances: Sequence[Tolerance], samples: int, seed: int, sampling: str | None
) -> list[Values]:
    if not tolerances:
        return [()]
    if not 1 <= samples <= MOST_SAMPLES:
        raise CommandError(f"--samples = {samples}: must be from 1 to {MOST_SAMPLES}")
    if seed < 0:
        raise CommandError(f"--seed = {seed}: must be a whole number, at least 0")
    if sampling not in (None, *SAMPLINGS):
        raise CommandError(f"--sampling = {sampling!r}: must be {' or '.join(SAMPLINGS)}")
    draw = _independent if sampling == "random" else _latin_hypercube
    shares = draw(samples, len(tolerances), np.random.default_rng(seed))
    values = [t.quantile(column) for t, column in zip(tolerances, shares.T, strict=True)]
    return [tuple(map(float, row)) for row in zip(*values, strict=True)]


def _independent(samples: int, n: int, rng: np.random.Generator) -> FloatArray:
    return rng.random((samples, n))


def _latin_hypercube(samples: int, n: int, rng: np.random.Generator) -> FloatArray:
    """Every 1/samples of each parameter's probability is drawn from once."""
    from scipy.stats import qmc  # takes its time to load

    return np.asarray(qmc.LatinHypercube(n, seed=rng).random(samples))


def variation(drivetrain: Drivetrain, text: str) -> Variation:
    """One ``PATH=SPEC``.

    Raises
    ------
    CommandError
        There is no such parameter, or the values cannot be read.
    """
    path, equals, spec = (part.strip() for part in text.partition("="))
    if not equals:
        raise CommandError(f"--vary {text!r}: must be PATH=SPEC, SPEC one of {FORMS}")
    known = known_parameters(drivetrain)
    if path not in known:
        raise CommandError(
            f"--vary {path}: no such number in '{drivetrain.name}'; {_near(path, known)}"
        )
    nominal = known[path]
    if "%" in spec:
        return Variation(path, tolerance=_tolerance(path, spec, nominal))
    values = _range(path, spec) if ":" in spec else _list(path, spec)
    if isinstance(nominal, int):
        values = tuple(int(v) if v.is_integer() else v for v in values)
    return Variation(path, values)


def _near(path: str, known: Mapping[str, object]) -> str:
    nearest = get_close_matches(path, known, n=3, cutoff=0.5)
    if nearest:
        return f"did you mean {' or '.join(nearest)}?"
    tables = dict.fromkeys(name.partition(".")[0] for name in known)
    return f"it has the tables {', '.join(tables)}"


def _tolerance(path: str, spec: str, nominal: object) -> Tolerance:
    match = re.fullmatch(r"(.*?)(±|\+-|\+/-|~)(.*)%", spec)
    if match is None:
        raise _unreadable(path, spec)
    if isinstance(nominal, int):
        raise CommandError(f"--vary {path}={spec}: a whole number has no tolerance; give v1,v2,v3")
    own = nominal if isinstance(nominal, float) else math.nan
    centre = _number(path, match[1], spec) if match[1].strip() else float(own)
    percent = _number(path, match[3], spec)
    if not percent > 0.0:
        raise CommandError(f"--vary {path}={spec}: the tolerance must be greater than 0 %")
    if not math.isfinite(centre):
        raise CommandError(f"--vary {path}={spec}: the model's value is no number; give one")
    if centre == 0.0:
        raise CommandError(f"--vary {path}={spec}: a percentage of 0 is 0; give another value")
    return Tolerance(centre, abs(centre) * percent / 100.0, normal=match[2] == "~")


def _range(path: str, spec: str) -> Values:
    match = re.fullmatch(r"([^:]+):([^:]+):\s*(\d+)\s*(log)?", spec)
    if match is None:
        raise _unreadable(path, spec)
    first, last = _number(path, match[1], spec), _number(path, match[2], spec)
    if max(abs(first), abs(last)) > LARGEST:
        raise CommandError(f"--vary {path}={spec}: must be within ±{LARGEST:g}")
    n = int(match[3])
    if not 2 <= n <= MOST_SAMPLES:
        raise CommandError(f"--vary {path}={spec}: {n} values; must be from 2 to {MOST_SAMPLES}")
    if match[4] is None:
        return tuple(map(float, np.linspace(first, last, n)))
    if min(first, last) <= 0.0:
        raise CommandError(f"--vary {path}={spec}: logarithmic limits must be greater than 0")
    return tuple(map(float, np.geomspace(first, last, n)))


def _list(path: str, spec: str) -> Values:
    return tuple(_number(path, item, spec) for item in spec.split(","))


def _number(path: str, text: str, spec: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise _unreadable(path, spec) from None
    if not math.isfinite(value):
        raise CommandError(f"--vary {path}={spec}: {text.strip()} is not finite")
    return value


def _unreadable(path: str, spec: str) -> CommandError:
    return CommandError(f"--vary {path}={spec}: cannot be read; SPEC must be {FORMS}")
