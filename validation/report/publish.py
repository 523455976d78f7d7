"""From a study's result to its files: page, numbers and whatever goes with them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

from ..checks.check import Check
from ..runtime.output_folder import Writer, write_together
from .documents import document_text
from .page import Page
from .pages import page_html
from .provenance import Provenance, provenance


class Result(Protocol):
    """What a study finds, ready to be published."""

    @property
    def files(self) -> tuple[str, str]:
        """Names of its page and of its numbers."""

    @property
    def checks(self) -> tuple[Check, ...]:
        """The verdicts."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """What to mind."""

    def page(self) -> Page:
        """What its page says."""

    def document(self, made: Provenance) -> Mapping[str, Any]:
        """Its numbers: what `documents.plain` can read."""

    def companions(self, made: Provenance) -> Mapping[str, str | Writer]:
        """Other files, by name: their text, or what writes them."""


def publish(result: Result, directory: Path) -> tuple[Path, ...]:
    """Write a result's page, numbers and companions, all or none; returns their paths.

    Raises
    ------
    ReportError
        The directory or a file in it cannot be written.
    """
    made = provenance()
    page, numbers = result.files
    contents: dict[str, str | Writer] = {
        page: page_html(result.page(), made),
        numbers: document_text(result.document(made)),
        **result.companions(made),
    }
    return write_together(directory, contents)
