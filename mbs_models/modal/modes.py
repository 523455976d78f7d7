"""Natural frequencies, damping and mode shapes: exudyn's own eigensolution."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..contact.mesh_excitation import at_mean
from ..model.parameters import Drivetrain
from ..system.components import GROUND, Components
from ..system.displaced import Displaced, placed
from ..system.drivetrain import MultibodySystem, build_drivetrain
from ..system.linearization import LinearizedSystem, coordinate_transform, linearize
from ..system.read_back import components
from .mode_kinds import (
    Mode,
    Modes,
    StageStiffness,
    classify,
    frequency_and_ratio,
    match_poles,
    rigid_body_count,
    undamped_estimate,
)


def drivetrain_modes(drivetrain: Drivetrain, point: Displaced | None = None) -> Modes:
    """Modes of the whole drivetrain from exudyn's eigensolution, at rest or under a torque.

    det(K − ω²M) = 0, and with damping det(K + sC + s²M) = 0; each mode is given the latter's
    poles that lie nearest to its own −γ/2 ± √(γ²/4 − ω²), γ = φᵀCφ.

    Parameters
    ----------
    drivetrain
        Its parameters.
    point
        Where the torque has moved it, every mesh at its mean. None: as built.
    """
    if point is None:
        system = build_drivetrain(drivetrain)
        return system_modes(drivetrain, system, linearize(system), components(system))
    system = build_drivetrain(drivetrain, at_mean(point.laws))
    alone = components(system)
    with placed(system, point.displacement):
        return system_modes(drivetrain, system, linearize(system), alone)


def system_modes(
    drivetrain: Drivetrain, system: MultibodySystem, linear: LinearizedSystem, parts: Components
) -> Modes:
    """Modes of a built system where it stands.

    Parameters
    ----------
    drivetrain
        Its parameters.
    system, linear
        The system, and the same linearised where it stands.
    parts
        Its springs, which tell where a mode's strain energy is.
    """
    eigenvalues, shapes = _undamped(system)
    n_rigid = rigid_body_count(linear.stiffness)
    poles = _poles(system, linear, eigenvalues, shapes, n_rigid)
    round_off = len(eigenvalues) * np.finfo(float).eps * abs(eigenvalues[-1])
    frequencies, ratios = frequency_and_ratio(poles, n_rigid)

    labelled = _with_derived(linear, shapes)
    kinds, labelled = classify(
        drivetrain, linear.labels, frequencies, labelled, n_rigid, part_stiffness(drivetrain, parts)
    )
    modes = tuple(
        Mode(float(f), float(z), kind, shares, _frequency_error(f, round_off))
        for f, z, (kind, shares) in zip(frequencies, ratios, kinds, strict=True)
    )
    return Modes(modes, linear.labels, labelled)


def part_stiffness(drivetrain: Drivetrain, parts: Components) -> dict[str, StageStiffness]:
    """Σ Gᵀ k G over the springs within each part or from it to the ground."""
    size = len(parts.dofs)
    stiffness = {part.name: np.zeros((size, size)) for part in drivetrain.parts}
    joined = [{coupling.first, coupling.second} for coupling in drivetrain.couplings]
    for spring in parts.springs:
        if {end.body for end in spring.ends} in joined:
            continue
        owners = {end.body.partition(".")[0] for end in spring.ends if end.body != GROUND}
        if len(owners) == 1 and (owner := owners.pop()) in stiffness:  # else a coupling's
            stiffness[owner] += spring.deflection.T @ spring.stiffness @ spring.deflection
    return {name: StageStiffness(parts.dofs, matrix) for name, matrix in stiffness.items()}


def _undamped(system: MultibodySystem) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Eigenvalues ω² (ascending) and shapes in labelled DoFs."""
    eigenvalues, vectors = system.mbs.ComputeODE2Eigenvalues(useAbsoluteValues=False)
    transform = coordinate_transform(system)
    # The columns of T do not overlap: each DoF is read off the coordinates it moves.
    shapes = (transform.T @ vectors) / np.sum(transform**2, axis=0)[:, None]
    return np.asarray(eigenvalues), shapes


def _poles(
    system: MultibodySystem,
    linear: LinearizedSystem,
    eigenvalues: NDArray[np.float64],
    shapes: NDArray[np.float64],
    n_rigid: int,
) -> NDArray[np.complex128]:
    """The two poles of each mode (n_mode, 2), from exudyn's complex eigensolution if damped."""
    modal_mass = np.einsum("im,ij,jm->m", shapes, linear.mass, shapes)
    modal_damping = np.einsum("im,ij,jm->m", shapes, linear.damping, shapes) / modal_mass
    expected = undamped_estimate(eigenvalues, modal_damping)
    if not np.any(linear.damping):
        return expected
    found, _ = system.mbs.ComputeODE2Eigenvalues(
        computeComplexEigenvalues=True, useAbsoluteValues=False
    )
    found = np.asarray(found).astype(complex)
    return np.concatenate([expected[:n_rigid], match_poles(found, expected[n_rigid:])])


def eigenvalue_error(modes: Modes) -> float:
    """δλ of the undamped eigensolution ((rad/s)²): n·eps·λ_max, the same for every mode.

    `Mode.round_off_hz` is what it makes of a frequency; this takes it back.
    """
    mode = modes.modes[0]
    f, error = mode.frequency_hz, mode.round_off_hz
    squares = error**2 if error >= f else error * (2.0 * f - error)
    return float(4.0 * np.pi**2 * squares)


def _frequency_error(frequency: float, round_off: float) -> float:
    """δf = f − √(f² − δλ/4π²) of an eigenvalue error δλ, or √δλ/2π where λ may be zero."""
    squares = round_off / (4.0 * np.pi**2)
    if frequency**2 <= squares:
        return float(np.sqrt(squares))
    return float(squares / (frequency + np.sqrt(frequency**2 - squares)))


def _with_derived(linear: LinearizedSystem, shapes: NDArray[np.float64]) -> NDArray[np.float64]:
    rows = [shapes]
    for dof, factor in linear.derived.values():
        rows.append(factor * shapes[[linear.dofs.index(dof)]])
    return np.concatenate(rows)
