"""Plain text of the study as text to be read: indices set low, powers of ten short."""

from __future__ import annotations

import re
from collections.abc import Iterable
from itertools import groupby

from markupsafe import Markup, escape

from .results import Curve, Figure, Resonance

LETTER = r"[A-Za-zα-ωΑ-Ω]"
INDEX = r"[A-Za-z0-9α-ω]+(?:[-,]\d+)?"
OF_SUBSYSTEM = re.compile(rf"\b([AB])_H(?:_({INDEX}))?(?![\w])")
INDEXED = re.compile(rf"(?<!\w)({LETTER}{{1,2}}|\])_({INDEX})")
BRACKET = re.compile(rf"\]_({INDEX})")
POWER = re.compile(r"(?<![\w.])(\d+(?:\.\d+)?)e([-+]?)0*(\d*)(?!\w)")
MINUS = re.compile(r"(?<![\w)–-])-(?=\d)")
APOSTROPHE = re.compile(r"(?<=\w)(?:'|&#39;)(?=\w)")
FIRST_WORD = re.compile(r"(?!exudyn\b)[a-z]{2,}(?=[\s,:])")


def typeset(text: str) -> Markup:
    """``k_sw`` with a low index, ``A_H_cc`` as ᴬH with one, 1.0e-08 as 1.0e−8; the rest escaped."""
    html = POWER.sub(_power, str(escape(text)))
    html = MINUS.sub("−", APOSTROPHE.sub("’", html))
    html = OF_SUBSYSTEM.sub(_of_subsystem, html)
    html = BRACKET.sub(r"]<sub>\1</sub>", INDEXED.sub(r"\1<sub>\2</sub>", html))
    return Markup(html)  # escaped above; only <sub> and <sup> were added


def sentence(text: str) -> Markup:
    """The same, from a capital to a full stop."""
    if FIRST_WORD.match(text):
        text = text[0].upper() + text[1:]
    return typeset(text if text.endswith((".", "?", "!")) else text + ".")


def _power(found: re.Match[str]) -> str:
    mantissa, sign, exponent = found.groups()
    if not exponent:
        return mantissa
    return f"{mantissa}e{sign.replace('-', '−').replace('+', '')}{exponent}"


def _of_subsystem(found: re.Match[str]) -> str:
    subsystem, index = found.groups()
    return f"<sup>{subsystem}</sup>H" + (f"<sub>{index}</sub>" if index else "")


def shown_resonances(figure: Figure) -> str:
    """The resonances that a figure's FRF shows, by system and kind."""
    visible = [mark for mark in figure.resonances if mark.visible]
    systems = groupby(visible, lambda mark: mark.system)
    return "; ".join(f"{name}: {_by_kind(marks)}" for name, marks in systems) or "none"


def _by_kind(marks: Iterable[Resonance]) -> str:
    by_kind: dict[str, list[str]] = {}
    for mark in marks:
        repeated = f"({mark.multiplicity})" if mark.multiplicity > 1 else ""
        by_kind.setdefault(mark.kind, []).append(f"{mark.frequency_hz:.1f}{repeated}")
    return ", ".join(f"{kind} {', '.join(found)} Hz" for kind, found in by_kind.items())


def unnamed_routes(curves: Iterable[Curve]) -> str:
    """The routes of those curves whose names do not say it."""
    by_route: dict[str, list[str]] = {}
    for curve in curves:
        if curve.route not in curve.name:
            by_route.setdefault(curve.route, []).append(curve.name)
    return "; ".join(
        f"{' and '.join(names) if len(names) < 3 else f'{len(names)} curves'}: {route}"
        for route, names in by_route.items()
    )
