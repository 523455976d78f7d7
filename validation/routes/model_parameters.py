"""Parameters by their place in the model file, as `reducer.pinion.mass`; others for a change."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import ValidationError

from mbs_models.model.messages import one_message
from mbs_models.model.parameters import Drivetrain

from ..errors import CommandError

Step = str | int

TABLES = {"stage": "stages", "inertia": "inertias", "coupling": "couplings"}


def known_parameters(drivetrain: Drivetrain) -> dict[str, object]:
    """Every number of a drivetrain by its path: ``reducer.pinion.mass`` → 2.0."""
    data = drivetrain.model_dump(exclude_none=True)
    tables = [("damping", data["damping"])]
    tables += [(table["name"], table) for group in TABLES.values() for table in data[group]]
    return {f"{name}.{key}": value for name, table in tables for key, value in _leaves(table)}


def _leaves(table: Mapping[str, Any]) -> Iterator[tuple[str, object]]:
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from ((f"{key}.{inner}", leaf) for inner, leaf in _leaves(value))
        elif isinstance(value, int | float | tuple) or value == "rigid":
            yield key, value


def model_data(drivetrain: Drivetrain) -> dict[str, Any]:
    """A drivetrain's tables as its file has them."""
    return drivetrain.model_dump(by_alias=True, exclude_unset=True, exclude_none=True)


def steps_to(data: Mapping[str, Any], path: str) -> tuple[Step, ...]:
    """Where the parameter of a path is in `model_data`."""
    name, *keys = path.split(".")
    for group in TABLES:
        for i, table in enumerate(data.get(group, ())):
            if table["name"] == name:
                return (group, i, *keys)
    return (name, *keys)


def changed(data: dict[str, Any], values: Mapping[tuple[Step, ...], float]) -> Drivetrain:
    """The drivetrain with other values at some places.

    Raises
    ------
    CommandError
        It is none any more: what the parameters refuse, in one line.
    """
    tree: Any = data
    for steps, value in values.items():
        tree = _replaced(tree, steps, value)
    try:
        return Drivetrain.model_validate(tree, by_alias=True, by_name=False)
    except ValidationError as error:
        raise CommandError(one_message(error.errors(), tree)) from error


def _replaced(tree: Any, steps: tuple[Step, ...], value: float) -> Any:
    if not steps:
        return value
    step, rest = steps[0], steps[1:]
    if isinstance(step, int):
        return [*tree[:step], _replaced(tree[step], rest, value), *tree[step + 1 :]]
    return {**tree, step: _replaced(tree.get(step, {}), rest, value)}
