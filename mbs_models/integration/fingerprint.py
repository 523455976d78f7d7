"""A digest of what a run is made of, so that it is continued only by itself."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache
from importlib import import_module
from pathlib import Path
from types import CodeType, FunctionType, MethodType
from typing import Any, Protocol

import numpy as np

PLAIN = (bool, int, float, complex, str, bytes, np.generic)


@cache
def code_digest(*packages: str) -> str:
    """SHA-256 of the Python files of some installed packages, as they were when first asked for."""
    digest = hashlib.sha256()
    for name in packages:
        for file in sorted(Path(next(iter(import_module(name).__path__))).rglob("*.py")):
            digest.update(file.name.encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()


class _Hash(Protocol):
    def update(self, data: bytes, /) -> None: ...


def fingerprint(*parts: Any) -> str:
    """SHA-256 of the contents of some objects.

    Numbers, texts, arrays, containers, dataclasses and other objects count by their contents,
    functions by their code and what they close over. Objects without readable contents (exudyn's
    own) count by their type: what is in them must be given besides.
    """
    digest = hashlib.sha256()
    _feed(digest, parts, ())
    return digest.hexdigest()


def _feed(digest: _Hash, value: Any, within: tuple[int, ...]) -> None:
    digest.update(f"<{type(value).__qualname__}".encode())
    if id(value) not in within:  # an object may refer to itself
        if isinstance(value, np.ndarray):
            digest.update(f"{value.dtype}{value.shape}".encode())
            digest.update(np.ascontiguousarray(value).tobytes())
        elif value is None or isinstance(value, PLAIN):
            digest.update(repr(value).encode())
        else:
            for part in _contents(value):
                _feed(digest, part, (*within, id(value)))
    digest.update(b">")


def _contents(value: Any) -> Iterable[Any]:
    if isinstance(value, Enum):
        return (value.value,)
    if isinstance(value, Mapping):
        return sorted(value.items(), key=lambda item: str(item[0]))
    if isinstance(value, (set, frozenset)):
        return sorted(value, key=str)
    if isinstance(value, (Sequence, range)):
        return value
    if isinstance(value, FunctionType):
        closed_over = [cell.cell_contents for cell in value.__closure__ or ()]
        return (value.__qualname__, value.__code__, value.__defaults__, closed_over)
    if isinstance(value, MethodType):
        return (value.__func__, value.__self__)
    if isinstance(value, CodeType):
        return (value.co_code, value.co_names, value.co_consts)
    if is_dataclass(value) and not isinstance(value, type):
        return [(field.name, getattr(value, field.name)) for field in fields(value)]
    if isinstance(value, type):
        return (value.__qualname__,)
    if hasattr(value, "__int__"):  # exudyn's indices
        return (int(value),)
    return getattr(value, "__dict__", {}).items()
