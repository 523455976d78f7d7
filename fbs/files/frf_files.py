"""FRFs in files, by the file's ending: .uff, .unv, .npz, .csv and .mat, read and written.

.npz and .mat hold the arrays `frequency` (Hz), `values` (lines, responses, excitations),
`responses`, `excitations` and `quantity`, and `unit` if it is not SI; .csv a column `frequency_hz`
and, for every FRF, `re QUANTITY RESPONSE <- EXCITATION (UNIT)` and `im …`. A label that ends in
.rx, .ry or .rz is a rotation: rad and N m.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from .._kernels.checks import unique_labels
from ..errors import FbsError
from ..frf import Frf, Quantity, as_quantity
from .channel_map import signed
from .measurement import (
    AS_STATED,
    Candidate,
    Contents,
    Given,
    Measured,
    Measurement,
    Pair,
    take,
)
from .stated_units import frequency_factor, frf_unit
from .tables import Table, read_table, write_table
from .uff import uff_contents, write_uff_to
from .uff_functions import UNITS, Channel
from .universal import Axis, End, read_universal
from .untrusted import read_arrays
from .whole_files import written_whole

NUMBERS, TEXT = "fiu", "U"
NEEDED: Mapping[str, tuple[str, str]] = {
    "frequency": (NUMBERS, "real numbers (Hz)"),
    "values": ("c", "complex numbers (lines, responses, excitations)"),
    "responses": (TEXT, "text"),
    "excitations": (TEXT, "text"),
}
MORE = ("quantity", "unit", "coherence", "averages")


def read_frf(
    path: str | os.PathLike[str],
    given: Given = AS_STATED,
    responses: Sequence[str] | None = None,
    excitations: Sequence[str] | None = None,
) -> Measurement:
    """Read FRFs by the file's ending: the complete block between the labels wanted.

    Parameters
    ----------
    path : path
    given : Given
        What the user says of the file where it does not say so itself.
    responses, excitations : labels, optional
        Those wanted; None: all.

    Raises
    ------
    FbsError
        The ending is not known, the file is damaged, holds no such FRFs, or contradicts itself.
        The message starts with the path.
    OSError
    """
    source = Path(path)
    try:
        return take(frf_contents(source, given), responses, excitations, given.run)
    except FbsError as error:
        raise _named(error, source) from error


def frf_contents(path: Path, given: Given = AS_STATED) -> Contents:
    """Return what FRFs a file holds, none of them brought to SI yet.

    Raises
    ------
    FbsError, OSError
        As for `read_frf`, without the path.
    """
    return _format(path).read(path, given)


def write_frf(
    frf: Frf,
    path: str | os.PathLike[str],
    channels: Mapping[str, Channel] | None = None,
    coherence: NDArray[np.float64] | None = None,
    averages: Mapping[str, int] | None = None,
) -> None:
    """Write FRFs by the file's ending; the file appears complete or not at all.

    Parameters
    ----------
    frf : Frf
    path : path
        Replaced if it exists.
    channels : mapping of str to Channel, optional
        Nodes and directions for .uff.
    coherence : array, shape of the FRF's values, optional
        Kept by .uff, .npz and .mat.
    averages : mapping of str to int, optional
        Excitation → of how many averages its coherence is.

    Raises
    ------
    FbsError
        The ending is not known, or the FRF does not fit into the format.
    OSError
        As for `files.written_whole`.
    """
    target = Path(path)
    writer = _format(target).write
    with written_whole(target) as file:
        writer(frf, file, Extras(channels, coherence, averages))


def _named(error: FbsError, source: Path) -> FbsError:
    words = str(error).removeprefix(f"{source}: ")  # some readers name the file themselves
    return FbsError(f"{source}: {words}")


# --- arrays ------------------------------------------------------------------------------------


def array_contents(arrays: Mapping[str, NDArray[Any]], given: Given) -> Contents:
    """Return the FRFs of named arrays.

    Raises
    ------
    FbsError
        Shapes that do not fit together.
    """
    axis = np.atleast_1d(np.asarray(arrays["frequency"], dtype=float).squeeze())
    labels = [
        unique_labels(map(str, np.ravel(arrays[name]).tolist()), f"the {name}")
        for name in ("responses", "excitations")
    ]
    values = np.asarray(arrays["values"])
    expected = (axis.size, len(labels[0]), len(labels[1]))
    if values.size == np.prod(expected) and values.ndim < 3:
        values = values.reshape(expected)  # MATLAB drops what has one element
    if values.shape != expected:
        raise FbsError(
            f"the array values has shape {values.shape}; {expected[0]} lines, {expected[1]} "
            f"responses and {expected[2]} excitations need {expected}"
        )
    quantity = as_quantity(_word(arrays, "quantity", "receptance"))
    unit = _word(arrays, "unit", "")
    columns = [
        Column(response, excitation, axis, values[:, i, j], quantity, unit)
        for j, excitation in enumerate(labels[1])
        for i, response in enumerate(labels[0])
    ]
    coherence = arrays.get("coherence")
    known = (
        {}
        if coherence is None or coherence.size != values.size
        else {
            (signed(r)[0], signed(e)[0]): [
                np.asarray(coherence.reshape(expected)[:, i, j], dtype=float)
            ]
            for i, r in enumerate(labels[0])
            for j, e in enumerate(labels[1])
        }
    )
    count = arrays.get("averages", np.empty(0)).ravel()
    averages = (
        {signed(label)[0]: int(n) for label, n in zip(labels[1], count, strict=True)}
        if count.size == expected[2]
        else {}
    )
    return Contents(tuple(one.candidate(given) for one in columns), known, averages)


def _word(arrays: Mapping[str, NDArray[Any]], name: str, otherwise: str) -> str:
    return str(arrays[name].ravel()[0]) if name in arrays and arrays[name].size else otherwise


@dataclass(frozen=True, eq=False)
class Column:
    """One FRF of a file that has no node numbers, values as they stand there."""

    response: str
    excitation: str
    frequency: NDArray[np.float64]
    values: NDArray[np.complex128]
    quantity: Quantity
    unit: str

    def candidate(self, given: Given) -> Candidate:
        """Return it as an FRF to be taken; its unit is read only then.

        A label such as "12:-Z" becomes "12.z" of other sign, as node and direction of .uff do.
        """
        (response, of_response), (excitation, of_excitation) = (
            signed(label) for label in (self.response, self.excitation)
        )
        sign = of_response * of_excitation
        own = replace(self, response=response, excitation=excitation, values=self.values * sign)
        return Candidate(response, excitation, lambda: own._measured(given))

    def _measured(self, given: Given) -> Measured:
        name = f"the FRF from {self.excitation!r} to {self.response!r}"
        if given.quantity not in (None, self.quantity):
            raise FbsError(f"{name} is {self.quantity}, not {given.quantity} as given")
        stated = frf_unit(
            (_end(self.response), _end(self.excitation)),
            (Axis(0, unit=self.unit), Axis(0)),
            self.quantity,
            None,
            given.units,
            name,
        )
        angle, moment = (stated.angle, stated.moment)
        note = stated.note if self.unit else ""
        values = np.asarray(self.values * stated.factor, dtype=np.complex128)
        return Measured(
            self.response, self.excitation, self.quantity, self.frequency, values, angle, moment,
            note,
        )  # fmt: skip


ROTATIONS = re.compile(r"\.r[xyz]$", re.IGNORECASE)


def _end(label: str) -> End:
    """An end whose label says that it turns; else what its unit says."""
    return End(0, 4 if ROTATIONS.search(label) else 0)


# --- formats -----------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Extras:
    """What a file may say besides the FRFs; see `write_frf`."""

    channels: Mapping[str, Channel] | None = None
    coherence: NDArray[np.float64] | None = None
    averages: Mapping[str, int] | None = None


def _read_uff(path: Path, given: Given) -> Contents:
    return uff_contents(read_universal(path), given)


def _write_uff(frf: Frf, file: BinaryIO, extras: Extras) -> None:
    write_uff_to(frf, file, extras.channels, extras.coherence, averages=extras.averages)


def _read_npz(path: Path, given: Given) -> Contents:
    return array_contents(read_arrays(path, NEEDED, MORE), given)


def _arrays(frf: Frf, extras: Extras) -> dict[str, Any]:
    arrays: dict[str, Any] = {
        "frequency": frf.frequency,
        "values": frf.values,
        "responses": np.array(frf.responses),
        "excitations": np.array(frf.excitations),
        "quantity": np.array(str(frf.quantity)),
    }
    if extras.coherence is not None:
        arrays["coherence"] = extras.coherence
    if extras.averages is not None:
        arrays["averages"] = np.array([extras.averages[label] for label in frf.excitations])
    return arrays


def _write_npz(frf: Frf, file: BinaryIO, extras: Extras) -> None:
    np.savez_compressed(file, **_arrays(frf, extras))


def _read_mat(path: Path, given: Given) -> Contents:
    from .matlab import read_mat

    return array_contents(read_mat(path, NEEDED, MORE), given)


def _write_mat(frf: Frf, file: BinaryIO, extras: Extras) -> None:
    from .matlab import write_mat

    write_mat(file, _arrays(frf, extras))


PART = re.compile(
    r"(?P<part>re|real|im|imag|imaginary|mag|magnitude|abs|phase)\b[ _:]*"
    r"(?:(?P<quantity>receptance|mobility|accelerance)\s+)?"
    r"(?P<response>.+?)\s*(?:<-|←|/)\s*(?P<excitation>[^\s(\[]+)\s*(?:[(\[](?P<unit>.+)[)\]])?",
    re.IGNORECASE,
)
PARTS = {"r": "re", "i": "im", "m": "mag", "a": "mag", "p": "phase"}
DEGREES, RADIANS = ("", "deg", "°", "degree", "degrees"), ("rad", "radian", "radians")


def _read_csv(path: Path, given: Given) -> Contents:
    table = read_table(path)
    frequency = table.values[:, 0] * _hertz(table)
    found: dict[Pair, dict[str, tuple[int, str, str | None]]] = {}
    for number, name in enumerate(table.names[1:], start=1):
        match = _matched(name)
        parts = found.setdefault((match["response"], match["excitation"]), {})
        part = PARTS[match["part"][0].lower()]
        if part in parts:
            raise FbsError(f"the column {name!r} is there more than once")
        parts[part] = (number, match["unit"] or table.units[number], match["quantity"])
    columns = [_column(table, frequency, pair, parts, given) for pair, parts in found.items()]
    return Contents(tuple(column.candidate(given) for column in columns))


def _hertz(table: Table) -> float:
    name = table.names[0]
    match = re.fullmatch(
        r"\s*(?:(?:freq|frequency|f)(?:_hz)?|hz)\s*(?:[(\[](?P<unit>.*)[)\]])?\s*", name, re.I
    )
    if match is None:
        raise FbsError(f"its first column is {name!r}; it must be the frequency (frequency_hz)")
    return frequency_factor(match["unit"] or table.units[0], "its first column")


def _matched(name: str) -> re.Match[str]:
    match = PART.fullmatch(name.strip())
    if match is None:
        raise FbsError(
            f"a column is called {name!r}; the header must have frequency_hz and, for every FRF, "
            '"re QUANTITY RESPONSE <- EXCITATION (UNIT)" and "im …"'
        )
    return match


def _column(
    table: Table,
    frequency: NDArray[np.float64],
    pair: Pair,
    parts: Mapping[str, tuple[int, str, str | None]],
    given: Given,
) -> Column:
    name = f"{pair[0]} <- {pair[1]}"
    if set(parts) not in ({"re", "im"}, {"mag", "phase"}):
        raise FbsError(
            f"{name} has the columns {', '.join(parts)}; needed are re and im, or mag and phase"
        )
    first, second = (parts[p] for p in (("re", "im") if "re" in parts else ("mag", "phase")))
    a, b = (table.values[:, number] for number, _, _ in (first, second))
    if "re" in parts:
        if first[1:] != second[1:]:
            raise FbsError(f"{name} has columns of different unit or quantity")
        values = a + 1j * b
    else:
        values = a * np.exp(1j * b * _radians(second[1], name))
    quantity = first[2] or given.quantity
    if quantity is None:
        raise FbsError(
            f"the column of {name} does not say its quantity; name it, or give it (--quantity)"
        )
    return Column(*pair, frequency, values, as_quantity(str(quantity).lower()), first[1])


def _radians(unit: str, name: str) -> float:
    if unit.lower() not in DEGREES + RADIANS:
        raise FbsError(f"the phase of {name} is in {unit!r}; must be deg or rad")
    return 1.0 if unit.lower() in RADIANS else np.pi / 180


def _write_csv(frf: Frf, file: BinaryIO, extras: Extras) -> None:
    names, columns = ["frequency_hz"], [frf.frequency]
    for response, excitation, values in frf.curves():
        name = f"{frf.quantity} {response} <- {excitation} ({UNITS[frf.quantity]}/N)"
        names += [f"re {name}", f"im {name}"]
        columns += [values.real, values.imag]
    write_table(file, names, columns)


@dataclass(frozen=True)
class Format:
    """How a kind of file is read and written."""

    read: Callable[[Path, Given], Contents]
    write: Callable[[Frf, BinaryIO, Extras], None]


FORMATS: Mapping[str, Format] = {
    ".npz": Format(_read_npz, _write_npz),
    ".csv": Format(_read_csv, _write_csv),
    ".uff": Format(_read_uff, _write_uff),
    ".unv": Format(_read_uff, _write_uff),
    ".mat": Format(_read_mat, _write_mat),
}


def _format(path: Path) -> Format:
    found = FORMATS.get(path.suffix.lower())
    if found is None:
        raise FbsError(
            f"{path}: the ending {path.suffix or '(none)'} is not known; allowed: "
            f"{', '.join(FORMATS)}"
        )
    return found
