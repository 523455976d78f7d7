"""What unit a function of a universal file is in: its labels and dataset 164 read together.

Dataset 164 says file = SI × factor of length and force; labels say it in words. Programs keep the
one, the other, or both. Where both are there they must agree: one that scales by 164 and one that
scales by the labels would differ, and which was right no reader can tell.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

from ..frf import Quantity
from .units import (
    ANGLE,
    FORCE,
    LENGTH,
    MOMENT,
    TIME,
    Dimension,
    Unit,
    is_nothing,
    read_unit,
    times,
)
from .universal import Axis, End, UffError, UnitSystem

SAME_UNIT = 1e-4
"""Relative: factors of one unit written with other digits (39.37 and 39.3701 inches a metre)."""

CODES = {
    1: (1.0, 1.0),
    2: (1 / 0.3048, 1 / 4.4482216152605),
    3: (1.0, 1 / 9.80665),
    4: (1 / 0.3048, 1 / 0.138254954376),
    5: (1e3, 1e3),
    6: (1e2, 1e2),
    7: (1 / 0.0254, 1 / 4.4482216152605),
    8: (1e3, 1 / 9.80665),
    10: (1e3, 1.0),
}
"""Length and force of the unit codes of dataset 164; 9 is the user's own."""

Kind = tuple[bool, bool]
"""Whether the response is an angle, and the excitation a moment."""


@dataclass(frozen=True)
class Stated:
    """A value in the file, times `factor`, is m or rad (per s or s²) per N or N m.

    Attributes
    ----------
    factor : float
    angle, moment : bool
        Whether the response is a rotation (rad) and the excitation a moment (N m).
    note : str
        What was assumed or overruled; empty if nothing.
    """

    factor: float
    angle: bool
    moment: bool = False
    note: str = ""


def unit_system(found: Sequence[UnitSystem]) -> UnitSystem | None:
    """Return the one unit system of a file, or None if it has none.

    Raises
    ------
    UffError
        Several, or a unit code whose own factors are others.
    """
    factors = sorted({(one.length, one.force) for one in found})
    if len(factors) > 1:
        raise UffError(f"several unit systems (dataset 164), length and force {factors}")
    if not found:
        return None
    one = found[0]
    expected = CODES.get(one.code, factors[0])
    if not all(
        math.isclose(a, b, rel_tol=SAME_UNIT) for a, b in zip(expected, factors[0], strict=True)
    ):
        raise UffError(
            f"dataset 164 has the unit code {one.code}, which is length {expected[0]:g} and force "
            f"{expected[1]:g}, but the factors length {one.length:g} and force {one.force:g}"
        )
    return one


def frf_unit(
    ends: tuple[End, End],
    axes: tuple[Axis, Axis],
    quantity: Quantity,
    system: UnitSystem | None,
    given: Sequence[str],
    name: str,
) -> Stated:
    """Return the unit of an FRF from its labels, dataset 164, and what the user gives.

    Parameters
    ----------
    ends : (End, End)
        Response and reference.
    axes : (Axis, Axis)
        Ordinate and its denominator. The ordinate's unit may be the whole ratio.
    quantity : Quantity
    system : UnitSystem or None
    given : str
        Units such as "m/s^2/N" that the user gives, which overrule what the file says; the one of
        the right dimension counts.
    name : str
        Of the function, for messages.

    Raises
    ------
    UffError
        A unit that is not known or of another dimension, labels and dataset 164 that contradict,
        a motion where a force should be.
    """
    kinds = list(product(_rotations(ends[0]), _rotations(ends[1])))
    if given:
        try:
            own = frf_unit(ends, axes, quantity, system, (), name)
        except UffError:
            own = None
        return _given(given, kinds, own, _words(axes), quantity, name)
    top = _known(axes[0].unit, _tops(quantity), name)
    below = _known(axes[1].unit, (FORCE, MOMENT, *_motions()), name)
    if below is not None and below.dimension in _motions():
        raise UffError(
            f"{name} is a transmissibility: {axes[0].unit!r} per {axes[1].unit!r}, both motions; "
            "an FRF is motion per force"
        )
    fitting = [k for k in kinds if _fits(k, top, below, quantity)]
    if not fitting:
        raise UffError(
            f"{name} goes from {_place(ends[1])} to {_place(ends[0])}, but has the unit "
            f"{axes[0].unit!r} per {axes[1].unit!r}: rotations and translations do not match"
        )
    kind = fitting[0]
    if top is None and below is None:
        note = "" if system else "no unit is stated: taken as SI"
        return Stated(_by_system(kind, system), *kind, note)
    factor = _by_labels(kind, top, below, system, quantity, name, axes)
    stated = _by_system(kind, system)
    if system is not None and not math.isclose(factor, stated, rel_tol=SAME_UNIT):
        raise UffError(
            f"{name} contradicts itself: its labels say {_words(axes)} (× {factor:.6g} is SI), "
            f"dataset 164 ({system.description or system.code}) length {system.length:g} and force "
            f"{system.force:g} (× {stated:.6g} is SI); give the right unit (--unit)"
        )
    return Stated(factor, *kind)


def channel_unit(
    end: End, axis: Axis, quantity: Quantity | None, system: UnitSystem | None, name: str
) -> Stated:
    """Return the unit of a channel of time: a motion, or a force if `quantity` is None.

    Raises
    ------
    UffError
        As for `frf_unit`.
    """
    dimensions = {rotation: _channel_dimension(rotation, quantity) for rotation in _rotations(end)}
    unit = _known(axis.unit, [_channel_dimension(r, quantity) for r in (False, True)], name)
    if unit is not None and unit.dimension not in dimensions.values():
        raise UffError(
            f"{name} is at {_place(end)}, but has the unit {axis.unit!r}: rotations and "
            "translations do not match"
        )
    rotation = next(r for r, d in dimensions.items() if unit is None or d == unit.dimension)
    length, force = (system.length, system.force) if system else (1.0, 1.0)
    si = force * length**rotation if quantity is None else length ** (not rotation)
    stated = 1 / si
    if unit is None:
        return Stated(stated, rotation, note="" if system else "no unit is stated: taken as SI")
    if system is not None and not math.isclose(unit.factor, stated, rel_tol=SAME_UNIT):
        raise UffError(
            f"{name} contradicts itself: its label says {axis.unit!r} (× {unit.factor:.6g} is SI), "
            f"dataset 164 ({system.description or system.code}) length {length:g} and force "
            f"{force:g} (× {stated:.6g} is SI)"
        )
    return Stated(unit.factor, rotation)


def frequency_factor(label: str, name: str) -> float:
    """Return what makes hertz of an abscissa.

    Raises
    ------
    UffError
        Its unit is none of frequency.
    """
    if is_nothing(label):
        return 1.0
    turns = times(ANGLE, TIME, -1)
    unit = read_unit(label, (times((0, 0, 0, 0), TIME, -1), turns))
    if unit is None:
        raise UffError(f"{name} has an abscissa in {label!r}, no unit of frequency")
    return unit.factor / (2 * math.pi) if unit.dimension == turns else unit.factor


def states_ratio(axes: tuple[Axis, Axis], quantity: Quantity) -> bool:
    """Whether labels state motion and force: both, or the ordinate their ratio."""
    if is_nothing(axes[0].unit):
        return False
    motions = [motion_dimension(angle, quantity) for angle in (False, True)]
    return not is_nothing(axes[1].unit) or read_unit(axes[0].unit, motions) is None


# --- parts -------------------------------------------------------------------------------------


def motion_dimension(angle: bool, quantity: Quantity) -> Dimension:
    """Return the dimension of a displacement, velocity or acceleration."""
    return times(ANGLE if angle else LENGTH, TIME, -quantity.derivative)


def ratio_dimension(kind: Kind, quantity: Quantity) -> Dimension:
    """Return the dimension of an FRF."""
    return times(motion_dimension(kind[0], quantity), MOMENT if kind[1] else FORCE, -1)


def _channel_dimension(rotation: bool, quantity: Quantity | None) -> Dimension:
    if quantity is None:
        return MOMENT if rotation else FORCE
    return motion_dimension(rotation, quantity)


def _rotations(end: End) -> tuple[bool, ...]:
    """What an end's direction allows: a scalar is what its unit says, else a translation."""
    return (False, True) if end.direction == 0 else (abs(end.direction) > 3,)


def _motions() -> list[Dimension]:
    return [motion_dimension(angle, q) for angle in (False, True) for q in Quantity]


def _tops(quantity: Quantity) -> list[Dimension]:
    ratios = [ratio_dimension((a, m), quantity) for a in (False, True) for m in (False, True)]
    return [*(motion_dimension(angle, quantity) for angle in (False, True)), *ratios]


def _known(label: str, allowed: Sequence[Dimension], name: str) -> Unit | None:
    """Return a label's unit, or None where nothing is stated; refuse one of another dimension."""
    if is_nothing(label):
        return None
    try:
        unit = read_unit(label, allowed)
    except ValueError as error:
        raise UffError(f"{name}: {error}") from error
    if unit is None:
        raise UffError(f"{name} has the unit {label!r}, which its data type cannot have")
    return unit


def _fits(kind: Kind, top: Unit | None, below: Unit | None, quantity: Quantity) -> bool:
    angle, moment = kind
    tops = (motion_dimension(angle, quantity), ratio_dimension(kind, quantity))
    return (top is None or top.dimension in tops) and (
        below is None or below.dimension == (MOMENT if moment else FORCE)
    )


def _by_system(kind: Kind, system: UnitSystem | None) -> float:
    """An angle has no length, a moment has one."""
    if system is None:
        return 1.0
    return _top_by_system(kind, system) / _below_by_system(kind, system)


def _top_by_system(kind: Kind, system: UnitSystem | None) -> float:
    return 1.0 if kind[0] or system is None else 1 / system.length


def _below_by_system(kind: Kind, system: UnitSystem | None) -> float:
    if system is None:
        return 1.0
    return 1 / (system.force * system.length) if kind[1] else 1 / system.force


def _by_labels(
    kind: Kind,
    top: Unit | None,
    below: Unit | None,
    system: UnitSystem | None,
    quantity: Quantity,
    name: str,
    axes: tuple[Axis, Axis],
) -> float:
    """Return the factor the labels state; what one leaves out, dataset 164 or SI says."""
    if top is not None and top.dimension == ratio_dimension(kind, quantity):
        if below is not None and not math.isclose(top.force * below.factor, 1.0):
            raise UffError(
                f"{name} contradicts itself: its ordinate is in {axes[0].unit!r}, its denominator "
                f"in {axes[1].unit!r}; give the right unit (--unit)"
            )
        return top.factor
    upper = _top_by_system(kind, system) if top is None else top.factor
    lower = _below_by_system(kind, system) if below is None else below.factor
    return upper / lower


def _given(
    given: Sequence[str],
    kinds: Sequence[Kind],
    own: Stated | None,
    words: str,
    quantity: Quantity,
    name: str,
) -> Stated:
    """Return the unit the user gives, with a note if the function's `own` is another."""
    for kind, label in product(kinds, given):
        unit = read_unit(label, [ratio_dimension(kind, quantity)])
        if unit is not None:
            same = own and (own.note or math.isclose(own.factor, unit.factor, rel_tol=SAME_UNIT))
            note = "" if same else f"taken as {label}, as given, where labels say {words}"
            return Stated(unit.factor, *kind, note)
    raise UffError(f"{name} is {quantity}, which no unit given has ({', '.join(given)})")


def _words(axes: tuple[Axis, Axis]) -> str:
    return f"{axes[0].unit} per {axes[1].unit}"


def _place(end: End) -> str:
    if end.direction == 0:
        return f"a scalar at node {end.node}"
    motion = "a rotation" if abs(end.direction) > 3 else "a translation"
    return f"{motion} at node {end.node}"
