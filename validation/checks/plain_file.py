"""What a model file says by itself: masses, gear ratios and stiffnesses by hand, against exudyn.

The file is read by `tomllib`; no class of the model, no placement and no equations are used. What
is not plain – stages of other types, loops, planets that differ – is left out, never guessed.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fbs import SecondOrderSystem

from ..arrays import FloatArray
from .check import Check
from .plain_train import Train, plain_train

TOLERANCE = 1e-11
REASON = (
    "a few dozen products in double precision on either side, and sines of the same angles: 1e-14 "
    "each; static solutions as much more as their own round-off, n eps |u|ᵀ|K||u|"
)
FILE = "model file"
UNKNOWN = 1e-4  # relative: a static stiffness known to less would witness nothing


def plain_checks(text: str, system: SecondOrderSystem, route: str) -> list[Check]:
    """Total mass, inertia and freedom of the turning train, static stiffness.

    Parameters
    ----------
    text
        The model file's.
    system, route
        M, C, K of the whole, and whose they are.
    """
    train = plain_train(tomllib.loads(text))
    if train is None:
        return []
    checks = [_mass(train, system, route)]
    if train.turning:
        checks += [_inertia(train, system, route), _freedom(train, system, route)]
    for name, path in train.paths.items():
        checks += _stiffness(name, path, system, route)
    return checks


def _vector(values: Mapping[str, float], system: SecondOrderSystem) -> FloatArray:
    return np.array([values.get(dof, 0.0) for dof in system.dofs])


def _held_at(supports: Mapping[str, float], system: SecondOrderSystem) -> FloatArray:
    """Supports at the system's DoFs (N/m): k f² of a label that a rigid hub makes f times one."""
    held = np.zeros(len(system.dofs))
    index, factor = system.locate(tuple(supports))
    np.add.at(held, index, np.array(list(supports.values())) * factor**2)
    return held


def _compared(
    name: str, measure: str, route: str, expected: float, found: float, allowed: float = TOLERANCE
) -> Check:
    error = abs(found - expected) / abs(expected) if expected else abs(found)
    findings = () if error <= allowed else (f"{expected:.9g} by hand, {found:.9g} by {route}",)
    return Check(name, "whole drivetrain", (FILE, route), measure, error, allowed, REASON, findings)


def _mass(train: Train, system: SecondOrderSystem, route: str) -> Check:
    """uᵀMu of everything moved along the first transverse direction: Σ m."""
    u = _vector(train.sideways, system)
    return _compared(
        "Total mass", "relative difference", route, train.mass, float(u @ system.mass @ u)
    )


def _inertia(train: Train, system: SecondOrderSystem, route: str) -> Check:
    """wᵀMw of the train turned by its gear ratios: Σ I/r² w², and planets that go round."""
    w = _vector(train.turning, system)
    found = float(w @ system.mass @ w)
    name = "Inertia of the turning train"
    return _compared(name, "relative difference", route, train.inertia, found)


def _freedom(train: Train, system: SecondOrderSystem, route: str) -> Check:
    """K w = the torsional supports' forces: nothing else is strained by turning."""
    w, held = _vector(train.turning, system), _held_at(train.supported, system)
    forces = np.abs(system.stiffness @ w - held * w)
    scale = np.abs(system.stiffness) @ np.abs(w)
    error = forces / np.where(scale > 0.0, scale, 1.0)
    worst = int(np.argmax(error))
    findings = (
        f"turned by its ratios, {system.dofs[worst]} is pushed by {forces[worst]:.3g} N for 1 m "
        f"of w at {next(iter(train.turning))}"
    )
    return Check(
        "Turning strains nothing", "whole drivetrain", (FILE, route),
        "largest force / what it is made of", float(error[worst]), TOLERANCE,
        "w of all bodies by base radii alone; " + REASON,
        () if error[worst] <= TOLERANCE else (findings,),
    )  # fmt: skip


def _stiffness(
    name: str, path: tuple[str, str, float], system: SecondOrderSystem, route: str
) -> list[Check]:
    """1/c at one end with the other held: c = Σ F²/k, forces F from statics.

    c = fᵀK⁻¹f = fᵀu is known to n eps |u|ᵀ|K||u|, what a Cholesky or LU solution of n equations
    leaves of K (Higham 2002, ch. 10); none is given where that is more than `UNKNOWN` of c.
    """
    start, end, compliance = path
    (at, hold), (factor, _) = system.locate([start, end])
    free = np.delete(np.arange(len(system.dofs)), hold)
    force = np.zeros(len(system.dofs))
    force[at] = factor
    stiffness = system.stiffness[np.ix_(free, free)]
    root = np.sqrt(np.abs(np.diag(stiffness)))
    if not root.all():
        return []
    try:
        moved = np.linalg.solve(stiffness / np.outer(root, root), force[free] / root) / root
    except np.linalg.LinAlgError:
        return []
    found = float(force[free] @ moved)
    round_off = len(free) * np.finfo(float).eps * np.abs(moved) @ np.abs(stiffness) @ np.abs(moved)
    allowed = max(TOLERANCE, float(round_off) / abs(found)) if found else math.inf
    if not allowed < UNKNOWN:
        return []
    subject, measure = f"{start}, {end} held", "relative difference"
    check = _compared(name, measure, route, 1.0 / compliance, 1.0 / found, allowed)
    return [replace(check, subject=subject)]
