"""TOML text: whole documents, and single values as messages show them."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np


def document(data: Mapping[str, Any]) -> Iterator[str]:
    """Lines of a model file: keys, then [tables] and [[arrays of tables]]; inline below those."""
    tables: list[tuple[str, Mapping[str, Any]]] = []
    for key, value in data.items():
        if isinstance(value, Mapping):
            tables.append((f"[{key}]", value))
        elif isinstance(value, Sequence) and not isinstance(value, str):
            tables.extend((f"[[{key}]]", table) for table in value)
        else:
            yield f"{key} = {inline(value)}"
    for header, table in tables:
        yield ""
        yield header
        yield from (f"{key} = {inline(value)}" for key, value in table.items())


def inline(value: object) -> str:
    """A value as TOML writes it on one line."""
    match value:
        case str():
            return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
        case bool():
            return str(value).lower()
        case float():
            return _float(value)
        case Mapping():
            pairs = ", ".join(f"{bare(key)} = {inline(item)}" for key, item in value.items())
            return f"{{ {pairs} }}"
        case list() | tuple():
            return f"[{', '.join(map(inline, value))}]"
        case _:
            return str(value)


def bare(key: str) -> str:
    """A key, in quotes where it needs them."""
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else inline(key)


def _float(value: float) -> str:
    """The shortest digits that read back as ``value``: 24.6, 2.0e8, 4.48e-8."""
    if value == 0.0 or 1e-3 <= abs(value) < 1e5 or not np.isfinite(value):
        return repr(value)
    return np.format_float_scientific(value, trim="0", exp_digits=1).replace("e+", "e")
