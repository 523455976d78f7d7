"""Joints of any kind: complex, varying with frequency, of several DoFs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fbs import (
    FbsError,
    Frf,
    Joint,
    JointError,
    MatrixJoint,
    SecondOrderSystem,
    StiffnessTable,
    bounded_frf,
    couple,
    couple_chain,
    direct_frf,
    frequency_axis,
)
from tests.fbs.fbs_systems import random_system, scaled_error

AXIS = frequency_axis(20, 2000, 20)
OMEGA = 2 * np.pi * AXIS


def systems(seed: int = 7) -> dict[str, SecondOrderSystem]:
    rng = np.random.default_rng(seed)
    return {name: random_system(rng, 4, name) for name in "abc"}


def solved(parts: dict[str, SecondOrderSystem], joints: Any, axis: Any = AXIS) -> np.ndarray:
    """Flexible joints put into Z of all parts, which is inverted line by line."""
    place: dict[tuple[str, str], int] = {}
    for name, system in parts.items():
        for dof in system.dofs:
            place[name, dof] = len(place)
    n = len(place)
    found = np.empty((len(axis), n, n), complex)
    for line, w in enumerate(2 * np.pi * np.asarray(axis)):
        z = np.zeros((n, n), complex)
        for name, s in parts.items():
            at = [place[name, dof] for dof in s.dofs]
            z[np.ix_(at, at)] = s.stiffness - w**2 * s.mass + 1j * w * s.damping
        for joint in joints:
            b = signed(joint, place)
            z += b.T @ np.atleast_2d(joint.dynamic_stiffness(np.array([w]))[0]) @ b
        found[line] = np.linalg.inv(z)
    return found


def signed(joint: Any, place: dict[tuple[str, str], int]) -> np.ndarray:
    """Rows of B of one joint."""
    single = isinstance(joint, Joint)
    sides = ([joint.first], [joint.second]) if single else (joint.first, joint.second)
    b = np.zeros((len(sides[0]), len(place)))
    for row, first, second in zip(b, *sides, strict=True):
        row[place[first]] += 1.0
        row[place[second]] -= joint.ratio
    return b


def frfs(parts: dict[str, SecondOrderSystem], axis: Any = AXIS) -> dict[str, Frf]:
    return {name: direct_frf(system, axis) for name, system in parts.items()}


def bushing(kind: str, rng: Any) -> Any:
    """A 2 × 2 stiffness of about 1e7 N/m."""
    matrix = 1e7 * rng.uniform(-1.0, 1.0, (2, 2))
    if kind == "symmetric":
        return matrix @ matrix.T / 1e7
    if kind == "hysteretic":
        return (matrix @ matrix.T / 1e7) * (1 + 0.1j)
    if kind == "singular":
        return 1e7 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    if kind == "varying":
        return lambda f: matrix * (1 + 0.2j * np.tanh(f / 500.0))[:, None, None]
    if kind == "table":
        lines = np.array([20.0, 500.0, 2000.0])
        return StiffnessTable(lines, np.array([1.0, 1.5 + 0.1j, 3.0])[:, None, None] * matrix)
    return matrix  # as a journal bearing's: not symmetric


KINDS = ["symmetric", "hysteretic", "singular", "varying", "table", "bearing"]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("ratio", [1.0, -0.7])
def test_a_joint_of_two_dofs_is_the_assembled_one(kind: str, ratio: float) -> None:
    parts = systems()
    joints: list[Joint | MatrixJoint] = [
        MatrixJoint(
            [("a", "a0"), ("a", "a3")],
            [("b", "b1"), ("b", "b2")],
            bushing(kind, np.random.default_rng(3)),
            np.array([[20.0, 5.0], [5.0, 10.0]]) if kind != "singular" else None,
            ratio,
        ),
        Joint(("b", "b0"), ("c", "c0"), 3e6 * (1 + 0.02j)),
    ]
    expected = solved(parts, joints)
    found = couple(frfs(parts), joints)
    # inverse of a matrix of scaled condition 1e4 on both sides
    assert scaled_error(found.frf, expected).max() < 1e-11
    error = np.abs(found.frf.values - expected)
    # the reference rounds alike: as much again, of its own bound of n eps times condition
    assert (
        error <= 2 * found.round_off + 1e-12 * np.abs(expected).max(axis=(1, 2))[:, None, None]
    ).all()
    labels = found.frf.responses
    chain = couple_chain(parts, joints, AXIS, labels, labels, direct_frf)
    assert scaled_error(chain.frf, expected).max() < 1e-11


def test_a_matrix_joint_with_a_diagonal_is_as_many_joints() -> None:
    parts, ends = systems(), [(("a", "a0"), ("b", "b1")), (("a", "a3"), ("b", "b2"))]
    single = [Joint(*ends[0], 1e7, 10.0), Joint(*ends[1], 2e6, 5.0)]
    one, two = ([pair[k] for pair in ends] for k in (0, 1))
    matrix = MatrixJoint(one, two, np.diag([1e7, 2e6]), np.diag([10.0, 5.0]))
    found, other = couple(frfs(parts), single), couple(frfs(parts), [matrix])
    assert scaled_error(found.frf, other.frf.values).max() < 1e-12
    # the same sums of moduli, whose rows are only in another order
    assert np.allclose(found.kernel_condition, other.kernel_condition, rtol=1e-9)


def test_a_matrix_of_mobilities_and_the_renamed_bound() -> None:
    parts = systems()
    joint = MatrixJoint([("a", "a0"), ("a", "a3")], [("b", "b1"), ("b", "b2")], 1e7 * np.eye(2))
    receptance = couple(frfs(parts), [joint]).frf
    mobility = couple({n: f.to("mobility") for n, f in frfs(parts).items()}, [joint]).frf
    assert scaled_error(mobility.to("receptance"), receptance.values).max() < 1e-12
    renamed = receptance.renamed({"a0": "hub"})
    assert np.array_equal(renamed.round_off, receptance.round_off)


@settings(max_examples=40, deadline=None)
@given(
    st.integers(0, 10**6), st.floats(3.0, 11.0), st.floats(-1.0, 1.0), st.sampled_from(KINDS[:-1])
)
def test_the_bound_holds(seed: int, log_stiffness: float, loss: float, kind: str) -> None:
    """Against the assembly in extended precision (longdouble), at a few lines."""
    rng = np.random.default_rng(seed)
    parts = {name: random_system(rng, 3, name) for name in "ab"}
    axis = np.array([20.0, 333.0, 2000.0])
    joints: list[Joint | MatrixJoint] = [
        Joint(("a", "a0"), ("b", "b1"), 10**log_stiffness * (1 + 1j * loss)),
        MatrixJoint([("a", "a1"), ("a", "a2")], [("b", "b0"), ("b", "b2")], bushing(kind, rng)),
    ]
    found = couple(frfs(parts, axis), joints)
    exact = _refined(parts, joints, axis)
    assert (np.abs(found.frf.values - exact) <= found.round_off).all()


def _refined(parts: Any, joints: Any, axis: Any) -> np.ndarray:
    """X of Z X = 1, by Newton's iteration X (2 - Z X) in extended precision."""
    coarse = solved(parts, joints, axis)
    fine = np.empty(coarse.shape, np.clongdouble)
    two = 2 * np.eye(coarse.shape[1], dtype=np.longdouble)
    for line, w in enumerate(2 * np.longdouble(np.pi) * axis.astype(np.longdouble)):
        z, at = np.zeros(coarse.shape[1:], np.clongdouble), 0
        for s in parts.values():
            own = slice(at, at + len(s.dofs))
            z[own, own] = s.stiffness.astype(np.longdouble) - w**2 * s.mass + 1j * w * s.damping
            at += len(s.dofs)
        names = [(name, dof) for name, s in parts.items() for dof in s.dofs]
        place = {node: k for k, node in enumerate(names)}
        for joint in joints:
            b = signed(joint, place)
            stiffness = np.atleast_2d(joint.dynamic_stiffness(2 * np.pi * axis[[line]])[0])
            z += b.T @ stiffness.astype(np.clongdouble) @ b
        x = coarse[line].astype(np.clongdouble)
        for _ in range(3):
            x = x @ (two - z @ x)
        fine[line] = x
    return fine


def test_a_hysteretic_joint_loses_the_energy_its_loss_factor_says() -> None:
    """One mass on a hysteretic spring: H = 1 / (k (1 + j eta) - w^2 m)."""
    mass, ground = (
        SecondOrderSystem([[m]], [[0.0]], [[0.0]], (label,))
        for m, label in ((2.0, "m"), (1e9, "g"))
    )
    k, eta = 1e6, 0.05
    parts = {"m": direct_frf(mass, AXIS), "g": direct_frf(ground, AXIS)}
    found = couple(parts, [Joint(("m", "m"), ("g", "g"), k * (1 + 1j * eta))]).frf
    z = k * (1 + 1j * eta)
    reduced = 1 / (1 / 2.0 + 1 / 1e9)  # the ground is free and heavy: u_m = f/(-w² M) elsewhere
    expected = 1 / (z - OMEGA**2 * reduced) * (reduced / 2.0) ** 2 - 1 / (OMEGA**2 * (2.0 + 1e9))
    assert np.allclose(found.between("m", "m"), expected, rtol=1e-12)


def test_a_table_is_straight_between_its_lines_and_nothing_beyond() -> None:
    table = StiffnessTable([10.0, 20.0, 40.0], [1.0, 3.0, 1.0 + 2.0j])
    assert np.allclose(
        table(np.array([10.0, 15.0, 30.0, 40.0])), [1.0, 2.0, 2.0 + 1.0j, 1.0 + 2.0j]
    )
    joint = Joint(("a", "a0"), ("b", "b0"), StiffnessTable([100.0, 2000.0], [1e6, 2e6]))
    with pytest.raises(JointError, match=r"joint a\.a0 - b\.b0: its .* 100 to 2000 Hz .* 20 Hz"):
        couple(frfs(systems()), [joint])


def test_what_a_function_returns_is_looked_at() -> None:
    def refused(law: Any, words: str) -> None:
        with pytest.raises(JointError, match=words):
            couple(frfs(systems()), [Joint(("a", "a0"), ("b", "b0"), law)])

    refused(lambda f: f[:3], r"joint a\.a0 - b\.b0: its stiffness of 100 lines has shape \(3,\)")
    refused(lambda f: np.full(f.shape, np.nan), "not finite")
    refused(lambda f: "stiff", "must be an array of numbers")
    constant = Joint(("a", "a0"), ("b", "b0"), lambda f: 1e6)
    same = Joint(("a", "a0"), ("b", "b0"), 1e6)
    one, other = (couple(frfs(systems()), [j]).frf.values for j in (constant, same))
    assert np.array_equal(one, other)


def test_bad_joints_are_refused_in_one_message() -> None:
    one, two = [("a", "a0"), ("a", "a1")], [("b", "b0"), ("b", "b1")]
    with pytest.raises(JointError, match="as many DoFs on either side, got 2 and 1"):
        MatrixJoint(one, two[:1], np.eye(2))
    with pytest.raises(JointError, match=r"stiffness matrix has shape \(3, 3\), \(2, 2\)"):
        MatrixJoint(one, two, np.eye(3))
    with pytest.raises(JointError, match="damping matrix holds NaN"):
        MatrixJoint(one, two, np.eye(2), np.diag([np.nan, 1.0]))
    with pytest.raises(JointError, match="both ends are the same"):
        MatrixJoint(one, one, np.eye(2))
    with pytest.raises(JointError, match="must be finite"):
        Joint(one[0], two[0], complex(1e6, np.inf))
    with pytest.raises(JointError, match="no spring and damper"):
        _ = Joint(one[0], two[0], 1e6 + 1e4j).spring
    with pytest.raises(FbsError, match=r"of 3 lines has values of shape \(2,\)"):
        StiffnessTable([1.0, 2.0, 3.0], [1.0, 2.0])
    joint = MatrixJoint(one, two, 1e6 * np.eye(2))
    with pytest.raises(JointError, match="no guarantee for joints of several DoFs"):
        bounded_frf(systems(), [joint], AXIS, ["a0"], ["a0"])


def test_a_complex_joint_is_within_the_bound_of_truncated_parts() -> None:
    parts = systems()
    joints = [Joint(("a", "a0"), ("b", "b1"), 1e7 * (1 + 0.05j), 3.0)]
    two = {name: parts[name] for name in "ab"}
    found = bounded_frf(two, joints, AXIS, ["a0"], ["b3"])
    exact = couple(frfs(two), joints).frf.between("a0", "b3")
    error = np.abs(found.frf.between("a0", "b3") - exact)
    assert (error <= found.between("a0", "b3") + 2 * found.round_off("a0", "b3")).all()


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "table"])
def test_a_free_light_part_on_a_bushing_keeps_its_digits(kind: str) -> None:
    """1 mg on 1e7 N/m: by its dynamic stiffness, where the bushing holds all of it."""
    rng = np.random.default_rng(4)
    light = SecondOrderSystem(1e-6 * np.eye(2), np.zeros((2, 2)), np.zeros((2, 2)), ("l0", "l1"))
    parts = {"a": random_system(rng, 4, "a"), "l": light}
    axis = np.array([5.0, 100.0, 1500.0])
    ends = [("a", "a1"), ("a", "a2")], [("l", "l0"), ("l", "l1")]
    joints = [MatrixJoint(*ends, bushing(kind, rng))]
    found = couple(frfs(parts, axis), joints)
    exact = _refined(parts, joints, axis)
    error = np.abs(found.frf.values - exact)
    assert (error <= found.round_off).all()
    # what leaves a motion free is coupled by receptances: the bound says what is left
    assert found.held["l"].any() == (kind != "singular")
    if kind != "singular":
        assert (error < 1e-8 * np.abs(exact)).all()
