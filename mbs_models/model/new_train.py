"""The text of a new model file: a train of parts, with every key that its tables have."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from itertools import pairwise
from string import Template

from ..errors import ModelError
from .messages import suggest

RADIUS = 0.1  # m, of a plain inertia's rotation
COLUMN = 40  # where comments begin
MOST = 50  # parts of a new train: nobody edits more by hand


@dataclass(frozen=True)
class Kind:
    """A part of a new train.

    Attributes
    ----------
    template
        Which table it is.
    fast, slow
        Its bodies towards the fast and the slow end of the train; "" is the part itself.
    inertia
        Of a plain rotor (kg m²), whose radius is `RADIUS`.
    """

    template: str
    fast: str = ""
    slow: str = ""
    inertia: float = 0.0


KINDS: Mapping[str, Kind] = {
    "motor": Kind("inertia", inertia=0.02),
    "generator": Kind("inertia", inertia=0.02),
    "flywheel": Kind("inertia", inertia=0.5),
    "load": Kind("inertia", inertia=5.0),
    "rotor": Kind("inertia", inertia=5.0),
    "parallel": Kind("parallel", "pinion", "wheel"),
    "planetary": Kind("planetary", "sun", "carrier"),
}


@dataclass(frozen=True)
class _Link:
    name: str
    kind: Kind

    def body(self, end: str) -> str:
        """The body at its fast or slow end, as couplings name it."""
        return f"{self.name}.{end}" if end else self.name


def new_train(kinds: Sequence[str], file: str) -> str:
    """A model file of parts joined by shafts, that can be computed as it stands.

    Parameters
    ----------
    kinds
        Of the parts, from the fast end of the train to the slow one: `KINDS`.
    file
        What it will be called, for its head.

    Raises
    ------
    ModelError
        A kind that there is not, a rotor alone, or more parts than `MOST`.
    """
    if not 1 <= len(kinds) <= MOST:
        raise ModelError(f"--for: {len(kinds)} parts; 1 to {MOST} are possible")
    for kind in kinds:
        if kind not in KINDS:
            raise ModelError(f"--for: '{kind}': no part of that kind; {suggest(kind, [*KINDS])}")
    if len(kinds) == 1 and not KINDS[kinds[0]].fast:
        raise ModelError(
            f"--for: '{kinds[0]}' alone has no spring; give it a shaft to another part"
        )
    return "".join(_tables(_named(kinds), ", ".join(kinds).capitalize(), file))


def _tables(links: Sequence[_Link], title: str, file: str) -> Iterator[str]:
    fast, slow = links[0], links[-1]
    driven, driving = fast.body(fast.kind.fast), slow.body(slow.kind.slow)
    key = f'output = "{driving}"'
    output = f"{key:<{COLUMN}}# takes the reaction" if driving != driven else ""
    yield _filled("head", title=title, file=file, input=driven, output=output)
    for link in links:
        kind = link.kind
        yield _filled(
            kind.template,
            name=link.name,
            inertia=f"{f'polar_inertia = {kind.inertia}':<{COLUMN}}",
            reduced=f"{f'# polar_inertia_over_r2 = {kind.inertia / RADIUS**2:.1f}':<{COLUMN}}",
        )
    for number, (first, second) in enumerate(pairwise(links), start=1):
        yield _filled(
            "coupling",
            name=f"shaft{number}",
            first=first.body(first.kind.slow),
            second=second.body(second.kind.fast),
        )
    yield _filled("excitation", dof=f"{driven}.w")


def _named(kinds: Sequence[str]) -> list[_Link]:
    """Each by its kind; numbered where there are several of a kind."""
    count, seen, links = Counter(kinds), Counter[str](), []
    for kind in kinds:
        seen[kind] += 1
        links.append(_Link(kind if count[kind] == 1 else f"{kind}{seen[kind]}", KINDS[kind]))
    return links


def _filled(template: str, **words: str) -> str:
    path = files(__package__) / "templates" / f"{template}.toml"
    return Template(path.read_text(encoding="utf-8")).substitute(words)
