"""Runs in time that cannot be, or do not end well: one clear message each."""

from __future__ import annotations

import io
import signal
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mbs_models.contact.mesh_excitation import LawSamples, MeshForce, MeshLaw
from mbs_models.errors import ModelError
from mbs_models.integration.integrators import RK44, TRAPEZOIDAL, stable_step
from mbs_models.integration.run_store import CHECKPOINT, DIGEST_BYTES
from mbs_models.integration.time_integration import SimulationError, simulate
from mbs_models.model.excitation import Excitation
from mbs_models.model.model_file import load
from mbs_models.signals.waveforms import FourierSeries
from mbs_models.system import elements
from mbs_models.system.drivetrain import build_drivetrain
from mbs_models.system.linearization import linearize
from mbs_models.system.locking import lock_dofs
from tests.mbs_models.transient_runs import SUN, at, by, planetary
from tests.strategies import paper


def test_the_stability_limit_is_exudyns() -> None:
    """1 % below it a run stays where it is; 1 % above it, were it let, it would grow.

    |R|² = 1 − x⁶/72 + x⁸/576 at x = 1.01 √8: 7 % a step.
    """
    system = build_drivetrain(load("lin-parker-4"))
    limit, _ = stable_step(linearize(system))
    below = simulate(system, [at(SUN)], duration=0.1, integrator=by(RK44, 0.99 * limit))
    assert below.displacement is not None
    assert np.abs(below.displacement).max() < 1e-6
    with pytest.raises(ModelError, match=r"RK44 is stable below 3.44e-05 s only.*13.1 kHz"):
        simulate(system, [at(SUN)], duration=0.1, integrator=by(RK44, 1.01 * limit))


def test_a_law_that_stiffens_beyond_the_limit_diverges() -> None:
    """Linearised at t = 0 the meshes have their mean stiffness; then six times it."""
    law = MeshLaw(frequency=10.0, stiffness=FourierSeries((5.0,), (-np.pi / 2.0,)))
    stage = load("lin-parker-4")
    names = build_drivetrain(stage).meshes
    system = build_drivetrain(stage, dict.fromkeys(names, law))
    with pytest.raises(
        SimulationError,
        match=r"diverged at 0\.\d+ s \(displacement\) \(RK44, h = 3e-05 s\): the step is too long",
    ):
        simulate(system, [at(SUN)], duration=0.05, integrator=by(RK44, 3e-5))


def test_a_run_that_diverges_keeps_what_was_before(tmp_path: Path) -> None:
    """A law that turns into an explosive after 10 ms: pieces to 10 ms are good, and stay."""
    system = planetary()
    explosive = _Jump(0.0105)
    with pytest.raises(SimulationError, match=r"diverged at 0.01\d+ s"):
        simulate(
            system, [Excitation(SUN, explosive)], duration=0.05, integrator=by(RK44, 1e-5),
            piece=5e-3, store=tmp_path / "run",
        )  # fmt: skip
    assert not (tmp_path / "run" / "displacement.npy").exists()
    content = (tmp_path / "run" / CHECKPOINT).read_bytes()[DIGEST_BYTES:]
    with np.load(io.BytesIO(content)) as checkpoint:
        assert checkpoint["samples"] == 1000


@dataclass(frozen=True)
class _Jump:
    """1e200 N from an instant on."""

    instant: float
    band = (0.0, 0.0)
    period = None
    duration = None

    def values(self, time: Any) -> Any:
        return np.where(time < self.instant, 1.0, 1e200)


def test_a_step_without_a_solution_is_named() -> None:
    hammer = Excitation(SUN, _Jump(1e-3))
    with pytest.raises(SimulationError, match=r"step to 0.001 s have no solution \(trapezoidal"):
        simulate(planetary(), [hammer], duration=2e-3, integrator=by(TRAPEZOIDAL, 1e-5))


def test_an_interrupt_is_one_and_leaves_the_system_as_it_was(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As if Ctrl-C were pressed while a mesh's force is computed: it ends exudyn's solver, and is
    raised when that has returned.
    """

    def interrupting(stiffness: float, damping: float, samples: LawSamples) -> MeshForce:
        def force(time: float, deflection: float, rate: float) -> tuple[float, float, float]:
            if time > 5e-4:
                signal.raise_signal(signal.SIGINT)
            return stiffness * deflection, stiffness, damping

        return force

    monkeypatch.setattr(elements, "mesh_force", interrupting)
    system = build_drivetrain(load("lin-parker-4"))
    with pytest.raises(KeyboardInterrupt):
        simulate(system, [at(SUN)], duration=2e-3, integrator=by(RK44, 1e-5))
    assert system.mbs.systemData.NumberOfLoads() == 0


@dataclass(frozen=True)
class _Gap:
    """NaN at an instant."""

    band = (0.0, 0.0)
    period = None
    duration = None

    def values(self, time: Any) -> Any:
        return np.where(np.isclose(time, 5e-4), np.nan, 1.0)


GOOD: dict[str, Any] = {"duration": 2e-3, "integrator": by(RK44, 1e-5)}
SHORT = (np.zeros(3), np.zeros(3))
NAN = (np.full(21, np.nan), np.zeros(21))


@pytest.mark.parametrize(
    ("excitation", "keys", "words"),
    [
        (at("planetary.sun.q"), {}, r"'planetary.sun.q': no such DoF; known: planetary.sun.u"),
        (at(SUN), {"responses": ("sun.w",)}, "response 'sun.w': no such DoF; known: planetary"),
        (at(SUN), {"record": ("position",)}, "'position': must be one of displacement, velocity"),
        (at(SUN, frequency=6e4), {}, "reaches 60000 Hz; must be below the Nyquist"),
        (at(SUN), {"sampling_frequency": 3000.0}, "3.*of them make a sampling interval"),
        (at(SUN), {"sampling_frequency": 0.0}, "sampling frequency: must be above 0 Hz, got 0 Hz"),
        (at(SUN), {"sampling_frequency": 2500.0}, "reaches 1500 Hz; must be below the Nyquist"),
        (at(SUN, frequency=400.0), {}, "shorter than one period of 0.0025 s"),
        (at(SUN), {"duration": 0.0}, "duration 0 s: must be at least one sampling interval"),
        (at(SUN), {"duration": float("nan")}, "duration nan s"),
        (at(SUN), {"piece": 0.0}, "piece 0 s: must be above 0 s"),
        (at(SUN), {"start_state": SHORT}, "the displacement must be 21 finite numbers"),
        (at(SUN), {"start_state": NAN}, "the displacement must be 21 finite numbers"),
        (at(SUN), {"duration": 3600.0}, "GiB of memory, 1 GiB are allowed: store it in a direct"),
        (Excitation(SUN, _Gap()), {}, f"excitation at '{SUN}': the force is nan at 0.0005 s"),
    ],
)
def test_what_cannot_be_run(excitation: Any, keys: dict[str, Any], words: str) -> None:
    with pytest.raises(ModelError, match=words):
        simulate(planetary(), [excitation], **(GOOD | keys))


def test_constraints_and_explicit_solvers() -> None:
    for system in (
        build_drivetrain(paper(first_stiffness="rigid")),
        lock_dofs(planetary(), ["planetary.ring.w"]),
    ):
        with pytest.raises(ModelError, match="explicit solvers do not take; use 'trapezoidal'"):
            simulate(system, [], **GOOD)
    held = lock_dofs(planetary(), ["planetary.ring.w"])
    record = simulate(held, [at(SUN)], duration=2e-3, integrator=by(TRAPEZOIDAL, 1e-5))
    assert "planetary.ring.w" not in record.labels
    assert record.displacement is not None
    assert np.isfinite(record.displacement).all()
