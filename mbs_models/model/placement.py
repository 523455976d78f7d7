"""Which way a part faces, and the frame it stands in.

Coupled bodies share an axis and turn the same way. A wheel turns against its pinion, so that the
part behind it may have to be seen from the other side. Every part's first transverse direction (the
line of action y of a parallel stage, u of a planetary one) is the global y axis, whatever it faces:
translations of coupled bodies are then along common axes.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..stages.geometry import DIRECTIONS, Frame, Vector
from ..stages.part import Member, Part
from .couplings import Coupling
from .parameters import Drivetrain


def facings(drivetrain: Drivetrain) -> dict[str, float]:
    """Side each part is seen from (±1), so that coupled bodies turn the same way.

    Parts are taken in order; a coupling that closes a loop and cannot be satisfied (three external
    gears in a ring) turns its second body against w: `turnings` says so.
    """
    members = drivetrain.members
    found: dict[str, float] = {}
    for part in drivetrain.parts:
        if part.name not in found:
            found[part.name] = 1.0
            _face_neighbours(drivetrain, members, part.name, found)
    return found


def _face_neighbours(
    drivetrain: Drivetrain, members: Mapping[str, Member], placed: str, found: dict[str, float]
) -> None:
    for here, there in neighbours(drivetrain, placed):
        name = there.partition(".")[0]
        if name not in found:
            found[name] = found[placed] * members[here].sense * members[there].sense
            _face_neighbours(drivetrain, members, name, found)


def turnings(drivetrain: Drivetrain) -> dict[str, float]:
    """Sign of positive w of every body against global counter-clockwise rotation."""
    facing = facings(drivetrain)
    return {
        body: facing[body.partition(".")[0]] * member.sense
        for body, member in drivetrain.members.items()
    }


def hub_ratios(drivetrain: Drivetrain) -> dict[tuple[str, str], float]:
    """(coupling, body at an end of it) → w of its hub where that turns as the body, per w of it.

    r_hub/r_body; negative only in a loop that no orientation of its parts can satisfy.
    """
    turning = turnings(drivetrain)
    return {
        (coupling.name, body): turning[coupling.first]
        * turning[body]
        * (coupling.radius / drivetrain.radius(body))
        for coupling in drivetrain.couplings
        for body in (coupling.first, coupling.second)
    }


def place_parts(drivetrain: Drivetrain) -> dict[str, Frame]:
    """Where each part stands, starting from the first: coupled bodies coaxial, turning alike."""
    facing = facings(drivetrain)
    frames: dict[str, Frame] = {}
    for part in drivetrain.parts:
        if part.name not in frames:
            frames[part.name] = Frame(axes=axes_facing(part, facing[part.name]))
            _place_neighbours(drivetrain, part.name, facing, frames)
    return frames


def _place_neighbours(
    drivetrain: Drivetrain, placed: str, facing: dict[str, float], frames: dict[str, Frame]
) -> None:
    for here, there in neighbours(drivetrain, placed):
        name = there.partition(".")[0]
        if name not in frames:
            axes = axes_facing(drivetrain.part(name), facing[name])
            axis = frames[placed].point(drivetrain.member(here).centre)
            frames[name] = Frame(axis - axes @ drivetrain.member(there).centre, axes)
            _place_neighbours(drivetrain, name, facing, frames)


def axes_facing(part: Part, facing: float) -> Vector:
    """Axes of a part whose first transverse direction is the global y axis."""
    y, z = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, facing])
    if DIRECTIONS[part.axes[0]] == DIRECTIONS["y"]:
        return np.column_stack([y, np.cross(z, y), z])
    return np.column_stack([np.cross(y, z), y, z])


def neighbours(drivetrain: Drivetrain, name: str) -> list[tuple[str, str]]:
    """(own body, other body) of every coupling of a part."""
    pairs = []
    for coupling in drivetrain.couplings:
        for here, there in (
            (coupling.first, coupling.second),
            (coupling.second, coupling.first),
        ):
            if here.partition(".")[0] == name:
                pairs.append((here, there))
    return pairs


def rigid_end(coupling: Coupling) -> tuple[str, float | str]:
    """The end at which a massless hub is cut: the (first) rigid one."""
    return next(end for end in coupling.ends if end[1] == "rigid")


def translation_ends(
    drivetrain: Drivetrain, coupling: Coupling, dof: str
) -> tuple[str, str, float]:
    """The two DoFs that a coupled translation joins, and the sign of the second along the first.

    The first transverse direction is everybody's; the others turn with the side a part faces.
    """
    direction = DIRECTIONS[dof]
    first, second = (
        f"{body}.{drivetrain.member(body).translations[direction]}"
        for body in (coupling.first, coupling.second)
    )
    if direction == DIRECTIONS["u"]:
        return first, second, 1.0
    facing = facings(drivetrain)
    sides = [facing[body.partition(".")[0]] for body in (coupling.first, coupling.second)]
    return first, second, sides[0] * sides[1]
