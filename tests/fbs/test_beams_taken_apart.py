"""Beams of 201 nodes joined at three, two 2-DoF systems: coupled, and taken apart again."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fbs import (
    FbsError,
    Frf,
    Joint,
    MatrixJoint,
    SecondOrderSystem,
    couple,
    decouple,
    decouple_primal,
    decouple_systems,
    direct_frf,
)
from fbs.decoupling import Form
from tests.fbs.fbs_systems import random_system, scaled_error

LINES = np.geomspace(20.0, 2000.0, 20)  # below, the last digit of K (L/h)^4 = 1.6e9 counts more
NODES, LENGTH = 201, 4.0
E_I, RHO_A = 2.1e11 * 1e-8, 7800.0 * 1e-3  # N m², kg/m
JOINED = (60, 100, 140)
AT = tuple(f"{node}.{dof}" for node in JOINED for dof in "vt")


@cache
def beam(held: bool = False, stiffer: float = 1.0) -> SecondOrderSystem:
    """Euler–Bernoulli beam, Rayleigh-damped; its rotations are carried as h θ, in m."""
    h = LENGTH / (NODES - 1)
    n = 2 * NODES
    mass, stiffness = np.zeros((n, n)), np.zeros((n, n))
    k = stiffer * E_I / h**3 * np.array(
        [[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]]
    )  # fmt: skip
    m = RHO_A * h / 420 * np.array(
        [[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]]
    )  # fmt: skip
    for e in range(NODES - 1):
        at = slice(2 * e, 2 * e + 4)
        mass[at, at] += m
        stiffness[at, at] += k
    free = slice(2, None) if held else slice(None)
    labels = [f"{node}.{dof}" for node in range(NODES) for dof in "vt"][free]
    mass, stiffness = mass[free, free], stiffness[free, free]
    return SecondOrderSystem(mass, 5.0 * mass + 1e-5 * stiffness, stiffness, labels)


def second() -> SecondOrderSystem:
    """A free beam whose labels but the joined ones are its own: ``b.…``."""
    system = beam(stiffer=1.5)
    labels = [dof if dof in AT else f"b.{dof}" for dof in system.dofs]
    return SecondOrderSystem(system.mass, system.damping, system.stiffness, labels)


def together(*systems: SecondOrderSystem) -> SecondOrderSystem:
    """M, C, K added up at equal labels."""
    dofs = list(dict.fromkeys(dof for system in systems for dof in system.dofs))
    matrices = np.zeros((3, len(dofs), len(dofs)))
    for system in systems:
        place = [dofs.index(dof) for dof in system.dofs]
        for whole, own in zip(
            matrices, (system.mass, system.damping, system.stiffness), strict=True
        ):
            whole[np.ix_(place, place)] += own
    mass, damping, stiffness = matrices
    return SecondOrderSystem(mass, damping, stiffness, dofs)


ASKED_A, ASKED_B = (*AT, "20.v", "200.v"), (*AT, "b.0.v", "b.170.v")


@pytest.mark.slow
@pytest.mark.parametrize("held", [False, True])
def test_beams_coupled_at_three_nodes_are_the_assembled_ones_and_come_apart(held: bool) -> None:
    a, b = beam(held), second()
    one, two = direct_frf(a, LINES, ASKED_A, ASKED_A), direct_frf(b, LINES, ASKED_B, ASKED_B)
    joints = [Joint(("A", label), ("B", label)) for label in AT]
    coupled = couple({"A": one, "B": two}, joints).frf
    asked = tuple(dict.fromkeys((*ASKED_A, *ASKED_B)))
    whole = direct_frf(together(a, b), LINES, asked, asked)
    assert scaled_error(coupled.select(asked, asked), whole.values).max() < 1e-9

    inside = ("b.0.v", "b.170.v")
    forms: list[tuple[Form, tuple[str, ...]]] = [
        ("standard", ()), ("mixed", inside), ("extended", inside),
    ]  # fmt: skip
    for form, internal in forms:
        found = decouple(whole, two, AT, internal, form=form).frf
        expected = one.select(found.responses, found.excitations).values
        assert scaled_error(found, expected).max() < 1e-6, form
    # impedances: the interface's six and the DoFs inside, all of them in the assembly
    primal = decouple_primal(whole, two, AT)
    expected = one.select(primal.responses, primal.excitations).values
    assert scaled_error(primal, expected).max() < 1e-6

    back = decouple_systems(together(a, b), b, AT)
    assert back.dofs == a.dofs
    for name in ("mass", "damping", "stiffness"):
        error = np.abs(getattr(back, name) - getattr(a, name)).max()
        assert error < 1e-14 * np.abs(getattr(a, name)).max()


@pytest.mark.parametrize("relative", [1e-3, 1e-2])
def test_noise_on_beams_does_what_the_spread_says(relative: float) -> None:
    """Within 1.96/√2 of the spread in real and imaginary part: 95 % where it is linear.

    400 repetitions of 20 lines, a third of them linear at least: errors of one line's FRFs are not
    independent, and the share's own scatter is below 0.22/√(400 · 7) = 0.4 %.
    """
    rng = np.random.default_rng(8)
    a, b = beam(True), second()
    at = ("100.v",)
    joints = [Joint(("A", "100.v"), ("B", "100.v"))]
    one = direct_frf(a, LINES, (*at, "20.v"), (*at, "20.v"))
    two = direct_frf(b, LINES, (*at, "b.0.v"), (*at, "b.0.v"))
    whole = couple({"A": one, "B": two}, joints).frf
    spread = decouple(whole, two, at).spread(relative)
    exact = one.select((*at, "20.v"), (*at, "20.v")).values
    linear = spread < 0.05 * np.abs(exact)
    assert linear.mean() > 0.3
    inside = np.zeros(exact.shape)
    for _ in range(400):
        found = decouple(noisy(whole, relative, rng), noisy(two, relative, rng), at).frf
        error = found.select((*at, "20.v"), (*at, "20.v")).values - exact
        inside += np.abs(error.real) <= 1.96 * spread / np.sqrt(2.0)
        inside += np.abs(error.imag) <= 1.96 * spread / np.sqrt(2.0)
    assert inside[linear].sum() / (800 * linear.sum()) == pytest.approx(0.95, abs=0.015)


def noisy(frf: Frf, relative: float, rng: np.random.Generator) -> Frf:
    shape = frf.values.shape
    error = (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2.0)
    return Frf(frf.frequency, frf.values * (1.0 + relative * error), frf.responses, frf.excitations)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6))
def test_coupling_is_associative_and_decoupling_undoes_it(seed: int) -> None:
    """(A + B) + C = A + (B + C) = all at once, through a spring and a bushing."""
    rng = np.random.default_rng(seed)
    lines = np.linspace(20.0, 2000.0, 12)
    parts = {
        name: direct_frf(
            random_system(rng, 4, name, beta=lambda rng: rng.uniform(1e-6, 1e-5)), lines
        )
        for name in "abc"
    }
    first: list[Joint | MatrixJoint] = [Joint(("a", "a0"), ("b", "b1"), 1e7 * (1 + 0.1j))]
    last: list[Joint | MatrixJoint] = [
        MatrixJoint(
            [("b", "b2"), ("b", "b3")], [("c", "c0"), ("c", "c2")],
            1e7 * np.array([[2.0, 1.0], [1.0, 3.0]]),
        )
    ]  # fmt: skip
    once = couple(parts, first + last)
    left = couple({"a": parts["a"], "b": parts["b"]}, first).frf
    tied = MatrixJoint(
        [("ab", "b2"), ("ab", "b3")], [("c", "c0"), ("c", "c2")],
        1e7 * np.array([[2.0, 1.0], [1.0, 3.0]]),
    )  # fmt: skip
    left = couple({"ab": left, "c": parts["c"]}, [tied]).frf
    right = couple({"b": parts["b"], "c": parts["c"]}, last).frf
    right = couple(
        {"a": parts["a"], "bc": right}, [Joint(("a", "a0"), ("bc", "b1"), 1e7 * (1 + 0.1j))]
    ).frf
    labels = once.frf.responses
    for other in (left, right):
        assert (
            np.abs(other.select(labels, labels).values - once.frf.values)
            <= once.round_off + other.select(labels, labels).round_off
        ).all()


def test_a_known_part_that_is_not_in_the_assembly_is_refused() -> None:
    """Stiffer, heavier, or elsewhere: one message with what and where."""
    a = SecondOrderSystem(np.eye(2), np.zeros((2, 2)), [[3e4, -2e4], [-2e4, 2e4]], ("a", "c"))
    b = SecondOrderSystem(np.eye(2), np.zeros((2, 2)), [[3e4, -3e4], [-3e4, 7e4]], ("c", "b"))
    whole = together(a, b)
    assert np.allclose(decouple_systems(whole, b, ["c"]).stiffness, a.stiffness)
    stiff = SecondOrderSystem(b.mass, b.damping, b.stiffness + np.diag([5e4, 0.0]), b.dofs)
    with pytest.raises(FbsError, match=r"stiffer than the assembly at c: .* stiffness of -3"):
        decouple_systems(whole, stiff, ["c"])
    heavy = SecondOrderSystem(b.mass + np.diag([2.0, 0.0]), b.damping, b.stiffness, b.dofs)
    with pytest.raises(FbsError, match="heavier than the assembly at c"):
        decouple_systems(whole, heavy, ["c"])
    soft = SecondOrderSystem(b.mass, b.damping, b.stiffness - np.diag([0.0, 1e4]), b.dofs)
    with pytest.raises(FbsError, match="stiffness is left at 'b', which is inside it"):
        decouple_systems(whole, soft, ["c"])
    lines = np.linspace(2.0, 80.0, 157)
    damped = [
        SecondOrderSystem(s.mass, 1e-4 * s.stiffness, s.stiffness, s.dofs) for s in (a, b, stiff)
    ]
    frfs = [direct_frf(system, lines) for system in damped]
    assembly = couple({"A": frfs[0], "B": frfs[1]}, [Joint(("A", "c"), ("B", "c"))]).frf
    decouple(assembly, frfs[1], ["c"]).require_stable(["c"], 0.01)
    # what is left: 1e4 and 2e4 N/m in a row, less 5e4
    with pytest.raises(FbsError, match=r"stiffer than the assembly at c: .* -4\.33e\+04 N/m"):
        decouple(assembly, frfs[2], ["c"]).require_stable(["c"])
