"""What a drivetrain is excited with: a signal at a DoF."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar

from .signals import Signal

S = TypeVar("S", bound=Signal, covariant=True)


@dataclass(frozen=True)
class Excitation(Generic[S]):
    """A force at a DoF.

    Attributes
    ----------
    dof
        Label of the DoF; the force is the one conjugate to it (rotations: torque / r), in N.
    signal
        The force over time.
    """

    dof: str
    signal: S
