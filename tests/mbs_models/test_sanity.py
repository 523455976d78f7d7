"""Stiffnesses that look like a wrong unit, however far off they are."""

from __future__ import annotations

import pytest

from mbs_models.model_file import loads, template
from mbs_models.sanity.neighbours import suspicious_stiffnesses

PAPER = template("paper-table2")
MESH = "\nmesh_stiffness = 2.0e8"


@pytest.mark.parametrize(
    ("stiffness", "told"),
    [
        # The median of the stage's seven: two bearings of 3.5e8, four of 1e8 are its others.
        ("2.0e11", "2e+11 N/m: 2000 times its neighbours (1.0e+8 N/m)"),
        ("5.0e4", "50000 N/m: a 2000th of its neighbours (1.0e+8 N/m)"),
        ("1e300", "1e+300 N/m: 1.0e+292 times its neighbours (1.0e+8 N/m)"),
        ("1e-300", "1e-300 N/m: 1.0e-308 times its neighbours (1.0e+8 N/m)"),
    ],
)
def test_how_far_off_is_told_in_few_digits(stiffness: str, told: str) -> None:
    drivetrain = loads(PAPER.replace(MESH, f"\nmesh_stiffness = {stiffness}", 1))
    assert suspicious_stiffnesses(drivetrain) == (
        f"reducer: mesh_stiffness = {told}; is the unit right?",
    )


def test_factors_that_no_float_holds() -> None:
    text = PAPER.replace("first_stiffness = 1.0e8", "first_stiffness = 1.7e308", 1)
    text = text.replace("second_stiffness = 1.0e5", "second_stiffness = 1.0e-320", 1)
    hard, soft = suspicious_stiffnesses(loads(text))
    # Two values: each is the root of their ratio from the median, √(1.7e308/1.0e-320) = 1.3e314.
    assert "first_stiffness = 1.7e+308 N/m: 1.3e+314 times" in hard
    assert "times its neighbours" in soft


def test_a_stiffness_that_its_radius_makes_infinite_is_no_neighbour() -> None:
    text = PAPER.replace("bearing_rocking_over_r2 = 1.0e8", "bearing_rocking = 1e308", 1)
    assert suspicious_stiffnesses(loads(text)) == ()
