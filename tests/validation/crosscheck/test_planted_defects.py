"""Planted defects over all routes and what they share: caught, and located to the right element."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pytest

from fbs import Frf, SecondOrderSystem, direct_frf, modal_frf
from mbs_models.model.model_file import dumps
from mbs_models.model.parameters import Drivetrain
from tests.strategies import damped, paper, with_stage
from validation.checks.check import Check
from validation.crosscheck.result import CrossCheck
from validation.crosscheck.study import cross_check
from validation.routes import equations
from validation.routes.bands import Band
from validation.routes.model_parameters import changed, known_parameters, model_data, steps_to
from validation.routes.source import Source, equations_source

BAND = Band(50.0, 15000.0, 50.0)
TRAIN = with_stage(damped(paper()), "reducer", helix_angle=15.0)  # every parameter shows
# Nothing linear depends on the first (y is along the line of action, whatever the angle is); the
# others are not of the linear system
EQUIVALENT = ("reducer.pressure_angle", "backlash", "planetary.planet.base_radius",
              "reducer.pinion.base_radius", "planetary.planets")  # fmt: skip


def one_percent(path: str) -> Drivetrain:
    data, value = model_data(TRAIN), known_parameters(TRAIN)[path]
    assert isinstance(value, float)
    from_zero = 1e-6 if path.endswith("backlash") else 1e6  # m, or N/m
    return changed(data, {steps_to(data, path): 1.01 * value if value else from_zero})


def located(path: str) -> tuple[str, ...]:
    """What a first finding has to name: the body, or the bodies that a mesh or coupling joins."""
    owner, _, key = path.rpartition(".")
    if path.startswith("damping."):
        return ("damping",)
    if owner == "coupling":
        return ("coupling.w", "reducer.wheel.w", "planetary.sun.w")
    if key.startswith(("sun_mesh", "ring_mesh", "pressure_angle")) or owner == "planetary.planet":
        return ("planetary.planet", "planetary.sun", "planetary.ring")
    if key.startswith("planet_bearing"):
        return ("planetary.planet", "planetary.carrier")
    if key.endswith("base_radius"):  # that of the coupling's springs
        return ("coupling.w", f"{owner}.")
    return (f"{owner}.",)


PATHS = tuple(
    path
    for path, value in known_parameters(TRAIN).items()
    if isinstance(value, float) and not any(word in path for word in EQUIVALENT)
)


def failed(result: CrossCheck) -> list[Check]:
    return [check for check in result.checks if not check.agrees]


@pytest.mark.parametrize(
    "path",
    ["reducer.pressure_angle", "planetary.planet.base_radius", "reducer.pinion.base_radius",
     "reducer.mesh_backlash", "planetary.sun_mesh_backlash", "planetary.ring_mesh_backlash"],
)  # fmt: skip
def test_excluded_parameters_are_equivalent(path: str) -> None:
    lines = np.linspace(50.0, 15000.0, 60)
    own, other = (
        direct_frf(equations.drivetrain_system(d), lines) for d in (TRAIN, one_percent(path))
    )
    largest = np.abs(own.values).max(axis=(1, 2))
    # Round-off 1e-16 by the condition of a damped system's dynamic stiffness
    assert np.all(np.abs(own.values - other.values).max(axis=(1, 2)) <= 1e-11 * largest)


@pytest.mark.slow
def test_every_parameter_of_one_route_is_caught_and_located() -> None:
    right, wrong = 0, []
    for path in PATHS:
        other = one_percent(path)
        result = cross_check(TRAIN, BAND, equations=lambda _, d=other: equations_source(d))  # type: ignore[misc]
        checks = failed(result)
        assert checks, path
        first = next(finding for check in checks for finding in check.findings)
        if any(words in first for words in located(path)):
            right += 1
        else:
            wrong.append((path, first))
            # Never a false element: only what says that it cannot tell
            assert "not a change of M, C, K" in first or "not traced" in first, (path, first)
    assert len(PATHS) >= 36
    assert right >= 0.95 * len(PATHS), wrong


def _entry(name: str, label: str, factor: float) -> Callable[[Drivetrain], SecondOrderSystem]:
    def whole(drivetrain: Drivetrain) -> SecondOrderSystem:
        return _scaled(equations.drivetrain_system(drivetrain), name, label, factor)

    return whole


def _scaled(system: SecondOrderSystem, name: str, label: str, factor: float) -> SecondOrderSystem:
    matrix = np.array(getattr(system, name))
    at = system.dofs.index(label)
    matrix[at, at] *= factor
    changes: Mapping[str, object] = {name: matrix}
    return replace(system, **changes)  # type: ignore[arg-type]


WHOLE = [
    (name, label)
    for name in ("mass", "damping", "stiffness")
    for label in ("reducer.pinion.y", "planetary.sun.w", "planetary.planet3.v", "coupling.w")
]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "label"), WHOLE)
def test_an_entry_of_the_whole_is_named(name: str, label: str) -> None:
    source = _entry(name, label, 1.001)
    result = cross_check(
        TRAIN, BAND, equations=lambda d: Source("equations", d, source, equations.stage_system)
    )
    first = next(check for check in failed(result) if check.routes[1] == "equations")
    assert first.findings[0].startswith(f"{name} at {label}")


@pytest.mark.slow
@pytest.mark.parametrize(("name", "label"), WHOLE[:-1:2])
def test_an_entry_of_a_stage_is_named(name: str, label: str) -> None:
    def stage(drivetrain: Drivetrain, part: str) -> SecondOrderSystem:
        system = equations.stage_system(drivetrain, part)
        return _scaled(system, name, label, 1.001) if label in system.dofs else system

    result = cross_check(
        TRAIN, BAND, equations=lambda d: Source("equations", d, equations.drivetrain_system, stage)
    )
    assert any(
        finding.startswith(f"{name} at {label}")
        for check in failed(result)
        for finding in check.findings
    )


def _frf(change: Callable[[np.ndarray], np.ndarray]) -> Callable[..., Frf]:
    def made(system: SecondOrderSystem, lines: np.ndarray, *more: object) -> Frf:
        frf = modal_frf(system, lines, *more)  # type: ignore[arg-type]
        return Frf(frf.frequency, change(np.array(frf.values)), frf.responses, frf.excitations)

    return made


def _one_line(values: np.ndarray) -> np.ndarray:
    values[len(values) // 2] *= 1.001
    return values


SYNTHESES = {
    "conjugate": lambda v: v.conj(),
    "0.01 %": lambda v: 1.0001 * v,
    "transposed and scaled": lambda v: v * np.linspace(1.0, 1.001, v.shape[1])[:, None],
    "one line": _one_line,
    "labels shifted": lambda v: np.roll(v, 1, axis=1),
    "signs": lambda v: -v,
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", SYNTHESES)
def test_a_synthesis_that_is_wrong_is_caught(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("validation.routes.routes.modal_frf", _frf(SYNTHESES[kind]))
    routes = {check.routes[1] for check in failed(cross_check(TRAIN, BAND))}
    assert routes
    assert all("FRFs" in check.name for check in failed(cross_check(TRAIN, BAND)))


# What both routes share: the tables themselves. Only the file's own text knows better.
SHARED: Mapping[str, Mapping[str, float]] = {
    "pressure angle": {"planetary.pressure_angle": 24.7},
    "planet's mass": {"planetary.planet.mass": 0.67},
    "sun's inertia": {"planetary.sun.polar_inertia_over_r2": 0.391},
    "planet's inertia": {"planetary.planet.polar_inertia_over_r2": 0.6101},
    "hub": {"coupling.inertia_over_r2": 1e-3},
    "mesh": {"reducer.mesh_stiffness": 2.001e8},
    "bearing": {"reducer.wheel.bearing_y": 3.501e8},
    "planet bearing": {"planetary.planet_bearing": 1.001e8},
    "shaft": {"coupling.second_stiffness": 1.001e5},
    "ring's support": {"planetary.ring.torsional_support": 1.001e9},
    "radius": {"planetary.sun.base_radius": 0.0388},
    "helix": {"reducer.helix_angle": 15.1},
    "planets": {"planetary.planets": 3},
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", SHARED)
def test_what_all_routes_share_is_held_against_the_file(kind: str) -> None:
    data = model_data(TRAIN)
    wrong = changed(data, {steps_to(data, p): v for p, v in SHARED[kind].items()})
    checks = failed(cross_check(wrong, BAND, text=dumps(TRAIN)))
    assert {check.routes[0] for check in checks} == {"model file"}
    assert all(check.findings for check in checks)


def test_the_table_has_sixty_defects() -> None:
    assert len(PATHS) + len(WHOLE) + len(WHOLE[:-1:2]) + len(SYNTHESES) + len(SHARED) >= 60
