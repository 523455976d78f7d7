"""The report of a cross-check: report.html for people, results.json for programs."""

from __future__ import annotations

from pathlib import Path

from ..report.provenance import provenance
from ..runtime.output_folder import write_together
from .page import report_html
from .results import CrossCheck
from .results_json import results_text


def write_report(result: CrossCheck, directory: Path) -> tuple[Path, Path]:
    """Write ``report.html`` and ``results.json``, both whole or neither.

    Parameters
    ----------
    result
        What a cross-check found.
    directory
        Where to; made if it is not there.

    Returns
    -------
    html, json
        The files' paths.

    Raises
    ------
    ReportError
        The files cannot be written there.
    """
    made = provenance()
    texts = {"report.html": report_html(result, made), "results.json": results_text(result, made)}
    html, json = write_together(directory, texts)
    return html, json
