"""What axes and legends call a varied parameter: its words, and the unit that its table gives."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from mbs_models.model.parameters import Drivetrain


def parameter_labels(drivetrain: Drivetrain, paths: tuple[str, ...]) -> tuple[str, ...]:
    """``reducer.pinion: mass (kg)`` of ``reducer.pinion.mass``."""
    labels = []
    for path in paths:
        place, _, key = path.rpartition(".")
        unit = unit_of(drivetrain, path)
        labels.append(f"{place}: {key.replace('_', ' ')}" + (f" ({unit})" if unit else ""))
    return tuple(labels)


def unit_of(drivetrain: Drivetrain, path: str) -> str:
    """The unit of a parameter; empty of a number of things."""
    name, *keys = path.split(".")
    tables = {item.name: type(item) for item in drivetrain.items}
    schema = tables.get(name, type(drivetrain.damping)).model_json_schema(by_alias=True)
    described: Mapping[str, Any] = schema
    for key in keys:
        described = next(
            each["properties"][key]
            for each in _alternatives(described, schema.get("$defs", {}))
            if key in each.get("properties", ())
        )
    return next(
        (
            each["unit"]
            for each in _alternatives(described, schema.get("$defs", {}))
            if "unit" in each
        ),
        "",
    )


def _alternatives(schema: Mapping[str, Any], known: Mapping[str, Any]) -> Iterator[Any]:
    """The schemas that a value may follow."""
    if "$ref" in schema:
        schema = known[schema["$ref"].rpartition("/")[2]]
    yield schema
    for each in (*schema.get("anyOf", ()), *schema.get("oneOf", ())):
        yield from _alternatives(each, known)
