"""The guard at the doors of the package: arguments of another kind than annotated are refused."""

from __future__ import annotations

import inspect
import operator
from collections.abc import Callable, Iterable, KeysView, Mapping, Sequence, Set
from functools import cache, wraps
from types import UnionType
from typing import Any, Literal, TypeVar, Union, cast, get_args, get_origin

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import FbsError
from .checks import described, numbers

F = TypeVar("F", bound=Callable[..., Any])


def door(function: F) -> F:
    """Check every argument against its annotation before the function runs.

    A number must be real and no NaN, a whole number whole; an array must hold numbers, unmasked;
    labels must come in order; what is annotated with a class must be one of it, element by element
    in mappings and sequences (iterators are left to the function). What values are allowed the
    function says itself.

    Raises
    ------
    FbsError
        When called: which argument, what it must be and what it is.
    """
    signature = inspect.signature(function)

    @cache
    def annotations() -> dict[str, Any]:
        return {
            name: _resolved(parameter.annotation, function)
            for name, parameter in signature.parameters.items()
        }

    @wraps(function)
    def guarded(*args: Any, **kwargs: Any) -> Any:
        for name, value in signature.bind(*args, **kwargs).arguments.items():
            _require(value, annotations()[name], f"{function.__name__}: {name}")
        return function(*args, **kwargs)

    return cast(F, guarded)


def _resolved(annotation: Any, function: Callable[..., Any]) -> Any:
    if annotation is inspect.Parameter.empty:  # self
        return Any
    if not isinstance(annotation, str):
        return annotation
    try:
        return eval(annotation, function.__globals__)
    except NameError:  # imported for type checkers only
        return Any


def _require(value: Any, kind: Any, what: str) -> None:
    """Raise FbsError unless the value is of the annotated kind."""
    if kind is Any:
        return
    if kind == NDArray[np.bool_]:
        is_mask = isinstance(value, np.ndarray) and value.dtype.kind == "b"
        _refuse_unless(is_mask, value, "a mask", what)
    elif kind is ArrayLike or get_origin(kind) is np.ndarray:
        numbers(value, what, float if kind == _REAL else complex)
    elif get_origin(kind) in (Union, UnionType):
        _require_any(value, get_args(kind), what)
    elif kind is None or kind is type(None):
        _refuse_unless(value is None, value, "None", what)
    elif kind in _SCALARS:
        check, name = _SCALARS[kind]
        _refuse_unless(check(value), value, name, what)
    elif get_origin(kind) is Literal:
        allowed = ", ".join(map(repr, get_args(kind)))
        _refuse_unless(
            isinstance(value, str) and value in get_args(kind), value, f"one of {allowed}", what
        )
    elif get_origin(kind) is Callable:
        _refuse_unless(callable(value), value, "a function", what)
    elif get_origin(kind) in _MANY:
        _require_many(value, kind, what)
    elif inspect.isclass(get_origin(kind)):
        _refuse_unless(isinstance(value, get_origin(kind)), value, f"of type {kind}", what)
    elif _is_class(kind):
        _refuse_unless(isinstance(value, kind), value, f"of type {kind.__name__}", what)


def _is_class(kind: Any) -> bool:
    """Whether being an instance of it is all there is to check."""
    protocol = getattr(kind, "_is_protocol", False)
    return inspect.isclass(kind) and kind not in _SCALARS and not protocol


def _require_any(value: Any, kinds: tuple[Any, ...], what: str) -> None:
    if isinstance(value, tuple(kind for kind in kinds if _is_class(kind))):
        return  # before anything is tried in vain: its message would print whole arrays
    messages = []
    for kind in kinds:
        try:
            return _require(value, kind, what)
        except FbsError as error:
            messages.append(error)
    fitting = [kind for kind in kinds if kind is not type(None)]
    raise messages[kinds.index(fitting[0])]


def _require_many(value: Any, kind: Any, what: str) -> None:
    """Check the elements of a mapping, sequence or other iterable; iterators are left alone."""
    origin, parameters = get_origin(kind), get_args(kind)
    if origin is Mapping:
        _refuse_unless(isinstance(value, Mapping), value, "a mapping", what)
        for key, one in value.items():
            _require(key, parameters[0], f"a key of {what}")
            _require(one, parameters[1], f"{what}[{key!r}]")
        return
    if origin is tuple:
        _refuse_unless(isinstance(value, tuple), value, "a tuple", what)
        return
    unordered = isinstance(value, Set) and not isinstance(value, KeysView)
    single = isinstance(value, str | bytes | np.ma.MaskedArray)
    single |= isinstance(value, np.ndarray) and not (value.ndim and parameters[0] is str)
    needed = (Sequence, np.ndarray) if origin is Sequence else Iterable
    fits = isinstance(value, needed) and not unordered and not single
    _refuse_unless(fits, value, "a sequence, in order", what)
    if isinstance(value, Sequence | Mapping | np.ndarray):
        for k, one in enumerate(value):
            _require(one, parameters[0], f"{what}[{k}]")


def _refuse_unless(fits: bool, value: Any, kind: str, what: str) -> None:
    if not fits:
        raise FbsError(f"{what} must be {kind}, got {described(value)}")


def _is_number(value: Any) -> bool:
    try:
        array = numbers(value, "")
    except FbsError:
        return False
    return array.ndim == 0 and not np.isnan(array)


def _is_whole(value: Any) -> bool:
    try:
        size = abs(operator.index(value))
    except TypeError:
        return False
    return size < 2**53 and not isinstance(value, bool | np.bool_ | np.ndarray)


_SCALARS: dict[Any, tuple[Callable[[Any], bool], str]] = {
    float: (_is_number, "a real number, not NaN"),
    int: (_is_whole, "a whole number"),
    bool: (lambda value: isinstance(value, bool | np.bool_), "True or False"),
    str: (lambda value: isinstance(value, str), "text"),
}

_MANY = (Mapping, Sequence, Iterable, tuple)

_REAL = NDArray[np.float64]
