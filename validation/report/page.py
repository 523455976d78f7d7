"""What a page says, as data: head, sections, and the blocks sections are made of.

A block is a text (a paragraph), or one of the classes here; a section holds them in the order they
are read. Text is escaped; `markupsafe.Markup` stands as it is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar

from ..checks.check import Check


@dataclass(frozen=True)
class Note:
    """A paragraph in small print."""

    kind: ClassVar[str] = "note"
    text: str


@dataclass(frozen=True)
class Bullets:
    """A list of sentences."""

    kind: ClassVar[str] = "bullets"
    items: tuple[str, ...]


@dataclass(frozen=True)
class Definitions:
    """Terms, each with what is said of it."""

    kind: ClassVar[str] = "definitions"
    entries: tuple[tuple[str, tuple[str, ...]], ...]


@dataclass(frozen=True)
class Table:
    """A table, which scrolls inside its frame where the page is narrow.

    Attributes
    ----------
    headings, rows
        Texts.
    numbers
        Columns of numbers, which stand to the right.
    style
        CSS classes of the table.
    row_styles
        Row → its CSS classes.
    empty
        What is said in place of rows where there are none; without it there is no table then.
    """

    kind: ClassVar[str] = "table"
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numbers: frozenset[int] = frozenset()
    style: str = ""
    row_styles: Mapping[int, str] = field(default_factory=dict)
    empty: str = ""

    def with_columns(self, columns: Sequence[int]) -> Table:
        """Some of its columns, as for a terminal."""
        return replace(
            self,
            headings=tuple(self.headings[column] for column in columns),
            rows=tuple(tuple(row[column] for column in columns) for row in self.rows),
            numbers=frozenset(n for n, column in enumerate(columns) if column in self.numbers),
        )


@dataclass(frozen=True)
class Picture:
    """A figure (SVG), under a heading and a note where it has them."""

    kind: ClassVar[str] = "picture"
    svg: str
    title: str = ""
    note: str = ""
    style: str = ""


@dataclass(frozen=True)
class Verdicts:
    """The one table of verdicts: value against tolerance, margin, reason, findings."""

    kind: ClassVar[str] = "verdicts"
    checks: tuple[Check, ...]


@dataclass(frozen=True)
class Preformatted:
    """Text as it is, such as a model file; with a summary it can be folded away."""

    kind: ClassVar[str] = "preformatted"
    text: str
    summary: str = ""
    is_open: bool = True


@dataclass(frozen=True)
class Fragment:
    """HTML of what is none of these."""

    kind: ClassVar[str] = "fragment"
    html: str


@dataclass(frozen=True)
class Folded:
    """Blocks under a summary, folded away or open."""

    kind: ClassVar[str] = "folded"
    summary: str
    blocks: tuple[Block, ...]
    is_open: bool = False


@dataclass(frozen=True)
class Columns:
    """Sections beside each other."""

    kind: ClassVar[str] = "columns"
    sections: tuple[Section, ...]


@dataclass(frozen=True)
class Section:
    """A heading and what stands below it.

    Attributes
    ----------
    anchor
        Of the heading, unique in the page; empty: it has none.
    title
        The heading.
    blocks
        In the order they are read; a section among them is one level lower.
    """

    kind: ClassVar[str] = "section"
    anchor: str
    title: str
    blocks: tuple[Block, ...] = ()

    @property
    def paragraphs(self) -> tuple[str, ...]:
        """Its plain text."""
        return tuple(block for block in self.blocks if isinstance(block, str))

    @property
    def tables(self) -> tuple[Table, ...]:
        """Its tables."""
        return tuple(block for block in self.blocks if isinstance(block, Table))

    @property
    def pictures(self) -> tuple[Picture, ...]:
        """Its figures."""
        return tuple(block for block in self.blocks if isinstance(block, Picture))


Block = (
    str
    | Note
    | Bullets
    | Definitions
    | Table
    | Picture
    | Verdicts
    | Preformatted
    | Fragment
    | Folded
    | Columns
    | Section
)


@dataclass(frozen=True)
class Verdict:
    """The study in a sentence; ``agrees`` is None where nothing was checked: a finding."""

    sentence: str
    agrees: bool | None = None

    @property
    def style(self) -> str:
        """Its CSS class."""
        return "finding" if self.agrees is None else "agree" if self.agrees else "disagree"

    @property
    def sign(self) -> str:
        """What stands before it."""
        return "" if self.agrees is None else "✓ " if self.agrees else "✗ "


@dataclass(frozen=True)
class Fact:
    """A number worth a large print, what it is of, and what belongs to it."""

    name: str
    value: str
    more: str = ""


@dataclass(frozen=True)
class Page:
    """A page.

    Attributes
    ----------
    eyebrow, heading, title, source
        Above the heading, the heading, what the browser's tab says after it, and where the model
        is from.
    verdict, conclusions
        The outcome, and what else matters.
    warnings
        What to mind.
    facts
        Numbers at a glance.
    sections
        What is found; the last is about the model, and the page ends it with versions and timings.
    timings
        Seconds by step.
    footer
        What is in the files beside it.
    styles
        Templates of CSS beyond the page's own.
    body
        CSS class of the whole.
    """

    eyebrow: str
    heading: str
    title: str
    source: str
    verdict: Verdict
    sections: tuple[Section, ...]
    conclusions: tuple[Block, ...] = ()
    warnings: tuple[str, ...] = ()
    facts: tuple[Fact, ...] = ()
    timings: Mapping[str, float] = field(default_factory=dict)
    footer: str = ""
    styles: tuple[str, ...] = ()
    body: str = ""
    warnings_title: str = ""


def model_section(text: str, *before: Block) -> Section:
    """The section on the model: its file."""
    return Section("model", "Model", (*before, Preformatted(text)))


def source_of(text: str) -> str:
    """What a page says of where a model is from."""
    return text or "No source is given in the model file."
