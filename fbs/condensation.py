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

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._kernels.blocks import stretches
from ._kernels.checks import (
    ComplexArray,
    FloatArray,
    ascending_frequency,
    positions,
    sealed,
    unique_labels,
)
from ._kernels.door import door
from ._kernels.elimination import EPS, Blocks, Enclosure, eliminate, equilibrating_size
from ._mixed_assembly import HELD
from .errors import (
    AmbiguousDofError,
    FbsError,
    SingularLineError,
    UnknownDofError,
    lost_digits,
)
from .frf import Frf, computed_frf
from .second_order_system import SecondOrderSystem, SystemOrigin, differentiated

BLOCK = 256
"""Lines condensed at once: 256 matrices of 30 DoFs are 3.7 MB."""


@door
def condense_blocked(frf: Frf, masters: Iterable[str]) -> Frf:
    """Block the slaves: H_MM - H_MS H_SS^-1 H_SM; the paper, Eqs. (30) and (31) as printed.

    0 = u_S = H_SM f_M + H_SS f_S gives the reactions f_S = -H_SS^-1 H_SM f_M, and with them
    u_M = H_MM f_M + H_MS f_S = (H_MM - H_MS H_SS^-1 H_SM) f_M.

    The slaves' coordinates are thus locked, as `block_dofs` locks them in a system. It is not
    what the paper's text asks for, no force on the slaves: see `condense_free`. Near a pole of
    the whole, or 0 Hz of a free one, H is much larger than the result, and the subtraction loses
    the ratio of the two. On lines where that is more than 1 / `HELD`, the FRFs of a system are
    condensed by its dynamic stiffness,

        [0     -L_S] [f_S]   [0  ]
        [L_S^T  Z  ] [x  ] = [f_M],    u_M = L_M x,

    and of other FRFs the `round_off` says what is left. Fewer slaves lose less, and those behind
    others need no blocking: of a - c - b, block c alone,
    condense_blocked(condense_free(frf, a + c), a).

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
    found = _Blocked(whole, len(kept), np.zeros(frf.frequency.size, dtype=bool)).solve(False)
    own = range(len(kept))
    with np.errstate(invalid="ignore"):
        left = np.abs(found.values[:, own, own]) < HELD * np.abs(whole.values[:, own, own])
    held = left.any(axis=1) & isinstance(whole._origin, SystemOrigin)
    origin = _Blocked(whole, len(kept), held)
    if held.any():
        found = origin.solve(False)
    singular = ~np.isfinite(found.bound).all(axis=(1, 2))
    _refuse_singular(
        frf.frequency[singular],
        "the slaves' receptance H_SS is singular to working precision",
        "these lines lie on undamped poles of the blocked system, or slaves move as one (two "
        "labels of one motion, or none at all, as every mobility at 0 Hz): leave the lines out, "
        "add damping, or drop a slave with Frf.select first",
    )
    small = np.asarray(np.abs(found.values) <= found.bound)
    lost = small.all(axis=(1, 2)) & np.any(found.values != 0, axis=(1, 2))
    if lost.any():
        raise lost_digits(frf.frequency[lost], slaves)
    contiguous = np.ascontiguousarray(found.values.transpose(1, 2, 0)).transpose(2, 0, 1)
    return computed_frf(frf.frequency, contiguous, kept, kept, frf.quantity, origin=origin)


@dataclass(frozen=True, eq=False)
class _Blocked:
    """The origin of FRFs whose slaves are blocked: `whole`, the first `count` labels masters.

    `held` : (nf,), on which lines the dynamic stiffness of the system behind it is used
    """

    whole: Frf
    count: int
    held: NDArray[np.bool_]

    def renamed(self, names: Mapping[str, str]) -> _Blocked:
        return replace(self, whole=self.whole.renamed(names))

    def enclose(self, frf: Frf) -> Enclosure:
        at = np.searchsorted(self.whole.frequency, frf.frequency)
        part = _Blocked(self.whole.at_lines(frf.frequency), self.count, self.held[at])
        masters = self.whole.responses[: self.count]
        i, j = (positions(some, masters, "the FRF") for some in (frf.responses, frf.excitations))
        found = Enclosure(*(own[:, i][:, :, j] for own in part.solve(True)))
        order = frf.quantity.derivative - self.whole.quantity.derivative
        return differentiated(found, frf.omega, order)

    def solve(self, bounded: bool) -> Enclosure:
        """Return H_MM - H_MS H_SS^-1 H_SM on all lines; `bounded`: from the FRFs' own bound.

        Without it an entry is taken to be known to 10 eps of its row and column: H_SS is then
        singular where its inverse, equilibrated as part of H, exceeds 1 / (10 n eps).
        """
        m, h = self.count, self.whole.values
        if bounded:
            error = self.whole.round_off
        else:
            root = np.sqrt(equilibrating_size(np.abs(h)))
            error = 10 * EPS * root[:, :, None] * root[:, None, :]
        values = np.empty((len(h), m, m), dtype=complex)
        bound = np.empty(values.shape)
        for some, blocks in ((~self.held, None), (self.held, self._equations)):
            for part in stretches(int(some.sum()), BLOCK):
                lines = np.flatnonzero(some)[part]
                known = blocks(lines) if blocks else _blocks(h[lines], error[lines], m)
                values[lines], bound[lines] = eliminate(*known)
        if self.held.any():
            order = self.whole.quantity.derivative
            omega = self.whole.omega[self.held]
            again = Enclosure(values[self.held], bound[self.held])
            values[self.held], bound[self.held] = differentiated(again, omega, order)
        return Enclosure(values, bound)

    def _equations(self, lines: NDArray[np.intp]) -> tuple[Blocks, Blocks]:
        origin, m = self.whole._origin, self.count
        assert isinstance(origin, SystemOrigin)
        ports = origin.ports(self.whole.responses)
        z, error = origin.dynamic_stiffness(self.whole.omega[lines])
        s, n = len(ports) - m, z.shape[1]
        whole = np.zeros((len(z), m + s + n, m + s + n), dtype=z.dtype)
        known = np.zeros(whole.shape)
        whole[:, m + s :, m + s :], known[:, m + s :, m + s :] = z, error
        whole[:, : m + s, m + s :], whole[:, m + s :, : m + s] = -ports, ports.T
        return _blocks(whole, known, m)


def _blocks(matrix: NDArray[Any], error: FloatArray, m: int) -> tuple[Blocks, Blocks]:
    """Partition matrices and their errors, masters being the first m rows and columns."""
    first, second = (
        Blocks(own[:, :m, :m], own[:, :m, m:], own[:, m:, :m], own[:, m:, m:])
        for own in (matrix, error)
    )
    return first, second


@dataclass(frozen=True, eq=False)
class CondensedStiffness:
    """What `condense_dynamic_stiffness` returns.

    Parameters
    ----------
    frequency : array, shape (nf,), Hz
    values : complex array, shape (nf, m, m), N/m
        Rows and columns in the order of the masters.
    masters : tuple of str
    round_off : array, shape (nf, m, m)
        Bound of the values' error, as `Frf.round_off`.
    """

    frequency: FloatArray
    values: ComplexArray
    masters: tuple[str, ...]
    round_off: FloatArray


@door
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


@door
def condense_dynamic_stiffness(
    system: SecondOrderSystem, frequency: ArrayLike, masters: Iterable[str]
) -> CondensedStiffness:
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
    CondensedStiffness

    Raises
    ------
    SingularLineError
        Z_SS has no digit left on a line: an undamped pole of the system with its masters blocked.
        Or none is left of the difference: near 0 Hz of a free system K cancels, down to -w^2 M.
    UnknownDofError, AmbiguousDofError, FbsError
    """
    axis = ascending_frequency(frequency)
    kept = _masters(masters)
    index, factor = system.locate(kept)
    _refuse_repeated(kept, index)
    order = index + [i for i in range(len(system.dofs)) if i not in index]
    m = len(kept)
    values = np.empty((axis.size, m, m), dtype=complex)
    bound = np.empty(values.shape)
    for lines in stretches(axis.size, BLOCK):
        z, error = SystemOrigin.of(system).dynamic_stiffness(2 * np.pi * axis[lines])
        part = np.ix_(range(len(z)), order, order)
        values[lines], bound[lines] = eliminate(*_blocks(z[part], error[part], m))
    _refuse_singular(
        axis[~np.isfinite(bound).all(axis=(1, 2))],
        "the slaves' dynamic stiffness Z_SS is singular to working precision",
        "these lines lie on undamped poles of the system with its masters blocked: leave them "
        "out, add damping, or take condense_free of the receptance",
    )
    _refuse_singular(
        axis[np.any(np.all(np.abs(values) <= bound, axis=2), axis=1)],
        "nothing but round-off is left of the dynamic stiffness between the masters",
        "the stiffness of a system free to move cancels near 0 Hz: leave these lines out, or take "
        "condense_free of the receptance",
    )
    values /= np.outer(factor, factor)
    bound = bound / np.abs(np.outer(factor, factor)) + 4 * EPS * np.abs(values)
    return CondensedStiffness(axis, sealed(values), kept, sealed(bound))


@door
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


def _refuse_singular(frequencies: FloatArray, reason: str, remedy: str) -> None:
    if frequencies.size:
        raise SingularLineError(frequencies, reason, remedy)
