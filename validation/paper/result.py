"""What the study of the paper finds, ready to be published."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from math import isnan
from typing import Any, ClassVar

from mbs_models.model.parameters import Drivetrain

from ..checks.check import Check
from ..report.page import Page
from ..report.provenance import Provenance
from ..runtime.output_folder import Writer
from .item import Item


@dataclass(frozen=True, eq=False)
class PaperStudy:
    """All items asked for, in the paper's order.

    Attributes
    ----------
    items
        Each with its verdict.
    drivetrains
        Parameter set → its drivetrain; the first is the one studied.
    seconds
        How long each item took (what several need counts for the first).
    """

    files: ClassVar = ("paper.html", "paper.json")
    warnings: ClassVar[tuple[str, ...]] = ()

    items: tuple[Item, ...]
    drivetrains: Mapping[str, Drivetrain]
    seconds: Mapping[str, float] = field(default_factory=dict)

    @property
    def checks(self) -> tuple[Check, ...]:
        """Whether the study's own routes agree, whatever the paper says, at their worst."""
        return worst_checks(check for item in self.items for check in item.finding.checks)

    @property
    def agrees(self) -> bool:
        """Whether they all do."""
        return all(check.agrees for check in self.checks)

    @property
    def verdicts(self) -> tuple[tuple[str, str], ...]:
        """(id, verdict) of every item and table row, in the paper's order."""
        found: list[tuple[str, str]] = []
        for item in self.items:
            found.append((item.id, item.verdict))
            rows = item.finding.details.get("rows", ())
            found += [(f"{item.id} row {r.number}, {r.printed}", r.verdict) for r in rows]
        return tuple(found)

    def item(self, id: str) -> Item:
        """An item by its name."""
        return next(item for item in self.items if item.id == id)

    def of(self, *subjects: str) -> tuple[Item, ...]:
        """Items of some subjects; of all but tables and figures where none is named."""
        if subjects:
            return tuple(item for item in self.items if item.subject in subjects)
        return tuple(item for item in self.items if item.subject not in ("tables", "figures"))

    def page(self) -> Page:
        """What paper.html says."""
        from .page import paper_page  # pictures take their time to load

        return paper_page(self)

    def document(self, made: Provenance) -> dict[str, Any]:
        """What paper.json holds."""
        return {
            "date": made.date,
            "platform": made.platform,
            "versions": made.versions,
            "drivetrain": next(iter(self.drivetrains.values())).name,
            "parameter_sets": list(self.drivetrains),
            "route_checks": self.checks,
            "tables": [_document(item) for item in self.of("tables")],
            "figures": [_document(item) for item in self.of("figures")],
            "claims": [_document(item) for item in self.of()],
            "verdicts": [{"id": id, "verdict": verdict} for id, verdict in self.verdicts],
            "seconds": self.seconds,
        }

    def companions(self, made: Provenance) -> dict[str, str | Writer]:
        """No other files."""
        return {}


def worst_checks(checks: Iterable[Check]) -> tuple[Check, ...]:
    """Checks of one name, routes and measure as one: the largest value, and where it is."""
    found: dict[tuple[str, tuple[str, str], str], Check] = {}
    for check in checks:
        key = (check.name, check.routes, check.measure)
        known = found.get(key)
        if known is None or not (isnan(known.value) or check.value <= known.value):
            found[key] = check
    return tuple(
        check if check.agrees else replace(check, findings=(check.note,) if check.note else ())
        for check in found.values()
    )


def _document(item: Item) -> dict[str, Any]:
    """A record of paper.json: words, verdict, numbers, and what else was computed."""
    found = item.finding
    picture = found.picture
    drawn = {f.name: getattr(picture, f.name) for f in fields(picture)} if picture else {}
    return {
        "id": item.id, "title": item.title, "subject": item.subject, "place": item.place,
        "says": item.says, "computed": item.computed, "verdict": found.verdict,
        "evidence": found.evidence, "numbers": found.numbers, **drawn, **found.details,
    }  # fmt: skip
