"""What can go wrong, each with a name of its own; all are `ValueError`."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike


class FbsError(ValueError):
    """Base of every error this package raises on purpose."""


class AxisMismatchError(FbsError):
    """Two frequency axes, or two sets of labels, that should be the same are not."""


class UnknownDofError(FbsError):
    """A label was asked for that is not there."""


class AmbiguousDofError(FbsError):
    """One label stands for two different degrees of freedom."""


class QuantityMismatchError(FbsError):
    """Receptance, mobility and accelerance were mixed, or cannot be converted."""


class NonFiniteError(FbsError):
    """An array holds NaN or infinity."""


class JointError(FbsError):
    """A joint that joins nothing, or that repeats what other rigid joints already do."""


class IndefiniteStiffnessError(FbsError):
    """The stiffness matrix is not symmetric positive semi-definite."""


class IndefiniteMassError(FbsError):
    """The mass matrix is not symmetric positive definite."""


class DefectiveModesError(FbsError):
    """The complex modes do not span the state space (critical damping, or nearly so)."""


class SingularLineError(FbsError):
    """No finite FRF exists, or none that is more than round-off, at some lines.

    Attributes
    ----------
    frequencies : numpy.ndarray, shape (n,), Hz
        All the lines concerned.
    """

    def __init__(self, frequencies: ArrayLike, reason: str, remedy: str) -> None:
        self.frequencies = np.atleast_1d(np.asarray(frequencies, dtype=float))
        self.reason = reason
        self.remedy = remedy
        count = self.frequencies.size
        lines = f"{count} line{'s' if count != 1 else ''} ({first_few(self.frequencies)} Hz)"
        super().__init__(f"{reason} at {lines}; {remedy}")

    def __reduce__(self) -> tuple[type[SingularLineError], tuple[np.ndarray, str, str]]:
        return type(self), (self.frequencies, self.reason, self.remedy)


def first_few(values: Iterable[float], limit: int = 5) -> str:
    """Write the first `limit` numbers, and dots if there are more."""
    numbers = [f"{value:.10g}" for value in values]
    return ", ".join(numbers[:limit]) + (", ..." if len(numbers) > limit else "")


def unknown_dof(label: str, known: Sequence[str], where: str) -> UnknownDofError:
    """Build the error for an unknown label; it names the nearest known ones."""
    near = difflib.get_close_matches(label, known, n=3, cutoff=0.4)
    hint = f"did you mean {' or '.join(map(repr, near))}?" if near else _listing(known)
    return UnknownDofError(f"{where} has no degree of freedom {label!r}; {hint}")


def singular_dynamic_stiffness(frequencies: ArrayLike) -> SingularLineError:
    """Build the error for lines where Z = K (1 + j eta) - w^2 M + jwC has no inverse."""
    return SingularLineError(
        frequencies,
        "the dynamic stiffness K (1 + j eta) - w^2 M + jwC is singular to working precision",
        "these lines lie on undamped poles, or on 0 Hz of a system free to move: "
        "leave them out, shift the axis or add damping",
    )


def undamped_pole(frequencies: ArrayLike) -> SingularLineError:
    """Build the error for lines on a pole of a sum over modes."""
    return SingularLineError(
        frequencies,
        "an undamped mode, or rigid-body motion at 0 Hz, makes the FRF infinite",
        "leave these lines out, shift the axis or add damping",
    )


def singular_kernel(frequencies: ArrayLike, whose: str) -> SingularLineError:
    """Build the error for lines where a coupling's kernel has no inverse."""
    return SingularLineError(
        frequencies,
        f"the {whose}'s kernel B Y B^T + 1/Z is singular to working precision",
        "these lines lie on undamped poles of the assembly, or the joints tie the same motion "
        "twice: leave the lines out, add damping or drop a joint",
    )


def lost_digits(frequencies: ArrayLike, parts: Iterable[str]) -> SingularLineError:
    """Build the error for lines where a difference of parts' FRFs keeps no digit."""
    return SingularLineError(
        frequencies,
        f"the joints hold {' or '.join(map(repr, parts))} so much that nothing but round-off is "
        "left of the difference between its FRFs and what the joints take from them",
        "leave these lines out, or let the part's FRFs be made from its system (direct_frf, "
        "synthesize): its dynamic stiffness keeps the digits",
    )


def _listing(known: Sequence[str]) -> str:
    shown = ", ".join(known[:8]) + (", ..." if len(known) > 8 else "")
    return f"it has {shown or 'none'}"
