"""Quality of measured FRFs: what a passive, reciprocal structure has, and each way to lack it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fbs import Frf, SecondOrderSystem, direct_frf, frequency_axis
from fbs.measured.quality import (
    Defect,
    passivity_defect,
    quality,
    reciprocity_defect,
    rigid_accelerance,
    zeros,
)

AXIS = frequency_axis(1, 400, 1)
LABELS = ("a", "b", "c")


def chain(ground: float = 1e4) -> SecondOrderSystem:
    mass = np.diag([1.0, 2.0, 1.5])
    stiffness = np.array([[1e6, -1e6, 0], [-1e6, 3e6, -2e6], [0, -2e6, 2e6]])
    stiffness[0, 0] += ground
    return SecondOrderSystem(mass, 1e-5 * stiffness + 0.5 * mass, stiffness, LABELS)


def changed(frf: Frf, response: str, excitation: str, factor: complex, lines: slice) -> Frf:
    values = frf.values.copy()
    values[lines, LABELS.index(response), LABELS.index(excitation)] *= factor
    return replace(frf, values=values)


def defects(frf: Frf, coherence: np.ndarray | None = None) -> tuple[Defect, ...]:
    return quality(frf, coherence).defects


GOOD = direct_frf(chain(), AXIS)


@pytest.mark.parametrize("quantity", ["receptance", "mobility", "accelerance"])
def test_a_sound_structure_has_no_defects(quantity: str) -> None:
    assert defects(GOOD.to(quantity)) == ()
    assert passivity_defect(GOOD.to(quantity), LABELS).max() < 1e-12
    assert reciprocity_defect(GOOD, LABELS).max() < 1e-12


def test_a_pair_that_is_not_reciprocal() -> None:
    bad = changed(GOOD, "a", "c", 1.3, slice(100, 150))
    found = {d.what: d for d in defects(bad)}
    assert found["reciprocity"].labels == ("a", "c")
    assert set(np.flatnonzero(found["reciprocity"].lines)) <= set(range(100, 150))
    assert 101 <= found["reciprocity"].at <= 150


def test_a_drive_point_of_other_sign() -> None:
    found = [d.what for d in defects(changed(GOOD, "b", "b", -1.0, slice(0, 400)))]
    assert "phase" in found


def test_a_matrix_whose_drive_points_are_passive_and_which_is_not() -> None:
    """Transfer FRFs twice as large: reciprocal, every Re Y_ii as it was, and power comes out."""
    values = GOOD.values * np.where(np.eye(3), 1.0, 2.0)
    found = {d.what: d for d in defects(replace(GOOD, values=values))}
    assert set(found) == {"passivity"}
    assert found["passivity"].labels == LABELS
    assert 0.05 < found["passivity"].worst <= 1.0


def test_units_of_a_dof_do_not_count() -> None:
    scale = np.array([1.0, 1e-3, 1e4])
    scaled = replace(GOOD, values=GOOD.values * scale[:, None] * scale)
    np.testing.assert_allclose(
        passivity_defect(changed(scaled, "b", "b", -1.0, slice(0, 400)), LABELS),
        passivity_defect(changed(GOOD, "b", "b", -1.0, slice(0, 400)), LABELS),
        atol=1e-9,
    )


def test_a_dead_channel_is_named_and_has_no_other_defect() -> None:
    dead = changed(GOOD, "b", "b", 0.0, slice(None))
    for other in ("a", "c"):
        dead = changed(changed(dead, "b", other, 0.0, slice(None)), other, "b", 0.0, slice(None))
    pairs = {("b", "b"), ("a", "b"), ("b", "a"), ("c", "b"), ("b", "c")}
    assert zeros(GOOD) == ()
    assert set(zeros(dead)) == pairs
    with np.errstate(divide="raise", invalid="raise"):
        assert quality(dead).defects == ()


def test_coherence() -> None:
    coherence = np.full(GOOD.values.shape, 0.99)
    coherence[10:20, 1, 2] = 0.5
    coherence[:, 0, 0] = np.nan
    (found,) = defects(GOOD, coherence)
    assert (found.what, found.labels, found.worst, found.at) == ("coherence", ("b", "c"), 0.5, 11.0)
    assert found.lines.sum() == 10


def test_the_rigid_body_line_against_mass() -> None:
    """A free chain of 4.5 kg has 1/4.5 per kg at every drive point far below its first mode.

    DoF d is twice c's motion, and so has four times its accelerance.
    """
    mass = np.diag([1.0, 2.0, 1.5])
    stiffness = np.array([[1e6, -1e6, 0], [-1e6, 3e6, -2e6], [0, -2e6, 2e6]])
    free = SecondOrderSystem(mass, 1e-5 * stiffness, stiffness, LABELS, {"d": ("c", 2.0)})
    rigid = rigid_accelerance(free, AXIS)
    assert set(rigid) == {*LABELS, "d"}
    for label, expected in rigid.items():
        known = np.isfinite(expected)
        assert known[:10].all()
        assert not known[AXIS > 110].any()  # the first elastic mode, 110 Hz
        np.testing.assert_allclose(expected[known], 4 / 4.5 if label == "d" else 1 / 4.5)
    measured = direct_frf(free, AXIS)
    assert quality(measured, rigid=rigid).defects == ()
    ratios = quality(measured, rigid=rigid).rigid
    assert np.nanmax(np.abs(ratios["a"] - 1)) < 0.025  # half of the noise
    heavy = {label: expected / 2 for label, expected in rigid.items()}
    found = quality(measured, rigid=heavy).defects
    assert [(d.what, d.labels) for d in found] == [("mass", (label,)) for label in heavy]
    np.testing.assert_allclose([d.worst for d in found], 2.0, rtol=0.025)


def test_what_is_held_has_no_rigid_body_line() -> None:
    assert rigid_accelerance(chain(), AXIS) == {}


def test_lines_of_doubt() -> None:
    found = quality(changed(GOOD, "a", "c", 1.3, slice(100, 150)))
    assert found.reciprocity is not None
    assert set(np.flatnonzero(found.doubtful)) <= set(range(100, 150))
    assert found.doubtful.any()
    assert found.reciprocity.shape == found.frequency.shape == AXIS.shape
    assert found.coherence is None
    single = quality(GOOD.select(["a"], ["a"]))
    assert (single.square, single.reciprocity, single.passivity) == (("a",), None, None)
