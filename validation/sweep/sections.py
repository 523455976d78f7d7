"""The page of a sweep: parameters, metrics in numbers, pictures."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup

from mbs_models.model.model_file import dumps

from ..report.digits import grouped
from ..report.page import (
    Block,
    Fact,
    Note,
    Page,
    Picture,
    Section,
    Table,
    Verdict,
    model_section,
    source_of,
)
from ..routes.model_parameters import known_parameters
from .describe import describe_sample, describe_value, failures, hints, method, verdict
from .result import SweepResult

MOST_FAILURES = 20  # in the page


def sweep_page(result: SweepResult) -> Page:
    """What sweep.html says."""
    failed = int((~result.results.ok).sum())
    return Page(
        eyebrow="Drivetrain cross-check · sweep of parameters",
        heading=result.title,
        title="sweep of parameters",
        source=source_of(result.drivetrain.source),
        verdict=Verdict(verdict(result)),
        conclusions=(
            *([f"{method(result)}."] if result.has_frf else []),
            *(f"{hint[0].upper()}{hint[1:]}." for hint in hints(result)),
        ),
        warnings=failures(result, MOST_FAILURES),
        warnings_title=f"{failed} sample{'' if failed == 1 else 's'} failed",
        facts=_facts(result),
        sections=(
            Section("parameters", "Parameters", (parameter_table(result),)),
            *_metrics(result),
            *(
                Section(picture.name, picture.title, (picture.words, Picture(picture.inline)))
                for picture in result.pictures
            ),
            model_section(
                dumps(result.drivetrain), "As it is in its file, before anything is varied."
            ),
        ),
        timings=result.seconds,
        footer="every sample is in sweep.csv and sweep.npz beside it, a summary in sweep.json",
    )


def _facts(result: SweepResult) -> tuple[Fact, ...]:
    how = "sampled from tolerances" if result.samples.sampled else "over a grid"
    facts = [
        Fact("Parameters", str(len(result.samples.paths)), how),
        Fact("Samples", grouped(len(result.results.ok)), f"of route {result.plan.route}"),
    ]
    if result.has_frf:
        f = result.frequency
        facts.append(Fact("Lines", grouped(len(f)), f"{f[0]:g} to {f[-1]:g} Hz"))
    return tuple(facts)


def parameter_table(result: SweepResult) -> Table:
    """What is varied, in which unit, from where to where."""
    known = known_parameters(result.drivetrain)
    rows = tuple(
        (
            Markup("<code>{}</code>").format(path),
            unit or "–",
            describe_value(known[path]),
            describe_value(values.min()),
            describe_value(values.max()),
            str(len(np.unique(values))),
        )
        for path, unit, values in zip(
            result.samples.paths, result.units, result.values.T, strict=True
        )
    )
    headings = ("Parameter", "Unit", "In the model", "Lowest", "Highest", "Values")
    return Table(headings, rows, frozenset({2, 3, 4, 5}))


def _metrics(result: SweepResult) -> tuple[Section, ...]:
    if not result.metrics:
        return ()
    missing = tuple(Note(words) for words in missing_metrics(result))
    blocks: tuple[Block, ...] = (metric_table(result), *missing)
    return (Section("metrics-table", "Metrics in numbers", blocks),)


def metric_table(result: SweepResult) -> Table:
    """Percentiles of sampled metrics, or the extremes over a grid and where they are."""
    rows = tuple(
        (name, result.metric_labels[name], *_numbers(result, column))
        for name, column in result.metrics.items()
    )
    if result.samples.sampled:
        return Table(("Metric", "Of", "5 %", "Median", "95 %"), rows, frozenset({2, 3, 4}))
    headings = ("Metric", "Of", "Lowest", "At", "Highest", "At")
    return Table(headings, rows, frozenset({2, 4}))


def _numbers(result: SweepResult, column: np.ndarray) -> tuple[str, ...]:
    rows = np.flatnonzero(result.results.ok & np.isfinite(column))
    if result.samples.sampled:
        if not len(rows):
            return ("–", "–", "–")
        return tuple(map(describe_value, np.percentile(column[rows], (5, 50, 95))))
    if not len(rows):
        return ("–", "", "–", "")
    ends = rows[np.argmin(column[rows])], rows[np.argmax(column[rows])]
    return tuple(
        text for i in ends for text in (describe_value(column[i]), describe_sample(result, i))
    )


def missing_metrics(result: SweepResult) -> tuple[str, ...]:
    """Of which metrics some samples that succeeded have none."""
    ok = result.results.ok
    counts = {name: int((ok & ~np.isfinite(c)).sum()) for name, c in result.metrics.items()}
    return tuple(
        f"{name}: {'no sample has' if n == ok.sum() else f'{n} of {ok.sum()} samples do not have'} "
        "one."
        for name, n in counts.items()
        if n
    )
