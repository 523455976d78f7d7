"""Which parts couplings join, in what order they are reached, and which side each is seen from."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .parameters import Coupling, Drivetrain

# Sign of the counter-clockwise rotation (in the part's own frame) that counts as positive w: a
# parallel stage's pinion and wheel turn against each other.
SENSE = {"wheel": -1.0}

Joined = Mapping[str, Sequence[tuple[str, str]]]


def sense(body: str) -> float:
    """Sign of positive w of a body against counter-clockwise rotation in its part's frame."""
    return SENSE.get(body.partition(".")[2], 1.0)


def joined(names: Iterable[str], couplings: Iterable[Coupling]) -> Joined:
    """Part → (own body, other body) of each of its couplings, in their order."""
    found: dict[str, list[tuple[str, str]]] = {name: [] for name in names}
    for coupling in couplings:
        first, second = coupling.first, coupling.second
        found[first.partition(".")[0]].append((first, second))
        found[second.partition(".")[0]].append((second, first))
    return found


def groups(joints: Joined) -> list[list[str]]:
    """Parts that are joined, each group in the order of `walk`."""
    found: list[list[str]] = []
    for here, there in walk(joints):
        if not here:
            found.append([])
        found[-1].append(there.partition(".")[0])
    return found


def walk(joints: Joined) -> Iterator[tuple[str, str]]:
    """Every part once, depth first: (body it is reached from, "" for none; its own body or name).

    Time and memory are linear in parts and couplings.
    """
    reached: set[str] = set()
    for name in joints:
        if name in reached:
            continue
        reached.add(name)
        yield "", name
        waiting = [iter(joints[name])]
        while waiting:
            here, there = next(waiting[-1], ("", ""))
            part = there.partition(".")[0]
            if not there:
                waiting.pop()
            elif part not in reached:
                reached.add(part)
                yield here, there
                waiting.append(iter(joints[part]))


def facings(drivetrain: Drivetrain) -> dict[str, float]:
    """Side each part is seen from (±1), so that coupled bodies turn the same way.

    Parts are taken in order; a coupling that closes a loop and cannot be satisfied (three external
    gears in a ring) turns its second body against w: `placement.turning` says so.
    """
    found: dict[str, float] = {}
    for here, there in walk(drivetrain.joined):
        before = found[here.partition(".")[0]] * sense(here) * sense(there) if here else 1.0
        found[there.partition(".")[0]] = before
    return found
