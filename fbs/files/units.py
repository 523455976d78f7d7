"""Unit labels as people write them: factor to SI and dimension.

A label is a product of powers of known names: `m/s²`, `(m/s^2)/N`, `m s-2 N⁻¹`, `in/sec**2`, `g`,
`1/kg`, `N-m`. Factors are exact by definition: inch 0.0254 m, pound 0.45359237 kg, standard gravity
9.80665 m/s² (BIPM, The International System of Units, 9th ed., 2019; NIST SP 811, appendix B).

What a label leaves open is settled by the dimension asked for, never by a guess: `m/N s` is
m/(N s) where a mobility is expected, `lb` a force under a motion, `g` gravity over a force and
a gram under a number. Capital letters throughout (`MM/S**2`) are read as lower-case ones where no
unit is written just so.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import product

from ..errors import FbsError

Dimension = tuple[int, int, int, int]
"""Exponents of length, mass, time and angle."""

NUMBER: Dimension = (0, 0, 0, 0)
LENGTH: Dimension = (1, 0, 0, 0)
MASS: Dimension = (0, 1, 0, 0)
TIME: Dimension = (0, 0, 1, 0)
ANGLE: Dimension = (0, 0, 0, 1)
FORCE: Dimension = (1, 1, -2, 0)
MOMENT: Dimension = (2, 1, -2, 0)

LONGEST = 60
"""Characters of a label; dataset 58 has twenty."""

NOTHING = {"", "none", "-", "n/a", "unknown"}


class UnitError(FbsError):
    """A label that names no known unit, or not one of the dimension needed."""


@dataclass(frozen=True)
class Unit:
    """A value in this unit, times `factor`, is the value in SI.

    Attributes
    ----------
    factor : float
    dimension : tuple of int
        Exponents of length, mass, time and angle.
    force : float
        The share of `factor` that forces below the fraction line have: 1/4.448… of `g/lbf`.
    """

    factor: float
    dimension: Dimension
    force: float = 1.0


def times(first: Dimension, second: Dimension, power: int = 1) -> Dimension:
    """Return the dimension of first × second^power."""
    length, mass, time, angle = (a + power * b for a, b in zip(first, second, strict=True))
    return length, mass, time, angle


def is_nothing(label: str) -> bool:
    """Whether a label states no unit."""
    return label.strip().lower() in NOTHING


def read_unit(label: str, allowed: Iterable[Dimension]) -> Unit | None:
    """Return the unit a label names, of one of the dimensions allowed; None if of another.

    Parameters
    ----------
    label : str
    allowed : dimensions

    Raises
    ------
    UnitError
        A name that is not known, no product of powers, or two readings of different size.
    """
    wanted = set(allowed)
    found = [unit for unit in readings(label) if unit.dimension in wanted]
    if not found:
        return None
    if any(not math.isclose(unit.factor, found[0].factor) for unit in found):
        sizes = " or ".join(f"{unit.factor:.6g}" for unit in found)
        raise UnitError(f"the unit {label!r} has two readings ({sizes} in SI); write it out")
    return found[0]


@lru_cache(maxsize=256)
def readings(label: str) -> tuple[Unit, ...]:
    """Return everything a label can mean.

    Raises
    ------
    UnitError
        A name that is not known, or no product of powers.
    """
    text = _plain(label)
    found: dict[tuple[float, Dimension], Unit] = {}
    for tight in (True, False):
        for factors in _products(label, text, tight):
            unit = _multiplied(factors)
            found.setdefault((unit.factor, unit.dimension), unit)
    return tuple(found.values())


# --- names -------------------------------------------------------------------------------------

INCH, POUND, GRAVITY = 0.0254, 0.45359237, 9.80665
DEGREE = math.pi / 180

PREFIXES: Mapping[str, float] = {
    "": 1.0,
    "n": 1e-9,
    "u": 1e-6,
    "µ": 1e-6,
    "m": 1e-3,
    "c": 1e-2,
    "d": 1e-1,
    "k": 1e3,
    "M": 1e6,
}
PREFIXED: Mapping[str, tuple[float, Dimension]] = {
    "m": (1.0, LENGTH),
    "s": (1.0, TIME),
    "N": (1.0, FORCE),
    "Nm": (1.0, MOMENT),
    "rad": (1.0, ANGLE),
    "Hz": (1.0, times(NUMBER, TIME, -1)),
}
NAMES: Mapping[str, tuple[tuple[float, Dimension], ...]] = {
    name: tuple(meanings)
    for names, *meanings in (
        ("metre metres meter meters", (1.0, LENGTH)),
        ("in inch inches", (INCH, LENGTH)),
        ("ft foot feet", (12 * INCH, LENGTH)),
        ("mil mils thou", (1e-3 * INCH, LENGTH)),
        ("sec second seconds", (1.0, TIME)),
        ("min minute minutes", (60.0, TIME)),
        ("kg kilogram kilograms", (1.0, MASS)),
        ("g", (GRAVITY, times(LENGTH, TIME, -2)), (1e-3, MASS)),
        ("gn g_n g0 g_0 G gravity", (GRAVITY, times(LENGTH, TIME, -2))),
        ("lb lbs pound pounds", (POUND * GRAVITY, FORCE), (POUND, MASS)),
        ("lbf", (POUND * GRAVITY, FORCE)),
        ("lbm", (POUND, MASS)),
        ("kgf kp", (GRAVITY, FORCE)),
        ("newton newtons", (1.0, FORCE)),
        ("dyn", (1e-5, FORCE)),
        ("Nmm", (1e-3, MOMENT)),
        ("Ns", (1.0, times(FORCE, TIME))),
        ("ips", (INCH, times(LENGTH, TIME, -1))),
        ("radian radians", (1.0, ANGLE)),
        ("deg degree degrees °", (DEGREE, ANGLE)),
        ("rev", (2 * math.pi, ANGLE)),
        ("rpm", (2 * math.pi / 60, times(ANGLE, TIME, -1))),
        ("hertz cps", (1.0, times(NUMBER, TIME, -1))),
        ("cpm", (1 / 60, times(NUMBER, TIME, -1))),
    )
    for name in names.split()
}


@lru_cache(maxsize=1)
def _known() -> tuple[Mapping[str, list[tuple[float, Dimension]]], ...]:
    """Meanings by the name as it is written, and by the name in lower case."""
    exact: dict[str, list[tuple[float, Dimension]]] = {
        name: list(meanings) for name, meanings in NAMES.items()
    }
    for (prefix, scale), (name, (size, dimension)) in product(PREFIXES.items(), PREFIXED.items()):
        exact.setdefault(prefix + name, []).append((scale * size, dimension))
    lower: dict[str, list[tuple[float, Dimension]]] = {}
    for name, meanings in exact.items():
        if not name.startswith("M"):  # nobody means mega where all letters are capital
            lower.setdefault(name.lower(), []).extend(meanings)
    return exact, lower


def _meanings(label: str, name: str) -> list[tuple[float, Dimension]]:
    exact, lower = _known()
    found = exact.get(name) or lower.get(name.lower())
    if not found:
        raise UnitError(f"the unit {label!r} is not known ({name!r} is none)")
    return found


# --- grammar -----------------------------------------------------------------------------------

SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
SIGNS = {"μ": "µ", "·": "*", "⋅": "*", "∙": "*", "•": "*", "×": "*", "−": "-", "÷": "/", "**": "^"}
MISREAD = {"Â²": "²", "Â³": "³", "Âµ": "µ", "Â·": "·", "Â°": "°"}
"""UTF-8 that a program took for Latin-1 and wrote again."""

TOKEN = re.compile(
    r"\s*(?:(?P<name>[A-Za-zµ°_]+(?:_?[n0](?![\d^]))?)|(?P<number>\d+(?:\.\d+)?)"
    r"|(?P<sign>[*/^()\-.+]))"
)
POWER = re.compile(r"\s*(?:\^\s*(?P<hat>[+-]?\d+|\([+-]?\d+\))|(?P<bare>-?\d+))")

Factor = tuple[list[tuple[float, Dimension]], int]


def _plain(label: str) -> str:
    text = label.strip().strip("[]").strip()
    if len(text) > LONGEST:
        raise UnitError(f"the unit {text[:20] + '…'!r} has {len(text)} characters; no unit has")
    for wrong, right in {**MISREAD, **SIGNS}.items():
        text = text.replace(wrong, right)
    return text.translate(SUPERSCRIPTS)


def _products(label: str, text: str, tight: bool) -> Iterator[list[tuple[float, Dimension, int]]]:
    """Yield, for every choice of meanings, the factors with their exponents.

    A product sign binds tighter than the fraction line if `tight`: m/N s is m/(N s).
    """
    factors, end = _fraction(label, text, 0, tight)
    if text[end:].strip(" .") or not factors:
        raise UnitError(f"the unit {label!r} is no product of powers of units")
    for chosen in product(*(meanings for meanings, _ in factors)):
        powers = (power for _, power in factors)
        yield [(*meaning, power) for meaning, power in zip(chosen, powers, strict=True)]


def _fraction(label: str, text: str, at: int, tight: bool) -> tuple[list[Factor], int]:
    """Read products and fraction lines up to the end or a closing bracket."""
    factors: list[Factor] = []
    below = 1
    while True:
        found, at = _term(label, text, at, tight)
        factors += [(meanings, below * power) for meanings, power in found]
        sign, after = _sign(text, at)
        if sign in ("", ")"):
            return factors, at
        below = -1 if sign == "/" else 1
        at = after if sign in "/*-." else at


def _term(label: str, text: str, at: int, tight: bool) -> tuple[list[Factor], int]:
    factors, at = _power(label, text, at, tight)
    while tight:
        sign, after = _sign(text, at)
        if sign in ("", ")", "/"):
            break
        more, at = _power(label, text, after if sign in "*-." else at, tight)
        factors += more
    return factors, at


def _sign(text: str, at: int) -> tuple[str, int]:
    """Return the sign that follows, " " for a mere blank between names, and where it ends."""
    if not text[at:].strip(" ."):
        return "", at
    token = TOKEN.match(text, at)
    if token is None:
        return "?", at
    sign = token["sign"]
    return (sign, token.end()) if sign and sign in "*/-.)" else (" ", at)


def _power(label: str, text: str, at: int, tight: bool) -> tuple[list[Factor], int]:
    token = TOKEN.match(text, at)
    if token is None:
        raise UnitError(f"the unit {label!r} is no product of powers of units")
    factors: list[Factor]
    if token["sign"] == "(":
        factors, end = _fraction(label, text, token.end(), tight)
        close = TOKEN.match(text, end)
        if close is None or close["sign"] != ")":
            raise UnitError(f"the unit {label!r} has an open bracket")
        at = close.end()
    elif token["number"]:
        return [([(float(token["number"]), NUMBER)], 1)], token.end()
    elif token["name"]:
        factors, at = [(_meanings(label, token["name"]), 1)], token.end()
    else:
        raise UnitError(f"the unit {label!r} is no product of powers of units")
    raised = POWER.match(text, at)
    if raised is None:
        return factors, at
    power = int((raised["hat"] or raised["bare"]).strip("()"))
    if not 1 <= abs(power) <= 4:
        raise UnitError(f"the unit {label!r} has the exponent {power}; must be from -4 to 4")
    return [(meanings, exponent * power) for meanings, exponent in factors], raised.end()


def _multiplied(factors: Iterable[tuple[float, Dimension, int]]) -> Unit:
    factor, force, dimension = 1.0, 1.0, NUMBER
    for size, of, power in factors:
        factor *= size**power
        dimension = times(dimension, of, power)
        if power < 0 and of in (FORCE, MOMENT):
            force *= size**power
    return Unit(factor, dimension, force)
