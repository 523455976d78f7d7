"""The routes to an FRF, side by side.

What differs between them is where M, C, K come from (exudyn, or the paper's equations), whether
the whole is solved or its stages are coupled, and how an FRF is made (solved line by line, or
summed over modes).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fbs import (
    CoupledFrf,
    Frf,
    Joint,
    SecondOrderSystem,
    couple,
    couple_chain,
    direct_frf,
    modal_frf,
)
from mbs_models.model.parameters import Coupling, Drivetrain
from mbs_models.model.placement import hub_ratios, rigid_end, translation_ends

from ..errors import CommandError
from . import equations

if TYPE_CHECKING:
    from mbs_models.gears.operating_point import OperatingPoint

FloatArray = NDArray[np.float64]
Synthesis = Callable[[SecondOrderSystem, FloatArray], Frf]


@dataclass(frozen=True)
class Source:
    """Where M, C, K come from: the whole drivetrain's, and a stage's with its halves of the hubs.

    ``synthesis`` makes the FRF of the source's whole system.
    """

    name: str
    whole: Callable[[Drivetrain], SecondOrderSystem]
    stage: Callable[[Drivetrain, str], SecondOrderSystem]
    synthesis: Synthesis = direct_frf


def exudyn_source() -> Source:
    """exudyn's linearised multibody systems."""
    from . import multibody  # exudyn takes its time to load: only when it is used

    return Source("exudyn", multibody.drivetrain_system, multibody.stage_system, multibody.frf)


def loaded_source(point: OperatingPoint) -> Source:
    """exudyn's systems, linearised where an operating point's torque has moved them."""
    from mbs_models.gears.operating_point import linearized_part

    from .multibody import as_second_order

    return Source(
        "exudyn under load",
        lambda _: as_second_order(point.linear),
        lambda drivetrain, name: as_second_order(linearized_part(drivetrain, name, point)),
    )


EQUATIONS = Source("equations", equations.drivetrain_system, equations.stage_system)


@dataclass(frozen=True)
class Model:
    """One source's matrices of a drivetrain: whole, and by stage."""

    source: str
    whole: SecondOrderSystem
    stages: Mapping[str, SecondOrderSystem]
    joints: tuple[Joint, ...]


def build_model(source: Source, drivetrain: Drivetrain) -> Model:
    """Build a source's systems of a drivetrain."""
    return Model(
        source=source.name,
        whole=source.whole(drivetrain),
        stages={part.name: source.stage(drivetrain, part.name) for part in drivetrain.parts},
        joints=tuple(j for c in drivetrain.couplings for j in coupling_joints(drivetrain, c)),
    )


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


MODAL = ", modal synthesis"


@dataclass(frozen=True)
class Route:
    """A way from a model to the FRFs of the whole."""

    name: str
    frf: Callable[[FloatArray], Frf]
    modal: bool = False  # summed over modes, not solved line by line


def whole_route(model: Model, synthesis: Synthesis = direct_frf) -> Route:
    """The whole system's own FRF."""
    modal = synthesis is modal_frf
    name = model.source + (MODAL if modal else "")
    return Route(name, lambda frequency: synthesis(model.whole, frequency), modal)


def fbs_route(model: Model, synthesis: Synthesis = direct_frf) -> Route:
    """FBS: the stages' FRFs, coupled at the hubs."""
    modal = synthesis is modal_frf
    name = f"FBS of {model.source} stages" + (MODAL if modal else "")
    return Route(name, lambda frequency: couple_stages(model, frequency, synthesis).frf, modal)


def couple_stages(
    model: Model, frequency: FloatArray, synthesis: Synthesis = direct_frf
) -> CoupledFrf:
    """The stages' FRFs, coupled at the hubs."""
    stages = {name: synthesis(system, frequency) for name, system in model.stages.items()}
    return couple(stages, model.joints)


def swapped_route(model: Model, files: Mapping[str, Frf]) -> Route:
    """FBS with some stages' FRFs from elsewhere; its lines must be a stretch of theirs."""

    def frf(frequency: FloatArray) -> Frf:
        stages = {
            name: files[name].band(frequency[0], frequency[-1])
            if name in files
            else direct_frf(system, frequency)
            for name, system in model.stages.items()
        }
        return couple(stages, model.joints).frf

    return Route(f"FBS with {', '.join(files)} from file", frf)


def kernel_condition(model: Model, frequency: FloatArray) -> FloatArray:
    """Amplification of the stages' errors in the interface kernel, per line.

    Only the interface DoFs' FRFs are needed for it, not all that the stages have.
    """
    ends = [end for joint in model.joints for end in (joint.first, joint.second)]
    labels = {name: [label for part, label in ends if part == name] for name in model.stages}
    interface = {
        name: direct_frf(system, frequency, wanted, wanted)
        for name, system in model.stages.items()
        if (wanted := list(dict.fromkeys(labels[name])))
    }
    return couple(interface, model.joints).kernel_condition


def comparison_routes(exudyn: Model, equations_model: Model) -> tuple[Route, ...]:
    """Every route that is held against exudyn's whole system."""
    return (
        whole_route(equations_model),
        fbs_route(exudyn),
        fbs_route(equations_model),
        whole_route(exudyn, modal_frf),
        fbs_route(exudyn, modal_frf),
    )


def frf_by_name(
    drivetrain: Drivetrain,
    route: str,
    frequency: FloatArray,
    responses: Sequence[str] | None,
    excitations: Sequence[str] | None,
    stage: str | None = None,
) -> tuple[Frf, str]:
    """The FRFs of one route, by its name on the command line, and how they were made.

    Parameters
    ----------
    drivetrain
        What is computed.
    route
        The route's name.
    frequency
        (n_frequency,) Hz.
    responses, excitations
        Labels (None: all there are).
    stage
        A stage or inertia alone, with its halves of the hubs (None: the whole).

    Returns
    -------
    frf, method
        What was asked for only; the method in words.

    Raises
    ------
    CommandError
        There is no such route or stage.
    """
    if route not in ("exudyn", "fbs", "equations"):
        raise CommandError(f"--route = {route!r}: must be exudyn, fbs or equations")
    part = None if stage is None else known_part(drivetrain, stage, "--stage")
    if route == "fbs":
        if part is not None:
            raise CommandError(
                f"--stage = {stage!r}: route fbs couples the stages; for one alone, --route "
                "must be exudyn or equations"
            )
        model = build_model(exudyn_source(), drivetrain)
        if responses is None or excitations is None or _loops(drivetrain):
            frf = couple_stages(model, frequency).frf.select(responses, excitations)
            return frf, "direct solve of the stages, coupled all at once"
        chain = couple_chain(
            model.stages, model.joints, frequency, responses, excitations, synthesis=direct_frf
        )
        return chain.frf, "direct solve of the stages at their interfaces, coupled one by one"
    source = EQUATIONS if route == "equations" else exudyn_source()
    system = source.whole(drivetrain) if part is None else source.stage(drivetrain, part)
    # Summed modes would be as fast, but FRFs far below the largest would be their round-off.
    return direct_frf(system, frequency, responses, excitations), "direct solve, line by line"


def _loops(drivetrain: Drivetrain) -> bool:
    """Whether couplings close a loop of parts: each group of n parts has n − 1 if not."""
    joining = sum(coupling.transmits or bool(coupling.dofs) for coupling in drivetrain.couplings)
    return joining > len(drivetrain.parts) - len(drivetrain.groups())


def known_part(drivetrain: Drivetrain, name: str, option: str) -> str:
    """The name of a stage or inertia, as an option gives it.

    Raises
    ------
    CommandError
        There is none of that name; the nearest is named.
    """
    names = [part.name for part in drivetrain.parts]
    if name not in names:
        near = get_close_matches(name, names, n=1)
        hint = f"did you mean {near[0]}? " if near else ""
        raise CommandError(
            f"{option} = {name!r}: is no stage or inertia of '{drivetrain.name}'; {hint}"
            f"There are {', '.join(names)}"
        )
    return name
