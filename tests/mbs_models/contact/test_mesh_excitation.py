"""What a mesh excites with: waveforms, model-file tables, the force law, and exudyn's springs."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from mbs_models.contact.mesh_excitation import LawSamples, MeshLaw, mesh_force, mesh_forces
from mbs_models.errors import ModelError
from mbs_models.integration.integrators import RK44, TRAPEZOIDAL, Integrator
from mbs_models.integration.time_integration import simulate
from mbs_models.model.model_file import dumps, load, loads
from mbs_models.model.parameters import Drivetrain, ParallelStage, PlanetaryStage
from mbs_models.signals.waveforms import FourierSeries, Trapezoid
from mbs_models.stages.mesh_tables import TrapezoidVariation
from mbs_models.system.drivetrain import build_drivetrain
from mbs_models.system.linearization import linearize
from mbs_models.system.read_back import components
from tests.geared import lin_parker
from tests.strategies import with_stage

SUN_MESH = "mesh planetary.sun – planet1"


@st.composite
def trapezoids(draw: st.DrawFn) -> Trapezoid:
    share = draw(st.floats(0.05, 0.95))
    transition = draw(st.floats(0.1, 1.0)) * min(share, 1.0 - share)
    return Trapezoid(draw(st.floats(0.01, 2.0)), share, transition, draw(st.floats(-2.0, 2.0)))


pairs = st.lists(st.tuples(st.floats(0.0, 1.0), st.floats(-7.0, 7.0)), min_size=1, max_size=5)
series = pairs.map(lambda found: FourierSeries(*map(tuple, zip(*found, strict=True))))


@given(waveform=st.one_of(trapezoids(), series))
def test_a_waveforms_harmonics_are_its_fourier_coefficients(waveform: Any) -> None:
    n = 4096
    values = [waveform.value(k / n) for k in range(n)]
    spectrum = np.fft.rfft(values) / n
    # Sampled every 1/n, a kink's ramps are wrong by slope/n² in the coefficients: below 1e-5 for
    # the steepest ramp drawn (2/0.005).
    assert abs(spectrum[0]) < 1e-4
    for order in range(1, 6):
        assert abs(2.0 * spectrum[order] - waveform.harmonic(order)) < 1e-4


@given(waveform=st.one_of(trapezoids(), series), turns=st.floats(-3.0, 3.0))
def test_a_waveforms_slope_is_its_derivative(waveform: Any, turns: float) -> None:
    step = 1e-6
    gaps = [abs((turns - kink + 0.5) % 1.0 - 0.5) for kink in waveform.kinks]
    if min(gaps, default=1.0) > 2.0 * step:
        change = waveform.value(turns + step) - waveform.value(turns - step)
        # Third derivative of Σ A cos 2πlτ (l ≤ 5, ΣA ≤ 5): ≤ 1.6e5, times step²/6; round-off 1e-9.
        assert waveform.slope(turns) == pytest.approx(change / (2.0 * step), abs=1e-6)


def test_a_trapezoid_is_low_at_the_pitch_point_and_keeps_its_mean() -> None:
    """ε = 1.6: one pair for 0.4 of the period about the pitch point, two for 0.6."""
    table = TrapezoidVariation(shape="trapezoid", contact_ratio=1.6, transition=0.1)
    waveform = table.waveform
    # Equal pairs: 1/ε each, so 1/1.6 and 2/1.6 of the mean.
    assert 1.0 + waveform.value(0.0) == pytest.approx(1.0 / 1.6, rel=1e-12)
    assert 1.0 + waveform.value(0.5) == pytest.approx(2.0 / 1.6, rel=1e-12)
    assert waveform.kinks == pytest.approx((0.15, 0.25, 0.75, 0.85))
    assert [waveform.value(t) for t in (0.149, 0.2, 0.251)] == pytest.approx(
        [-0.375, (0.25 - 0.375) / 2.0, 0.25]
    )


TRAPEZOID = '{ shape = "trapezoid", contact_ratio = 1.6, amplitude = 0.3 }'
REFUSED = [
    ('{ shape = "trapezoid", contact_ratio = 2.0 }', "as many pairs of teeth at all times"),
    ('{ shape = "trapezoid", contact_ratio = 1.05 }', "transition = 0.1: with contact_ratio"),
    ('{ shape = "trapezoid", contact_ratio = 0.9 }', "greater than 1"),
    ('{ shape = "trapezoid", contact_ratio = 1.6, amplitude = 1.7 }', "give less than 1.667"),
    ('{ shape = "trapezoid", contact_ratio = 1.6, transition = 0.0 }', "greater than 0"),
    ('{ shape = "sine" }', 'must be "constant" or "harmonics" or "trapezoid"'),
    ('{ shape = "harmonics", harmonics = [[1.0, 0.0]] }', "falls to 0 of its mean"),
    ('{ shape = "harmonics", harmonics = [[0.6, 0.0], [0.5, 180.0]] }', "falls to -0.1"),
    ('{ shape = "harmonics", harmonics = [] }', r"a list of \[amplitude, phase in deg\]"),
]


def model_with(line: str) -> Drivetrain:
    text = dumps(load("lin-parker-4")).replace(
        "sun_mesh_stiffness", f"{line}\nsun_mesh_stiffness", 1
    )
    return loads(text, origin="m.toml")


@pytest.mark.parametrize(("table", "words"), REFUSED)
def test_stiffness_that_cannot_be_is_refused(table: str, words: str) -> None:
    with pytest.raises(ModelError, match=words) as caught:
        model_with(f"sun_mesh_variation = {table}")
    assert "m.toml: stage[0] 'planetary': sun_mesh_variation" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_harmonics_of_more_than_one_may_leave_the_stiffness_positive() -> None:
    """0.9 cos θ + 0.2 cos 2θ ≥ −0.706: the sum of the amplitudes is no bound."""
    table = '{ shape = "harmonics", harmonics = [[0.9, 0.0], [0.2, 0.0]] }'
    (stage,) = model_with(f"sun_mesh_variation = {table}").stages_of(PlanetaryStage)
    assert stage.sun_mesh_variation is not None
    assert stage.sun_mesh_variation.waveform.value(0.5) == pytest.approx(-0.7)


def test_model_files_with_mesh_tables_read_back_equal() -> None:
    drivetrain = model_with(
        f"ring_mesh_variation = {TRAPEZOID}\n"
        "sun_mesh_transmission_error = { harmonics = [[1e-6, 0.0], [2e-7, 45.0]] }\n"
        "sun_mesh_backlash = 5e-5\nring_mesh_phase = 0.25"
    )
    assert loads(dumps(drivetrain)) == drivetrain


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("sun_mesh_backlash = -1e-6", r"at least 0 \(m\)"),
        ("mesh_backlash = 1e-6", "did you mean 'sun_mesh_backlash'|unknown key"),
        ("sun_mesh_transmission_error = { harmonics = [[1e-6]] }", r"\[amplitude, phase in deg\]"),
    ],
)
def test_other_mesh_keys_that_cannot_be(line: str, words: str) -> None:
    with pytest.raises(ModelError, match=words):
        model_with(line)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("speed = 0.0", "leave the key out for a standstill"),
        ('output = "planetary.sun"', "is the input"),
        ('output = "planetary.moon"', "not a body of this drivetrain"),
    ],
)
def test_operations_that_cannot_be(line: str, words: str) -> None:
    text = dumps(lin_parker(4)).replace("speed_range", f"{line}\nspeed_range", 1)
    with pytest.raises(ModelError, match=words):
        loads(text)


# The law


def test_backlash_is_taken_up_on_either_side() -> None:
    law, at = MeshLaw(backlash=2.0), np.array([-3.0, -1.0, 0.5, 1.0, 1.5])
    forces, contact = mesh_forces(law, 1.0, 0.0, np.zeros(5), at, np.zeros(5))
    assert forces.tolist() == [-2.0, 0.0, 0.0, 0.0, 0.5]
    assert contact.tolist() == [-1.0, 0.0, 0.0, 0.0, 1.0]
    plain, _ = mesh_forces(MeshLaw(), 1.0, 0.0, np.zeros(5), at, np.zeros(5))
    assert plain.tolist() == at.tolist()


def test_damping_acts_in_contact_only_and_never_pulls() -> None:
    """k = 1e8 N/m, c = 200 N s/m: in the gap nothing, parting at 1 m/s the damper would pull."""
    law = MeshLaw(backlash=2e-5)
    at = np.array([0.0, 0.9e-5, 1.1e-5, 1.1e-5, -1.1e-5])
    forces, contact = mesh_forces(
        law, 1e8, 200.0, np.zeros(5), at, np.array([1.0, -1.0, 0.1, -1.0, 0.1])
    )
    assert forces == pytest.approx([0.0, 0.0, 100.0 + 20.0, 0.0, -100.0 + 20.0])
    assert contact.tolist() == [0.0, 0.0, 1.0, 1.0, -1.0]


@given(
    time=st.floats(0.0, 1.0),
    deflection=st.floats(-1e-4, 1e-4),
    rate=st.floats(-0.1, 0.1),
    flank=st.sampled_from([-1.0, 1.0]),
    backlash=st.sampled_from([0.0, 2e-5]),
)
def test_the_force_is_the_equation(
    time: float, deflection: float, rate: float, flank: float, backlash: float
) -> None:
    """F = k(t) g(p δ − e) + c (p δ̇ − ė) in contact, written out; at one instant and at many."""
    law = MeshLaw(
        50.0, 0.3, FourierSeries((0.2,), (0.1,)), FourierSeries((1e-5,), (0.4,)), backlash, flank
    )
    w, t = 2.0 * math.pi * 50.0, time - 0.3 / 50.0
    k = 1e8 * (1.0 + 0.2 * math.cos(w * t + 0.1))
    x = flank * deflection - 1e-5 * math.cos(w * t + 0.4)
    g = math.copysign(max(abs(x) - backlash / 2.0, 0.0), x)
    e_t = -1e-5 * w * math.sin(w * t + 0.4)
    expected = k * g + 30.0 * (flank * rate - e_t) if g else 0.0
    if backlash and expected * x < 0.0:
        expected = 0.0
    samples = LawSamples(law)
    samples.sample(time, 1.0, 1)
    now = mesh_force(1e8, 30.0, samples)(time, deflection, rate)[0]
    assert now == pytest.approx(flank * expected, abs=1e-6)
    many, _ = mesh_forces(
        law, 1e8, 30.0, np.array([time]), np.array([deflection]), np.array([rate])
    )
    assert many[0] == pytest.approx(expected, abs=1e-6)


# exudyn


def test_a_law_that_does_nothing_is_the_constant_spring() -> None:
    """Same matrices: the derivatives are given to exudyn."""
    drivetrain = lin_parker(4, beta=1e-6)
    names = build_drivetrain(drivetrain).meshes
    plain = linearize(build_drivetrain(drivetrain))
    laws = linearize(build_drivetrain(drivetrain, {name: MeshLaw() for name in names}))
    for one, other in ((plain.stiffness, laws.stiffness), (plain.damping, laws.damping)):
        np.testing.assert_array_equal(one, other)


def test_springs_with_a_law_are_read_back_by_their_mean() -> None:
    drivetrain = lin_parker(4)
    law = MeshLaw(1000.0, 0.0, FourierSeries((0.5,), (0.0,)), backlash=1e-5)
    plain, lawful = (
        components(build_drivetrain(drivetrain, laws)) for laws in ({}, {SUN_MESH: law})
    )
    assert [spring.name for spring in plain.springs] == [spring.name for spring in lawful.springs]
    for one, other in zip(plain.springs, lawful.springs, strict=True):
        np.testing.assert_array_equal(one.stiffness, other.stiffness)
        np.testing.assert_array_equal(one.deflection, other.deflection)


def test_a_law_for_no_mesh_is_refused() -> None:
    with pytest.raises(ModelError, match=r"'mesh sun': no such mesh; known: mesh planetary\.sun"):
        build_drivetrain(lin_parker(4), {"mesh sun": MeshLaw()})


def pair_of_gears() -> Drivetrain:
    """A pinion and a wheel without bearings: the mesh alone holds them together."""
    gear = {
        "mass": 1.0,
        "base_radius": 0.05,
        "polar_inertia_over_r2": 2.0,
        "diametral_inertia_over_r2": 1.0,
        "bearing_y": 0.0,
        "bearing_z": 0.0,
        "bearing_rocking_over_r2": 0.0,
    }
    return Drivetrain.model_validate(
        {
            "name": "pair",
            "damping": {"stiffness_proportional": 2e-6},
            "stage": [
                {
                    "type": "parallel",
                    "name": "pair",
                    "mesh_stiffness": 1e8,
                    "pinion": gear,
                    "wheel": gear,
                }
            ],
        }
    )


LAW = MeshLaw(2500.0, 0.2, FourierSeries((0.4,), (0.0,)), FourierSeries((1e-6,), (1.0,)), 0.0, -1.0)


@pytest.mark.parametrize(
    ("method", "order", "backlash"),
    # RK44's fourth and the trapezoidal rule's second order; a flank that meets or parts within a
    # step leaves either with about the first.
    [(RK44, 4.0, 0.0), (TRAPEZOIDAL, 2.0, 0.0), (RK44, 1.0, 2e-6), (TRAPEZOIDAL, 1.0, 2e-6)],
)
def test_exudyn_integrates_the_law_to_the_integrators_order(
    method: str, order: float, backlash: float
) -> None:
    """Two free gears are one mass on the mesh: 1/m = 2 (1/1 + 1/2), translation and rotation.

    SciPy's DOP853 integrates that single equation as oracle.
    """
    law = replace(LAW, backlash=backlash)
    drivetrain, name = pair_of_gears(), "mesh pair.pinion – wheel"
    system = build_drivetrain(drivetrain, {name: law})
    samples = LawSamples(law)

    def force(t: float, deflection: float, rate: float) -> float:
        samples.sample(t, 1.0, 1)
        return mesh_force(1e8, 200.0, samples)(t, deflection, rate)[0]

    flexible = 2.0 * (1.0 / 1.0 + 1.0 / 2.0)  # 1/m of δ: both gears' y and w

    duration, speed = 4e-3, 1e-3

    def right(t: float, y: Any) -> list[float]:
        return [y[1], -flexible * force(t, y[0], y[1])]

    oracle = solve_ivp(
        right,
        (0.0, duration),
        [0.0, speed],
        method="DOP853",
        rtol=1e-12,
        atol=1e-18,
        max_step=1e-6,
        dense_output=True,
    ).sol
    start = np.zeros((2, len(system.dofs)))
    start[1, [dof.label for dof in system.dofs].index("pair.pinion.w")] = speed
    errors = []
    for step in (1e-5, 5e-6, 1.25e-6):  # at the first, modified Newton would fail on a backlash
        record = simulate(
            system,
            [],
            duration=duration,
            integrator=Integrator(method, step, "test"),
            start_state=(start[0], start[1]),
            record=("displacement",),
        )
        assert record.displacement is not None
        q = dict(zip(record.labels, record.displacement.T, strict=True))
        stretch = q["pair.pinion.w"] + q["pair.pinion.y"] - q["pair.wheel.w"] - q["pair.wheel.y"]
        expected = oracle(record.time)[0]
        errors.append(np.abs(stretch - expected).max() / np.abs(expected).max())
    # A quarter of the step: 4^order, of which the asymptote may not be reached (half an order).
    assert errors[1] / errors[2] > 4.0 ** (order - 0.5)
    assert errors[2] < 0.02


def test_varying_meshes_of_a_parallel_stage() -> None:
    """The mesh's name and its law's way through the parallel stage."""
    drivetrain = with_stage(load("paper"), "reducer", mesh_backlash=1e-5)
    (reducer,) = drivetrain.stages_of(ParallelStage)
    assert reducer.mesh_backlash == 1e-5
    system = build_drivetrain(drivetrain, {"mesh reducer.pinion – wheel": MeshLaw()})
    assert "mesh reducer.pinion – wheel" in system.meshes
