"""Executors: the same table whoever computes, and one clear message where nobody can."""

from __future__ import annotations

import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from mbs_models.model.model_file import load
from validation.cli import main
from validation.errors import CommandError
from validation.routes.bands import Band
from validation.runtime.executors import dask_cluster, mpi_pool, opened, versions
from validation.sweep.parameters import Samples, samples_of
from validation.sweep.pieces import FIELDS
from validation.sweep.plan import SampleResults, SweepPlan, sweep_plan
from validation.sweep.run import sweep

PAIR = ("planetary.sun.w", "reducer.pinion.w")
PATIENCE = 120.0  # seconds; a busy machine starts processes slowly


def small(samples: int = 40) -> tuple[SweepPlan, Samples]:
    drivetrain = load("paper")
    options = ["planetary.sun_mesh_stiffness=±10%", "planetary.planets=3,4,40"]
    found = samples_of(drivetrain, options, samples=samples)
    return sweep_plan(drivetrain, found, Band(10.0, 1000.0, 10.0), PAIR, 4, "equations"), found


@pytest.fixture(scope="module")
def serial() -> SampleResults:
    todo, found = small()
    return sweep(todo, found.rows)


def assert_same(one: SampleResults, other: SampleResults) -> None:
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def run(*arguments: str) -> int:
    try:
        main(["sweep", *arguments])
    except SystemExit as end:
        return int(end.code or 0)
    return 0


# dask


@dataclass
class Cluster:
    """A dask scheduler and its workers, each a process of this machine."""

    address: str
    workers: list[subprocess.Popen[bytes]]


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
    return port


@contextmanager
def started(module: str, *arguments: str) -> Iterator[subprocess.Popen[bytes]]:
    """A process that is surely gone afterwards."""
    process = subprocess.Popen(
        [sys.executable, "-m", module, *arguments],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        cwd=Path(__file__).parents[3],
    )
    try:
        yield process
    finally:
        process.kill()
        process.wait()


@contextmanager
def cluster(folder: Path, n_workers: int = 2) -> Iterator[Cluster]:
    address = f"tcp://127.0.0.1:{free_port()}"
    port = address.rpartition(":")[2]
    local = ("--local-directory", str(folder), "--no-dashboard")
    alone = ("--nthreads", "1", "--no-nanny")
    scheduler = ("--host", "127.0.0.1", "--port", port, "--no-dashboard")
    with ExitStack() as stack:
        stack.enter_context(started("distributed.cli.dask_scheduler", *scheduler))
        workers = [
            stack.enter_context(started("distributed.cli.dask_worker", address, *alone, *local))
            for _ in range(n_workers)
        ]
        wait_for_workers(address, n_workers)
        yield Cluster(address, workers)


def wait_for_workers(address: str, n_workers: int) -> None:
    from distributed import Client

    until = time.monotonic() + PATIENCE
    while True:
        try:
            with Client(address, timeout=2.0, set_as_default=False) as client:
                client.wait_for_workers(n_workers, timeout=PATIENCE)
            return
        except OSError:
            if time.monotonic() > until:
                raise


@pytest.mark.slow
def test_dask_gives_the_same_bits_as_serial(tmp_path: Path, serial: Any) -> None:
    todo, found = small()
    with cluster(tmp_path) as dask, dask_cluster(dask.address) as workers:
        assert workers.count == 2
        assert workers.warnings == ()
        assert_same(serial, sweep(todo, found.rows, workers))


@pytest.mark.slow
def test_samples_of_a_dask_worker_that_is_killed_are_redone(tmp_path: Path, serial: Any) -> None:
    todo, found = small()
    told: list[int] = []
    with cluster(tmp_path) as dask, dask_cluster(dask.address) as workers:

        def kill_one(_: str, done: int, __: int) -> None:
            told.append(done)
            if done == 10:
                dask.workers[0].send_signal(signal.SIGKILL)

        outcome = sweep(todo, found.rows, workers, progress=kill_one)
        assert dask.workers[0].wait(PATIENCE) == -signal.SIGKILL
    assert told[-1] == len(found.rows)
    assert_same(serial, outcome)


@pytest.mark.slow
def test_the_command_on_a_cluster_writes_the_same_table(tmp_path: Path) -> None:
    options = ["paper", "--vary", "planetary.planets=3,4,40", "--route", "equations", "--vary"]
    options += ["planetary.sun.mass=~2%", "--samples", "7", "--df", "10", "--fmax", "500"]
    options += ["--response", PAIR[0], "--excitation", PAIR[1], "--metric", "mean:10:100"]
    with cluster(tmp_path / "dask") as dask:
        assert run(*options, "--executor", dask.address, "--out", str(tmp_path / "far")) == 0
    assert run(*options, "--executor", "serial", "--out", str(tmp_path / "here")) == 0
    far, here = ((tmp_path / name / "sweep.csv").read_bytes() for name in ("far", "here"))
    assert far == here


def test_a_scheduler_that_does_not_answer_is_told_of(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    address = f"tcp://127.0.0.1:{free_port()}"
    options = ["paper", "--vary", "planetary.planets=3,4", "--out", str(tmp_path)]
    assert run(*options, "--executor", address) == 2
    error = capsys.readouterr().err
    assert f"crosscheck: --executor = {address}: no dask scheduler answers there within" in error
    assert error.count("\n") == 1


@pytest.fixture
def listening() -> Iterator[str]:
    """An address where somebody takes connections."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        yield f"tcp://127.0.0.1:{server.getsockname()[1]}"


class FakeClient:
    """What is asked of `distributed.Client`."""

    status = "running"

    def __init__(self, address: str, **_: object) -> None:
        self.address = address
        self.found: dict[str, tuple[str, ...]] = {"tcp://w:1": versions()}

    def __enter__(self) -> FakeClient:
        return self

    def __exit__(self, *_: object) -> None:
        self.status = "closed"

    def run(self, function: object) -> dict[str, tuple[str, ...]]:
        return self.found

    def nthreads(self) -> dict[str, int]:
        return dict.fromkeys(self.found, 3)

    def get_executor(self, **_: object) -> ThreadPoolExecutor:
        return ThreadPoolExecutor(1)


class Without(FakeClient):
    def run(self, function: object) -> dict[str, tuple[str, ...]]:
        raise ModuleNotFoundError("No module named 'validation'")


class Empty(FakeClient):
    def run(self, function: object) -> dict[str, tuple[str, ...]]:
        return {}


class Other(FakeClient):
    def run(self, function: object) -> dict[str, tuple[str, ...]]:
        python, *_, scipy = versions()
        return {**self.found, "tcp://w:2": (python, *versions()[1:3], "1.26.4", scipy)}


def pretend(monkeypatch: pytest.MonkeyPatch, client: type[FakeClient]) -> None:
    module = ModuleType("distributed")
    module.Client = client  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "distributed", module)


def test_a_cluster_without_this_package_is_told_of(
    monkeypatch: pytest.MonkeyPatch, listening: Any
) -> None:
    pretend(monkeypatch, Without)
    said = r"a worker cannot compute \(ModuleNotFoundError: No module named 'validation'\); install"
    with pytest.raises(CommandError, match=said), dask_cluster(listening):
        pass


def test_a_cluster_without_workers_is_told_of(
    monkeypatch: pytest.MonkeyPatch, listening: Any
) -> None:
    pretend(monkeypatch, Empty)
    said = "the scheduler has no workers; start some with 'dask worker"
    with pytest.raises(CommandError, match=said), dask_cluster(listening):
        pass


def test_other_versions_are_a_warning(monkeypatch: pytest.MonkeyPatch, listening: Any) -> None:
    pretend(monkeypatch, Other)
    with dask_cluster(listening) as workers:
        (warning,) = workers.warnings
    assert warning.startswith(f"{listening}: worker tcp://w:2 has numpy 1.26.4, here it is ")


def test_a_cluster_that_is_lost_is_noticed(monkeypatch: pytest.MonkeyPatch, listening: Any) -> None:
    pretend(monkeypatch, FakeClient)
    with dask_cluster(listening) as workers:
        assert workers.count == 3
        assert workers.gone() == ""
    assert workers.gone() == f"{listening} does not answer any more"


# MPI


class FakePool(ThreadPoolExecutor):
    """What is asked of `mpi4py.futures.MPIPoolExecutor`."""

    ranks = 2

    def __init__(self, max_workers: int | None = None) -> None:
        super().__init__(max_workers or 1)

    @property
    def num_workers(self) -> int:
        return self.ranks


class Alone(FakePool):
    ranks = 0


def pretend_mpi(monkeypatch: pytest.MonkeyPatch, pool: type[FakePool]) -> None:
    modules = {name: ModuleType(name) for name in ("mpi4py", "mpi4py.MPI", "mpi4py.futures")}
    modules["mpi4py"].MPI = modules["mpi4py.MPI"]  # type: ignore[attr-defined]
    modules["mpi4py.futures"].MPIPoolExecutor = pool  # type: ignore[attr-defined]
    for name, module in modules.items():
        monkeypatch.setitem(sys.modules, name, module)


def test_an_mpi_pool_gives_the_same_bits(monkeypatch: pytest.MonkeyPatch, serial: Any) -> None:
    pretend_mpi(monkeypatch, FakePool)
    todo, found = small()
    with mpi_pool(None) as workers:
        assert workers.count == 2
        assert_same(serial, sweep(todo, found.rows, workers))


def test_mpi_without_ranks_is_told_of(monkeypatch: pytest.MonkeyPatch) -> None:
    pretend_mpi(monkeypatch, Alone)
    with pytest.raises(CommandError, match="no other ranks; start with 'mpiexec"), mpi_pool(1):
        pass


# The MPI library is the machine's, no package of ours: without it the pretended pool above serves.
@pytest.mark.slow
@pytest.mark.skipif(
    find_spec("mpi4py") is None or shutil.which("mpiexec") is None,
    reason="needs the mpi extra and an MPI library",
)
def test_mpi_ranks_give_the_same_table(tmp_path: Path) -> None:
    options = ["sweep", "paper", "--vary", "planetary.planets=3,4,40", "--route", "equations"]
    module = [sys.executable, "-m", "mpi4py.futures", "-m", "validation.cli"]
    far = ["--executor", "mpi", "--out", str(tmp_path / "far")]
    root = Path(__file__).parents[3]
    subprocess.run(
        ["mpiexec", "-n", "3", *module, *options, *far], check=True, timeout=PATIENCE, cwd=root
    )
    assert run(*options[1:], "--executor", "serial", "--out", str(tmp_path / "here")) == 0
    one, other = ((tmp_path / name / "sweep.csv").read_bytes() for name in ("far", "here"))
    assert one == other


# What is asked for


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--executor", "threads"], "--executor = 'threads': must be processes, serial, mpi, or"),
        (["--executor", "udp://x:1"], "must be processes, serial, mpi, or the scheduler"),
        (["--executor", "tcp://"], "'tcp://': must be processes, serial, mpi, or the scheduler"),
        (["--executor", "tcp://x"], "of a dask cluster as tcp://host:port"),
        (["--executor", "tcp://x:y"], "of a dask cluster as tcp://host:port"),
        (["--executor", "serial", "--workers", "2"], "--workers = 2: --executor serial has its"),
        (["--executor", "tcp://x:1", "--workers", "2"], "--executor tcp://x:1 has its own"),
    ],
)
def test_what_cannot_be_is_one_message(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[str], said: str
) -> None:
    vary = ["paper", "--vary", "planetary.planets=3,4", "--out", str(tmp_path)]
    assert run(*vary, *options) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    ("kind", "module", "extra"),
    [("tcp://127.0.0.1:8786", "distributed", "dask"), ("mpi", "mpi4py", "mpi")],
)
def test_a_missing_extra_is_one_message(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    kind: str,
    module: str,
    extra: str,
) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    vary = ["paper", "--vary", "planetary.planets=3,4", "--out", str(tmp_path)]
    assert run(*vary, "--executor", kind) == 2
    assert capsys.readouterr().err == (
        f"crosscheck: --executor: {module} is not installed; "
        f"python -m pip install 'drivetrain-crosscheck[{extra}]'\n"
    )


def test_serial_is_this_process() -> None:
    with opened("serial") as workers:
        assert workers.executor is None
    with opened(None, worth=1) as workers:
        assert workers.executor is None
