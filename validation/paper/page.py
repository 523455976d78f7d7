"""What paper.html says: every item with its verdict, and what it follows from."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import groupby

from markupsafe import Markup

from mbs_models.model.model_file import dumps

from ..report import page
from ..report.page import Block, Columns, Definitions, Fact, Fragment, Note, Page, Section, Verdicts
from .item import Curve, DofName, Item, Picture, Resonance, Verdict
from .panels import DECADES, draw
from .result import PaperStudy
from .tables import RowVerdict, TableRow
from .typeset import sentence, set_block, typeset

PAPER = (
    "“Effects of modal truncation and condensation methods on the Frequency Response Function "
    "of a stage reducer connected by rigid coupling to a planetary gear system” (2017)"
)
LEAD = (
    "The paper’s tables, figures, equations and claims, computed again from its parameters in "
    "several ways: by a multibody model that exudyn builds and linearises; by its two stages "
    "alone, their FRFs coupled by frequency-based substructuring (FBS); and by the lumped "
    "equations K = Σ k v vᵀ, written independently of exudyn. Every verdict follows from the "
    "computed numbers beside it."
)
DISAGREE = (
    "Until that is explained, no verdict on the paper can be trusted. See Routes against each "
    "other."
)
FIGURES = (
    "Each picture shows the same receptance as the paper’s, in dB, on its band and step and a "
    "linear axis. Top: natural frequencies by kind; a long mark where this FRF has a "
    "resonance, a short one where a mode leaves it untouched. Middle: the curves, each by the "
    "route named. Bottom: how far each is from the grey one, line by line (values more than "
    f"{DECADES} decades below the largest lie on the axis; where the grey curve is zero, the "
    "error is scaled by the norms of its row and column of H). Curves are drawn by the "
    "extreme values of narrow columns, so that no peak is lost; every line is in paper.json."
)
ROUTES = (
    "Whether the ways in which this study computes the same quantity agree, whatever the "
    "paper says. A disagreement here is a fault of the study, and crosscheck paper then ends "
    "with exit code 1."
)
PARAMETERS = (
    "The model file of each parameter set, in SI units; angles in degrees. Figures, "
    "condensation, truncation and timing use the first."
)
LOOKS = {
    Verdict.HOLDS: ("holds", "✓"),
    Verdict.CORRECTED: ("corrected", "±"),
    Verdict.FAILS: ("fails", "✗"),
    Verdict.OPEN: ("open", "?"),
}
PLURAL = {
    Verdict.HOLDS: "hold",
    Verdict.CORRECTED: "hold with a correction",
    Verdict.FAILS: "do not hold",
    Verdict.OPEN: "cannot be told",
}
SLOWEST = 12


def paper_page(study: PaperStudy) -> Page:
    """The page of a study."""
    checks = study.checks
    sections = (
        *_section("claims", "Claims", [_claim(item) for item in study.of()]),
        *_section("tables", "Tables", [_table(item) for item in study.of("tables")]),
        *_section("figures", "Figures", _figures(study.of("figures")), FIGURES),
        *_section(
            "routes", "Routes against each other", [Verdicts(checks)] if checks else [], ROUTES
        ),
        _models(study),
    )
    slowest = sorted(study.seconds.items(), key=lambda entry: -entry[1])[:SLOWEST]
    return Page(
        eyebrow="Check of a published study",
        heading="Does the paper hold?",
        title="the paper’s tables, figures and claims, checked",
        source=PAPER,
        verdict=_verdict(study),
        conclusions=(LEAD, *([] if study.agrees else [DISAGREE]), *_glance(study.of())),
        facts=tuple(_facts(study)),
        sections=sections,
        timings=dict(slowest),
        footer="every number of this report is in paper.json beside it",
        styles=("paper.css",),
        body="paper",
    )


def tally(verdicts: Iterable[Verdict]) -> str:
    """``11 hold, 10 hold with a correction, 8 do not hold``."""
    counted = Counter(verdicts)
    return ", ".join(f"{counted[v]} {PLURAL[v]}" for v in Verdict if counted[v])


def _verdict(study: PaperStudy) -> page.Verdict:
    if not study.agrees:
        return page.Verdict("The routes of this study disagree with one another", False)
    return page.Verdict(f"{len(study.items)} items: {tally(i.verdict for i in study.items)}")


def _facts(study: PaperStudy) -> Iterable[Fact]:
    for name, items in (
        ("Claims and equations", study.of()),
        ("Figures, part by part", study.of("figures")),
        ("Tables", study.of("tables")),
    ):
        if items:
            yield Fact(name, str(len(items)), tally(item.verdict for item in items))
    rows: list[TableRow] = [
        row for item in study.items for row in item.finding.details.get("rows", ())
    ]
    if rows:
        counted = Counter(row.verdict for row in rows)
        words = ", ".join(f"{counted[v]} {v}" for v in RowVerdict if counted[v])
        yield Fact("Rows of tables", str(len(rows)), words)
    checks = study.checks
    if checks:
        agreeing = sum(check.agrees for check in checks)
        more = "exudyn, FBS, equations, blocked matrices"
        yield Fact("Routes against each other", f"{agreeing} of {len(checks)} agree", more)


def _glance(items: Sequence[Item]) -> list[Block]:
    if not items:
        return []
    lines = Markup("").join(
        Markup('<li>{} <a href="#claim-{}">{}</a> <span class="small">{}</span></li>').format(
            _mark(item.verdict), item.id, typeset(item.title), typeset(item.place)
        )
        for item in items
    )
    return [Fragment(Markup('<ul class="glance">{}</ul>').format(lines))]


def _section(
    anchor: str, title: str, blocks: Sequence[Block], lead: str = ""
) -> tuple[Section, ...]:
    """A section where it has something to say."""
    return (Section(anchor, title, (*([lead] if lead else []), *blocks)),) if blocks else ()


def chip(verdict: Verdict) -> Markup:
    """A verdict as a coloured pill."""
    look, sign = LOOKS[verdict]
    return Markup('<span class="pill {}">{} {}</span>').format(look, sign, verdict)


def _mark(verdict: Verdict) -> Markup:
    look, sign = LOOKS[verdict]
    return Markup(
        '<span class="pill mark {}" title="{}" role="img" aria-label="{}">{}</span>'
    ).format(look, verdict, verdict, sign)


def _claim(item: Item) -> Section:
    heading = Fragment(
        Markup('<p class="said">{} <span class="small">{}</span></p>').format(
            chip(item.verdict), typeset(item.place)
        )
    )
    blocks = map(set_block, item.finding.blocks)
    return Section(f"claim-{item.id}", typeset(item.title), (heading, _said(item), *blocks))


def _table(item: Item) -> Section:
    title = Markup("{}: {} {}").format(item.place, typeset(item.title), chip(item.verdict))
    return Section(item.id, title, (_said(item), *map(set_block, item.finding.blocks)))


def _said(item: Item, *more: tuple[str, str]) -> Definitions:
    return Definitions(
        (
            ("The paper", (sentence(item.says),)),
            ("Computed", (sentence(item.computed),)),
            ("Found", (sentence(item.evidence),)),
            *((term, (said,)) for term, said in more),
        )
    )


# --- figures ---


def _figures(items: Sequence[Item]) -> list[Section]:
    """A section for each figure; two parts stand side by side, others one below the other."""
    found = []
    for number, group in groupby(items, lambda item: re.sub(r"^(fig\d+).*", r"\1", item.id)):
        members = list(group)
        pair = len(members) == 2
        parts = tuple(_part(item, wide=not pair) for item in members)
        notes = dict.fromkeys(i.finding.picture.band_note for i in members if i.finding.picture)
        bands = (Note(typeset(f"Band: {note}.")) for note in notes)
        anchor = number.replace("fig", "figure-")
        body: tuple[Block, ...] = (Columns(parts),) if pair else parts
        found.append(Section(anchor, members[0].place, (*body, *bands)))
    return found


def _part(item: Item, *, wide: bool) -> Section:
    title = Markup("{} {}").format(typeset(item.title), chip(item.verdict))
    shown = item.finding.picture
    if shown is None:
        return Section(item.id, title, (_said(item),))
    same = shown.response == shown.excitation
    where = (
        Markup("Drive point: {}").format(_dof(shown.response))
        if same
        else Markup("Response: {}; excitation: {}").format(
            _dof(shown.response), _dof(shown.excitation)
        )
    )
    said = _said(
        item,
        ("Resonances", shown_resonances(shown.resonances)),
        *((("Routes", typeset(routes)),) if (routes := unnamed_routes(shown.curves)) else ()),
    )
    caption = Note(Markup("Caption: {}. {}").format(typeset(shown.caption), where))
    return Section(item.id, title, (caption, _picture(item, shown, wide), said))


def _picture(item: Item, shown: Picture, wide: bool) -> page.Picture:
    return page.Picture(draw(item, shown, wide=wide), style="" if wide else "half")


def _dof(name: DofName) -> Markup:
    return Markup('{} <span class="label">{}</span> (no. {})').format(
        name.words, name.label, typeset(name.paper)
    )


def shown_resonances(marks: Iterable[Resonance]) -> str:
    """The resonances that a figure's FRF shows, by system and kind."""
    visible = [mark for mark in marks if mark.visible]
    systems = groupby(visible, lambda mark: mark.system)
    return "; ".join(f"{name}: {_by_kind(own)}" for name, own in systems) or "none"


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


def _models(study: PaperStudy) -> Section:
    files = (
        page.Preformatted(dumps(drivetrain), name, is_open=number == 0)
        for number, (name, drivetrain) in enumerate(study.drivetrains.items())
    )
    return Section("parameters", "Parameters and versions", (PARAMETERS, *files))
