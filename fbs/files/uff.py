"""Measured FRFs: universal files, dataset 58 (function at nodal DOF), ASCII or binary.

Written are complex functions in double precision, one per pair, after the SI units (dataset 164).
ASCII ordinates have twelve digits, binary ones all. An abscissa has six: E13.5 for its start and
its step, so an axis that needs more is refused, or written line by line where its lines have six.

Labels stand in full in ID lines 4 and 5 ("response: planetary.planet2.u", "excitation: ...").
Files from others have no such lines: there a label is node and direction, `12.z`, `12.rz`, `12` if
scalar, and `wing.12.z` with an entity name. A negative direction becomes the positive one of other
sign.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from .._kernels.checks import FloatArray
from .._kernels.door import door
from ..axes import frequency_axis
from ..errors import FbsError
from ..frf import Frf, Quantity, as_quantity
from .measurement import AS_STATED, Candidate, Contents, Given, Measured, few, take
from .stated_units import frequency_factor, frf_unit, states_ratio, unit_system
from .universal import (
    COHERENCE,
    EVEN,
    FRF,
    FUNCTION_TYPES,
    LINE,
    MULTIPLE_COHERENCE,
    TRANSMISSIBILITY,
    UNEVEN,
    Axis,
    End,
    Function,
    UffError,
    UnitSystem,
    Universal,
    read_universal,
)
from .universal_text import ASCII, function_text, six_digits, unit_system_text
from .whole_files import written_whole

RESPONSE, EXCITATION = "response: ", "excitation: "

FREQUENCY, FORCE = 18, 13
GENERAL = (0, 1)
DATA_TYPES = {8: Quantity.RECEPTANCE, 11: Quantity.MOBILITY, 12: Quantity.ACCELERANCE}
OTHER_TYPES = {
    2: "stress",
    3: "strain",
    5: "temperature",
    6: "heat flux",
    9: "reaction force",
    13: "force",
    15: "pressure",
    16: "mass",
}
UNITS = {Quantity.RECEPTANCE: "m", Quantity.MOBILITY: "m/s", Quantity.ACCELERANCE: "m/s^2"}
ANGULAR_UNITS = {unit: unit.replace("m", "rad") for unit in UNITS.values()}
DIRECTIONS = ("", "x", "y", "z", "rx", "ry", "rz")


@dataclass(frozen=True)
class Channel:
    """Where a DoF stands in a universal file.

    Attributes
    ----------
    node : int
    direction : int
        -6 to 6; above 3 a rotation, then written in rad and N m.
    radius : float
        r of a rotation carried as w = r·θ.
    """

    node: int
    direction: int = 0
    radius: float = 1.0

    @property
    def rotation(self) -> bool:
        """Whether it turns."""
        return abs(self.direction) > 3

    @property
    def end(self) -> End:
        """Node and direction."""
        return End(self.node, self.direction)


@door
def write_uff(
    frf: Frf,
    path: str | os.PathLike[str],
    channels: Mapping[str, Channel] | None = None,
    coherence: FloatArray | None = None,
    form: str = ASCII,
) -> None:
    """Write an FRF to a file as dataset 58; see `write_uff_to`.

    The file appears complete or not at all, and replaces an existing one.

    Raises
    ------
    UffError
        As for `write_uff_to`.
    OSError
        As for `files.written_whole`; FileNotFoundError where there is no such folder.
    """
    with written_whole(path) as file:
        write_uff_to(frf, file, channels, coherence, form)


def write_uff_to(
    frf: Frf,
    file: BinaryIO,
    channels: Mapping[str, Channel] | None = None,
    coherence: FloatArray | None = None,
    form: str = ASCII,
) -> None:
    """Write an FRF as dataset 58, one function per pair of response and excitation.

    The axis is written evenly spaced if its start and step have at most six digits, else line by
    line if all lines have.

    Parameters
    ----------
    frf : Frf
    file : binary file, open
    channels : mapping of str to Channel, optional
        Label → node and direction. A rotation is written as one, θ = w / r and M = r f. Labels
        that are not there get the next node numbers, as scalars.
    coherence : array, shape of the FRF's values, optional
        Written as functions of their own.
    form : "ascii" or "binary"

    Raises
    ------
    UffError
        Frequencies of more than six digits, fewer than two lines, labels that do not fit.
    """
    spacing = _spacing(frf.frequency)
    labels = dict.fromkeys(frf.responses + frf.excitations)
    for label in labels:
        refuse_unfit_label(label)
    places = _places(labels, channels or {})
    file.write(unit_system_text())
    for function in _functions(frf, places, spacing, coherence):
        file.write(function_text(function, form))


@door
def read_uff(
    path: str | os.PathLike[str],
    quantity: Quantity | str | None = None,
    unit: str | None = None,
    run: int | None = None,
) -> Frf:
    """Read the FRF matrix of a universal file, ASCII or binary; other datasets are passed over.

    The axis is rebuilt with `frequency_axis` where it can be, so that it equals a computed one in
    every digit and the FRF can be coupled. Values are brought to SI, see `stated_units`. Rotations
    stay in rad and N m: times or divided by r they become w = r·θ. `frf_files.read_frf` takes a
    block of a file that holds more.

    Parameters
    ----------
    path : path
    quantity, unit, run
        As in `measurement.Given`, where the file does not say it.

    Returns
    -------
    Frf
        Labels in order of appearance; frequency-contiguous.

    Raises
    ------
    UffError
        Truncated or damaged; no FRFs; pairs missing or twice; mixed axes or quantities; real
        ordinates; an abscissa that is no frequency; a quantity or unit that is not known or
        contradicts; NaN.
    OSError
    """
    source = Path(path)
    known = None if quantity is None else as_quantity(quantity)
    given = Given(known, (unit,) if unit else (), run)
    try:
        contents = uff_contents(read_universal(source), given)
        _require_matrix(contents, run)
        return take(contents, run=run).frf
    except FbsError as error:
        raise UffError(f"{source}: {str(error).removeprefix(f'{source}: ')}") from error


# --- writing -----------------------------------------------------------------------------------


def refuse_unfit_label(label: str) -> None:
    """Refuse a label that does not survive an ID line."""
    longest = LINE - max(len(RESPONSE), len(EXCITATION))
    if len(label) > longest:
        raise UffError(f"label {label!r} has {len(label)} characters; UFF takes {longest}")
    if not label.isprintable() or label != label.strip():
        raise UffError(f"label {label!r} would not survive: unprintable, or blanks at its ends")


def _places(labels: Mapping[str, None], channels: Mapping[str, Channel]) -> dict[str, Channel]:
    next_node = max((c.node for c in channels.values()), default=0) + 1
    places = dict(channels)
    for label in labels:
        if label not in places:
            places[label] = Channel(next_node)
            next_node += 1
    return places


def _functions(
    frf: Frf, places: Mapping[str, Channel], spacing: int, coherence: FloatArray | None
) -> Iterator[Function]:
    for j, excitation in enumerate(frf.excitations):
        for i, response in enumerate(frf.responses):
            to, at = places[response], places[excitation]
            values = frf.values[:, i, j] / (
                (to.radius if to.rotation else 1.0) * (at.radius if at.rotation else 1.0)
            )
            unit = UNITS[frf.quantity]
            data_type = {quantity: code for code, quantity in DATA_TYPES.items()}[frf.quantity]
            axes = (
                Axis(data_type, str(frf.quantity), ANGULAR_UNITS[unit] if to.rotation else unit),
                Axis(FORCE, "Moment" if at.rotation else "Force", "N m" if at.rotation else "N"),
            )
            yield _function(frf, (response, excitation), (to.end, at.end), axes, values, spacing)
            if coherence is not None:
                none = (Axis(0, "Coherence"), Axis(0))
                known = np.asarray(coherence[:, i, j])
                ends = (to.end, at.end)
                yield _function(
                    frf, (response, excitation), ends, none, known, spacing, kind=COHERENCE
                )


def _function(
    frf: Frf,
    pair: tuple[str, str],
    ends: tuple[End, End],
    axes: tuple[Axis, Axis],
    values: np.ndarray,
    spacing: int,
    kind: int = FRF,
) -> Function:
    response, excitation = pair
    name = str(frf.quantity) if kind == FRF else "coherence"
    return Function(
        (
            f"{name} {response} / {excitation}"[:LINE],
            "NONE",
            "NONE",
            RESPONSE + response,
            EXCITATION + excitation,
        ),
        kind,
        *ends,
        Axis(FREQUENCY, "Frequency", "Hz"),
        *axes,
        frf.frequency,
        values,
        spacing,
        float(frf.frequency[1] - frf.frequency[0]),
    )


def _spacing(axis: FloatArray) -> int:
    """Return EVEN or UNEVEN: which of the two carries the axis through E13.5 unharmed."""
    if axis.size < 2:
        raise UffError(f"UFF needs two lines at least, there is only {axis[0]:.10g} Hz")
    first, step = six_digits([axis[0], axis[1] - axis[0]])
    if step > 0 and _same(_even_axis(first, step, axis.size), axis):
        return EVEN
    stored = six_digits(axis)
    if _same(stored, axis):
        return UNEVEN
    worst = int(np.argmax(np.abs(stored - axis)))
    raise UffError(
        f"UFF keeps six digits of a frequency: neither a start of {axis[0]:.10g} Hz with a step "
        f"of {axis[1] - axis[0]:.10g} Hz nor every line fits ({axis[worst]:.12g} Hz would become "
        f"{stored[worst]:.12g} Hz); choose a start and a step of at most six digits, such as "
        f"{first:.10g} and {step:.10g} Hz, or another format"
    )


def _same(stored: FloatArray, axis: FloatArray) -> bool:
    return bool((np.abs(stored - axis) <= 1e-12 * axis).all())


def _even_axis(first: float, step: float, count: int) -> FloatArray:
    """Return first + k step, by `frequency_axis` where `first` is a multiple of the step."""
    start = first / step
    if abs(start - round(start)) <= 1e-9 * max(1.0, start):
        return frequency_axis(first, (round(start) + count - 1) * step, step)
    return np.asarray(first + step * np.arange(count))


# --- reading -----------------------------------------------------------------------------------


def uff_contents(file: Universal, given: Given = AS_STATED) -> Contents:
    """Return the FRFs of a universal file, its coherences, and what else it holds.

    Raises
    ------
    UffError
        It holds no FRF, or several unit systems.
    """
    system = unit_system(file.units)
    candidates: list[Candidate] = []
    others: dict[str, list[str]] = {}
    coherences: dict[tuple[str, str], list[FloatArray]] = {}
    for f in file.functions:
        other = _foreign(f) if f.kind == FRF else FUNCTION_TYPES.get(f.kind, f"type {f.kind}")
        if other is None:
            candidates.append(_candidate(f, system, given))
        elif f.kind in (COHERENCE, MULTIPLE_COHERENCE):
            pair = (dof_label(f, "response")[0], dof_label(f, "reference")[0])
            coherences.setdefault(pair, []).append(np.asarray(f.values.real, dtype=float))
        else:
            others.setdefault(other, []).append(dof_label(f, "response")[0])
    if not candidates:
        there = "; ".join(f"{words} of {few(labels)}" for words, labels in others.items())
        raise UffError(
            f"no FRF (dataset 58, function type 4) inside; {file}" + (f": {there}" if there else "")
        )
    listed = [f"{len(labels)} {words} ({few(labels)})" for words, labels in others.items()]
    return Contents(tuple(candidates), coherences, tuple(listed))


def _foreign(f: Function) -> str | None:
    """Say what a function of type 4 is where its data types show that it is no FRF of motion."""
    above, below = f.ordinate.kind, f.denominator.kind
    if above in DATA_TYPES and below in DATA_TYPES:
        return f"{FUNCTION_TYPES[TRANSMISSIBILITY]} (data type {above} per {below})"
    if above in OTHER_TYPES or below in set(OTHER_TYPES) - {FORCE} | set(DATA_TYPES):
        return f"{OTHER_TYPES.get(above, 'function')} (data type {above} per {below})"
    return None


def _candidate(f: Function, system: UnitSystem | None, given: Given) -> Candidate:
    response, response_sign = dof_label(f, "response")
    excitation, excitation_sign = dof_label(f, "reference")
    sign = response_sign * excitation_sign

    def measured() -> Measured:
        name = f"the FRF from {excitation!r} to {response!r}"
        quantity = _quantity(f, given, name)
        if not np.iscomplexobj(f.values):
            raise UffError(f"{name} is real, not complex")
        stated = frf_unit(
            (f.response, f.reference), (f.ordinate, f.denominator), quantity, system,
            given.units, name,
        )  # fmt: skip
        with np.errstate(invalid="ignore", over="ignore"):  # what is not finite is refused below
            values = f.values * (sign * stated.factor)
        axis = _axis(f, name)
        return Measured(
            response, excitation, quantity, axis, values, stated.angle, stated.moment, stated.note
        )

    return Candidate(response, excitation, measured)


def dof_label(f: Function, side: str) -> tuple[str, int]:
    """Return the label at one end, and the sign that makes its direction positive.

    Parameters
    ----------
    f : Function
    side : "response" or "reference"
    """
    end: End = getattr(f, side)
    line, prefix = (f.ids[3], RESPONSE) if side == "response" else (f.ids[4], EXCITATION)
    if line.startswith(prefix):
        return line[len(prefix) :], 1
    entity = "" if end.entity == "NONE" else end.entity
    parts = (entity, str(end.node), DIRECTIONS[abs(end.direction)])
    return ".".join(filter(None, parts)), -1 if end.direction < 0 else 1


def _quantity(f: Function, given: Given, name: str) -> Quantity:
    """Return what the data types say, or the user where they are general or unknown."""
    above, below = f.ordinate.kind, f.denominator.kind
    if f.abscissa.kind not in (FREQUENCY, *GENERAL):
        raise UffError(
            f"{name} has an abscissa of data type {f.abscissa.kind}, not {FREQUENCY} (frequency)"
        )
    stated = DATA_TYPES.get(above)
    if stated is not None and given.quantity not in (None, stated):
        raise UffError(f"{name} is {stated} (data type {above}), not {given.quantity} as given")
    if stated is not None and below == FORCE:
        return stated
    known = ", ".join(f"{code} ({quantity})" for code, quantity in DATA_TYPES.items())
    hint = "say what it is by its quantity and unit (--quantity accelerance --unit m/s^2/N)"
    if above not in (*GENERAL, *DATA_TYPES) or below not in (*GENERAL, FORCE):
        raise UffError(f"{name} is data type {above} per {below}; known are {known} per {FORCE}")
    ratio = given.quantity and states_ratio((f.ordinate, f.denominator), given.quantity)
    if given.quantity is None or not (given.units or ratio):
        raise UffError(
            f"{name} is data type {above} per {below}, which does not say what it is (known are "
            f"{known} per {FORCE}); {hint}"
        )
    return given.quantity


def _axis(f: Function, name: str) -> FloatArray:
    factor = frequency_factor(f.abscissa.unit, name)
    if f.spacing == UNEVEN:
        return f.x * factor
    first, step = float(f.x[0]) * factor, f.step * factor
    if not (first >= 0 and step > 0):
        raise UffError(f"the frequencies start at {first:g} Hz with a step of {step:g} Hz")
    return _even_axis(first, step, f.x.size)


def _require_matrix(contents: Contents, run: int | None) -> None:
    """Refuse a file whose FRFs are no whole matrix, or are several."""
    pairs = [c.pair for c in contents.candidates]
    responses, excitations = (list(dict.fromkeys(ends)) for ends in zip(*pairs, strict=True))
    twice = [pair for pair, n in Counter(pairs).items() if n > 1] if run is None else []
    if twice:
        response, excitation = twice[0]
        raise UffError(
            f"the FRF from {excitation!r} to {response!r} is there more than once; choose a run"
        )
    missing = sorted({(r, e) for r in responses for e in excitations} - set(pairs))
    if missing:
        shown = ", ".join(f"{excitation!r} to {response!r}" for response, excitation in missing[:5])
        more = ", ..." if len(missing) > 5 else ""
        count = len(responses) * len(excitations)
        raise UffError(f"{len(missing)} of {count} FRFs are missing: {shown}{more}")
