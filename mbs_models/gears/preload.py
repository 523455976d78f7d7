"""Constant torque through a drivetrain: at the input, and its reaction at the output."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import ModelError
from ..model.parameters import Drivetrain
from ..stages.part import Part
from ..system.components import Components
from ..system.linearization import LinearizedSystem
from .orders import STANDS_STILL, free_motions, speeds

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Constant:
    """A force that does not change.

    Attributes
    ----------
    force
        N.
    """

    force: float

    @property
    def band(self) -> tuple[float, float]:
        """Nothing but 0 Hz."""
        return 0.0, 0.0

    @property
    def period(self) -> float | None:
        """None: it is not periodic."""
        return None

    @property
    def duration(self) -> float | None:
        """None: without end."""
        return None

    def values(self, time: FloatArray) -> FloatArray:
        """The force (N) at any instants (s)."""
        return np.full(np.shape(time), self.force)


def preload(
    drivetrain: Drivetrain,
    linear: LinearizedSystem,
    parts: Components,
    torque: float,
    output: str | None,
) -> tuple[FloatArray, str | None]:
    """Forces (n_dof,) N of an input torque and its reaction, and which body takes it.

    The reaction makes the two do no work on the drivetrain's free motion: moments in the inverse
    ratio of the speeds. None is needed where supports hold the input.

    Parameters
    ----------
    drivetrain, linear, parts
        The drivetrain, linearised and read back.
    torque
        N m at the input of ``[operation]``, along its positive w.
    output
        The body that takes the reaction (default: the other end of the drivetrain, if it is one).

    Raises
    ------
    ModelError
        The output is none, or does not turn with the input.
    """
    if torque == 0.0:
        return np.zeros(len(linear.dofs)), None
    assert drivetrain.operation is not None
    driven = drivetrain.operation.input
    free = free_motions(parts)
    at_input = _unit_torque(drivetrain, linear, driven)
    driven_work = free.T @ at_input
    if np.linalg.norm(driven_work) <= STANDS_STILL * np.linalg.norm(at_input):
        return torque * at_input, None  # supports hold the input
    taker = output or _other_end(drivetrain, parts)
    if taker not in drivetrain.bodies:
        raise ModelError(
            f"output = {taker!r}: not a body of this drivetrain; allowed: "
            f"{', '.join(drivetrain.bodies)}"
        )
    at_output = _unit_torque(drivetrain, linear, taker)
    taken_work = free.T @ at_output
    if np.linalg.norm(taken_work) <= STANDS_STILL * np.linalg.norm(driven_work):
        raise ModelError(f"output = {taker!r}: does not turn with the input: it takes no reaction")
    reaction = -float(taken_work @ driven_work) / float(taken_work @ taken_work)
    return torque * (at_input + reaction * at_output), taker


def _unit_torque(drivetrain: Drivetrain, linear: LinearizedSystem, body: str) -> FloatArray:
    """Generalised forces (n_dof,) of 1 N m on a body along its positive w: 1/r at its w."""
    label = f"{body}.w"
    leader, factor = linear.derived.get(label, (label, 1.0))
    unit = np.zeros(len(linear.dofs))
    unit[linear.dofs.index(leader)] = factor / drivetrain.radius(body)
    return unit


def _other_end(drivetrain: Drivetrain, parts: Components) -> str:
    """The one end of the chain, other than the input, that turns with it."""
    assert drivetrain.operation is not None
    driven = drivetrain.operation.input
    ratio = speeds(parts, driven)
    coupled = [end for coupling in drivetrain.couplings for end, _ in coupling.ends]
    ends = [
        body
        for body in drivetrain.bodies
        if body != driven
        and abs(ratio.get(body, 0.0)) > STANDS_STILL
        and coupled.count(body) <= _joints_of_an_end(drivetrain.part(body.partition(".")[0]))
    ]
    if len(ends) != 1:
        named = f"there are {len(ends)} ({', '.join(ends)})" if ends else "there is none"
        raise ModelError(
            f"operation: torque at {driven} needs a reaction at the other end of the drivetrain, "
            f"but {named}; give output, one of: "
            f"{', '.join(body for body in drivetrain.bodies if body != driven)}"
        )
    return ends[0]


def _joints_of_an_end(part: Part) -> int:
    """How many couplings a body may have where the drivetrain ends: a lone one hangs on one."""
    return 1 if len(part.bodies) == 1 else 0
