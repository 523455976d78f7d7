"""The reductions compared, each to a given number of coordinates."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from scipy.linalg import qr

from fbs import FbsError, Frf, RealModes, SecondOrderSystem, galerkin_bound, real_modes
from fbs.large.krylov import reduced_frf
from fbs.large.sparse_system import SparseSystem
from fbs.reduction import (
    Reduction,
    craig_bampton,
    dual_craig_bampton,
    dynamic,
    guyan,
    irs,
    macneal,
    projected,
    rubin,
    serep,
)

from ..arrays import FloatArray

KRYLOV_TOLERANCE = 1e-8


@dataclass(frozen=True, eq=False)
class Reductions:
    """A stage's reductions.

    Attributes
    ----------
    system
        Of the stage.
    ports
        Labels between which FRFs are compared.
    frequency
        (n_frequency,) Hz.
    """

    system: SecondOrderSystem
    ports: tuple[str, ...]
    frequency: FloatArray

    @cached_property
    def interface(self) -> tuple[str, ...]:
        """DoFs behind the ports."""
        places, _ = self.system.locate(self.ports)
        return tuple(dict.fromkeys(self.system.dofs[k] for k in places))

    @cached_property
    def modes(self) -> RealModes:
        """Of the free stage."""
        return real_modes(self.system)

    @cached_property
    def masters(self) -> tuple[str, ...]:
        """The interface, then the DoFs with the least K_ii/M_ii (Henshell & Ong 1975)."""
        ratio = np.diag(self.system.stiffness) / np.diag(self.system.mass)
        order = [self.system.dofs[k] for k in np.argsort(ratio, kind="stable")]
        return (*self.interface, *(dof for dof in order if dof not in self.interface))

    @cached_property
    def krylov_vectors(self) -> FloatArray:
        """(n, r) in the order they were found, each of unit energy."""
        found = reduced_frf(
            SparseSystem.of(self.system), self.frequency, self.ports, self.ports,
            tolerance=KRYLOV_TOLERANCE,
        )  # fmt: skip
        squares = np.einsum("ij,ij->j", found.vectors, self._energy @ found.vectors)
        return np.asarray(found.vectors / np.sqrt(squares))

    @property
    def _energy(self) -> FloatArray:
        """K + s M, s of the band's middle."""
        middle = (2.0 * np.pi * self.frequency.mean()) ** 2
        return np.asarray(self.system.stiffness + middle * self.system.mass)

    @property
    def names(self) -> tuple[str, ...]:
        """Of all methods."""
        return tuple(self._reducers)

    @property
    def _reducers(self) -> Mapping[str, Callable[[int], Reduction]]:
        b = len(self.interface)
        middle = float(self.frequency[0] + self.frequency[-1]) / 2.0
        return {
            "Guyan": lambda r: guyan(self.system, self.masters[:r]),
            "dynamic": lambda r: dynamic(self.system, self.masters[:r], middle),
            "IRS": lambda r: irs(self.system, self.masters[:r]),
            "SEREP": self._serep,
            "Craig–Bampton": partial(_with_modes, craig_bampton, self.system, self.interface, b),
            "Rubin": partial(_with_modes, rubin, self.system, self.interface, b),
            "MacNeal": partial(_with_modes, macneal, self.system, self.interface, b),
            "dual Craig–Bampton": partial(
                _with_modes, dual_craig_bampton, self.system, self.interface, 2 * b
            ),
            "Krylov": self._krylov,
        }

    def reduction(self, name: str, size: int) -> Reduction:
        """A method's.

        Raises
        ------
        FbsError
            The method has none of this size.
        """
        return self._reducers[name](size)

    def bounded(self, name: str, size: int) -> tuple[Frf, FloatArray]:
        """A method's FRFs between the ports, and a bound of their error.

        The bound is that of the method's vectors (`fbs.galerkin_bound`), and the difference where
        its matrices are not their projection; of the dual method, Rubin's vectors.

        Raises
        ------
        FbsError
            The method has none of this size.
        """
        reduction = self.reduction(name, size)
        frf = reduction.frf(self.frequency, self.ports, self.ports)
        basis = reduction.basis
        if name == "dual Craig–Bampton":
            basis = self._reducers["Rubin"](size - len(self.interface)).basis
        bound = galerkin_bound(self.system, basis, self.frequency, self.ports, self.ports)
        return frf, bound.of(frf)

    def _krylov(self, size: int) -> Reduction:
        vectors = self.krylov_vectors
        if size > vectors.shape[1]:
            raise FbsError(f"{vectors.shape[1]} vectors meet {KRYLOV_TOLERANCE:g} at every line")
        return projected(self.system, vectors[:, :size])

    def _serep(self, size: int) -> Reduction:
        """Masters at which the modes differ most: QR with pivots of their transpose."""
        shapes = self.modes.truncated(slice(size)).shapes
        _, _, order = qr(shapes.T, mode="economic", pivoting=True)
        return serep(self.system, [self.system.dofs[k] for k in order[:size]], self.modes)


def _with_modes(
    method: Callable[[SecondOrderSystem, Sequence[str], int], Reduction],
    system: SecondOrderSystem,
    interface: Sequence[str],
    others: int,
    size: int,
) -> Reduction:
    return method(system, interface, size - others)
