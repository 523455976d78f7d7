"""The report of a cross-check: report.html for people, results.json for programs."""

from __future__ import annotations

from pathlib import Path

from ..output_folder import ReportError, write_together
from ..results import CrossCheck
from .html import report_html
from .provenance import provenance
from .results_json import results_text

__all__ = ["ReportError", "write_report"]


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
