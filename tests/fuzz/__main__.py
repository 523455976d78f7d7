"""`python -m tests.fuzz N [KIND]`: try N inputs, and print what became of them as a table.

`python -m tests.fuzz "KIND NUMBER"` tries one of them again.
"""

from __future__ import annotations

import sys

from .kinds import KINDS
from .processes import PROCESSES
from .trial import Tally, Trial, attempt, table


def run(count: int, only: str = "") -> dict[str, Tally]:
    """Try so many inputs, shared among the kinds."""
    chosen: dict[str, tuple[Trial, int]] = {
        kind: each for kind, each in {**KINDS, **PROCESSES}.items() if only in kind
    }
    shares = sum(share for _, share in chosen.values())
    tallies = {kind: Tally() for kind in chosen}
    for kind, (trial, share) in chosen.items():
        for number in range(max(1, round(count * share / shares))):
            attempt(kind, number, trial, tallies[kind])
    return tallies


def main(arguments: list[str]) -> int:
    """Print the table, and the faults; returns 1 if there are any."""
    kind, _, number = arguments[0].rpartition(" ")
    if kind:
        tallies = {kind: Tally()}
        attempt(kind, int(number), {**KINDS, **PROCESSES}[kind][0], tallies[kind])
    else:
        tallies = run(int(number), *arguments[1:])
    for tally in tallies.values():
        for fault in tally.faults:
            print(fault, end="\n\n")
    print(table(tallies))
    return int(any(tally.faults for tally in tallies.values()))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
