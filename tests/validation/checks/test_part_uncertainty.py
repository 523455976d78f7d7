"""What measured parts leave open in the FRFs of the whole drivetrain."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import t as t_distribution

from fbs import Frf, direct_frf, frequency_axis
from fbs.measured.quality import quality
from fbs.measured.uncertainty import Scatter, coupled_uncertainty, sampled
from tests.strategies import damped, paper
from validation.checks.part_uncertainty import (
    DECIBEL,
    Known,
    Noise,
    how_well_known,
    known_of,
    parse_noise,
)
from validation.errors import CommandError
from validation.routes.source import equations_source
from validation.routes.substitution import Substitution, interface_labels

DRIVETRAIN = damped(paper())
MODEL = equations_source(DRIVETRAIN)
AXIS = frequency_axis(20, 2000, 20)
PAIRS = [("reducer.pinion.w", "reducer.pinion.w"), ("planetary.sun.w", "reducer.pinion.w")]


def measured() -> Substitution:
    frf = direct_frf(MODEL.stages["planetary"], AXIS)
    interface = interface_labels(MODEL, "planetary")
    return Substitution("planetary", Path("x.uff"), frf, interface, (), (), (), quality(frf))


def test_bands_hold_what_noise_does() -> None:
    part, noise = measured(), Noise(0.02, np.deg2rad(2))
    known = how_well_known(MODEL, [part], PAIRS, noise)
    stages = {name: direct_frf(system, AXIS) for name, system in MODEL.stages.items()}
    errors = Scatter.relative(part.frf, noise.amplitude, noise.phase)
    rows, columns = (list(dict.fromkeys(labels)) for labels in zip(*PAIRS, strict=True))
    draws = [
        frf.magnitude_db()
        for frf in sampled(stages, MODEL.joints, {"planetary": errors}, 300, 1, rows, columns)
    ]
    exact = np.mean(draws, axis=0)
    for number, pair in enumerate(PAIRS):
        off = np.abs(np.array(draws)[:, :, number, 0] - exact[:, number, 0])
        inside = (off < known[pair].level).mean()
        assert abs(inside - 0.95) < 0.015  # 300 draws at 100 lines, neighbours alike
        shares = known[pair].shares
        assert {share.part for share in shares} == {"planetary"}
        assert len(shares) == part.frf.values[0].size
        assert sum(share.share for share in shares) == pytest.approx(1.0)
    largest = known[PAIRS[0]].shares[0]
    assert (largest.response, largest.excitation) == ("coupling.w", "coupling.w")
    split = known[PAIRS[0]].split("planetary", part.frf.responses, part.frf.excitations)
    assert split.max() == largest.share
    assert not known[PAIRS[0]].split("reducer", ["coupling.w"], ["coupling.w"]).any()


def test_coherence_says_it_where_its_averages_are_known() -> None:
    """γ² = 0.9 of 11 averages: a variance of 0.1 / 0.9 / 10, as much noise of |H| and phase."""
    part = replace(measured(), coherence=np.full(measured().frf.values.shape, 0.9))
    assert how_well_known(MODEL, [part], PAIRS) == {}
    known = how_well_known(MODEL, [replace(part, averages=11)], PAIRS)
    size = np.sqrt(0.1 / 0.9 / 10 / 2)
    stated = how_well_known(MODEL, [part], PAIRS, Noise(size, size))
    for pair in PAIRS:
        wider = t_distribution.ppf(0.975, 20) / 1.959963985  # twice ten degrees of freedom
        share = wider * stated[pair].level / DECIBEL  # of |H|, and alike up and down
        np.testing.assert_allclose(known[pair].high, DECIBEL * np.log1p(share), rtol=1e-9)
        small = share < 0.9
        np.testing.assert_allclose(
            known[pair].low[small], DECIBEL * np.log(1 - share[small]), rtol=1e-8
        )
        assert (known[pair].level[share >= 1] > 900).all()


def test_bands_of_coherence_hold_95_percent() -> None:
    """A drive point uncoupled, by H1 of n blows of equal force with noise of the response.

    20 000 tests: the share inside scatters by 0.15 %. Where half of the response is noise the
    distribution is far from normal in dB, and the band is not symmetric.
    """
    rng = np.random.default_rng(11)
    for averages, coherence in ((4, 0.5), (4, 0.9), (8, 0.5), (8, 0.99)):
        size = np.sqrt((1 - coherence) / coherence / 2)
        noise = size * (rng.standard_normal((20000, averages, 2)) @ np.array([1, 1j]))
        estimates = 1 + noise.mean(axis=1)
        rest = np.abs(noise - noise.mean(axis=1, keepdims=True)) ** 2
        found = np.abs(estimates) ** 2
        found = found / (found + rest.mean(axis=1))  # γ² = |S_fx|² / (S_ff S_xx)
        axis = np.arange(1.0, 20001.0)
        frf = Frf(axis, estimates[:, None, None], ["x"], ["x"])
        scatter = Scatter.of_coherence(frf, found[:, None, None], averages - 1)
        one = coupled_uncertainty({"a": frf}, (), "a", scatter)
        known = known_of({"a": one}, ("x", "x"))
        change = -20 * np.log10(np.abs(1 / estimates))  # of the true FRF to the estimate
        outside = (-change < known.low) | (-change > known.high)
        assert abs(outside.mean() - 0.05) < 0.01, (averages, coherence)


def test_repetitions_tell_what_first_order_does_not() -> None:
    """Small errors: both bands alike; of 400 repetitions a quantile of 2.5 % scatters by 7 %."""
    part, noise = measured(), Noise(0.002, 0.002)
    first = how_well_known(MODEL, [part], PAIRS, noise)
    again = how_well_known(MODEL, [part], PAIRS, noise, 400)
    for pair in PAIRS:
        assert (again[pair].repetitions, again[pair].shares) == (400, first[pair].shares)
        ratios = np.array([again[pair].high, -again[pair].low]) / first[pair].level
        assert abs(np.median(ratios) - 1) < 0.02  # of 100 lines
        assert 0.7 < ratios.min() < ratios.max() < 1.4
        assert (again[pair].method, again[pair].told) == ("400 repetitions", np.inf)


def test_errors_of_two_parts_add_up() -> None:
    parts = []
    for name in ("reducer", "planetary"):
        frf = direct_frf(MODEL.stages[name], AXIS)
        labels = interface_labels(MODEL, name)
        parts.append(Substitution(name, Path("x"), frf, labels, (), (), (), quality(frf)))
    noise = Noise(0.02, 0.03)
    both = how_well_known(MODEL, parts, PAIRS, noise)
    apart = [how_well_known(MODEL, [part], PAIRS, noise) for part in parts]
    for pair in PAIRS:
        squares = [one[pair].level ** 2 for one in apart]
        np.testing.assert_allclose(both[pair].level ** 2, sum(squares), rtol=1e-9)
        assert sum(share.share for share in both[pair].shares) == pytest.approx(1.0)
        assert {share.part for share in both[pair].shares} == {"reducer", "planetary"}


def test_changes_within_round_off_are_within_the_band() -> None:
    level = np.array([1e-30, 0.5, 0.5, np.inf])
    known = Known(-level, level, ())
    change = np.array([1e-7, 0.4, -0.6, np.nan])
    assert known.exceeded(change).tolist() == [False, False, True, False]


def test_runs_say_it_where_no_noise_is_stated() -> None:
    part = measured()
    assert how_well_known(MODEL, [part], PAIRS) == {}
    rng = np.random.default_rng(2)
    values = part.frf.values
    runs = tuple(
        replace(part.frf, values=values * (1 + 0.01 * rng.standard_normal(values.shape)))
        for _ in range(5)
    )
    known = how_well_known(MODEL, [replace(part, repeats=runs)], PAIRS)
    stated = how_well_known(MODEL, [part], PAIRS, Noise(0.01 / np.sqrt(5)))
    ratio = known[PAIRS[0]].high / stated[PAIRS[0]].level
    wider = t_distribution.ppf(0.975, 4) / 1.96  # four degrees of freedom
    assert 0.6 < np.median(ratio) / wider < 1.4


@pytest.mark.parametrize(
    ("text", "noise"),
    [
        ("1%,1deg", Noise(0.01, np.pi / 180)),
        ("2 %", Noise(0.02)),
        ("0.5%, 3°", Noise(0.005, np.pi / 60)),
    ],
)
def test_the_noise_a_user_states(text: str, noise: Noise) -> None:
    found = parse_noise(text)
    assert found is not None
    np.testing.assert_allclose((found.amplitude, found.phase), (noise.amplitude, noise.phase))
    assert parse_noise(None) is None


@pytest.mark.parametrize("text", ["", "1", "1deg", "-1%", "0%", "60%", "1%,90deg", "1%,x", "e%"])
def test_noise_that_is_none(text: str) -> None:
    with pytest.raises(CommandError, match=r"--noise = .* such as 1%,1deg"):
        parse_noise(text)
