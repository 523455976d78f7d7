"""A run proves itself: planted defects end in a verdict that names them, good runs agree."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mbs_models.gears.operating_point import OperatingPoint, operating_point
from mbs_models.integration.integrators import TRAPEZOIDAL, Integrator
from mbs_models.integration.time_integration import simulate
from mbs_models.integration.transient_record import TransientRecord
from mbs_models.model.model_file import load
from mbs_models.model.parameters import Drivetrain
from mbs_models.system import elements
from mbs_models.system.drivetrain import build_drivetrain
from tests.gearboxes import pair, planetary
from tests.geared import speed_for
from validation import cli
from validation.checks.check import Check
from validation.report.console import console
from validation.runtime import streams
from validation.runtime.streams import progress_bars
from validation.simulation.console import print_result
from validation.simulation.gear_run import NOTHING_EXCITES
from validation.simulation.options import Options
from validation.simulation.proof import run_checks, static_mesh_forces
from validation.simulation.run import run_simulation

STATICS, MEANS, SHARES, GROWTH, ENERGY, FREE = (
    "static mesh forces",
    "mean mesh forces",
    "sun and ring force of each planet",
    "growth of the mesh forces",
    "energy against work",
    "free rotation",
)
RECORDED = ("displacement", "velocity", "mesh_forces", "contact", "energy", "work")


@cache
def turning() -> tuple[Drivetrain, OperatingPoint, TransientRecord]:
    """A planetary stage with varying sun meshes, 0.2 s at 900 Hz of mesh frequency."""
    drivetrain = planetary()
    point = operating_point(drivetrain, speed_rpm=speed_for(drivetrain, 900.0), torque=100.0)
    record = simulate(
        build_drivetrain(drivetrain, point.laws),
        point.loads,
        duration=0.2,
        integrator=Integrator(TRAPEZOIDAL, 2e-5, "test"),
        start_state=point.start_state,
        record=RECORDED,
    )
    return drivetrain, point, record


def verdicts(change: Callable[[TransientRecord], dict[str, Any]] | None = None) -> dict[str, Check]:
    """Checks of that run with something changed in its record."""
    drivetrain, point, record = turning()
    if change is not None:
        record = replace(record, **change(record))
    found, unjudged = run_checks(drivetrain, point, record, 0.05, 6000.0)
    assert not unjudged
    return {check.name: check for check in found}


def test_a_good_run_agrees_with_itself() -> None:
    found = verdicts()
    assert list(found) == [STATICS, MEANS, SHARES, GROWTH, ENERGY, FREE]
    assert all(check.agrees for check in found.values()), found
    # Newton's method leaves 1e-9 of the force, and the balance holds step by step.
    assert found[SHARES].value < 1e-6
    assert found[ENERGY].value < 1e-7


def weaker(record: TransientRecord) -> dict[str, Any]:
    """Every sun mesh carries a thousandth less than the torque asks for, every ring mesh too."""
    assert record.mesh_forces is not None
    return {"mesh_forces": 0.999 * record.mesh_forces}


def unequal(record: TransientRecord) -> dict[str, Any]:
    """One planet's ring mesh carries more than its sun mesh, another's as much less."""
    assert record.mesh_forces is not None
    forces = record.mesh_forces.copy()
    ring = [i for i, name in enumerate(record.meshes) if ".ring" in name]
    forces[:, ring[0]] *= 1.001
    forces[:, ring[1]] *= 0.999
    return {"mesh_forces": forces}


def growing(record: TransientRecord) -> dict[str, Any]:
    """What swings about the mean grows by e³ a second."""
    assert record.mesh_forces is not None
    mean = record.mesh_forces.mean(axis=0)
    return {"mesh_forces": mean + np.exp(3.0 * record.time)[:, None] * (record.mesh_forces - mean)}


def gaining(record: TransientRecord) -> dict[str, Any]:
    """A millionth of the energy stored comes from nowhere every millisecond."""
    assert record.energy is not None
    return {"energy": record.energy * (1.0 + 1e-3 * record.time)}


def creeping(record: TransientRecord) -> dict[str, Any]:
    """All w run away by 0.1 mm/s, as nothing that strains."""
    assert record.displacement is not None
    ratio = np.array([label.endswith((".sun.w", ".carrier.w")) for label in record.labels])
    return {"displacement": record.displacement + 1e-4 * np.outer(record.time, ratio)}


@pytest.mark.parametrize(
    ("defect", "name", "words"),
    [
        (weaker, MEANS, "planetary sun_mesh: mean 2581"),
        (unequal, SHARES, "mesh planetary.sun – planet1: 645.9"),
        (growing, GROWTH, "grows by a factor of e in 0.3"),
        (gaining, ENERGY, "energy and work part by"),
        (creeping, FREE, "creeps by"),
    ],
)
def test_a_planted_defect_is_named(
    defect: Callable[[TransientRecord], dict[str, Any]], name: str, words: str
) -> None:
    found = verdicts(defect)
    broken = [check.name for check in found.values() if not check.agrees]
    assert name in broken
    assert any(words in finding for finding in found[name].findings), found[name].findings
    assert set(broken) <= {name, MEANS}  # uneven shares do change a family's sum by round-off


def test_statics_by_the_equations_are_torque_over_radius() -> None:
    """100 N m on a sun of 38.7 mm with four planets; every mesh of a planet alike."""
    drivetrain, point, _ = turning()
    expected = 100.0 / 4.0 / 0.0387
    found = static_mesh_forces(drivetrain, point)
    assert found == pytest.approx(dict.fromkeys(found, expected), rel=1e-9)
    turbine = load("wind-turbine")
    rated = operating_point(turbine, torque=4.18e6)
    low = static_mesh_forces(turbine, rated)
    # Teeth 19 and 56: the sun takes 19/75 of the carrier's torque; radii have six digits.
    sun = 4.18e6 * 19.0 / 75.0 / 3.0 / 0.4017185
    assert low["mesh low_speed.sun – planet1"] == pytest.approx(sun, rel=2e-5)


# What a spring between two points of the gears does, which is a linkage

PAIR = """
name = "spur pair 20/20, module 10"
[damping]
stiffness_proportional = 5e-6
[operation]
input = "g.pinion"
output = "g.wheel"
speed_range = [100.0, 3000.0]
[[stage]]
type = "parallel"
name = "g"
mesh_stiffness = 517925405.0
pinion = { mass = 6.57, base_radius = 0.09396926207859085, teeth = 20, polar_inertia = 0.0365292, diametral_inertia = 0.0182646, bearing_y = 1e8, bearing_z = 1e8, bearing_rocking = 1e6 }
wheel = { mass = 6.57, base_radius = 0.09396926207859085, teeth = 20, polar_inertia = 0.0365292, diametral_inertia = 0.0182646, bearing_y = 1e8, bearing_z = 1e8, bearing_rocking = 1e6 }
"""  # noqa: E501


def linkage(pair: Any, size: int, force: Any) -> Callable[..., list[float]]:
    """Forces of a spring between the tangent points, as they turn with the gears."""
    assert size == 6
    (x_0, y_0), (r_1, r_2) = pair.centre, pair.radii

    def forces(mbs: Any, time: float, item: int, q: list[float], v: list[float]) -> list[float]:
        one = np.array([q[0], q[1]]) + r_1 * np.array([math.cos(q[5]), math.sin(q[5])])
        other = np.array([x_0 + q[6], y_0 + q[7]])
        other -= r_2 * np.array([math.cos(q[11]), math.sin(q[11])])
        along = other - one
        length = float(np.hypot(*along))
        rest = math.sqrt(x_0**2 + y_0**2 - (r_1 + r_2) ** 2)
        pressed = force(time, rest - length, 0.0)[0]
        n = along / length
        arms = (one - np.array(q[:2])), (other - np.array([x_0 + q[6], y_0 + q[7]]))
        turn_1 = -pressed * (arms[0][0] * n[1] - arms[0][1] * n[0])
        turn_2 = pressed * (arms[1][0] * n[1] - arms[1][1] * n[0])
        return [
            -pressed * n[0], -pressed * n[1], 0.0, 0.0, 0.0, turn_1,
            pressed * n[0], pressed * n[1], 0.0, 0.0, 0.0, turn_2,
        ]  # fmt: skip

    return forces


def test_a_linkage_in_the_place_of_teeth_is_no_green_verdict(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The run that once said factor 8.43 and agreed: now 1.000; with the linkage, exit code 1."""
    model = tmp_path / "pair.toml"
    model.write_text(PAIR, encoding="utf-8")
    asked = ["simulate", str(model), "--speed", "1200", "--torque", "1000", "--duration", "0.3"]

    def code(out: str) -> int:
        try:
            cli.main([*asked, "--out", str(tmp_path / out)])
        except SystemExit as exit_:
            return int(exit_.code or 0)
        return 0

    assert code("teeth") == 0
    monkeypatch.setattr(elements, "mesh_forces_on_bodies", linkage)
    assert code("linkage") != 0


# Words


def test_nothing_excites(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    simulation = run_simulation(pair(), Options(speed_rpm=600.0, torque=100.0, duration=0.05))
    assert simulation.agrees
    assert simulation.gears is not None
    assert not simulation.gears.excites
    (load,) = simulation.gears.loads
    assert load.dynamic_factor == pytest.approx(1.0, abs=1e-9)
    print_result(simulation, console())
    assert NOTHING_EXCITES in capsys.readouterr().out.replace("\n", " ")


def test_a_speed_of_0_asks_for_frfs_under_the_torque(tmp_path: Path) -> None:
    """The model file has a speed and a torque: FRFs about the loaded state, against FBS there."""
    drivetrain = pair(mesh_variation={"shape": "harmonics", "harmonics": [[0.2, 0.0]]})
    assert drivetrain.operation is not None
    operation = drivetrain.operation.model_copy(update={"speed": 900.0})
    model = tmp_path / "pair.toml"
    from mbs_models.model.model_file import dumps

    model.write_text(dumps(drivetrain.model_copy(update={"operation": operation})))
    with pytest.raises(SystemExit) as ended:
        cli.main(["simulate", str(model), "--speed", "0", "--out", str(tmp_path / "out")])
    assert not ended.value.code
    text = (tmp_path / "out" / "simulation.json").read_text(encoding="utf-8")
    assert '"frfs":[{' in text
    assert "FRFs from time integration" in text


def test_teeth_that_part_are_counted_on_the_deflection() -> None:
    """10 µm of play, a light torque, an error of 8 µm: the damper does not hide the gap."""
    drivetrain = pair(
        mesh_backlash=1e-5, mesh_transmission_error={"harmonics": [[8e-6, 0.0]]}, beta=4e-6
    )
    options = Options(speed_rpm=6000.0, torque=1.0, duration=0.2)
    simulation = run_simulation(drivetrain, options)
    assert simulation.gears is not None
    (load,) = simulation.gears.loads
    assert 0.05 < load.open_share < 0.95
    assert load.smallest >= 0.0 or load.reversed_share > 0.0
    record = simulation.record
    assert record.contact is not None
    assert record.mesh_forces is not None
    apart = np.asarray(record.contact) == 0.0
    assert np.abs(np.asarray(record.mesh_forces)[apart]).max() == 0.0


def test_progress_without_a_terminal_is_told_line_by_line(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(streams, "BETWEEN_LINES", 0.0)
    with progress_bars() as step:
        step("time integration", 3, 10)
    assert capsys.readouterr().err == "time integration: 3 of 10, 0 s\n"
