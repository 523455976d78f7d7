"""How many planted defects `explain` finds: ``python -m tests.benchmarks.explain_defects``.

40 drivetrains with one parameter wrong and 10 with two, by 3 to 10 %, each seen by 12 FRFs of 1296
(8 of 36 DoFs) without noise and with 1 %. Prints the counts and what was missed; about 6 minutes.
"""

from __future__ import annotations

import sys

from tests.validation.explanation.defects import missed_defects

CASES = ((1, 40, 0.0, 38), (2, 10, 0.0, 8), (1, 40, 0.01, 34), (2, 10, 0.01, 6))


def main() -> int:
    """Exit code 1 where fewer are found than must be."""
    short = 0
    for causes, count, noise, least in CASES:
        wrong = missed_defects(causes, count, noise)
        found = count - len(wrong)
        short += found < least
        print(
            f"{causes} wrong, {100.0 * noise:g} % noise: {found} of {count} found (least: {least})",
            flush=True,
        )
        for true, words in wrong:
            print(f"  {', '.join(sorted(true))}: {' | '.join(words) or 'no difference'}")
    return int(short > 0)


if __name__ == "__main__":
    sys.exit(main())
