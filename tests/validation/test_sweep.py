"""Sweeps: what is varied, what is computed, that nothing depends on how it is computed."""

from __future__ import annotations

import csv
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from fbs import Joint, couple, direct_frf
from mbs_models.model_file import load
from mbs_models.modes import drivetrain_modes
from mbs_models.parameters import Drivetrain
from validation import sweep_sample
from validation.cli import main
from validation.errors import CommandError
from validation.results import Band
from validation.routes import EQUATIONS, exudyn_source
from validation.sweep import process_pool, sweep, task
from validation.sweep_figures import log_slope, sensitivities, spearman
from validation.sweep_output import Pieces, Sweep
from validation.sweep_parameters import Design, changed, design, model_data, steps_to
from validation.sweep_sample import Bench, evaluate, part_key, spring_deflection
from validation.sweep_task import Outcome, Task, base_values, reference

PAIR = ("planetary.sun.w", "reducer.pinion.w")
SPRING = "coupling.second_stiffness"
BAND = Band(5.0, 3000.0, 5.0)
FIELDS = ("status", "magnitude", "frequency_hz", "kind")


@pytest.fixture(scope="module")
def paper() -> Drivetrain:
    return load("paper")


def damped(drivetrain: Drivetrain) -> Drivetrain:
    return with_value(drivetrain, "damping.stiffness_proportional", 2e-6)


def with_value(drivetrain: Drivetrain, path: str, value: float) -> Drivetrain:
    data = model_data(drivetrain)
    return changed(data, {steps_to(data, path): value})


def assert_same(one: Outcome, other: Outcome) -> None:
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


# What is varied


@pytest.mark.parametrize(
    ("spec", "expected"),
    [
        ("1:3:3", (1.0, 2.0, 3.0)),
        ("1e5:1e7:3log", (1e5, 1e6, 1e7)),
        ("4,2.5", (4.0, 2.5)),
    ],
)
def test_values(paper, spec, expected):
    found = design(paper, [f"{SPRING}={spec}"])
    np.testing.assert_allclose([s[0] for s in found.samples], expected, rtol=1e-14)
    assert not found.sampled


def test_whole_numbers_stay_whole(paper):
    found = design(paper, ["planetary.planets=3:5:3"])
    assert [type(value) for (value,) in found.samples] == [int, int, int]


def test_several_parameters_are_a_grid(paper):
    found = design(paper, ["planetary.planets=3,4", f"{SPRING}=1,2,3"])
    assert found.samples == ((3, 1.0), (3, 2.0), (3, 3.0), (4, 1.0), (4, 2.0), (4, 3.0))


@pytest.mark.parametrize("sign", ["±", "+-"])
def test_tolerances_are_a_latin_hypercube(paper, sign):
    options = [f"planetary.sun_mesh_stiffness=5e8{sign}10%", f"reducer.pinion.mass={sign}5%"]
    found = design(paper, options, samples=50, seed=3)
    assert found.sampled
    assert found == design(paper, options, samples=50, seed=3)
    assert found != design(paper, options, samples=50, seed=4)
    values = np.array(found.samples)
    for column, centre, half in ((0, 5e8, 5e7), (1, 2.0, 0.1)):
        strata = np.floor((values[:, column] - centre + half) / (2 * half) * 50)
        np.testing.assert_array_equal(np.sort(strata), np.arange(50))


def test_tolerances_beside_a_grid_are_drawn_alike_at_each_point(paper):
    options = ["reducer.pinion.mass=±5%", "planetary.planets=3,4"]
    found = np.array(design(paper, options, samples=7).samples)
    assert found.shape == (14, 2)
    np.testing.assert_array_equal(found[:7, 0], found[7:, 0])
    np.testing.assert_array_equal(found[:, 1], np.repeat([3, 4], 7))


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
        ("planetary.planets=4±10%", "whole number has no tolerance"),
        (f"{SPRING}=1:2:2000000", "at most 1000000|must be from 2 to 1000000"),
    ],
)
def test_wrong_options_say_what_is_right(paper, option, said):
    with pytest.raises(CommandError, match=said):
        design(paper, [option])


def test_options_that_do_not_fit_together(paper):
    with pytest.raises(CommandError, match="--vary is missing"):
        design(paper, [])
    with pytest.raises(CommandError, match="given 2 times"):
        design(paper, [f"{SPRING}=1,2", f"{SPRING}=3"])
    with pytest.raises(CommandError, match="--samples = 5: needs"):
        design(paper, [f"{SPRING}=1,2"], samples=5)
    with pytest.raises(CommandError, match="--samples = 0"):
        design(paper, [f"{SPRING}=±5%"], samples=0)


def test_a_key_left_to_its_default_can_be_varied(paper):
    assert damped(paper).damping.stiffness_proportional == 2e-6
    assert with_value(paper, "reducer.pressure_angle", 22.0).stage("reducer").pressure_angle == 22.0


# What is computed


def errors_against_the_rebuilt_whole(drivetrain, found, outcome, source, paths):
    """Scaled error of |H| per line and sample: |Δ| / √(h_response h_excitation)."""
    frequency = BAND.frequency()
    worst = []
    for values, magnitude in zip(found.samples, outcome.magnitude, strict=True):
        data = model_data(drivetrain)
        places = [steps_to(data, path) for path in paths]
        system = source.whole(changed(data, dict(zip(places, values, strict=True))))
        h = direct_frf(system, frequency)
        scale = [np.linalg.norm(h.select([label]).values[:, 0], axis=1) for label in PAIR]
        error = np.abs(magnitude - np.abs(h.between(*PAIR)))
        worst.append((error / np.sqrt(scale[0] * scale[1])).max())
    return worst


@pytest.mark.parametrize("is_damped", [False, True])
@pytest.mark.parametrize(
    "options",
    [
        [f"{SPRING}=0,1e2,1e5,1e7,1e10"],
        ["coupling.first_stiffness=1e5,1e8", f"{SPRING}=1e5,1e7"],
        [f"{SPRING}=1e5,1e7", "planetary.planets=3,5", "reducer.wheel.bearing_y=1e8,5e8"],
        ["coupling.inertia_over_r2=1e-3,0.5"],
    ],
)
def test_equals_the_rebuilt_whole(paper, options, is_damped):
    drivetrain = damped(paper) if is_damped else paper
    found = design(drivetrain, options)
    outcome = sweep(task(drivetrain, found, BAND, PAIR, 0, "equations"), found.samples)
    assert set(outcome.status) == {"ok"}
    worst = errors_against_the_rebuilt_whole(drivetrain, found, outcome, EQUATIONS, found.paths)
    assert max(worst) < 1e-8


def test_exudyn_equals_the_rebuilt_whole(paper):
    found = design(paper, [f"{SPRING}=1e5:1e7:3log", "planetary.planets=3,4"])
    outcome = sweep(task(paper, found, BAND, PAIR, 12), found.samples)
    source = exudyn_source()
    worst = errors_against_the_rebuilt_whole(paper, found, outcome, source, found.paths)
    assert max(worst) < 1e-8
    modes = drivetrain_modes(changed_to(paper, found, 3)).modes[:12]
    expected = [mode.frequency_hz for mode in modes]
    np.testing.assert_allclose(outcome.frequency_hz[3], expected, rtol=1e-6, atol=1e-2)
    assert list(outcome.kind[3]) == [str(mode.kind) for mode in modes]


def changed_to(drivetrain: Drivetrain, found: Design, sample: int) -> Drivetrain:
    for path, value in zip(found.paths, found.samples[sample], strict=True):
        drivetrain = with_value(drivetrain, path, value)
    return drivetrain


def test_the_interface_solve_is_a_joint_of_what_the_spring_is_stiffer_by(paper):
    """One spring's update is `fbs.couple` with the difference to k₀ as a flexible joint."""
    wide = with_value(paper, "coupling.radius", 0.06)  # so that the joint's ratio is not one
    frequency = BAND.frequency()
    whole = direct_frf(EQUATIONS.whole(with_value(wide, SPRING, 1e6)), frequency)
    deflection = spring_deflection(wide, "coupling", "second_stiffness")
    ratio = deflection["planetary.sun.w"]
    assert ratio == pytest.approx(0.06 / 0.0387)
    joint = Joint(("all", "coupling.w"), ("all", "planetary.sun.w"), 4e6, ratio=ratio)
    coupled = couple({"all": whole}, [joint]).frf.between(*PAIR)
    found = Design((SPRING,), ((2e5,), (5e6,)), sampled=False)  # k₀ = √(2e5 · 5e6) = 1e6
    outcome = sweep(task(wide, found, BAND, PAIR, 0, "equations"), found.samples)
    np.testing.assert_allclose(outcome.magnitude[1], np.abs(coupled), rtol=1e-6)


def test_the_reference_is_near_whatever_the_stiffness():
    for stiffness in np.geomspace(1e-3, 1e15, 200):
        ratio = reference(1e6, stiffness) / stiffness
        assert 1 / 32 < ratio < 32
    assert reference(1e6, 0.0) == 0.0


def test_zero_hertz_where_a_part_is_free(paper):
    found = design(paper, [f"{SPRING}=1e5,1e6"])
    band = Band(0.0, 100.0, 50.0)
    outcome = sweep(task(paper, found, band, PAIR, 0, "equations"), found.samples)
    assert all("0 Hz" in status or "singular" in status for status in outcome.status)


def test_natural_frequencies_of_damped_systems(paper):
    found = design(damped(paper), [f"{SPRING}=1e5,1e7"])
    outcome = sweep(task(damped(paper), found, BAND, None, 8, "equations"), found.samples)
    assert outcome.magnitude.shape == (2, 0)
    expected = drivetrain_modes(with_value(damped(paper), SPRING, 1e7)).modes[:8]
    np.testing.assert_allclose(
        outcome.frequency_hz[1], [m.frequency_hz for m in expected], rtol=1e-6, atol=1e-2
    )


# What is computed once


def test_parts_are_computed_only_if_something_in_them_changes(paper, monkeypatch):
    solved = []
    real = sweep_sample.direct_frf
    monkeypatch.setattr(
        sweep_sample,
        "direct_frf",
        lambda system, *given: (
            solved.append(system.dofs[0].partition(".")[0]) or real(system, *given)
        ),
    )
    options = [f"{SPRING}=1e5:1e7:4log", "planetary.ring.mass=2,3", "planetary.planets=3,4"]
    found = design(paper, options)
    todo = task(paper, found, BAND, PAIR, 0, "equations")
    bench = Bench(todo)
    for values in sorted(found.samples, key=lambda v: base_values(todo, v)):
        bench.frf(bench.sample(values))
    assert sorted(solved) == ["planetary"] * 4 + ["reducer"]


def test_part_key(paper):
    reducer, planetary = (part_key(paper, name) for name in ("reducer", "planetary"))
    for path, value, moved in (
        ("reducer.pinion.mass", 3.0, (True, False)),
        (SPRING, 7e5, (False, True)),
        ("coupling.first_stiffness", 7e5, (True, False)),
        ("coupling.radius", 0.05, (True, True)),
        ("damping.mass_proportional", 1.0, (True, True)),
    ):
        other = with_value(paper, path, value)
        keys = part_key(other, "reducer"), part_key(other, "planetary")
        assert (keys[0] != reducer, keys[1] != planetary) == moved, path


# Whoever computes, and in whatever order


def small(drivetrain: Drivetrain) -> tuple[Task, Design]:
    found = design(drivetrain, [f"{SPRING}=1e5:1e7:8log", "planetary.planets=3,4,40"])
    return task(drivetrain, found, Band(10.0, 2000.0, 10.0), PAIR, 4, "equations"), found


@pytest.fixture(scope="module")
def serial(paper) -> Outcome:
    todo, found = small(paper)
    return sweep(todo, found.samples)


def test_a_failing_sample_is_told_and_the_others_go_on(serial):
    assert serial.ok.sum() == 16
    assert "40: makes planets 1 and 2 overlap" in serial.status[2]
    assert np.isnan(serial.magnitude[2]).all()
    assert np.isnan(serial.frequency_hz[2]).all()
    assert not serial.kind[2].any()


def test_processes_give_the_same_bits(paper, serial):
    todo, found = small(paper)
    with process_pool(2) as executor:
        assert executor is not None
        assert_same(serial, sweep(todo, found.samples, executor))


def test_threads_give_the_same_bits(paper, serial):
    todo, found = small(paper)
    with ThreadPoolExecutor(1) as executor:
        assert_same(serial, sweep(todo, found.samples, executor))


def test_order_does_not_matter(paper, serial):
    todo, found = small(paper)
    order = np.random.default_rng(0).permutation(len(found.samples))
    outcome = sweep(todo, [found.samples[i] for i in order])
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(outcome, name), getattr(serial, name)[order])


class Crashing(Executor):
    """Runs the first job; loses the second; takes no more."""

    def __init__(self) -> None:
        self.jobs = 0

    def submit(self, fn, /, *args, **kwargs):
        self.jobs += 1
        if self.jobs > 2:
            raise BrokenExecutor("a worker died")
        future: Future = Future()
        if self.jobs == 1:
            future.set_result(fn(*args, **kwargs))
        else:
            future.set_exception(BrokenExecutor("a worker died"))
        return future


def test_samples_of_a_dead_worker_are_redone(paper, serial):
    todo, found = small(paper)
    assert_same(serial, sweep(todo, found.samples, Crashing()))


def test_an_interrupted_sweep_goes_on(paper, serial, tmp_path, monkeypatch):
    todo, found = small(paper)
    computed: list[int] = []
    monkeypatch.setattr(
        "validation.sweep.evaluate",
        lambda task, samples: computed.append(len(samples)) or evaluate(task, samples),
    )
    pieces = Pieces.of(todo, found.samples, tmp_path)

    def interrupt(_: str, done: int, __: int) -> None:
        if done >= 10:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sweep(todo, found.samples, store=pieces, progress=interrupt)
    assert len(list(pieces.directory.iterdir())) == 1
    told: list[int] = []
    outcome = sweep(
        todo, found.samples, store=pieces, progress=lambda _, done, __: told.append(done)
    )
    assert told == [0, 10, 20, 24]
    assert computed == [10, 10, 4]
    assert_same(serial, outcome)
    (pieces.directory / "10.npz").write_bytes(b"cut short")
    assert_same(serial, sweep(todo, found.samples, store=pieces))
    other = Pieces.of(todo, found.samples[1:], tmp_path)
    assert other.load("0") is None


def test_results_too_large_are_refused(paper):
    found = Design((SPRING,), ((1e5,),) * 100_000, sampled=False)
    with pytest.raises(CommandError, match=r"take 12\.0 GB, more than 2 GB; give a larger --df"):
        task(paper, found, Band(), PAIR)


# Sensitivities


def test_slope_of_a_power_law():
    p = np.geomspace(1.0, 100.0, 9)
    assert log_slope(p, 3.0 * p**0.5) == pytest.approx(0.5)
    assert log_slope(np.ones(3), p[:3]) == 0.0


def test_rank_correlation():
    p = np.linspace(1.0, 2.0, 9)
    assert spearman(p, np.exp(p)) == pytest.approx(1.0)
    assert spearman(p, -(p**3)) == pytest.approx(-1.0)
    assert spearman(p, np.full(9, 3.0) + 1e-14 * p) == 0.0


def test_the_ranking_finds_what_matters(paper):
    found = design(paper, ["planetary.carrier.mass=±5%", "reducer.mesh_stiffness=±5%"], samples=20)
    todo = task(paper, found, BAND, None, 30, "equations")
    result = Sweep("x", todo, found, sweep(todo, found.samples))
    by = {(s.metric, s.parameter): s.value for s in sensitivities(result)}
    mesh = [value for (_, parameter), value in by.items() if parameter == "reducer.mesh_stiffness"]
    assert max(mesh) == pytest.approx(1.0)


# The command


def run(*arguments: str) -> int:
    try:
        main(["sweep", *arguments])
    except SystemExit as end:
        return int(end.code or 0)
    return 0


def fast(out: Path) -> list[str]:
    frf = ["--response", PAIR[0], "--excitation", PAIR[1]]
    return [*frf, "--df", "10", "--fmax", "1000", "--route", "equations", "--out", str(out)]


def test_the_command_writes_table_and_pictures(tmp_path, capsys):
    assert run("paper", "--vary", f"{SPRING}=1e5:1e7:7log", "--modes", "5", *fast(tmp_path)) == 0
    assert "7 of 7 samples computed" in capsys.readouterr().out
    names = {path.name for path in tmp_path.iterdir()}
    figures = {"frf_map.svg", "frequencies.svg", "sensitivity.svg"}
    assert names == {"sweep.csv", "sweep.npz", *figures}
    with (tmp_path / "sweep.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 7
    with np.load(tmp_path / "sweep.npz", allow_pickle=False) as data:
        assert data["magnitude"].shape == (7, 100)
        peak = 20 * np.log10(data["magnitude"].max(axis=1))
        np.testing.assert_allclose(data["peak_db"], peak)
        np.testing.assert_allclose([float(row["peak_db"]) for row in rows], peak)
        at = data["frequency"][data["magnitude"].argmax(axis=1)]
        np.testing.assert_array_equal([float(row["peak_hz"]) for row in rows], at)
        rms = np.sqrt((data["magnitude"] ** 2).mean(axis=1))
        np.testing.assert_allclose(data["rms_m_per_n"], rms)
        np.testing.assert_array_equal(
            [float(row["f2_hz"]) for row in rows], data["natural_frequency_hz"][:, 1]
        )
    assert rows[0]["kind1"] == "rigid-body"


def test_samples_have_bands_and_old_pictures_go(tmp_path):
    assert run("paper", "--vary", f"{SPRING}=1e5,1e6", *fast(tmp_path)) == 0
    assert (tmp_path / "frf_map.svg").exists()
    options = ["--vary", f"{SPRING}=1e5±10%", "--samples", "6"]
    assert run("paper", *options, *fast(tmp_path)) == 0
    assert (tmp_path / "bands.svg").exists()
    assert not (tmp_path / "frf_map.svg").exists()


def test_a_failing_sample_is_a_warning(tmp_path, capsys):
    assert run("paper", "--vary", "planetary.planets=3,40", *fast(tmp_path)) == 0
    assert "sample 1 (planetary.planets = 40): " in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--vary", "planetary.planets=40,50"], "all 2 samples failed; sample 0 (planetary.plan"),
        (["--vary", "reducer.pinion.mass=-1"], "pinion.mass = -1"),
        (["--vary", "planetary.planet=3"], "did you mean planetary.planet"),
        (["--vary", "planetary.planets=3", "--response", "planetary.sn.w"], "planetary.sun.w"),
        (["--vary", "planetary.planets=3", "--route", "fbs"], "--route = 'fbs': must be exudyn"),
        (["--vary", "planetary.planets=3", "--modes", "-1"], "--modes = -1"),
        ([], "--vary is missing"),
    ],
)
def test_bad_input_is_one_message(tmp_path, capsys, options, said):
    assert run("paper", *fast(tmp_path), *options) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1


def test_one_dof_alone_is_refused(tmp_path, capsys):
    options = ["--vary", "planetary.planets=3", "--response", PAIR[0], "--out", str(tmp_path)]
    assert run("paper", *options) == 2
    assert "give both, or neither" in capsys.readouterr().err
