"""Reductions of M, C, K to fewer coordinates, solved, coupled and expanded like any system.

The motion is written u = T p, and the reduced matrices are TᵀMT, TᵀCT, TᵀKT (Ritz): natural
frequencies of the reduced system then lie above those of the whole, mode by mode. With masters m,
the others s, Φ and Θ the modes of the free and of the held part (interface b held):

=================  =====================================================================
`guyan`            u_s = −K_ss⁻¹ K_sm u_m (Guyan 1965, AIAA J. 3, 380)
`dynamic`          the same with Z = K − ω₀²M in place of K: exact at ω₀ (Leung 1978)
`irs`              Guyan's corrected for the inertia left out, once or iterated (O'Callahan
                   1989, IMAC 7; Friswell, Garvey & Penny 1995, J. Sound Vib. 186, 311)
`serep`            u = Φ Φ_m⁻¹ u_m: the kept modes exactly (O'Callahan et al. 1989, IMAC 7)
`craig_bampton`    u = Ψ u_b + Θ q, Ψ Guyan's to the interface (Craig & Bampton 1968, AIAA J. 6)
`rubin`            u = Φ q + G_b g, G the residual flexibility of the modes left out, g the
                   interface forces, eliminated for u_b (Rubin 1975, AIAA J. 13, 995)
`macneal`          Rubin's without the mass of G_b g (MacNeal 1971, Comput. Struct. 1, 581)
`dual_craig_bampton`  q, g and u_b kept: u_b = Φ_b q + (G_bb + ω² G_bᵀM G_b) g (Rixen 2004,
                   J. Comput. Appl. Math. 168, 383)
`projected`        u = V p, of any vectors V
=================  =====================================================================

At the interface the last three are what `truncate` writes down at once: with R_0 = G and
R_1 = G M G, dual Craig-Bampton is Σ φφᵀ/(ω_r² − ω²) + R_0 + ω² R_1, MacNeal the same without R_1,
and Rubin sums the series as R_0 (R_0 − ω² R_1)⁻¹ R_0. The last two have no Ritz bound.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ._kernels import checks
from ._kernels.checks import FloatArray, numbers, positions, read_only, unique_labels
from ._kernels.door import door
from .errors import FbsError
from .frf import Frf, Quantity
from .modal_truncation import truncate
from .second_order_system import SecondOrderSystem, direct_frf
from .undamped_modes import RealModes, real_modes

SINGULAR = 1e-12
"""Smallest over largest singular value of a scaled matrix that counts as having an inverse."""


@dataclass(frozen=True, eq=False)
class Reduction:
    """u = T p, and the system whose coordinates p are.

    Parameters
    ----------
    system : SecondOrderSystem
        The reduced one: interface or master DoFs under their own labels, then generalised
        coordinates ``q1``, ``q2``, … and interface forces ``g1``, ….
    basis : array, shape (n_dof, n_reduced)
        T, rows as `source`'s dofs.
    source : SecondOrderSystem
        What was reduced.
    """

    system: SecondOrderSystem
    basis: FloatArray
    source: SecondOrderSystem

    def __repr__(self) -> str:
        return f"<Reduction: {len(self.source.dofs)} DoFs to {len(self.system.dofs)}>"

    def frf(
        self,
        frequency: ArrayLike,
        responses: Iterable[str] | None = None,
        excitations: Iterable[str] | None = None,
        quantity: Quantity | str = Quantity.RECEPTANCE,
    ) -> Frf:
        """T H_p Tᵀ between labels of the whole system (default: all), as an FRF of the part.

        Raises
        ------
        SingularLineError, UnknownDofError
        """
        reduced = direct_frf(self.system, frequency, quantity=quantity)
        rows = self.source.labels if responses is None else tuple(responses)
        columns = self.source.labels if excitations is None else tuple(excitations)
        left, right = self._rows(rows), self._rows(columns)
        coordinates = reduced.select(self.system.dofs, self.system.dofs)
        values = np.einsum("ip,kpq,jq->ijk", left, coordinates.values, right, optimize=True)
        return Frf(reduced.frequency, values.transpose(2, 0, 1), rows, columns, reduced.quantity)

    def expanded(self, motion: ArrayLike) -> FloatArray:
        """T p: the motion of every DoF (n_dof, …) from that of the reduced coordinates."""
        whole: FloatArray = self.basis @ np.asarray(motion)
        return whole

    def _rows(self, labels: Sequence[str]) -> FloatArray:
        place, factor = self.source.locate(labels)
        rows: FloatArray = factor[:, None] * self.basis[place]
        return rows


# Masters and slaves


@door
def guyan(system: SecondOrderSystem, masters: Iterable[str]) -> Reduction:
    """Static condensation: u_s = −K_ss⁻¹ K_sm u_m; see the module for all methods.

    Parameters
    ----------
    system
        Symmetric; the masters must hold it, so that K_ss is not singular.
    masters
        Its DoFs that stay, in this order.

    Raises
    ------
    FbsError
        The other DoFs are free to move while the masters are held.
    UnknownDofError
    """
    return dynamic(system, masters, 0.0)


@door
def dynamic(system: SecondOrderSystem, masters: Iterable[str], frequency: float) -> Reduction:
    """Condense with Z = K − ω₀²M: exact at ω₀ = 2π `frequency` (Hz), Guyan's at 0 Hz.

    Raises
    ------
    FbsError
        The frequency is no finite number, or an eigenfrequency with the masters held.
    """
    frequency = checks.scalar(frequency, "the frequency", 0.0, checks.HIGHEST)
    split = _Split.of(system, masters)
    at = system.stiffness - (2.0 * np.pi * frequency) ** 2 * system.mass
    return split.reduction(-_solved(at[np.ix_(split.s, split.s)], at[np.ix_(split.s, split.m)]))


@door
def irs(system: SecondOrderSystem, masters: Iterable[str], iterations: int = 1) -> Reduction:
    """t ← t_G + K_ss⁻¹ (M_sm + M_ss t) M_R⁻¹ K_R, from Guyan's t_G.

    One iteration is O'Callahan's improved reduced system; many converge to SEREP of the lowest
    modes (Friswell, Garvey & Penny 1995).

    Raises
    ------
    FbsError
        As `guyan`, or no iteration is asked for.
    """
    if iterations < 1:
        raise FbsError(f"iterations = {iterations}: must be 1 or more; 0 would be guyan")
    split = _Split.of(system, masters)
    k_ss = system.stiffness[np.ix_(split.s, split.s)]
    m_sm, m_ss = system.mass[np.ix_(split.s, split.m)], system.mass[np.ix_(split.s, split.s)]
    static = -_solved(k_ss, system.stiffness[np.ix_(split.s, split.m)])
    follow = static
    for _ in range(iterations):
        reduced = split.reduction(follow).system
        correction = (m_sm + m_ss @ follow) @ _solved(reduced.mass, reduced.stiffness)
        follow = static + _solved(k_ss, correction)
    return split.reduction(follow)


@door
def serep(
    system: SecondOrderSystem, masters: Iterable[str], modes: RealModes | None = None
) -> Reduction:
    """u = Φ Φ_m⁻¹ u_m: as many of the lowest modes as there are masters, exactly.

    Parameters
    ----------
    modes
        Which modes, as many as masters (default: the lowest).

    Raises
    ------
    FbsError
        Another number of modes, or masters that do not tell them apart.
    """
    split = _Split.of(system, masters)
    count = len(split.m)
    shapes = (real_modes(system).truncated(slice(count)) if modes is None else modes).shapes
    if shapes.shape != (len(system.dofs), count):
        raise FbsError(
            f"{shapes.shape[1]} modes for {count} masters: as many are needed; with fewer the "
            "reduced matrices would be singular"
        )
    at_masters = shapes[split.m]
    if not _is_regular(at_masters / np.linalg.norm(at_masters, axis=0)):
        raise FbsError(
            f"the masters {', '.join(split.masters)} do not tell the modes apart: choose others"
        )
    return split.reduction(
        np.asarray(np.linalg.solve(at_masters.T, shapes[split.s].T).T, dtype=float)
    )


# Interface and modes


@door
def craig_bampton(system: SecondOrderSystem, interface: Iterable[str], count: int) -> Reduction:
    """u = Ψ u_b + Θ q: static shapes of the interface and `count` modes with it held.

    Raises
    ------
    FbsError
        As `guyan`, or there are not so many modes.
    """
    split = _Split.of(system, interface)
    mass, damping, stiffness = (m[np.ix_(split.s, split.s)] for m in _matrices(system))
    held = SecondOrderSystem(mass, damping, stiffness, tuple(system.dofs[k] for k in split.s))
    shapes = real_modes(held).truncated(slice(_count(count, len(split.s)))).shapes
    static = split.reduction(-_solved(held.stiffness, system.stiffness[np.ix_(split.s, split.m)]))
    modal = np.zeros((len(system.dofs), count))
    modal[split.s] = shapes
    basis = np.hstack([static.basis, modal])
    return _ritz(system, basis, (*split.masters, *_names("q", count)))


@door
def rubin(system: SecondOrderSystem, interface: Iterable[str], count: int) -> Reduction:
    """u = Φ q + G_b g, with g = G_bb⁻¹ (u_b − Φ_b q): modes of the free part and its interface.

    Parameters
    ----------
    count
        Modes kept, the lowest, the rigid-body modes among them.

    Raises
    ------
    FbsError
        Rigid-body modes are left out, or the modes left out do not move the interface in as many
        ways as it has DoFs.
    """
    free = _Free.of(system, interface, count)
    return _ritz(system, free.basis, free.labels)


@door
def macneal(system: SecondOrderSystem, interface: Iterable[str], count: int) -> Reduction:
    """Rubin's coordinates with the inertia and damping of the residual motion G_b g left out.

    Raises
    ------
    FbsError
        As `rubin`.
    """
    free = _Free.of(system, interface, count)
    into_modes = np.hstack([np.zeros((count, len(free.b))), np.eye(count)])
    modal = free.shapes @ into_modes
    mass, damping = (modal.T @ matrix @ modal for matrix in (system.mass, system.damping))
    stiffness = free.basis.T @ system.stiffness @ free.basis
    return _reduced(system, (mass, damping, stiffness), free.basis, free.labels)


@door
def dual_craig_bampton(
    system: SecondOrderSystem, interface: Iterable[str], count: int
) -> Reduction:
    """Modes, interface forces and interface motion: u_b = Φ_b q + (G_bb + ω² G_bᵀM G_b) g.

    The matrices are symmetric and indefinite; compatibility holds weakly, with the error of the
    residual's own series. Damping is that of the modes kept (and the loss factor).

    Raises
    ------
    FbsError
        As `rubin`.
    """
    free = _Free.of(system, interface, count)
    b = len(free.b)
    at_b = free.shapes[free.b]
    mass, damping, stiffness = (np.zeros((2 * b + count,) * 2) for _ in range(3))
    u, q, g = slice(b), slice(b, b + count), slice(b + count, None)
    mass[q, q] = np.eye(count)
    mass[g, g] = free.attachment.T @ system.mass @ free.attachment
    damping[q, q] = free.shapes.T @ system.damping @ free.shapes
    stiffness[q, q] = np.diag(free.squares)
    stiffness[g, g] = -free.flexibility
    stiffness[u, g] = stiffness[g, u] = np.eye(b)
    stiffness[q, g], stiffness[g, q] = -at_b.T, -at_b
    basis = np.hstack([np.zeros((len(system.dofs), b)), free.shapes, free.attachment])
    basis[free.b] = np.eye(b, 2 * b + count)
    labels = (*free.labels, *_names("g", b))
    return _reduced(system, (mass, damping, stiffness), basis, labels)


@door
def projected(system: SecondOrderSystem, vectors: ArrayLike) -> Reduction:
    """u = V p: a basis of one's own, such as Krylov's (`ReducedFrf.vectors`) or measured shapes.

    Parameters
    ----------
    vectors : array, shape (n_dof, n_reduced)
        Linearly independent.

    Raises
    ------
    FbsError
        Vectors of another shape, or dependent to working precision.
    """
    basis = numbers(vectors, "the vectors")
    rows = len(system.dofs)
    if basis.ndim != 2 or basis.shape[0] != rows or not np.isfinite(basis).all():
        raise FbsError(f"vectors of shape {basis.shape}: must be finite, with {rows} rows")
    length = np.linalg.norm(basis, axis=0)
    if not (basis.size and length.all() and _is_regular(basis / length)):
        raise FbsError("the vectors depend on one another: leave some out")
    return _ritz(system, basis, _names("q", basis.shape[1]))


# The pieces


@dataclass(frozen=True, eq=False)
class _Split:
    """Masters and the other DoFs of a symmetric system."""

    system: SecondOrderSystem
    masters: tuple[str, ...]
    m: list[int]
    s: list[int]

    @classmethod
    def of(cls, system: SecondOrderSystem, masters: Iterable[str]) -> _Split:
        labels = unique_labels(masters, "the DoFs that stay")
        if not labels:
            raise FbsError("no DoF stays: give at least one")
        m = positions(labels, system.dofs, "the system")
        return cls(system, labels, m, [k for k in range(len(system.dofs)) if k not in m])

    def reduction(self, follow: FloatArray) -> Reduction:
        """u_s = follow u_m."""
        basis = np.zeros((len(self.system.dofs), len(self.m)))
        basis[self.m] = np.eye(len(self.m))
        basis[self.s] = follow
        return _ritz(self.system, basis, self.masters)


@dataclass(frozen=True, eq=False)
class _Free:
    """Modes kept of a free part, and what the others add at its interface."""

    b: list[int]
    labels: tuple[str, ...]
    squares: FloatArray  # ω_r², (count,)
    shapes: FloatArray  # Φ, (n, count)
    attachment: FloatArray  # G_b, (n, b)
    flexibility: FloatArray  # G_bb, (b, b)

    @classmethod
    def of(cls, system: SecondOrderSystem, interface: Iterable[str], count: int) -> _Free:
        split = _Split.of(system, interface)
        modes = real_modes(system)
        count = _count(count, len(system.dofs))
        if count < modes.n_rigid:
            raise FbsError(
                f"count = {count}: the part has {modes.n_rigid} rigid-body modes, and all of them "
                "must be kept: they have no residual flexibility"
            )
        kept = modes.truncated(slice(count))
        attachment = truncate(system, slice(count), 0, modes).residuals[0][:, split.m]
        flexibility = attachment[split.m]
        size = np.sqrt(np.diag(flexibility))
        if not (size.all() and _is_regular(flexibility / np.outer(size, size))):
            raise FbsError(
                f"count = {count}: the modes left out move the interface {', '.join(split.masters)}"
                " in fewer ways than it has DoFs; keep fewer modes"
            )
        labels = (*split.masters, *_names("q", count))
        return cls(split.m, labels, kept.angular_frequency**2, kept.shapes, attachment, flexibility)

    @property
    def basis(self) -> FloatArray:
        """[G_b G_bb⁻¹, Φ − G_b G_bb⁻¹ Φ_b], the interface's rows as they must be."""
        along = np.linalg.solve(self.flexibility, self.attachment.T).T
        basis = np.hstack([along, self.shapes - along @ self.shapes[self.b]])
        basis[self.b] = np.eye(len(self.b), basis.shape[1])
        return basis


def _ritz(system: SecondOrderSystem, basis: FloatArray, labels: tuple[str, ...]) -> Reduction:
    matrices = tuple(basis.T @ matrix @ basis for matrix in _matrices(system))
    return _reduced(system, matrices, basis, labels)


def _reduced(
    system: SecondOrderSystem,
    matrices: Sequence[FloatArray],
    basis: FloatArray,
    labels: tuple[str, ...],
) -> Reduction:
    mass, damping, stiffness = ((matrix + matrix.T) / 2.0 for matrix in matrices)
    reduced = SecondOrderSystem(
        mass, damping, stiffness, labels, _derived(system, labels), system.loss_factor
    )
    return Reduction(reduced, read_only(basis), system)


def _derived(system: SecondOrderSystem, labels: Sequence[str]) -> dict[str, tuple[str, float]]:
    return {label: tie for label, tie in system.derived.items() if tie[0] in labels}


def _matrices(system: SecondOrderSystem) -> tuple[FloatArray, FloatArray, FloatArray]:
    for name in ("mass", "damping", "stiffness"):
        matrix = getattr(system, name)
        size = np.abs(matrix).max(initial=0.0)
        if np.abs(matrix - matrix.T).max(initial=0.0) > SINGULAR * size:
            raise FbsError(f"the {name} matrix is not symmetric: these reductions need it to be")
    return system.mass, system.damping, system.stiffness


def _count(count: int, most: int) -> int:
    if not 0 <= count <= most:
        raise FbsError(f"count = {count}: must be between 0 and {most}, the modes there are")
    return count


def _names(letter: str, count: int) -> tuple[str, ...]:
    return tuple(f"{letter}{number}" for number in range(1, count + 1))


def _solved(matrix: FloatArray, right: FloatArray) -> FloatArray:
    """matrix⁻¹ right, scaled to a unit diagonal: units do not decide what is singular.

    Raises
    ------
    FbsError
        No digit would be left.
    """
    size = np.sqrt(np.abs(np.diag(matrix)))
    scaled = matrix / np.outer(size, size) if size.all() else matrix
    if not (size.all() and _is_regular(scaled)):
        raise FbsError(
            "the DoFs that are condensed are free to move while the others are held, or resonate "
            "at this frequency: let more DoFs stay"
        )
    solved: FloatArray = np.linalg.solve(scaled, right / size[:, None]) / size[:, None]
    return solved


def _is_regular(scaled: FloatArray) -> bool:
    if not scaled.size:
        return True
    values = np.linalg.svd(scaled, compute_uv=False)
    return bool(values[-1] > SINGULAR * values[0])
