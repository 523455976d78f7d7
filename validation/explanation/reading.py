"""Evidence from files: FRFs, natural frequencies, or M, C, K, as their contents say."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fbs import FbsError
from fbs.files.matlab import read_mat
from fbs.files.untrusted import read_arrays, read_plain
from mbs_models.model.parameters import Drivetrain

from ..arrays import FloatArray
from ..errors import CommandError
from ..routes import frf_input
from ..routes.frf_input import FileOptions, naming
from .evidence import Evidence, FrfEvidence
from .few_numbers import FrequencyEvidence, MatrixEvidence

NUMBER = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)(?:\((\d+)\))?")
NAMES = {"mass": ("M", "mass"), "damping": ("C", "damping"), "stiffness": ("K", "stiffness")}
LABELS = ("dofs", "labels")
MOST_FREQUENCIES = 10_000


def read_evidence(
    path: Path,
    drivetrain: Drivetrain,
    labels: Sequence[str],
    dofs: Sequence[str],
    options: FileOptions,
) -> tuple[Evidence, tuple[str, ...]]:
    """What a file holds, and what was left out of it.

    Parameters
    ----------
    path
        A file of FRFs (.uff, .npz, .csv, .mat), of natural frequencies (.txt, .csv) or of M, C, K
        (.npz, .mat, or a folder with M.mtx, C.mtx, K.mtx).
    drivetrain
        The model, for radii.
    labels, dofs
        Its labels, and its independent DoFs, in whose order unlabelled matrices are.
    options
        What the user says of it.

    Raises
    ------
    CommandError
        It holds none of these, or does not fit; the message starts with the path.
    """
    with naming(path):
        if path.is_dir():
            return _matrices(_matrix_market(path), {}, dofs), ()
        ending = path.suffix.lower()
        if ending in (".npz", ".mat"):
            arrays = _named_matrices(path, ending)
            if any(name in arrays for names in NAMES.values() for name in names):
                return _matrices(arrays, arrays, dofs), ()
        if ending in (".txt", ".csv", ".dat") and (rows := _frequency_rows(path)) is not None:
            return _frequencies(rows), ()
    measured = frf_input.read(path, labels, drivetrain.dof_radii(), options)
    frf = measured.frf.to("receptance")
    notes = list(measured.notes)
    if frf.frequency[0] == 0.0:
        frf = frf.band(frf.frequency[1])
        notes.append("its line at 0 Hz is left out: what is free to move has no FRF there")
    return FrfEvidence(frf), tuple(f"{path}: {note}" for note in notes)


# Matrices


def _named_matrices(path: Path, ending: str) -> dict[str, Any]:
    more = [*(name for names in NAMES.values() for name in names), *LABELS]
    if ending == ".npz":
        return read_arrays(path, {}, more)
    return read_mat(path, {}, more)


def _matrix_market(folder: Path) -> dict[str, Any]:
    from scipy.io import mmread

    found = {}
    for names in NAMES.values():
        for name in names:
            file = folder / f"{name}.mtx"
            if file.exists():
                read_plain(file)  # a regular file of a size that is one
                try:
                    matrix = mmread(file)
                except (ValueError, OSError) as error:
                    raise CommandError(f"{file}: is no Matrix Market file: {error}") from error
                found[name] = matrix.toarray() if hasattr(matrix, "toarray") else matrix
    if not found:
        raise CommandError(f"{folder}: has no M.mtx, C.mtx or K.mtx (Matrix Market)")
    return found


def _matrices(
    arrays: Mapping[str, Any], words: Mapping[str, Any], dofs: Sequence[str]
) -> MatrixEvidence:
    matrices: dict[str, FloatArray] = {}
    for name, keys in NAMES.items():
        for key in keys:
            if key in arrays:
                matrices[name] = np.asarray(arrays[key], dtype=float)
    own = next(
        (tuple(np.ravel(words[key]).tolist()) for key in LABELS if key in words), tuple(dofs)
    )
    strange = [dof for dof in own if dof not in dofs]
    if strange or len(own) != len(dofs):
        missing = ", ".join([dof for dof in dofs if dof not in own][:5])
        raise FbsError(
            f"its matrices are of {len(own)} DoFs"
            + (f", among them {strange[0]!r}, which the model has not" if strange else "")
            + f"; needed are the model's {len(dofs)}"
            + (f", of which it lacks {missing}" if missing else "")
        )
    for name, matrix in matrices.items():
        if matrix.shape != (len(own), len(own)):
            size = " × ".join(map(str, matrix.shape))
            raise FbsError(f"{name} is {size}; must be {len(own)} × {len(own)}, one row a DoF")
        if not np.all(np.isfinite(matrix)):
            raise FbsError(f"{name} has a number that is not finite")
    return MatrixEvidence(matrices, own)


# Natural frequencies


def _frequency_rows(path: Path) -> list[list[str]] | None:
    """Its rows as texts where it is a list of frequencies; None where it holds FRFs."""
    text = read_plain(path).decode("utf-8-sig", errors="replace")
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    rows = [[cell.strip() for cell in re.split(r"[,;\t]", line)] for line in lines]
    if not rows:
        raise FbsError("the file is empty; must hold natural frequencies (Hz) or FRFs")
    if all(NUMBER.fullmatch(word) for row in rows for cell in row for word in cell.split()):
        return [[word] for row in rows for cell in row for word in cell.split()]  # a bare list
    head = [cell.lower() for cell in rows[0]]
    is_list = head[0].startswith(("frequency", "natural", "f_", "mode")) or head[0] in ("f", "hz")
    columns_of_frfs = any("<-" in cell or "←" in cell or "/" in cell[1:] for cell in rows[0][1:])
    return rows if is_list and not columns_of_frfs and len(rows) < MOST_FREQUENCIES else None


def _frequencies(rows: Sequence[Sequence[str]]) -> FrequencyEvidence:
    """From a bare list, or from columns: frequency, perhaps damping, perhaps DoFs' shapes."""
    head: list[str] = []
    if NUMBER.fullmatch(rows[0][0]) is None:
        head, rows = list(rows[0]), rows[1:]
    found: list[tuple[float, float, list[float]]] = []
    for row in rows:
        match = NUMBER.fullmatch(row[0])
        if match is None:
            raise FbsError(f"{row[0]!r} is no natural frequency; must be like 1125.4 or 1125.4(2)")
        try:
            rest = [float(cell) for cell in row[1:]]
        except ValueError as error:
            raise FbsError(f"{', '.join(row)}: {error}") from error
        if head and len(rest) != len(head) - 1:
            raise FbsError(f"{', '.join(row)}: has {len(row)} columns; the heading {len(head)}")
        value = float(match[1])
        if value < 0.0:
            raise FbsError(f"{row[0]}: a natural frequency must be 0 or more (Hz)")
        found += [(value, half_digit(match[1]), rest)] * int(match[2] or 1)
    elastic = sorted((each for each in found if each[0] > 0.0), key=lambda each: each[0])
    if not elastic:
        raise FbsError("has no natural frequency above 0 Hz")
    zeros = len(found) - len(elastic)
    values = np.array([each[0] for each in elastic])
    columns = np.array([each[2] for each in elastic])
    names = [name.lower() for name in head[1:]]
    is_damping = [n.startswith(("damping", "zeta", "ζ")) for n in names]
    labels = tuple(head[1 + k] for k, damped in enumerate(is_damping) if not damped)
    shapes = [k for k, damped in enumerate(is_damping) if not damped]
    return FrequencyEvidence(
        values,
        np.array([each[1] / each[0] for each in elastic]),
        zeros or None,
        columns[:, is_damping.index(True)] if True in is_damping else None,
        labels,
        columns[:, shapes] if labels else None,
    )


def half_digit(text: str) -> float:
    """Half a unit of a printed number's last digit: 0.05 of 1125.4."""
    mantissa, _, exponent = text.lower().partition("e")
    decimals = len(mantissa.partition(".")[2])
    return float(0.5 * 10.0 ** (int(exponent or 0) - decimals))
