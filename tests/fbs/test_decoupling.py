"""Decoupling undoes coupling, by every formulation, and says what noise does to it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fbs import FbsError, Frf, Joint, SecondOrderSystem, SingularLineError, couple, direct_frf
from fbs.decoupling import DecoupledFrf, Form, decouple, decouple_primal

LINES = np.linspace(2.0, 80.0, 157)


def chain(
    labels: str, masses: list[float], springs: list[float], ground: float
) -> SecondOrderSystem:
    """Masses in a row (kg) joined by springs (N/m), the first held by one to the ground."""
    n = len(masses)
    stiffness = np.zeros((n, n))
    stiffness[0, 0] = ground
    for k, spring in enumerate(springs):
        stiffness[k : k + 2, k : k + 2] += spring * np.array([[1.0, -1.0], [-1.0, 1.0]])
    return SecondOrderSystem(np.diag(masses), 1e-4 * stiffness, stiffness, tuple(labels))


# Two masses of 1 kg each, A on springs of 1e4 and 2e4 N/m, B of 3e4 and 4e4: joined at c.
UNKNOWN = chain("ac", [1.0, 1.0], [2e4], 1e4)
KNOWN = SecondOrderSystem(
    np.diag([1.0, 1.0]), 1e-4 * np.array([[3e4, -3e4], [-3e4, 7e4]]),
    np.array([[3e4, -3e4], [-3e4, 7e4]]), ("c", "b"),
)  # fmt: skip


def assembled(unknown: Frf, known: Frf, at: str = "c") -> Frf:
    joints = [Joint(("A", label), ("B", label)) for label in at]
    return couple({"A": unknown, "B": known}, joints).frf


A, B = direct_frf(UNKNOWN, LINES), direct_frf(KNOWN, LINES)
AB = assembled(A, B)


def difference(found: Frf, exact: Frf) -> float:
    same = exact.select(found.responses, found.excitations)
    return float(np.abs(found.values - same.values).max() / np.abs(exact.values).max())


@pytest.mark.parametrize(
    ("form", "internal"), [("standard", ""), ("mixed", "b"), ("extended", "b")]
)
def test_the_part_comes_back(form: Form, internal: str) -> None:
    """Two 2-DoF systems (m = 1 kg; 1e4, 2e4 | 3e4, 4e4 N/m): to round-off, by each form."""
    result = decouple(AB, B, ["c"], tuple(internal), form=form)
    assert result.frf.responses == ("a", "c")
    assert difference(result.frf, A) < 1e-11


def test_primal_and_dual_are_one() -> None:
    """eps × the condition of the 3 × 3 FRFs inverted (1e5 near their poles)."""
    assert difference(decouple_primal(AB, B, ["c"]), A) < 1e-9
    frf = decouple_primal(AB.to("mobility"), B.to("mobility"), ["c"])
    assert difference(frf, A.to("mobility")) < 1e-9


def test_not_collocated() -> None:
    """Forces act at the interface alone, motions are made equal inside the known part as well."""
    at_b = decouple(AB, B, ["c"], ["b"], form="mixed", responses=["a"], excitations=["a", "c"])
    assert difference(at_b.frf, A) < 1e-11


@given(st.integers(0, 2**32 - 1))
def test_random_parts_with_two_interface_dofs(seed: int) -> None:
    """Decoupling undoes coupling, to what round-off of the data explains, line by line."""
    rng = np.random.default_rng(seed)

    def part(labels: str) -> Frf:
        n = len(labels)
        root = rng.standard_normal((n, n)) * 100.0
        stiffness = root @ root.T + 1e3 * np.eye(n)
        mass = np.diag(rng.uniform(0.5, 2.0, n))
        return direct_frf(
            SecondOrderSystem(mass, 1e-3 * stiffness, stiffness, tuple(labels)), LINES
        )

    unknown, known = part("pqcd"), part("cdxy")
    whole = assembled(unknown, known, "cd")
    forms: dict[Form, tuple[str, ...]] = {"standard": (), "mixed": INSIDE, "extended": INSIDE}
    for form, internal in forms.items():
        result = decouple(whole, known, ("c", "d"), internal, form=form)
        exact = unknown.select(result.frf.responses, result.frf.excitations).values
        # each datum has a few dozen roundings behind it, those of couple's kernel among them
        allowed = 1e3 * result.bound() * couple_condition(unknown, known)[:, None, None]
        assert (np.abs(result.frf.values - exact) <= allowed).all()


def couple_condition(unknown: Frf, known: Frf) -> np.ndarray:
    joints = [Joint(("A", label), ("B", label)) for label in "cd"]
    return np.asarray(couple({"A": unknown, "B": known}, joints).kernel_condition)


def noisy(frf: Frf, relative: float, rng: np.random.Generator) -> Frf:
    """Each value times 1 + a complex Gaussian of standard deviation `relative`."""
    shape = frf.values.shape
    error = (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2.0)
    return Frf(frf.frequency, frf.values * (1.0 + relative * error), frf.responses, frf.excitations)


@pytest.mark.parametrize("relative", [1e-3, 1e-2])
def test_noise_does_what_the_spread_says(relative: float) -> None:
    """Within 1.96/√2 of the spread in real part: 95 % where linear (a tenth of the FRF at most).

    400 repetitions × 157 lines × 4 FRFs are counted together: the share's own scatter, the lines
    of one repetition independent, is below 0.2 %.
    """
    rng = np.random.default_rng(1)
    spread = decouple(AB, B, ["c"]).spread(relative)
    exact = A.select(("a", "c"), ("a", "c")).values
    linear = spread < 0.1 * np.abs(exact)
    inside = np.zeros(exact.shape)
    for _ in range(400):
        found = decouple(noisy(AB, relative, rng), noisy(B, relative, rng), ["c"]).frf.values
        inside += np.abs((found - exact).real) <= 1.96 * spread / np.sqrt(2.0)
    assert linear.mean() > 0.5
    share = inside[linear].sum() / (400 * linear.sum())
    assert share == pytest.approx(0.95, abs=0.01)


def test_spikes_are_foretold() -> None:
    """Where c hardly moves in A beside B held there: fewer digits than anywhere else."""
    light = SecondOrderSystem(np.eye(2), np.zeros((2, 2)), UNKNOWN.stiffness, ("a", "c"))
    undamped = SecondOrderSystem(np.eye(2), np.zeros((2, 2)), KNOWN.stiffness, ("c", "b"))
    lines = np.linspace(30.0, 45.0, 1501)
    a, b = direct_frf(light, lines), direct_frf(undamped, lines)
    result = decouple(assembled(a, b), b, ["c"])
    held = np.sqrt(7e4) / (2.0 * np.pi)  # b with c held, where B's own c stands still
    worst = lines[np.argmin(result.digits_left(1e-3).min(axis=(1, 2)))]
    assert worst == pytest.approx(held, abs=0.02)
    assert result.digits_left(1e-3).min() < 1.0


def test_the_extended_form_says_how_far_data_contradict() -> None:
    """Round-off for one model's FRFs; about the noise for measured ones."""
    assert decouple(AB, B, ["c"], ["b"], form="extended").dropped.max() < 1e-10
    rng = np.random.default_rng(2)
    data = decouple(noisy(AB, 1e-2, rng), noisy(B, 1e-2, rng), ["c"], ["b"], form="extended")
    assert 1e-3 < np.median(data.dropped) < 1e-1


def test_what_is_regularised_is_said() -> None:
    two = assembled(TWO[0], TWO[1], "cd")
    cut: DecoupledFrf = decouple(two, TWO[1], ["c", "d"], rank=1)
    assert (cut.dropped > 0.0).all()
    full = decouple(two, TWO[1], ["c", "d"])
    assert (full.dropped == 0.0).all()
    damped = decouple(two, TWO[1], ["c", "d"], tikhonov=1e-3)
    assert 0.0 < difference(damped.frf, full.frf) < 0.1
    assert (damped.kernel_condition <= full.kernel_condition).all()


INSIDE = ("x", "y")
TWO = (
    direct_frf(chain("pcd", [1.0, 2.0, 1.5], [2e4, 3e4], 1e4), LINES),
    direct_frf(chain("cdx", [1.0, 1.0, 0.5], [1e4, 5e4], 2e4), LINES),
)


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda: decouple(AB, B, []), FbsError, "at least one interface DoF"),
        (lambda: decouple(AB, B, ["a"]), FbsError, "known part"),
        (lambda: decouple(AB, B, ["c"], form="mixed"), FbsError, "the others need some"),
        (lambda: decouple(AB, B, ["c"], ["b"], form="standard"), FbsError, "takes none"),
        (lambda: decouple(AB, B, ["c"], rank=2), FbsError, "between 1 and 1"),
        (lambda: decouple(AB, B, ["c"], tikhonov=-1.0), FbsError, "tikhonov = -1"),
        (lambda: decouple(AB, B.to("mobility"), ["c"]), FbsError, "receptance against mobility"),
        (lambda: decouple(AB, B.band(3.0), ["c"]), FbsError, "axes"),
        (lambda: decouple(AB, AB, ["c"], responses=["a"]), SingularLineError, "singular"),
        (lambda: decouple_primal(AB.select(["a", "c", "b"], ["a"]), B, ["c"]), FbsError, "square"),
    ],
)
def test_what_cannot_be_decoupled(call: Callable[..., Any], error: Any, words: str) -> None:
    with pytest.raises(error, match=words):
        call()
