"""What must hold of every steady state, whatever the speed: mean forces are in equilibrium.

A motion R that strains nothing once a family of meshes is taken out (the sun of a stage turning
alone, and all that hangs on it) is held by that family alone. Nothing accelerates for good, so that

    Σ_m (v_mᵀ R) F̄_m = fᵀ R,    F̄_m the mean forces of its meshes, f the load,

however the meshes vary: the torque through a family is what statics say. On a planet nothing but
its two meshes has a torque, whose means are equal for that reason.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mbs_models.orders import free_motions
from mbs_models.parameters import PlanetaryStage

from ..results import Check
from .steady import Speeds
from .turning import MeshFamily, Turning

FloatArray = NDArray[np.float64]

ROUTES = ("statics", "harmonic balance")
MEAN_TOLERANCE = 1e-5
MEAN_REASON = (
    "an identity: the static state is known to 1e-6 of the load, the balance is solved to 1e-9 or "
    "better, and the load's own balance is that of the radii"
)


def steady_checks(turning: Turning, found: Speeds) -> tuple[Check, ...]:
    """Mean forces against statics, and on every planet sun's against ring's."""
    return (*_torques(turning, found), *_planets(turning, found))


def load_of(turning: Turning) -> FloatArray:
    """The constant forces (n_dof,) N on the drivetrain."""
    dofs = turning.periodic.system.dofs
    load = np.zeros(len(dofs))
    for excitation in turning.point.loads:
        load[dofs.index(excitation.dof)] += excitation.signal.force
    return load


def _torques(turning: Turning, found: Speeds) -> Iterator[Check]:
    load = load_of(turning)
    if not np.any(load):
        return
    for family in turning.families:
        held = _held_by(turning, family)
        if not held.shape[1]:
            continue
        columns = list(family.columns)
        vectors = np.array([turning.periodic.springs[c].vector for c in columns])
        mean = found.mesh[found.ok][:, 0, columns].real
        wanted = load @ held
        carried = mean @ (vectors @ held)
        scale = np.abs(mean).sum(axis=1).max() * np.abs(vectors @ held).max()
        yield _check(
            "mean mesh forces against statics",
            family.name,
            "largest difference, of the family’s mean forces",
            found.rpm[found.ok],
            np.abs(carried - wanted).max(axis=1) / scale,
        )


def _held_by(turning: Turning, family: MeshFamily) -> FloatArray:
    """Motions (n_dof, n) that strain nothing without the family, and are not free with it."""
    parts = turning.parts
    names = {turning.meshes[column] for column in family.columns}
    without = replace(parts, springs=tuple(s for s in parts.springs if s.name not in names))
    free, more = free_motions(parts), free_motions(without)
    more = more - free @ (free.T @ more)
    left, sizes, _ = np.linalg.svd(more, full_matrices=False)
    held: FloatArray = left[:, sizes > 1e-6]  # of orthonormal vectors: 0 or 1
    return held


def _planets(turning: Turning, found: Speeds) -> Iterator[Check]:
    by_name = {family.name: family for family in turning.families}
    for stage in turning.plan.drivetrain.stages:
        if not isinstance(stage, PlanetaryStage) or not np.any(turning.static_forces):
            continue
        sun, ring = (by_name[f"{stage.name} {which} meshes"] for which in ("sun", "ring"))
        mean = found.mesh[found.ok][:, 0].real
        apart = np.abs(mean[:, list(sun.columns)] - mean[:, list(ring.columns)]).max(axis=1)
        yield _check(
            "mean force of sun and ring on every planet",
            stage.name,
            "largest difference, of the largest mean force",
            found.rpm[found.ok],
            apart / np.abs(mean[:, list(sun.columns)]).max(),
        )


def _check(name: str, subject: str, measure: str, rpm: FloatArray, values: FloatArray) -> Check:
    worst = int(np.argmax(values))
    value = float(values[worst])
    findings = ()
    if not value <= MEAN_TOLERANCE:
        findings = (f"largest at {rpm[worst]:.5g} rpm",)
    return Check(name, subject, ROUTES, measure, value, MEAN_TOLERANCE, MEAN_REASON, findings)
