"""Sweeps: what is varied, what is computed, that nothing depends on how it is computed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from multiprocessing import active_children
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fbs import Frf, Joint, SecondOrderSystem, couple, direct_frf
from mbs_models.modal.modes import drivetrain_modes
from mbs_models.model.model_file import load
from mbs_models.model.parameters import Drivetrain
from validation.errors import CommandError
from validation.routes.bands import Band
from validation.routes.model_parameters import changed, model_data, steps_to
from validation.routes.source import equations_source, exudyn_source
from validation.runtime.executors import Workers, process_pool
from validation.sweep import sample as sweep_sample
from validation.sweep.parameters import Samples, Values, samples_of
from validation.sweep.pieces import FIELDS, Pieces
from validation.sweep.plan import SampleResults, SweepPlan, base_values, reference, sweep_plan
from validation.sweep.run import sweep
from validation.sweep.sample import Bench, evaluate, part_key, spring_deflection

UNFIT = (
    "{} of the pieces kept of an interrupted sweep are damaged, or another version's: they are "
    "computed again"
)
PAIR = ("planetary.sun.w", "reducer.pinion.w")
SPRING = "coupling.second_stiffness"
BAND = Band(5.0, 3000.0, 5.0)


@pytest.fixture(scope="module")
def paper() -> Drivetrain:
    return load("paper")


def damped(drivetrain: Drivetrain) -> Drivetrain:
    return with_value(drivetrain, "damping.stiffness_proportional", 2e-6)


def with_value(drivetrain: Drivetrain, path: str, value: float) -> Drivetrain:
    data = model_data(drivetrain)
    return changed(data, {steps_to(data, path): value})


def assert_same(one: SampleResults, other: SampleResults) -> None:
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


# What is computed


def errors_of_the_sweep(
    drivetrain: Drivetrain, found: Any, outcome: Any, source: Any, paths: Any
) -> Any:
    """Scaled error of |H| per line and sample: |Δ| / √(h_response h_excitation)."""
    frequency = BAND.frequency()
    worst = []
    for values, magnitude in zip(found.rows, outcome.magnitude, strict=True):
        data = model_data(drivetrain)
        places = [steps_to(data, path) for path in paths]
        system = source(changed(data, dict(zip(places, values, strict=True)))).whole
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
def test_equals_the_rebuilt_whole(paper: Any, options: list[str], is_damped: bool) -> None:
    drivetrain = damped(paper) if is_damped else paper
    found = samples_of(drivetrain, options)
    outcome = sweep(sweep_plan(drivetrain, found, BAND, PAIR, 0, "equations"), found.rows)
    assert set(outcome.status) == {"ok"}
    worst = errors_of_the_sweep(drivetrain, found, outcome, equations_source, found.paths)
    assert max(worst) < 1e-8


def test_exudyn_equals_the_rebuilt_whole(paper: Any) -> None:
    found = samples_of(paper, [f"{SPRING}=1e5:1e7:3log", "planetary.planets=3,4"])
    outcome = sweep(sweep_plan(paper, found, BAND, PAIR, 12), found.rows)
    worst = errors_of_the_sweep(paper, found, outcome, exudyn_source, found.paths)
    assert max(worst) < 1e-8
    modes = drivetrain_modes(changed_to(paper, found, 3)).modes[:12]
    expected = [mode.frequency_hz for mode in modes]
    np.testing.assert_allclose(outcome.frequency_hz[3], expected, rtol=1e-6, atol=1e-2)
    assert list(outcome.kind[3]) == [str(mode.kind) for mode in modes]


def changed_to(drivetrain: Drivetrain, found: Samples, sample: int) -> Drivetrain:
    for path, value in zip(found.paths, found.rows[sample], strict=True):
        drivetrain = with_value(drivetrain, path, value)
    return drivetrain


def test_the_interface_solve_is_a_joint_of_what_the_spring_is_stiffer_by(paper: Any) -> None:
    """One spring's update is `fbs.couple` with the difference to k₀ as a flexible joint."""
    wide = with_value(paper, "coupling.radius", 0.06)  # so that the joint's ratio is not one
    frequency = BAND.frequency()
    whole = direct_frf(equations_source(with_value(wide, SPRING, 1e6)).whole, frequency)
    deflection = spring_deflection(wide, "coupling", "second_stiffness")
    ratio = deflection["planetary.sun.w"]
    assert ratio == pytest.approx(0.06 / 0.0387)
    joint = Joint(("all", "coupling.w"), ("all", "planetary.sun.w"), 4e6, ratio=ratio)
    coupled = couple({"all": whole}, [joint]).frf.between(*PAIR)
    found = Samples((SPRING,), ((2e5,), (5e6,)), sampled=False)  # k₀ = √(2e5 · 5e6) = 1e6
    outcome = sweep(sweep_plan(wide, found, BAND, PAIR, 0, "equations"), found.rows)
    np.testing.assert_allclose(outcome.magnitude[1], np.abs(coupled), rtol=1e-6)


def test_the_reference_is_near_whatever_the_stiffness() -> None:
    for stiffness in np.geomspace(1e-3, 1e15, 200):
        ratio = reference(1e6, stiffness) / stiffness
        assert 1 / 32 < ratio < 32
    assert reference(1e6, 0.0) == 0.0


def test_zero_hertz_where_a_part_is_free(paper: Any) -> None:
    found = samples_of(paper, [f"{SPRING}=1e5,1e6"])
    band = Band(0.0, 100.0, 50.0)
    outcome = sweep(sweep_plan(paper, found, band, PAIR, 0, "equations"), found.rows)
    assert all("0 Hz" in status or "singular" in status for status in outcome.status)


def test_natural_frequencies_of_damped_systems(paper: Any) -> None:
    found = samples_of(damped(paper), [f"{SPRING}=1e5,1e7"])
    outcome = sweep(sweep_plan(damped(paper), found, BAND, None, 8, "equations"), found.rows)
    assert outcome.magnitude.shape == (2, 0)
    expected = drivetrain_modes(with_value(damped(paper), SPRING, 1e7)).modes[:8]
    np.testing.assert_allclose(
        outcome.frequency_hz[1], [m.frequency_hz for m in expected], rtol=1e-6, atol=1e-2
    )


# What is computed once


def test_parts_are_computed_only_if_something_in_them_changes(
    paper: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    solved: list[str] = []

    def noted(system: SecondOrderSystem, *given: Any) -> Frf:
        solved.append(system.dofs[0].partition(".")[0])
        return direct_frf(system, *given)

    monkeypatch.setattr(
        sweep_sample,
        "direct_frf",
        noted,
    )
    options = [f"{SPRING}=1e5:1e7:4log", "planetary.ring.mass=2,3", "planetary.planets=3,4"]
    found = samples_of(paper, options)
    todo = sweep_plan(paper, found, BAND, PAIR, 0, "equations")
    bench = Bench(todo)
    room = np.empty((1, todo.n_lines))
    for values in sorted(found.rows, key=lambda v: base_values(todo, v)):
        bench.magnitude(bench.base(values), bench.stiffer([values]), room)
    assert sorted(solved) == ["planetary"] * 4 + ["reducer"]


def test_part_key(paper: Any) -> None:
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


def small(drivetrain: Drivetrain) -> tuple[SweepPlan, Samples]:
    found = samples_of(drivetrain, [f"{SPRING}=1e5:1e7:8log", "planetary.planets=3,4,40"])
    return sweep_plan(drivetrain, found, Band(10.0, 2000.0, 10.0), PAIR, 4, "equations"), found


@pytest.fixture(scope="module")
def serial(paper: Any) -> SampleResults:
    todo, found = small(paper)
    return sweep(todo, found.rows)


def test_a_failing_sample_is_told_and_the_others_go_on(serial: Any) -> None:
    assert serial.ok.sum() == 16
    assert "40: makes planets 1 and 2 overlap" in serial.status[2]
    assert np.isnan(serial.magnitude[2]).all()
    assert np.isnan(serial.frequency_hz[2]).all()
    assert not serial.kind[2].any()


def test_processes_give_the_same_bits(paper: Any, serial: Any) -> None:
    todo, found = small(paper)
    with process_pool(2) as workers:
        assert workers.count == 2
        assert_same(serial, sweep(todo, found.rows, workers))


def test_threads_give_the_same_bits(paper: Any, serial: Any) -> None:
    todo, found = small(paper)
    with ThreadPoolExecutor(4) as executor:
        assert_same(serial, sweep(todo, found.rows, Workers(executor)))


def test_order_does_not_matter(paper: Any, serial: Any) -> None:
    todo, found = small(paper)
    order = np.random.default_rng(0).permutation(len(found.rows))
    outcome = sweep(todo, [found.rows[i] for i in order])
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(outcome, name), getattr(serial, name)[order])


class Crashing(Executor):
    """Runs the first job; loses the second; takes no more."""

    def __init__(self) -> None:
        self.jobs = 0

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Any:
        self.jobs += 1
        if self.jobs > 2:
            raise BrokenExecutor("a worker died")
        future: Future[Any] = Future()
        if self.jobs == 1:
            future.set_result(fn(*args, **kwargs))
        else:
            future.set_exception(BrokenExecutor("a worker died"))
        return future


def test_a_value_that_is_not_allowed_is_told_as_in_a_model_file(paper: Any) -> None:
    found = samples_of(paper, [f"{SPRING}=-1,1e5"])
    outcome = sweep(sweep_plan(paper, found, BAND, PAIR, 0, "equations"), found.rows)
    assert outcome.status[0] == (
        "coupling[0] 'coupling': second_stiffness = -1.0: must be a number, at least 0 (N/m) or "
        '"rigid"'
    )
    assert outcome.status[1] == "ok"


def test_samples_of_a_dead_worker_are_redone(paper: Any, serial: Any) -> None:
    todo, found = small(paper)
    assert_same(serial, sweep(todo, found.rows, Workers(Crashing())))


@pytest.mark.slow
def test_each_of_several_processes_keeps_to_one_core(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two threads in each of two processes on two cores took a sixth more of both."""
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    for workers, threads in ((2, "1"), (1, None)):
        with process_pool(workers, apart=True) as crew:
            assert crew.executor is not None
            assert crew.executor.submit(os.getenv, "OMP_NUM_THREADS").result() == threads


@pytest.mark.slow
# There a signal sent is a process ended, and a mask to inherit there is none.
@pytest.mark.skipif(os.name == "nt", reason="Windows has no signal mask")
def test_ctrl_c_of_a_terminal_is_for_the_parent_alone() -> None:
    """Also where it comes before a worker process has got as far as ignoring it."""
    others = set(active_children())
    with process_pool(2) as crew:
        starting = set(active_children()) - others
        assert len(starting) == 2
        for process in starting:
            assert process.pid is not None
            os.kill(process.pid, signal.SIGINT)
        assert crew.executor is not None
        assert crew.executor.submit(int, "7").result() == 7
        assert set(active_children()) - others == starting
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())


def deadly(task: SweepPlan, samples: Sequence[Values]) -> SampleResults:
    """As `evaluate`, but the process dies of the eighth stiffness (counted from 0: 7)."""
    if any(values[0] > 9e6 and values[1] == 4 for values in samples):
        os._exit(1)
    return evaluate(task, samples)


@pytest.mark.slow
def test_a_sample_that_kills_its_process_fails_and_the_others_go_on(
    paper: Any, serial: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("validation.sweep.run.evaluate", deadly)
    todo, found = small(paper)
    told: list[str] = []
    with process_pool(2) as workers:
        outcome = sweep(todo, found.rows, workers, warn=told.append)
    assert len(told) == 1
    assert "lost with their workers and are computed again: BrokenProcessPool" in told[0]
    killer = found.rows.index((pytest.approx(1e7), 4))
    assert outcome.status[killer] == "the process that computed it died"
    assert np.isnan(outcome.magnitude[killer]).all()
    others = np.arange(len(found.rows)) != killer
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(outcome, name)[others], getattr(serial, name)[others])


UNGUARDED = """
from mbs_models.model.model_file import load
from validation.routes.bands import Band
from validation.runtime.executors import process_pool
from validation.sweep.parameters import samples_of
from validation.sweep.plan import sweep_plan
from validation.sweep.run import sweep

found = samples_of(load("paper"), ["coupling.second_stiffness=1e5:1e7:20log"])
todo = sweep_plan(load("paper"), found, Band(), None, 1, "equations")
with process_pool(2) as workers:
    sweep(todo, found.rows, workers)
"""


@pytest.mark.slow
def test_a_script_whose_workers_run_it_again_is_told(tmp_path: Path) -> None:
    """Each sample by a process of its own that dies would take minutes, and blame the samples."""
    script = tmp_path / "sweep.py"
    script.write_text(UNGUARDED, encoding="utf-8")
    root = Path(__file__).parents[3]
    done = subprocess.run(
        [sys.executable, str(script)], env=os.environ | {"PYTHONPATH": str(root)},
        capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    assert done.returncode == 1
    last = done.stderr.splitlines()[-1]
    assert "CommandError: worker processes die as they start" in last
    assert "if __name__ == '__main__':" in last


def test_what_is_wrong_with_the_program_is_not_taken_for_a_lost_worker(
    paper: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("validation.sweep.run.evaluate", faulty)
    todo, found = small(paper)
    with ThreadPoolExecutor(1) as executor, pytest.raises(ZeroDivisionError):
        sweep(todo, found.rows, Workers(executor))


def faulty(task: SweepPlan, samples: Sequence[Values]) -> SampleResults:
    raise ZeroDivisionError


class Silent(Executor):
    """Takes everything and answers nothing."""

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Any:
        return Future()


def test_an_executor_that_is_gone_is_given_up(
    paper: Any, serial: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("validation.runtime.pieces.POLL", 0.01)
    todo, found = small(paper)
    told: list[str] = []
    workers = Workers(Silent(), gone=lambda: "tcp://x does not answer any more")
    assert_same(serial, sweep(todo, found.rows, workers, warn=told.append))
    assert told == [
        "24 samples were lost with their workers and are computed again: "
        "tcp://x does not answer any more"
    ]


def test_a_streamed_sweep_is_the_same_and_goes_on(paper: Any, serial: Any, tmp_path: Path) -> None:
    todo, found = small(paper)
    pieces = Pieces(todo, found.rows, tmp_path, streamed=True)
    shape = serial.magnitude.shape

    def interrupt(_: str, done: int, __: int) -> None:
        if done >= 20:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sweep(
            todo,
            found.rows,
            store=pieces,
            progress=interrupt,
            magnitude=pieces.magnitude(shape),
        )
    kept = sorted(path.name for path in pieces.directory.iterdir())
    assert kept == ["0.piece", "10.piece", "magnitude.npy"]
    assert (pieces.directory / "0.piece").stat().st_size < serial.magnitude[:10].nbytes / 2
    outcome = sweep(todo, found.rows, store=pieces, magnitude=pieces.magnitude(shape))
    assert_same(serial, outcome)
    np.testing.assert_array_equal(np.load(pieces.magnitude_file), serial.magnitude)
    pieces.magnitude_file.unlink()  # then what was kept beside it is worth nothing
    again = pieces.magnitude(shape)
    told: list[str] = []
    assert_same(serial, sweep(todo, found.rows, store=pieces, magnitude=again, warn=told.append))
    assert told == [UNFIT.format(3)]


def test_an_interrupted_sweep_goes_on(
    paper: Any, serial: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    todo, found = small(paper)
    computed: list[int] = []

    def counted(task: Any, samples: Any) -> Any:
        computed.append(len(samples))
        return evaluate(task, samples)

    monkeypatch.setattr("validation.sweep.run.evaluate", counted)
    pieces = Pieces(todo, found.rows, tmp_path)

    def interrupt(_: str, done: int, __: int) -> None:
        if done >= 10:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sweep(todo, found.rows, store=pieces, progress=interrupt)
    assert len(list(pieces.directory.iterdir())) == 1
    told: list[int] = []
    outcome = sweep(todo, found.rows, store=pieces, progress=lambda _, done, __: told.append(done))
    assert told == [0, 10, 20, 24]
    assert computed == [10, 10, 4]
    assert_same(serial, outcome)
    other = Pieces(todo, found.rows[1:], tmp_path)
    assert other.load("0", range(10)) is None
    assert not other.unfit
    (pieces.directory / "photo.npz").write_bytes(b"mine")
    pieces.clear()
    assert [path.name for path in pieces.directory.iterdir()] == ["photo.npz"]


def swapped(pieces: Pieces) -> None:
    first, second = (pieces.directory / f"{key}.piece" for key in ("0", "10"))
    content = first.read_bytes()
    first.write_bytes(second.read_bytes())
    second.write_bytes(content)


def cut(pieces: Pieces) -> None:
    for key in ("0", "10"):
        piece = pieces.directory / f"{key}.piece"
        piece.write_bytes(piece.read_bytes()[:-1])


def flipped(pieces: Pieces) -> None:
    for key in ("0", "10"):
        piece = pieces.directory / f"{key}.piece"
        content = bytearray(piece.read_bytes())
        content[len(content) // 2] ^= 1
        piece.write_bytes(content)


def flipped_row(pieces: Pieces) -> None:
    rows = np.load(pieces.magnitude_file, mmap_mode="r+")
    rows[:, 7] *= 1.0 + 2.0**-52


def linked(pieces: Pieces) -> None:
    for key in ("0", "10"):
        piece = pieces.directory / f"{key}.piece"
        piece.unlink()
        piece.symlink_to("/dev/zero")


@pytest.mark.skipif(sys.platform == "win32", reason="making links takes rights there")
@pytest.mark.parametrize("damage", [swapped, cut, flipped, flipped_row, linked])
def test_kept_pieces_that_do_not_fit_are_computed_again(
    paper: Any, serial: Any, tmp_path: Path, damage: Any
) -> None:
    todo, found = small(paper)
    pieces = Pieces(todo, found.rows, tmp_path, streamed=True)
    room = pieces.magnitude(serial.magnitude.shape)
    sweep(todo, found.rows, store=pieces, magnitude=room)
    (pieces.directory / "20.piece").unlink()
    damage(pieces)
    told: list[str] = []
    pieces = Pieces(todo, found.rows, tmp_path, streamed=True)
    room = pieces.magnitude(serial.magnitude.shape)
    outcome = sweep(todo, found.rows, store=pieces, magnitude=room, warn=told.append)
    assert told == [UNFIT.format(2)]
    assert_same(serial, outcome)


def test_pieces_of_other_code_or_libraries_are_computed_again(
    paper: Any, serial: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    todo, found = small(paper)
    sweep(todo, found.rows, store=Pieces(todo, found.rows, tmp_path))
    for name, other in (("code_digest", lambda *_: "other"), ("versions", lambda: ("3.0",))):
        told: list[str] = []
        with monkeypatch.context() as patched:
            patched.setattr(f"validation.runtime.kept.{name}", other)
            pieces = Pieces(todo, found.rows, tmp_path)
            outcome = sweep(todo, found.rows, store=pieces, warn=told.append)
        assert told == [UNFIT.format(3)]
        assert_same(serial, outcome)


def test_results_too_large_are_refused(paper: Any) -> None:
    found = Samples((SPRING,), ((1e5,),) * 100_000, sampled=False)
    with pytest.raises(
        CommandError, match=r"12\.1 GB, more than 2 GB; give a larger --df.*--stream"
    ):
        sweep_plan(paper, found, Band(), PAIR)
    todo = sweep_plan(paper, found, Band(), PAIR, streamed=True)
    assert todo.n_lines == 15000
    with pytest.raises(CommandError, match=r"of 0 lines and 1000 modes take 6\.4 GB.* --modes"):
        sweep_plan(paper, found, Band(), n_modes=1000)
