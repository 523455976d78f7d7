"""Model files, and names in them, changed."""

from __future__ import annotations

import random
import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

from mbs_models.model.model_file import preset_names, template

from .mutations import changed_text, in_toml, odd_number, odd_text
from .trial import DOFS, SMALL, Fault, command, ended


def model_files(rng: random.Random, folder: Path) -> str:
    """A preset's text, changed: what is made of it by one command."""
    text = changed_text(rng, template(rng.choice(preset_names())))
    return _used(rng, folder, text)


def model_numbers(rng: random.Random, folder: Path) -> str:
    """A preset with one to three of its numbers extreme."""
    text = template(rng.choice(preset_names()))
    for _ in range(rng.choice((1, 1, 2, 3))):
        found = list(re.finditer(r"(?m)(?<= = )-?[\d.]+(?:e[+-]?\d+)?(?=\s)", text))
        at = rng.choice(found)
        text = text[: at.start()] + odd_number(rng).replace("+", "") + text[at.end() :]
    return _used(rng, folder, text)


def _used(rng: random.Random, folder: Path, text: str) -> str:
    file = folder / "model.toml"
    file.write_text(text, encoding="utf-8", errors="surrogatepass")
    route = rng.choice(("exudyn", "equations"))
    line = rng.choice(
        (
            ("check", str(file)),
            ("check", str(file)),
            ("modes", str(file), "--route", route),
            (
                "frf",
                str(file),
                "--df",
                "500",
                "--response",
                "all",
                "--excitation",
                "all",
                "--route",
                rng.choice(("exudyn", "equations", "fbs")),
            ),
            ("modes", str(file), "--torque", odd_number(rng)),
        )
    )
    return ended(command(*line, within=(0, 2)))


def names(rng: random.Random, folder: Path) -> str:
    """What a drivetrain is called, in pictures, pages, tables and on the terminal."""
    text = template(SMALL)
    text = re.sub(r"(?m)^name = .*$", lambda _: f"name = {in_toml(odd_text(rng))}", text, count=1)
    text = re.sub(
        r"(?m)^source = .*$", lambda _: f"source = {in_toml(odd_text(rng))}", text, count=1
    )
    if rng.random() < 0.3:
        text = text.replace('"planetary"', in_toml(odd_text(rng)))
    file = folder / "model.toml"
    file.write_bytes(text.encode("utf-8", "surrogatepass"))
    picture = f"picture{rng.choice(('.svg', '.svg', '.png', '.pdf'))}"
    lines = [
        ["check", str(file)],
        ["modes", str(file), "--route", "equations"],
        [
            "frf",
            str(file),
            "--response",
            DOFS[0],
            "--excitation",
            DOFS[0],
            "--df",
            "500",
            "--output",
            picture,
        ],
        [
            "sweep",
            str(file),
            "--vary",
            "planetary.sun.mass=1,2,3",
            "--response",
            DOFS[0],
            "--excitation",
            DOFS[0],
            "--df",
            "500",
            "--out",
            "out",
            "--workers",
            "1",
        ],
    ]
    called = command(*rng.choice(lines), within=(0, 2))
    for path in folder.rglob("*.svg"):
        _svg_is_text(path.read_text(encoding="utf-8"))
    for path in folder.rglob("*.html"):
        page = path.read_text(encoding="utf-8")
        if "<script>alert" in page:
            raise Fault("markup of a name stands in a page")
        for svg in re.findall(r"<svg.*?</svg>", page, flags=re.DOTALL):
            _svg_is_text(svg)
    return ended(called)


def _svg_is_text(svg: str) -> None:
    try:
        ElementTree.fromstring(svg)
    except ElementTree.ParseError as error:
        raise Fault(f"an SVG that no viewer reads: {error}") from error
    if "<script" in svg:
        raise Fault("markup of a name stands in an SVG")
