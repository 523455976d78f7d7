"""Parametric instability: Mathieu's equation, first-order theory, and exudyn in time."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import mathieu_a, mathieu_b

from mbs_models.contact.mesh_excitation import MeshLaw
from mbs_models.gears.operating_point import operating_point
from mbs_models.integration.integrators import RK44, TRAPEZOIDAL, Integrator
from mbs_models.integration.time_integration import simulate
from mbs_models.model.model_file import load
from mbs_models.model.parameters import Drivetrain
from mbs_models.signals.waveforms import FourierSeries, Trapezoid
from mbs_models.system.drivetrain import build_drivetrain
from tests.geared import lin_parker, speed_for
from tests.instability import instability_boundary
from tests.strategies import changed, paper, with_stage
from validation.errors import CommandError
from validation.routes.floquet import (
    ParametricSystem,
    growth_rate,
    monodromy,
    multipliers,
    parametric_system,
    tongues,
)

# A large variation: k between 0.7 and 1.3 of its mean, as of one and two pairs of teeth.
TRAPEZOID = {"shape": "trapezoid", "contact_ratio": 1.5, "amplitude": 0.6, "transition": 0.1}


def single(square: float, amplitude: float, decay: float = 0.0) -> ParametricSystem:
    """ẍ + 2 decay ẋ + (square + amplitude cos ωt) x = 0."""
    return ParametricSystem(
        np.array([math.sqrt(square)]),
        np.array([[2.0 * decay]]),
        np.array([[math.sqrt(abs(amplitude))]]),
        (MeshLaw(1.0, 0.0, FourierSeries((math.copysign(1.0, amplitude),), (0.0,))),),
    )


# Mathieu's equation


# Abramowitz & Stegun 1964, Table 20.1 (q = 5, 10): a_0, a_1, b_1, a_2, b_2.
@pytest.mark.parametrize(
    ("name", "order", "q", "value"),
    [
        ("b", 1, 5.0, -5.79008060),
        ("a", 1, 5.0, 1.85818754),
        ("b", 2, 5.0, 2.09946045),
        ("a", 2, 5.0, 7.44910974),
        ("a", 1, 10.0, -2.39914240),
    ],
)
def test_the_tabulated_characteristic_values(name: str, order: int, q: float, value: float) -> None:
    """The oracle of the next test against the printed table, eight decimals."""
    found = {"a": mathieu_a, "b": mathieu_b}[name](order, q)
    assert found == pytest.approx(value, abs=1e-8)


@pytest.mark.parametrize("q", [0.1, 1.0, 5.0])
@pytest.mark.parametrize(("function", "order"), [(mathieu_a, 1), (mathieu_b, 2), (mathieu_a, 2)])
def test_mathieus_boundaries(function: Any, order: int, q: float) -> None:
    """ẍ + (a − 2q cos 2t) x = 0, T = π: trace Φ = −2 at a_1, +2 at a_2, b_2 (McLachlan 1947)."""
    square = float(function(order, q))
    trace = np.trace(monodromy(single(square, -2.0 * q), 1.0 / math.pi))
    # At 16 steps per radian, four times what is seen at q = 5.
    assert trace == pytest.approx(-2.0 if order == 1 else 2.0, abs=2e-5)


def test_a_monodromy_matrix_is_what_an_ode_solver_finds() -> None:
    """SciPy's DOP853 over one period of a damped trapezoid."""
    frequency, waveform = 0.5, Trapezoid(1.5, 0.4, 0.1)
    system = replace(single(4.0, 1.0, decay=0.1), laws=(MeshLaw(stiffness=waveform),))

    def right(t: float, z: Any) -> list[float]:
        return [2.0 * z[1], -(4.0 + waveform.value(frequency * t)) * z[0] / 2.0 - 0.2 * z[1]]

    columns = [
        solve_ivp(right, (0.0, 2.0), start, method="DOP853", rtol=1e-11, max_step=1e-3).y[:, -1]
        for start in np.eye(2)
    ]
    found = monodromy(system, frequency)
    np.testing.assert_allclose(found, np.transpose(columns), atol=1e-6)
    # Liouville: det Φ = exp(−∫ tr Γ) whatever the stiffness does.
    assert np.linalg.det(found) == pytest.approx(math.exp(-0.2 * 2.0), rel=1e-10)


def test_the_principal_tongue_of_one_mode() -> None:
    """Nayfeh & Mook (1979), ch. 5: ω = 2 ω_0 ± E/(2 ω_0), growth E/(4 ω_0); errors of order E²."""
    omega, amplitude = 10.0, 2.0  # 2 % of ω²
    system = single(omega**2, amplitude)
    (tongue,) = tongues(system, [1])
    assert tongue.centre == pytest.approx(2.0 * omega / (2.0 * math.pi))
    assert tongue.half_width == pytest.approx(amplitude / (2.0 * omega) / (2.0 * math.pi))
    assert tongue.growth_rate == pytest.approx(amplitude / (4.0 * omega))
    assert growth_rate(system, tongue.centre) == pytest.approx(tongue.growth_rate, rel=1e-3)
    for side in (-1.0, 1.0):
        edge = instability_boundary(
            system, tongue.centre + 2 * side * tongue.half_width, tongue.centre
        )
        # Second order: E²/ω³ of the width's E/ω, 1 %.
        assert edge - tongue.centre == pytest.approx(side * tongue.half_width, rel=0.02)


def test_damping_narrows_the_tongue() -> None:
    """Growth √(σ_0² − (Δ/2)²) − δ: half width √(σ_0² − δ²) · 2 in ω (Nayfeh & Mook)."""
    decay = 0.03
    plain, damped = single(100.0, 2.0), single(100.0, 2.0, decay)
    (tongue,) = tongues(plain, [1])
    narrowed = 2.0 * math.sqrt(tongue.growth_rate**2 - decay**2) / (2.0 * math.pi)
    edge = instability_boundary(damped, tongue.centre + 2 * tongue.half_width, tongue.centre)
    assert edge - tongue.centre == pytest.approx(narrowed, rel=0.02)
    assert growth_rate(damped, 2.0 * tongue.centre) == pytest.approx(-decay, rel=1e-6)


# Drivetrains


def geared(amplitude: float = 0.6, **keys: Any) -> Drivetrain:
    table = TRAPEZOID | {"amplitude": amplitude}
    return lin_parker(4, sun_mesh_variation=table, ring_mesh_variation=table, **keys)


def system_of(drivetrain: Drivetrain, highest_hz: float = np.inf) -> ParametricSystem:
    laws = operating_point(drivetrain, speed_rpm=speed_for(drivetrain, 1000.0)).laws
    return parametric_system(drivetrain, laws, highest_hz=highest_hz)


def test_the_modes_are_lin_and_parkers() -> None:
    """1999, Table 2, without the rigid-body mode; nothing is left out."""
    system = system_of(geared())
    assert len(system.omega) == 20
    assert system.frequency[[4, 5, -1]] == pytest.approx([1536.6, 1808.2, 13071.1], abs=0.15)
    assert system.left_out == 0.0


def test_without_variation_multipliers_are_the_modes_own() -> None:
    """|μ| = 1 at exp(±jω_p T), to the round-off of a product of thirty matrices."""
    system = system_of(lin_parker(4, sun_mesh_variation=TRAPEZOID))
    still = replace(system, participation=0.0 * system.participation)
    found = multipliers(still, 3000.0)
    expected = np.exp(1j * np.concatenate([system.omega, -system.omega]) / 3000.0)
    gaps = np.abs(found[:, None] - expected).min(axis=0)
    assert gaps.max() < 1e-10
    assert np.abs(np.abs(found) - 1.0).max() < 1e-10


@pytest.mark.parametrize("rank", [0, pytest.param(2, marks=pytest.mark.slow)])
def test_first_order_tongues_of_a_planetary_stage(rank: int) -> None:
    """Lin & Parker (2002): combination instabilities at ω_p + ω_q, with planet phases.

    With k varying by 3 % peak to peak, second-order terms are 3 % of the width at most.
    """
    system = system_of(geared(amplitude=0.03))
    tongue = tongues(system, [1])[rank]
    assert growth_rate(system, tongue.centre) == pytest.approx(tongue.growth_rate, rel=0.03)
    for side in (-1.0, 1.0):
        outside = tongue.centre + 1.3 * side * tongue.half_width
        edge = instability_boundary(system, outside, tongue.centre, tolerance=1e-5)
        assert edge - tongue.centre == pytest.approx(side * tongue.half_width, rel=0.05)


def test_phases_decide_which_modes_combine() -> None:
    """l = 1, k = 3 (translational): ω_p + ω_q of two rotational modes is no instability of it.

    E_pq = Σ_n e^(−j2πγ_n) w_p w_q vanishes unless the two families' wave numbers add up to k.
    """
    (harmonic,) = [1]
    system = system_of(geared())
    found = tongues(system, [harmonic], narrowest_hz=1e-6)
    rotational = (1536.5, 1970.6, 2625.7, 7773.6, 13071.1)
    for tongue in found:
        both = [any(abs(f - r) < 0.1 for r in rotational) for f in tongue.modes]
        assert not all(both), tongue


def test_a_parallel_stages_single_mesh() -> None:
    """Half width k A w_p w_q/(2 √(ω_p ω_q)) with w of the mesh alone; the hub's mode left out."""
    drivetrain = changed(
        with_stage(
            paper(),
            "reducer",
            mesh_variation={"shape": "harmonics", "harmonics": [[0.01, 0.0]]},
            pinion=_with_teeth(paper(), "pinion"),
        ),
        operation={"input": "reducer.pinion", "speed_range": [0.0, 1.0]},
    )
    laws = operating_point(drivetrain, speed_rpm=6000.0).laws
    system = parametric_system(drivetrain, laws, highest_hz=20e3)
    assert system.frequency[-1] < 20e3
    # The hub, 4.5e-8 kg on 1e8 N/m, moves no mesh.
    assert system.left_out < 1e-6
    tongue = tongues(system, [1])[0]
    p, q = (int(np.argmin(np.abs(system.frequency - f))) for f in tongue.modes)
    w = system.participation[0]
    width = 0.01 * abs(w[p] * w[q]) / (2.0 * math.sqrt(system.omega[p] * system.omega[q]))
    assert tongue.half_width == pytest.approx(width / (2.0 * math.pi), rel=1e-9)
    assert growth_rate(system, tongue.centre) == pytest.approx(tongue.growth_rate, rel=0.02)


def _with_teeth(drivetrain: Drivetrain, gear: str) -> dict[str, Any]:
    table: dict[str, Any] = drivetrain.stage("reducer").model_dump(exclude_unset=True)[gear]
    return table | {"teeth": 30}


# exudyn in time


def integrated(
    drivetrain: Drivetrain, frequency: float, periods: int, steps: int, method: str = RK44
) -> tuple[ParametricSystem, Any]:
    """Mesh forces once per mesh period, from a random 1e-13 m; and the system Floquet has of it."""
    point = operating_point(drivetrain, speed_rpm=speed_for(drivetrain, frequency))
    system = build_drivetrain(drivetrain, point.laws)
    start = 1e-13 * np.random.default_rng(1).standard_normal(len(system.dofs))
    record = simulate(
        system,
        point.loads,
        duration=periods / frequency,
        integrator=Integrator(method, 1.0 / (frequency * steps), "test"),
        sampling_frequency=frequency,
        start_state=(start, np.zeros_like(start)),
        record=("mesh_forces",),
    )
    return parametric_system(drivetrain, point.laws), record.mesh_forces


def dominant_multiplier(forces: Any, largest: float) -> complex:
    """μ of the pair that rules the last of the growth: x_{k+2} = 2 Re μ x_{k+1} − |μ|² x_k."""
    beyond = np.abs(forces).max(axis=1) > largest
    last = int(np.argmax(beyond)) if beyond.any() else len(forces)
    x = forces[last - 15 : last]
    before = np.stack([x[1:-1].ravel(), x[:-2].ravel()], axis=1)
    (a, b), *_ = np.linalg.lstsq(before, x[2:].ravel(), rcond=None)
    return complex(a / 2.0, math.sqrt(-b - a**2 / 4.0))


@pytest.mark.parametrize(
    ("method", "tolerance"),
    # RK44 at 20 steps per period, ωh = 0.15 for the modes that take part: (ωh)⁵/120 per step.
    # The trapezoidal rule at 40: (ωh)²/12 of the angle ωT.
    [(RK44, 2e-4), (TRAPEZOIDAL, 1e-2)],
)
@pytest.mark.parametrize("frequency", [13600.0, 14963.0, 16500.0])
def test_exudyn_grows_by_the_floquet_multiplier(
    frequency: float, method: str, tolerance: float
) -> None:
    """k(t) of 60 %, within the tongues: the disturbance grows from 0.1 pm by |μ| a period.

    Up to 100 N, 0.2 µm of the mesh: geometry is linear to 5e-6.
    """
    steps = 20 if method == RK44 else 40
    expected = multipliers(system_of(geared(alpha=200.0)), frequency)[0]
    assert abs(expected) > 1.1
    # From 1e-13 m of 5e8 N/m to a thousand newtons; nothing in a mesh without play ends it.
    periods = math.ceil(math.log(2e7) / math.log(abs(expected)))
    _, forces = integrated(geared(alpha=200.0), frequency, periods, steps, method)
    found = dominant_multiplier(forces, 100.0)
    assert abs(found) == pytest.approx(abs(expected), rel=tolerance)
    assert found.real == pytest.approx(expected.real, rel=tolerance)


def test_exudyn_decays_beside_the_tongues() -> None:
    """At 12 kHz, between tongues, every motion decays by α/2 = 100 1/s, in 50 ms by e⁻⁵.

    The envelope is that of beating modes: its slope is known to a few per cent of e⁻⁵.
    """
    frequency = 12000.0
    system, forces = integrated(geared(alpha=200.0), frequency, 600, 20)
    assert growth_rate(system, frequency) == pytest.approx(-100.0, rel=1e-6)
    size = np.linalg.norm(forces, axis=1)
    slope = np.polyfit(np.arange(len(size)) / frequency, np.log(size), 1)[0]
    assert slope == pytest.approx(-100.0, rel=0.05)


@pytest.mark.slow
def test_exudyn_becomes_unstable_where_floquet_says() -> None:
    """Around the first edge above 12 kHz: growth on one side, none 0.4 % further out.

    With α = 200 the edge is where the undamped growth passes 100 1/s.
    """
    drivetrain = geared(alpha=200.0)
    system = system_of(drivetrain)
    edge = instability_boundary(system, 12000.0, 13600.0)
    for frequency, periods, grows in ((1.002 * edge, 900, True), (0.998 * edge, 900, False)):
        rate = growth_rate(system, frequency)
        assert (rate > 0.0) == grows
        _, forces = integrated(drivetrain, frequency, periods, 20)
        size = np.linalg.norm(forces, axis=1)
        change = size[-periods // 3 :].max() / size[: periods // 3].max()
        assert change > 10.0 if grows else change < 0.1, (frequency, rate, change)


def test_one_frequency_worked_out_in_two_ways_is_one() -> None:
    """977 rpm of 20 teeth, through an idler: its two meshes' frequencies differ in the last digit.

    Half a round-off apart they have a common period; 1e-6 apart they have not.
    """
    drivetrain = geared()
    laws = operating_point(drivetrain, speed_rpm=speed_for(drivetrain, 1000.0)).laws
    first = next(iter(laws))
    nearly = dict(laws) | {
        first: replace(laws[first], frequency=math.nextafter(laws[first].frequency, math.inf))
    }
    assert nearly[first].frequency != laws[first].frequency
    expected = growth_rate(parametric_system(drivetrain, laws), 14963.0)
    assert growth_rate(parametric_system(drivetrain, nearly), 14963.0) == expected
    apart = dict(laws) | {
        first: replace(laws[first], frequency=laws[first].frequency * (1.0 + 1e-6))
    }
    with pytest.raises(CommandError, match="without a common period"):
        parametric_system(drivetrain, apart)


# Refusals


def test_what_floquet_theory_cannot_take() -> None:
    with pytest.raises(CommandError, match="'mesh moon': no such mesh; known: mesh planetary"):
        parametric_system(lin_parker(4), {"mesh moon": MeshLaw()})
    with pytest.raises(CommandError, match=r"no mode up to 100 Hz: the lowest is 727\."):
        system_of(geared(), highest_hz=100.0)
    turbine = load("wind-turbine")
    for name in ("low_speed", "intermediate"):
        turbine = with_stage(turbine, name, sun_mesh_variation=TRAPEZOID)
    laws = operating_point(turbine, speed_rpm=12.0).laws
    with pytest.raises(CommandError, match=r"meshes vary at 11\.2, 73\.4209 Hz"):
        parametric_system(turbine, laws)
    with pytest.raises(CommandError, match="the first must be stable, the second unstable"):
        instability_boundary(single(100.0, 2.0), 20.0 / (2.0 * math.pi), 1.0)
