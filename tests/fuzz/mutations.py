"""Changes to real files, and values that nobody means."""

from __future__ import annotations

import random
import re

NUMBERS = (
    "0",
    "-0.0",
    "1",
    "-1",
    "0.5",
    "3",
    "1e-3",
    "1e-9",
    "1e-30",
    "1e-300",
    "5e-324",
    "1e9",
    "1e15",
    "1e30",
    "1e154",
    "1e300",
    "1.7976931348623157e308",
    "1e400",
    "nan",
    "inf",
    "-inf",
    "0.1000000000000000055511151231257827021181583404541015625",
    "1" * 40,
    "9" * 5000,
    "2147483648",
    "1e-15",
    "1e12",
    "-1e12",
    "89.9999999",
    "360.0",
    "1000000",
)
TEXTS = (
    "",
    " ",
    "[/b]",
    "[bold red]x[/]",
    "$\\frac",
    "$x$",
    "_^{",
    "<script>alert(1)</script>",
    "&lt;",
    "\x1b]0;owned\x07",
    "\x1b[2J",
    "a\u202eb",
    "\u2028",
    "\x00",
    "\x7f",
    "\x9b31m",
    "ä ß – 漢字 🦷",
    "a" * 300,
    "a" * 100_000,
    "../../etc/passwd",
    "{{ 7 * 7 }}",
    "%s%n",
    "{0}",
    "NaN",
    "\ufeffx",
    "'",
    '"',
    "\ud800",
    "-",
    "--help",
    "\\",
    "rigid",
    "paper",
    "a\nb",
    "a\tb",
    "\r",
)
NUMBER = re.compile(r"(?<![\w.])-?\d+\.?\d*(?:[eE][+-]?\d+)?")
STRING = re.compile(r'"[^"\n]*"')


def odd_number(rng: random.Random) -> str:
    """A number that is extreme, or near one that is not."""
    if rng.random() < 0.3:
        return f"{rng.choice('-+') * (rng.random() < 0.3)}{10.0 ** rng.uniform(-20.0, 20.0):.3g}"
    return rng.choice(NUMBERS)


def odd_text(rng: random.Random) -> str:
    """Text that means something to somebody else."""
    return rng.choice(TEXTS)


def in_toml(text: str) -> str:
    """A text as TOML's basic string has it."""
    escaped = (c if c.isprintable() and c not in '"\\' else f"\\U{ord(c):08x}" for c in text)
    return f'"{"".join(escaped)}"'


def changed_text(rng: random.Random, text: str) -> str:
    """A text file with one to three changes."""
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        text = rng.choice(CHANGES)(rng, text)
    return text


def changed_bytes(rng: random.Random, content: bytes) -> bytes:
    """A file with some bytes flipped, lost, repeated or foreign."""
    for _ in range(rng.choice((1, 1, 2, 5))):
        at, size = rng.randrange(len(content) + 1), rng.choice((1, 1, 4, 50, 1000))
        match rng.randrange(5):
            case 0 if content:
                at = min(at, len(content) - 1)
                flipped = content[at] ^ (1 << rng.randrange(8))
                content = content[:at] + bytes([flipped]) + content[at + 1 :]
            case 1:
                content = content[:at] + content[at + size :]
            case 2:
                content = content[:at] + content[at : at + size] + content[at:]
            case 3:
                content = content[:at]
            case _:
                content = content[:at] + rng.randbytes(size) + content[at:]
    return content


def _number(rng: random.Random, text: str) -> str:
    found = list(NUMBER.finditer(text))
    if not found:
        return text
    at = rng.choice(found)
    return text[: at.start()] + odd_number(rng) + text[at.end() :]


def _string(rng: random.Random, text: str) -> str:
    found = list(STRING.finditer(text))
    if not found:
        return text
    at = rng.choice(found)
    other = rng.choice(found)[0] if rng.random() < 0.4 else in_toml(odd_text(rng))
    return text[: at.start()] + other + text[at.end() :]


def _line(rng: random.Random, text: str) -> str:
    lines = text.splitlines(keepends=True)
    if not lines:
        return text
    first, second = rng.randrange(len(lines)), rng.randrange(len(lines))
    match rng.randrange(4):
        case 0:
            del lines[first]
        case 1:
            lines.insert(second, lines[first])
        case 2:
            lines[first], lines[second] = lines[second], lines[first]
        case _:
            lines = lines[:first]
    return "".join(lines)


def _key(rng: random.Random, text: str) -> str:
    found = list(re.finditer(r"(?m)^\w+(?= *=)", text))
    if not found:
        return text
    at = rng.choice(found)
    other = rng.choice((rng.choice(found)[0], at[0][:-1] or "x", f"{at[0]}.a", f'"{at[0]} "', "Ω"))
    return text[: at.start()] + other + text[at.end() :]


def _value(rng: random.Random, text: str) -> str:
    found = list(re.finditer(r"(?<= = )[^\n#]+", text))
    if not found:
        return text
    at = rng.choice(found)
    depth = rng.choice((3, 50, 5000))
    other = rng.choice(
        (
            "[" * depth + "]" * depth,
            "{}",
            "true",
            "1979-05-27",
            "[]",
            "[1.0, [2.0]]",
            f"[{', '.join(['1.0'] * rng.choice((2, 3, 100_000)))}]",
            '"1.0"',
            "1",
            "0x7fffffffffffffff",
            "{ a = { b = 1 } }",
            "[[1e8, 3e7], [3e7, 6e7]]",
            "[[1e300, 1e300], [1e300, 1e300]]",
        )
    )
    return text[: at.start()] + other + text[at.end() :]


def _characters(rng: random.Random, text: str) -> str:
    at = rng.randrange(len(text) + 1)
    return text[:at] + odd_text(rng) + text[at + rng.choice((0, 0, 1, 10)) :]


CHANGES = (_number, _number, _number, _string, _line, _key, _value, _characters)
