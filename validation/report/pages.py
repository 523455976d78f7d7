"""The templates of the pages."""

from __future__ import annotations

from jinja2 import Environment, PackageLoader, StrictUndefined

from .digits import engineering, grouped, hertz, scientific
from .page import Page
from .provenance import Provenance
from .verdicts import SHOWN, verdict_table


def environment() -> Environment:
    """The templates: strict, escaped, with the filters of numbers."""
    templates = Environment(
        loader=PackageLoader("validation.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    templates.filters.update(
        scientific=scientific,
        hertz=hertz,
        count=grouped,
        engineering=engineering,
        verdict_table=verdict_table,
    )
    return templates


def page_html(page: Page, made: Provenance) -> str:
    """The text of a page, which needs nothing but itself."""
    return environment().get_template("page.html").render(page=page, made=made, shown=SHOWN)
