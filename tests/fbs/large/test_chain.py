"""A chain coupled part by part is the same as all parts coupled at once."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fbs import (
    AmbiguousDofError,
    AxisMismatchError,
    Frf,
    Joint,
    JointError,
    QuantityMismatchError,
    SecondOrderSystem,
    SingularLineError,
    UnknownDofError,
    couple,
    direct_frf,
    frequency_axis,
    modal_frf,
    real_modes,
)
from fbs.interface_synthesis import interface_frf
from fbs.large.chain import BLOCK, couple_chain
from tests.fbs.fbs_systems import random_system, scaled_error, spring_matrices, unit

AXIS = frequency_axis(100, 4000, 20)
EPS = float(np.finfo(float).eps)


def damped(rng: np.random.Generator) -> Any:
    return rng.uniform(1e-7, 1e-5)


def random_tree(
    seed: int, n_parts: Any, several: Any, chain: bool = False, beta: Any = damped
) -> Any:
    """Parts joined to earlier ones, by one joint or several, rigid or flexible."""
    rng = np.random.default_rng(seed)
    parts = {
        f"p{k}": random_system(rng, 4, f"p{k}.x", grounded=bool(rng.integers(2)), beta=beta)
        for k in range(n_parts)
    }
    joints = []
    for k in range(1, n_parts):
        other = k - 1 if chain else rng.integers(k)
        count = rng.integers(1, 4) if several else 1
        here, there = (rng.choice(4, count, replace=False) for _ in range(2))
        for a, b in zip(here, there, strict=True):
            ends = [(f"p{k}", f"p{k}.x{a}"), (f"p{other}", f"p{other}.x{b}")]
            first, second = ends if rng.integers(2) else ends[::-1]
            ratio = rng.uniform(0.3, 3) * rng.choice([-1, 1])
            if rng.integers(2):
                joints.append(Joint(first, second, ratio=ratio))
            else:
                stiffness = 10 ** rng.uniform(5, 10)
                joints.append(Joint(first, second, stiffness, 1e-6 * stiffness, ratio))
    return parts, joints


def solve_condition(parts: Any) -> Any:
    """Largest condition of the parts' dynamic stiffnesses, scaled to a unit diagonal, by line."""
    omega = 2 * np.pi * AXIS[:, None, None]
    largest = np.ones(len(AXIS))
    for part in parts:
        stiffness = part.stiffness + 1j * omega * part.damping - omega**2 * part.mass
        scale = np.sqrt(np.abs(np.einsum("fii->fi", stiffness)))
        scaled = stiffness / (scale[:, :, None] * scale[:, None, :])
        largest = np.maximum(largest, np.linalg.cond(scaled))
    return largest


def labels_of(parts: Any) -> Any:
    return [label for part in parts.values() for label in part.labels]


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 7), st.booleans())
def test_a_tree_is_all_its_parts_coupled_at_once(seed: int, n_parts: Any, several: Any) -> None:
    parts, joints = random_tree(seed, n_parts, several)
    asked = labels_of(parts)
    whole = couple({name: direct_frf(part, AXIS) for name, part in parts.items()}, joints)
    chain = couple_chain(parts, joints, AXIS, asked, asked, direct_frf)
    assert (chain.frf.responses, chain.frf.excitations) == (tuple(asked), tuple(asked))
    error = scaled_error(chain.frf, whole.frf)
    # A part's FRF is known to eps × the condition of its dynamic stiffness (Higham 2002, 7.1), and
    # the two solve it for different right sides; of some 4 n_parts sums, amplified by the kernel.
    known = EPS * solve_condition(parts.values())
    assert (error <= 10 * n_parts * known * whole.kernel_condition).all()
    ratio = chain.kernel_condition / whole.kernel_condition
    if several:
        assert (ratio >= 1 - 1e-6).all()  # a bound of it; 1e-6: both are condition * eps accurate
    else:
        assert np.abs(ratio - 1).max() < 1e-6


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 6))
def test_undamped_chains_by_modal_synthesis(seed: int, n_parts: Any) -> None:
    parts, joints = random_tree(seed, n_parts, False, chain=True, beta=lambda rng: 0.0)
    joints = [Joint(j.first, j.second, j.stiffness, ratio=j.ratio) for j in joints]
    asked = ["p0.x0", f"p{n_parts - 1}.x3"]
    axis = AXIS + np.pi  # off any pole
    chain = couple_chain(parts, joints, axis, asked, asked)
    whole = couple({name: direct_frf(part, axis) for name, part in parts.items()}, joints)
    error = scaled_error(chain.frf.values, whole.frf.select(asked, asked).values)
    # modal against direct parts: each is off by eps times its condition (1e5 at most between
    # these poles and lines); the kernel's amplification comes on top
    assert (error <= 1e5 * EPS * whole.kernel_condition).all()


def test_two_masses_on_a_spring_in_closed_form() -> None:
    parts = {
        name: SecondOrderSystem([[m]], [[0.0]], [[0.0]], (name,))
        for name, m in (("a", 2), ("b", 3))
    }
    k, w = 1e6, 2 * np.pi * AXIS
    chain = couple_chain(parts, [Joint(("a", "a"), ("b", "b"), k)], AXIS, ["a"], ["a", "b"])
    determinant = (k - 2 * w**2) * (k - 3 * w**2) - k**2
    expected = np.stack([k - 3 * w**2, k + 0 * w], axis=1)[:, None] / determinant[:, None, None]
    # a handful of roundings, amplified by at most 10 on this axis (the pole is at 145 Hz)
    assert np.abs(chain.frf.values / expected - 1).max() < 1e-13


@pytest.mark.parametrize("count", [1, 2])
@pytest.mark.parametrize("distance", [1e-6, 1e-9, 1e-12, 0.0])
def test_a_resonance_beyond_a_joint_does_not_spoil_the_rest(count: int, distance: float) -> None:
    # everything right of the first connection, alone, has a pole this near to the line: its
    # message is 1 / distance times larger than elsewhere, which must not cost digits (beyond
    # the three that GROWTH allows where joints are eliminated together)
    rng = np.random.default_rng(7)
    parts = {f"p{k}": random_system(rng, 3, f"p{k}.x") for k in range(4)}
    joints = [
        Joint((f"p{k}", f"p{k}.x{a}"), (f"p{k + 1}", f"p{k + 1}.x{a}"), 3e8)
        for k in range(3)
        for a in range(count)
    ]
    n, start = 9, {"p1": 0, "p2": 3, "p3": 6}
    mass, stiffness = np.zeros((n, n)), np.zeros((n, n))
    for name, at in start.items():
        here = slice(at, at + 3)
        mass[here, here], stiffness[here, here] = parts[name].mass, parts[name].stiffness
    for joint in joints[count:]:
        ends = [start[name] + int(label[-1]) for name, label in (joint.first, joint.second)]
        v = unit(n, (ends[0], 1.0), (ends[1], -1.0))
        stiffness += joint.spring[0] * np.outer(v, v)
    tail = SecondOrderSystem(mass, 0 * mass, stiffness, tuple(f"x{k}" for k in range(n)))
    asked = ["p0.x0", "p0.x2", "p3.x2"]
    lines = real_modes(tail).natural_frequencies * (1 + distance)
    chain = couple_chain(parts, joints, lines, asked, asked, direct_frf)
    whole = couple({name: direct_frf(part, lines) for name, part in parts.items()}, joints)
    error = scaled_error(chain.frf.values, whole.frf.select(asked, asked).values)
    assert (error <= 1000 * EPS * whole.kernel_condition).all()


def test_a_label_of_two_parts_is_one_motion() -> None:
    a = random_system(np.random.default_rng(0), 3, "a", beta=damped)
    b = random_system(np.random.default_rng(1), 3, "b", beta=damped)
    parts = {
        "a": SecondOrderSystem(a.mass, a.damping, a.stiffness, ("a0", "a1", "hub")),
        "b": SecondOrderSystem(b.mass, b.damping, b.stiffness, ("hub", "b1", "b2")),
    }
    tie = Joint(("a", "hub"), ("b", "hub"))
    asked = ["a0", "hub", "b2"]
    chain = couple_chain(parts, [tie], AXIS, asked, asked, direct_frf)
    whole = couple({name: direct_frf(part, AXIS) for name, part in parts.items()}, [tie])
    error = scaled_error(chain.frf.values, whole.frf.select(asked, asked).values)
    assert (error <= 1000 * EPS * whole.kernel_condition).all()
    with pytest.raises(AmbiguousDofError, match="'hub' is in 'a' and in 'b'"):
        couple_chain(parts, [Joint(("a", "hub"), ("b", "hub"), 1e6)], AXIS, asked, asked)


def test_ready_frfs_and_threads_give_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    parts, joints = random_tree(5, 5, True)
    asked = ["p0.x0", "p4.x1"]
    axis = np.linspace(100, 4000, BLOCK + 3)  # more than one block
    one = couple_chain(parts, joints, axis, asked, asked, direct_frf)
    ready = {name: direct_frf(part, axis) for name, part in parts.items()}
    two = couple_chain(ready, joints, axis, asked, asked)
    # the same operations; only how the stage's columns are batched may round differently
    assert scaled_error(two.frf, one.frf).max() < 1e-10
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    three = couple_chain(ready, joints, axis, asked, asked)
    assert np.array_equal(three.frf.values, two.frf.values)


def test_parts_that_are_not_joined_do_not_act_on_each_other() -> None:
    parts, _ = random_tree(5, 2, True)
    chain = couple_chain(parts, [], AXIS, ["p0.x0"], ["p0.x1", "p1.x0"], direct_frf)
    assert not chain.frf.between("p0.x0", "p1.x0").any()
    alone = direct_frf(parts["p0"], AXIS).between("p0.x0", "p0.x1")
    # the direct solution of fewer columns, as far as that rounds differently
    assert np.abs(chain.frf.between("p0.x0", "p0.x1") / alone - 1).max() < 1e-12
    assert (chain.kernel_condition == 1).all()


def test_modes_that_leave_the_interface_at_rest_are_left_out() -> None:
    # two equal pendulums on a body: their difference does not move it
    n, beta = 3, 1e-6
    springs = [(unit(n, (0, 1.0)), 1e8), *((unit(n, (0, 1.0), (k, -1.0)), 2e7) for k in (1, 2))]
    stiffness = sum(k * np.outer(v, v) for v, k in springs)
    system = SecondOrderSystem(
        np.diag([2.0, 1.0, 1.0]), beta * stiffness, stiffness, ("a", "b", "c")
    )
    few, all_modes = (
        interface_frf(system, AXIS, ["a"], ["a"]),
        modal_frf(system, AXIS, ["a"], ["a"]),
    )
    # the mode left out has a residue below (16 n eps)^2
    assert np.abs(few.values / all_modes.values - 1).max() < 1e-14
    damping = system.damping + np.diag([0.0, 30.0, 0.0])  # now it does
    general = SecondOrderSystem(system.mass, damping, stiffness, system.dofs)
    few, direct = (
        interface_frf(general, AXIS, ["a"], ["a"]),
        direct_frf(general, AXIS, ["a"], ["a"]),
    )
    assert np.abs(few.values / direct.values - 1).max() < 1e-10  # eps times the modes' condition


def test_refused() -> None:
    parts, joints = random_tree(0, 3, False, chain=True)
    asked = ["p0.x0"]

    def refused(
        error: Any,
        match: str,
        changed: Any = parts,
        tied: Any = joints,
        axis: Any = AXIS,
        wanted: Any = asked,
    ) -> None:
        with pytest.raises(error, match=match):
            couple_chain(changed, tied, axis, wanted, asked, direct_frf)

    loop = Joint(("p0", "p0.x0"), ("p2", "p2.x0"), 1e6)
    refused(JointError, "close a loop of parts; use couple", tied=[*joints, loop])
    refused(JointError, "within one part", tied=[Joint(("p0", "p0.x0"), ("p0", "p0.x1"), 1e6)])
    twice = [Joint(("p0", "p0.x0"), ("p1", "p1.x0")), Joint(("p1", "p1.x0"), ("p0", "p0.x0"))]
    refused(JointError, "redundant", tied=twice)
    refused(UnknownDofError, "no part 'p9'", tied=[Joint(("p0", "p0.x0"), ("p9", "x"), 1.0)])
    refused(UnknownDofError, "did you mean", tied=[Joint(("p0", "p0.x0"), ("p1", "p1.x7"), 1.0)])
    refused(UnknownDofError, "the chain has no", wanted=["p0.x9"])
    ready = parts | {"p1": direct_frf(parts["p1"], AXIS)}
    refused(AxisMismatchError, "axis of part 'p1'", changed=ready, axis=AXIS + 1)
    mobility = parts | {"p1": direct_frf(parts["p1"], AXIS, quantity="mobility")}
    refused(QuantityMismatchError, "part 'p1' is mobility", changed=mobility)


def test_a_line_on_a_pole_of_the_assembly_is_named() -> None:
    mass = {name: SecondOrderSystem([[1.0]], [[0.0]], [[0.0]], (name,)) for name in "ab"}
    axis = np.array([1.0, 2.0, 3.0])
    receptance = {
        name: Frf(axis, direct_frf(part, axis).values, (name,), (name,))
        for name, part in mass.items()
    }
    k = (2 * np.pi * 2.0) ** 2 / 2  # two masses of 1 kg: w^2 = 2 k
    with pytest.raises(SingularLineError, match="2 Hz") as caught:
        couple_chain(receptance, [Joint(("a", "a"), ("b", "b"), k)], axis, ["a"], ["a"])
    assert caught.value.frequencies.tolist() == [2.0]


def test_unstable_lines_are_coupled_at_once_with_a_label_of_two_parts(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # three branches on one body: the joints of two are eliminated together for the third, with
    # trouble where those two and the body have a pole. "spring" is a label of every branch
    k = (2 * np.pi * 100.0) ** 2

    def branch(stiffness: float) -> Any:
        matrix = stiffness * np.array([[1.0, -1.0], [-1.0, 1.0]])
        return SecondOrderSystem(np.eye(2), np.zeros((2, 2)), matrix, ("spring", "end"))

    body = SecondOrderSystem([[2.0]], [[0.0]], [[5 * k]], ("body",))
    parts = {"root": body, **{f"b{n}": branch(n * k) for n in (1, 2, 3)}}
    joints = [Joint(("root", "body"), (f"b{n}", "spring"), 2 * k) for n in (1, 2, 3)]
    springs = [(unit(5, (0, 1.0)), 5 * k, 0.0)]
    for n in (1, 2):
        at = 2 * n - 1
        springs += [(unit(5, (0, 1.0), (at, -1.0)), 2 * k, 0.0)]
        springs += [(unit(5, (at, 1.0), (at + 1, -1.0)), n * k, 0.0)]
    mass = np.diag([2.0, 1.0, 1.0, 1.0, 1.0])
    without = SecondOrderSystem(mass, 0 * mass, spring_matrices(5, springs)[0], tuple("abcde"))
    axis = np.sort(real_modes(without).natural_frequencies) * (1 + 1e-9)
    coupled: list[Any] = []

    def noted(*given: Any) -> Any:
        coupled.append(given)
        return couple(*given)

    monkeypatch.setattr("fbs.large.chain.couple", noted)
    chain = couple_chain(parts, joints, axis, ["body"], ["body"], direct_frf)
    assert len(coupled) == 1
    # the body's dynamic stiffness, with each branch's seen through its joint
    w = 2 * np.pi * axis
    expected = 5 * k - 2 * w**2
    for n in (1, 2, 3):
        driven = n * k - w**2 - (n * k) ** 2 / (n * k - w**2)
        expected += 2 * k * driven / (2 * k + driven)
    # some hundred roundings; the kernel's condition on top
    error = np.abs(chain.frf.values[:, 0, 0] * expected - 1)
    assert (error <= 100 * EPS * chain.kernel_condition).all()
