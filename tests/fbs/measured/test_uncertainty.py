"""Errors of a measured part in an assembly: closed form, dense matrices, repetitions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import f as f_distribution

from fbs import FbsError, Frf, Joint, UnknownDofError, couple, direct_frf, frequency_axis
from fbs.measured.uncertainty import Scatter, coupled_uncertainty, sampled
from tests.fbs.fbs_systems import random_system

AXIS = frequency_axis(5, 60, 5)
JOINTS = (
    Joint(("a", "a.x2"), ("b", "b.x0")),
    Joint(("a", "a.x1"), ("b", "b.x3"), stiffness=2e5, damping=3.0),
    Joint(("a", "a.x2"), ("b", "b.x1"), ratio=-0.7),
)


def parts() -> dict[str, Frf]:
    rng = np.random.default_rng(7)
    return {
        name: direct_frf(random_system(rng, n, f"{name}.x", beta=lambda _: 1e-4), AXIS)
        for name, n in (("a", 4), ("b", 5))
    }


def some_errors(frf: Frf) -> Scatter:
    rng = np.random.default_rng(8)
    size = np.abs(frf.values) ** 2
    variance = size * rng.uniform(1e-6, 1e-4, size.shape)
    turn = np.exp(2j * np.pi * rng.uniform(size=size.shape))
    return Scatter(variance, variance * turn * rng.uniform(0, 0.9, size.shape))


def sensitivities(part: str) -> np.ndarray:
    """dY_c,ij / dA_kl by central differences, which are exact but for third orders."""
    substructures = parts()
    frf = substructures[part]
    n, m = frf.values.shape[1:]
    found = []
    for k in range(n):
        for j in range(m):
            step = np.zeros_like(frf.values)
            step[:, k, j] = 1e-5 * frf.values[:, k, j]
            moved = [replace(frf, values=frf.values + sign * step) for sign in (1, -1)]
            ends = [couple(substructures | {part: one}, JOINTS).frf.values for one in moved]
            found.append((ends[0] - ends[1]) / (2 * step[:, k, j])[:, None, None])
    shape = (n, m, *found[0].shape)
    return np.array(found).reshape(shape).transpose(2, 3, 4, 0, 1)  # f, i, j, k, l


@pytest.mark.parametrize("part", ["a", "b"])
def test_first_order_is_the_derivative(part: str) -> None:
    substructures = parts()
    errors = some_errors(substructures[part])
    assert errors.pseudo is not None
    found = coupled_uncertainty(substructures, JOINTS, part, errors)
    exact = couple(substructures, JOINTS).frf
    np.testing.assert_array_equal(found.frf.values, exact.values)
    gains = sensitivities(part)
    variance = np.einsum("fijkl,fkl->fij", np.abs(gains) ** 2, errors.variance)
    np.testing.assert_allclose(found.variance, variance, rtol=1e-5)
    pseudo = np.einsum("fijkl,fkl->fij", gains**2, errors.pseudo)
    for response, excitation in (("a.x0", "b.x4"), ("a.x2", "a.x2"), ("b.x3", "a.x3")):
        i, j = exact.responses.index(response), exact.excitations.index(excitation)
        h = exact.values[:, i, j]
        along, across = found.deviations(response, excitation)
        # d ln H = dH / H: its real part is that of ln |H|, its imaginary one the phase
        turned, size = (pseudo[:, i, j] / h**2).real, variance[:, i, j] / np.abs(h) ** 2
        np.testing.assert_allclose(along**2, (size + turned) / 2, rtol=1e-4, atol=1e-9)
        np.testing.assert_allclose(across**2, (size - turned) / 2, rtol=1e-4, atol=1e-9)
        shares = found.shares(response, excitation)
        np.testing.assert_allclose(shares.sum(axis=(1, 2)), 1.0, rtol=1e-12)
        expected = np.abs(gains[:, i, j]) ** 2 * errors.variance
        share = expected / variance[:, i, j, None, None]
        np.testing.assert_allclose(shares, share, rtol=1e-4, atol=1e-9)


def test_a_choice_of_responses_and_excitations() -> None:
    substructures = parts()
    errors = some_errors(substructures["b"])
    every = coupled_uncertainty(substructures, JOINTS, "b", errors)
    rows, columns = ["b.x4", "a.x0", "b.x0"], ["a.x3", "b.x2"]
    few = coupled_uncertainty(substructures, JOINTS, "b", errors, rows, columns)
    pick = np.ix_(
        range(AXIS.size),
        [every.frf.responses.index(r) for r in rows],
        [every.frf.excitations.index(c) for c in columns],
    )
    np.testing.assert_allclose(few.variance, every.variance[pick], rtol=1e-12)


def test_without_joints_errors_stay_where_they_are() -> None:
    substructures = parts()
    errors = some_errors(substructures["a"])
    found = coupled_uncertainty(substructures, (), "a", errors)
    np.testing.assert_allclose(found.variance[:, :4, :4], errors.variance, rtol=1e-14)
    assert not found.variance[:, 4:].any()


def test_scatter_of_repeats_of_coherence_and_relative() -> None:
    frf = parts()["a"]
    rng = np.random.default_rng(9)
    scatter = Scatter.relative(frf, 0.02, 0.03)
    np.testing.assert_allclose(scatter.variance, np.abs(frf.values) ** 2 * (4e-4 + 9e-4))
    repeats = [
        replace(
            frf,
            values=frf.values
            * (1 + 0.02 * rng.standard_normal(frf.values.shape))
            * np.exp(0.03j * rng.standard_normal(frf.values.shape)),
        )
        for _ in range(200)
    ]
    measured = Scatter.of_repeats(repeats)
    ratio = 200 * measured.variance / scatter.variance
    assert abs(ratio.mean() - 1) < 4 / np.sqrt(ratio.size * 200)  # χ² of 2 · 199 each, four sigma
    # a mean of n averages with coherence γ² scatters by (1 − γ²) / (γ² n): 0.1 / 0.9 / 10
    coherent = Scatter.of_coherence(frf, np.full(frf.values.shape, 0.9), 10)
    np.testing.assert_allclose(coherent.variance, np.abs(frf.values) ** 2 / 90, rtol=1e-12)
    refused: tuple[Callable[[], object], ...] = (
        lambda: Scatter.of_repeats(repeats[:1]),
        lambda: Scatter.of_coherence(frf, np.zeros(frf.values.shape), 3),
        lambda: Scatter.of_coherence(frf, np.ones(frf.values.shape), 0),
        lambda: Scatter.relative(frf, -0.1),
    )
    for wrong in refused:
        with pytest.raises(FbsError):
            wrong()


def test_the_radius_is_that_of_f() -> None:
    substructures = parts()
    coherence = np.full(substructures["a"].values.shape, 0.9)
    errors = Scatter.of_coherence(substructures["a"], coherence, 5)
    found = coupled_uncertainty(substructures, JOINTS, "a", errors)
    np.testing.assert_allclose(
        found.radius(0.9) ** 2, f_distribution.ppf(0.9, 2, 10) * found.variance, rtol=1e-12
    )
    known = coupled_uncertainty(substructures, JOINTS, "a", Scatter(errors.variance))
    np.testing.assert_allclose(
        known.radius(0.9) ** 2, f_distribution.ppf(0.9, 2, 1e9) * known.variance, rtol=1e-7
    )
    with pytest.raises(FbsError, match="the level is 1"):
        known.radius(1)


def test_what_does_not_fit_is_refused() -> None:
    substructures = parts()
    errors = some_errors(substructures["a"])
    with pytest.raises(UnknownDofError, match="no substructure 'c'"):
        coupled_uncertainty(substructures, JOINTS, "c", errors)
    with pytest.raises(FbsError, match="the errors have shape"):
        coupled_uncertainty(substructures, JOINTS, "b", errors)


def test_repetitions_fall_into_the_bands() -> None:
    """±2 % and ±2° of a part: 95 % inside, of 400 repetitions within 4 √(0.05 · 0.95 / 400)."""
    substructures = parts()
    errors = Scatter.relative(substructures["b"], 0.02, np.deg2rad(2))
    found = coupled_uncertainty(substructures, JOINTS, "b", errors)
    response, excitation = "a.x0", "b.x2"
    i, j = found.frf.responses.index(response), found.frf.excitations.index(excitation)
    along, across = found.deviations(response, excitation)
    h = found.frf.values[:, i, j]
    ratios = np.array(
        [
            frf.values[:, 0, 0] / h
            for frf in sampled(
                substructures, JOINTS, {"b": errors}, 400, 1, [response], [excitation]
            )
        ]
    )
    scatter = 4 * np.sqrt(0.05 * 0.95 / 400)
    for deviation, errors_found in (
        (along, np.log(np.abs(ratios))),
        (across, np.angle(ratios)),
    ):
        inside = (np.abs(errors_found) < 1.96 * deviation).mean(axis=0)
        assert np.abs(inside - 0.95).max() < scatter + 0.01  # what first order leaves out
