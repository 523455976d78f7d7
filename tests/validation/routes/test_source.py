"""Sources: each system is built once, when it is first asked for, and serves everything."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from mbs_models.modal.modes import drivetrain_modes
from mbs_models.model.model_file import dumps, load
from mbs_models.system import drivetrain as builder
from mbs_models.system.drivetrain import MultibodySystem
from mbs_models.system.read_back import drivetrain_components
from tests.strategies import damped, paper
from tests.validation.command_line import call
from validation.routes.multibody import stage_system
from validation.routes.source import equations_source, exudyn_source

BAND = ["--fmin", "500", "--fmax", "4000", "--df", "500"]
HUB = ["--response", "coupling.w", "--excitation", "coupling.w"]


@pytest.fixture
def built(monkeypatch: pytest.MonkeyPatch) -> Counter[tuple[str, ...]]:
    """How often each exudyn system has been put together: by its parameters and its bodies."""
    counted: Counter[tuple[str, ...]] = Counter()
    finish = builder._finish

    def counting(train: builder._Train) -> MultibodySystem:
        system = finish(train)
        counted[(train.drivetrain.model_dump_json(), *system.bodies)] += 1
        return system

    monkeypatch.setattr(builder, "_finish", counting)
    return counted


def whole_and_parts(counted: Counter[tuple[str, ...]]) -> list[int]:
    """How many systems there are of each drivetrain."""
    return sorted(Counter(parameters for parameters, *_ in counted).values())


def test_run_builds_the_whole_and_each_part_once(
    built: Counter[tuple[str, ...]], tmp_path: Path
) -> None:
    """Whole, reducer and planetary stage; once more with the damping lent to the run in time."""
    assert call("run", "paper", "--out", str(tmp_path), *BAND) == 0
    assert set(built.values()) == {1}
    assert whole_and_parts(built) == [3, 3]


def test_run_of_a_damped_model_builds_nothing_twice(
    built: Counter[tuple[str, ...]], tmp_path: Path
) -> None:
    model = tmp_path / "damped.toml"
    model.write_text(dumps(damped(paper())), encoding="utf-8")
    assert call("run", str(model), "--out", str(tmp_path / "out"), *BAND) == 0
    assert set(built.values()) == {1}
    assert whole_and_parts(built) == [3]


@pytest.mark.parametrize(
    ("arguments", "systems"),
    [
        (["modes", "paper"], 1),
        (["frf", "paper", "--response", "all", "--excitation", "coupling.w", *BAND], 1),
        (["frf", "paper", "--response", "all", "--excitation", "all", "--route", "fbs", *BAND], 2),
        (
            ["frf", "paper", "--stage", "planetary", *HUB, *BAND],
            1,
        ),
        (["check", "paper"], 1),
    ],
    ids=["modes", "frf", "frf by FBS", "frf of a stage", "check"],
)
def test_commands_build_each_system_once(
    arguments: list[str], systems: int, built: Counter[tuple[str, ...]]
) -> None:
    assert call(*arguments) == 0
    assert set(built.values()) == {1}
    assert len(built) == systems


def test_a_sweep_builds_each_sample_once(built: Counter[tuple[str, ...]], tmp_path: Path) -> None:
    """Two planet numbers: the planetary stage of each, the reducer of neither anew."""
    given = ["--vary", "planetary.planets=3,4", "--modes", "3", "--workers", "1"]
    pair = ["--response", "planetary.sun.w", "--excitation", "reducer.pinion.w"]
    assert call("sweep", "paper", *given, *pair, *BAND, "--out", str(tmp_path)) == 0
    assert set(built.values()) == {1}


def test_the_papers_items_build_no_system_twice(
    built: Counter[tuple[str, ...]], tmp_path: Path
) -> None:
    assert call("paper", "--only", "fig8", "--out", str(tmp_path)) == 0
    assert set(built.values()) == {1}


def test_a_source_serves_what_is_built_on_its_own() -> None:
    drivetrain = damped(paper())
    source = exudyn_source(drivetrain)
    own = stage_system(drivetrain, "planetary")
    np.testing.assert_array_equal(source.stage("planetary").stiffness, own.stiffness)
    assert source.stage("planetary") is source.stages["planetary"]
    assert [spring.name for spring in source.components.springs] == [
        spring.name for spring in drivetrain_components(drivetrain).springs
    ]
    for mode, alone in zip(source.modes.modes, drivetrain_modes(drivetrain).modes, strict=True):
        assert mode == alone


@pytest.mark.parametrize("preset", ["paper", "lin-parker-5", "wind-turbine", "geared-torsional"])
def test_two_sources_name_and_share_modes_alike(preset: str) -> None:
    """exudyn's springs read back, and parts' matrices of the equations, hold the same energy."""
    drivetrain = load(preset)
    pairs = zip(
        exudyn_source(drivetrain).modes.modes,
        equations_source(drivetrain).modes.modes,
        strict=True,
    )
    for ours, theirs in pairs:
        assert ours.kind == theirs.kind
        assert ours.shares.strain == pytest.approx(theirs.shares.strain, abs=1e-6)
