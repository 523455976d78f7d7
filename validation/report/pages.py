"""The templates of the pages."""

from __future__ import annotations

from jinja2 import Environment, PackageLoader, StrictUndefined

from .digits import engineering, grouped, hertz, scientific


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
        scientific=scientific, hertz=hertz, count=grouped, engineering=engineering
    )
    return templates
