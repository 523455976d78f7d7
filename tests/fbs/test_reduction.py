"""Reductions: exact where theory says so, and bounded from above where Ritz says so."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fbs import (
    FbsError,
    Frf,
    Joint,
    SecondOrderSystem,
    couple,
    direct_frf,
    modal_frf,
    real_modes,
    truncate,
)
from fbs._kernels.checks import ComplexArray, FloatArray
from fbs.reduction import (
    Reduction,
    craig_bampton,
    dual_craig_bampton,
    dynamic,
    guyan,
    irs,
    macneal,
    projected,
    rubin,
    serep,
)

Method = Callable[[SecondOrderSystem], Reduction]

N = 12
FREE_METHODS = {"rubin": rubin, "macneal": macneal, "dual": dual_craig_bampton}


def rod(
    n: int = N, *, held: bool = False, beta: float = 0.0, loss: float = 0.0
) -> SecondOrderSystem:
    """Masses of 1 to 2 kg between springs of 1e6 to 2e6 N/m; held at the first by 3e5 N/m."""
    mass = np.diag(1.0 + np.arange(n) / n)
    stiffness = np.zeros((n, n))
    for k in range(n - 1):
        spring = 1e6 * (1.0 + k / n)
        stiffness[k : k + 2, k : k + 2] += spring * np.array([[1.0, -1.0], [-1.0, 1.0]])
    if held:
        stiffness[0, 0] += 3e5
    labels = tuple(f"x{k}" for k in range(n))
    return SecondOrderSystem(mass, beta * stiffness, stiffness, labels, {}, loss)


def frequencies(system: SecondOrderSystem) -> FloatArray:
    return real_modes(system).natural_frequencies


LINES = np.linspace(5.0, 120.0, 60)  # the rod's modes: 0, 47, 90, 130 … 450 Hz
ENDS = ("x0", "x11")


@pytest.mark.parametrize(
    "reduce",
    [
        lambda system: guyan(system, ENDS),
        lambda system: dynamic(system, ENDS, 60.0),
        lambda system: irs(system, ENDS),
        lambda system: irs(system, ("x0", "x4", "x11"), 5),
        lambda system: serep(system, ("x0", "x4", "x11")),
        lambda system: craig_bampton(system, ENDS, 3),
        lambda system: rubin(system, ENDS, 4),
    ],
)  # fmt: skip
def test_ritz_frequencies_lie_above(reduce: Method) -> None:
    """Rayleigh's quotient over a part of space has its k-th stationary value above the whole's."""
    whole = frequencies(rod(held=True))
    reduced = frequencies(reduce(rod(held=True)).system)
    assert (reduced >= whole[: len(reduced)] * (1.0 - 1e-9)).all()


@pytest.mark.parametrize(
    "reduce",
    [
        lambda system: craig_bampton(system, ENDS, N - 2),
        lambda system: rubin(system, ENDS, N - 2),
        lambda system: serep(system, system.dofs),
        lambda system: guyan(system, system.dofs),
    ],
)
def test_with_all_modes_it_is_exact(reduce: Method) -> None:
    """As many coordinates as DoFs span the whole space: round-off apart, nothing is reduced."""
    system = rod(beta=1e-6)
    exact = direct_frf(system, LINES).values
    found = reduce(system).frf(LINES).values
    assert np.abs(found - exact).max() < 1e-9 * np.abs(exact).max()


def test_guyan_is_exact_at_rest_and_dynamic_at_its_frequency() -> None:
    """The condensed DoFs carry no force: there −K_ss⁻¹ K_sm is no assumption."""
    system = rod(held=True)
    for reduction, line in ((guyan(system, ENDS), 1e-3), (dynamic(system, ENDS, 70.0), 70.0)):
        exact = direct_frf(system, [line], ENDS, ENDS).values
        found = reduction.frf([line], ENDS, ENDS).values
        np.testing.assert_allclose(found, exact, rtol=1e-9)


def test_irs_converges_to_serep() -> None:
    """Friswell, Garvey & Penny (1995): its modes become the lowest of the whole."""
    masters = ("x0", "x4", "x8", "x11")
    whole = frequencies(rod(held=True))[:4]
    errors = [
        np.abs(frequencies(irs(rod(held=True), masters, n).system) / whole - 1.0).max()
        for n in (1, 5, 40)
    ]
    assert errors[1] < errors[0] / 5.0
    assert errors[2] < 1e-9
    np.testing.assert_allclose(frequencies(serep(rod(held=True), masters).system), whole, rtol=1e-9)


@pytest.mark.parametrize("loss", [0.0, 0.02])
@pytest.mark.parametrize(("name", "order"), [("macneal", 0), ("dual", 1)])
def test_residual_methods_are_truncated_series(name: str, order: int, loss: float) -> None:
    """MacNeal is Σ φφᵀ/(ω_r² − ω²) + R_0 at the interface, dual Craig–Bampton + ω² R_1."""
    system = rod(loss=loss)
    reduction = FREE_METHODS[name](system, ENDS, 4)
    series = modal_frf(system, LINES, ENDS, ENDS, modes=truncate(system, slice(4), order))
    found = reduction.frf(LINES, ENDS, ENDS)
    np.testing.assert_allclose(found.values, series.values, rtol=1e-8)


def test_rubin_sums_the_series() -> None:
    """Σ φφᵀ/(ω_r² − ω²) + R_0 (R_0 − ω² R_1)⁻¹ R_0 at the interface."""
    system = rod()
    cut = truncate(system, slice(4), 1)
    places = [system.dofs.index(label) for label in ENDS]
    r_0, r_1 = (matrix[np.ix_(places, places)] for matrix in cut.residuals)
    kept = modal_frf(system, LINES, ENDS, ENDS, modes=truncate(system, slice(4))).values
    square = (2.0 * np.pi * LINES)[:, None, None] ** 2
    expected = kept + r_0 @ np.linalg.inv(r_0 - square * r_1) @ r_0
    np.testing.assert_allclose(
        rubin(system, ENDS, 4).frf(LINES, ENDS, ENDS).values, expected, rtol=1e-8
    )


Joined = Callable[[SecondOrderSystem, tuple[str, ...], int], Reduction]


def joined(part: Callable[[SecondOrderSystem], Frf]) -> ComplexArray:
    """Two damped rods in a row, made of their FRFs at the ends: far end ← near end."""
    left = part(rod(beta=2e-5)).renamed({"x11": "joint"})
    right = part(rod(beta=2e-5)).renamed({"x0": "joint", "x11": "far"})
    at = [Joint(("left", "joint"), ("right", "joint"))]
    return couple({"left": left, "right": right}, at).frf.between("far", "x0")


@pytest.mark.parametrize("method", [craig_bampton, rubin, macneal, dual_craig_bampton])
def test_reduced_parts_are_coupled_like_any(method: Joined) -> None:
    """Better by more than ten times with eight modes (to 249 Hz) than with four, up to 120 Hz."""
    whole = joined(lambda part: direct_frf(part, LINES, ENDS, ENDS))

    def error(count: int) -> float:
        found = joined(lambda part: method(part, ENDS, count).frf(LINES, ENDS, ENDS))
        return float(np.abs(found - whole).max())

    four, eight = error(4), error(8)
    assert eight < four / 10.0
    assert eight < 0.01 * np.abs(whole).max()


@given(st.integers(2, 8), st.integers(0, 2**32 - 1))
def test_craig_bampton_on_random_systems(count: int, seed: int) -> None:
    """Static response between interface DoFs is kept whatever the modes: exact at 0 Hz."""
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((10, 10))
    system = SecondOrderSystem(
        np.diag(rng.uniform(0.1, 10.0, 10)), np.zeros((10, 10)), root @ root.T + np.eye(10),
        tuple("abcdefghij"),
    )  # fmt: skip
    found = craig_bampton(system, ("a", "b"), count).frf([0.0], ("a", "b"), ("a", "b")).values
    exact = direct_frf(system, [0.0], ("a", "b"), ("a", "b")).values
    np.testing.assert_allclose(found, exact, rtol=1e-8, atol=1e-10 * np.abs(exact).max())


RITZ: dict[str, Callable[[SecondOrderSystem, int], Reduction]] = {
    "guyan": lambda system, size: guyan(system, system.dofs[:size]),
    "dynamic": lambda system, size: dynamic(system, system.dofs[:size], 0.1),
    "irs": lambda system, size: irs(system, system.dofs[:size]),
    "craig_bampton": lambda system, size: craig_bampton(system, ("a", "b"), size - 2),
    "rubin": lambda system, size: rubin(system, ("a", "b"), size - 2),
    "projected": lambda system, size: projected(system, real_modes(system).shapes[:, :size]),
}


@given(st.sampled_from(list(RITZ)), st.integers(3, 10), st.integers(0, 2**32 - 1))
def test_ritz_on_random_systems(name: str, size: int, seed: int) -> None:
    """Frequencies bound the whole's from above; with all coordinates they are the whole's."""
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((10, 10))
    system = SecondOrderSystem(
        np.diag(rng.uniform(0.1, 10.0, 10)), np.zeros((10, 10)), root @ root.T + np.eye(10),
        tuple("abcdefghij"),
    )  # fmt: skip
    whole, found = frequencies(system), frequencies(RITZ[name](system, size).system)
    assert (found >= whole[:size] * (1.0 - 1e-9)).all()
    if size == 10:
        np.testing.assert_allclose(found, whole, rtol=1e-7)  # the root of eps times conditions


def test_motion_is_expanded() -> None:
    system = rod(held=True)
    reduction = serep(system, ENDS)
    shapes = real_modes(reduction.system).shapes
    mode = real_modes(system).shapes[:, :2]
    mac = np.abs(np.einsum("im,ij,jm->m", reduction.expanded(shapes), system.mass, mode))
    np.testing.assert_allclose(mac, 1.0, rtol=1e-9)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: guyan(rod(), []), "no DoF stays"),
        (lambda: guyan(rod(), ["nowhere"]), "'nowhere'"),
        (lambda: dynamic(rod(held=True), ENDS, -1.0), "frequency must be at least 0"),
        (lambda: irs(rod(held=True), ENDS, 0), "iterations = 0"),
        (lambda: serep(rod(held=True), ENDS, real_modes(rod(held=True))), "12 modes for 2 masters"),
        (lambda: craig_bampton(rod(), ENDS, 11), "count = 11: must be between 0 and 10"),
        (lambda: rubin(rod(), ENDS, 0), "1 rigid-body modes"),
        (lambda: rubin(rod(), ENDS, 12), "keep fewer modes"),
        (lambda: guyan(two_rods(), ["x0"]), "free to move while the others are held"),
    ],
)
def test_what_cannot_be_reduced(call: Callable[[], Reduction], words: str) -> None:
    with pytest.raises(FbsError, match=words):
        call()


def two_rods() -> SecondOrderSystem:
    """Two that nothing joins: with one held the other still moves freely."""
    one = rod(4)
    zero = np.zeros((4, 4))
    mass, stiffness = (
        np.block([[matrix, zero], [zero, matrix]]) for matrix in (one.mass, one.stiffness)
    )
    return SecondOrderSystem(mass, 0.0 * mass, stiffness, tuple(f"x{k}" for k in range(8)))
