"""Which parts couplings join, in what order they are reached, and which side each is seen from."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from ..stages.part import Member
from .couplings import Coupling

Step = tuple[Coupling | None, str, str]


def walk(parts: Iterable[str], couplings: Iterable[Coupling]) -> Iterator[Step]:
    """(coupling, body here, body there) along the train, branch by branch, every coupling once.

    Each group begins with (None, "", name of the first of its ``parts``). Time and memory are
    linear in parts and couplings.
    """
    joined: dict[str, list[Step]] = {name: [] for name in parts}
    for coupling in couplings:
        for here, there in (coupling.bodies, coupling.bodies[::-1]):
            joined[here.partition(".")[0]].append((coupling, here, there))
    reached, passed = set[str](), set[str]()
    for first in joined:
        waiting: list[Step] = [] if first in reached else [(None, "", first)]
        while waiting:
            over, here, there = waiting.pop()
            if over is not None and over.name in passed:
                continue
            passed.add(over.name if over else "")
            yield over, here, there
            name = there.partition(".")[0]
            if name not in reached:
                reached.add(name)
                waiting += reversed(joined[name])


def groups(parts: Iterable[str], couplings: Iterable[Coupling]) -> tuple[frozenset[str], ...]:
    """Parts that are joined, as sets of names."""
    found: list[set[str]] = []
    for over, _, there in walk(parts, couplings):
        if over is None:
            found.append(set())
        found[-1].add(there.partition(".")[0])
    return tuple(map(frozenset, found))


def facings(steps: Iterable[Step], members: Mapping[str, Member]) -> dict[str, float]:
    """Side each part is seen from (±1), so that coupled bodies turn the same way.

    Parts are taken in order; a coupling that closes a loop and cannot be satisfied (three external
    gears in a ring) turns its second body against w: `placement.turnings` says so.
    """
    found: dict[str, float] = {}
    for _, here, there in steps:
        side = 1.0
        if here:
            side = found[here.partition(".")[0]] * members[here].sense * members[there].sense
        found.setdefault(there.partition(".")[0], side)
    return found
