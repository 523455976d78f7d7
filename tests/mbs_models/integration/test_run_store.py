"""Runs kept in a directory: resumed bit for bit, never mixed up, never larger than a piece."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mbs_models.contact.mesh_excitation import MeshLaw
from mbs_models.errors import ModelError
from mbs_models.integration.fingerprint import fingerprint
from mbs_models.integration.integrators import RK44, TRAPEZOIDAL, Integrator
from mbs_models.integration.run_store import StoredRunError, read_run, remove_run
from mbs_models.integration.time_integration import simulate
from mbs_models.integration.transient_record import QUANTITIES, TransientRecord
from mbs_models.model.excitation import Excitation
from mbs_models.model.model_file import load
from mbs_models.signals.lines import BandNoise, Harmonic
from mbs_models.signals.waveforms import FourierSeries
from mbs_models.system.drivetrain import MultibodySystem, build_drivetrain
from tests.strategies import damped

SUN = "planetary.sun.w"
ARRAYS = ("forces", *QUANTITIES)
LAW = MeshLaw(frequency=700.0, stiffness=FourierSeries((0.2,), (0.0,)))
MESH = "mesh planetary.sun – planet1"


class Interrupted(Exception):
    """What a user does to a run."""


def system(**laws: Any) -> MultibodySystem:
    return build_drivetrain(damped(load("lin-parker-4")), laws.get("meshes"))


def run(store: Path | None, name: str = RK44, **changes: Any) -> TransientRecord:
    settings: dict[str, Any] = {
        "duration": 0.02,
        "integrator": Integrator(name, 1e-5, "as given"),
        "sampling_frequency": 50000.0,
        "piece": 3e-3,
        "record": QUANTITIES,
    }
    force = changes.pop("amplitude", 1.0)
    meshes = changes.pop("meshes", {MESH: LAW})
    excitations = [Excitation(SUN, Harmonic(force, 1500.0))]
    return simulate(system(meshes=meshes), excitations, store=store, **(settings | changes))


def interrupted(store: Path, after: int, **changes: Any) -> None:
    """A run stopped when so many steps are done."""

    def stop(name: str, done: int, total: int) -> None:
        if done >= after:
            raise Interrupted

    with pytest.raises(Interrupted):
        run(store, progress=stop, **changes)


@pytest.mark.parametrize("name", [RK44, TRAPEZOIDAL])
def test_a_resumed_run_is_the_uninterrupted_one_bit_for_bit(name: str, tmp_path: Path) -> None:
    whole = run(None, name)
    interrupted(tmp_path / "run", 900, name=name)
    interrupted(tmp_path / "run", 1500, name=name)
    told: list[int] = []
    resumed = run(tmp_path / "run", name, progress=lambda what, done, total: told.append(done))
    assert told == [1500, 1800, 2000]
    for what in ARRAYS:
        np.testing.assert_array_equal(getattr(resumed, what), getattr(whole, what), err_msg=what)
    assert (resumed.aliasing, resumed.warnings) == (whole.aliasing, whole.warnings)
    assert resumed.labels == whole.labels
    assert resumed.meshes == whole.meshes
    assert resumed.integrator == whole.integrator


def test_what_was_written_after_the_checkpoint_is_written_again(tmp_path: Path) -> None:
    """As if the machine had stopped in the middle of a piece."""
    whole = run(None)
    interrupted(tmp_path, 900)
    part = tmp_path / "displacement.npy.part"
    with part.open("ab") as file:
        file.write(b"half a piece")
    (tmp_path / f".{'0' * 16}.partial").write_bytes(b"half a checkpoint")
    np.testing.assert_array_equal(run(tmp_path).displacement, whole.displacement)


def test_a_run_stopped_before_it_had_its_arrays_begins_again(tmp_path: Path) -> None:
    whole = run(None)
    interrupted(tmp_path, 0)
    (tmp_path / "displacement.npy.part").unlink()
    (tmp_path / "checkpoint").unlink(missing_ok=True)
    np.testing.assert_array_equal(run(tmp_path).displacement, whole.displacement)


@pytest.mark.parametrize("finished", [True, False])
def test_only_files_of_the_run_are_removed(finished: bool, tmp_path: Path) -> None:
    run(tmp_path) if finished else interrupted(tmp_path, 900)
    (tmp_path / f".{'0' * 16}.partial").write_bytes(b"half a checkpoint")
    (tmp_path / "photo.npy").write_bytes(b"mine")
    remove_run(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["photo.npy"]
    (tmp_path / "photo.npy").unlink()
    remove_run(tmp_path)
    assert not tmp_path.exists()


@pytest.mark.skipif(sys.platform == "win32", reason="making links takes rights there")
@pytest.mark.parametrize("name", ["checkpoint", "velocity.npy", "velocity.npy.part"])
def test_a_link_in_a_new_directory_is_not_followed(name: str, tmp_path: Path) -> None:
    store, outside = tmp_path / "run", tmp_path / "outside"
    store.mkdir()
    (store / name).symlink_to(outside)
    with pytest.raises(ModelError, match=rf"{name}: is there without a run\.json"):
        run(store)
    assert not outside.exists()


def test_a_finished_run_is_read_not_run_again(tmp_path: Path) -> None:
    first = run(tmp_path)
    told: list[int] = []
    again = run(tmp_path, progress=lambda what, done, total: told.append(done))
    assert told == [2000]
    np.testing.assert_array_equal(again.velocity, first.velocity)
    names = {f"{what}.npy" for what in ARRAYS} | {"run.json", "checkpoint"}
    assert {path.name for path in tmp_path.iterdir()} == names


def test_samples_are_read_as_maps_of_themselves(tmp_path: Path) -> None:
    whole = run(tmp_path)
    part = read_run(tmp_path, 300, 700)
    assert isinstance(part.displacement, np.memmap)
    assert part.start == 300 / 50000.0
    for what in ARRAYS:
        np.testing.assert_array_equal(getattr(part, what), getattr(whole, what)[300:700])
    np.testing.assert_array_equal(np.load(tmp_path / "forces.npy"), whole.forces)
    assert read_run(tmp_path, 1000).n_samples == 0


@pytest.mark.parametrize(
    "change",
    [
        {"amplitude": 2.0},
        {"name": TRAPEZOIDAL},
        {"integrator": Integrator(RK44, 5e-6, "as given")},
        {"duration": 0.03},
        {"piece": 2e-3},
        {"sampling_frequency": 25000.0},
        {"record": ("displacement",)},
        {"responses": (SUN,)},
        {"start_state": (np.full(21, 1e-9), np.zeros(21))},
        {"meshes": {}},
        {"meshes": {MESH: MeshLaw(frequency=701.0, stiffness=LAW.stiffness)}},
    ],
)
def test_another_run_in_the_same_directory_is_refused(
    change: dict[str, Any], tmp_path: Path
) -> None:
    interrupted(tmp_path, 900)
    with pytest.raises(ModelError, match="holds another run"):
        run(tmp_path, **change)


def test_directories_that_are_not_to_be_used(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="no run is stored there"):
        read_run(tmp_path)
    (tmp_path / "displacement.npy").write_bytes(b"somebody's")
    with pytest.raises(ModelError, match=r"displacement.npy: is there without a run.json"):
        run(tmp_path)
    (tmp_path / "run.json").write_text("{}")
    with pytest.raises(ModelError, match=r"run.json: is not a run's description"):
        run(tmp_path)


def test_damaged_and_unfinished_runs_are_said_to_be(tmp_path: Path) -> None:
    interrupted(tmp_path, 900)
    with pytest.raises(ModelError, match="not finished; run it again to resume it"):
        read_run(tmp_path)
    part, checkpoint = tmp_path / "velocity.npy.part", tmp_path / "checkpoint"
    for content in (
        part.read_bytes()[:1000],
        part.read_bytes()[:50],
        (tmp_path / "displacement.npy.part").read_bytes(),
        part.read_bytes()[:-9] + b"x" + part.read_bytes()[-8:],
    ):
        part.write_bytes(content)
        with pytest.raises(StoredRunError, match=r"velocity.npy.part: its samples are not those"):
            run(tmp_path)
    whole = checkpoint.read_bytes()
    for content in (b"", b"no archive", whole[:-1], whole[:-1] + bytes([whole[-1] ^ 1])):
        checkpoint.write_bytes(content)
        with pytest.raises(StoredRunError, match=r"checkpoint: is damaged, or another run's"):
            run(tmp_path)
    remove_run(tmp_path)
    assert not tmp_path.exists()


def test_a_checkpoint_of_another_run_is_none(tmp_path: Path) -> None:
    """Nor can arrays and checkpoint of two runs be mixed."""
    for name, force in (("one", 1.0), ("two", 2.0)):
        interrupted(tmp_path / name, 900, amplitude=force)
    shutil.copy(tmp_path / "two" / "checkpoint", tmp_path / "one" / "checkpoint")
    with pytest.raises(StoredRunError, match="checkpoint: is damaged, or another run's"):
        run(tmp_path / "one")


def test_other_code_does_not_go_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    interrupted(tmp_path, 900)
    monkeypatch.setattr(
        "mbs_models.integration.time_integration.code_digest", lambda *_: "another version"
    )
    with pytest.raises(StoredRunError, match="versions differ"):
        run(tmp_path)


def test_a_record_larger_than_the_disk_is_refused_before_it_starts(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="GiB are free"):
        run(tmp_path, duration=1e9)


def test_free_motion_is_stored_without_forces(tmp_path: Path) -> None:
    start = (np.full(21, 1e-9), np.zeros(21))
    settings: dict[str, Any] = {"duration": 1e-3, "start_state": start, "piece": 2e-4}
    integrator = Integrator(RK44, 1e-5, "as given")
    stored = simulate(system(), [], integrator=integrator, store=tmp_path, **settings)
    kept = simulate(system(), [], integrator=integrator, **settings)
    assert stored.forces.shape == kept.forces.shape == (100, 0)
    np.testing.assert_array_equal(stored.displacement, kept.displacement)


# Fingerprints


def law(stiffness: float) -> Any:
    def force(stretch: float) -> float:
        return stiffness * stretch

    return force


def other_law(stiffness: float) -> Any:
    def force(stretch: float) -> float:
        return stiffness + stretch

    return force


def test_fingerprints_tell_contents_apart() -> None:
    noise = BandNoise(10.0, 100.0, 1.0, 1.0, 1)
    values = [
        1, 1.0, "1", True, None, (1, 2), (2, 1), ((1,), 2), {"a": 1}, {"a": 2}, {"b": 1},
        np.array([1.0, 2.0]), np.array([[1.0, 2.0]]), np.array([1, 2]), noise,
        BandNoise(10.0, 100.0, 1.0, 1.0, 2), Harmonic(1.0, 2.0), Harmonic(2.0, 1.0),
        law(1.0), law(2.0), other_law(1.0), LAW.stiffness.value, LAW.stiffness.slope,
    ]  # fmt: skip
    assert len({fingerprint(value) for value in values}) == len(values)


def test_fingerprints_are_of_contents_alone() -> None:
    noise = BandNoise(10.0, 100.0, 1.0, 1.0, 1)
    before = fingerprint(noise, law(3.0), np.arange(3.0))
    noise.values(np.arange(5.0))  # what it computes for itself is not part of it
    assert fingerprint(noise, law(3.0), np.arange(3.0)) == before
    itself: list[Any] = [1]
    itself.append(itself)
    assert fingerprint(itself) == fingerprint(itself)


# Memory

GROWTH = """
import sys, tempfile
from pathlib import Path
from mbs_models.model.excitation import Excitation
from mbs_models.integration.integrators import RK44, Integrator
from mbs_models.signals.lines import BandNoise
from mbs_models.integration.time_integration import simulate
from tests.mbs_models.integration.test_run_store import SUN, system

def resident():
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("RssAnon"))

sizes = []
with tempfile.TemporaryDirectory() as folder:
    simulate(
        system(), [Excitation(SUN, BandNoise(10.0, 4000.0, 1.0, 1.0, 1))],
        duration=2.0, integrator=Integrator(RK44, 1e-5, ""), sampling_frequency=50000.0,
        piece=0.05,
        record=("displacement", "velocity", "acceleration", "mesh_forces"),
        store=Path(folder), progress=lambda name, done, total: sizes.append(resident()),
    )
print(*sizes)
"""


@pytest.mark.slow
# Only Linux tells memory from the pages of mapped files, which come and go as it likes.
@pytest.mark.skipif(sys.platform != "linux", reason="reads RssAnon off /proc")
def test_memory_does_not_grow_with_the_number_of_pieces() -> None:
    """40 pieces, 60 MB of samples: between the first few and the last no more than 2 MB come in.

    0.1 MB a piece would be 3 MB here, and 1.8 GB in the 18 000 pieces of an hour at 1e-5 s.
    """
    done = subprocess.run(
        [sys.executable, "-c", GROWTH], capture_output=True, text=True, check=True
    )
    sizes = np.array([float(word) for word in done.stdout.split()]) / 1024.0
    assert len(sizes) == 41
    assert sizes[-10:].max() - sizes[5:15].max() < 2.0
    assert sizes.max() < 500.0
