"""Plain text of the study as text to be read: indices set low, powers of ten short."""

from __future__ import annotations

import re
from dataclasses import replace

from markupsafe import Markup, escape

from ..report.page import Block, Bullets, Columns, Note, Section, Table

LETTER = r"[A-Za-zα-ωΑ-Ω]"
INDEX = r"[A-Za-z0-9α-ω]+(?:[-,]\d+)?"
OF_SUBSYSTEM = re.compile(rf"\b([AB])_H(?:_({INDEX}))?(?![\w])")
INDEXED = re.compile(rf"(?<!\w)({LETTER}{{1,2}}|\])_({INDEX})")
BRACKET = re.compile(rf"\]_({INDEX})")
POWER = re.compile(r"(?<![\w.])(\d+(?:\.\d+)?)e([-+−]?)0*(\d*)(?!\w)")
MINUS = re.compile(r"(?<![\w)–-])-(?=\d)")
APOSTROPHE = re.compile(r"(?<=\w)(?:'|&#39;)(?=\w)")
FIRST_WORD = re.compile(r"(?!exudyn\b)[a-z]{2,}(?=[\s,:])")


def typeset(text: str) -> Markup:
    """``k_sw`` with a low index, ``A_H_cc`` as ᴬH with one, 1.0e-08 as 1.0e−8; the rest escaped."""
    if isinstance(text, Markup):
        return text
    html = POWER.sub(_power, str(escape(text)))
    html = MINUS.sub("−", APOSTROPHE.sub("’", html))
    html = OF_SUBSYSTEM.sub(_of_subsystem, html)
    html = BRACKET.sub(r"]<sub>\1</sub>", INDEXED.sub(r"\1<sub>\2</sub>", html))
    return Markup(html)  # escaped above; only <sub> and <sup> were added


def sentence(text: str) -> Markup:
    """The same, from a capital to a full stop."""
    if isinstance(text, Markup):
        return text
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


def set_block(block: Block) -> Block:
    """A block with its texts typeset."""
    if isinstance(block, str):
        return sentence(block)
    if isinstance(block, Note):
        return Note(sentence(block.text))
    if isinstance(block, Bullets):
        return Bullets(tuple(map(sentence, block.items)))
    if isinstance(block, Table):
        rows = tuple(tuple(map(typeset, row)) for row in block.rows)
        return replace(block, headings=tuple(map(typeset, block.headings)), rows=rows)
    if isinstance(block, Section):
        return Section(block.anchor, typeset(block.title), tuple(map(set_block, block.blocks)))
    if isinstance(block, Columns):
        sections = (set_block(section) for section in block.sections)
        return Columns(tuple(each for each in sections if isinstance(each, Section)))
    return block
