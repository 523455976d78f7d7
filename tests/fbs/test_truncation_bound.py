"""Bounds of truncated parts, alone and coupled, against FRFs by other ways."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
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
    QuantityMismatchError,
    Reason,
    SecondOrderSystem,
    Tolerance,
    TruncatedPart,
    UnknownDofError,
    bounded_frf,
    couple,
    couple_chain,
    direct_frf,
    frequency_axis,
    modal_frf,
    real_modes,
    smallest_basis,
    truncate,
)
from fbs.coupled_bound import decibels
from fbs.truncation_bound import DEGREE, enclosed
from tests.benchmarks.truncation_bound import TOLERANCE, basis_trial
from tests.fbs.fbs_systems import hub_system, long_double_frf, random_system
from tests.random_drivetrains import Trial

OSCILLATORS = SecondOrderSystem(
    np.diag([1.0, 1.0]), np.zeros((2, 2)), np.diag([1e4, 1e6]), ("slow", "fast")
)


@settings(max_examples=200, deadline=None)
@given(
    st.floats(0.0, 0.3), st.just(0.0) | st.floats(1e-6, 3.0), st.just(0.0) | st.floats(1e-6, 0.5),
    st.floats(0.0, 1.0), st.floats(0.0, 1.0),
)  # fmt: skip
def test_series_and_disc_enclose_the_function(
    loss: Any, reach: Any, tilt: Any, share: Any, other: Any
) -> None:
    mu, v = np.array([1 + 1j * loss]), np.array([reach - 1j * tilt * reach])
    found = enclosed(mu, v, 1.0)
    t = np.unique([0.0, share, other, share * other, 1.0])
    if not np.isfinite(found.radius[0]):
        assert loss == tilt * reach == 0  # undamped, at or above the first left-out mode
        assert reach >= 1
        return
    exact = 1 / (mu - v * t)
    polynomial = np.polynomial.chebyshev.chebval(2 * t - 1, found.coefficients[:, 0])
    # round-off of a sum of DEGREE + 1 terms, each as large as g at most
    slack = 16 * (DEGREE + 1) * np.finfo(float).eps * found.largest
    assert (np.abs(exact - polynomial) <= found.radius + slack).all()
    assert (np.abs(exact) <= found.largest * (1 + 1e-12)).all()


@pytest.mark.parametrize("reach", [1 + 1e-9, 1.7, 1e3])
def test_undamped_from_the_first_left_out_mode_on_nothing_is_enclosed(reach: float) -> None:
    found = enclosed(np.array([1.0 + 0j]), np.array([reach * 1.1e-7 + 0j]), 1 / 1.1e-7)
    assert np.isinf(found.radius[0])  # exactly: a pole may lie at the line


def test_one_left_out_mode_is_known_by_statics() -> None:
    lines = np.array([0.0, 5.0, 50.0, 120.0])
    for order in (None, 0, 1):
        part = TruncatedPart.of(OSCILLATORS, [0], order)
        found = bounded_frf({"part": part}, (), lines, ["fast", "slow"], ["fast"])
        omega, power = 2 * np.pi * lines, 0 if order is None else order + 1
        missing = (omega**2 / 1e6) ** power / (1e6 - omega**2)
        # Chebyshev's remainder: tau <= 0.22 at 120 Hz of 159 Hz, of which 0.22^5 is left
        assert found.truncation("fast", "fast") == pytest.approx(missing, rel=3e-3)
        assert (found.truncation("fast", "fast") >= missing * (1 - 1e-14)).all()
        assert not found.truncation("slow", "fast").any()
        assert not found.reason.any()


def test_no_bound_from_the_first_left_out_mode_on_undamped() -> None:
    first = 1e3 / (2 * np.pi)
    lines = np.array([0.5, 0.99, 1.0, 1.5]) * first
    part = TruncatedPart.of(OSCILLATORS, [0], 0)
    found = bounded_frf({"part": part}, (), lines, ["fast"], ["fast"])
    assert [Reason(r).name for r in found.reason] == ["BOUNDED", "BOUNDED", "PART", "PART"]
    assert np.isinf(found.between("fast", "fast")[2:]).all()
    # what neither moves at the ports nor is asked for limits nothing
    assert not bounded_frf({"part": part}, (), lines, ["slow"], ["slow"]).reason.any()
    silent = bounded_frf(
        {"part": OSCILLATORS}, (), [first], ["slow"], ["slow"]
    )  # kept, on its pole
    assert np.isfinite(silent.bound).all()
    damped = TruncatedPart.of(replace(OSCILLATORS, loss_factor=0.02), [0], 0)
    found = bounded_frf({"part": damped}, (), lines, ["fast"], ["fast"])
    exact = direct_frf(damped.system, lines, ["fast"], ["fast"])
    error = np.abs(exact.values - found.frf.values)
    assert np.isfinite(found.bound).all()
    assert (error <= found.bound).all()


def check_trial(seed: int, lines: Any, dofs: int = 12) -> Any:
    trial = Trial.of(np.random.default_rng(seed), lines, dofs)
    found = trial.bounded()
    error = np.abs(found.frf.values - trial.exact).astype(float)
    assert (error <= found.bound).all(), f"seed {seed}"
    return found, error


@pytest.mark.parametrize("seed", range(8))
def test_no_random_drivetrain_breaks_its_bound(seed: int) -> None:
    check_trial(seed, 40, 6)


@pytest.mark.parametrize("seed", [101_886, 102_264, 102_556])
def test_a_truncated_frf_that_is_all_error_keeps_its_last_digit(seed: int) -> None:
    # |H~| 1e4 to 1e6 times |H|: what is known of the error is as large, and rounded as H~ is
    check_trial(seed, 200)


@pytest.mark.slow
def test_two_hundred_random_drivetrains_keep_their_bounds_and_use_them() -> None:
    ratios = []
    for seed in range(20_000, 20_200):
        found, error = check_trial(seed, 200)
        labels = found.frf.responses
        floor = np.array([[found.round_off(i, j) for j in labels] for i in labels])
        told = (found.reason == 0)[:, None, None] & (error > floor.transpose(2, 0, 1))
        ratios.append(found.bound[told] / error[told])
    ratio = np.concatenate(ratios)
    assert np.median(ratio) < 1.01
    assert np.percentile(ratio, 95) < 50


def test_a_chain_and_other_frfs_are_bounded_too() -> None:
    trial = Trial.of(np.random.default_rng(5), 40, stages=4, damping="hysteretic")
    found = trial.bounded()
    frfs = {
        name: modal_frf(p.system, trial.axis, modes=replace(p.modes, series_limit=np.inf))
        for name, p in trial.truncated.items()
    }
    for other in (
        couple_chain(frfs, trial.parts.joints, trial.axis, trial.labels, trial.labels).frf,
        couple(frfs, trial.parts.joints, trial.labels, trial.labels).frf,
        found.frf * 1.01,
    ):
        error = np.abs(other.values - trial.exact).astype(float)
        assert (error <= found.of(other)).all()


def two_parts(order: int | None = 0, loss: float = 0.01, kept: int = 6) -> Any:
    rng = np.random.default_rng(11)
    one, two = (replace(random_system(rng, 9, prefix), loss_factor=loss) for prefix in "ab")
    parts = {n: TruncatedPart.of(s, slice(0, kept), order) for n, s in (("a", one), ("b", two))}
    return parts, [Joint(("a", "a8"), ("b", "b0"), 1e8, 10.0), Joint(("a", "a7"), ("b", "b1"))]


def test_a_given_frf_is_taken_as_it_is() -> None:
    parts, joints = two_parts()
    lines, ports = frequency_axis(50, 2000, 50), ["a0", "b4"]
    given = direct_frf(parts["b"].system, lines)
    mixed = bounded_frf({"a": parts["a"], "b": given}, joints, lines, ports, ports)
    whole = couple({"a": direct_frf(parts["a"].system, lines), "b": given}, joints, ports, ports)
    assert (np.abs(mixed.frf.values - whole.frf.values) <= mixed.bound).all()
    complete = bounded_frf({"a": parts["a"].system, "b": given}, joints, lines, ports, ports)
    assert (complete.truncation("a0", "b4") <= complete.round_off("a0", "b4")).all()
    with pytest.raises(QuantityMismatchError, match="part 'b' is mobility"):
        bounded_frf({"a": parts["a"], "b": given.to("mobility")}, joints, lines, ports, ports)


def test_the_bound_does_not_depend_on_the_units_of_a_dof() -> None:
    parts, joints = two_parts()
    lines, scale = frequency_axis(50, 2000, 50), 1e3
    found = bounded_frf(parts, joints, lines, ["a0"], ["b4"])
    system = parts["b"].system
    units = np.diag([scale, *np.ones(8)])
    scaled = SecondOrderSystem(
        units @ system.mass @ units, system.damping, units @ system.stiffness @ units,
        system.dofs, {}, system.loss_factor,
    )  # fmt: skip
    others = {"a": parts["a"], "b": TruncatedPart.of(scaled, slice(0, 6), 0)}
    ties = [replace(joints[0], ratio=scale), joints[1]]
    again = bounded_frf(others, ties, lines, ["a0"], ["b4"])
    assert again.truncation("a0", "b4") == pytest.approx(found.truncation("a0", "b4"), rel=1e-6)
    assert again.kernel == pytest.approx(found.kernel, rel=1e-6)


def test_more_residuals_and_more_modes_leave_less() -> None:
    lines = frequency_axis(50, 1500, 50)
    worst = [
        bounded_frf(two_parts(order)[0], two_parts()[1], lines, ["a0"], ["b4"])
        .truncation("a0", "b4")
        .max()
        for order in (None, 0, 1, 2)
    ]
    assert all(after < before / 2 for before, after in pairwise(worst))
    modes = [
        bounded_frf(two_parts(kept=k)[0], two_parts()[1], lines, ["a0"], ["b4"])
        .truncation("a0", "b4")
        .max()
        for k in (6, 7, 8, 9)
    ]
    assert modes[-1] < 1e-13 * modes[0]  # complete: the FRF's own round-off
    assert all(after < before for before, after in pairwise(modes))


def test_where_left_out_modes_may_shift_a_resonance_to_the_line_there_is_no_bound() -> None:
    parts, joints = two_parts(None, loss=0.0, kept=3)
    limit = min(part.modes.series_limit for part in parts.values())
    lines = np.linspace(1.0, 0.99 * limit, 4000)
    found = bounded_frf(parts, joints, lines, ["a0"], ["a0"])
    beside = found.reason == Reason.JOINTS
    assert 0 < beside.sum() < 400
    assert (found.kernel[beside] >= 1).all()
    assert np.isinf(found.between("a0", "a0")[beside]).all()
    whole = couple(
        {name: direct_frf(part.system, lines) for name, part in parts.items()},
        joints,
        ["a0"],
        ["a0"],
    )
    error = np.abs(whole.frf.values - found.frf.values)
    assert (error <= found.bound).all()
    # signs of H change at resonances: each true one without a bound or with one as large as H
    above = np.flatnonzero(np.diff(np.sign(whole.frf.values[:, 0, 0].real)) != 0)
    told = found.between("a0", "a0") < np.abs(found.frf.values[:, 0, 0]) / 2
    signs = np.sign(found.frf.values[:, 0, 0].real)
    for k in above:
        assert signs[k] != signs[k + 1] or not (told[k] and told[k + 1])


def test_what_cannot_be_guaranteed_is_said() -> None:
    system = random_system(np.random.default_rng(3), 5)
    skew, indefinite = np.zeros((5, 5)), np.zeros((5, 5))
    skew[0, 1], skew[1, 0] = 5.0, -5.0
    indefinite[0, 1] = indefinite[1, 0] = 5.0
    free = random_system(np.random.default_rng(3), 5, grounded=False)
    one_damper = np.zeros((5, 5))
    one_damper[0, 0] = 100.0
    cases = [
        (replace(system, damping=skew), slice(0, 3), None, "not symmetric"),
        (
            replace(system, damping=indefinite),
            slice(0, 3),
            None,
            r"indefinite \(an eigenvalue of -",
        ),
        (free, slice(1, 3), None, "a rigid-body mode is left out"),
    ]
    for changed, keep, order, reason in cases:
        part = TruncatedPart.of(changed, keep, order)
        with pytest.raises(AssertionError, match=reason):
            assert part.no_guarantee is None, part.no_guarantee
        found = bounded_frf({"part": part}, (), [10.0, 20.0], ["x0"], ["x0"])
        assert (found.reason == Reason.PART).all()
        assert np.isinf(found.bound).all()
    general = TruncatedPart.of(replace(system, damping=one_damper), slice(0, 3), 0)
    assert general.no_guarantee is not None
    with pytest.raises(FbsError, match=r"C = alpha M \+ beta K"):
        bounded_frf({"part": general}, (), [10.0], ["x0"], ["x0"])


def test_viscous_galerkin_is_that_of_modal_frf() -> None:
    system = random_system(np.random.default_rng(4), 8, beta=lambda rng: rng.uniform(1e-7, 1e-5))
    modes = truncate(system, slice(0, 4))
    lines = frequency_axis(50, 1500, 50)
    found = bounded_frf({"part": TruncatedPart(system, modes)}, (), lines, ["x0", "x5"], ["x5"])
    galerkin = modal_frf(system, lines, ["x0", "x5"], ["x5"], modes=modes)
    assert np.abs(found.frf.values - galerkin.values).max() < 1e-12 * np.abs(galerkin.values).max()


def test_decibels_look_down() -> None:
    assert decibels(np.array([0.0, 0.5, 1.0, 2.0, 0.0]), np.array([1.0, 1.0, 1.0, 1.0, 0.0])) == (
        pytest.approx([0.0, -20 * np.log10(0.5), np.inf, np.inf, 0.0])
    )
    part = TruncatedPart.of(OSCILLATORS, [0], 0)
    found = bounded_frf({"part": part}, (), [50.0], ["slow", "fast"], ["fast"])
    assert found.decibels("fast", "fast")[0] == pytest.approx(
        -20 * np.log10(1 - found.between("fast", "fast")[0] / abs(found.frf.values[0, 1, 0]))
    )


def test_bad_input_is_named() -> None:
    parts, joints = two_parts()
    with pytest.raises(UnknownDofError, match="the assembly has no degree of freedom 'zz'"):
        bounded_frf(parts, joints, [10.0], ["zz"], ["a0"])
    with pytest.raises(UnknownDofError, match="there is no part 'c'"):
        bounded_frf(parts, [Joint(("a", "a0"), ("c", "x"))], [10.0], ["a0"], ["a0"])
    with pytest.raises(UnknownDofError, match="part 'b' has no degree of freedom 'b77'"):
        bounded_frf(parts, [Joint(("a", "a0"), ("b", "b77"))], [10.0], ["a0"], ["a0"])
    with pytest.raises(JointError, match="redundant"):
        bounded_frf(parts, [joints[1], joints[1]], [10.0], ["a0"], ["a0"])


def test_light_coordinates_keep_their_digits() -> None:
    system = replace(hub_system(3), loss_factor=0.01)
    line, hub = 700.0, 0
    exact = long_double_frf(system, line)
    found = modal_frf(system, [line]).values[0]
    error = np.abs(found[hub] - exact[hub]).astype(float) / np.abs(exact[hub]).astype(float)
    # a mode at 11 MHz beside one at 700 Hz: eps / sqrt(m) would be 1e-12 to 1e-9 of these
    assert np.median(error) < 1e-13


def small_problem() -> Any:
    parts, joints = two_parts(kept=9)
    systems = {name: part.system for name, part in parts.items()}
    modes = real_modes(systems["a"]).natural_frequencies
    return systems, joints, [("a0", "a0"), ("b4", "a0")], np.linspace(20.0, modes[3], 60)


def test_smallest_basis_meets_its_tolerance_and_needs_every_mode() -> None:
    systems, joints, pairs, axis = small_problem()
    found = smallest_basis(systems, joints, pairs, axis, 0.1)
    assert found.error <= 0.1
    assert not found.unreachable.any()
    assert max(found.bounded.decibels(*pair).max() for pair in pairs) == pytest.approx(found.error)
    exact = couple(
        {n: direct_frf(s, axis) for n, s in systems.items()}, joints, ["a0", "b4"], ["a0"]
    )
    for response, excitation in pairs:
        ratio = found.bounded.frf.between(response, excitation) / exact.frf.between(
            response, excitation
        )
        assert np.abs(20 * np.log10(np.abs(ratio))).max() <= found.error
    for name, kept in found.kept.items():
        parts = dict(found.parts)
        parts[name] = TruncatedPart.of(systems[name], list(kept[:-1]), 2)
        fewer = bounded_frf(parts, joints, axis, ["a0", "b4"], ["a0"])
        assert max(fewer.decibels(*pair).max() for pair in pairs) > 0.1


def test_smallest_basis_by_scaled_error_and_without_residuals() -> None:
    systems, joints, pairs, axis = small_problem()
    found = smallest_basis(systems, joints, pairs, axis, Tolerance(1e-3, scaled=True))
    assert found.error <= 1e-3
    labels = ["a0", "b4"]
    exact = couple({n: direct_frf(s, axis) for n, s in systems.items()}, joints, labels, labels).frf
    row = np.linalg.norm(exact.values, axis=2)
    error = np.abs(found.bounded.frf.select(labels, labels).values - exact.values)
    scaled = error / np.sqrt(row[:, :, None] * row[:, None, :])
    assert max(scaled[:, labels.index(i), labels.index(j)].max() for i, j in pairs) <= found.error
    bare = smallest_basis(systems, joints, pairs, axis, 0.1, largest_order=-1)
    assert set(bare.orders.values()) == {None}
    assert sum(map(len, bare.kept.values())) > sum(map(len, found.kept.values()))


def test_smallest_basis_says_what_no_basis_reaches() -> None:
    systems, joints, pairs, axis = small_problem()
    found = smallest_basis(systems, joints, pairs, axis, 1e-13)
    assert found.unreachable.all()
    assert np.isinf(found.error)
    complete = bounded_frf(systems, joints, axis, ["a0", "b4"], ["a0"])
    for pair in pairs:  # as good as round-off lets them be, and no worse
        assert (found.bounded.between(*pair) <= 2 * complete.between(*pair)).all()
    with pytest.raises(FbsError, match="no FRFs are asked for"):
        smallest_basis(systems, joints, [], axis, 0.1)
    with pytest.raises(FbsError, match="a scaled error must be above 0 and below 1: 2"):
        Tolerance(2.0, scaled=True)
    with pytest.raises(FbsError, match="a tolerance in dB must be above 0: 0"):
        Tolerance(0.0)


def test_smallest_basis_keeps_given_frfs() -> None:
    systems, joints, pairs, axis = small_problem()
    given = direct_frf(systems["b"], axis)
    found = smallest_basis({"a": systems["a"], "b": given}, joints, pairs, axis, 0.1)
    assert isinstance(found.parts["b"], Frf)
    assert set(found.kept) == {"a"}
    assert found.error <= 0.1


@pytest.mark.parametrize("seed", range(2))
def test_smallest_basis_is_near_the_optimum(seed: int) -> None:
    kept, best, error = basis_trial(seed)
    assert kept <= 2 * best
    assert error <= TOLERANCE


@pytest.mark.slow
def test_smallest_bases_of_fifty_drivetrains_are_near_the_optimum() -> None:
    for seed in range(50):
        kept, best, error = basis_trial(seed)
        assert kept <= 2 * best, seed
        assert error <= TOLERANCE, seed
