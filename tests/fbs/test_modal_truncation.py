"""Truncated modes: residuals against the sum over the left-out modes, and their order."""

from __future__ import annotations

import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fbs import (
    AxisMismatchError,
    FbsError,
    Frf,
    Joint,
    SecondOrderSystem,
    couple,
    direct_frf,
    frequency_axis,
    modal_frf,
    real_modes,
    truncate,
)
from fbs.damped_modes import rayleigh_coefficients
from mbs_models.model.model_file import load
from tests.fbs.fbs_systems import hub_system, random_system, scaled_error
from validation.checks import metrics
from validation.routes import equations

seeds = st.integers(0, 2**32 - 1)


def with_full_mass(system: SecondOrderSystem, rng: np.random.Generator) -> Any:
    spread = rng.standard_normal(system.mass.shape)
    return replace(system, mass=system.mass + 0.1 * spread @ spread.T)


def random_case(seed: int, n: int, grounded: Any, full_mass: bool = False) -> Any:
    """A system, its modes and a random mask of those kept, rigid-body modes among them."""
    rng = np.random.default_rng(seed)
    system = random_system(rng, n, grounded=grounded)
    if full_mass:
        system = with_full_mass(system, rng)
    modes = real_modes(system)
    keep = rng.random(n) < rng.random()
    keep[: modes.n_rigid] = True
    return rng, system, modes, keep


def left_out_sum(modes: Any, keep: Any, power: Any) -> Any:
    """Sum over the left-out modes of phi phi^T / w^(2 power)."""
    shapes, omega = modes.shapes[:, ~keep], modes.angular_frequency[~keep]
    return (shapes / omega ** (2 * power)) @ shapes.T


def by_diagonal(matrix: Any, scale: Any) -> Any:
    """|matrix_ij| / sqrt(scale_ii scale_jj): the largest."""
    root = np.sqrt(np.diag(scale))
    return np.abs(matrix / np.outer(root, root)).max()


@settings(max_examples=60, deadline=None)
@given(seeds, st.integers(2, 14), st.booleans(), st.booleans())
def test_residuals_are_the_sum_over_the_left_out_modes(
    seed: int, n: int, grounded: Any, full_mass: Any
) -> None:
    _, system, modes, keep = random_case(seed, n, grounded, full_mass)
    truncated = truncate(system, keep, residual_order=3)
    assert len(truncated.residuals) == 4
    if keep.all():
        assert not any(residual.any() for residual in truncated.residuals)
        assert truncated.series_limit == np.inf
        return
    first = modes.natural_frequencies[~keep].min()
    assert truncated.series_limit == pytest.approx(first, rel=1e-9)
    every = np.ones(n, dtype=bool)
    every[: modes.n_rigid] = False
    for k, residual in enumerate(truncated.residuals):
        expected = left_out_sum(modes, keep, k + 1)
        # eps times the flexibility of all modes, which the projection starts from, and one factor
        # 1 / w_first^2 per order
        scale = left_out_sum(modes, ~every, 1) / (2 * np.pi * first) ** (2 * k)
        assert by_diagonal(residual - expected, scale) < 1e-11


def in_mass_metric(difference: Any, system: SecondOrderSystem, size: Any) -> Any:
    """|dR_ij| sqrt(m_i m_j) / size: against a mode of unit modal mass, wherever it moves."""
    return by_diagonal(difference, np.diag(1 / np.diag(system.mass))) / size


@pytest.mark.parametrize("grounded", [True, False])
@pytest.mark.parametrize("seed", range(5))
def test_the_hub_mode_alone_has_digits_of_its_own(seed: int, grounded: bool) -> None:
    system = hub_system(seed, grounded=grounded)
    modes = real_modes(system)
    keep = np.arange(22) < 21
    hub = modes.angular_frequency[-1]
    assert hub > 2 * np.pi * 7e6
    residuals = truncate(system, keep, 2, modes).residuals
    for k, residual in enumerate(residuals):
        error = residual - left_out_sum(modes, keep, k + 1)
        # a few n eps, n eps = 5e-15, though the kept modes' flexibility is (w_hub / w_first)^2
        # = 1e8 times larger
        assert in_mass_metric(error, system, 1 / hub ** (2 * k + 2)) < 1e-13
    # the two springs of the hub in parallel, but for its mass over a gear's, 1e-8
    assert residuals[0][0, 0] == pytest.approx(1 / (1e8 + 1e5), rel=1e-7)
    if grounded:  # a plain difference loses those eight digits
        kept = modes.truncated(keep)
        plain = np.linalg.inv(system.stiffness)
        plain -= (kept.shapes / kept.angular_frequency**2) @ kept.shapes.T
        error = plain - left_out_sum(modes, keep, 1)
        assert in_mass_metric(error, system, 1 / hub**2) > 1e-8


@settings(max_examples=20, deadline=None)
@given(seeds, st.integers(2, 10), st.booleans())
def test_inertia_relief_does_not_depend_on_where_the_system_is_held(
    seed: int, n: int, full_mass: Any
) -> None:
    # the textbook form: A = P K_held^-1 P^T, P = I - Phi_rigid Phi_rigid^T M, any DoF held
    rng = np.random.default_rng(seed)
    system = random_system(rng, n, grounded=False)
    if full_mass:
        system = with_full_mass(system, rng)
    rigid = real_modes(system).shapes[:, :1]
    project = np.eye(n) - rigid @ rigid.T @ system.mass
    residual = truncate(system, [0], residual_order=0).residuals[0]
    for held in range(n):
        free = np.delete(np.arange(n), held)
        flexibility = np.zeros((n, n))
        flexibility[np.ix_(free, free)] = np.linalg.inv(system.stiffness[np.ix_(free, free)])
        # eps cond(K_held)
        assert by_diagonal(project @ flexibility @ project.T - residual, residual) < 1e-9


@settings(max_examples=60, deadline=None)
@given(
    seeds,
    st.integers(2, 10),
    st.booleans(),
    st.sampled_from([0.0, 0.01, 0.2]),
    st.sampled_from([0.0, 1e-6, 1e-5]),
    st.sampled_from([0.0, 10.0]),
    st.integers(0, 3),
)
def test_the_error_of_every_order_mode_by_mode(
    seed: int, n: int, grounded: Any, eta: Any, beta: Any, alpha: Any, order: int
) -> None:
    # a geometric series cut after order p is wrong by (v / (mu w_r^2))^(p+1) of its sum
    rng, system, modes, keep = random_case(seed, n, grounded)
    damping = alpha * system.mass + beta * system.stiffness
    system = replace(system, damping=damping, loss_factor=eta)
    first = modes.natural_frequencies[~keep].min(initial=5000.0)  # beyond, the series diverges
    lines = np.sort(rng.uniform(0.01, 0.99, 5)) * first
    w = 2 * np.pi * lines
    mu, v = 1 + 1j * (eta + w * beta), w**2 - 1j * w * alpha
    try:
        exact = modal_frf(system, lines, modes=modes).values
    except FbsError:  # a random line on a pole
        return
    lam = modes.angular_frequency[~keep, None]
    wrong = (v / (mu * lam**2)) ** (order + 1) / (mu * lam**2 - v)
    shapes = modes.shapes[:, ~keep]
    expected = np.einsum("ir,jr,rk->kij", shapes, shapes, wrong)
    found = modal_frf(system, lines, modes=truncate(system, keep, order)).values
    # far above the first left-out mode the terms of the series are larger than H itself
    size = 1 + (w / lam.min(initial=np.inf)) ** (2 * order)
    # 1e-14 of the modes over the distance to the nearest pole
    near = np.abs(w[:, None] / modes.angular_frequency[modes.n_rigid :] - 1).min(axis=1)
    allowed = 1e-11 * size * (1 + 1e-3 / near)
    assert (scaled_error(exact - found - expected + exact, exact) < allowed).all()


@settings(max_examples=30, deadline=None)
@given(seeds, st.integers(3, 12), st.booleans())
def test_each_order_gains_the_square_of_the_frequency_ratio(
    seed: int, n: int, grounded: Any
) -> None:
    _, system, modes, _ = random_case(seed, n, grounded)
    keep = np.arange(n) < max(n // 2, modes.n_rigid)
    first = modes.natural_frequencies[~keep][0]
    line = [first / 8]
    exact = modal_frf(system, line, modes=modes).values
    errors = [
        np.abs(modal_frf(system, line, modes=truncate(system, keep, order, modes)).values - exact)
        .max(axis=(1, 2))
        .item()
        for order in (0, 1, 2)
    ]
    # the largest entry of a positive definite sum lies on its diagonal, where every term shrinks
    # by 1/64 or more; the floor is round-off
    floor = 1e-12 * np.abs(exact).max()
    assert errors[1] <= errors[0] / 64 * (1 + 1e-6) + floor
    assert errors[2] <= errors[1] / 64 * (1 + 1e-6) + floor


@pytest.mark.parametrize("order", [None, 0, 2])
def test_all_modes_kept_is_the_full_sum(order: int | None) -> None:
    system = replace(hub_system(4), loss_factor=0.01)
    lines = frequency_axis(10, 4000, 10)
    truncated = truncate(system, slice(None), order)
    found = modal_frf(system, lines, modes=truncated).values
    assert scaled_error(found, modal_frf(system, lines)).max() < 1e-14


def test_no_mode_kept_is_the_static_flexibility() -> None:
    system = replace(random_system(np.random.default_rng(1), 5), loss_factor=0.1)
    statics = truncate(system, [], residual_order=0)
    assert statics.kept.angular_frequency.size == 0
    found = modal_frf(system, [0.0, 7.0], modes=statics)
    expected = np.linalg.inv(system.stiffness) / (1 + 0.1j)
    assert scaled_error(found, np.array([expected, expected])).max() < 1e-12
    assert not modal_frf(system, [7.0], modes=truncate(system, [])).values.any()


def test_any_order_is_exact_at_zero_frequency() -> None:
    system = replace(random_system(np.random.default_rng(2), 6), loss_factor=0.01)
    for order in (0, 1):
        found = modal_frf(system, [0.0], modes=truncate(system, [0, 3], order))
        assert scaled_error(found, direct_frf(system, [0.0])).max() < 1e-12


def test_without_residuals_the_modes_are_merely_missing() -> None:
    system = random_system(np.random.default_rng(3), 6, beta=lambda rng: rng.uniform(1e-7, 1e-6))
    modes = real_modes(system)
    keep = [0, 1, 4]
    found = modal_frf(system, [50.0, 500.0], modes=truncate(system, keep))
    expected = modal_frf(system, [50.0, 500.0], modes=modes.truncated(keep))
    assert np.array_equal(found.values, expected.values)


def test_the_lowest_modes_are_enough() -> None:
    system = hub_system(5)
    modes = real_modes(system)
    lowest = truncate(system, slice(None), 2, modes.truncated(slice(0, 9)))
    whole = truncate(system, slice(0, 9), 2, modes)
    assert lowest.series_limit == whole.series_limit
    assert whole.series_limit == pytest.approx(modes.natural_frequencies[9], rel=1e-9)
    for one, other in zip(lowest.residuals, whole.residuals, strict=True):
        assert np.array_equal(one, other)


def test_slices_indices_and_masks_mean_the_same() -> None:
    system = random_system(np.random.default_rng(6), 6)
    mask = np.array([True, True, False, True, False, False])
    truncated = [truncate(system, keep, 0) for keep in (mask, [0, 1, 3], mask.tolist())]
    for other in truncated[1:]:
        assert np.array_equal(truncated[0].residuals[0], other.residuals[0])
    assert truncate(system, slice(0, 2)).kept.angular_frequency.size == 2


def test_quantities_derived_labels_and_parts() -> None:
    system = random_system(np.random.default_rng(7), 5, derived={"hub": ("x2", -1.5)})
    system = replace(system, loss_factor=0.02)
    truncated = truncate(system, slice(0, 2), residual_order=1)
    lines = [10.0, 300.0]
    whole = modal_frf(system, lines, quantity="mobility", modes=truncated)
    receptance = modal_frf(system, lines, modes=truncated)
    assert np.allclose(whole.values, receptance.to("mobility").values, rtol=1e-13)
    part = modal_frf(system, lines, ["hub"], ["x0", "hub"], "mobility", truncated)
    assert np.allclose(part.values, whole.select(["hub"], ["x0", "hub"]).values, rtol=1e-13)
    x2 = receptance.between("x2", "x2")
    assert np.allclose(receptance.between("hub", "hub"), 2.25 * x2, rtol=1e-13)


def test_truncated_modes_are_frozen_and_travel() -> None:
    truncated = truncate(random_system(np.random.default_rng(8), 4), slice(0, 2), 1)
    with pytest.raises(ValueError, match="read-only"):
        truncated.residuals[0][0, 0] = 1.0
    copy = pickle.loads(pickle.dumps(truncated))
    assert np.array_equal(copy.residuals[1], truncated.residuals[1])
    assert truncated.dofs == ("x0", "x1", "x2", "x3")


def test_what_has_no_residual_is_refused_by_name() -> None:
    free = random_system(np.random.default_rng(9), 5, grounded=False)
    with pytest.raises(FbsError, match=r"0 of 1 rigid-body modes are kept.*need all of them"):
        truncate(free, slice(1, None), residual_order=0)
    assert truncate(free, slice(1, None)).series_limit == 0.0
    with pytest.raises(FbsError, match="residual_order must be 0 or more, or None, got -1"):
        truncate(free, slice(0, 2), residual_order=-1)
    for keep in ([0, 7], [True, False]):
        with pytest.raises(FbsError, match="does not fit 5 modes"):
            truncate(free, keep)
    for keep in ([0, 1, 1], [0, -5]):
        with pytest.raises(FbsError, match="once each"):
            truncate(free, keep)
    other = real_modes(random_system(np.random.default_rng(9), 5, "y"))
    with pytest.raises(AxisMismatchError, match="another system"):
        truncate(free, slice(0, 2), modes=other)
    with pytest.raises(AxisMismatchError, match="another system"):
        modal_frf(
            free, [10.0], modes=truncate(random_system(np.random.default_rng(9), 5, "y"), [0])
        )
    general = random_system(np.random.default_rng(9), 5, beta=lambda rng: rng.uniform(0, 1e-5))
    with pytest.raises(FbsError, match=r"C = alpha M \+ beta K"):
        modal_frf(general, [10.0], modes=truncate(general, slice(0, 2), 0))


@settings(max_examples=40, deadline=None)
@given(seeds, st.sampled_from([0.0, 1e-9, 1e-6]), st.sampled_from([0.0, 1.0, 100.0]))
def test_rayleigh_coefficients_are_found_again(seed: int, beta: Any, alpha: Any) -> None:
    system = hub_system(seed, n=8)
    damping = alpha * system.mass + beta * system.stiffness
    found = rayleigh_coefficients(replace(system, damping=damping))
    assert found is not None
    # each to round-off of what the other contributes to the same entries of C
    assert found[1] == pytest.approx(beta, rel=1e-9, abs=1e-9 * alpha / 1e6)
    assert found[0] == pytest.approx(alpha, rel=1e-9, abs=1e-9 * beta * 1e9)


def test_other_damping_has_no_rayleigh_coefficients() -> None:
    system = random_system(np.random.default_rng(10), 4, beta=lambda rng: rng.uniform(0, 1e-5))
    assert rayleigh_coefficients(system) is None
    one_damper = np.zeros((4, 4))
    one_damper[0, 0] = 1.0
    assert rayleigh_coefficients(replace(system, damping=one_damper)) is None
    skew = np.zeros((4, 4))
    skew[0, 1], skew[1, 0] = 1.0, -1.0
    assert rayleigh_coefficients(replace(system, damping=skew)) is None
    single = SecondOrderSystem([[2.0]], [[3.0]], [[5.0]], ("x",))
    found = rayleigh_coefficients(single)
    assert found is not None
    alpha, beta = found
    assert alpha * 2.0 + beta * 5.0 == pytest.approx(3.0, rel=1e-14)


HUB = ("coupling.w", "coupling.w")
SUN_W = ("planetary.sun.w", "planetary.sun.w")
SUN_U = ("planetary.sun.u", "planetary.sun.u")
PINION = ("reducer.pinion.w", "reducer.pinion.w")
THROUGH = ("planetary.sun.w", "reducer.pinion.w")
FIVE = (HUB, SUN_W, SUN_U, PINION, THROUGH)
LIMIT = 4000  # Hz


class PlanetaryStage:
    """The the paper's planetary stage cut at 4 kHz and coupled to the whole reducer.

    Preset "paper": Lin & Parker's gears, k_sw = 1e5 N/m, each stage with half the hub
    (2.24e-8 kg), loss factor 1 % in both.
    """

    def __init__(self) -> None:
        drivetrain = load("paper")
        self.stage, reducer = (
            replace(equations.stage_system(drivetrain, name), loss_factor=0.01)
            for name in ("planetary", "reducer")
        )
        self.axis = frequency_axis(1, LIMIT, 1)
        self.reducer = modal_frf(reducer, self.axis)
        self.modes = real_modes(self.stage)
        self.above = self.modes.natural_frequencies > LIMIT
        self.hub = np.arange(self.above.size) == self.above.size - 1
        self.exact = self.coupled(self.modes)
        self.known: dict[Any, Any] = {}

    def coupled(self, modes: Any) -> Any:
        planetary = modal_frf(self.stage, self.axis, modes=modes)
        joint = Joint(("reducer", "coupling.w"), ("planetary", "coupling.w"))
        return couple({"reducer": self.reducer, "planetary": planetary}, [joint]).frf

    def cut(self, order: Any = None, hub_kept: bool = False) -> Any:
        if (order, hub_kept) not in self.known:
            keep = ~self.above | (self.hub & hub_kept)
            modes = truncate(self.stage, keep, order, self.modes)
            self.known[order, hub_kept] = self.coupled(modes)
        return self.known[order, hub_kept]

    def worst_db(self, frf: Frf, pair: Any) -> Any:
        difference = metrics.decibel_difference(self.exact.between(*pair), frf.between(*pair))
        return np.abs(difference).max()

    def scaled(self, frf: Frf) -> Any:
        return metrics.scaled_error(self.exact.values, frf.values).max(axis=(1, 2))


@pytest.fixture(scope="module")
def planetary() -> Any:
    return PlanetaryStage()


def test_nine_modes_lie_above_the_band(planetary: Any) -> None:
    assert planetary.above.sum() == 9
    assert planetary.modes.natural_frequencies[planetary.above][0] == pytest.approx(5963.8, abs=0.1)
    hub_shape = planetary.modes.shapes[:, planetary.hub]
    assert np.argmax(np.abs(hub_shape)) == planetary.stage.dofs.index("coupling.w")


# measured to two digits by an independent computation; half a unit of the last one
@pytest.mark.parametrize(
    ("hub_kept", "pair", "expected", "unit"),
    [
        (False, HUB, 43, 1),
        (False, SUN_W, 35, 1),
        (False, THROUGH, 94, 1),
        (True, HUB, 0.01, 0.01),
        (True, SUN_W, 10, 1),
        (True, SUN_U, 5, 1),
    ],
)
def test_leaving_modes_out_without_a_residual(
    planetary: Any, hub_kept: bool, pair: Any, expected: float, unit: float
) -> None:
    frf = planetary.cut(hub_kept=hub_kept)
    assert planetary.worst_db(frf, pair) == pytest.approx(expected, abs=unit / 2)
    for each in FIVE:  # the usual measure sees none of it
        assert metrics.frac(planetary.exact.between(*each), frf.between(*each)) > 0.99


@pytest.mark.parametrize(("order", "allowed"), [(0, 0.5), (1, 0.1), (2, 0.02)])
@pytest.mark.parametrize("hub_kept", [False, True])
def test_residuals_bring_the_five_frfs_back(
    planetary: Any, order: int, allowed: float, hub_kept: bool
) -> None:
    frf = planetary.cut(order, hub_kept)
    assert max(planetary.worst_db(frf, pair) for pair in FIVE) <= allowed


@pytest.mark.slow
def test_all_frfs_gain_the_square_of_the_frequency_ratio_with_every_order(planetary: Any) -> None:
    # deep antiresonances of other FRFs stay tens of dB wrong: their exact value vanishes, while
    # the error against what the two DoFs do at that line falls with every order
    first = planetary.modes.natural_frequencies[planetary.above][0]
    scaled = [planetary.scaled(planetary.cut(order)) for order in (0, 1, 2, 3, 4)]
    assert all(error.argmax() == LIMIT - 1 for error in scaled)  # the band's edge
    edge = np.array([error[-1] for error in scaled])
    gain = edge[1:] / edge[:-1] / (LIMIT / first) ** 2
    # from below: the modes above the first one die out faster and leave it alone in the end
    assert (gain < 1).all()
    assert (gain > 0.85).all()
    assert (np.diff(gain) > 0).all()
