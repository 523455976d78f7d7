r"""The coupled FRFs of truncated parts, and how far they can be from those of the whole parts.

Each truncated part lacks known(f, f') + a(f)^T V a(f') with || V || <= rho (`truncation_bound`).
First, what is known is added: Y' = Y~ + known, as good as some residuals more, at the ports alone
and coupled as Y~ is. Stacked over the parts, Y = Y' + a^T V a, V and rho block by block. With B the
signed joints (`couple`), A = a B^T, G' = (B Y' B^T + 1/Z)^-1 and p_j = e_j - B^T G' B Y' e_j the
forces on the parts, joints' included, under a unit force at j,

    (B Y B^T + 1/Z)^-1 = G' - G' A^T V (1 + Q V)^-1 A G',   Q = A G' A^T,
    Y_c - Y'_c = (a p_i)^T V (1 + Q V)^-1 (a p_j),

by Woodbury's formula (Hager 1989, Updating the inverse of a matrix, SIAM Review 31, 221-239):
exact, whatever is missing, from Y_c = Y - Y B^T (...)^-1 B Y written out; the left p_i is that of
the transpose. In the scale of rho, V = rho^(1/2) V' rho^(1/2) with || V' || <= 1,

    Y_c - Y'_c = u_i^T V' (1 + K V')^-1 u_j,   u_j = rho^(1/2) a p_j,   K = rho^(1/2) Q rho^(1/2).

If k = ||K|| < 1, 1 + K V' has an inverse of norm 1 / (1 - k) at most (Neumann's series; Golub &
Van Loan 2013, Matrix Computations, lemma 2.3.3), and so there is one of the kernel of the whole
parts, det(1 + X Y) being det(1 + Y X): whatever V is, the assembly has no pole there. Then (Cauchy
& Schwarz)

    |Y_c - Y'_c| <= sum_q ||u_iq|| ||u_jq|| + ||u_i|| ||u_j|| k / (1 - k),

V' (1 + K V')^-1 being V' less V' K V' (1 + K V')^-1 and V' block-diagonal over the parts q: what
one part lacks is felt by two DoFs through that part. Any other FRF, such as Y~_c, is at most
|Y~_c - Y'_c| further away.

k is taken as Frobenius' norm, which is never below the spectral one: k^2 = tr(G'^H S G' S*) with
S = A^H rho A, one row a joint. Nothing here depends on the units of a DoF or on how joints are
scaled. p_j is nearly 0 where the part's motion is set by the others, so that the bound is not the
sum of all parts' worst cases.

Round-off is a share of its own. A part's receptances are right to s_i s_j (`truncation_bound`; a
given FRF to eps of its entries); to invert the kernel and to round 1/Z changes it by
m eps sqrt(d_k d_l) at most between the joints of a part, d_k the moduli added up on its diagonal
(Gauss, in the joints' scale), m the number of joints. As above, with lambda_j = G' B Y' e_j the
joint forces and g_kq = s_k |B_kq| + (m eps d_k)^(1/2) at a part's joints,

    |Y'_c computed - Y'_c| <= sum_q r_iq r_jq + (sum_q r_iq) (sum_q r_jq) l / (1 - l),

r_jq = s_j + sum_k |lambda_kj| g_kq (s_j of j's own part alone) and l = sum_kl g_k |G'_kl| g_l, g_k
of both parts; where l is 1, nothing is left of the line's digits. It is taken twice: the numbers of
the bound are rounded, too.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._assembly import Layout, assemble
from ._kernels.blas_threads import one_blas_thread
from ._kernels.checks import (
    ComplexArray,
    FloatArray,
    ascending_frequency,
    positions,
    read_only,
    unique_labels,
)
from ._kernels.elimination import EPS
from .bounded_assembly import Assembly, Coupled, Part, TruncatedPart, product
from .frf import Frf, Quantity, computed_frf, require_same_layout
from .joints import AnyJoint
from .truncation_bound import Missing

__all__ = ["BoundedFrf", "Part", "Reason", "TruncatedPart", "bounded_frf", "decibels"]


Sides = dict[str, tuple[FloatArray, FloatArray]]
"""Of each part: of the responses and of the excitations, shape (n, nf)."""


class Reason(IntEnum):
    """Whether there is a bound at a line, and why not."""

    BOUNDED = 0
    PART = 1
    """A left-out mode may lie at the line or below it, or damping leaves no guarantee."""
    JOINTS = 2
    """k is not below 1: left-out modes may shift a resonance of the assembly to the line."""
    ROUND_OFF = 3
    """l is not below 1: the parts' round-off leaves no digit."""


@dataclass(frozen=True, eq=False)
class BoundedFrf:
    """What `bounded_frf` returns; the exact FRF is within `bound` of `frf`, line by line.

    Parameters
    ----------
    frf : Frf
        Of the truncated parts, coupled.
    reason : array of Reason, shape (nf,)
        Why there is no bound at a line.
    kernel, loss : array, shape (nf,)
        k and l, which must be below 1.
    """

    frf: Frf
    reason: NDArray[np.int8]
    kernel: FloatArray
    loss: FloatArray
    _assembly: Assembly
    _truncated: Coupled
    _better: Coupled
    _norms: Sides
    _sizes: Sides

    def change(self, response: str, excitation: str) -> ComplexArray:
        """Return Y'_c - Y~_c, what is known of the error; shape (nf,), m/N."""
        return self._change(*self._at(response, excitation))

    def truncation(self, response: str, excitation: str) -> FloatArray:
        """Bound the error of an FRF of `frf`, but for round-off; shape (nf,), m/N."""
        return self._truncation(*self._at(response, excitation))

    def round_off(self, response: str, excitation: str) -> FloatArray:
        """Bound what round-off makes of it; shape (nf,), m/N."""
        return self._round_off(*self._at(response, excitation))

    def between(self, response: str, excitation: str) -> FloatArray:
        """Bound the whole error of an FRF of `frf`; infinite where there is no bound."""
        i, j = self._at(response, excitation)
        return np.asarray(self._truncation(i, j) + self._round_off(i, j))

    @cached_property
    def bound(self) -> FloatArray:
        """The bounds of all FRFs, shape (nf, n_response, n_excitation), m/N."""
        n_rows, n_columns = len(self.frf.responses), len(self.frf.excitations)
        bounds = np.empty((n_rows, n_columns, self.kernel.size))
        for i in range(n_rows):
            for j in range(n_columns):
                bounds[i, j] = self._truncation(i, j) + self._round_off(i, j)
        return read_only(bounds.transpose(2, 0, 1))

    def of(self, frf: Frf) -> FloatArray:
        """Bound the error of any other FRF of the same lines and labels, as `couple_chain`'s."""
        require_same_layout(self.frf, frf)
        return np.asarray(self.bound + np.abs(frf.values - self.frf.values))

    def decibels(self, response: str, excitation: str) -> FloatArray:
        """Return the largest |20 log10 |exact / frf|| that the bound b allows, shape (nf,).

        |exact| is |frf| - b at least and |frf| + b at most, and the lower side is further away in
        decibels: -20 log10(1 - b / |frf|), infinite where b >= |frf|, an antiresonance deeper
        than the bound.
        """
        modulus = np.abs(self.frf.between(response, excitation))
        return decibels(self.between(response, excitation), modulus)

    def _at(self, response: str, excitation: str) -> tuple[int, int]:
        i = positions([response], self.frf.responses, "the FRF's responses")[0]
        return i, positions([excitation], self.frf.excitations, "the FRF's excitations")[0]

    def _change(self, i: int, j: int) -> ComplexArray:
        change = self._truncated.passed(i, j) - self._better.passed(i, j)
        place = self._assembly.place(i, j)
        if place is not None:
            name, row, column = place
            missing = self._assembly.parts[name].missing
            if missing is not None:
                change += missing.known([row], [column])[0, 0]
        return change

    def _truncation(self, i: int, j: int) -> FloatArray:
        direct = _sum_of_products(self._norms, i, j)
        left = sum((own[0][i] ** 2 for own in self._norms.values()), np.zeros(1))
        right = sum((own[1][j] ** 2 for own in self._norms.values()), np.zeros(1))
        with np.errstate(divide="ignore", invalid="ignore"):
            through = np.sqrt(left * right) * self.kernel / (1 - self.kernel)
        radius = np.where(self.reason > 0, np.inf, direct + through)
        return np.asarray(np.abs(self._change(i, j)) + radius)

    def _round_off(self, i: int, j: int) -> FloatArray:
        direct = _sum_of_products(self._sizes, i, j)
        left = sum((own[0][i] for own in self._sizes.values()), np.zeros(1))
        right = sum((own[1][j] for own in self._sizes.values()), np.zeros(1))
        with np.errstate(divide="ignore", invalid="ignore"):
            share = 2 * (direct + left * right * self.loss / (1 - self.loss))
        return np.where(self.loss < 1, share, np.inf)


def decibels(bound: FloatArray, modulus: FloatArray) -> FloatArray:
    """Return -20 log10(1 - b / h); infinite where b >= h, 0 where both vanish."""
    share = np.divide(bound, modulus, out=np.full_like(bound, np.inf), where=modulus > 0)
    share[(bound == 0) & (modulus == 0)] = 0.0
    with np.errstate(divide="ignore"):
        return np.asarray(-20 * np.log10(1 - share.clip(max=1.0)))


def bounded_frf(
    parts: Mapping[str, Part],
    joints: Sequence[AnyJoint],
    frequency: ArrayLike,
    responses: Iterable[str],
    excitations: Iterable[str],
) -> BoundedFrf:
    """Couple parts of which modes are left out, and bound how far the whole parts' FRFs can be.

    Parameters
    ----------
    parts : mapping of str to TruncatedPart, SecondOrderSystem or Frf
        Systems are complete; FRFs are receptances on the same lines, and taken as they are.
    joints : sequence of Joint
        As for `couple`, of one DoF each; none: a part's own FRFs.
    frequency : array, shape (nf,), Hz
    responses, excitations : labels
        Of any parts; a label that several of them have is the first one's.

    Returns
    -------
    BoundedFrf
        Bounds are made for the FRFs asked of it.

    Raises
    ------
    SingularLineError
        A line on an undamped pole of a truncated part, or of the assembly of them.
    UnknownDofError, AmbiguousDofError, JointError, AxisMismatchError, QuantityMismatchError
    """
    axis = ascending_frequency(frequency)
    rows = unique_labels(responses, "the responses")
    columns = unique_labels(excitations, "the excitations")
    with one_blas_thread():
        assembly = Assembly.of(parts, joints, axis, rows, columns)
        truncated, better = (Coupled.of(assembly, better) for better in (False, True))
        kernel = _kernel_norm(assembly, better)
        sizes, loss = _round_off(assembly, better)
        reason = np.zeros(axis.size, np.int8)
        reason[~(kernel < 1)] = Reason.JOINTS
        reason[~(loss < 1)] = Reason.ROUND_OFF
        for part in assembly.parts.values():
            if part.missing is not None:
                reason[~np.isfinite(part.missing.radius)] = Reason.PART
        norms = _norms(assembly, better)
        frf = _coupled_frf(assembly, truncated)
    return BoundedFrf(
        frf, read_only(reason), read_only(kernel), read_only(loss),
        assembly, truncated, better, norms, sizes,
    )  # fmt: skip


def _coupled_frf(assembly: Assembly, coupled: Coupled) -> Frf:
    """Assemble Y_c as `couple` does."""
    frfs = {name: part.frf for name, part in assembly.parts.items()}
    layout = Layout.of(frfs, *assembly.labels)
    ends = {name: ports.all_ends for name, ports in assembly.ports.items()}
    values = {name: frf.values.transpose(1, 2, 0) for name, frf in frfs.items()}
    found, finite = assemble(layout, values, ends, coupled.inverse)
    return computed_frf(
        assembly.axis, found.transpose(2, 0, 1), *assembly.labels, Quantity.RECEPTANCE, finite
    )


def _sum_of_products(sides: Sides, i: int, j: int) -> FloatArray:
    """Return sum_q left_iq right_jq, shape (nf,) or (1,) if there are no parts."""
    return sum((left[i] * right[j] for left, right in sides.values()), np.zeros(1))


def _norms(assembly: Assembly, coupled: Coupled) -> Sides:
    """Return ||u_iq|| of the responses and ||u_jq|| of the excitations, part by part."""
    found: Sides = {}
    for name, part in assembly.parts.items():
        if part.missing is not None:
            right = _part_norms(assembly, name, part.missing, coupled.forces, False)
            left = right
            if not coupled.symmetric:
                left = _part_norms(assembly, name, part.missing, coupled.reactions, True)
            found[name] = left, right
    return found


def _part_norms(
    assembly: Assembly, name: str, missing: Missing, forces: ComplexArray, responses: bool
) -> FloatArray:
    ports = assembly.ports[name]
    at = dict(ports.responses if responses else ports.excitations)
    own = [at.get(place) for place in range(forces.shape[1])]
    squares = missing.squares(ports.row_ends, own, forces[list(ports.joints)])
    return np.asarray(np.sqrt(missing.finite_radius * squares))


def _kernel_norm(assembly: Assembly, coupled: Coupled) -> FloatArray:
    """Return k, shape (nf,)."""
    weights = np.zeros_like(coupled.inverse)
    for name, part in assembly.parts.items():
        joints = assembly.ports[name].joints
        if part.missing is not None and joints:
            gram = part.missing.gram(assembly.ports[name].row_ends)
            for at, k in enumerate(joints):
                for there, other in enumerate(joints):
                    weights[k, other] += part.missing.finite_radius * gram[at, there]
    inner = product(product(weights, coupled.inverse), weights.conj())
    square = (coupled.inverse.conj() * inner).real.sum(axis=(0, 1))
    return np.asarray(np.sqrt(square.clip(min=0.0)))


def _round_off(assembly: Assembly, coupled: Coupled) -> tuple[Sides, FloatArray]:
    """Return r_iq of the responses and r_jq of the excitations, part by part, and l."""
    scale = coupled.scale
    root = np.sqrt(len(scale) * EPS)
    own = np.divide(root, scale, out=np.zeros_like(scale), where=scale > 0)
    at_joints, found = np.zeros_like(scale), {}
    forces = np.abs(coupled.forces)
    reactions = forces if coupled.symmetric else np.abs(coupled.reactions)
    for name, part in assembly.parts.items():
        ports, (of_rows, of_columns) = assembly.ports[name], part.sizes
        joints = list(ports.joints)
        (rows, signs), (columns, _) = ports.row_ends, ports.column_ends
        here = own[joints] + np.abs(signs)[:, None] * np.maximum(
            of_rows[list(rows)], of_columns[list(columns)]
        )
        np.add.at(at_joints, joints, here)
        right = _weighted(forces, joints, here)
        for place, at in ports.excitations:
            right[place] += of_columns[at]
        left = right
        if not coupled.symmetric:
            left = _weighted(reactions, joints, here)
            for place, at in ports.responses:
                left[place] += of_rows[at]
        found[name] = left, right
    loss = (np.abs(coupled.inverse) * at_joints[:, None] * at_joints).sum(axis=(0, 1))
    return found, loss


def _weighted(forces: FloatArray, joints: Sequence[int], sizes: FloatArray) -> FloatArray:
    """Return sum_k |lambda_kj| g_k over some joints, shape (n, nf)."""
    total = np.zeros(forces.shape[1:])
    for joint, size in zip(joints, sizes, strict=True):
        total += forces[joint] * size
    return total
