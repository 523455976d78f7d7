"""Coupling by FRFs is assembly of the systems, to round-off."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fbs import (
    AmbiguousDofError,
    AxisMismatchError,
    FbsError,
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
)
from tests.fbs.fbs_systems import random_system, scaled_error, unit

AXIS = frequency_axis(100, 4000, 20)


def damped(rng: np.random.Generator) -> Any:
    return rng.uniform(1e-7, 1e-5)


def assembled(systems: Any, joints: Any) -> Any:
    """One system of all coordinates; rigid joints eliminate u_first - u_second = 0."""
    names = list(systems)
    sizes = [len(systems[name].dofs) for name in names]
    start = dict(zip(names, np.cumsum([0, *sizes[:-1]]), strict=True))
    n = sum(sizes)
    mass, damping, stiffness = (np.zeros((n, n)) for _ in range(3))
    for name in names:
        system, at = systems[name], start[name]
        own = slice(at, at + len(system.dofs))
        mass[own, own], damping[own, own] = system.mass, system.damping
        stiffness[own, own] = system.stiffness
    rows = []
    for joint in joints:
        v = np.zeros(n)
        for (name, label), sign in ((joint.first, 1.0), (joint.second, -1.0)):
            (index,), (factor,) = systems[name].locate([label])
            v[start[name] + index] += sign * factor
        if joint.rigid:
            rows.append(v)
        else:
            stiffness += joint.stiffness * np.outer(v, v)
            damping += joint.damping * np.outer(v, v)
    basis = np.eye(n)
    if rows:
        basis = np.linalg.svd(np.array(rows))[2][len(rows) :].T  # null space of the constraints
    m, c, k = (basis.T @ matrix @ basis for matrix in (mass, damping, stiffness))
    q = tuple(f"q{i}" for i in range(basis.shape[1]))
    return SecondOrderSystem(m, c, k, q), basis, start


def reference(systems: Any, joints: Any, coupled: Any) -> Any:
    """FRFs of the assembly between the labels of a coupled FRF, label by label."""
    system, basis, start = assembled(systems, joints)
    rows = []
    for label in coupled.responses:
        owner = next(name for name in systems if label in systems[name].labels)
        (index,), (factor,) = systems[owner].locate([label])
        rows.append(factor * basis[start[owner] + index])
    basis_rows = np.array(rows)
    return basis_rows @ direct_frf(system, coupled.frequency).values @ basis_rows.T


def loss(frfs: Any, coupled: Any) -> Any:
    """|Y_ij| / sqrt(h_i h_j): by how much Y - Y B^T (...) B Y cancels, per line (at least 1)."""
    row = dict(zip(coupled.responses, np.linalg.norm(coupled.values, axis=2).T, strict=True))
    ratios = [np.ones(coupled.frequency.size)]
    for frf in frfs.values():
        h = np.array([row[label] for label in frf.responses]).T
        ratio = np.abs(frf.values) / np.sqrt(h[:, :, None] * h[:, None, :])
        ratios.append(ratio.max(axis=(1, 2)))
    return np.max(ratios, axis=0)


def check(systems: Any, joints: Any, axis: Any = AXIS) -> Any:
    frfs = {name: direct_frf(system, axis) for name, system in systems.items()}
    coupled = couple(frfs, joints)
    error = scaled_error(coupled.frf, reference(systems, joints, coupled.frf))
    # the parts' own error: a free stage has condition k / (w^2 m) <= 1e10 / (4e5 * 0.4) at 100 Hz,
    # and so has the assembly solved as one
    own = 1e-11
    assert (error <= own * coupled.kernel_condition * loss(frfs, coupled.frf)).all()
    assert np.median(error) < 1e-11
    assert coupled.kernel_condition.min() >= 1 - 1e-12
    return coupled


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 5), st.integers(0, 3))
def test_coupling_is_assembly(seed: int, count: int, loops: Any) -> None:
    rng = np.random.default_rng(seed)
    systems = {}
    for k in range(count):
        n = int(rng.integers(2, 7))
        derived = {f"s{k}.hub": (f"s{k}.x{n - 1}", float(rng.uniform(0.5, 2.0)))}
        systems[f"s{k}"] = random_system(
            rng, n, f"s{k}.x", grounded=k == 0, beta=damped, derived=derived
        )

    def node(k: Any) -> Any:
        return f"s{k}", str(rng.choice(systems[f"s{k}"].labels))

    def joint(first: Any, second: Any) -> Any:
        if rng.random() < 0.4:  # a tree of joints: no rigid one can be redundant
            return Joint(first, second)
        return Joint(first, second, rng.uniform(1e6, 1e9), rng.choice([0.0, 10.0]))

    joints = [joint(node(int(rng.integers(k))), node(k)) for k in range(1, count)]
    for _ in range(loops):  # flexible ones may close any loop, within one substructure too
        first, second = node(int(rng.integers(count))), node(int(rng.integers(count)))
        if first != second:
            joints.append(Joint(first, second, rng.uniform(1e6, 1e9)))
    check(systems, joints)


def two_stages(seed: int = 0) -> Any:
    rng = np.random.default_rng(seed)
    return {
        "a": random_system(rng, 5, "a", beta=damped),
        "b": random_system(rng, 6, "b", grounded=False, beta=damped),
    }


@pytest.mark.parametrize("stiffness", [None, 1e5, 1e7])
def test_equation_15_with_the_minus_sign(stiffness: float | None) -> None:
    """The printed column [A_ic; A_cc; B_jc] turns the sign of every FRF between A and B."""
    systems = two_stages()
    joint = Joint(("a", "a4"), ("b", "b0"), stiffness)
    coupled = check(systems, [joint]).frf
    a, b = (direct_frf(system, AXIS).values for system in systems.values())
    kernel = a[:, 4, 4] + b[:, 0, 0] + (0 if stiffness is None else 1 / stiffness)
    column = np.concatenate([a[:, :, 4], -b[:, :, 0]], axis=1)
    full = np.zeros((len(AXIS), 11, 11), dtype=complex)
    full[:, :5, :5], full[:, 5:, 5:] = a, b
    full -= column[:, :, None] * column[:, None, :] / kernel[:, None, None]
    assert coupled.responses == systems["a"].dofs + systems["b"].dofs
    assert scaled_error(coupled, full).max() < 1e-11  # the same formula in another order
    between = coupled.select(systems["a"].dofs, systems["b"].dofs)
    as_printed = -column[:, :5, None] * -column[:, None, 5:] / kernel[:, None, None]
    assert np.allclose(between.values, -as_printed, rtol=1e-9, atol=0)


def test_rigid_joints_make_one_motion_and_keep_a_shared_label_once() -> None:
    rng = np.random.default_rng(1)
    systems = {
        "a": random_system(rng, 4, "a", beta=damped, derived={"hub": ("a3", 1.0)}),
        "b": random_system(rng, 3, "b", beta=damped, derived={"hub": ("b0", 0.5)}),
        "c": random_system(rng, 3, "c", beta=damped, derived={"hub": ("c1", 2.0)}),
    }
    joints = [Joint(("a", "hub"), ("b", "hub")), Joint(("b", "hub"), ("c", "hub"))]
    coupled = check(systems, joints).frf
    assert coupled.responses.count("hub") == 1
    # u_b0 * 0.5 is the hub's motion too
    assert np.allclose(
        0.5 * coupled.between("b0", "a0"), coupled.between("hub", "a0"), rtol=1e-9, atol=0
    )


def test_a_loop_closed_within_one_substructure() -> None:
    rng = np.random.default_rng(2)
    systems = {"a": random_system(rng, 6, "a", beta=damped)}
    check(systems, [Joint(("a", "a0"), ("a", "a4"), 1e8, 20.0)])
    check(systems, [Joint(("a", "a0"), ("a", "a4"))])


def test_a_taken_away_stiffness_undoes_a_joint() -> None:
    systems = two_stages()
    frfs = {name: direct_frf(system, AXIS) for name, system in systems.items()}
    joint = Joint(("a", "a4"), ("b", "b0"), 1e7)
    once = couple(frfs, [joint]).frf
    back = couple({"ab": once}, [Joint(("ab", "a4"), ("ab", "b0"), -1e7)]).frf
    assert (
        scaled_error(
            back.select(["a0", "a4"], ["a0", "a4"]), frfs["a"].select(["a0", "a4"], ["a0", "a4"])
        ).max()
        < 1e-9
    )  # two couplings of condition below 1e3


def test_substructures_need_not_be_square() -> None:
    systems = two_stages()
    whole = {name: direct_frf(system, AXIS) for name, system in systems.items()}
    part = {
        "a": whole["a"].select(["a0", "a4"], ["a4"]),
        "b": whole["b"].select(["b0"], ["b3", "b0", "b5"]),
    }
    joints = [Joint(("a", "a4"), ("b", "b0"), 1e8)]
    coupled = couple(part, joints).frf
    assert coupled.responses == ("a0", "a4", "b0")
    assert coupled.excitations == ("a4", "b3", "b0", "b5")
    expected = couple(whole, joints).frf.select(coupled.responses, coupled.excitations)
    assert np.array_equal(coupled.values, expected.values)
    assert coupled.values.strides[0] == 16


def test_only_what_is_asked_for() -> None:
    systems = two_stages()
    frfs = {name: direct_frf(system, AXIS) for name, system in systems.items()}
    joints = [Joint(("a", "a4"), ("b", "b0"), 1e7), Joint(("a", "a1"), ("b", "b2"))]
    whole = couple(frfs, joints)
    responses, excitations = ["b5", "a0", "a1", "b4"], ["b1", "b2", "a3", "b3"]
    part = couple(frfs, joints, responses, excitations)
    expected = whole.frf.select(responses, excitations)
    assert part.frf.responses == tuple(responses)
    assert part.frf.excitations == tuple(excitations)
    np.testing.assert_array_equal(part.frf.values, expected.values)
    np.testing.assert_array_equal(part.kernel_condition, whole.kernel_condition)
    one = couple(frfs, joints, ["a0"]).frf
    np.testing.assert_array_equal(one.values, whole.frf.select(["a0"]).values)
    with pytest.raises(UnknownDofError, match="assembly's responses has no degree of freedom 'a9'"):
        couple(frfs, joints, ["a9"])
    with pytest.raises(AmbiguousDofError, match="'a0' more than once"):
        couple(frfs, joints, None, ["a0", "a0"])


def test_a_shared_label_may_be_asked_for() -> None:
    rng = np.random.default_rng(1)
    systems = {
        "a": random_system(rng, 4, "a", beta=damped, derived={"hub": ("a3", 1.0)}),
        "b": random_system(rng, 3, "b", beta=damped, derived={"hub": ("b0", 0.5)}),
    }
    frfs = {name: direct_frf(system, AXIS) for name, system in systems.items()}
    joints = [Joint(("a", "hub"), ("b", "hub"))]
    wanted = ["b1", "hub", "a2", "b2"]
    part = couple(frfs, joints, wanted, wanted).frf
    expected = couple(frfs, joints).frf.select(wanted, wanted)
    np.testing.assert_array_equal(part.values, expected.values)


@pytest.mark.parametrize("joints", [1, 3])
def test_frfs_that_are_not_reciprocal(joints: int) -> None:
    """Y_c = Y - Y B^T (B Y B^T + 1/Z)^-1 B Y written out, for measured FRFs with H_ij != H_ji."""
    rng = np.random.default_rng(17)
    axis = frequency_axis(1, 600, 1)

    def noise(n: int) -> Any:
        return rng.standard_normal((axis.size, n, n)) + 1j * rng.standard_normal((axis.size, n, n))

    a, b = noise(4), noise(5)
    links = [
        Joint(("a", "a1"), ("b", "b3")),
        Joint(("a", "a0"), ("b", "b0"), 0.5, 1e-4),
        Joint(("b", "b4"), ("a", "a2"), 2.0, ratio=-1.5),
    ][:joints]
    labels = tuple(f"a{i}" for i in range(4)), tuple(f"b{i}" for i in range(5))
    frfs = {
        "a": Frf(axis, a, labels[0], labels[0]),
        "b": Frf(axis, b, labels[1], labels[1]),
    }
    coupled = couple(frfs, links)
    y = np.zeros((axis.size, 9, 9), dtype=complex)
    y[:, :4, :4], y[:, 4:, 4:] = a, b
    signs = np.array(
        [
            unit(9, (1, 1.0), (7, -1.0)),
            unit(9, (0, 1.0), (4, -1.0)),
            unit(9, (8, 1.0), (2, 1.5)),
        ][:joints]
    )
    flexibility = np.zeros((axis.size, joints, joints), dtype=complex)
    for k, joint in enumerate(links):
        if not joint.rigid:
            flexibility[:, k, k] = 1 / joint.dynamic_stiffness(2 * np.pi * axis)
    kernel = signs @ y @ signs.T + flexibility
    expected = y - y @ signs.T @ np.linalg.solve(kernel, signs @ y)
    size = coupled.kernel_condition[:, None, None] * np.abs(y).max() ** 2
    # eps times the kernel's condition, a few times over
    assert (np.abs(coupled.frf.values - expected) <= 1e-14 * size).all()
    assert np.abs(expected - expected.transpose(0, 2, 1)).max() > 1.0


def test_memory_order_does_not_matter() -> None:
    frfs = {name: direct_frf(system, AXIS) for name, system in two_stages().items()}
    copies = {
        name: Frf(AXIS, np.ascontiguousarray(frf.values), frf.responses, frf.excitations)
        for name, frf in frfs.items()
    }
    joints = [Joint(("a", "a4"), ("b", "b0"))]
    assert np.array_equal(couple(frfs, joints).frf.values, couple(copies, joints).frf.values)


@pytest.mark.parametrize("quantity", ["mobility", "accelerance"])
def test_other_quantities_couple_alike(quantity: str) -> None:
    frfs = {name: direct_frf(system, AXIS) for name, system in two_stages().items()}
    joints = [Joint(("a", "a4"), ("b", "b0"), 1e7, 30.0), Joint(("a", "a1"), ("b", "b2"))]
    expected = couple(frfs, joints)
    coupled = couple({name: frf.to(quantity) for name, frf in frfs.items()}, joints)
    assert coupled.frf.quantity == quantity
    # eps, times the kernel's condition and Y / Y_c, both up to 1e2 for the stage that is free
    assert scaled_error(coupled.frf.to("receptance"), expected.frf).max() < 1e-11


def test_kernel_condition_of_one_scalar_joint() -> None:
    frfs = {name: direct_frf(system, AXIS) for name, system in two_stages().items()}
    joint = Joint(("a", "a4"), ("b", "b0"), 1e7, 30.0)
    a, b = frfs["a"].between("a4", "a4"), frfs["b"].between("b0", "b0")
    z = 1e7 + 2j * np.pi * AXIS * 30
    expected = (abs(a) + abs(b) + abs(1 / z)) / abs(a + b + 1 / z)
    assert np.allclose(couple(frfs, [joint]).kernel_condition, expected, rtol=1e-12)


def test_kernel_condition_bounds_the_amplification() -> None:
    rng = np.random.default_rng(7)
    frfs = {name: direct_frf(system, AXIS) for name, system in two_stages().items()}
    joint = Joint(("a", "a4"), ("b", "b0"))
    coupled = couple(frfs, [joint])
    noisy = dict(frfs)
    noise = 1 + 1e-6 * rng.uniform(-1, 1, len(AXIS))  # relative error of one interface FRF
    values = frfs["a"].values.copy()
    values[:, 4, 4] *= noise
    noisy["a"] = Frf(AXIS, values, frfs["a"].responses, frfs["a"].excitations)
    # the joint force for a unit force at b3 is u_b0 / kernel: all its error is the kernel's
    u = frfs["b"].between("b0", "b3")
    force = u / (frfs["a"].between("a4", "a4") + frfs["b"].between("b0", "b0"))
    changed = u / (values[:, 4, 4] + frfs["b"].between("b0", "b0"))
    assert (abs(changed / force - 1) <= 1.01e-6 * coupled.kernel_condition).all()


def test_a_damper_vanishes_at_zero_hertz() -> None:
    rng = np.random.default_rng(3)
    systems = {"a": random_system(rng, 3, "a"), "b": random_system(rng, 3, "b")}
    joints = [Joint(("a", "a2"), ("b", "b0"), 0.0, 100.0)]
    coupled = check(systems, joints, np.array([0.0, 100.0, 200.0]))
    assert (coupled.frf.select(["a0"], ["b0"]).values[0] == 0).all()


def test_grounded_stages_couple_at_zero_hertz() -> None:
    rng = np.random.default_rng(4)
    systems = {"a": random_system(rng, 3, "a"), "b": random_system(rng, 3, "b")}
    check(systems, [Joint(("a", "a2"), ("b", "b0"), 1e7)], np.array([0.0, 100.0]))


def test_a_pole_of_the_assembly_is_a_singular_line() -> None:
    # two equal oscillators, coupled rigidly with the opposite of one's receptance: h_a + h_b = 0
    h = np.array([1e-8, 2e-8, 3e-8])[:, None, None]
    a, b = Frf([1.0, 2.0, 3.0], h, ("a",), ("a",)), Frf([1.0, 2.0, 3.0], -h, ("b",), ("b",))
    with pytest.raises(SingularLineError, match="3 lines") as caught:
        couple({"a": a, "b": b}, [Joint(("a", "a"), ("b", "b"))])
    assert caught.value.frequencies.tolist() == [1.0, 2.0, 3.0]
    # interface FRFs that vanish altogether
    zero = Frf([1.0], np.zeros((1, 1, 1)), ("a",), ("a",))
    with pytest.raises(SingularLineError):
        couple({"a": zero, "b": zero.renamed({"a": "b"})}, [Joint(("a", "a"), ("b", "b"))])


def test_ties_that_follow_from_others_are_singular() -> None:
    rng = np.random.default_rng(5)
    # b's three labels are one coordinate: tying two of them to a ties a's DoFs twice over
    one = random_system(rng, 1, "b", derived={"hub": ("b0", 1.0)})
    rigid_pair = random_system(rng, 1, "a", derived={"a.hub": ("a0", 1.0)})
    frfs = {"a": direct_frf(rigid_pair, AXIS), "b": direct_frf(one, AXIS)}
    with pytest.raises(SingularLineError, match="tie the same motion twice"):
        couple(frfs, [Joint(("a", "a0"), ("b", "b0")), Joint(("a", "a.hub"), ("b", "hub"))])


def test_redundant_rigid_joints_are_named() -> None:
    frfs = {name: direct_frf(system, AXIS) for name, system in two_stages().items()}
    twice = [Joint(("a", "a4"), ("b", "b0")), Joint(("b", "b0"), ("a", "a4"))]
    with pytest.raises(JointError, match=r"joint b\.b0 - a\.a4 is redundant"):
        couple(frfs, twice)
    ring = [
        Joint(("a", "a4"), ("b", "b0")),
        Joint(("b", "b0"), ("b", "b1")),
        Joint(("b", "b1"), ("a", "a4")),
    ]
    with pytest.raises(JointError, match="redundant"):
        couple(frfs, ring)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"stiffness": 0.0}, "no stiffness and no damping"),
        ({"stiffness": np.inf}, "must be finite"),
        ({"stiffness": 1.0, "damping": np.nan}, "must be finite"),
        ({"damping": 1.0}, "takes no damping"),
        ({"second": ("a", "x")}, "both ends are the same"),
        ({"second": "b"}, r"\(substructure, DoF label\)"),
    ],
)
def test_bad_joints(arguments: dict[str, Any], message: str) -> None:
    ends = {"first": ("a", "x"), "second": ("b", "y")}
    with pytest.raises(JointError, match=message):
        Joint(**(ends | arguments))


def test_a_rigid_joint_has_no_dynamic_stiffness() -> None:
    joint = Joint(("a", "x"), ("b", "y"))
    with pytest.raises(JointError, match="rigid"):
        joint.dynamic_stiffness(np.ones(1))


def test_without_joints_the_substructures_stay_side_by_side() -> None:
    frfs = {name: direct_frf(system, AXIS) for name, system in two_stages().items()}
    apart = couple(frfs, [])
    for frf in frfs.values():
        own = apart.frf.select(frf.responses, frf.excitations)
        np.testing.assert_array_equal(own.values, frf.values)
    assert not apart.frf.between("a0", "b0").any()
    np.testing.assert_array_equal(apart.kernel_condition, 1.0)


def test_bad_couplings_are_refused_by_name() -> None:
    frfs = {name: direct_frf(system, AXIS) for name, system in two_stages().items()}
    joint = Joint(("a", "a4"), ("b", "b0"))
    with pytest.raises(FbsError, match="no substructures"):
        couple({}, [joint])
    with pytest.raises(UnknownDofError, match="no substructure 'c', only a, b"):
        couple(frfs, [Joint(("a", "a4"), ("c", "b0"))])
    with pytest.raises(UnknownDofError, match=r"'b' has no degree of freedom 'b9'.*did you mean"):
        couple(frfs, [Joint(("a", "a4"), ("b", "b9"))])
    with pytest.raises(UnknownDofError, match=r"'b0' is not among the excitations of 'b'"):
        couple({**frfs, "b": frfs["b"].select(None, ["b1"])}, [joint])
    other = Frf(AXIS + 1, frfs["b"].values, frfs["b"].responses, frfs["b"].excitations)
    with pytest.raises(AxisMismatchError, match="'a' and 'b' differ: line 0"):
        couple({**frfs, "b": other}, [joint])
    with pytest.raises(QuantityMismatchError, match="receptance against mobility"):
        couple({**frfs, "b": frfs["b"].to("mobility")}, [joint])
    same = frfs["b"].renamed({"b3": "a2"})
    with pytest.raises(AmbiguousDofError, match="'a2' is in 'a' and in 'b'"):
        couple({**frfs, "b": same}, [joint])
    flexible = Joint(("a", "a4"), ("b", "a4"), 1e6)
    with pytest.raises(AmbiguousDofError, match=r"Frf\.renamed"):
        couple({**frfs, "b": frfs["b"].renamed({"b0": "a4"})}, [flexible])


def test_mobility_at_zero_hertz_cannot_be_coupled() -> None:
    axis = np.array([0.0, 10.0])
    rng = np.random.default_rng(6)
    frfs = {
        name: direct_frf(random_system(rng, 2, name), axis, quantity="mobility") for name in "ab"
    }
    with pytest.raises(QuantityMismatchError, match="vanishes at 0 Hz"):
        couple(frfs, [Joint(("a", "a0"), ("b", "b0"))])


def test_unit_builds_vectors() -> None:
    assert unit(3, (0, 1.0), (2, -1.0)).tolist() == [1.0, 0.0, -1.0]
