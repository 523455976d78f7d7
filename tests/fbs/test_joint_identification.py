"""A joint comes back from the FRFs it made, with an interval that noise keeps to."""

from __future__ import annotations

import numpy as np
import pytest

from fbs import FbsError, Frf, Joint, SecondOrderSystem, SingularLineError, couple, direct_frf
from fbs.joint_identification import (
    JointStiffness,
    Spring,
    fit_spring,
    joint_between,
    joint_in_situ,
)

LINES = np.linspace(2.0, 60.0, 117)
K, C = 3e4, 20.0
AT = [("a2", "b1")]


def part(prefix: str, springs: tuple[float, float], ground: float) -> Frf:
    k_1, k_2 = ground, springs[0]
    stiffness = np.array([[k_1 + k_2, -k_2], [-k_2, k_2]])
    system = SecondOrderSystem(
        np.diag([1.0, 2.0]), 2e-4 * stiffness, stiffness, (f"{prefix}1", f"{prefix}2")
    )
    return direct_frf(system, LINES)


A, B = part("a", (2e4, 0.0), 1e4), part("b", (4e4, 0.0), 0.0)
AB = couple({"A": A, "B": B}, [Joint(("A", "a2"), ("B", "b1"), K, C)]).frf


def noisy(frf: Frf, relative: float, rng: np.random.Generator) -> Frf:
    shape = frf.values.shape
    error = (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2.0)
    return Frf(frf.frequency, frf.values * (1.0 + relative * error), frf.responses, frf.excitations)


def exact(joint: JointStiffness) -> None:
    expected = K + 2j * np.pi * LINES * C
    np.testing.assert_allclose(joint.values[:, 0, 0], expected, rtol=1e-9)
    fitted = fit_spring(joint)
    assert fitted.stiffness == pytest.approx(K, rel=1e-9)
    assert fitted.damping == pytest.approx(C, rel=1e-7)


def test_without_noise_it_is_exact() -> None:
    exact(joint_in_situ(AB, AT))
    exact(joint_between(AB, A, B, AT))
    exact(joint_between(AB.to("accelerance"), A.to("mobility"), B, AT))


@pytest.mark.parametrize("form", ["in situ", "between"])
def test_with_one_percent_noise_within_one_percent_and_its_interval(form: str) -> None:
    """400 repetitions: the 95 % interval holds in 95 ± 3 % (its own scatter 1.1 %)."""
    rng = np.random.default_rng(3)
    held, values = 0, []
    for _ in range(400):
        ab, a, b = (noisy(frf, 0.01, rng) for frf in (AB, A, B))
        joint = (
            joint_in_situ(ab, AT, 0.01) if form == "in situ" else joint_between(ab, a, b, AT, 0.01)
        )
        fitted = fit_spring(joint)
        held += abs(fitted.stiffness - K) <= fitted.stiffness_interval
        values.append(fitted.stiffness)
    assert held / 400 == pytest.approx(0.95, abs=0.03)
    assert np.std(values) < 0.01 * K


def test_what_the_data_do_not_tell_is_said() -> None:
    """A spring a million times stiffer than the parts hardly shows in their FRFs."""
    stiff = couple({"A": A, "B": B}, [Joint(("A", "a2"), ("B", "b1"), 1e10)]).frf
    rng = np.random.default_rng(4)
    ab, a, b = (noisy(frf, 0.01, rng) for frf in (stiff, A, B))
    fitted = fit_spring(joint_between(ab, a, b, AT, 0.01))
    assert not fitted.tells_stiffness
    assert fitted.describe().startswith("the data do not tell the stiffness")


def test_more_than_a_spring_shows_in_the_residual() -> None:
    """A mass in between is no spring: the misfit is far beyond the noise."""
    heavy = SecondOrderSystem(np.diag([0.5]), np.zeros((1, 1)), np.array([[1e-9]]), ("m",))
    joints = [Joint(("A", "a2"), ("M", "m"), 2 * K), Joint(("M", "m"), ("B", "b1"), 2 * K)]
    ab = couple({"A": A, "M": direct_frf(heavy, LINES), "B": B}, joints).frf
    assert fit_spring(joint_between(ab, A, B, AT, 1e-3)).residual > 5.0
    assert fit_spring(joint_between(AB, A, B, AT, 1e-3)).residual < 1e-3


def test_what_cannot_be_identified() -> None:
    with pytest.raises(FbsError, match="at least one pair"):
        joint_in_situ(AB, [])
    with pytest.raises(FbsError, match="relative = 2"):
        joint_in_situ(AB, AT, 2.0)
    with pytest.raises(FbsError, match="pair = 1: there are 1"):
        fit_spring(joint_in_situ(AB, AT), 1)
    rigid = couple({"A": A, "B": B.renamed({"b1": "a2"})}, [Joint(("A", "a2"), ("B", "a2"))]).frf
    alike = Frf(
        LINES, rigid.select(["a2"], ["a2"]).values * np.ones((1, 2, 2)), ("a2", "b1"), ("a2", "b1")
    )
    with pytest.raises(SingularLineError, match="the joint is rigid"):
        joint_in_situ(alike, AT)


def test_a_joint_that_is_no_spring_is_not_told_as_a_sharp_one() -> None:
    """Between DoFs that no joint ties, all misfits are alike: the lines are worth few, not 117."""
    rng = np.random.default_rng(5)
    ab, a, b = (noisy(frf, 0.01, rng) for frf in (AB, A, B))
    for joint in (joint_between(ab, a, b, [("a2", "b2")], 0.01), joint_in_situ(ab, [("a2", "b2")])):
        assert not fit_spring(joint).tells_stiffness


@pytest.mark.parametrize(
    ("value", "half", "words"),
    [
        (50000.0, 83.0, "stiffness 50000 ± 83 N/m"),
        (123456.7, 0.5, "stiffness 123456.7 ± 0.5 N/m"),
        (3.14159e9, 2e7, "stiffness 3.142e+09 ± 2e+07 N/m"),
    ],
)
def test_as_many_digits_as_the_interval_leaves(value: float, half: float, words: str) -> None:
    assert words in Spring(value, 1.0, half, 0.1, 1.0).describe()
