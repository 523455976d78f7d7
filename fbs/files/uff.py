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
import re
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import BinaryIO

import numpy as np

from .._kernels.checks import FloatArray
from .._kernels.door import door
from ..errors import FbsError
from ..frf import Frf, Quantity, as_quantity
from .channel_map import signed
from .measurement import AS_STATED, Candidate, Contents, Given, Measured, few, take
from .stated_units import frequency_factor, frf_unit, states_ratio, unit_system
from .uff_functions import (
    DATA_TYPES,
    EXCITATION,
    FORCE,
    FREQUENCY,
    RESPONSE,
    Channel,
    even_axis,
    functions,
)
from .universal import (
    COHERENCE,
    FRF,
    FUNCTION_TYPES,
    MULTIPLE_COHERENCE,
    TRANSMISSIBILITY,
    UNEVEN,
    End,
    Function,
    UffError,
    UnitSystem,
    Universal,
    read_universal,
)
from .universal_text import ASCII, function_text, unit_system_text
from .whole_files import written_whole

AVERAGES = re.compile(
    r"\b(?P<first>\d{1,6})\s*averages?\b|\baverages?\s*[:=]?\s*(?P<second>\d{1,6})\b", re.IGNORECASE
)

GENERAL = (0, 1)
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
DIRECTIONS = ("", "x", "y", "z", "rx", "ry", "rz")


@door
def write_uff(
    frf: Frf,
    path: str | os.PathLike[str],
    channels: Mapping[str, Channel] | None = None,
    coherence: FloatArray | None = None,
    form: str = ASCII,
    averages: Mapping[str, int] | None = None,
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
        write_uff_to(frf, file, channels, coherence, form, averages)


def write_uff_to(
    frf: Frf,
    file: BinaryIO,
    channels: Mapping[str, Channel] | None = None,
    coherence: FloatArray | None = None,
    form: str = ASCII,
    averages: Mapping[str, int] | None = None,
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
    averages : mapping of str to int, optional
        Excitation → of how many averages its coherence is: "6 averages" in its ID line 3.

    Raises
    ------
    UffError
        Frequencies of more than six digits, fewer than two lines, labels that do not fit.
    """
    file.write(unit_system_text())
    for function in functions(frf, channels or {}, coherence, averages or {}):
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
    averages: dict[str, int] = {}
    for f in file.functions:
        other = _foreign(f) if f.kind == FRF else FUNCTION_TYPES.get(f.kind, f"type {f.kind}")
        if other is None:
            candidates.append(_candidate(f, system, given))
        elif f.kind in (COHERENCE, MULTIPLE_COHERENCE):
            pair = (dof_label(f, "response")[0], dof_label(f, "reference")[0])
            coherences.setdefault(pair, []).append(np.asarray(f.values.real, dtype=float))
            if count := _averages(f):
                averages[pair[1]] = min(count, averages.get(pair[1], count))
        else:
            others.setdefault(other, []).append(dof_label(f, "response")[0])
    if not candidates:
        there = "; ".join(f"{words} of {few(labels)}" for words, labels in others.items())
        raise UffError(
            f"no FRF (dataset 58, function type 4) inside; {file}" + (f": {there}" if there else "")
        )
    listed = [f"{len(labels)} {words} ({few(labels)})" for words, labels in others.items()]
    return Contents(tuple(candidates), coherences, averages, tuple(listed))


def _averages(f: Function) -> int | None:
    """Return how many averages an ID line names: "6 averages", "Averages: 6"."""
    match = next(filter(None, (AVERAGES.search(line) for line in f.ids[:3])), None)
    return int(match["first"] or match["second"]) if match else None


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
        label, sign = signed(line[len(prefix) :])
        return label, int(sign)
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
    return even_axis(first, step, f.x.size)


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
