"""Dynamic condensation, in its two senses: slaves blocked (u_S = 0) or free of force (f_S = 0).

Partition H f = u into masters M and slaves S, the paper, Eq. (28). A Schur complement means the
opposite for a receptance H and for a dynamic stiffness Z = H^-1:

=======================================  =========  =============================
``condense_blocked``                     u_S = 0    H_MM - H_MS H_SS^-1 H_SM
``condense_free``                        f_S = 0    H_MM
``condense_dynamic_stiffness``           f_S = 0    Z_MM - Z_MS Z_SS^-1 Z_SM = H_MM^-1
``block_dofs`` (of a system)             u_S = 0    M, C, K without the rows and columns S
=======================================  =========  =============================

Eqs. (18)-(22) of the paper need no function of their own: Eqs. (19) and (20) are
``condense_blocked`` of the coupled FRF with B, or A, blocked; with c blocked as well,
``condense_blocked(frf, a)`` is "condensed subsystem A" of Eq. (21), and of A alone with its hub
locked: blocking in steps is blocking at once (the quotient property of Schur complements).
Eqs. (21) and (22) as printed are shorter only because the paper sets H_ab = 0. No coupled
receptance has that (H_ab = H_ac H_cc^-1 H_cb where c alone joins a and b); the dynamic stiffness
has, Z_ab = 0, and read with Z for H, Eqs. (18)-(22) are ``condense_dynamic_stiffness``.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._kernels import batched as _batched
from ._kernels.checks import ComplexArray, FloatArray, ascending_frequency, positions, unique_labels
from .errors import AmbiguousDofError, FbsError, SingularLineError, UnknownDofError
from .frf import Frf
from .second_order_system import SecondOrderSystem

BLOCK = 256
"""Lines condensed at once: 256 matrices of 30 DoFs are 3.7 MB."""

SWEEPS = 4
"""Of `_equilibrating_size`: row maxima are then within 1e-5^(1/16), half a decade, of one."""


def condense_blocked(frf: Frf, masters: Iterable[str]) -> Frf:
    """Block the slaves: H_MM - H_MS H_SS^-1 H_SM; the paper, Eqs. (30) and (31) as printed.

    0 = u_S = H_SM f_M + H_SS f_S gives the reactions f_S = -H_SS^-1 H_SM f_M, and with them
    u_M = H_MM f_M + H_MS f_S = (H_MM - H_MS H_SS^-1 H_SM) f_M.

    The slaves' coordinates are thus locked, as `block_dofs` locks them in a system. It is not
    what the paper's text asks for, no force on the slaves: see `condense_free`. Near a pole of
    the whole, or 0 Hz of a free one, H is much larger than the result, and the subtraction loses
    the ratio of the two. Fewer slaves lose less, and those behind others need no blocking: of
    a - c - b, block c alone, condense_blocked(condense_free(frf, a + c), a).

    Parameters
    ----------
    frf : Frf
        Any quantity. Every label must be both response and excitation.
    masters : labels
        All others are slaves. (A master that moves with a slave comes out as zero.)

    Returns
    -------
    Frf
        Between the masters, in the order given; frequency-contiguous.

    Raises
    ------
    SingularLineError
        H_SS, equilibrated, has no digit left on a line: an undamped pole of the blocked system,
        or slaves that move as one.
    UnknownDofError, AmbiguousDofError, FbsError
    """
    kept = _masters(masters)
    known = _square_labels(frf, kept)
    slaves = tuple(label for label in known if label not in kept)
    whole = frf.select(kept + slaves, kept + slaves)
    if not slaves:
        return whole
    m, nf = len(kept), frf.frequency.size
    values = np.empty((m, m, nf), dtype=complex)
    singular = np.zeros(nf, dtype=bool)
    for lines in _blocks(nf):
        h = np.ascontiguousarray(whole.values[lines])
        complement, singular[lines] = _schur_complement(h, m, _equilibrating_size(np.abs(h)))
        values[:, :, lines] = complement.transpose(1, 2, 0)
    _refuse_singular(
        frf.frequency[singular],
        "the slaves' receptance H_SS is singular to working precision",
        "these lines lie on undamped poles of the blocked system, or slaves move as one (two "
        "labels of one motion, or none at all, as every mobility at 0 Hz): leave the lines out, "
        "add damping, or drop a slave with Frf.select first",
    )
    return Frf(frf.frequency, values.transpose(2, 0, 1), kept, kept, frf.quantity)


def condense_free(frf: Frf, masters: Iterable[str]) -> Frf:
    """Leave the slaves without force: H_MM; what the paper's text above Eq. (29) assumes.

    Eq. (29) itself says so: with f_S = 0 its first row reads u_M = H_MM f_M, and u_S appears in
    it nowhere. A receptance is condensed by selection; eliminating u_S costs something only in
    the dynamic stiffness, see `condense_dynamic_stiffness`.

    Parameters
    ----------
    frf : Frf
    masters : labels
        Each both response and excitation.

    Returns
    -------
    Frf
        Between the masters, in the order given.

    Raises
    ------
    UnknownDofError, AmbiguousDofError, FbsError
    """
    kept = _masters(masters)
    return frf.select(kept, kept)


def condense_dynamic_stiffness(
    system: SecondOrderSystem, frequency: ArrayLike, masters: Iterable[str]
) -> ComplexArray:
    """Leave the slaves without force: Z_MM - Z_MS Z_SS^-1 Z_SM, Z = K - w^2 M + jwC.

    0 = f_S = Z_SM u_M + Z_SS u_S eliminated from f_M = Z_MM u_M + Z_MS u_S (Leung 1978, An
    accurate method of dynamic condensation in structural analysis, Int. J. Numer. Methods Eng.
    12). Its inverse is H_MM, `condense_free` of the receptance.

    Parameters
    ----------
    system : SecondOrderSystem
    frequency : array, shape (nf,), Hz
    masters : labels
        Of different coordinates; derived labels are allowed. All other coordinates are slaves.

    Returns
    -------
    array, shape (nf, m, m), N/m
        Rows and columns in the order of the masters.

    Raises
    ------
    SingularLineError
        Z_SS has no digit left on a line: an undamped pole of the system with its masters blocked.
    UnknownDofError, AmbiguousDofError, FbsError
    """
    axis = ascending_frequency(frequency)
    kept = _masters(masters)
    index, factor = system.locate(kept)
    _refuse_repeated(kept, index)
    order = index + [i for i in range(len(system.dofs)) if i not in index]
    m = len(kept)
    values = np.empty((axis.size, m, m), dtype=complex)
    singular = np.zeros(axis.size, dtype=bool)
    for lines in _blocks(axis.size):
        z, size = _dynamic_stiffness(system, order, 2 * np.pi * axis[lines])
        values[lines], singular[lines] = _schur_complement(z, m, size)
    _refuse_singular(
        axis[singular],
        "the slaves' dynamic stiffness Z_SS is singular to working precision",
        "these lines lie on undamped poles of the system with its masters blocked: leave them "
        "out, add damping, or take condense_free of the receptance",
    )
    values /= np.outer(factor, factor)
    return values


def block_dofs(system: SecondOrderSystem, dofs: Iterable[str]) -> SecondOrderSystem:
    """Lock coordinates, u_S = 0: M, C and K without the rows and columns S.

    The model behind `condense_blocked`: the equation of a locked coordinate only gives its
    reaction, and its column multiplies zero.

    Parameters
    ----------
    system : SecondOrderSystem
    dofs : labels
        A derived label locks the coordinate it hangs on. Derived labels of locked coordinates
        stand still too and are dropped.

    Returns
    -------
    SecondOrderSystem

    Raises
    ------
    UnknownDofError, AmbiguousDofError
    FbsError
        No coordinate is left.
    """
    locked, _ = system.locate(dofs)
    free = [i for i in range(len(system.dofs)) if i not in locked]
    if not free:
        raise FbsError("every degree of freedom of the system is blocked; nothing is left to move")
    names = tuple(system.dofs[i] for i in free)
    part = np.ix_(free, free)
    return SecondOrderSystem(
        system.mass[part],
        system.damping[part],
        system.stiffness[part],
        names,
        {label: (dof, f) for label, (dof, f) in system.derived.items() if dof in names},
        system.loss_factor,
    )


def _masters(masters: Iterable[str]) -> tuple[str, ...]:
    kept = unique_labels(masters, "the masters")
    if not kept:
        raise FbsError("no masters given: nothing is left after condensation")
    return kept


def _square_labels(frf: Frf, masters: tuple[str, ...]) -> tuple[str, ...]:
    """Return the labels of an FRF whose responses are its excitations; masters among them."""
    known = tuple(dict.fromkeys(frf.responses + frf.excitations))
    positions(masters, known, "the FRF")
    for role, labels in (("response", frf.responses), ("excitation", frf.excitations)):
        missing = [label for label in known if label not in labels]
        if missing:
            raise UnknownDofError(
                f"{', '.join(map(repr, missing))} is no {role} of the FRF; blocking needs every "
                "label as response and as excitation (drop those that are not with Frf.select)"
            )
    return known


def _refuse_repeated(labels: tuple[str, ...], index: list[int]) -> None:
    owner: dict[int, str] = {}
    for label, i in zip(labels, index, strict=True):
        if owner.setdefault(i, label) != label:
            raise AmbiguousDofError(
                f"the masters {owner[i]!r} and {label!r} are one motion; leave one of them out"
            )


def _blocks(count: int) -> list[slice]:
    return [slice(start, start + BLOCK) for start in range(0, count, BLOCK)]


def _refuse_singular(frequencies: FloatArray, reason: str, remedy: str) -> None:
    if frequencies.size:
        raise SingularLineError(frequencies, reason, remedy)


def _dynamic_stiffness(
    system: SecondOrderSystem, order: list[int], omega: FloatArray
) -> tuple[ComplexArray, FloatArray]:
    """Return Z, shape (nk, n, n), rows and columns in `order`, and the size of its terms."""
    w = omega[:, None, None]
    part = np.ix_(order, order)
    elastic = system.stiffness[part] * (1.0 + 1j * system.loss_factor)
    terms = (elastic, -(w**2) * system.mass[part], w * system.damping[part])
    size = sum(np.abs(np.diagonal(term, axis1=-2, axis2=-1)) for term in terms)
    return terms[0] + terms[1] + 1j * terms[2], np.asarray(size)


def _schur_complement(
    matrices: NDArray[Any], m: int, size: FloatArray
) -> tuple[ComplexArray, NDArray[np.bool_]]:
    """Return A_MM - A_MS A_SS^-1 A_SM per matrix, M the first m rows; and where A_SS is singular.

    With s_i = size_i^(-1/2), the entries of s_i A_ij s_j are of order one whatever the units, and
    A_SS is singular to working precision where the inverse of its scaled self exceeds
    1 / (10 n eps), so that no digit is left.

    Parameters
    ----------
    matrices : array, shape (nk, n, n)
    m : int
    size : array, shape (nk, n)
    """
    scale = np.where(size > 0, size, 1.0) ** -0.5
    scaled = scale[:, :, None] * matrices * scale[:, None, :]
    inverse, singular = _batched.inverse(scaled[:, m:, m:])
    limit = 1 / (10 * matrices.shape[-1] * np.finfo(float).eps)
    peak = np.abs(inverse).max(axis=(-2, -1), initial=0.0)
    reaction = inverse @ scaled[:, m:, :m]
    complement = scaled[:, :m, :m] - scaled[:, :m, m:] @ reaction
    complement /= scale[:, :m, None] * scale[:, None, :m]
    return complement, singular | ~(peak <= limit)  # NaN counts as singular


def _equilibrating_size(modulus: FloatArray) -> FloatArray:
    """Return d with max_j |A_ij| / sqrt(d_i d_j) near one for every row and column i.

    Ruiz (2001), A scaling algorithm to equilibrate both rows and columns norms in matrices, RAL
    TR-2001-034. The diagonal alone would not do: a drive point vanishes at its antiresonances.

    Parameters
    ----------
    modulus : array, shape (nk, n, n)
    """
    root = np.ones(modulus.shape[:2])
    for _ in range(SWEEPS):
        scaled = modulus / (root[:, :, None] * root[:, None, :])
        largest = np.maximum(scaled.max(axis=1), scaled.max(axis=2))
        root *= np.sqrt(np.where(largest > 0, largest, 1.0))
    return np.asarray(root**2)
