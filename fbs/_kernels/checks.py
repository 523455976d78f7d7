"""Checks of arrays and labels that several modules share."""

from __future__ import annotations

from collections.abc import Iterable, KeysView, Mapping, Sequence, Set
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import AmbiguousDofError, FbsError, NonFiniteError, unknown_dof

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

HIGHEST = 1e15  # Hz; far above anything that vibrates, and ω² is a number still


def read_only(array: NDArray[Any]) -> NDArray[Any]:
    """Return a read-only view; memory order and the caller's own array stay as they are."""
    view = array.view()
    view.setflags(write=False)
    return view


def frozen(array: NDArray[Any]) -> NDArray[Any]:
    """Return an array that nobody else can write to: itself if that is so, else a copy of it.

    Memory order is kept. What this package makes is handed over by `sealed`, and not copied.
    """
    own: Any = array
    while isinstance(own, np.ndarray):
        if own.flags.writeable:
            return read_only(np.array(array, order="K"))
        own = own.base
    return array


def sealed(array: NDArray[Any]) -> NDArray[Any]:
    """Make an array read-only for good, with all that it is a view of."""
    own: Any = array
    while isinstance(own, np.ndarray):
        own.setflags(write=False)
        own = own.base
    return array


def numbers(value: Any, what: str, kind: type = float) -> NDArray[Any]:
    """Return an array of float or complex numbers; every array from outside comes in here.

    Parameters
    ----------
    value : array_like
        Integers, real or, for `kind` complex, complex numbers. Not copied if it is that already.
    what : str
        Its name in messages, with its article: "the mass matrix".

    Raises
    ------
    FbsError
        Masked, ragged, or no numbers (text, dates, objects, truth values); complex where it must
        be real.
    """
    if isinstance(value, np.ma.MaskedArray):
        raise FbsError(f"{what} must not be masked: fill the masked values, or leave them out")
    try:
        array = np.asarray(value)
    except (TypeError, ValueError) as error:
        raise FbsError(f"{what} must be an array of numbers: {error}") from None
    if array.dtype.kind == "c" and kind is float:
        raise FbsError(f"{what} must be real, got complex numbers")
    if array.dtype.kind not in "iufc":
        raise FbsError(f"{what} must be an array of numbers, got {described(value)}")
    return array.astype(kind, copy=False)


def scalar(value: Any, what: str, least: float = -np.inf, most: float = np.inf) -> float:
    """Return one finite real number, least <= value <= most; every scalar comes in here.

    Raises
    ------
    FbsError, NonFiniteError
    """
    array = numbers(value, what)
    if array.ndim:
        raise FbsError(f"{what} must be one number, got an array of shape {array.shape}")
    result = float(array)
    if not np.isfinite(result):
        raise NonFiniteError(f"{what} must be finite, got {result}")
    if not least <= result <= most:
        least_of = f"at least {least:g}" if np.isfinite(least) else ""
        most_of = f"at most {most:g}" if np.isfinite(most) else ""
        allowed = " and ".join(filter(None, (least_of, most_of)))
        raise FbsError(f"{what} must be {allowed}, got {result:.10g}")
    return result


def require_type(value: Any, kind: type | tuple[type, ...], what: str) -> None:
    """Refuse a value of another type; `what` begins the message: "a joint".

    Raises
    ------
    FbsError
    """
    if not isinstance(value, kind):
        kinds = kind if isinstance(kind, tuple) else (kind,)
        names = " or ".join(one.__name__ for one in kinds)
        raise FbsError(f"{what} must be of type {names}, got {described(value)}")


def named(parts: Any, kind: type | tuple[type, ...], what: str) -> dict[str, Any]:
    """Return a mapping of names to objects of a type, as a dict.

    Raises
    ------
    FbsError
    """
    require_type(parts, Mapping, what)
    for name, part in parts.items():
        require_type(name, str, f"a name in {what}")
        require_type(part, kind, f"{name!r} of {what}")
    return dict(parts)


def described(value: Any) -> str:
    text = repr(value)
    return f"{text if len(text) <= 60 else text[:60] + '…'} ({type(value).__name__})"


def unique_labels(labels: Iterable[str], what: str) -> tuple[str, ...]:
    """Return the labels as a tuple of non-empty strings, no two alike."""
    if isinstance(labels, str):
        raise FbsError(f"{what} must be a sequence of labels, not the single string {labels!r}")
    unordered = isinstance(labels, Set) and not isinstance(labels, KeysView)
    if unordered or not isinstance(labels, Iterable):
        raise FbsError(f"{what} must be a sequence of labels, in order, got {described(labels)}")
    try:
        result = tuple(labels)
    except TypeError as error:  # an array without dimensions
        raise FbsError(f"{what} must be a sequence of labels: {error}") from None
    for label in result:
        if not isinstance(label, str) or not label:
            raise FbsError(f"{what} must be non-empty strings, got {label!r}")
    seen: set[str] = set()
    for label in result:
        if label in seen:
            raise AmbiguousDofError(f"{what} name {label!r} more than once")
        seen.add(label)
    return result


def positions(wanted: Iterable[str], known: Sequence[str], where: str) -> list[int]:
    """Return where each wanted label stands among the known ones."""
    index = {label: position for position, label in enumerate(known)}
    result = []
    for label in unique_labels(wanted, "the labels asked for"):
        if label not in index:
            raise unknown_dof(label, known, where)
        result.append(index[label])
    return result


def ascending_frequency(frequency: ArrayLike) -> FloatArray:
    """Return a frequency axis in Hz: one-dimensional, >= 0, physical, strictly ascending."""
    axis = numbers(frequency, "the frequency axis")
    if axis.ndim != 1 or axis.size == 0:
        raise FbsError(f"the frequency axis must be one-dimensional, got shape {axis.shape}")
    if not np.isfinite(axis).all():
        line = int(np.flatnonzero(~np.isfinite(axis))[0])
        raise NonFiniteError(f"the frequency axis holds {axis[line]} at line {line}")
    if axis[0] < 0:
        raise FbsError(f"frequencies must not be negative, the first is {axis[0]:.10g} Hz")
    falling = np.flatnonzero(np.diff(axis) <= 0)
    if falling.size:
        line = int(falling[0])
        raise FbsError(
            "the frequency axis must ascend strictly, but line "
            f"{line + 1} ({axis[line + 1]:.10g} Hz) follows {axis[line]:.10g} Hz"
        )
    if axis[-1] > HIGHEST:
        raise FbsError(
            f"frequencies must be at most {HIGHEST:g} Hz, the last is {axis[-1]:.10g} Hz"
        )
    return frozen(axis)


def square_matrix(matrix: ArrayLike, size: int, name: str) -> FloatArray:
    """Return a finite real matrix of shape (size, size)."""
    result = frozen(numbers(matrix, f"the {name} matrix"))
    if result.shape != (size, size):
        raise FbsError(f"the {name} matrix has shape {result.shape}, {size} DoFs need {size, size}")
    if not np.isfinite(result).all():
        row, column = np.argwhere(~np.isfinite(result))[0].tolist()
        raise NonFiniteError(f"the {name} matrix holds {result[row, column]} at {row, column}")
    return result
