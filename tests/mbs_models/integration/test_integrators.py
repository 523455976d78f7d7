"""Which integrator with which step, and where RK44's limits are."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from mbs_models.errors import ModelError
from mbs_models.integration.integrators import (
    FREQUENCY_BEND,
    RK44,
    TRAPEZOIDAL,
    amplification,
    choose_integrator,
    poles,
    stable_step,
    steps_per_sample,
)
from mbs_models.model.model_file import load
from mbs_models.model.parameters import Damping
from mbs_models.system.drivetrain import build_drivetrain
from mbs_models.system.linearization import LinearizedSystem, linearize
from tests.strategies import damped, paper


def oscillator(stiffness: float, damping: float = 0.0, mass: float = 1.0) -> LinearizedSystem:
    m, c, k = (np.array([[value]]) for value in (mass, damping, stiffness))
    return LinearizedSystem(m, c, k, ("body.w",), {})


def of(drivetrain: Any) -> LinearizedSystem:
    return linearize(build_drivetrain(drivetrain))


def test_rk44_is_stable_to_two_root_two_without_damping() -> None:
    """|R(iy)|² = 1 − y⁶/72 + y⁸/576 (Hairer & Wanner 1996, IV.2), one again at y = √8."""
    limit, pole = stable_step(oscillator(1e6))
    assert limit * 1e3 == pytest.approx(np.sqrt(8.0), rel=1e-8)
    assert abs(pole.value) == pytest.approx(1e3)


def test_rk44_is_stable_to_2_785_where_poles_are_real() -> None:
    """R(x) = 1 on the negative axis: x³ + 4x² + 12x + 24 = 0."""
    limit, pole = stable_step(oscillator(1.0, damping=1e4))
    root = np.roots([1.0, 4.0, 12.0, 24.0])
    real = float(-root[np.abs(root.imag) < 1e-9].real[0])
    assert real == pytest.approx(2.785, abs=1e-3)
    assert limit * abs(pole.value) == pytest.approx(real, rel=1e-8)


def test_amplifications_are_the_exponential_to_their_order() -> None:
    """Error of a step: z⁵/120 and −z³/12, next terms a factor |z| smaller."""
    z = 1e-2 * np.exp(1j * np.linspace(0.5, np.pi, 7) * np.pi)
    explicit = amplification(RK44, z) - np.exp(z)
    np.testing.assert_allclose(explicit, -(z**5) / 120.0, rtol=1e-2)
    implicit = amplification(TRAPEZOIDAL, z) - np.exp(z)
    np.testing.assert_allclose(implicit, z**3 / 12.0, rtol=2e-2)


def test_poles_are_those_of_the_oscillator() -> None:
    """−ζω ± jω√(1 − ζ²)."""
    found = sorted((pole.value for pole in poles(oscillator(1e6, damping=20.0))), key=np.imag)
    expected = -10.0 + 1j * np.sqrt(1e6 - 100.0)
    np.testing.assert_allclose(found, [expected.conjugate(), expected], rtol=1e-12)


def test_a_free_body_limits_no_step() -> None:
    assert stable_step(oscillator(0.0))[0] == np.inf


def test_a_growing_pole_is_no_instability_of_the_integrator() -> None:
    """A body on a negative spring falls off: RK44 follows, |R(hs)| ≤ e^{hs}."""
    assert stable_step(oscillator(-1e6))[0] * 1e3 == pytest.approx(2.785, abs=1e-3)


def test_a_planetary_stage_takes_rk44() -> None:
    integrator = choose_integrator(of(load("lin-parker-4")), 4000.0, sampling_frequency=50000.0)
    assert integrator.name == RK44
    assert integrator.step == 1e-5  # (120e-4)^¼/ω = 1.32e-5 s, fitted to 1/50000 s
    assert integrator.reason == (
        "RK44, h = 1e-05 s: what is at 4 kHz comes out 0.003 % lower; stable below 3.4e-05 s, the "
        "highest mode is at 13.1 kHz (planetary.sun.w)"
    )


def test_a_stiff_hub_takes_the_trapezoidal_rule_and_the_reason_says_so() -> None:
    """2√2/ω of 7.5 MHz is 6e-8 s."""
    integrator = choose_integrator(of(paper()), 4000.0)
    assert integrator.name == TRAPEZOIDAL
    bend = (2.0 * np.pi * 4000.0 * integrator.step) ** 2 / 12.0
    assert 0.99 * FREQUENCY_BEND < bend <= FREQUENCY_BEND
    assert integrator.reason.endswith(
        "the highest mode, 7.52 MHz (coupling.w), would ask an explicit solver for h < 6e-08 s"
    )


def test_stiffness_proportional_damping_makes_the_limit_shorter_still() -> None:
    """βω² of the hub: a real pole of 3.4e9 1/s where the mode alone has 4.7e7."""
    beta = 1.5e-6
    limit, pole = stable_step(of(damped(paper(), Damping(stiffness_proportional=beta))))
    undamped, _ = stable_step(of(paper()))
    rate = beta * (np.sqrt(8.0) / undamped) ** 2
    assert limit == pytest.approx(2.785 / rate, rel=1e-3)
    assert str(pole) == f"{rate:.2g} 1/s (coupling.w, overdamped)"


def test_rigid_couplings_take_the_trapezoidal_rule() -> None:
    welded = of(paper(first_stiffness="rigid"))
    integrator = choose_integrator(welded, 4000.0)
    assert integrator.name == TRAPEZOIDAL
    assert "rigid couplings are constraints between bodies" in integrator.reason
    with pytest.raises(ModelError, match=r"rigid couplings \(coupling.w\) are constraints"):
        choose_integrator(welded, 4000.0, method=RK44)


def test_method_and_step_can_be_given() -> None:
    linear = of(load("lin-parker-4"))
    assert choose_integrator(linear, 4000.0, method=TRAPEZOIDAL).name == TRAPEZOIDAL
    given = choose_integrator(linear, 4000.0, sampling_frequency=50000.0, step=5e-6)
    assert (given.name, given.step) == (RK44, 5e-6)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"method": "Euler"}, "integrator 'Euler': must be 'RK44' or 'trapezoidal'"),
        ({"method": RK44, "step": 4e-5}, r"stable below 3.44e-05 s only.*13.1 kHz \(planetary.sun"),
        ({"method": TRAPEZOIDAL, "step": 2e-4}, "not below half the step's frequency, 2.5 kHz"),
        ({"step": 0.0}, "step: must be above 0 s, got 0 s"),
        ({"step": float("nan")}, "step: must be above 0 s, got nan s"),
        ({"step": 1e-12}, "differ by 1e-09 s or more"),
        ({"fmax": 0.0}, "its end must be above 0 Hz, got 0 Hz"),
        ({"sampling_frequency": 8000.0}, "must end below half the sampling frequency, 4 kHz"),
        ({"sampling_frequency": -1.0}, "sampling frequency: must be above 0 Hz"),
        ({"sampling_frequency": 30000.0, "step": 1e-5}, r"3.333333333 of them.*1.111111111e-05 s"),
    ],
)
def test_what_cannot_be(keys: dict[str, Any], words: str) -> None:
    given = {"fmax": 4000.0} | keys
    with pytest.raises(ModelError, match=words):
        choose_integrator(of(load("lin-parker-4")), **given)


def test_steps_per_sample() -> None:
    assert steps_per_sample(1e-5, 25000.0) == 4
    assert steps_per_sample(1.0 / (3.0 * 44100.0), 44100.0) == 3
