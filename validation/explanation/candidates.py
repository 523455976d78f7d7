"""What may be wrong: the model's parameters by their own names, and what a change makes of it."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fbs import FbsError, SecondOrderSystem
from mbs_models.errors import ModelError
from mbs_models.model.parameters import Drivetrain

from ..arrays import FloatArray
from ..errors import CommandError
from ..routes.model_parameters import changed, known_parameters, model_data, steps_to
from .evidence import Evidence, Slope

# What a parameter that is 0 in the model is counted in: about what such elements have
OFFSETS = {
    "stiffness_proportional": 1e-6,
    "mass_proportional": 10.0,
    "helix_angle": 10.0,
}
STIFFNESS = 1e8  # N/m
STEP = 1e-4  # of ln p, or of the unit
AFFINE = 1e-9  # of the largest entry: differences of 0.1 % have a round-off of 1e-13
WITHOUT_EFFECT = ("backlash", "teeth", "planets", "phase", "contact_ratio", "amplitude")


@dataclass(frozen=True, eq=False)
class Case:
    """A drivetrain, how its system is built, and the evidence it is held against."""

    drivetrain: Drivetrain
    build: Callable[[Drivetrain], SecondOrderSystem]
    evidence: Evidence

    @cached_property
    def system(self) -> SecondOrderSystem:
        """Its system."""
        return self.build(self.drivetrain)

    @cached_property
    def residual(self) -> FloatArray:
        """(n,) of the system against the evidence."""
        return self.evidence.residual(self.system)

    def thinned(self) -> Case:
        """With less evidence, to search."""
        return self.held_against(self.evidence.thinned())

    def held_against(self, evidence: Evidence) -> Case:
        """The same drivetrain with other evidence."""
        other = replace(self, evidence=evidence)
        other.__dict__["system"] = self.system  # built once
        return other


@dataclass(frozen=True)
class Parameter:
    """A number of the model file, or several that are said to be wrong by the same factor.

    Attributes
    ----------
    name
        As a person would say it.
    paths
        Its places in the model file.
    values
        What stands there.
    unit
        What a change from zero is counted in; 0 where the value is none.
    """

    name: str
    paths: tuple[str, ...]
    values: tuple[float, ...]
    unit: float = 0.0

    def value(self, log: float) -> float:
        """Of the first place, the change being ln(p/p₀), or ln(p/unit) where p₀ is zero."""
        return (self.values[0] or self.unit) * math.exp(log)

    def at(self, case: Case, log: float) -> Case:
        """The case with the parameter changed.

        Raises
        ------
        CommandError
            The model refuses it.
        """
        data = model_data(case.drivetrain)
        new = {
            steps_to(data, path): (value or self.unit) * math.exp(log)
            for path, value in zip(self.paths, self.values, strict=True)
        }
        return replace(case, drivetrain=changed(data, new))

    @property
    def neutral(self) -> float:
        """The change that is none: 0, or one that makes next to nothing of a unit."""
        return 0.0 if not self.unit else math.log(1e-6)


def parameters(drivetrain: Drivetrain) -> tuple[Parameter, ...]:
    """Every number that may change M, C or K, alone; then those of one key of a stage together."""
    alone = list(_single(drivetrain))
    return (*alone, *_together(alone))


def _single(drivetrain: Drivetrain) -> Iterator[Parameter]:
    for path, value in known_parameters(drivetrain).items():
        key = path.rpartition(".")[2]
        if any(word in key for word in WITHOUT_EFFECT) or "variation" in path or "error" in path:
            continue
        if isinstance(value, bool) or not isinstance(value, float | int):
            continue
        unit = 0.0 if value else OFFSETS.get(key, STIFFNESS)
        yield Parameter(path, (path,), (float(value),), unit)


def _together(alone: Sequence[Parameter]) -> Iterator[Parameter]:
    groups: dict[tuple[str, str], list[Parameter]] = defaultdict(list)
    for parameter in alone:
        stage, *_, key = parameter.paths[0].split(".")
        if parameter.paths[0].count(".") == 2 and not parameter.unit:
            groups[stage, key].append(parameter)
    for (stage, key), members in groups.items():
        if len(members) > 1:
            bodies = [member.paths[0].split(".")[1] for member in members]
            yield Parameter(
                f"{key} of {', '.join(bodies[:-1])} and {bodies[-1]} ({stage}) alike",
                tuple(member.paths[0] for member in members),
                tuple(member.values[0] for member in members),
            )


def slope_of(case: Case, parameter: Parameter) -> Slope | None:
    """∂(M, C, K)/∂(p/p₀), or per unit from zero, where they are affine in it; else None.

    That is seen where a change of 60 % is 600 times one of 0.1 %, to the round-off of the latter.
    """
    base, near, far = case.system, 1e-3, 0.6
    from_zero = bool(parameter.unit) and _is_zero(case, parameter)
    logs = [math.log(x) for x in ((near, far) if from_zero else (1.0 + near, 1.0 + far))]
    try:
        small, large = (parameter.at(case, log).system for log in logs)
    except (CommandError, FbsError, ModelError):
        return None
    slopes = []
    for name in ("mass", "damping", "stiffness"):
        own, first, second = (getattr(each, name) for each in (base, small, large))
        slope = (second - own) / far
        if np.abs((first - own) / near - slope).max() > AFFINE * max(np.abs(own).max(), 1e-300):
            return None
        slopes.append(slope)
    return Slope(*slopes)


def _is_zero(case: Case, parameter: Parameter) -> bool:
    known = known_parameters(case.drivetrain)
    return known[parameter.paths[0]] == 0.0


def steps_of(
    case: Case, candidates: Sequence[Parameter]
) -> tuple[list[Parameter], list[SecondOrderSystem], FloatArray]:
    """Candidates that the model takes with a small change, their systems, and the steps.

    (S(h) − S(−h))/2 is added, h = 1e-4 of ln p: derivatives to h²/6 = 2e-9, since a spring of 1e8
    in series with one of 1e5 counts a thousandth. Zero parameters are set to 1e-4 of their unit.
    """
    kept, systems, steps = [], [], []
    for candidate in candidates:
        try:
            if candidate.unit:
                systems.append(candidate.at(case, math.log(STEP)).system)
            else:
                more, less = (candidate.at(case, s * STEP).system for s in (1.0, -1.0))
                systems.append(_half_between(case.system, more, less))
        except CommandError:
            continue
        kept.append(candidate)
        steps.append(STEP)
    return kept, systems, np.array(steps)


def _half_between(
    base: SecondOrderSystem, more: SecondOrderSystem, less: SecondOrderSystem
) -> SecondOrderSystem:
    return replace(
        base,
        mass=base.mass + (more.mass - less.mass) / 2.0,
        damping=base.damping + (more.damping - less.damping) / 2.0,
        stiffness=base.stiffness + (more.stiffness - less.stiffness) / 2.0,
    )
