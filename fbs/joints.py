"""What joins two substructures: rigid and flexible joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ._kernels.checks import ComplexArray, FloatArray, scalar
from .errors import FbsError, JointError

Node = tuple[str, str]


@dataclass(frozen=True)
class Joint:
    """f = (k + jwc) (n u_second - u_first), acting on `first`; k = None: u_first = n u_second.

    Parameters
    ----------
    first, second : (substructure name, DoF label)
    stiffness : float or None
        N/m; None is a rigid joint. May be negative (a stiffness taken away).
    damping : float
        N s/m, of a flexible joint.
    ratio : float
        n, where the two coordinates are not measured alike: on other radii, or against each other.

    Raises
    ------
    JointError
        Neither stiffness nor damping, not finite, or both ends the same.
    """

    first: Node
    second: Node
    stiffness: float | None = None
    damping: float = 0.0
    ratio: float = 1.0

    def __post_init__(self) -> None:
        for end in (self.first, self.second):
            if not (
                isinstance(end, tuple) and len(end) == 2 and all(isinstance(e, str) for e in end)
            ):
                raise JointError(f"a joint's end is (substructure, DoF label), got {end!r}")
        if self.first == self.second:
            raise JointError(f"{self}: both ends are the same")
        for name in ("ratio", "damping", *(() if self.rigid else ("stiffness",))):
            try:
                object.__setattr__(self, name, scalar(getattr(self, name), f"the {name}"))
            except FbsError as error:
                raise JointError(f"{self}: {error}; a stiffness of None is rigid") from None
        if self.ratio == 0:
            raise JointError(f"{self}: the ratio must be finite and not 0, got {self.ratio}")
        if self.rigid:
            if self.damping != 0:
                raise JointError(f"{self}: a rigid joint (stiffness None) takes no damping")
        elif self.stiffness == 0 and self.damping == 0:
            raise JointError(f"{self}: no stiffness and no damping joins nothing; leave it out")

    @property
    def rigid(self) -> bool:
        """Whether both ends move as one."""
        return self.stiffness is None

    def dynamic_stiffness(self, omega: FloatArray) -> ComplexArray:
        """Return Z = k + jwc, shape (nf,), N/m; a rigid joint has none."""
        if self.stiffness is None:
            raise JointError(f"{self} is rigid")
        return np.asarray(self.stiffness + 1j * omega * self.damping)

    def __str__(self) -> str:
        return f"joint {'.'.join(self.first)} - {'.'.join(self.second)}"


def ends_of(name: str, joints: Sequence[Joint]) -> list[tuple[int, str, float]]:
    """Return (joint, label, entry of B) of a substructure: +1 first, -ratio second."""
    return [
        (k, label, sign)
        for k, joint in enumerate(joints)
        for (owner, label), sign in ((joint.first, 1.0), (joint.second, -joint.ratio))
        if owner == name
    ]
