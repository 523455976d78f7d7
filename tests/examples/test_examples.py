"""Each example runs, and gives the number that theory or a published table says."""

from __future__ import annotations

import runpy
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mbs_models import Kind, build_stage, linearize, unregister_stage
from validation import publish

HERE = Path(__file__).parent


def example(name: str) -> dict[str, Any]:
    """The names an example leaves behind."""
    return runpy.run_path(str(HERE / f"{name}.py"))


def test_planetary_modes() -> None:
    """Lin & Parker (1999), Table 2, N = 4: to the digits printed."""
    by_kind = example("planetary_modes")["by_kind"]
    published = [0.0, 1536.6, 1970.6, 2625.7, 7773.6, 13071.1]
    rotational = by_kind[Kind.RIGID_BODY] + by_kind[Kind.ROTATIONAL]
    np.testing.assert_allclose(rotational, published, atol=0.1)
    np.testing.assert_allclose(by_kind[Kind.PLANET], [1808.2, 5963.8, 6981.7], atol=0.1)


def test_two_beams() -> None:
    """Coupling at a node is assembling its element matrices: round-off apart, the same."""
    run = example("two_beams")
    assert run["error"] < 1e-8
    magnitude, lines = np.abs(run["coupled"]), run["lines"]
    first = 1.8751040687**2 * np.sqrt(run["E_I"] / run["RHO_A"]) / (2.0 * np.pi)  # of 1 m
    assert lines[np.argmax(magnitude[: lines.searchsorted(3.0 * first)])] == pytest.approx(
        first, abs=0.25
    )


def test_swapped_stage() -> None:
    """A stage's own FRFs, through a file of single digits' loss at most, change nothing."""
    assert example("swapped_stage")["worst_db"] < 1e-5


def test_truncation() -> None:
    """Each residual takes every left-out mode's share down by (ω/ω_r)², (2000/5964)² at most.

    The largest error is a drive point's, where all shares have one sign.
    """
    errors = example("truncation")["errors"]
    ratio = (2000.0 / 5963.0) ** 2
    assert errors[0] <= ratio * errors[None]
    assert errors[1] <= ratio * errors[0]


def test_run_at_speed() -> None:
    """Torque over base radius; the sun's is shared by four planets."""
    run = example("run_at_speed")
    mean, statics = run["mean"], run["statics"]
    assert mean["mesh reducer.pinion – wheel"] == pytest.approx(statics, rel=1e-6)
    assert len(mean) == 9


def test_loaded_mesh() -> None:
    """500 N m at a base radius of 24 mm."""
    run = example("loaded_mesh")
    force = run["point"].mesh_forces["mesh reducer.pinion – wheel"]
    assert force == pytest.approx(500.0 / run["drivetrain"].radius("reducer.pinion"), rel=1e-9)


def test_gear_pair() -> None:
    """Bearings of 1e15 N/m give way by 1e-7 of the mesh's stiffness."""
    run = example("gear_pair")
    rigid, elastic = run["frequencies"][:2]
    assert rigid == 0.0
    assert elastic == pytest.approx(run["by_hand"], rel=1e-6)


def test_long_train() -> None:
    """The closed form of a chain, to half a line."""
    run = example("long_train")
    magnitude = np.abs(run["chain"].frf.between("x0", "x0"))
    peaks = 1 + np.flatnonzero(
        (magnitude[1:-1] > magnitude[:-2]) & (magnitude[1:-1] > magnitude[2:])
    )
    expected = run["resonances"][run["resonances"] < 300.0]
    found = run["lines"][peaks]
    np.testing.assert_allclose(found, expected[: len(found)], atol=0.51)
    assert len(found) == len(expected)


@pytest.fixture
def own_stage_type() -> Iterator[dict[str, Any]]:
    yield example("own_stage_type")
    unregister_stage("shaft")


def test_own_stage_type(own_stage_type: dict[str, Any], tmp_path: Path) -> None:
    """Alone, without its half of the hub (none): two inertias I on a spring k, ω² = 2 k/I."""
    result, drivetrain = own_stage_type["result"], own_stage_type["drivetrain"]
    assert [check.subject for check in result.checks if not check.agrees] == []
    assert "part shaft" in {check.subject for check in result.checks}
    alone = linearize(build_stage(drivetrain, "shaft"))
    (rigid, elastic) = np.linalg.eigvalsh(np.linalg.solve(alone.mass, alone.stiffness))
    assert elastic == pytest.approx(2.0 * 4e4 / 2e-3, rel=1e-12)
    assert abs(rigid) < 1e-12 * elastic
    page = publish(result, tmp_path)[0].read_text(encoding="utf-8")
    assert "<title>shaft.left: r = 50 mm</title>" in page
    assert "<title>shaft shaft.right – shaft.left: 4e+04 N m/rad</title>" in page


def test_stiffness_sweep() -> None:
    """Two rigid halves on a soft spring: ω ∝ √k, so long as it is far below what they have else."""
    run = example("stiffness_sweep")
    lowest, stiffness = run["lowest"], run["stiffness"]
    slope = np.diff(np.log(lowest)) / np.diff(np.log(stiffness))
    assert slope[0] == pytest.approx(0.5, abs=1e-3)  # (13 Hz / 727 Hz)² off
    assert (np.diff(lowest) > 0.0).all()


def test_decoupled_part() -> None:
    """The part comes back to round-off; noise does most at its own poles, where D vanishes."""
    run = example("decoupled_part")
    assert run["error"] < 1e-10
    relative = (run["spread"] / np.abs(run["part"].values)).max(axis=(1, 2))
    poles = np.sqrt(np.linalg.eigvalsh(run["springs_a"])) / (2.0 * np.pi)  # Hz, masses of 1 kg
    assert np.abs(poles - run["lines"][np.argmax(relative)]).min() < 0.5
