"""Receptances of a constant system between its springs, as sums over all of its modes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._kernels.checks import ComplexArray, FloatArray
from .._kernels.elimination import EPS
from ..damped_modes import complex_modes, is_proportional, modal_damping
from ..errors import FbsError, undamped_pole
from ..second_order_system import SecondOrderSystem
from ..undamped_modes import RealModes, real_modes
from .periodic_springs import PeriodicSpring

STRAINED = 1e-6
"""Of |v| |phi| entry by entry: rigid-body shapes are exact to some n eps."""

NO_DIGIT = 4 * EPS
"""Of w_r^2: w_r^2 - w^2 + jw gamma below this is round-off."""


@dataclass(frozen=True, eq=False)
class SpringModes:
    """H V = Σ_k (a_k + b_k/jω) d_k(ω) (Vᵀp_k)ᵀ, and Y = Vᵀ H V, for springs V.

    Parameters
    ----------
    squares : array, shape (n_mode,), or None
        ω_r² where modes decouple: d = 1/(ω_r² − ω² + jωγ_r). None: d = 1/(jω − s_k).
    rates : array, shape (n_mode,)
        γ_r, or s_k.
    shapes, rigid_shapes : array, shape (n_dof, n_mode)
        a and b.
    response, excitation : array, shape (n_spring, n_mode)
        Vᵀa and Vᵀp.
    """

    squares: FloatArray | None
    rates: NDArray[Any]
    shapes: NDArray[Any]
    rigid_shapes: NDArray[Any]
    response: NDArray[Any]
    excitation: NDArray[Any]

    def factors(self, frequency: FloatArray) -> ComplexArray:
        """d_k (..., n_mode) at frequencies (Hz).

        Raises
        ------
        SingularLineError
        """
        s = 2j * np.pi * frequency[..., None]
        if self.squares is None:
            divisor = s - self.rates
            scale = np.abs(self.rates)
        else:
            divisor = self.squares + s**2 + s * self.rates
            scale = self.squares
        lost = np.abs(divisor) <= NO_DIGIT * scale
        if lost.any():
            raise undamped_pole(np.unique(frequency[lost.any(axis=-1)]))
        return np.asarray(1.0 / divisor)

    def receptances(self, factors: ComplexArray) -> ComplexArray:
        """Y (..., n_spring, n_spring) from d_k."""
        n = len(self.response)
        pairs = (self.response[:, None] * self.excitation).reshape(n * n, -1).T
        flat = factors.reshape(-1, factors.shape[-1])
        if np.iscomplexobj(pairs):
            values = flat @ pairs
        else:  # two real products take half as long
            values = flat.real @ pairs + 1j * (flat.imag @ pairs)
        return np.asarray(values.reshape(*factors.shape[:-1], n, n))


def spring_modes(system: SecondOrderSystem, springs: Sequence[PeriodicSpring]) -> SpringModes:
    """All modes of the constant system that strain something, as the springs see them.

    Raises
    ------
    FbsError
        A vector does not fit, a rigid-body motion strains a spring, or there is a loss factor.
    IndefiniteMassError, IndefiniteStiffnessError, DefectiveModesError
    """
    vectors = spring_vectors(system, springs)
    modes = real_modes(system)
    refuse_strained_rigid_motions(modes, vectors, springs)
    gamma = modal_damping(modes, system.damping)
    rigid = modes.n_rigid
    if is_proportional(gamma):
        shapes = modes.shapes[:, rigid:]
        along = vectors @ shapes
        squares = modes.angular_frequency[rigid:] ** 2
        rates = np.diag(gamma)[rigid:]
        return SpringModes(squares, rates, shapes, np.zeros_like(shapes), along, along)
    found = complex_modes(system, modes)
    kept = np.any(found.elastic_shapes != 0.0, axis=0)  # others are drift, which strains nothing
    elastic = found.elastic_shapes[:, kept]
    return SpringModes(
        None,
        found.poles[kept],
        elastic,
        found.rigid_shapes[:, kept],
        vectors @ elastic,
        vectors @ found.participation[:, kept],
    )


def spring_vectors(system: SecondOrderSystem, springs: Sequence[PeriodicSpring]) -> FloatArray:
    """Vᵀ (n_spring, n_dof).

    Raises
    ------
    FbsError
        There is no spring, a vector does not fit, or the system has a loss factor.
    """
    if not springs:
        raise FbsError("no springs were given")
    if system.loss_factor:
        raise FbsError(
            f"loss factor {system.loss_factor:g}: structural damping has no equation of motion in "
            "time; give viscous damping"
        )
    for spring in springs:
        if spring.vector.shape != (len(system.dofs),):
            raise FbsError(
                f"spring {spring.name!r}: vector has {spring.vector.size} entries, the system "
                f"{len(system.dofs)} DoFs"
            )
    return np.array([spring.vector for spring in springs])


def refuse_strained_rigid_motions(
    modes: RealModes, vectors: FloatArray, springs: Sequence[PeriodicSpring]
) -> None:
    """Refuse springs that K does not hold: what K leaves free must not strain them.

    Raises
    ------
    FbsError
    """
    shapes = modes.shapes[:, : modes.n_rigid]
    strained = np.abs(vectors @ shapes) > STRAINED * (np.abs(vectors) @ np.abs(shapes))
    if strained.any():
        name = springs[int(np.argmax(strained.any(axis=1)))].name
        raise FbsError(
            f"spring {name!r} is strained by a motion that K leaves free: the system's matrices "
            "must hold its constant part k v v^T"
        )
