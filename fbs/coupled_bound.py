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
|Y~_c - Y'_c| further away; the distance is that of the numbers returned, their rounding included.

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
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._assembly import Layout, assemble
from ._kernels.blas_threads import one_blas_thread
from ._kernels.blocks import stretches
from ._kernels.checks import (
    ComplexArray,
    FloatArray,
    ascending_frequency,
    positions,
    read_only,
    unique_labels,
)
from ._kernels.elimination import EPS
from .bounded_assembly import Assembly, Coupled, Part, TruncatedPart
from .frf import Frf, Quantity, computed_frf, require_same_layout
from .joints import AnyJoint
from .reduced_bound import ReducedPart
from .truncation_bound import SURE

__all__ = [
    "BoundedFrf",
    "Part",
    "Reason",
    "ReducedPart",
    "TruncatedPart",
    "bounded_frf",
    "decibels",
]


Sides = tuple[FloatArray, FloatArray]
"""Of responses and of excitations, shape (n, n_share, nf): a bound is sum_q left_iq right_jq."""


CACHED = 2**19
"""Bytes of FRFs whose bounds are made at once: what they take stays in the cache."""


ROUNDED = 1 + 1e-13
"""A bound is a sum of positive terms, two a part: eps times their number is below 1e-13."""


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
    _better: Coupled
    _unknown: Sides
    _rounding: Sides

    def change(self, response: str, excitation: str) -> ComplexArray:
        """Return Y'_c - Y~_c, what is known of the error of the numbers in `frf`; (nf,), m/N."""
        return self._change(*self._at(response, excitation))

    def truncation(self, response: str, excitation: str) -> FloatArray:
        """Bound the error of an FRF of `frf`, but for round-off; shape (nf,), m/N."""
        i, j = self._at(response, excitation)
        unknown = self._shares(i, range(j, j + 1), self._unknown)[0]
        return np.asarray(_modulus(self._change(i, j)) + unknown)

    def round_off(self, response: str, excitation: str) -> FloatArray:
        """Bound what round-off makes of it; shape (nf,), m/N."""
        i, j = self._at(response, excitation)
        share = _products(self._rounding, i, slice(j, j + 1))[0]
        return np.where(self.loss < 1, share, np.inf)

    def between(self, response: str, excitation: str) -> FloatArray:
        """Bound the whole error of an FRF of `frf`; infinite where there is no bound."""
        i, j = self._at(response, excitation)
        shares = self._shares(i, range(j, j + 1), self._unknown, self._rounding)[0]
        return np.asarray(_modulus(self._change(i, j)) + shares)

    @cached_property
    def bound(self) -> FloatArray:
        """The bounds of all FRFs, shape (nf, n_response, n_excitation), m/N."""
        values = self.frf.values.transpose(1, 2, 0)
        bounds, mirrored = np.empty(values.shape), self._better.symmetric
        step = max(1, CACHED // (16 * self.kernel.size))
        for i in range(len(values)):
            first = i if mirrored else 0
            for some in stretches(values.shape[1] - first, step):
                columns = range(first + some.start, first + some.stop)
                at = slice(columns.start, columns.stop)
                better = self._better.frf(i, columns)
                shares = self._shares(i, columns, self._unknown, self._rounding)
                bounds[i, at] = _modulus(better - values[i, at]) + shares
                if mirrored:
                    bounds[at, i] = _modulus(better - values[at, i]) + shares
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
        better = self._better.frf(i, range(j, j + 1))[0]
        return np.asarray(better - self.frf.values[:, i, j])

    def _shares(self, i: int, columns: range, *shares: Sides) -> FloatArray:
        """Add up shares for some excitations in a row, shape (n, nf); infinite without a bound."""
        some = slice(columns.start, columns.stop)
        total = sum((_products(sides, i, some) for sides in shares), np.zeros(self.kernel.size))
        return np.where(self.reason > 0, np.inf, total * ROUNDED)


def _modulus(values: ComplexArray) -> FloatArray:
    return np.asarray(np.sqrt(values.real**2 + values.imag**2) * ROUNDED)


def _products(sides: Sides, i: int, columns: slice) -> FloatArray:
    """Return sum_q left_iq right_jq, shape (n, nf)."""
    return np.asarray(np.einsum("qf,jqf->jf", sides[0][i], sides[1][columns]))


def decibels(bound: FloatArray, modulus: FloatArray) -> FloatArray:
    """Return -20 log10(1 - b / h); infinite where b >= h, 0 where both vanish."""
    share = np.divide(bound, modulus, out=np.full_like(bound, np.inf), where=modulus > 0)
    share[(bound == 0) & (modulus == 0)] = 0.0
    with np.errstate(divide="ignore"):
        return np.asarray(-20 * np.log10(1 - share.clip(max=1.0)) + 0.0)  # no -0


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
    parts : mapping of str to TruncatedPart, ReducedPart, SecondOrderSystem or Frf
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
        kernel = _kernel_norm(assembly, better) * SURE
        rounding, loss = _round_off(assembly, better)
        reason = np.zeros(axis.size, np.int8)
        reason[~(kernel < 1)] = Reason.JOINTS
        reason[~(loss < 1)] = Reason.ROUND_OFF
        for part in assembly.parts.values():
            if part.missing is not None:
                reason[~np.isfinite(part.missing.radius)] = Reason.PART
        unknown = _unknown(assembly, better, kernel)
        frf = _coupled_frf(assembly, truncated)
    return BoundedFrf(
        frf, read_only(reason), read_only(kernel), read_only(loss),
        better, unknown, rounding,
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


def _unknown(assembly: Assembly, coupled: Coupled, kernel: FloatArray) -> Sides:
    """Return ||u_jq|| part by part, and ||u_j|| (k / (1 - k))^(1/2)."""
    parts = [name for name, part in assembly.parts.items() if part.missing is not None]
    weight = _geometric(kernel)

    def side(forces: ComplexArray, responses: bool) -> FloatArray:
        shares = np.empty((forces.shape[1], len(parts) + 1, kernel.size))
        for q, name in enumerate(parts):
            shares[:, q] = _squares(assembly, name, forces, responses)
        np.sum(shares[:, :-1], axis=1, out=shares[:, -1])
        np.sqrt(shares, out=shares)
        shares[:, -1] *= weight
        return shares

    right = side(coupled.forces, False)
    return (right if coupled.symmetric else side(coupled.reactions, True)), right


def _geometric(ratio: FloatArray) -> FloatArray:
    """Return (x / (1 - x))^(1/2), 0 where x is 1 or more and there is no bound."""
    below = np.where(ratio < 1, ratio, 0.0)
    return np.asarray(np.sqrt(below / (1 - below)))


def _squares(assembly: Assembly, name: str, forces: ComplexArray, responses: bool) -> FloatArray:
    """Return ||u_jq||^2, shape (n, nf)."""
    missing, ports = assembly.parts[name].missing, assembly.ports[name]
    assert missing is not None
    at = dict(ports.responses if responses else ports.excitations)
    own = [at.get(place) for place in range(forces.shape[1])]
    squares = missing.squares(ports.row_ends, own, forces[list(ports.joints)])
    return np.asarray(missing.finite_radius * squares)


def _kernel_norm(assembly: Assembly, coupled: Coupled) -> FloatArray:
    """Return k, shape (nf,)."""
    weights: dict[tuple[int, int], NDArray[np.inexact]] = {}
    for name, part in assembly.parts.items():
        joints = assembly.ports[name].joints
        if part.missing is not None and joints:
            gram = part.missing.gram(assembly.ports[name].row_ends)
            for (at, k), (there, other) in product(enumerate(joints), repeat=2):
                own = part.missing.finite_radius * gram[at, there]
                weights[k, other] = weights.get((k, other), 0.0) + own
    inner, weighted = np.zeros_like(coupled.inverse), np.zeros_like(coupled.inverse)
    for (i, j), weight in weights.items():
        weighted[i] += weight * coupled.inverse[j]
    for (i, j), weight in weights.items():
        inner[:, j] += weighted[:, i] * weight.conj()
    square = (coupled.inverse.real * inner.real + coupled.inverse.imag * inner.imag).sum(
        axis=(0, 1)
    )
    return np.asarray(np.sqrt(square.clip(min=0.0)))


def _round_off(assembly: Assembly, coupled: Coupled) -> tuple[Sides, FloatArray]:
    """Return r_jq part by part and (sum_q r_jq) (l / (1 - l))^(1/2), times 2^(1/2), and l."""
    scale = coupled.scale
    root = np.sqrt(len(scale) * EPS)
    own = np.divide(root, scale, out=np.zeros_like(scale), where=scale > 0)
    at_joints, here = np.zeros_like(scale), {}
    for name, part in assembly.parts.items():
        ports, (of_rows, of_columns) = assembly.ports[name], part.sizes
        joints = list(ports.joints)
        (rows, signs), (columns, _) = ports.row_ends, ports.column_ends
        here[name] = own[joints] + np.abs(signs)[:, None] * np.maximum(
            of_rows[list(rows)], of_columns[list(columns)]
        )
        np.add.at(at_joints, joints, here[name])
    loss = (np.abs(coupled.inverse) * at_joints[:, None] * at_joints).sum(axis=(0, 1))
    weight = np.sqrt(2) * _geometric(loss)

    def side(forces: ComplexArray, responses: bool) -> FloatArray:
        size = np.sqrt(forces.real**2 + forces.imag**2)
        shares = np.zeros((forces.shape[1], len(here) + 1, loss.size))
        for q, (name, sizes) in enumerate(here.items()):
            ports, of = assembly.ports[name], assembly.parts[name].sizes
            for joint, at_joint in zip(ports.joints, sizes, strict=True):
                shares[:, q] += size[joint] * at_joint
            for place, at in ports.responses if responses else ports.excitations:
                shares[place, q] += of[0 if responses else 1][at]
        np.sum(shares[:, :-1], axis=1, out=shares[:, -1])
        shares[:, :-1] *= np.sqrt(2)
        shares[:, -1] *= weight
        return shares

    right = side(coupled.forces, False)
    return ((right if coupled.symmetric else side(coupled.reactions, True)), right), loss
