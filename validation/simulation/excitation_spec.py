"""The command line's excitations: ``TYPE@DOF:key=value,key=value``, a table in one word."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING

from ..errors import CommandError

if TYPE_CHECKING:
    from mbs_models.model.excitation_tables import ExcitationTable

FORM = "TYPE@DOF or TYPE@DOF:key=value,key=value, such as sweep@reducer.pinion.w:fmax=2000"

Value = float | str | list[float]

_BAND: dict[str, Value] = {"fmin": 10.0, "fmax": 4000.0}
_NEWTON: dict[str, Value] = {"amplitude": 1.0}
# What a key is where the word does not give it; a model file gives everything.
DEFAULTS: Mapping[str, Mapping[str, Value]] = {
    "harmonic": _NEWTON,
    "stepped-sine": {**_NEWTON, **_BAND, "df": 10.0, "periods": 20.0},
    "sweep": {**_NEWTON, **_BAND, "duration": 5.0},
    # of each line: 4000 of them make 4.5 N RMS
    "multisine": {**_BAND, "amplitude": 0.1, "df": 1.0},
    "noise": {**_NEWTON, **_BAND},
    "impulse": {**_NEWTON, "fmax": 4000.0},
    "record": {},
}
# A key that says the same in another way takes the default's place.
INSTEAD: Mapping[str, tuple[str, ...]] = {
    "moment": ("amplitude",),
    "frequencies": ("fmin", "fmax", "df"),
    "dwell": ("periods",),
    "contact_time": ("fmax",),
}
TEXTS = ("file", "unit")  # may look like numbers


def parse_excitation(text: str) -> ExcitationTable:
    """The table that an option's text stands for, with the defaults of `DEFAULTS`.

    Values are numbers, words, or lists as [10, 20, 40]; keys and units are the model file's.

    Raises
    ------
    CommandError
        Not of this form, an unknown type or key, or a value that is not allowed.
    """
    from mbs_models.errors import ModelError
    from mbs_models.model.model_file import excitation_table

    head, _, rest = text.partition(":")
    kind, at, dof = (part.strip() for part in head.partition("@"))
    if not (at and kind and dof):
        raise CommandError(f"--excitation {text}: must be {FORM}")
    given = _keys(text, rest)
    replaced = {old for new in given for old in INSTEAD.get(new, ())}
    defaults = {k: v for k, v in DEFAULTS.get(kind, {}).items() if k not in replaced}
    try:
        return excitation_table({"type": kind, "dof": dof, **defaults, **given})
    except ModelError as error:
        raise CommandError(f"--excitation {text}: {error}") from error


def _keys(text: str, rest: str) -> dict[str, Value]:
    given: dict[str, Value] = {}
    for pair in re.split(r",(?![^\[]*\])", rest) if rest.strip() else ():
        key, equals, value = (part.strip() for part in pair.partition("="))
        if not (key and equals and value):
            raise CommandError(f"--excitation {text}: {pair!r} is no key=value; must be {FORM}")
        if key in ("type", "dof"):
            raise CommandError(f"--excitation {text}: {key}: stands before the colon already")
        if key in given:
            raise CommandError(f"--excitation {text}: {key}: is given twice")
        given[key] = value if key in TEXTS else _value(value)
    return given


def _value(text: str) -> Value:
    if text.startswith("[") and text.endswith("]"):
        items = [_value(item.strip()) for item in text[1:-1].split(",") if item.strip()]
        return items  # type: ignore[return-value]  # items that are no numbers: the table refuses
    for number in (int, float):
        try:
            return number(text)
        except ValueError:
            continue
    return text
