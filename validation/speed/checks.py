"""What must hold of every steady state, whatever the speed: mean forces are in equilibrium.

Take a family of meshes out (all between sun and planets): the motion R that strains nothing else
and moves all its meshes alike, v_mᵀ R = 1, is held by that family alone. It is a rotation of what
hangs together, so that no tilt of lines of action matters. Nothing accelerates for good, hence

    Σ_m F̄_m = fᵀ R,    F̄_m the mean forces of its meshes, f the load,

however the meshes vary: the torque through a family is what statics say. On a planet nothing but
its two meshes has a torque, whose means are equal for that reason.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from mbs_models.gears.orders import free_motions

from ..arrays import FloatArray
from ..checks.check import Check
from .steady import SteadyStates
from .turning import MeshFamily, Turning

ROUTES = ("statics", "harmonic balance")
MEAN_TOLERANCE = 1e-6
MEAN_REASON = (
    "an identity, held to round-off: a static state is accepted at 1e-6 of the load, and the "
    "balance is solved far beyond that"
)


def steady_checks(turning: Turning, states: SteadyStates) -> tuple[Check, ...]:
    """Mean forces against statics, and on every planet sun's against ring's."""
    return (*_torques(turning, states), *_planets(turning, states))


def load_of(turning: Turning) -> FloatArray:
    """The constant forces (n_dof,) N on the drivetrain."""
    dofs = turning.periodic.system.dofs
    load = np.zeros(len(dofs))
    for excitation in turning.point.loads:
        load[dofs.index(excitation.dof)] += excitation.signal.force
    return load


def _torques(turning: Turning, states: SteadyStates) -> Iterator[Check]:
    load = load_of(turning)
    if not np.any(load):
        return
    for family in turning.families:
        held = _held_by(turning, family)
        if held is None:
            continue
        mean = states.mesh[states.ok][:, 0, list(family.columns)].real.sum(axis=1)
        wanted = float(load @ held)
        yield _check(
            "mean mesh forces against statics",
            family.name,
            "largest difference of their sum, of the largest of any",
            states.rpm[states.ok],
            np.abs(mean - wanted) / max(np.abs(mean).max(), abs(wanted)),
        )


def _held_by(turning: Turning, family: MeshFamily) -> FloatArray | None:
    """R (n_dof,) of a family; None where there is none, as in a loop."""
    parts = turning.parts
    names = {turning.meshes[column] for column in family.columns}
    without = replace(parts, springs=tuple(s for s in parts.springs if s.name not in names))
    free = free_motions(without)
    vectors = np.array(
        [
            np.sign(s.deflection[0] @ turning.periodic.springs[column].vector) * s.deflection[0]
            for column in family.columns
            for s in parts.springs
            if s.name == turning.meshes[column]
        ]
    )
    alike = np.ones(len(vectors))
    share, *_ = np.linalg.lstsq(vectors @ free, alike, rcond=1e-9)
    if np.abs(vectors @ free @ share - alike).max() > 1e-9:
        return None
    return np.asarray(free @ share)


def _planets(turning: Turning, states: SteadyStates) -> Iterator[Check]:
    columns = {family.name: list(family.columns) for family in turning.families}
    mean = states.mesh[states.ok][:, 0].real
    for stage in turning.plan.drivetrain.stages if np.any(turning.static_forces) else ():
        for _, *families in stage.planet_meshes():
            sun, ring = (mean[:, columns[family.label]] for family in families)
            yield _check(
                "mean force of sun and ring on every planet",
                stage.name,
                "largest difference, of the largest mean force",
                states.rpm[states.ok],
                np.abs(sun - ring).max(axis=1) / np.abs(sun).max(),
            )


def _check(name: str, subject: str, measure: str, rpm: FloatArray, values: FloatArray) -> Check:
    worst = int(np.argmax(values))
    value = float(values[worst])
    wrong = not value <= MEAN_TOLERANCE
    findings = (f"largest at {rpm[worst]:.5g} rpm",) if wrong else ()
    return Check(name, subject, ROUTES, measure, value, MEAN_TOLERANCE, MEAN_REASON, findings)
