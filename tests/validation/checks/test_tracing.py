"""What a difference of FRFs is said to be."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from fbs import real_modes
from tests.validation.checks.test_traced_entries import DOFS, LINES, MATRICES, NO_ROUND_OFF, frfs
from validation.checks.tracing import NO_CHANGE, explained, single_lines, traced


def test_a_changed_entry_says_how_much_it_explains() -> None:
    words = traced(LINES, frfs(), frfs("stiffness", (1, 1), 50.0), NO_ROUND_OFF, DOFS)
    assert words[0].startswith("stiffness at b: 25000 against 25050 N/m")
    assert words[-1] == "this explains all but round-off of the difference"


@pytest.mark.parametrize(
    ("slip", "words"),
    [
        (np.conj, "conjugates"),
        (np.negative, "all signs are reversed"),
        (lambda h: np.roll(h, 1, axis=1), "shifted by one"),
        (lambda h: h[:, [1, 0, 2]][:, :, [1, 0, 2]], "a and b are exchanged"),
        (lambda h: h * np.outer([1, 1, -1], [1, 1, -1]), "c counts the other way"),
    ],
)
def test_slips_are_no_change_of_the_matrices(slip: Callable[[Any], Any], words: str) -> None:
    (found,) = traced(LINES, frfs(), slip(frfs()), NO_ROUND_OFF, DOFS)
    assert found.startswith(NO_CHANGE)
    assert words in found


def test_a_modes_residue_is_one_pattern() -> None:
    from fbs import SecondOrderSystem

    system = SecondOrderSystem(MATRICES["mass"], MATRICES["damping"], MATRICES["stiffness"], DOFS)
    modes = real_modes(system)
    shape, square = modes.shapes[:, 1], modes.angular_frequency[1] ** 2
    wrong = 0.1 * np.outer(shape, shape) / (square - (2.0 * np.pi * LINES[:, None, None]) ** 2)
    found = traced(LINES, frfs(), frfs() + wrong, NO_ROUND_OFF, DOFS)
    assert "one pattern at all lines, as a mode's residue is" in found[0]


def test_a_line_alone_is_told_from_a_pole() -> None:
    lines = np.arange(5.0)
    assert single_lines(lines, np.array([1e-12, 1e-12, 1e-3, 1e-12, 1e-12])).tolist() == [2.0]
    assert single_lines(lines, np.array([1e-6, 1e-5, 1e-3, 1e-5, 1e-6])).size == 0


def test_what_is_stated_counts_by_what_it_leaves() -> None:
    reference, other = frfs(), frfs("mass", (0, 0), 0.1)
    assert explained(reference, other, other) == 1.0
    assert explained(reference, other, reference) == 0.0
    half = reference + 0.5 * (other - reference)
    assert explained(reference, other, half) == pytest.approx(0.75)
