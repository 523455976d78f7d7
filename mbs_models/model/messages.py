"""What is wrong with a model file, in one line: the place, its value, and what is allowed.

What is allowed is read from the JSON schema of the parameters, so that bounds and units are written
down once, there. Where the schema has no answer, pydantic's own reason stands in for it.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

from pydantic_core import ErrorDetails

from .parameters import Drivetrain, Part, stage_types
from .toml_text import bare, inline

Schema = Mapping[str, Any]
Location = tuple[int | str, ...]

LONGEST_VALUE = 60  # characters of a wrong value shown in a message
ABSENT = object()  # the value of a key that is not there
BOUNDS = {
    "exclusiveMinimum": "greater than",
    "minimum": "at least",
    "exclusiveMaximum": "less than",
    "maximum": "at most",
}
TYPES = {
    "number": "a number",
    "integer": "a whole number",
    "string": "text",
    "boolean": "true or false",
    "array": "a list",
}


def one_message(errors: Sequence[ErrorDetails], data: Mapping[str, Any]) -> str:
    """The first problem in full and the places of the others.

    Unknown keys come first: where a key is mistyped, the missing one follows from it.
    """
    problems = _telling([_problem(detail, data) for detail in errors])
    first, *others = dict.fromkeys(_written(problem.path, data) for problem in problems)
    more = f" (and {len(others)} more: {', '.join(others)})" if others else ""
    line = _text(problems[0], first) + more
    return line.replace("\n", "\\n")  # a validator may have quoted a name as it is


def not_toml(error: Exception, text: str) -> str:
    """What the reader of TOML says, in a user's words and with the line it speaks of."""
    said = str(error).replace("Cannot overwrite a value", "the key is there already")
    place = re.search(r"\(at line (\d+), column \d+\)$", said)
    line = text.split("\n")[int(place[1]) - 1].strip() if place else ""
    return f"{said}: {_short(line)}" if line and line.isprintable() else said


def suggest(wrong: str, right: Iterable[str]) -> str:
    """The nearest right name, and all of them."""
    nearest = "".join(f"did you mean {name!r}? " for name in _nearest(wrong, right))
    return f"{nearest}allowed: {', '.join(right)}"


@dataclass(frozen=True)
class Problem:
    """One of pydantic's errors, and where in the file it is.

    Attributes
    ----------
    detail
        The error.
    path, value
        Keys and indices that lead to the wrong value, and the value, or ABSENT.
    schema
        What governs the value; empty where nothing is known of it.
    parent
        What governs the table or list that the value is in.
    """

    detail: ErrorDetails
    path: Location
    value: object
    schema: Schema
    parent: Schema

    @property
    def unknown_key(self) -> bool:
        """Whether the last key is none of its table's."""
        return self.detail["type"] == "extra_forbidden" or self.detail["loc"][-1:] == ("[key]",)

    @property
    def meant(self) -> set[Location]:
        """The known key that an unknown one probably stands for."""
        if not self.unknown_key:
            return set()
        keys = _nearest(str(self.path[-1]), _keys(self.parent))
        return {(*self.path[:-1], key) for key in keys}

    @property
    def said(self) -> bool:
        """Whether a validator of ours says what is wrong."""
        return self.detail["type"] == "value_error"


def _telling(problems: Sequence[Problem]) -> list[Problem]:
    """The problems without those that only follow from another, unknown keys first.

    A list with a bad item is also none of the other things its key may be, and may be too short for
    want of the item; what an unknown key holds does not count; a mistyped key is also missing; and
    what a validator says of a value is more than that it is none of the other things it may be.
    """
    unknown = [problem for problem in problems if problem.unknown_key]
    meant = set().union(*(problem.meant for problem in unknown))
    unknown_paths = {problem.path for problem in unknown}
    above = {path for problem in problems for path in _above(problem.path)}
    said = {problem.path for problem in problems if problem.said}
    known = [
        problem
        for problem in problems
        if not problem.unknown_key
        and problem.path not in above
        and unknown_paths.isdisjoint(_above(problem.path))
        and not (problem.value is ABSENT and problem.path in meant)
        and (problem.said or problem.path not in said)
    ]
    return unknown + known


def _above(path: Location) -> set[Location]:
    return {path[:n] for n in range(len(path))}


def _text(problem: Problem, where: str) -> str:
    """One problem as ``where.key = value: what is allowed``."""
    allowed = _allowed(problem.schema)
    reason = f"must be {allowed}" if allowed else problem.detail["msg"]
    if problem.value is ABSENT:
        return f"{where}: missing; {reason}"
    if problem.said:
        reason = str(problem.detail["ctx"]["error"])
        if isinstance(problem.value, Mapping):  # a whole table: the reason names key and value
            return f"{where}: {reason}" if where else reason
    if problem.unknown_key:
        reason = f"unknown key; {suggest(str(problem.path[-1]), _keys(problem.parent))}"
    return f"{where} = {_short(inline(problem.value))}: {reason}"


# Places


def _problem(detail: ErrorDetails, data: Mapping[str, Any]) -> Problem:
    """Follow an error's location through file and schema, past the names of union branches."""
    schema: Schema = _drivetrain_schema()
    parent: Schema = {}
    path: Location = ()
    value: object = data
    ends_in_a_key = detail["type"] in ("missing", "extra_forbidden")
    for depth, step in enumerate(detail["loc"], start=1):
        branch, below, inside = _branch(schema, step), _below(schema, step), _inside(value, step)
        if branch is not None:
            schema = branch
        elif isinstance(step, int) and inside is ABSENT:
            break  # an item too few: the list is wrong
        elif (
            below is not None
            or (inside is not ABSENT and "anyOf" not in schema)
            or (ends_in_a_key and depth == len(detail["loc"]))
        ):
            path, value, parent, schema = (*path, step), inside, schema, below or {}
    tag = _tag(schema)
    if tag and detail["type"].startswith("union_tag"):
        key = tag["propertyName"]
        path, value, parent = (*path, key), _inside(value, key), schema
        schema = {"anyOf": [{"const": name} for name in tag["mapping"]]}
    return Problem(detail, path, value, schema, parent)


def _inside(value: object, step: int | str) -> object:
    """What a table has under a key or a list at an index."""
    if isinstance(value, Mapping):
        return value.get(step, ABSENT)
    if isinstance(value, list | tuple) and isinstance(step, int) and step < len(value):
        return value[step]
    return ABSENT


def _written(path: Location, data: Mapping[str, Any]) -> str:
    """A place as a reader finds it: ``stage[0] 'reducer': pinion.mass``."""
    if len(path) < 2 or not isinstance(path[1], int):
        return _dotted(path)
    name = _inside(_inside(data[str(path[0])], path[1]), "name")
    label = f" {_short(repr(name))}" if isinstance(name, str) else ""
    key = _dotted(path[2:])
    return _dotted(path[:2]) + label + (f": {key}" if key else "")


def _dotted(path: Location) -> str:
    """``stage[0].pinion.mass`` for the path ("stage", 0, "pinion", "mass")."""
    steps = (f"[{step}]" if isinstance(step, int) else f".{bare(step)}" for step in path)
    return "".join(steps).removeprefix(".")


def _short(text: str) -> str:
    return text if len(text) <= LONGEST_VALUE else f"{text[: LONGEST_VALUE - 1]}…"


# What the schema allows


def _drivetrain_schema() -> Schema:
    return _schema_with(stage_types())


@cache
def _schema_with(_: tuple[type[Part], ...]) -> Schema:
    return Drivetrain.model_json_schema(by_alias=True)


def _resolved(schema: Schema) -> Schema:
    """The schema behind a reference."""
    while "$ref" in schema:
        schema = _drivetrain_schema()["$defs"][schema["$ref"].rpartition("/")[2]]
    return schema


def _alternatives(schema: Schema) -> Iterator[Schema]:
    """All that a value may be: TOML has no null, so that leaving a key out is none of them."""
    schema = _resolved(schema)
    if "anyOf" not in schema:
        yield schema
        return
    for branch in schema["anyOf"]:
        if branch.get("type") != "null":
            yield from _alternatives(branch)


def _tag(schema: Schema) -> Schema:
    """Which key tells the tables apart that a value may be, and their names (empty: none)."""
    return next((s["discriminator"] for s in _alternatives(schema) if "discriminator" in s), {})


def _branch(schema: Schema, step: int | str) -> Schema | None:
    """The schema of the table that a name stands for, where a key tells tables apart."""
    mapping = _tag(schema).get("mapping", {})
    return {"$ref": mapping[step]} if step in mapping else None


def _below(schema: Schema, step: int | str) -> Schema | None:
    """The schema of a table's key or of a list's item; None if there is no such thing."""
    for each in _alternatives(schema):
        if isinstance(step, int):
            items = each.get("prefixItems", ())
            found = items[step] if step < len(items) else each.get("items")
        elif step in each.get("properties", ()):
            found = each["properties"][step]
        else:
            found = each.get("additionalProperties")
        if isinstance(found, Mapping):
            return found
    return None


def _keys(schema: Schema) -> list[str]:
    """The keys of the tables that a value may be."""
    return [
        key
        for each in _alternatives(schema)
        for key in each.get("properties", each.get("propertyNames", {}).get("enum", ()))
    ]


def _allowed(schema: Schema) -> str:
    """What a schema allows, in words: "a number, greater than 0 (kg)"; nothing if it is unknown."""
    return " or ".join(filter(None, map(_words, _alternatives(schema))))


def _words(schema: Schema) -> str:
    if "const" in schema:
        return inline(schema["const"])
    if "discriminator" in schema:
        tag = schema["discriminator"]
        return f"a table with {tag['propertyName']} {' or '.join(map(inline, tag['mapping']))}"
    if "enum" in schema:
        return " or ".join(map(inline, schema["enum"]))
    if schema.get("type") == "object":
        return f"a table with {', '.join(_keys(schema))}"
    if "prefixItems" in schema and "description" not in schema:
        return f"a list of {len(schema['prefixItems'])}, each {_allowed(schema['prefixItems'][0])}"
    bounds = " and ".join(f"{BOUNDS[key]} {schema[key]:g}" for key in BOUNDS if key in schema)
    words: str = schema.get("description") or TYPES.get(schema.get("type", ""), "")
    unit = f" ({schema['unit']})" if "unit" in schema else ""
    return (f"{words}, {bounds}" if bounds else words) + unit


def _nearest(wrong: str, right: Iterable[str]) -> list[str]:
    return difflib.get_close_matches(wrong, list(right), n=1)
