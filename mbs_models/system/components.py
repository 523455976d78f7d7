"""The bodies and springs of an exudyn system, read back from it.

What is listed here is not what the parameters ask for but what exudyn was given: which body each
spring holds, where, along what, and how stiffly. Pictures and energies of single components come
from it, so that a wrong model shows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..stages.given_springs import SpringKind as SpringKind

Array = NDArray[np.float64]
GROUND = "ground"


@dataclass(frozen=True)
class End:
    """Where a spring takes hold: a body (or ground), and the point in global coordinates (m)."""

    body: str
    point: Array


@dataclass(frozen=True)
class Spring:
    """A spring as exudyn has it.

    Attributes
    ----------
    name, kind
        What to call it, and what it is there for.
    ends
        What it holds, and where.
    axes
        (3, m) global directions of its m deflections: along them, or (rotations) about them.
    stiffness
        (m, m) in N/m, rotations in N m/rad.
    deflection
        (m, n_dof) deflections per unit of the system's DoFs.
    damping
        (m, m) in N s/m, rotations in N m s/rad.
    """

    name: str
    kind: SpringKind
    ends: tuple[End, End]
    axes: Array
    stiffness: Array
    deflection: Array
    damping: Array

    def energy(self, shapes: Array) -> Array:
        """½ δᵀ k δ with δ = G q, for shapes q (n_dof, n_mode)."""
        stretch = self.deflection @ shapes
        energy: Array = 0.5 * np.einsum("im,ij,jm->m", stretch.conj(), self.stiffness, stretch).real
        return energy


@dataclass(frozen=True)
class Components:
    """The springs of a system, and the inertia of each body.

    Attributes
    ----------
    dofs
        Labels of the DoFs.
    springs
        Every spring that has a stiffness.
    motions
        Body → (n_coordinate, n_dof), exudyn's coordinates of the body per unit of the DoFs.
    masses
        Body → (n_coordinate, n_coordinate), exudyn's mass matrix of the body alone.
    """

    dofs: tuple[str, ...]
    springs: tuple[Spring, ...]
    motions: dict[str, Array]
    masses: dict[str, Array]
