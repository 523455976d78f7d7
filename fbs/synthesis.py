"""FRFs of a system by the method that costs least, and which one that was."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from types import MappingProxyType

from numpy.typing import ArrayLike

from ._kernels.checks import FloatArray, ascending_frequency
from ._kernels.door import door
from .damped_modes import complex_modes, is_proportional, modal_damping
from .errors import (
    DefectiveModesError,
    FbsError,
    IndefiniteMassError,
    IndefiniteStiffnessError,
)
from .frf import Frf, Quantity
from .modal_synthesis import modal_frf
from .schur_form import schur_frf
from .second_order_system import SecondOrderSystem, direct_frf
from .undamped_modes import RealModes, real_modes


class Method(StrEnum):
    """How an FRF is made."""

    DIRECT = "direct"
    MODAL = "modal"
    COMPLEX_MODES = "complex modes"
    SCHUR = "schur"


class MethodError(FbsError):
    """The method asked for does not apply to the system."""


@dataclass(frozen=True, eq=False)
class Synthesis:
    """What `synthesize` returns.

    Parameters
    ----------
    frf : Frf
    method : Method
        The one that was used.
    reason : str
        Why: its cost against the next, and which cheaper ones did not apply.
    costs : mapping of Method to float
        Real floating-point operations of each.
    refused : mapping of Method to str
        Why a cheaper method did not apply.
    """

    frf: Frf
    method: Method
    reason: str
    costs: Mapping[Method, float]
    refused: Mapping[Method, str]


@door
def synthesize(
    system: SecondOrderSystem,
    frequency: ArrayLike,
    responses: Iterable[str] | None = None,
    excitations: Iterable[str] | None = None,
    quantity: Quantity | str = Quantity.RECEPTANCE,
    method: Method | str | None = None,
) -> Synthesis:
    """Compute H(w) = (K (1 + j eta) - w^2 M + jwC)^-1 by the method of least `costs` that applies.

    ============= ================================================ ==============================
    method        per line                                         the system must have
    ============= ================================================ ==============================
    direct        LU of the dynamic stiffness, the columns asked   nothing
    modal         sum over real modes                              M > 0, K >= 0 symmetric and
                                                                   Phi^T C Phi diagonal
    complex modes sum over pairs of complex modes                  M > 0, K >= 0 symmetric, modes
                                                                   that span the state
    schur         back-substitution in a triangular state matrix   M > 0, K >= 0 symmetric
    ============= ================================================ ==============================

    All are exact to round-off of the largest FRFs of a line. Far below those (a transfer through
    many stages) a sum of modes is its own round-off, and only `direct` has correct digits.

    Parameters
    ----------
    system : SecondOrderSystem
    frequency : array, shape (nf,), Hz
    responses, excitations : labels, optional
        Default: all of `system.labels`.
    quantity : Quantity
    method : Method, optional
        This one and no other.

    Raises
    ------
    MethodError
        `method` is unknown, or does not apply to the system.
    SingularLineError, UnknownDofError, FbsError
    """
    axis = ascending_frequency(frequency)
    rows = system.labels if responses is None else tuple(responses)
    columns = system.labels if excitations is None else tuple(excitations)
    counts = costs(system, axis.size, rows, columns)
    order = sorted(counts, key=lambda one: counts[one])
    candidates = order if method is None else [_known(method)]
    attempt = _Attempt(system, axis, rows, columns, quantity)
    refused: dict[Method, str] = {}
    for candidate in candidates:  # the direct solution has no requirement: one of them succeeds
        try:
            frf = attempt.by(candidate)
            break
        except _DOES_NOT_APPLY as error:
            if method is not None:
                raise MethodError(f"method {candidate.value!r} does not apply: {error}") from error
            refused[candidate] = str(error)
    reason = "asked for" if method is not None else _reason(candidate, order, counts, refused)
    return Synthesis(frf, candidate, reason, MappingProxyType(counts), MappingProxyType(refused))


def costs(
    system: SecondOrderSystem,
    n_lines: int,
    responses: tuple[str, ...],
    excitations: tuple[str, ...],
) -> dict[Method, float]:
    """Count the real floating-point operations of every method, those that do not apply included.

    With n coordinates, N = 2 n states, r responses, e excitations, m = min(r, e), p FRFs to sum
    (r e, or half of them where responses and excitations are the same) and L lines; a complex
    multiplication with addition is 8:

    - direct: L (2/3 n^3 + 2 n^2 m), times 4 where the system is damped;
    - modal: 30 n^3 + L n (15 + 4 p): Jacobi sweeps once; gains, and real times complex weights;
    - complex modes: that, 25 N^3 for the eigenvectors (Golub & Van Loan 2013, Matrix Computations,
      sec. 7.5), 8 N^3 for their inverse, and two terms per pair: L n (25 + 8 p);
    - schur: 30 n^3 + 100 N^3 (complex QR, ibid.) + 8 L N m (N / 2 + max(r, e)).

    Counts are not seconds: a matrix product runs several times as fast as small LU factors, which
    favours the sums further. Where counts differ by less than 3, so may the seconds either way.
    """
    n, r, e = len(system.dofs), len(responses), len(excitations)
    states, fewer = 2 * n, min(r, e)
    sums = r * (r + 1) / 2 if responses == excitations else r * e
    real = 1 if system.undamped else 4
    basis = 30.0 * n**3
    return {
        Method.DIRECT: n_lines * real * (2 / 3 * n**3 + 2.0 * n**2 * fewer),
        Method.MODAL: basis + n_lines * n * (15 + 4 * sums),
        Method.COMPLEX_MODES: basis + 33.0 * states**3 + n_lines * n * (25 + 8 * sums),
        Method.SCHUR: basis
        + 100.0 * states**3
        + 8.0 * n_lines * states * fewer * (states / 2 + max(r, e)),
    }


def _known(method: Method | str) -> Method:
    try:
        return Method(method)
    except ValueError:
        raise MethodError(f"method {method!r} is none of {', '.join(Method)}") from None


@dataclass(frozen=True, eq=False)
class _Attempt:
    """What is asked of a system, by any method; its real modes are found once, if needed."""

    system: SecondOrderSystem
    axis: FloatArray
    responses: tuple[str, ...]
    excitations: tuple[str, ...]
    quantity: Quantity | str

    @cached_property
    def real(self) -> RealModes:
        return real_modes(self.system)

    def by(self, method: Method) -> Frf:
        """Raise one of `_DOES_NOT_APPLY` where the method does not."""
        asked = (self.system, self.axis, self.responses, self.excitations, self.quantity)
        if method is Method.DIRECT:
            return direct_frf(*asked)
        if method is Method.SCHUR:
            return schur_frf(*asked, self.real)
        if method is Method.COMPLEX_MODES:
            return modal_frf(*asked, complex_modes(self.system, self.real))
        if not is_proportional(modal_damping(self.real, self.system.damping)):
            raise MethodError("the damping is not proportional, Phi^T C Phi is not diagonal")
        return modal_frf(*asked, self.real)


_DOES_NOT_APPLY = (
    MethodError,
    DefectiveModesError,
    IndefiniteMassError,
    IndefiniteStiffnessError,
)


def _reason(
    chosen: Method,
    order: list[Method],
    counts: Mapping[Method, float],
    refused: Mapping[Method, str],
) -> str:
    """Say what it costs, what the next would have cost, and why cheaper ones were not used."""
    parts = [f"{counts[chosen]:.2g} operations"]
    later = order[order.index(chosen) + 1 :]
    if later:
        parts.append(f"{later[0]} would take {counts[later[0]] / counts[chosen]:.2g} times as many")
    parts.extend(f"{method} does not apply ({why})" for method, why in refused.items())
    return "; ".join(parts)
