"""The involute mesh: geometry against a belt drawn on the base circles, and exudyn with it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from mbs_models.contact.involute_mesh import (
    InvolutePair,
    curvature,
    gradient,
    mesh_motion,
    transverse_mesh,
)
from mbs_models.gears.operating_point import operating_point
from mbs_models.integration.integrators import RK44, TRAPEZOIDAL, Integrator
from mbs_models.integration.time_integration import simulate
from mbs_models.model.parameters import Drivetrain, ParallelStage
from mbs_models.system.displaced import forces_at
from mbs_models.system.drivetrain import MultibodySystem, build_drivetrain
from mbs_models.system.linearization import linearize

FloatArray = NDArray[np.float64]


@st.composite
def pairs(draw: st.DrawFn, helical: bool = True) -> InvolutePair:
    kind = draw(st.sampled_from([1.0, -1.0]))
    second = draw(st.floats(0.01, 0.3))
    first = draw(st.floats(0.01, 0.3)) if kind > 0.0 else second * draw(st.floats(1.5, 5.0))
    distance = (first + kind * second) / math.cos(math.radians(draw(st.floats(12.0, 35.0))))
    angle = draw(st.floats(-math.pi, math.pi))
    helix = draw(st.floats(-0.5, 0.5)) if helical else 0.0
    return InvolutePair(
        (distance * math.cos(angle), distance * math.sin(angle)),
        (first, second),
        kind,
        draw(st.sampled_from([1.0, -1.0])),
        helix,
        (first, -kind * second),
    )


def shifts(size: int, scale: float) -> st.SearchStrategy[list[float]]:
    return st.lists(st.floats(-scale, scale), min_size=size, max_size=size)


def belt(pair: InvolutePair, shift: FloatArray) -> float:
    """L + r₁ψ₁ + σ r₂ψ₂, the belt from a mark at angle 0 of one circle to one of the other (m).

    Drawn as a belt is: the tangent touches circle 1 at the angle −α (crossed) or α (open) from the
    line of centres, seen in the stage's sense; what it leaves the first circle by, and comes onto
    the second, is wrapped from the marks.
    """
    x, y = np.array(pair.centre) + shift
    distance, angle = math.hypot(x, y), pair.facing * math.atan2(y, x)
    working = math.acos(pair.base_sum / distance)
    # Open belts touch both circles at the same angle, crossed ones at opposite ones.
    touch = angle - working if pair.kind > 0.0 else angle + working
    points = pair.radii[0] * np.exp(1j * touch), -pair.kind * pair.radii[1] * np.exp(1j * touch)
    tangent = abs(distance * np.exp(1j * angle) + points[1] - points[0])
    return pair.kind * float(tangent) + (pair.radii[0] + pair.kind * pair.radii[1]) * touch


@given(pair=pairs(helical=False), shift=shifts(2, 0.02), turn=st.floats(-0.02, 0.02))
def test_the_deflection_is_the_belts(pair: InvolutePair, shift: list[float], turn: float) -> None:
    moved = pair.base_sum / 20.0 * np.array(shift)
    angles = turn, -0.7 * turn
    found = transverse_mesh(pair, math)(moved[0], moved[1], *angles)
    rolled = pair.facing * (pair.radii[0] * angles[0] + pair.kind * pair.radii[1] * angles[1])
    expected = rolled - (belt(pair, moved) - belt(pair, np.zeros(2)))
    period = 2.0 * math.pi * pair.base_sum  # the oracle's angles jump at half a turn
    expected -= period * round(expected / period)
    assert found[0] == pytest.approx(expected, abs=1e-13)
    assert math.hypot(found[1], found[2]) == pytest.approx(1.0)
    # The working pressure angle: n leans off the line of centres by it.
    along = np.array(pair.centre) + moved
    lean = abs(along @ np.array(found[1:3])) / np.hypot(*along)
    assert lean == pytest.approx(math.sin(math.acos(pair.base_sum / np.hypot(*along))))


@given(pair=pairs(), size=st.sampled_from([3, 6]), data=st.data())
def test_row_and_curvature_are_the_derivatives(
    pair: InvolutePair, size: int, data: st.DataObject
) -> None:
    """Central differences over 1e-5 of the base circles: 1e-10 and 1e-5 of third derivatives."""
    if size == 3:
        pair = InvolutePair(pair.centre, pair.radii, pair.kind, pair.facing)
    scale = pair.base_sum
    at = 0.01 * scale * np.array(data.draw(shifts(2 * size, 1.0)))

    def row(q: FloatArray) -> tuple[FloatArray, float, tuple[float, float, float]]:
        _, n_x, n_y, length = transverse_mesh(pair, math)(
            q[size] - q[0], q[size + 1] - q[1], q[size - 1], q[-1]
        )
        value = mesh_motion(pair, q[None], np.zeros((1, 2 * size)))[0][0]
        return np.array(gradient(pair, n_x, n_y, size)), value, (n_x, n_y, length)

    here, _, (n_x, n_y, length) = row(at)
    step = 1e-5 * scale
    for i, unit in enumerate(np.eye(2 * size) * step):
        ahead, behind = row(at + unit), row(at - unit)
        slope = (ahead[1] - behind[1]) / (2.0 * step)
        assert slope == pytest.approx(here[i], abs=1e-7)
        bent = (ahead[0] - behind[0]) / (2.0 * step)
        expected = curvature(pair, n_x, n_y, length, size)[i]
        np.testing.assert_allclose(bent, expected, atol=1e-4 / scale)


@given(pair=pairs(), turns=st.floats(-1e4, 1e4), rates=shifts(12, 0.1))
def test_a_rigid_roll_strains_nothing_at_any_angle(
    pair: InvolutePair, turns: float, rates: list[float]
) -> None:
    """ε × the arc that has rolled: 2e4 π r × 1e-16."""
    angle = 2.0 * math.pi * turns
    position = np.zeros((1, 12))
    position[0, [5, 11]] = angle, -pair.kind * pair.radii[0] / pair.radii[1] * angle
    deflection, rate = mesh_motion(pair, position, np.array([rates]))
    assert abs(deflection[0]) < 1e-15 * abs(angle) * pair.radii[0] + 1e-15
    still = mesh_motion(pair, np.zeros((1, 12)), np.array([rates]))[1]
    assert rate[0] == pytest.approx(still[0], abs=1e-12)  # arms and line are where they were


@given(pair=pairs(), turn=st.floats(-3.0, 3.0))
def test_a_pair_carried_round_strains_nothing(pair: InvolutePair, turn: float) -> None:
    """A carrier's turn: centres and gears turn alike about the first centre."""
    cos, sin = math.cos(turn), math.sin(turn)
    x, y = pair.centre
    moved = cos * x - sin * y - x, sin * x + cos * y - y
    found = transverse_mesh(pair, math)(*moved, turn, turn)[0]
    assert abs(found) < 1e-14


# exudyn


def pair_drivetrain(helix: float = 0.0, **damping: float) -> Drivetrain:
    """Two different gears on bearings, free to turn."""
    gears = {
        name: {
            "mass": mass, "base_radius": r, "polar_inertia_over_r2": mass / 2.0,
            "diametral_inertia_over_r2": mass / 3.0, "bearing_y": 2e8, "bearing_z": 1e8,
            "bearing_rocking_over_r2": 1e8,
        }
        for name, mass, r in (("pinion", 3.0, 0.04), ("wheel", 9.0, 0.09))
    }  # fmt: skip
    return Drivetrain.model_validate(
        {
            "name": "pair",
            "damping": damping,
            "operation": {
                "input": "pair.pinion", "output": "pair.wheel", "speed_range": [0.0, 1.0],
            },
            "stage": [
                {
                    "type": "parallel", "name": "pair", "mesh_stiffness": 3e8,
                    "helix_angle": helix, **gears,
                }
            ],
        }
    )  # fmt: skip


def potential_energy(system: MultibodySystem, drivetrain: Drivetrain, q: FloatArray) -> float:
    """½ k δ² of the mesh with δ from the belt, and of the bearings."""
    (stage,) = drivetrain.stages_of(ParallelStage)
    (mesh,) = system.meshes.values()
    values = dict(zip((dof.label.removeprefix("pair.") for dof in system.dofs), q, strict=True))
    # Labels to the plane: the stage's frame is the global one, y along the line of action.
    x = np.array([0.0, values["wheel.y"] - values["pinion.y"]])
    rolled = values["pinion.w"] - values["wheel.w"]
    transverse = rolled - (belt(mesh.pair, x) - belt(mesh.pair, np.zeros(2)))
    axial = (values["pinion.z"] + values["pinion.rho"]) - (values["wheel.z"] + values["wheel.rho"])
    tilt = math.radians(stage.helix_angle)
    deflection = math.cos(tilt) * transverse + math.sin(tilt) * axial
    energy = 0.5 * 3e8 * deflection**2
    for gear in ("pinion", "wheel"):
        for dof, k in (("y", 2e8), ("z", 1e8), ("rho", 1e8)):
            energy += 0.5 * k * values[f"{gear}.{dof}"] ** 2
    return float(energy)


@pytest.mark.parametrize("helix", [0.0, 20.0])
def test_exudyns_forces_are_the_potentials(helix: float) -> None:
    """Far from rest and after turns of the gears; x is locked, the line of action tilts in it."""
    drivetrain = pair_drivetrain(helix)
    system = build_drivetrain(drivetrain)
    generator = np.random.default_rng(1)
    for _ in range(5):
        at = 1e-4 * generator.standard_normal(len(system.dofs))
        roll = 10.0 * generator.standard_normal()
        for i, dof in enumerate(system.dofs):
            at[i] += roll * dof.label.endswith(".w")
        step, n = 1e-8, len(system.dofs)
        slope = [
            potential_energy(system, drivetrain, at + unit)
            - potential_energy(system, drivetrain, at - unit)
            for unit in step * np.eye(n)
        ]
        # ε × 10 m of arc × 3e8 N/m, and the difference quotient's own round-off.
        np.testing.assert_allclose(
            forces_at(system, at), -np.array(slope) / (2.0 * step), atol=2e-3 * 3e4
        )


def energy_drift(method: str, step: float, helix: float) -> float:
    """Largest change of the energy, of its strain, while a loaded pair turns 100 times."""
    drivetrain = pair_drivetrain(helix)
    system = build_drivetrain(drivetrain)
    point = operating_point(drivetrain, torque=400.0)
    turns, speed = 100.0, 2.0 * math.pi * 0.04 * 2000.0  # rev; m/s on the pinion's base circle
    velocity = np.array([speed * dof.label.endswith(".w") for dof in system.dofs])
    jolt = 0.02 * velocity * np.array([dof.label == "pair.pinion.w" for dof in system.dofs])
    record = simulate(
        system,
        point.loads,
        duration=turns / 2000.0,
        integrator=Integrator(method, step, "test"),
        start_state=(point.displacement, velocity + jolt),
        record=("displacement", "velocity"),
    )
    assert record.displacement is not None
    assert record.velocity is not None
    assert record.displacement[-1].max() > 0.99 * turns * 2.0 * math.pi * 0.04
    loads = np.zeros(len(system.dofs))
    for force in point.loads:
        loads[record.labels.index(force.dof)] = force.signal.force
    every = slice(None, None, max(1, len(record.displacement) // 200))
    mass = linearize(system).mass
    total = [
        0.5 * v @ mass @ v + potential_energy(system, drivetrain, q) - loads @ q
        for q, v in zip(record.displacement[every], record.velocity[every], strict=True)
    ]
    strain = 0.5 * jolt @ mass @ jolt
    return float(np.abs(np.array(total) - total[0]).max() / strain)


@pytest.mark.parametrize("helix", [0.0, 20.0])
def test_energy_is_conserved_over_a_hundred_turns_under_load(helix: float) -> None:
    """A fourth-order method loses x⁶/72 of a mode's energy a step (Hairer & Wanner): order 5.

    Halving the step leaves 1/32 of the change.
    """
    coarse, fine = (energy_drift(RK44, step, helix) for step in (1e-5, 5e-6))
    assert fine < 1e-3
    assert coarse / fine > 24.0


@pytest.mark.parametrize("helix", [0.0, 20.0])
def test_the_trapezoidal_rule_conserves_it_too(helix: float) -> None:
    """Exactly in a linear system; what is not linear, a line that tilts by 1e-4, hardly counts."""
    assert energy_drift(TRAPEZOIDAL, 1e-5, helix) < 1e-7
