"""Kinetic and strain energy of every component in every mode.

    T_b = ½ φᵀ S_bᵀ M_b S_b φ,    U_s = ½ φᵀ G_sᵀ k_s G_s φ

with a body's own mass matrix M_b and coordinates S_b φ, a spring's stiffness k_s and deflection
G_s φ, all read back from the exudyn system. A mode is excited most by a force on, and changed most
by a change of, the component that holds most of its energy.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..system.components import Components, SpringKind
from .mode_kinds import Kind, Modes

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class ComponentShares:
    """Shares of each mode's energy.

    Attributes
    ----------
    bodies, kinetic
        Names, and (n_body, n_mode) shares of the kinetic energy; each mode's sum to one.
    springs, kinds, strain
        Names, what each is there for, and (n_spring, n_mode) shares of the strain energy; each
        mode's sum to one (rigid-body modes: zero).
    """

    bodies: tuple[str, ...]
    kinetic: FloatArray
    springs: tuple[str, ...]
    kinds: tuple[SpringKind, ...]
    strain: FloatArray

    def most(self, energy: str, mode: int, count: int = 3) -> tuple[tuple[str, float], ...]:
        """The components that hold most of a mode's ``kinetic`` or ``strain`` energy."""
        names = self.bodies if energy == "kinetic" else self.springs
        shares = (self.kinetic if energy == "kinetic" else self.strain)[:, mode]
        first = np.argsort(-np.round(shares, 6), kind="stable")[:count]  # equal ones in order
        return tuple((names[i], float(shares[i])) for i in first if shares[i] >= 0.005)


def component_shares(parts: Components, modes: Modes) -> ComponentShares:
    """Energy shares of every body and spring in every mode."""
    shapes = modes.shapes[[modes.labels.index(dof) for dof in parts.dofs]]
    strain = strain_energies(parts, shapes)
    strain[:, [mode.kind == Kind.RIGID_BODY for mode in modes.modes]] = 0.0
    return ComponentShares(
        bodies=tuple(parts.masses),
        kinetic=_normalised(kinetic_energies(parts, shapes)),
        springs=tuple(spring.name for spring in parts.springs),
        kinds=tuple(spring.kind for spring in parts.springs),
        strain=_normalised(strain),
    )


def kinetic_energies(parts: Components, shapes: FloatArray) -> FloatArray:
    """½ φᵀ S_bᵀ M_b S_b φ of every body: the kinetic energy over ω² (n_body, n_mode)."""
    rows = []
    for body, mass in parts.masses.items():
        motion = parts.motions[body] @ shapes
        rows.append(0.5 * np.einsum("im,ij,jm->m", motion, mass, motion))
    return np.array(rows)


def strain_energies(parts: Components, shapes: FloatArray) -> FloatArray:
    """½ φᵀ G_sᵀ k_s G_s φ of every spring (n_spring, n_mode)."""
    if not parts.springs:
        return np.zeros((0, shapes.shape[1]))
    return np.array([spring.energy(shapes) for spring in parts.springs])


def _normalised(energies: FloatArray) -> FloatArray:
    total = energies.sum(axis=0)
    shares: FloatArray = np.divide(energies, total, out=np.zeros_like(energies), where=total > 0.0)
    return shares
