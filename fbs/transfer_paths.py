"""Transfer path analysis: the forces that describe a source, and what each path adds at a receiver.

All of them solve one equation by least squares, Y f = u, line by line (van der Seijs, de Klerk &
Rixen 2016, Mech. Syst. Signal Process. 68–69, 217):

===================  =================================  =========================================
forces               Y                                  u
===================  =================================  =========================================
blocked, in situ     assembly: indicators ← interface   running, at indicators behind the interface
blocked, free        source alone: interface ←          running freely hung: free velocities
                     interface
contact              receiver alone: indicators ←       running, at indicators of the receiver
(matrix inversion)   interface
pseudo               assembly: indicators ← anywhere    running, at indicators behind the interface
                     on the source
===================  =================================  =========================================

Blocked forces belong to the source alone: what it is joined to does not change them (Moorhouse,
Elliott & Evans 2009, J. Sound Vib. 325, 849), so that they foretell the motion in another assembly,
u = Y' f. Operational analysis needs no FRFs: the transmissibility T = S_ui S_ii⁺ from running
spectra alone, whose paths are what was measured at the references and not forces.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ._kernels.checks import ComplexArray, FloatArray, read_only, unique_labels
from ._kernels.door import door
from .axes import require_same_frequency
from .errors import FbsError, NonFiniteError, SingularLineError
from .frf import Frf

EPS = float(np.finfo(float).eps)


@dataclass(frozen=True, eq=False)
class Spectra:
    """Complex amplitudes (nf, n) of labelled motions or forces on the lines `frequency` (Hz)."""

    frequency: FloatArray
    values: ComplexArray
    labels: tuple[str, ...]

    if TYPE_CHECKING:  # what `__post_init__` converts, said to type checkers

        def __init__(
            self, frequency: ArrayLike, values: ArrayLike, labels: Iterable[str]
        ) -> None: ...

    def __post_init__(self) -> None:
        labels = unique_labels(self.labels, "the spectra's labels")
        frequency = np.array(self.frequency, dtype=float)
        values = np.array(self.values, dtype=complex)
        if values.shape != (frequency.size, len(labels)):
            raise FbsError(
                f"spectra have shape {values.shape}, must be {(frequency.size, len(labels))}"
            )
        if not (np.isfinite(values).all() and np.isfinite(frequency).all()):
            raise NonFiniteError("the spectra hold NaN or infinity")
        for name, value in (
            ("frequency", read_only(frequency)),
            ("values", read_only(values)),
            ("labels", labels),
        ):
            object.__setattr__(self, name, value)


@dataclass(frozen=True, eq=False)
class SourceForces:
    """Forces found from motions.

    Attributes
    ----------
    spectra
        (nf, n_force).
    condition
        (nf,) of the inverse: how many times larger a relative error of the data is in the forces.
    left
        (nf,) ‖Y f − u‖/‖u‖: what no forces there explain; 0 where there are as many as motions.
    """

    spectra: Spectra
    condition: FloatArray
    left: FloatArray


@door
def source_forces(frf: Frf, motions: Spectra) -> SourceForces:
    """f of Y f = u by least squares: blocked, contact or pseudo-forces, as Y and u are; see above.

    Parameters
    ----------
    frf
        Responses: the motions' labels (others are left aside); excitations: where the forces act.
    motions
        At least as many as forces; displacements with receptances, and so on.

    Raises
    ------
    FbsError, AxisMismatchError, UnknownDofError
        Fewer motions than forces, or what does not fit.
    SingularLineError
        The motions do not tell the forces apart on a line.
    """
    require_same_frequency(
        frf.frequency, motions.frequency, "the FRFs' and the spectra's axes differ"
    )
    y = frf.select(motions.labels).values
    if y.shape[1] < y.shape[2]:
        raise FbsError(f"{y.shape[1]} motions for {y.shape[2]} forces: at least as many are needed")
    u, sigma, v = np.linalg.svd(y, full_matrices=False)
    with np.errstate(divide="ignore"):
        condition = sigma[:, 0] / sigma[:, -1]
    singular = ~(condition <= 1.0 / (10.0 * EPS))
    if singular.any():
        raise SingularLineError(
            frf.frequency[singular],
            "the motions do not tell the forces apart",
            "leave these lines out, or take other or more motions",
        )
    along = np.einsum("kmr,km->kr", u.conj(), motions.values) / sigma
    forces = np.einsum("krf,kr->kf", v.conj(), along)
    rest = np.einsum("kmf,kf->km", y, forces) - motions.values
    left = np.linalg.norm(rest, axis=1) / np.linalg.norm(motions.values, axis=1)
    return SourceForces(Spectra(frf.frequency, forces, frf.excitations), condition, left)


def foretold(frf: Frf, forces: Spectra) -> Spectra:
    """u = Y f: what the forces make in an assembly, at all its responses.

    Raises
    ------
    AxisMismatchError, UnknownDofError
    """
    paths = path_contributions(frf, forces)
    total = np.sum(list(paths.values()), axis=0)
    return Spectra(frf.frequency, total, frf.responses)


@door
def path_contributions(frf: Frf, forces: Spectra) -> dict[str, ComplexArray]:
    """Force → Y_·f f, (nf, n_response): what each path adds; the sum is what is heard.

    Raises
    ------
    AxisMismatchError, UnknownDofError
    """
    require_same_frequency(frf.frequency, forces.frequency, "the FRFs' and the forces' axes differ")
    y = frf.select(None, forces.labels).values
    return {
        label: y[:, :, place] * forces.values[:, place, None]
        for place, label in enumerate(forces.labels)
    }


def ranked(paths: Mapping[str, ComplexArray]) -> dict[str, FloatArray]:
    """Path → (n_response,) root sum square over the lines, the first response's largest first."""
    sizes = {name: np.asarray(np.linalg.norm(part, axis=0)) for name, part in paths.items()}
    return dict(sorted(sizes.items(), key=lambda item: -float(item[1][0])))


@door
def transmissibility(
    references: ArrayLike, responses: ArrayLike, rank: int | None = None
) -> ComplexArray:
    """T = U A⁺ of running spectra in many conditions, (nf, n_response, n_reference).

    Parameters
    ----------
    references, responses
        (nf, n, n_condition): at least as many conditions as references.
    rank
        Singular values kept of the references (principal components); default: all.

    Raises
    ------
    FbsError
        Too few conditions, or a rank that is none.
    """
    a, u = np.asarray(references, dtype=complex), np.asarray(responses, dtype=complex)
    if a.ndim != 3 or u.ndim != 3 or a.shape[::2] != u.shape[::2]:
        raise FbsError(f"spectra of shapes {a.shape} and {u.shape} are not of the same conditions")
    most = a.shape[1]
    if a.shape[2] < most:
        raise FbsError(
            f"{a.shape[2]} conditions for {most} references: at least as many are needed"
        )
    if rank is not None and not 1 <= rank <= most:
        raise FbsError(f"rank = {rank}: must be between 1 and {most}")
    left, sigma, right = np.linalg.svd(a, full_matrices=False)
    kept = slice(rank)
    inverse = np.einsum(
        "krc,kr,kir->kci", right[:, kept].conj(), 1.0 / sigma[:, kept], left[:, :, kept].conj()
    )
    found: ComplexArray = u @ inverse
    return found
