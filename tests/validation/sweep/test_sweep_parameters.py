"""What a sweep varies: grids, lists, and samples drawn from tolerances."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.stats import kstest, norm
from scipy.stats import uniform as scipy_uniform

from mbs_models.model.model_file import load
from mbs_models.model.parameters import Drivetrain, ParallelStage
from validation.errors import CommandError
from validation.routes.bands import Band
from validation.routes.model_parameters import changed, model_data, steps_to
from validation.sweep.parameters import samples_of
from validation.sweep.plan import sweep_plan
from validation.sweep.run import sweep

SPRING = "coupling.second_stiffness"
BAND = Band(5.0, 3000.0, 5.0)


@pytest.fixture(scope="module")
def paper() -> Drivetrain:
    return load("paper")


@pytest.mark.parametrize(
    ("spec", "expected"),
    [
        ("1:3:3", (1.0, 2.0, 3.0)),
        ("1e5:1e7:3log", (1e5, 1e6, 1e7)),
        ("4,2.5", (4.0, 2.5)),
    ],
)
def test_values(
    paper: Any, spec: str, expected: tuple[float, float, float] | tuple[float, float]
) -> None:
    found = samples_of(paper, [f"{SPRING}={spec}"])
    np.testing.assert_allclose([s[0] for s in found.rows], expected, rtol=1e-14)
    assert not found.sampled


def test_whole_numbers_stay_whole(paper: Any) -> None:
    found = samples_of(paper, ["planetary.planets=3:5:3"])
    assert [type(value) for (value,) in found.rows] == [int, int, int]


def test_several_parameters_are_a_grid(paper: Any) -> None:
    found = samples_of(paper, ["planetary.planets=3,4", f"{SPRING}=1,2,3"])
    assert found.rows == ((3, 1.0), (3, 2.0), (3, 3.0), (4, 1.0), (4, 2.0), (4, 3.0))


@pytest.mark.parametrize("sign", ["±", "+-"])
def test_tolerances_are_a_latin_hypercube(paper: Any, sign: str) -> None:
    options = [f"planetary.sun_mesh_stiffness=5e8{sign}10%", f"reducer.pinion.mass={sign}5%"]
    found = samples_of(paper, options, samples=50, seed=3)
    assert found.sampled
    assert found == samples_of(paper, options, samples=50, seed=3)
    assert found != samples_of(paper, options, samples=50, seed=4)
    values = np.array(found.rows)
    for column, centre, half in ((0, 5e8, 5e7), (1, 2.0, 0.1)):
        strata = np.floor((values[:, column] - centre + half) / (2 * half) * 50)
        np.testing.assert_array_equal(np.sort(strata), np.arange(50))


def test_tolerances_beside_a_grid_are_drawn_alike_at_each_point(paper: Any) -> None:
    options = ["reducer.pinion.mass=±5%", "planetary.planets=3,4"]
    found = np.array(samples_of(paper, options, samples=7).rows)
    assert found.shape == (14, 2)
    np.testing.assert_array_equal(found[:7, 0], found[7:, 0])
    np.testing.assert_array_equal(found[:, 1], np.repeat([3, 4], 7))


@pytest.mark.parametrize("sampling", ["lhs", "random"])
def test_tolerances_are_distributed_as_asked(paper: Any, sampling: str) -> None:
    options = ["reducer.pinion.mass=4~5%", "planetary.sun.mass=0.4±10%"]
    found = samples_of(paper, options, samples=4000, seed=1, sampling=sampling)
    assert found == samples_of(paper, options, samples=4000, seed=1, sampling=sampling)
    normal, uniform = np.array(found.rows).T
    # five standard errors of the mean and of the deviation; a hypercube is far within
    assert normal.mean() == pytest.approx(4.0, abs=5 * 0.2 / 4000**0.5)
    assert normal.std() == pytest.approx(0.2, rel=5 / 8000**0.5)
    assert kstest(normal, norm(4.0, 0.2).cdf).pvalue > 1e-4
    assert kstest(uniform, scipy_uniform(0.36, 0.08).cdf).pvalue > 1e-4
    assert abs(np.corrcoef(normal, uniform)[0, 1]) < 5 / 4000**0.5


def test_random_samples_are_no_hypercube(paper: Any) -> None:
    options = ["planetary.sun_mesh_stiffness=5e8±10%"]
    found = samples_of(paper, options, samples=50, sampling="random")
    strata = np.floor((np.array(found.rows)[:, 0] - 4.5e8) / 1e8 * 50)
    assert len(set(strata)) < 50


def test_a_normal_sample_that_cannot_be_is_reported(paper: Any) -> None:
    """A mass of 2 kg ± 100 % (one standard deviation) is negative in 16 % of all samples."""
    found = samples_of(paper, ["reducer.pinion.mass=2~100%"], samples=100)
    outcome = sweep(sweep_plan(paper, found, BAND, None, 1, "equations"), found.rows)
    negative = np.array(found.rows)[:, 0] <= 0.0
    assert negative.sum() == 16
    np.testing.assert_array_equal(outcome.ok, ~negative)
    assert all("pinion.mass" in status for status in outcome.status[negative])


@pytest.mark.parametrize(
    ("option", "said"),
    [
        ("coupling.second_stifness=1,2", "did you mean coupling.second_stiffness"),
        ("reducr.pinion.mass=1,2", "did you mean reducer.pinion.mass"),
        ("nothing=1", "tables damping, reducer, planetary, coupling"),
        ("reducer.name=1", "no such number"),
        (SPRING, "must be PATH=SPEC"),
        (f"{SPRING}=a,b", "cannot be read"),
        (f"{SPRING}=", "cannot be read"),
        (f"{SPRING}=1:2", "cannot be read"),
        (f"{SPRING}=1:2:3lin", "cannot be read"),
        (f"{SPRING}=1:2:1", "must be from 2"),
        (f"{SPRING}=0:2:5log", "greater than 0"),
        (f"{SPRING}=1,inf", "not finite"),
        (f"{SPRING}=1±x%", "cannot be read"),
        (f"{SPRING}=1±0%", "greater than 0 %"),
        (f"{SPRING}=1~-3%", "greater than 0 %"),
        (f"{SPRING}=1~3", "cannot be read"),
        (f"{SPRING}=0~3%", "a percentage of 0 is 0"),
        ("planetary.planets=4±10%", "whole number has no tolerance"),
        (f"{SPRING}=1:2:2000000", "at most 1000000|must be from 2 to 1000000"),
    ],
)
def test_wrong_options_say_what_is_right(paper: Any, option: Any, said: str) -> None:
    with pytest.raises(CommandError, match=said):
        samples_of(paper, [option])


def test_options_that_do_not_fit_together(paper: Any) -> None:
    with pytest.raises(CommandError, match="--vary is missing"):
        samples_of(paper, [])
    with pytest.raises(CommandError, match="given 2 times"):
        samples_of(paper, [f"{SPRING}=1,2", f"{SPRING}=3"])
    with pytest.raises(CommandError, match="--samples = 5: needs"):
        samples_of(paper, [f"{SPRING}=1,2"], samples=5)
    with pytest.raises(CommandError, match="--samples = 0"):
        samples_of(paper, [f"{SPRING}=±5%"], samples=0)
    with pytest.raises(CommandError, match="--sampling = random: needs"):
        samples_of(paper, [f"{SPRING}=1,2"], sampling="random")
    with pytest.raises(CommandError, match="--sampling = 'sobol': must be lhs or random"):
        samples_of(paper, [f"{SPRING}=±5%"], sampling="sobol")


def test_a_key_left_to_its_default_can_be_varied(paper: Any) -> None:
    data = model_data(paper)
    damped = changed(data, {steps_to(data, "damping.stiffness_proportional"): 2e-6})
    assert damped.damping.stiffness_proportional == 2e-6
    turned = changed(data, {steps_to(data, "reducer.pressure_angle"): 22.0})
    (reducer,) = turned.stages_of(ParallelStage)
    assert reducer.pressure_angle == 22.0
