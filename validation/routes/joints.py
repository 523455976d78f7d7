"""What joins the parts of a drivetrain once it is split at its couplings."""

from __future__ import annotations

from fbs import Joint
from mbs_models.model.parameters import Coupling, Drivetrain
from mbs_models.model.placement import hub_ratios, rigid_end, translation_ends


def coupling_joints(drivetrain: Drivetrain, coupling: Coupling) -> tuple[Joint, ...]:
    """What joins the two parts of a coupling once they are split.

    A hub's halves are made one again at ``<coupling>.w``; a massless hub is its spring; coupled
    translations are their springs.
    """
    hub = shaft_joint(drivetrain, coupling) if coupling.massless else hub_joint(coupling)
    moves = (translation_joint(drivetrain, coupling, dof) for dof in coupling.dofs)
    return tuple(joint for joint in (hub, *moves) if joint is not None)


def hub_joint(coupling: Coupling) -> Joint:
    """The two halves of a hub made one again: ``<coupling>.w`` of both parts."""
    first, second = (body.partition(".")[0] for body in (coupling.first, coupling.second))
    return Joint((first, f"{coupling.name}.w"), (second, f"{coupling.name}.w"))


def shaft_joint(drivetrain: Drivetrain, coupling: Coupling) -> Joint | None:
    """The spring of a massless hub, from its rigid end's r·θ to the other body's w."""
    near = rigid_end(coupling)
    far, stiffness = next(end for end in coupling.ends if end != near)
    if stiffness == 0.0:
        return None
    ratio = hub_ratios(drivetrain)[coupling.name, far]
    return _joint(
        drivetrain, (near[0].partition(".")[0], f"{coupling.name}.w"), f"{far}.w", ratio, stiffness
    )


def translation_joint(drivetrain: Drivetrain, coupling: Coupling, dof: str) -> Joint | None:
    """The spring of a coupled translation."""
    first, second, sign = translation_ends(drivetrain, coupling, dof)
    spring = coupling.dofs[dof]  # type: ignore[index]  # the keys are those literals
    end = (first.partition(".")[0], first)
    return _joint(drivetrain, end, second, sign, spring.stiffness, spring.damping)


def _joint(
    drivetrain: Drivetrain,
    first: tuple[str, str],
    second: str,
    ratio: float,
    stiffness: float | str,
    damping: float | None = None,
) -> Joint | None:
    end = (second.partition(".")[0], second)
    if isinstance(stiffness, str):
        return Joint(first, end, ratio=ratio)
    own = drivetrain.damping.stiffness_proportional * stiffness
    damper = own if damping is None else damping
    if stiffness == 0.0 and damper == 0.0:
        return None
    return Joint(first, end, stiffness, damper, ratio)
