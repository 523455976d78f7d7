"""Measured FRFs spread over more DoFs by a model: SEREP's shapes, SEMM, and singular vectors.

**SEREP expansion** (O'Callahan, Avitabile & Riemer 1989, IMAC 7): a motion measured at c is one of
the modes' motions, u = Φ Φ_c⁺ u_c.

**System equivalent model mixing** (Klaassen, van der Seijs & de Klerk 2018, Mech. Syst. Signal
Process. 105, 90): the model's dynamics at the measured DoFs are taken off and the measured ones put
on, by decoupling and coupling in one formula. With g all DoFs of the (parent) model, c and e the
measured responses and excitations,

    Y = Y_gg − Y_ge Y_ce⁺ (Y_ce − Y^m) Y_ce⁺ Y_cg          basic
    Y = Y_gg − Y_gg Y_cg⁺ (Y_ce − Y^m) Y_ge⁺ Y_gg          fully extended

The basic form follows the measurement at c, e exactly, errors and all; the extended one follows it
in the least-squares sense of all g, which takes spurious peaks away. Fewer singular values of the
inverses (`rank`) leave more to the model.

**Singular vectors** (Trainotti, Bregar & Rixen 2022, Mech. Syst. Signal Process. 165): in place of
geometry, the largest singular vectors of an interface's measured FRFs say which motions it has.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ._kernels.checks import ComplexArray, FloatArray, positions, unique_labels
from ._kernels.door import door
from .axes import require_same_frequency
from .errors import FbsError
from .frf import Frf
from .metrics import coherence_criterion
from .undamped_modes import RealModes

SPAN = 1e-9
"""Smallest over largest singular value that still counts as one more direction."""


@door
def serep_expansion(modes: RealModes, measured: Iterable[str]) -> FloatArray:
    """Φ Φ_c⁺, (n_dof, n_measured): motion of every DoF from that of the measured ones.

    Raises
    ------
    FbsError
        Fewer measured DoFs than modes, or they do not tell the modes apart.
    UnknownDofError
    """
    labels = unique_labels(measured, "the measured DoFs")
    seen = modes.shapes[positions(labels, modes.dofs, "the modes")]
    count = seen.shape[1]
    values = np.linalg.svd(seen / np.linalg.norm(modes.shapes, axis=0), compute_uv=False)
    if len(labels) < count or not values[-1] > SPAN * values[0]:
        raise FbsError(
            f"{len(labels)} measured DoFs do not tell {count} modes apart: keep fewer modes, or "
            "measure more"
        )
    expansion: FloatArray = modes.shapes @ np.linalg.pinv(seen)
    return expansion


@dataclass(frozen=True, eq=False)
class MixedFrf:
    """What `semm` returns.

    Attributes
    ----------
    frf
        Of all the model's DoFs.
    responses, excitations
        Measured label → (nf,) coherence criterion of what was measured there and what the mixed
        FRFs are: 1 where the mixture follows, low where measurement and model contradict.
    """

    frf: Frf
    responses: Mapping[str, FloatArray]
    excitations: Mapping[str, FloatArray]


@door
def semm(
    model: Frf,
    measured: Frf,
    form: Literal["basic", "extended"] = "extended",
    rank: int | None = None,
) -> MixedFrf:
    """Mix measured FRFs into a model's; the module has the formulas.

    Parameters
    ----------
    model
        Square, at all DoFs.
    measured
        At some of them, on the same lines, of the same quantity.
    form, rank
        Rank: singular values kept of the inverses (default: all there are).

    Raises
    ------
    FbsError, UnknownDofError, AxisMismatchError
        What does not fit.
    """
    if set(model.responses) != set(model.excitations):
        raise FbsError("the model's responses and excitations differ; give FRFs of all against all")
    if model.quantity != measured.quantity:
        raise FbsError(f"model and measurement: {model.quantity} against {measured.quantity}")
    require_same_frequency(model.frequency, measured.frequency, "model's and measured axes differ")
    every = model.responses
    whole = model.select(every, every).values
    c = positions(measured.responses, every, "the model")
    e = positions(measured.excitations, every, "the model")
    missed = whole[:, c][:, :, e] - measured.values
    if form == "basic":
        inverse = _pseudo_inverse(whole[:, c][:, :, e], rank)
        before, after = whole[:, :, e] @ inverse, inverse @ whole[:, c]
    else:
        before = whole @ _pseudo_inverse(whole[:, c], rank)
        after = _pseudo_inverse(whole[:, :, e], rank) @ whole
    mixed = whole - before @ missed @ after
    at = mixed[:, c][:, :, e]
    rows = coherence_criterion(measured.values, at, axis=2)
    columns = coherence_criterion(measured.values, at, axis=1)
    return MixedFrf(
        Frf(model.frequency, mixed, every, every, model.quantity),
        dict(zip(measured.responses, rows.T, strict=True)),
        dict(zip(measured.excitations, columns.T, strict=True)),
    )


@dataclass(frozen=True, eq=False)
class SingularBasis:
    """Motions U (nf, n_response, rank) and forces V (nf, n_excitation, rank) of an interface.

    ``dropped`` is (nf,) the largest singular value left out over the largest.
    """

    responses: tuple[str, ...]
    excitations: tuple[str, ...]
    motions: ComplexArray
    forces: ComplexArray
    dropped: FloatArray

    @property
    def labels(self) -> tuple[str, ...]:
        """``sv1``, ``sv2``, …"""
        return tuple(f"sv{number}" for number in range(1, self.motions.shape[2] + 1))

    def applied_to(self, frf: Frf) -> Frf:
        """Uᴴ Y V at the interface, other labels kept; parts in one basis are coupled at ``sv1`` …

        Raises
        ------
        UnknownDofError, FbsError
            A label of the basis is missing, or the lines are others.
        """
        if len(frf.frequency) != len(self.motions):
            raise FbsError(f"a basis of {len(self.motions)} lines for FRFs of {len(frf.frequency)}")
        left = _extended(frf.responses, self.responses, self.motions.conj())
        right = _extended(frf.excitations, self.excitations, self.forces)
        values = left.transpose(0, 2, 1) @ frf.values @ right
        rows, columns = (
            (*self.labels, *(label for label in labels if label not in own))
            for labels, own in (
                (frf.responses, self.responses),
                (frf.excitations, self.excitations),
            )
        )
        return Frf(frf.frequency, values, rows, columns, frf.quantity)


@door
def singular_basis(
    frf: Frf, responses: Iterable[str], excitations: Iterable[str], rank: int
) -> SingularBasis:
    """The `rank` largest singular vectors of an interface's FRFs, line by line.

    Raises
    ------
    UnknownDofError, FbsError
        A label, or more vectors than there are channels.
    """
    block = frf.select(responses, excitations)
    most = min(len(block.responses), len(block.excitations))
    if not 1 <= rank <= most:
        raise FbsError(f"rank = {rank}: must be between 1 and {most}")
    u, sigma, v = np.linalg.svd(block.values, full_matrices=False)
    dropped = sigma[:, rank] / sigma[:, 0] if rank < most else 0.0 * sigma[:, 0]
    return SingularBasis(
        block.responses,
        block.excitations,
        u[:, :, :rank],
        v[:, :rank].conj().transpose(0, 2, 1),
        dropped,
    )


def _extended(labels: tuple[str, ...], own: tuple[str, ...], basis: ComplexArray) -> ComplexArray:
    """The basis' columns, then a column of one for every label that is not its own."""
    places = positions(own, labels, "the FRF")
    others = [k for k in range(len(labels)) if k not in places]
    rank = basis.shape[2]
    matrix = np.zeros((len(basis), len(labels), rank + len(others)), dtype=complex)
    matrix[:, places, :rank] = basis
    matrix[:, others, range(rank, rank + len(others))] = 1.0
    return matrix


def _pseudo_inverse(matrices: ArrayLike, rank: int | None) -> ComplexArray:
    u, sigma, v = np.linalg.svd(np.asarray(matrices, dtype=complex), full_matrices=False)
    most = sigma.shape[1]
    if rank is not None and not 1 <= rank <= most:
        raise FbsError(f"rank = {rank}: must be between 1 and {most}")
    kept = slice(most if rank is None else rank)
    small = ~(sigma[:, kept] > SPAN * sigma[:, :1])
    if small.any():
        raise FbsError(
            f"{int(small.any(axis=1).sum())} lines have fewer than {small.shape[1]} independent "
            "measured DoFs; give a rank"
        )
    inverse: ComplexArray = np.einsum(
        "kre,kr,kcr->kec", v[:, kept].conj(), 1.0 / sigma[:, kept], u[:, :, kept].conj()
    )
    return inverse
