"""What measured parts leave open in the FRFs of the whole drivetrain."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fbs import direct_frf, frequency_axis
from fbs.measured.uncertainty import Scatter, sampled
from tests.strategies import damped, paper
from validation.checks.part_uncertainty import Noise, how_well_known, parse_noise
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
    return Substitution("planetary", Path("x.uff"), frf, interface, (), (), ())


def test_bands_hold_what_noise_does() -> None:
    part, noise = measured(), Noise(0.02, np.deg2rad(2))
    known = how_well_known(MODEL, [part], PAIRS, noise)
    stages = {name: direct_frf(system, AXIS) for name, system in MODEL.stages.items()}
    errors = Scatter.relative(part.frf, noise.amplitude, noise.phase)
    rows, columns = (list(dict.fromkeys(labels)) for labels in zip(*PAIRS, strict=True))
    draws = [
        frf.magnitude_db()
        for frf in sampled(stages, MODEL.joints, "planetary", errors, 300, 1, rows, columns)
    ]
    exact = np.mean(draws, axis=0)
    for number, pair in enumerate(PAIRS):
        off = np.abs(np.array(draws)[:, :, number, 0] - exact[:, number, 0])
        inside = (off < known[pair].level).mean()
        assert abs(inside - 0.95) < 0.015  # 300 draws at 100 lines, neighbours alike
        assert known[pair].main[0] == "planetary"
        assert 0 < known[pair].share <= 1
    assert known[PAIRS[0]].main == ("planetary", "coupling.w", "coupling.w")


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
    ratio = known[PAIRS[0]].level / stated[PAIRS[0]].level
    assert 0.6 < np.median(ratio) < 1.4  # four degrees of freedom


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
