"""Measured FRFs: universal files, dataset 58 (function at nodal DOF), through pyuff.

Format: https://www.ceas3.uc.edu/sdrluff/, datasets 58 and 164.

Written are ASCII double-precision complex functions, one per pair, after the SI units (dataset
164). Ordinates have twelve digits. An abscissa has six: E13.5 for its start and its step, and
E13.5 again for every line of unevenly spaced ones, so an axis that needs more is refused.

Labels stand in full in ID lines 4 and 5 ("response: planetary.planet2.u", "excitation: ..."); the
node is the label's number in order of appearance, its direction 0 (scalar). Files from others
have no such lines: there a label is node and direction, `12.z`, `12.rz`, `12` if scalar, and
`wing.12.z` with an entity name. A negative direction becomes the positive one of other sign.
"""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO

import numpy as np

from .._kernels.checks import ComplexArray, FloatArray
from .._kernels.door import door
from ..axes import frequency_axis, require_same_frequency
from ..errors import FbsError
from ..frf import Frf, Quantity
from .whole_files import written_whole

RESPONSE, EXCITATION = "response: ", "excitation: "
LINE = 80
"""Characters of an ID line."""

FRF_FUNCTION, FREQUENCY, FORCE = 4, 18, 13
EVEN, UNEVEN = 1, 0
COMPLEX = (5, 6)
DATA_TYPES = {8: Quantity.RECEPTANCE, 11: Quantity.MOBILITY, 12: Quantity.ACCELERANCE}
UNITS = {Quantity.RECEPTANCE: "m", Quantity.MOBILITY: "m/s", Quantity.ACCELERANCE: "m/s^2"}
DIRECTIONS = ("", "x", "y", "z", "rx", "ry", "rz")
SPELLINGS = {
    Quantity.RECEPTANCE: {"m", "rad"},
    Quantity.MOBILITY: {"m/s", "rad/s"},
    Quantity.ACCELERANCE: {"m/s^2", "m/s2", "rad/s^2", "rad/s2"},
}
FORCE_SPELLINGS = {"n", "nm", "n*m", "n.m"}


class UffError(FbsError):
    """A universal file that holds no FRF matrix, or an FRF that does not fit into one."""


@door
def write_uff(frf: Frf, path: str | os.PathLike[str]) -> None:
    """Write an FRF to a file as dataset 58; see `write_uff_to`.

    The file appears complete or not at all.

    Parameters
    ----------
    frf : Frf
    path : path
        Replaced if it exists.

    Raises
    ------
    UffError
        As for `write_uff_to`.
    OSError
        As for `files.written_whole`; FileNotFoundError where there is no such folder.
    """
    with written_whole(path) as file:
        write_uff_to(frf, file)


def write_uff_to(frf: Frf, file: BinaryIO) -> None:
    """Write an FRF as dataset 58, one function per pair of response and excitation.

    Values keep twelve digits. The axis is written evenly spaced if its start and step have at most
    six digits, else line by line if all lines have.

    Parameters
    ----------
    frf : Frf
    file : binary file, open

    Raises
    ------
    UffError
        Frequencies of more than six digits, fewer than two lines, or labels that do not fit.
    """
    spacing = _spacing(frf.frequency)
    labels = dict.fromkeys(frf.responses + frf.excitations)
    for label in labels:
        refuse_unfit_label(label)
    nodes = {label: number for number, label in enumerate(labels, start=1)}
    functions = (
        _function(frf, response, excitation, nodes, spacing)
        for excitation in frf.excitations
        for response in frf.responses
    )
    write_datasets(chain([si_units()], functions), file)


@door
def read_uff(path: str | os.PathLike[str]) -> Frf:
    """Read the FRF matrix of a universal file, ASCII or binary; other datasets are passed over.

    The axis is rebuilt with `frequency_axis` where it can be, so that it equals a computed one in
    every digit and the FRF can be coupled. Units are brought to SI by dataset 164; without it
    they are SI. Rotations stay in rad and N m: times or divided by r they become w = r·θ.

    Parameters
    ----------
    path : path

    Returns
    -------
    Frf
        Labels in order of appearance; frequency-contiguous.

    Raises
    ------
    UffError
        Truncated or damaged; no FRFs; pairs missing or twice; mixed axes or quantities; real
        ordinates; an abscissa that is no frequency; a quantity or unit that is not known; NaN.
    FileNotFoundError
    """
    source = Path(path)
    try:
        return _matrix(_measurements(source))
    except FbsError as error:
        raise UffError(f"{source}: {error}") from error


class _PyuffErrors:
    """Turn what pyuff raises, a bare `Exception`, into an error that says what failed."""

    def __init__(self, failure: str) -> None:
        self.failure = failure

    def __enter__(self) -> None:
        return None

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if kind is Exception:
            raise UffError(f"{self.failure} ({error})") from error


# --- writing -----------------------------------------------------------------------------------


def write_datasets(datasets: Iterable[dict[str, Any]], file: BinaryIO) -> None:
    """Write datasets by pyuff, which reads a file again after every one: each to a small one."""
    import pyuff

    with tempfile.TemporaryDirectory(prefix="uff-") as folder:
        scratch = Path(folder, "dataset")
        for dataset in datasets:
            # 'overwrite' is safe in ASCII only: in binary pyuff writes the data over the header
            with _PyuffErrors("the universal file could not be written"):
                pyuff.UFF(str(scratch)).write_sets(dataset, mode="overwrite")
            file.write(scratch.read_bytes())


def si_units() -> dict[str, Any]:
    """Return the dataset 164 of SI units."""
    return {
        "type": 164,
        "units_code": 1,
        "units_description": "SI",
        "temp_mode": 1,
        "length": 1.0,
        "force": 1.0,
        "temp": 1.0,
        "temp_offset": 273.15,
    }


def _function(
    frf: Frf, response: str, excitation: str, nodes: dict[str, int], spacing: int
) -> dict[str, Any]:
    data_type = {quantity: code for code, quantity in DATA_TYPES.items()}[frf.quantity]
    return {
        "type": 58,
        "binary": 0,
        "id1": f"{frf.quantity} {response} / {excitation}"[:LINE],
        "id4": RESPONSE + response,
        "id5": EXCITATION + excitation,
        "func_type": FRF_FUNCTION,
        "rsp_node": nodes[response],
        "rsp_dir": 0,
        "ref_node": nodes[excitation],
        "ref_dir": 0,
        "abscissa_spacing": spacing,
        "abscissa_spec_data_type": FREQUENCY,
        "abscissa_axis_lab": "Frequency",
        "abscissa_axis_units_lab": "Hz",
        "ordinate_spec_data_type": data_type,
        "ordinate_len_unit_exp": 1,
        "ordinate_axis_lab": str(frf.quantity),
        "ordinate_axis_units_lab": UNITS[frf.quantity],
        "orddenom_spec_data_type": FORCE,
        "orddenom_force_unit_exp": 1,
        "orddenom_axis_lab": "Force",
        "orddenom_axis_units_lab": "N",
        "data": frf.between(response, excitation),
        "x": frf.frequency,
    }


def refuse_unfit_label(label: str) -> None:
    """Refuse a label that does not survive an ID line."""
    longest = LINE - max(len(RESPONSE), len(EXCITATION))
    if len(label) > longest:
        raise UffError(f"label {label!r} has {len(label)} characters; UFF takes {longest}")
    if not label.isprintable() or label != label.strip():
        raise UffError(f"label {label!r} would not survive: unprintable, or blanks at its ends")


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


def six_digits(values: Iterable[float]) -> FloatArray:
    """Return the values as E13.5 keeps them."""
    return np.array([float(f"{value:.5e}") for value in values])


def _same(stored: FloatArray, axis: FloatArray) -> bool:
    return bool((np.abs(stored - axis) <= 1e-12 * axis).all())


def _even_axis(first: float, step: float, count: int) -> FloatArray:
    """Return first + k step, by `frequency_axis` where `first` is a multiple of the step."""
    start = first / step
    if abs(start - round(start)) <= 1e-9 * max(1.0, start):
        return frequency_axis(first, (round(start) + count - 1) * step, step)
    return np.asarray(first + step * np.arange(count))


# --- reading -----------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Measurement:
    """One function: values (nf,) in SI."""

    response: str
    excitation: str
    quantity: Quantity
    axis: FloatArray
    values: ComplexArray

    def __str__(self) -> str:
        return f"the FRF from {self.excitation!r} to {self.response!r}"


def _measurements(path: Path) -> list[_Measurement]:
    functions, types, length, force = read_functions(path)
    found = [_measurement(f, length, force) for f in functions if f["func_type"] == FRF_FUNCTION]
    if not found:
        raise UffError(
            f"no FRF (dataset 58, function type 4) inside; {what_is_there(functions, types)}"
        )
    return found


def read_functions(path: Path) -> tuple[list[dict[str, Any]], list[int], float, float]:
    """Return the datasets 58, the types of all, and the factors of length and force."""
    import pyuff

    _refuse_truncated(path.read_bytes())
    with _PyuffErrors("the file is damaged"):
        file = pyuff.UFF(str(path))
        types = [int(kind) for kind in file.get_set_types()]
    length, force = _unit_factors([_dataset(file, n) for n, t in enumerate(types) if t == 164])
    return [_dataset(file, n) for n, t in enumerate(types) if t == 58], types, length, force


def what_is_there(functions: Sequence[dict[str, Any]], types: Iterable[int]) -> str:
    """Say which datasets and functions a file holds."""
    kinds = sorted({int(f["func_type"]) for f in functions})
    numbers = ", ".join(str(kind) for kind in sorted(set(types)))
    found = f"there are datasets {numbers}" if numbers else "there are no datasets at all"
    return found + (f", functions of type {kinds}" if kinds else "")


def _refuse_truncated(content: bytes) -> None:
    """Datasets open and close with a line of -1; pyuff drops one that never closes."""
    if len(re.findall(rb"    -1 *(?=[\r\n]|\Z)", content)) % 2:
        raise UffError("the file is truncated: its last dataset has no end")


def _dataset(file: Any, number: int) -> dict[str, Any]:
    with _PyuffErrors(f"dataset number {number + 1} is damaged"):
        dataset: dict[str, Any] = file.read_sets(number)
    return dataset


def _unit_factors(units: Sequence[dict[str, Any]]) -> tuple[float, float]:
    """Return the length and force of dataset 164: file units = SI units times the factor."""
    factors = {(float(u["length"]), float(u["force"])) for u in units} or {(1.0, 1.0)}
    if len(factors) > 1:
        raise UffError(f"several unit systems (dataset 164), length and force {sorted(factors)}")
    length, force = factors.pop()
    if not (0 < length < np.inf and 0 < force < np.inf):
        raise UffError(f"dataset 164 has the unit factors length {length:g} and force {force:g}")
    return length, force


def _measurement(dataset: dict[str, Any], length: float, force: float) -> _Measurement:
    response, response_sign = dof_label(dataset, "id4", RESPONSE, "rsp")
    excitation, excitation_sign = dof_label(dataset, "id5", EXCITATION, "ref")
    name = f"the FRF from {excitation!r} to {response!r}"
    quantity = _quantity(dataset, name)
    if dataset["ord_data_type"] not in COMPLEX:
        raise UffError(f"{name} is real (ordinate type {dataset['ord_data_type']}), not complex")
    if (length, force) == (1.0, 1.0):
        _refuse_foreign_units(dataset, quantity, name)
    values = np.asarray(dataset["data"], dtype=complex)
    if values.size != dataset["num_pts"]:
        raise UffError(f"{name} has {values.size} values where {dataset['num_pts']} are announced")
    # m per N; an angle has no length, a moment has one: rad per N m
    exponent = (abs(dataset["ref_dir"]) > 3) - (abs(dataset["rsp_dir"]) <= 3)
    factor = response_sign * excitation_sign * force * length**exponent
    return _Measurement(response, excitation, quantity, _axis(dataset), values * factor)


def dof_label(dataset: dict[str, Any], line: str, prefix: str, end: str) -> tuple[str, int]:
    """Return the label at one end, and the sign that makes its direction positive."""
    node, direction = int(dataset[f"{end}_node"]), int(dataset[f"{end}_dir"])
    if abs(direction) >= len(DIRECTIONS):
        raise UffError(f"node {node} has the direction code {direction}; known are -6 to 6")
    text = dataset[line]
    if text.startswith(prefix):
        return text[len(prefix) :], 1
    entity = dataset[f"{end}_ent_name"]
    parts = ("" if entity == "NONE" else entity, str(node), DIRECTIONS[abs(direction)])
    return ".".join(filter(None, parts)), -1 if direction < 0 else 1


def _quantity(dataset: dict[str, Any], name: str) -> Quantity:
    abscissa, above, below = (
        dataset[f"{axis}_spec_data_type"] for axis in ("abscissa", "ordinate", "orddenom")
    )
    if abscissa != FREQUENCY:
        raise UffError(
            f"{name} has an abscissa of data type {abscissa}, not {FREQUENCY} (frequency)"
        )
    if above not in DATA_TYPES or below != FORCE:
        known = ", ".join(f"{code} ({quantity})" for code, quantity in DATA_TYPES.items())
        raise UffError(
            f"{name} is data type {above} per {below}; known are {known} per {FORCE} (force)"
        )
    return DATA_TYPES[above]


def _refuse_foreign_units(dataset: dict[str, Any], quantity: Quantity, name: str) -> None:
    """Refuse unit labels that contradict SI: no factor would say what they mean."""
    for axis, known in (
        ("abscissa", {"hz"}),
        ("ordinate", SPELLINGS[quantity]),
        ("orddenom", FORCE_SPELLINGS),
    ):
        refuse_foreign_unit(dataset[f"{axis}_axis_units_lab"], known, name)


def refuse_foreign_unit(label: str, known: set[str], name: str) -> None:
    """Refuse a unit label that is none of the SI spellings known."""
    plain = re.sub(r"[()\s]", "", label.lower()).replace("**", "^").replace("²", "^2")
    if plain.removesuffix("/n") not in known | {"", "none"}:
        raise UffError(
            f"{name} has the unit {label!r}; without other factors in dataset 164 it must be "
            f"SI ({' or '.join(sorted(known))})"
        )


def _axis(dataset: dict[str, Any]) -> FloatArray:
    if dataset["abscissa_spacing"] == UNEVEN:
        return np.asarray(dataset["x"], dtype=float)
    first, step = float(dataset["abscissa_min"]), float(dataset["abscissa_inc"])
    if not (first >= 0 and step > 0):
        raise UffError(f"the frequencies start at {first:g} Hz with a step of {step:g} Hz")
    return _even_axis(first, step, int(dataset["num_pts"]))


def _matrix(measurements: Sequence[_Measurement]) -> Frf:
    """Arrange the functions; every response must be there for every excitation."""
    first = measurements[0]
    responses = tuple(dict.fromkeys(m.response for m in measurements))
    excitations = tuple(dict.fromkeys(m.excitation for m in measurements))
    found: dict[tuple[str, str], _Measurement] = {}
    for one in measurements:
        if one.quantity != first.quantity:
            raise UffError(f"{first} is {first.quantity}, {one} is {one.quantity}")
        require_same_frequency(first.axis, one.axis, f"the axes of {first} and of {one} differ")
        if found.setdefault((one.response, one.excitation), one) is not one:
            raise UffError(f"{one} is there more than once")
    _refuse_missing(responses, excitations, found)
    values = np.empty((len(responses), len(excitations), first.axis.size), dtype=complex)
    for i, response in enumerate(responses):
        for j, excitation in enumerate(excitations):
            values[i, j] = found[response, excitation].values
    return Frf(first.axis, values.transpose(2, 0, 1), responses, excitations, first.quantity)


def _refuse_missing(
    responses: Sequence[str], excitations: Sequence[str], found: Iterable[tuple[str, str]]
) -> None:
    pairs = {(response, excitation) for response in responses for excitation in excitations}
    missing = sorted(pairs - set(found))
    if missing:
        shown = ", ".join(f"{excitation!r} to {response!r}" for response, excitation in missing[:5])
        more = ", ..." if len(missing) > 5 else ""
        raise UffError(f"{len(missing)} of {len(pairs)} FRFs are missing: {shown}{more}")
