"""Guo 2011, PhD thesis, Ohio State University: mesh phases, what they suppress, and instabilities.

*Analytical study on compound planetary gear dynamics*, read in full text (pp. 118–197). Chapters 5
and 6 extend Parker & Lin (2004, J. Mech. Des. 126, 365–370), Parker (2000, J. Sound Vib. 236,
561–573) and Ambarisha & Parker (2006, J. Vib. Acoust. 128, 133–142); for the sun's meshes they are
those papers' own formulas, and Table 6.2 is their rule. The papers themselves were not read.

The thesis' gear sets have two planets in a row. Only teeth of the sun and the number of planets
count for what is tested here: simple stages with these take their place.

Chapter 7 has formulas, no numbers: they are met with the gear set of Lin & Parker (1999).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest

from fbs import outputs, stability, steady_state
from mbs_models.gears.operating_point import OperatingPoint, operating_point
from mbs_models.gears.phasing import phasing
from mbs_models.integration.integrators import RK44, Integrator
from mbs_models.integration.time_integration import simulate
from mbs_models.modal.mode_kinds import Kind
from mbs_models.model.model_file import load
from mbs_models.model.parameters import Drivetrain, PlanetaryStage
from mbs_models.signals.waveforms import Trapezoid
from mbs_models.stages.planet_set import mesh_phases
from mbs_models.system.drivetrain import build_drivetrain
from tests.geared import family_amplitudes, speed_for
from tests.literature.stiffness_series import SLOPE, coefficients
from tests.strategies import changed
from validation.routes.floquet import (
    ParametricSystem,
    Tongue,
    growth_rate,
    parametric_system,
    tongues,
)
from validation.routes.periodic_meshes import PeriodicDrivetrain, parametric

TRAPEZOID = {"shape": "trapezoid", "contact_ratio": 1.6, "transition": 0.3}


def drivetrain_with(
    z_s: int, z_p: int, planets: int, *, alpha: float = 0.0, beta: float = 0.0, **stage: Any
) -> Drivetrain:
    """Lin & Parker's (1999) masses and springs with these teeth; radii go with the teeth."""
    drivetrain = load("lin-parker-4")
    (own,) = drivetrain.stages
    tables = own.model_dump(exclude_unset=True) | {"planets": planets} | stage
    for gear, teeth in (("sun", z_s), ("planet", z_p), ("ring", z_s + 2 * z_p)):
        tables[gear] = tables[gear] | {"teeth": teeth}
    tables["planet"] |= {"base_radius": tables["sun"]["base_radius"] * z_p / z_s}
    return changed(
        drivetrain,
        stage=[tables],
        operation={"input": "planetary.sun", "speed_range": [0.0, 10000.0]},
        damping={"stiffness_proportional": beta, "mass_proportional": alpha},
    )


def stage_of(drivetrain: Drivetrain) -> PlanetaryStage:
    (stage,) = drivetrain.stages
    assert isinstance(stage, PlanetaryStage)
    return stage


# Chapter 5: phases


@pytest.mark.parametrize(
    ("z_s", "z_p", "analytical", "numerical", "error"),
    [
        (35, 37, (0.0, 0.667, 0.333), (0.0, 0.663, 0.331), 0.0031),
        (29, 29, (0.0, 0.250, 0.500, 0.750), (-0.001, 0.254, 0.503, 0.753), 0.0048),
    ],
    ids=["stage 1", "stage 2"],
)
def test_table_5_6(
    z_s: int,
    z_p: int,
    analytical: Sequence[float],
    numerical: Sequence[float],
    error: float,
) -> None:
    """γ of the sun's meshes: as printed, and as Planetary2D's finite elements found contact.

    The latter to the printed error of their time step and 1e-3: 0.663 is 0.0037 from 2/3, beyond
    its ±0.0031.
    """
    found = mesh_phases(stage_of(drivetrain_with(z_s, z_p, len(analytical))).planet_set).sun
    assert found == pytest.approx(analytical, abs=5e-4)
    assert found == pytest.approx(numerical, abs=error + 1e-3)


# Chapter 6: what phases suppress

# z_s, z_p (ours: planets can be put in), N; k_μ for μ = 1 … 4 as printed in Tables 6.5 and 6.7.
CASES = {
    "table 6.5, case 1": (29, 29, 4, (1, 2, 3, 0)),
    "table 6.5, case 2": (30, 30, 4, (2, 0, 2, 0)),
    "table 6.7, case 1": (24, 18, 6, (0, 0, 0, 0)),
    "table 6.7, case 2": (26, 19, 6, (2, 4, 0, 2)),
}


def excited(k: int, planets: int) -> Kind:
    """Table 6.2."""
    if k == 0:
        return Kind.ROTATIONAL
    return Kind.TRANSLATIONAL if k in (1, planets - 1) else Kind.PLANET


@pytest.mark.parametrize("case", CASES)
def test_tables_6_2_6_5_and_6_7(case: str) -> None:
    z_s, z_p, planets, numbers = CASES[case]
    found = phasing(stage_of(drivetrain_with(z_s, z_p, planets)).planet_set, 4)
    assert tuple(p.phasing_number for p in found) == numbers
    assert [p.excited for p in found] == [excited(k, planets) for k in numbers]


@pytest.mark.parametrize(
    ("z_s", "z_p", "planets"),
    [*(case[:3] for case in CASES.values()), (35, 37, 3), (27, 33, 5), (30, 40, 5)],
)
def test_table_6_2_holds_in_the_steady_state(z_s: int, z_p: int, planets: int) -> None:
    """Ten harmonics of k(t) under torque, through all resonances below 13 kHz: one family each.

    Phases are kept to 12 digits: 2π · 10 · 5e-13 = 3e-11 of a mesh force, of which a resonance of
    the other families (1/2ζ, ζ above 0.4 %) makes 4e-9.
    """
    drivetrain = drivetrain_with(
        z_s, z_p, planets, beta=2e-6, sun_mesh_variation=TRAPEZOID, ring_mesh_variation=TRAPEZOID
    )
    model = parametric(drivetrain, operating_point(drivetrain, speed_rpm=1000.0, torque=100.0))
    ratio = model.springs[0].ratio
    speeds = np.linspace(300.0, 4000.0, 75) / ratio
    response = steady_state(model.system, model.springs, speeds)
    motion = outputs(response, np.eye(len(model.system.dofs)))
    for harmonic in range(1, 11):
        kind = excited(harmonic * z_s % planets, planets)
        line = response.lattice.harmonic(0, harmonic)
        for lines in motion[:, line]:
            size = family_amplitudes(model.system.dofs, lines, planets)
            for other in set(size) - {kind}:
                assert size[other] < 4e-9 * size[kind], (harmonic, kind, size)


@pytest.mark.parametrize(("z_s", "z_p"), [(29, 29), (30, 30)])
def test_the_suns_translation_of_figures_6_5_and_6_6(z_s: int, z_p: int) -> None:
    """exudyn in time under torque: z_s = 29 moves the sun sideways in odd harmonics, 30 in none.

    As their finite elements do (p. 162, 164). What is left of the transient is e^(−α t/2) = e^−20.
    """
    alpha, frequency, per_period = 2000.0, 1000.0, 200
    drivetrain = drivetrain_with(
        z_s, z_p, 4, alpha=alpha, sun_mesh_variation=TRAPEZOID, ring_mesh_variation=TRAPEZOID
    )
    point = operating_point(drivetrain, speed_rpm=speed_for(drivetrain, frequency), torque=30.0)
    record = simulate(
        build_drivetrain(drivetrain, point.laws),
        point.loads,
        duration=40.0 / alpha + 1.0 / frequency,
        integrator=Integrator(RK44, 1.0 / (per_period * frequency), "test"),
        start_state=point.start_state,
    )
    assert record.displacement is not None
    steady = np.abs(np.fft.rfft(record.displacement[-per_period:], axis=0) / per_period)
    sideways = steady[1:5, record.labels.index("planetary.sun.u")]
    largest = steady[1:5].max()
    moves = [True, False, True, False] if z_s == 29 else [False] * 4
    for size, expected in zip(sideways, moves, strict=True):
        assert size > 1e-3 * largest if expected else size < 1e-6 * largest, sideways


# Chapter 7: parametric instabilities

CONTACT_RATIOS = {"sun": 1.4, "ring": 1.6}
AMPLITUDE = 0.005  # 2ξ: second-order terms are below 1 % of any width
# Lin & Parker (1999), Table 2, N = 5, as printed (Hz).
ROTATIONAL = (1567.4, 2006.1, 2614.8, 8065.4, 14253.1)
PLANET = (1808.2, 5963.8, 6981.7)
TEETH = {0: (35, 45), 2: (27, 33)}  # k_1 → z_s and z_p with N = 5


@pytest.mark.parametrize("mu", [1, 2, 3, 7])
@pytest.mark.parametrize("contact_ratio", [1.3, 1.5, 1.6, 1.85])
def test_the_trapezoid_is_equation_7_3(mu: int, contact_ratio: float) -> None:
    """Fewer pairs from where τ = d until τ = 1, more from the pitch point on: low at (1 + d)/2."""
    share = contact_ratio - 1.0
    waveform = Trapezoid(0.4, share, 2.0 * SLOPE, (1.0 + share) / 2.0)
    a, b = coefficients(mu, contact_ratio, 0.0, SLOPE)
    assert waveform.harmonic(mu) == pytest.approx(0.4 * complex(b, -a), abs=1e-15)


def geared(phasing_number: int, **changes: Any) -> tuple[ParametricSystem, PeriodicDrivetrain]:
    """N = 5 planets: for Magnus' Floquet theory with its modes, and as periodic springs."""
    z_s, z_p = TEETH[phasing_number]
    ratios = CONTACT_RATIOS | changes
    tables: dict[str, Any] = {
        f"{gear}_mesh_variation": {
            "shape": "trapezoid",
            "contact_ratio": ratio,
            "amplitude": AMPLITUDE,
            "transition": 2.0 * SLOPE,
            "phase": ratio / 2.0,
        }
        for gear, ratio in ratios.items()
    }
    drivetrain = drivetrain_with(z_s, z_p, 5, **tables)
    point: OperatingPoint = operating_point(drivetrain, speed_rpm=speed_for(drivetrain, 1000.0))
    return parametric_system(drivetrain, point.laws), parametric(drivetrain, point, series=128)


def half_width(system: ParametricSystem, mu: int, first: float, second: float) -> float:
    """ξ √(Λ/(ω_e ω_f))/(2π μ) (Hz) for two frequencies (Hz): Eqs. (7.17) to (7.35)."""
    groups = [np.flatnonzero(np.abs(system.frequency - f) < 0.2) for f in (first, second)]
    names = ["sun"] * 5 + ["ring"] * 5
    found = []
    for e, f in itertools.product(*groups):
        key = [0.0, 0.0]
        for name, law, row in zip(names, system.laws, system.participation, strict=True):
            for i, c in enumerate(coefficients(mu, CONTACT_RATIOS[name], law.phase, SLOPE)):
                key[i] += c * row[e] * row[f]
        indicator = key[0] ** 2 + key[1] ** 2
        found.append(np.sqrt(indicator / (system.omega[e] * system.omega[f])))
    return float(AMPLITUDE / 2.0 * max(found) / (2.0 * np.pi * mu))


def by_periodic_springs(model: PeriodicDrivetrain) -> Callable[[float], float]:
    ratio = model.springs[0].ratio

    def growth(frequency: float) -> float:
        return float(stability(model.system, model.springs, [frequency / ratio]).growth_rate[0])

    return growth


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (14253.1, 14253.1),
        (8065.4, 8065.4),
        (1567.4, 8065.4),
        (2614.8, 8065.4),
        (6981.7, 6981.7),
        (5963.8, 5963.8),
    ],
)
def test_boundaries_of_instability(first: float, second: float) -> None:
    """k_1 = 0, Eqs. (7.18) and (7.35), about sums of printed frequencies, by two Floquet theories.

    Just inside both boundaries a motion grows, just outside none does: centre and width to 5 % of
    the width and the 0.1 Hz that two printed frequencies leave open.
    """
    system, model = geared(0)
    width = half_width(system, 1, first, second)
    centre = first + second
    margin = 0.05 * width + 0.1
    routes = (lambda f: growth_rate(system, f), by_periodic_springs(model))
    largest = np.pi * width  # σ = ξ√(Λ/ω_e ω_f)/2 in the middle
    for growth in routes:
        assert growth(centre) == pytest.approx(largest, rel=0.02)
        for side in (-1.0, 1.0):
            assert growth(centre + side * (width - margin)) > 0.1 * largest
            assert growth(centre + side * (width + margin)) < 1e-6 * largest


def combines(found: Sequence[Tongue], first: float, second: float) -> bool:
    return any(
        np.allclose(sorted(tongue.modes), sorted((first, second)), atol=0.2) for tongue in found
    )


def test_table_7_1_where_the_phasing_number_is_zero() -> None:
    """Rotational modes combine, each planet mode with itself, rotational and planet modes never.

    That planet modes do, though the phases suppress their response, is the exception of p. 193.
    Round-off of E_pq is 1e-16 of the widest tongue, 1e-12 its phases' twelve digits.
    """
    system, _ = geared(0)
    found = tongues(system, [1], narrowest_hz=1e-8)
    for first, second in itertools.combinations_with_replacement(ROTATIONAL, 2):
        assert combines(found, first, second)
    for frequency in PLANET:
        assert combines(found, frequency, frequency)
    for first, second in itertools.product(ROTATIONAL, PLANET):
        assert not combines(found, first, second)


def test_table_7_1_where_it_is_not() -> None:
    """Rotational modes do not combine, neither two nor one with itself."""
    system, _ = geared(2)
    found = tongues(system, [1], narrowest_hz=1e-8)
    assert found
    for first, second in itertools.combinations_with_replacement(ROTATIONAL, 2):
        assert not combines(found, first, second)


def test_nothing_grows_where_phases_suppress_the_instability() -> None:
    """Two Floquet theories at twice 14 253.1 Hz: 67 1/s with k_1 = 0, nothing with k_1 = 2.

    To all orders: what adds up to one period has the wave number k_1 around the stage.
    """
    for number in (0, 2):
        system, model = geared(number)
        frequency = 2.0 * float(system.frequency[-1])
        expected = np.pi * half_width(system, 1, 14253.1, 14253.1)
        assert (expected > 60.0) == (number == 0)
        for growth in (growth_rate(system, frequency), by_periodic_springs(model)(frequency)):
            assert growth == pytest.approx(expected, rel=0.02, abs=1e-6)


def test_a_contact_ratio_that_ends_an_instability() -> None:
    """sin(μπc) = 0 (p. 190): with c = 3/2 in all meshes μ = 1 makes a motion grow, μ = 2 does not.

    Left is what the first harmonic does twice, σ_1²/ω times a few.
    """
    system, model = geared(0, sun=1.5, ring=1.5)
    assert not tongues(system, [2], narrowest_hz=1e-8)
    whole = 2.0 * float(system.frequency[-1])
    for growth in (lambda f: growth_rate(system, f), by_periodic_springs(model)):
        once = growth(whole)
        assert once > 60.0
        assert growth(whole / 2.0) < 10.0 * once**2 / system.omega[-1]
