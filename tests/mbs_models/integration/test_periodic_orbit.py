"""exudyn in time: the multisine, the periodic orbit, and the FRFs that come out."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from mbs_models.errors import ModelError, OrbitError
from mbs_models.integration.periodic_orbit import (
    CLOSURE,
    PeriodicRecord,
    periodic_response,
    steps_per_period,
    trapezoidal,
)
from mbs_models.integration.time_integration import SimulationError
from mbs_models.model.excitation import Excitation
from mbs_models.model.model_file import load
from mbs_models.model.parameters import Drivetrain
from mbs_models.signals.lines import Multisine, schroeder_multisine
from mbs_models.system.drivetrain import build_drivetrain
from mbs_models.system.linearization import linearize
from tests.strategies import changed, damped, paper
from validation.checks.time_domain import time_domain_checks
from validation.routes.routes import whole_route
from validation.routes.source import exudyn_source
from validation.routes.time_domain import (
    RAYLEIGH,
    TimeDomain,
    TimeRoute,
    rayleigh_damping,
    time_domain,
    with_damping,
)

SUN = "planetary.sun.w"


def sun_multisine(force: float = 0.5) -> Multisine:
    return schroeder_multisine(100.0, 2000.0, 100.0, force)


def at_sun(force: float = 0.5) -> Excitation[Multisine]:
    return Excitation(SUN, sun_multisine(force))


def lin_parker() -> Drivetrain:
    return damped(load("lin-parker-3"), rayleigh_damping(*RAYLEIGH))


def response(
    drivetrain: Drivetrain, excitation: Excitation[Multisine], steps: int | None = None
) -> PeriodicRecord:
    system = build_drivetrain(drivetrain)
    integrator = trapezoidal(excitation.signal, steps)
    return periodic_response(system, linearize(system), excitation, integrator)


def in_time(drivetrain: Drivetrain, excitation: str, **lines: Any) -> TimeDomain:
    return time_domain(exudyn_source(with_damping(drivetrain)), excitation, **lines)


def test_a_multisine_has_its_lines_and_no_others() -> None:
    signal = sun_multisine()
    samples = signal.samples(1000)
    spectrum = np.fft.rfft(samples) * 2.0 / len(samples)
    np.testing.assert_allclose(spectrum[signal.harmonics], signal.spectrum, rtol=1e-12)
    others = np.delete(spectrum, signal.harmonics)
    assert np.abs(others).max() <= 1e-12 * np.abs(spectrum).max()
    np.testing.assert_allclose(signal.frequency, np.arange(100.0, 2001.0, 100.0))


def test_schroeder_phases_keep_the_peak_low() -> None:
    """Crest factor of a flat multisine of 200 lines: 1.7 (Schroeder 1970), not √400 = 20."""
    samples = schroeder_multisine(1.0, 200.0, 1.0, 1.0).samples(4000)
    assert np.abs(samples).max() / samples.std() < 2.0


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"fmin": 0.0}, "fmin = 0 Hz: must be finite and greater than 0"),
        ({"fmax": 50.0}, "fmin = 100 Hz: must be less than fmax = 50 Hz"),
        ({"amplitudes": 0.0}, "amplitude = 0 N: must be finite and greater than 0"),
    ],
)
def test_multisines_that_are_none(keys: dict[str, float], words: str) -> None:
    given = {"fmin": 100.0, "fmax": 2000.0, "df": 100.0, "amplitudes": 1.0} | keys
    with pytest.raises(ModelError, match=words):
        schroeder_multisine(**given)


def test_lines_beyond_nyquist_are_refused() -> None:
    with pytest.raises(ModelError, match=r"below 200 Hz, the highest is 2000 Hz"):
        sun_multisine().samples(4)


def test_an_unknown_dof_is_refused() -> None:
    signal = Excitation("planetary.sun.q", schroeder_multisine(100.0, 500.0, 100.0, 1.0))
    with pytest.raises(ModelError, match=r"'planetary.sun.q'; known: planetary.sun.u"):
        response(lin_parker(), signal)


def test_the_orbit_closes_and_the_record_says_how() -> None:
    record = response(lin_parker(), at_sun())
    assert record.closed
    assert record.closure <= CLOSURE
    assert record.even_share < 1e-3
    assert record.periods == 1
    assert record.velocity.shape == (steps_per_period(record.excitation.signal), 18)
    assert np.isfinite(record.velocity).all()


def test_halving_the_step_shows_the_trapezoidal_rules_order() -> None:
    """Second order: the error of an FRF falls by four."""
    signal, drivetrain = sun_multisine(), lin_parker()
    steps = 5 * steps_per_period(signal)  # fine enough for the next order not to show
    frfs = [
        response(drivetrain, Excitation(SUN, signal), steps * factor).receptance()[:, 2]
        for factor in (1, 2, 4)
    ]
    differences = [np.abs(a - b).max() for a, b in pairwise(frfs)]
    assert differences[0] / differences[1] == pytest.approx(4.0, rel=0.05)


def test_large_amplitudes_are_not_linear_and_do_not_pass_unnoticed() -> None:
    """Gears turned by a tenth of a radian: geometry bends what is to be linear."""
    assert not response(lin_parker(), at_sun(force=5e3)).closed
    with pytest.raises(SimulationError, match=r"diverged|no solution"):
        response(lin_parker(), at_sun(force=5e8))
    small, larger = (response(lin_parker(), at_sun(force)).even_share for force in (0.5, 5.0))
    assert larger == pytest.approx(10.0 * small, rel=0.1)  # even terms grow with the square


def test_rayleigh_damping_has_its_ratio_at_both_frequencies() -> None:
    damping = rayleigh_damping(0.005, 40.0, 1000.0)
    for frequency in (40.0, 1000.0):
        omega = 2.0 * np.pi * frequency
        ratio = (damping.stiffness_proportional * omega + damping.mass_proportional / omega) / 2.0
        assert ratio == pytest.approx(0.005)


@pytest.mark.slow
@pytest.mark.parametrize("excitation", ["reducer.pinion.w", "coupling.w", "planetary.sun.u"])
def test_frfs_of_the_paper_against_fbs(excitation: str) -> None:
    """10 Hz to 4 kHz, every responding DoF, every line: 0.1 dB, 1°.

    Rayleigh damping of 0.5 % at 40 Hz and 1 kHz. The 7.5 MHz hub and the 42 Hz mode are in it.
    """
    result = in_time(paper(), excitation, df=10.0)
    assert result.frequency[0] == pytest.approx(10.0, rel=1e-6)  # the rule's bend, (ωh)²/12
    assert result.frequency[-1] == pytest.approx(4000.0, rel=0.0102)
    assert len(result.labels) >= 10
    # Allowed are 0.1 dB and 1°; what is left is how well the orbit closes, 1e-7 of the motion on
    # lines up to 80 dB below the peak, and 1e-3, or 0.01 dB and 0.06°, further below.
    assert result.compared.mean() >= 0.99
    assert result.worst_db.max() <= 0.01
    assert result.worst_degrees.max() <= 0.06
    assert all(check.agrees for check in time_domain_checks(result))


def test_a_motion_too_large_to_be_linear_is_no_route(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the smallest motion's orbit does not close, a larger one is tried; then it is said."""
    monkeypatch.setattr("validation.routes.time_domain.AMPLITUDES", (1e-2, 1e-1))
    route = TimeRoute(exudyn_source(lin_parker()))
    with pytest.raises(OrbitError, match=r"does not close|diverged|no solution"):
        route.frf(np.arange(100.0, 2001.0, 100.0), [SUN], [SUN])


def test_the_route_in_time_has_the_frfs_of_the_others() -> None:
    source = exudyn_source(lin_parker())
    found = TimeRoute(source).frf(np.arange(100.0, 2001.0, 100.0), [SUN], [SUN, "planetary.ring.w"])
    exact = whole_route(source).frf(found.frequency, [SUN], [SUN, "planetary.ring.w"])
    np.testing.assert_allclose(found.values, exact.values, rtol=1e-4)


def test_what_a_free_drivetrain_creeps_by_is_not_in_the_record() -> None:
    """A ramp Δt/T would leak N Δ/2πk into line k; measured without it: 1e-4 of the deepest lines.

    The train creeps by 1e-13 m in a period, and its displacements at 4 kHz are as small.
    """
    result = in_time(paper(), "reducer.pinion.w", df=10.0)
    assert result.compared.all()
    assert result.worst_db.max() <= 2e-3  # 2e-2 with the ramp


@pytest.mark.slow
def test_a_planetary_stage_to_15_khz() -> None:
    result = in_time(load("lin-parker-4"), SUN, fmax=15000.0, df=50.0)
    assert result.worst_db.max() <= 0.01  # 0.5 dB is asked for


@pytest.mark.slow
def test_a_wrong_stiffness_shows_in_time() -> None:
    """The transient is of the model as built: FBS of another one is told apart."""
    other = changed(paper().stage("planetary"), sun_mesh_stiffness=5.05e8)
    result = in_time(paper(), "reducer.pinion.w")
    data = paper().model_dump(by_alias=True, exclude_unset=True)
    data["stage"] = [data["stage"][0], other.model_dump(exclude_unset=True)]
    wrong = in_time(changed(paper(), stage=data["stage"]), "reducer.pinion.w")
    shared = result.labels.index(SUN)
    ratio = np.abs(wrong.substructured[:, shared] / result.transient[:, shared])
    assert np.abs(20.0 * np.log10(ratio)).max() > 0.1
