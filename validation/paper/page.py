"""paper.html and paper.json: what became of the paper's tables, figures and claims."""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from enum import StrEnum
from itertools import groupby
from pathlib import Path

from mbs_models.model.model_file import dumps
from mbs_models.model.parameters import Drivetrain

from ..report.pages import environment
from ..report.provenance import Provenance, provenance
from ..report.style import styled
from ..runtime.output_folder import write_together
from . import PaperStudy, RowVerdict, Verdict, to_json
from .agreement import route_checks
from .model import parameter_sets
from .page_figures import DECADES, draw
from .page_tables import (
    decibel,
    heat_table,
    locked_frequencies,
    longest,
    order_in_words,
    stiffness_table,
)
from .page_text import sentence, shown_resonances, typeset, unnamed_routes
from .results import Figure

NUMBER = re.compile(r"fig(\d+)")
SIGNS = {"holds": "✓", "corrected": "±", "fails": "✗"}
LOOKS: Mapping[StrEnum, str] = {
    Verdict.HOLDS: "holds",
    Verdict.CORRECTED: "corrected",
    Verdict.FAILS: "fails",
    RowVerdict.REPRODUCED: "holds",
    RowVerdict.CORRECTED: "corrected",
    RowVerdict.MISSED: "fails",
}
PLURAL: Mapping[str, str] = {
    Verdict.HOLDS: "hold",
    Verdict.CORRECTED: "hold with a correction",
    Verdict.FAILS: "do not hold",
}
ROW_WORDS: Mapping[str, str] = {RowVerdict.CORRECTED: "with a correction"}


@dataclass(frozen=True)
class Part:
    """One part of a figure, drawn."""

    figure: Figure
    svg: str
    wide: bool


@dataclass(frozen=True)
class PaperFigure:
    """All parts of one of the paper's figures, and what is true of every part."""

    number: int
    parts: tuple[Part, ...]
    bands: tuple[str, ...]

    @property
    def place(self) -> str:
        """Where it stands in the paper."""
        return self.parts[0].figure.place


@dataclass(frozen=True)
class Tally:
    """How many of a kind hold, hold with a correction, and do not hold."""

    name: str
    counts: tuple[tuple[str, str, int], ...]

    @property
    def total(self) -> int:
        """How many there are."""
        return sum(count for _, _, count in self.counts)


def write_paper_report(
    study: PaperStudy, directory: Path, preset: Drivetrain | None = None
) -> tuple[Path, Path]:
    """Write ``paper.html`` and ``paper.json``, both whole or neither; returns their paths.

    ``preset`` is the drivetrain of the study, if it was not the preset ``paper``. A `ReportError`
    says why they cannot be written.
    """
    made = provenance()
    models = {name: dumps(case.drivetrain) for name, case in parameter_sets(preset).items()}
    texts = {"paper.html": paper_html(study, made, models), "paper.json": paper_json(study, made)}
    html, data = write_together(directory, texts)
    return html, data


def paper_json(study: PaperStudy, made: Provenance) -> str:
    """The text of paper.json: strict JSON, compact."""
    document = {
        "date": made.date,
        "platform": made.platform,
        "versions": dict(made.versions),
        "route_checks": [
            {
                **asdict(check),
                "value": check.value if math.isfinite(check.value) else None,
                "agrees": check.agrees,
            }
            for check in route_checks(study)
        ],
        **to_json(study),
    }
    return json.dumps(document, ensure_ascii=False, allow_nan=False, separators=(",", ":")) + "\n"


def paper_html(study: PaperStudy, made: Provenance, models: Mapping[str, str]) -> str:
    """The text of paper.html; ``models`` is the model file of every parameter set."""
    checks = route_checks(study)
    templates = environment()
    templates.filters.update(
        look=LOOKS.__getitem__,
        decibel=decibel,
        first_clause=_first_clause,
        typeset=typeset,
        sentence=sentence,
        resonances=shown_resonances,
        routes=unnamed_routes,
    )
    shafts, stiffness = stiffness_table(study.stiffness)
    return templates.get_template("paper.html").render(
        study=study,
        made=made,
        models=models,
        signs=SIGNS,
        plural=PLURAL,
        row_words=ROW_WORDS,
        tallies=_tallies(study),
        figures=_figures(study.figures),
        decades=DECADES,
        sets=study.parameter_sets,
        checks=checks,
        disagreeing=[check for check in checks if not check.agrees],
        heat=heat_table(study.truncation) if study.truncation else None,
        order_in_words=order_in_words,
        shafts=shafts,
        stiffness=stiffness,
        locked_frequencies=locked_frequencies,
        slowest=longest(study.seconds),
        total_seconds=sum(study.seconds.values()),
    )


def _tallies(study: PaperStudy) -> list[Tally]:
    rows = [row.verdict for table in study.tables for row in table.rows]
    tallies = (
        _tally("Claims", Verdict, (claim.verdict for claim in study.claims)),
        _tally("Figures, part by part", Verdict, (figure.verdict for figure in study.figures)),
        _tally("Rows of Tables 3 and 4", RowVerdict, rows),
    )
    return [tally for tally in tallies if tally.total]


def _tally(name: str, kinds: type[StrEnum], verdicts: Iterable[StrEnum]) -> Tally:
    counted = Counter(verdicts)
    return Tally(name, tuple((LOOKS[kind], str(kind), counted[kind]) for kind in kinds))


def _figures(figures: Iterable[Figure]) -> list[PaperFigure]:
    """Draw every part; two parts stand side by side, any other number one below the other."""
    found = []
    with styled():
        for number, group in groupby(figures, _number):
            members = list(group)
            wide = len(members) != 2
            parts = tuple(Part(figure, draw(figure, wide=wide), wide) for figure in members)
            bands = tuple(dict.fromkeys(figure.band_note for figure in members))
            found.append(PaperFigure(number, parts, bands))
    return found


def _number(figure: Figure) -> int:
    found = NUMBER.match(figure.id)
    return int(found[1]) if found else 0


def _first_clause(reason: str) -> str:
    """The first half of a reason; where a row is reproduced, the rest is in its columns."""
    return reason.split(";")[0]
