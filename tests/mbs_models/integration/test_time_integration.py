"""exudyn in time, against exact solutions of the linearised system."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.signal import lsim

from mbs_models.contact.mesh_excitation import MeshLaw
from mbs_models.gears.preload import Constant
from mbs_models.integration.integrators import RK44, TRAPEZOIDAL, choose_integrator
from mbs_models.integration.steady_state import steady_start
from mbs_models.integration.time_integration import simulate
from mbs_models.integration.transient_record import QUANTITIES, TransientRecord
from mbs_models.model.excitation import Excitation
from mbs_models.model.model_file import load
from mbs_models.signals.lines import Harmonic, schroeder_multisine
from mbs_models.signals.sines import HalfSine
from mbs_models.signals.waveforms import FourierSeries
from mbs_models.system.drivetrain import MultibodySystem, build_drivetrain
from mbs_models.system.harmonic_response import harmonic_response
from mbs_models.system.linearization import linearize
from mbs_models.system.read_back import components
from tests.mbs_models.transient_runs import (
    PINION,
    SCALE,
    SUN,
    at,
    by,
    first_order,
    free,
    harmonic,
    largest_error,
    planetary,
)
from tests.strategies import damped, paper
from validation.routes.time_domain import rayleigh_damping

STEPS = {RK44: (1e-5, 5e-6, 2.5e-6), TRAPEZOIDAL: (2e-6, 1e-6, 5e-7)}


# Accuracy


@pytest.mark.parametrize(
    ("drivetrain", "dof", "name", "order"),
    [
        ("lin-parker-4", SUN, RK44, 4),
        ("lin-parker-4", SUN, TRAPEZOIDAL, 2),
        ("paper", PINION, TRAPEZOIDAL, 2),
    ],
)
def test_halving_the_step_shows_the_order(drivetrain: str, dof: str, name: str, order: int) -> None:
    """Error of displacement and velocity against the exact solution falls by 2^order.

    Within 5 %: the next term is (ωh)² of the first, (82e3 · 1e-5)²/10 for the highest mode.
    """
    system = build_drivetrain(damped(load(drivetrain)))
    linear = linearize(system)
    errors = []
    for step in STEPS[name]:
        record = simulate(
            system, [at(dof)], duration=1e-3, integrator=by(name, step),
            record=("displacement", "velocity"),
        )  # fmt: skip
        q, v = harmonic(linear, dof, 1.0, 1500.0, step, record.n_samples)
        errors.append([largest_error(record.displacement, q), largest_error(record.velocity, v)])
    for coarse, fine in pairwise(errors):
        np.testing.assert_allclose(np.divide(coarse, fine), 2.0**order, rtol=0.05)
    assert max(errors[-1]) < 5e-4


def test_a_blow_against_scipys_lsim() -> None:
    """lsim holds the force linearly over 1e-7 s: (π · 1e-3)²/12 = 1e-6 of it. RK44: 4e-5."""
    system, blow = planetary(), HalfSine(1.0, 1e-4, start=5e-5)
    linear = linearize(system)
    record = simulate(
        system, [Excitation(SUN, blow)], duration=1e-3, integrator=by(RK44, 2.5e-6),
        record=("displacement", "velocity"),
    )  # fmt: skip
    n = len(linear.dofs)
    force = np.zeros((2 * n, 1))
    force[n + linear.dofs.index(SUN)] = 1.0 / SCALE
    force[n:] = np.linalg.solve(linear.mass, force[n:])
    time = np.arange(10000) * 1e-7
    state_space = (first_order(linear), force, np.eye(2 * n), np.zeros((2 * n, 1)))
    _, states, _ = lsim(state_space, blow.values(np.asarray(time, float)), time)
    exact = states[::25]
    assert largest_error(record.displacement, exact[:, :n]) < 1e-5
    assert largest_error(record.velocity, exact[:, n:] * SCALE) < 5e-5


def test_free_motion_from_a_start_state() -> None:
    """RK44 is (ωh)⁴ωt/120 late: 6e-4 of the highest mode, 82e3 rad/s, after 0.5 ms."""
    system = planetary()
    linear = linearize(system)
    rng = np.random.default_rng(5)
    start = rng.normal(size=21) * 1e-7, rng.normal(size=21) * 1e-3
    record = simulate(
        system, [], duration=5e-4, integrator=by(RK44, 2.5e-6), start_state=start,
        record=("displacement", "velocity"),
    )  # fmt: skip
    q, v = free(linear, *start, 2.5e-6, record.n_samples)
    assert largest_error(record.displacement, q) < 6e-4
    assert largest_error(record.velocity, v) < 6e-4
    assert record.displacement is not None
    np.testing.assert_allclose(record.displacement[0], start[0], atol=1e-16)
    assert record.forces.shape == (200, 0)


@dataclass(frozen=True)
class Undamped:
    """The highest mode of an undamped planetary stage, set free."""

    omega: float
    system: MultibodySystem
    start: tuple[Any, Any]

    @classmethod
    def released(cls) -> Undamped:
        system = build_drivetrain(load("lin-parker-4"))
        linear = linearize(system)
        values, shapes = eigh(linear.stiffness, linear.mass)
        shape = shapes[:, -1] / np.abs(shapes[:, -1]).max()
        return cls(float(np.sqrt(values[-1])), system, (1e-6 * shape, np.zeros(21)))

    def energy(self, name: str, step: float, steps: int) -> Any:
        record = simulate(
            self.system, [], duration=steps * step, integrator=by(name, step),
            start_state=self.start, record=("energy",),
        )  # fmt: skip
        assert record.energy is not None
        return record.energy


def test_rk44_loses_the_energy_its_order_allows() -> None:
    """|R|² = 1 − x⁶/72 + x⁸/576 per step, x = ωh: 1.7 % of the energy in 1000 steps at x = 0.33.

    To 1e-6 of the energy: ε k x is 1e-8 of the spring force at 1e-6 m, a thousand times.
    """
    mode, step = Undamped.released(), 4e-6
    energy = mode.energy(RK44, step, 1000)
    x = mode.omega * step
    kept = (1.0 - x**6 / 72.0 + x**8 / 576.0) ** np.arange(1000)
    assert kept[-1] == pytest.approx(0.983, abs=0.001)
    np.testing.assert_allclose(energy / energy[0], kept, atol=1e-6)
    assert x**6 / 72.0 * 999 == pytest.approx(-np.log(kept[-1]), rel=x**2 / 7.0)


def test_the_trapezoidal_rule_keeps_the_energy() -> None:
    """Exactly, in a linear system; what is left is round-off of the springs and of geometry."""
    energy = Undamped.released().energy(TRAPEZOIDAL, 1e-5, 1000)
    np.testing.assert_allclose(energy / energy[0], 1.0, atol=1e-6)


@pytest.mark.parametrize("name", [RK44, TRAPEZOIDAL])
def test_accelerations_are_those_of_the_equations_of_motion(name: str) -> None:
    """M q̈ = f − C q̇ − K q at every sample, the first and those where pieces meet among them."""
    system = planetary()
    linear = linearize(system)
    record = simulate(
        system, [at(SUN, 0.1)], duration=2e-3, integrator=by(name, 1e-5), piece=5e-4,
        record=QUANTITIES,
    )  # fmt: skip
    force = np.zeros((record.n_samples, 21))
    force[:, linear.dofs.index(SUN)] = record.forces[:, 0]
    assert record.displacement is not None
    assert record.velocity is not None
    assert record.acceleration is not None
    inner = record.displacement @ linear.stiffness + record.velocity @ linear.damping
    expected = np.linalg.solve(linear.mass, (force - inner).T).T
    # Springs' forces are known to 1e-8 N, of 0.1 N. Geometry adds 3e-7, in proportion to the force.
    assert largest_error(record.acceleration, expected) < 1e-6
    assert record.acceleration[0, 2] == pytest.approx(0.1 / linear.mass[2, 2], rel=1e-6)


def test_a_free_drivetrain_drifts_off_as_one() -> None:
    """A constant force on the sun: Σ of masses along the rigid-body motion accelerates by it."""
    system = planetary()
    linear = linearize(system)
    _, shapes = eigh(linear.stiffness, linear.mass)
    rigid = shapes[:, 0]  # φᵀMφ = 1
    force = 0.02  # turns the sun by 1.3 mrad: geometry adds the square of that
    record = simulate(
        system, [Excitation(SUN, Constant(force))], duration=0.1, integrator=by(TRAPEZOIDAL, 2e-5),
        record=("acceleration",),
    )  # fmt: skip
    # The rigid mode's acceleration is φᵀM q̈ = φᵀ f, whatever vibrates beside it. α M damps
    # it, as α = 1/s says.
    assert record.acceleration is not None
    along = record.acceleration @ linear.mass @ rigid
    expected = rigid[2] * force * np.exp(-1.0 * record.time)
    np.testing.assert_allclose(along, expected, rtol=1e-5)


def test_what_was_chosen_is_as_accurate_as_it_says() -> None:
    """The paper's drivetrain to 4 kHz, with a hub at 7.5 MHz: FRFs of one period of the orbit.

    Frequencies bend by 1e-4 at 4 kHz, so that a mode of ζ = 2 % is 1e-4/2ζ = 0.25 % off at its
    peak, and responses near their antiresonances by more of themselves, but not of their peaks.
    """
    system = build_drivetrain(damped(paper(), rayleigh_damping(0.02, 40.0, 1000.0)))
    linear = linearize(system)
    signal = schroeder_multisine(100.0, 4000.0, 100.0, 1.0)
    integrator = choose_integrator(linear, 4000.0, sampling_frequency=20000.0)
    assert integrator.name == TRAPEZOIDAL
    record = simulate(
        system, [Excitation(PINION, signal)], duration=0.01, integrator=integrator,
        sampling_frequency=20000.0,
        start_state=steady_start(
            linear, PINION, signal.frequency, signal.spectrum, integrator.step
        ),
    )  # fmt: skip
    assert record.displacement is not None
    motion = np.fft.rfft(record.displacement, axis=0)[signal.harmonics]
    found = motion / np.fft.rfft(record.forces[:, 0])[signal.harmonics, None]
    expected = harmonic_response(linear, signal.frequency, linear.dofs, [PINION])[:, :, 0]
    peaks = np.abs(expected).max(axis=0)
    responding = peaks > 1e-5 * peaks.max()
    assert responding.sum() > 10
    error = np.abs(found - expected).max(axis=0)[responding] / peaks[responding]
    assert error.max() < 2.5e-3


# Mesh forces


def mesh_errors(system: MultibodySystem, record: TransientRecord, law: Any) -> list[float]:
    springs = {spring.name: spring for spring in components(system).springs}
    assert record.mesh_forces is not None
    errors = []
    for column, name in enumerate(record.meshes):
        spring = springs[name]
        stretch, rate = (m @ spring.deflection[0] for m in (record.displacement, record.velocity))
        expected = law(spring.stiffness[0, 0], stretch, rate, record.time)
        errors.append(largest_error(record.mesh_forces[:, column], expected))
    return errors


def test_mesh_forces_are_those_of_the_springs() -> None:
    """k δ + β k δ̇, tension positive; 1e-8 N of round-off and 1e-6 of geometry, of 0.3 N."""
    system = planetary()
    record = simulate(
        system, [at(SUN)], duration=2e-3, integrator=by(RK44, 5e-6),
        record=("displacement", "velocity", "mesh_forces"),
    )  # fmt: skip
    assert record.meshes[:2] == ("mesh planetary.sun – planet1", "mesh planetary.ring – planet1")
    errors = mesh_errors(system, record, lambda k, s, v, t: k * (s + 1e-6 * v))
    assert len(errors) == 8
    assert max(errors) < 5e-6


@pytest.mark.parametrize("name", [RK44, TRAPEZOIDAL])
def test_mesh_forces_of_a_law_over_time(name: str) -> None:
    """k (1 + 0.3 cos 2πft) δ + c δ̇: in later pieces too, the law sees the time of the run."""
    drivetrain = damped(load("lin-parker-4"))
    mesh = "mesh planetary.sun – planet1"
    law = MeshLaw(frequency=700.0, stiffness=FourierSeries((0.3,), (0.0,)))
    system = build_drivetrain(drivetrain, {mesh: law})
    record = simulate(
        system, [at(SUN)], duration=4e-3, integrator=by(name, 5e-6), piece=1e-3,
        record=("displacement", "velocity", "mesh_forces"),
    )  # fmt: skip

    def expected(k: float, stretch: Any, rate: Any, time: Any) -> Any:
        varying = np.array([law.relative_stiffness(t) for t in time])
        return k * (varying * stretch + 1e-6 * rate)

    assert record.meshes[0] == mesh
    assert mesh_errors(system, record, expected)[0] < 5e-6


# Pieces, sampling, records


def in_pieces(name: str, step: float, piece: float) -> TransientRecord:
    return simulate(
        planetary(), [at(SUN), at("planetary.planet2.u", 0.5, 900.0)], duration=0.02,
        integrator=by(name, step), piece=piece, record=QUANTITIES,
    )  # fmt: skip


# An explicit run's power goes through a parabola, not a cubic, at the ends of its pieces: h⁴P‴/24,
# (2ωh)³/24 of a step's work, with power at twice the 1500 Hz of the force and h = 1e-5 s.
PIECE_ENDS = (2.0 * 2.0 * np.pi * 1500.0 * 1e-5) ** 3 / 24.0  # 2.8e-4; measured 4e-5


@pytest.mark.parametrize(
    ("name", "step", "tolerance"),
    [
        # A piece's step is its length over its steps: it differs by round-off, and from then on
        # the springs' forces do, by ε‖Kx‖ = 3e-8 N of 1 N.
        (RK44, 1e-5, 1e-7),
        # Each piece has its own iteration matrix: equations are solved to 1e-9 of a step, or to
        # the round-off of the springs, 1e-8 N of 1 N.
        (TRAPEZOIDAL, 1e-5, 1e-6),
    ],
)
def test_pieces_are_one_run(name: str, step: float, tolerance: float) -> None:
    whole, pieces = in_pieces(name, step, 1.0), in_pieces(name, step, 1.7e-3)
    for what in ("forces", *QUANTITIES):
        allowed = PIECE_ENDS if what == "work" and name == RK44 else tolerance
        assert largest_error(getattr(pieces, what), getattr(whole, what)) < allowed, what


def test_samples_are_every_nth_step() -> None:
    system = planetary()
    settings: dict[str, Any] = {
        "duration": 0.01,
        "integrator": by(RK44, 1e-5),
        "record": QUANTITIES,
    }
    all_steps = simulate(system, [at(SUN)], **settings)
    some = simulate(system, [at(SUN)], sampling_frequency=25000.0, piece=1e-3, **settings)
    assert some.n_samples == 250
    np.testing.assert_array_equal(some.time, np.arange(250) / 25000.0)
    np.testing.assert_allclose(some.forces[:, 0], np.cos(3000.0 * np.pi * some.time), atol=1e-12)
    for what in ("forces", *QUANTITIES):
        expected = getattr(all_steps, what)
        # Work is done from one sample to the next, and there are four steps between two.
        expected = expected.reshape(-1, 4).sum(axis=1) if what == "work" else expected[::4]
        allowed = PIECE_ENDS if what == "work" else 1e-7
        assert largest_error(getattr(some, what), expected) < allowed


def test_forces_at_one_dof_are_added() -> None:
    system = planetary()
    settings: dict[str, Any] = {"duration": 2e-3, "integrator": by(RK44, 1e-5)}
    two = simulate(system, [at(SUN, 0.25), at(SUN, 0.75)], **settings)
    one = simulate(system, [at(SUN)], **settings)
    assert two.excitations == one.excitations == (SUN,)
    np.testing.assert_allclose(two.forces, one.forces, rtol=1e-15)
    assert largest_error(two.displacement, one.displacement) < 1e-7


def test_responses_can_be_chosen_and_a_welded_hub_is_one_of_them() -> None:
    """Welded to the wheel at equal radii the hub turns as it does, whichever of them is driven."""
    system = build_drivetrain(damped(paper(first_stiffness="rigid")))
    ((hub, (wheel, factor)),) = system.derived.items()
    settings: dict[str, Any] = {
        "duration": 1e-3,
        "integrator": by(TRAPEZOIDAL, 1e-6),
        "responses": (hub, wheel),
    }
    at_hub = simulate(system, [at(hub)], **settings)
    at_wheel = simulate(system, [at(wheel, factor)], **settings)
    assert at_hub.displacement is not None
    assert at_hub.labels == (hub, wheel)
    np.testing.assert_allclose(
        at_hub.displacement[:, 0], factor * at_hub.displacement[:, 1], rtol=1e-12
    )
    assert largest_error(at_hub.displacement, at_wheel.displacement) < 1e-9


def test_a_system_is_left_as_it_was_found() -> None:
    system = planetary()
    before = linearize(system)
    settings: dict[str, Any] = {
        "duration": 2e-3,
        "integrator": by(RK44, 1e-5),
        "record": QUANTITIES,
    }
    first = simulate(system, [at(SUN)], **settings)
    second = simulate(system, [at(SUN)], **settings)
    np.testing.assert_array_equal(first.displacement, second.displacement)
    np.testing.assert_array_equal(linearize(system).stiffness, before.stiffness)
    data = system.mbs.systemData
    assert (data.NumberOfLoads(), data.NumberOfSensors()) == (0, 0)


def test_nothing_is_written_nor_said(tmp_path: Path, monkeypatch: Any, capfd: Any) -> None:
    monkeypatch.chdir(tmp_path)
    simulate(planetary(), [at(SUN)], duration=1e-3, integrator=by(RK44, 1e-5), record=QUANTITIES)
    assert list(tmp_path.iterdir()) == []
    assert capfd.readouterr() == ("", "")


def test_progress_is_told_in_steps() -> None:
    told: list[tuple[str, int, int]] = []
    simulate(
        planetary(), [at(SUN)], duration=2e-3, integrator=by(RK44, 1e-5), piece=5e-4,
        sampling_frequency=50000.0, progress=lambda *step: told.append(step),
    )  # fmt: skip
    assert told == [("time integration", done, 200) for done in (0, 50, 100, 150, 200)]


def test_a_span_of_a_record() -> None:
    record = simulate(planetary(), [at(SUN)], duration=2e-3, integrator=by(RK44, 1e-5))
    part = record.span(50, 150)
    np.testing.assert_allclose(part.time, record.time[50:150], rtol=1e-15)
    assert record.displacement is not None
    np.testing.assert_array_equal(part.displacement, record.displacement[50:150])
    np.testing.assert_array_equal(part.forces, record.forces[50:150])


# Aliasing


def test_what_sampling_folds_back_is_measured() -> None:
    """A sine of 3 kHz beside one of 1 kHz, seen in a sampling at 5 kHz: its share of the variance.

    In the steady state the shares are those of |H F|²; the rest is the transient dying out.
    """
    system = planetary()
    linear = linearize(system)
    row = linear.dofs.index(SUN)

    def level(frequency: float) -> float:
        omega = 2.0 * np.pi * frequency
        dynamic = linear.stiffness - omega**2 * linear.mass + 1j * omega * linear.damping
        return float(abs(np.linalg.inv(dynamic)[row, row]) ** 2)

    settings: dict[str, Any] = {
        "duration": 0.25,
        "integrator": by(TRAPEZOIDAL, 1e-5),
        "responses": (SUN,),
    }
    beyond = _Unbanded((Harmonic(1.0, 1000.0), Harmonic(1.0, 3000.0)))
    record = simulate(system, [Excitation(SUN, beyond)], sampling_frequency=5000.0, **settings)
    expected = level(3000.0) / (level(1000.0) + level(3000.0))
    assert record.aliasing == pytest.approx(expected, rel=0.2)
    assert len(record.warnings) == 1
    assert record.warnings[0].startswith(f"aliasing: {record.aliasing:.2g} of the variance of")
    assert "displacement of planetary.sun.w lies above 2500 Hz" in record.warnings[0]
    enough = simulate(system, [Excitation(SUN, beyond)], **settings)
    assert (enough.aliasing, enough.warnings) == (0.0, ())


@dataclass(frozen=True)
class _Unbanded:
    """Sines that do not say how high they reach."""

    sines: tuple[Harmonic, ...]
    band = (0.0, 0.0)
    period = None
    duration = None

    def values(self, time: Any) -> Any:
        return sum(sine.values(time) for sine in self.sines)


def test_a_smooth_motion_folds_nothing_back() -> None:
    """A multisine to 1 kHz sampled at 10 kHz, in displacement: no warning."""
    signal = schroeder_multisine(100.0, 1000.0, 100.0, 1.0)
    record = simulate(
        planetary(), [Excitation(SUN, signal)], duration=0.1, integrator=by(RK44, 2e-5),
        sampling_frequency=10000.0,
    )  # fmt: skip
    assert 0.0 < record.aliasing < 1e-4
    assert record.warnings == ()
