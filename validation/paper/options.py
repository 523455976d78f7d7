"""What `crosscheck paper` is asked for: an item's name, and a tolerance in dB."""

from __future__ import annotations

import math
import re
from difflib import get_close_matches

from ..errors import CommandError
from . import item_names

DECIBELS = re.compile(r"\s*([-+.\w]+?)\s*(?:db)?\s*", re.IGNORECASE)
PARTS = re.compile(r"(fig\d+)")


def item(option: str, text: str) -> str:
    """The item, or the figure with several parts, that a text names.

    Raises
    ------
    CommandError
        There is none of that name; the message gives the nearest ones.
    """
    names = list(item_names())
    wholes = list(dict.fromkeys(found[1] if (found := PARTS.match(n)) else n for n in names))
    asked = re.sub(r"[\s.]", "", text).lower()
    if asked in names or asked in wholes:
        return asked
    nearest = get_close_matches(asked, dict.fromkeys(wholes + names), n=4, cutoff=0.5)
    known = f"nearest: {', '.join(nearest)}; " if nearest else ""
    raise CommandError(
        f"{option} = {text!r}: there is no such item; {known}there are {', '.join(wholes)}, and "
        "the parts of a figure, like fig8a"
    )


def decibels(option: str, text: str) -> float:
    """A tolerance: ``0.1dB``, ``0.1 dB`` or ``0.1``.

    Raises
    ------
    CommandError
        It is no finite number above 0.
    """
    found = DECIBELS.fullmatch(text)
    try:
        value = float(found[1]) if found else math.nan
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        raise CommandError(f"{option} = {text!r}: must be a number of dB above 0, like 0.1dB")
    return value
