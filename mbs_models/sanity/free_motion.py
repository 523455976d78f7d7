"""What nothing holds: bodies without bearings, members that turn freely, inputs that cannot turn.

The motions R that strain no spring (`orders.free_motions`) say it of the whole drivetrain. Parts
joined by torque should have one free rotation, or none where a support holds them: with two they
are a differential, and one speed does not tell the others.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..gears.orders import STANDS_STILL, free_motions, speeds
from ..model.parameters import Drivetrain
from ..stages.given_springs import SpringKind
from ..stages.part import Part, Role
from ..system.components import Components
from .finding import Finding
from .stiffnesses import RANGES

FloatArray = NDArray[np.float64]

MOVES = 1e-6  # of a free motion of norm 1: beyond round-off of its singular vectors


def free_to_move(drivetrain: Drivetrain, parts: Components) -> Iterator[Finding]:
    """Bearings of 0 N/m whose body nothing else holds, or else stages that pass no torque."""
    free = free_motions(parts)
    loose = tuple(_without_bearing(drivetrain, parts, free))
    yield from loose
    if not loose:  # what is loose sideways may let its gear turn as well
        for group in drivetrain.groups():
            yield from _differentials(drivetrain, parts, free, group)


def input_turns(drivetrain: Drivetrain, parts: Components) -> Iterator[Finding]:
    """An input or output of ``[operation]`` that stands still, or turns by itself alone."""
    operation = drivetrain.operation
    if operation is None:
        return
    driven = operation.input
    ratio = speeds(parts, driven)
    turning = [body for body in drivetrain.bodies if abs(ratio.get(body, 0.0)) > STANDS_STILL]
    if not ratio:
        others = _that_turn(drivetrain, parts)
        reason = f"cannot turn, a torsional support holds it; expected {others}"
        yield Finding("operation", "input", repr(driven), reason)
    elif any(map(_lacks_a_mesh, drivetrain.stages)):
        return  # that is the finding
    elif turning == [driven] and len(drivetrain.bodies) > 1:
        reason = "turns nothing but itself; expected a body that is geared or coupled to others"
        yield Finding("operation", "input", repr(driven), reason)
    elif operation.output is not None and operation.output not in turning:
        others = ", ".join(body for body in turning if body != driven)
        reason = f"does not turn with the input; expected one of {others}"
        yield Finding("operation", "output", repr(operation.output), reason)


def count_free_rotations(drivetrain: Drivetrain, parts: Components, group: frozenset[str]) -> int:
    """Independent free motions that turn bodies of a group of parts."""
    return _rotations(drivetrain, parts, free_motions(parts), group)


def _rotations(
    drivetrain: Drivetrain, parts: Components, free: FloatArray, group: frozenset[str]
) -> int:
    hubs = {c.name for c in drivetrain.couplings if c.first.partition(".")[0] in group}
    rows = [
        row
        for row, label in zip(free, parts.dofs, strict=True)
        if label.endswith(".w") and label.partition(".")[0] in group | hubs
    ]
    return int(np.linalg.matrix_rank(np.array(rows), tol=MOVES)) if free.size and rows else 0


def _without_bearing(
    drivetrain: Drivetrain, parts: Components, free: FloatArray
) -> Iterator[Finding]:
    moves = {
        label
        for label, row in zip(parts.dofs, free, strict=True)
        if np.linalg.norm(row) > MOVES and not label.endswith(".w")
    }
    for part in drivetrain.stages:
        for spring in part.given_springs():
            free_dofs = [dof for dof in spring.holds if f"{part.name}.{dof}" in moves]
            if spring.value == 0.0 and free_dofs:
                low, high = RANGES[spring.kind]
                reason = (
                    f"nothing holds {', '.join(free_dofs)}; expected {low:.1e} to {high:.1e} N/m"
                )
                yield Finding(part.name, spring.key, spring.written, reason)


def _differentials(
    drivetrain: Drivetrain, parts: Components, free: FloatArray, group: frozenset[str]
) -> Iterator[Finding]:
    count = _rotations(drivetrain, parts, free, group)
    if count < 2:
        return
    stages = [stage for stage in drivetrain.stages if stage.name in group]
    if any(_lacks_a_mesh(stage) for stage in stages):
        return  # that is the finding
    found = [finding for stage in stages for finding in _loose_members(drivetrain, stage)]
    yield from found
    if not found:
        names = ", ".join(sorted(group))
        reason = "expected 1: a differential, one speed does not tell the others"
        yield Finding(names, "free rotations", str(count), reason)


def _lacks_a_mesh(stage: Part) -> bool:
    return any(
        spring.kind is SpringKind.MESH and spring.value == 0.0 for spring in stage.given_springs()
    )


def _loose_members(drivetrain: Drivetrain, stage: Part) -> Iterator[Finding]:
    """Members that turn freely and carry no torque; the ring first, which is held as a rule."""
    operation = drivetrain.operation
    taken: set[str | None] = {operation.input, operation.output} if operation else set()
    for coupling in drivetrain.couplings:
        if coupling.transmits:
            taken |= {coupling.first, coupling.second}
    loose = {
        body: spring
        for spring in stage.given_springs()
        for body in (dof.removesuffix(".w") for dof in spring.holds)
        if spring.kind is SpringKind.TORSION
        and spring.value == 0.0
        and f"{stage.name}.{body}" not in taken
    }
    if loose:
        first, *others = sorted(loose, key=lambda body: (body != Role.RING, body))
        too = f" ({' and '.join(others)} too)" if others else ""
        low, high = RANGES[SpringKind.TORSION]
        reason = (
            f"the {first} turns freely{too}: no torque passes through the stage; expected it held "
            f"({low:.1e} to {high:.1e} N/m at its radius) or coupled"
        )
        unit = "N m/rad" if loose[first].key.endswith("stiffness") else "N/m"
        yield Finding(stage.name, loose[first].key, f"0 {unit}", reason)


def _that_turn(drivetrain: Drivetrain, parts: Components) -> str:
    turning = [body for body in drivetrain.bodies if speeds(parts, body)]
    return f"one of {', '.join(turning)}" if turning else "a drivetrain that turns: nothing does"
