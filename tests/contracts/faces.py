"""What the public sees of a file, a page or a command, as lines of text that can be compared."""

from __future__ import annotations

import csv
import inspect
import json
import re
import typing
from collections.abc import Callable, Iterator, Mapping
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import typer

from validation.cli import app

Lines = list[str]

# --- JSON ---------------------------------------------------------------------------------------

KINDS: Mapping[type, str] = {
    str: "string",
    bool: "boolean",
    int: "number",
    float: "number",
    type(None): "null",
    list: "empty list",
    dict: "empty object",
}
# Objects whose keys are no part of the format: steps of the computation, with how long each took.
ANY_KEY = {"timings_s", "seconds"}
# The model file over again, whose keys the schema pins.
MODEL_FILE = "parameters"


def json_lines(text: str) -> Lines:
    """``path: type`` of every value, items of lists merged; strict JSON only.

    ``null`` is left out where the same path holds something else as well: whether a value is
    missing depends on numbers, not on the format.
    """
    found: dict[str, set[str]] = {}
    for path, kind in _leaves(json.loads(text, parse_constant=_no_constant), ""):
        found.setdefault(path, set()).add(kind)
    inner = {path[: k + 1] for path in found for k, sign in enumerate(path[1:]) if sign in ".["}
    empty = {"null", "empty list", "empty object"}
    lines = []
    for path, kinds in sorted(found.items()):
        filled = kinds - empty
        if filled or path not in inner:
            lines.append(f"{path}: {' | '.join(sorted(filled or kinds))}")
    return lines


def _leaves(value: Any, path: str) -> Iterator[tuple[str, str]]:
    if path == MODEL_FILE:
        yield path, "model file"
    elif isinstance(value, dict) and value:
        free = path.rpartition(".")[2] in ANY_KEY
        for key, item in value.items():
            name = "*" if free else key if re.fullmatch(r"[\w-]+", key) else f'"{key}"'
            yield from _leaves(item, f"{path}.{name}".lstrip("."))
    elif isinstance(value, list) and value:
        for item in value:
            yield from _leaves(item, f"{path}[]")
    else:
        yield path, KINDS[type(value)]


def _no_constant(word: str) -> None:
    raise AssertionError(f"{word} is no JSON")


# --- the model file's schema --------------------------------------------------------------------


def schema_lines(text: str) -> Lines:
    """``key: type unit = default`` of every key of a model file; names of definitions are ours."""
    schema = json.loads(text)
    return sorted(_keys(schema, schema["$defs"], ""))


def _keys(table: Mapping[str, Any], known: Mapping[str, Any], path: str) -> Iterator[str]:
    for key, described in table.get("properties", {}).items():
        where = f"{path}.{key}".lstrip(".")
        default = f" = {json.dumps(described['default'])}" if "default" in described else ""
        needed = ", required" if key in table.get("required", ()) else ""
        variants = list(_variants(described, known, ""))
        kinds = sorted({kind for _, kind, _ in variants})
        yield f"{where}: {' | '.join(kinds)}{default}{needed}"
        for suffix, _, inner in variants:
            yield from _keys(inner, known, where + suffix)


def _variants(
    described: Mapping[str, Any], known: Mapping[str, Any], suffix: str
) -> Iterator[tuple[str, str, Mapping[str, Any]]]:
    """(where below the key, type and unit, table) of everything a key may hold."""
    if "$ref" in described:
        described = known[described["$ref"].rpartition("/")[2]]
    for one in (*described.get("oneOf", ()), *described.get("anyOf", ())):
        yield from _variants(one, known, suffix)
    if "items" in described:
        for below, kind, inner in _variants(described["items"], known, f"{suffix}[]"):
            yield below, f"list of {kind}", inner
    elif isinstance(described.get("additionalProperties"), dict):
        names = "|".join(described.get("propertyNames", {}).get("enum", ("*",)))
        for below, kind, inner in _variants(described["additionalProperties"], known, ""):
            yield f"{suffix}.{{{names}}}{below}", f"table of {kind}", inner
    elif "properties" in described:
        own = described["properties"]
        consts = [own[name].get("const", "") for name in ("type", "shape") if name in own]
        word = "".join(consts)
        yield f"{suffix}<{word}>" if word else suffix, "table", described
    elif "const" in described or "enum" in described:
        words = described.get("enum") or [described["const"]]
        yield suffix, " | ".join(json.dumps(word) for word in words), {}
    elif "type" in described:
        yield suffix, f"{described['type']} {described.get('unit', '')}".rstrip(), {}


# --- pages and tables ---------------------------------------------------------------------------

# What a heading says of one run only: a duration; the route that round-off puts last.
OF_THE_RUN = ((r"[\d.]+ s$", "<seconds>"), (r"(?<=^Which FRFs: ).*", "<route>"))


class _Headings(HTMLParser):
    """h1 to h3 with their id, or the id of the section or article they stand first in."""

    def __init__(self) -> None:
        super().__init__()
        self.lines: Lines = []
        self._around: list[str] = []  # ids of open sections and articles, "" where used
        self._level, self._id, self._text = 0, "", ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        own = dict(attrs).get("id") or ""
        if tag in ("section", "article"):
            self._around.append(own)
        elif re.fullmatch("h[1-3]", tag):
            around, self._around[-1:] = self._around[-1:], [""] if self._around else []
            self._level, self._id, self._text = int(tag[1]), own or "".join(around), ""

    def handle_data(self, data: str) -> None:
        self._text += data

    def handle_endtag(self, tag: str) -> None:
        if tag in ("section", "article"):
            self._around.pop()
        elif self._level and tag == f"h{self._level}":
            text = " ".join(self._text.split())
            for pattern, word in OF_THE_RUN:
                text = re.sub(pattern, word, text)
            anchor = f" (#{self._id})" if self._id else ""
            self.lines.append(f"{'  ' * (self._level - 1)}h{self._level} {text}{anchor}")
            self._level = 0


def heading_lines(html: str) -> Lines:
    """Headings h1 to h3 of a page, in order, with their anchors."""
    parser = _Headings()
    parser.feed(html)
    return parser.lines


def npz_lines(path: Path) -> Lines:
    """``member: kind, number of axes`` of an npz file."""
    kinds = {"f": "float", "c": "complex", "i": "int", "b": "bool", "U": "text"}
    with np.load(path, allow_pickle=False) as file:
        return sorted(
            f"{name}: {kinds[file[name].dtype.kind]}, {file[name].ndim}-d" for name in file
        )


def csv_lines(path: Path) -> Lines:
    """Comments' names and columns of a CSV file."""
    with path.open(encoding="utf-8", newline="") as file:
        lines: Lines = []
        for line in file:
            if not line.startswith("#"):
                return [*lines, *next(csv.reader([line]))]
            name, _, value = line.partition(": ")
            inner = json_lines(value) if value.startswith("{") else [""]
            lines += [f"{name} {key}".rstrip() for key in inner]
    raise AssertionError(f"{path}: no header")


READERS: Mapping[str, Callable[[Path], Lines]] = {
    ".json": lambda path: json_lines(path.read_text(encoding="utf-8")),
    ".html": lambda path: heading_lines(path.read_text(encoding="utf-8")),
    ".npz": npz_lines,
    ".csv": csv_lines,
}

# --- the command line ---------------------------------------------------------------------------


def command_names() -> Lines:
    """In the order of the help."""
    return list(_group().commands)


def option_lines(name: str = "") -> Lines:
    """``--name/--no-name METAVAR: type = default`` of each argument and option of a command.

    Without a name, of `crosscheck` itself.
    """
    command = _group()
    context = command.make_context("crosscheck", [], resilient_parsing=True)
    if name:
        command = command.commands[name]
        context = command.make_context(name, [], parent=context, resilient_parsing=True)
    types = typing.get_type_hints(inspect.unwrap(command.callback)) if command.callback else {}
    return [_option(parameter, types) for parameter in command.get_params(context)]


def option_names(name: str) -> Lines:
    """All that its help must name."""
    return [word for line in option_lines(name) for word in re.split("[ :]", line)[0].split("/")]


def _group() -> Any:
    return typer.main.get_command(app)


def _option(parameter: Any, types: Mapping[str, Any]) -> str:
    argument = parameter.param_type_name == "argument"
    names = [] if argument else ["/".join((*sorted(parameter.opts), *parameter.secondary_opts))]
    metavar = [parameter.metavar] if parameter.metavar else []
    kind = "flag" if getattr(parameter, "is_flag", False) else _word(types[parameter.name])
    silent = parameter.default is None or parameter.default is False
    default = "" if silent else f" = {parameter.default}"
    needed = ", required" if parameter.required else ""
    return f"{' '.join(names + metavar)}: {kind}{default}{needed}"


def _word(hint: Any) -> str:
    """``float`` of ``float | None``."""
    words = [one for one in typing.get_args(hint) if one is not type(None)]
    if hint is not list and typing.get_origin(hint) is list:
        return f"list of {_word(words[0])}"
    return _word(words[0]) if words else str(hint.__name__)
