"""Which way a part faces, and the frame it stands in.

Coupled bodies share an axis and turn the same way. A wheel turns against its pinion, so that the
part behind it may have to be seen from the other side. Every part's first transverse direction (the
line of action y of a parallel stage, u of a planetary one) is the global y axis, whatever it faces:
translations of coupled bodies are then along common axes.
"""

from __future__ import annotations

import numpy as np

from ..stages.geometry import DIRECTIONS, Frame, Vector
from ..stages.part import Part
from .couplings import Coupling
from .graph import walk
from .parameters import Drivetrain


def place_parts(drivetrain: Drivetrain) -> dict[str, Frame]:
    """Where each part stands, starting from the first: coupled bodies coaxial, turning alike."""
    members = drivetrain.members
    frames: dict[str, Frame] = {}
    for _, here, there in walk(drivetrain.facing, drivetrain.couplings):
        name = there.partition(".")[0]
        if name in frames:
            continue  # closes a loop
        axes = axes_facing(drivetrain.part(name), drivetrain.facing[name])
        frames[name] = Frame(axes=axes)
        if here:
            axis = frames[here.partition(".")[0]].point(members[here].centre)
            frames[name] = Frame(axis - axes @ members[there].centre, axes)
    return frames


def turnings(drivetrain: Drivetrain) -> dict[str, float]:
    """Sign of positive w of every body against global counter-clockwise rotation."""
    return {
        body: drivetrain.facing[body.partition(".")[0]] * member.sense
        for body, member in drivetrain.members.items()
    }


def hub_ratios(drivetrain: Drivetrain) -> dict[tuple[str, str], float]:
    """(coupling, body at an end of it) → w of its hub where that turns as the body, per w of it.

    r_hub/r_body; negative only in a loop that no orientation of its parts can satisfy.
    """
    turning, members = turnings(drivetrain), drivetrain.members
    return {
        (coupling.name, body): turning[coupling.first]
        * turning[body]
        * (coupling.radius / members[body].radius)
        for coupling in drivetrain.couplings
        for body in coupling.bodies
    }


def axes_facing(part: Part, facing: float) -> Vector:
    """Axes of a part whose first transverse direction is the global y axis."""
    y, z = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, facing])
    if DIRECTIONS[part.axes[0]] == DIRECTIONS["y"]:
        return np.column_stack([y, np.cross(z, y), z])
    return np.column_stack([np.cross(y, z), y, z])


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
        f"{body}.{drivetrain.member(body).translations[direction]}" for body in coupling.bodies
    )
    if direction == DIRECTIONS["u"]:
        return first, second, 1.0
    sides = [drivetrain.facing[body.partition(".")[0]] for body in coupling.bodies]
    return first, second, sides[0] * sides[1]
