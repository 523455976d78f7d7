"""What the page computes FRFs from: the parts' modes, what joins them, and dampers of their own.

Parts are taken without their hubs, which are parts of one free mode each, so that every spring of a
coupling is a joint, whose stiffness can be changed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fbs import SecondOrderSystem, real_modes
from mbs_models.model.parameters import Coupling, Damping, Drivetrain
from mbs_models.model.placement import hub_ratios, rigid_end, translation_ends

from ..arrays import FloatArray
from ..routes.source import Source

EPS = float(np.finfo(float).eps)
UNDAMPED = Damping()
UNIT = Damping(stiffness_proportional=1.0)  # c = k where nothing else is said


@dataclass(frozen=True, eq=False)
class PartModes:
    """Modes of a part without its couplings.

    Attributes
    ----------
    name, dofs
        The part, and its coordinates.
    omega
        (n_mode,) rad/s, the free motions first.
    shapes
        (n_dof, n_mode), of unit modal mass.
    rigid
        How many free motions.
    rows, damping, stiffness
        Coordinates with dampers that are not β k, those dampers (N s/m) and the stiffness beside
        them (N/m), (n_row, n_row).
    """

    name: str
    dofs: tuple[str, ...]
    omega: FloatArray
    shapes: FloatArray
    rigid: int
    rows: tuple[int, ...]
    damping: FloatArray
    stiffness: FloatArray

    def document(self) -> dict[str, Any]:
        """What `synthesis.js` calls a Part: numbers in full."""
        return {
            "name": self.name,
            "dofs": list(self.dofs),
            "omega": self.omega.tolist(),
            "shapes": self.shapes.tolist(),
            "rigid": self.rigid,
            "dampers": {
                "rows": list(self.rows),
                "damping": self.damping.tolist(),
                "stiffness": self.stiffness.tolist(),
            },
        }


@dataclass(frozen=True)
class JointSpring:
    """A spring δ = Σ factor · u(label); stiffness None: rigid; damping None: β k."""

    name: str
    terms: tuple[tuple[str, float], ...]
    stiffness: float | None
    damping: float | None = None


@dataclass(frozen=True, eq=False)
class JoinedParts:
    """A route of the page: parts, joints, and labels that follow from others."""

    name: str
    parts: tuple[PartModes, ...]
    joints: tuple[JointSpring, ...]
    derived: Mapping[str, tuple[str, float]]

    def document(self) -> dict[str, Any]:
        """What `synthesis.js` calls a Route."""
        return {
            "name": self.name,
            "parts": [part.document() for part in self.parts],
            "joints": [vars(joint) for joint in self.joints],
            "derived": dict(self.derived),
        }


def whole(source: Source) -> JoinedParts:
    """The whole drivetrain as one part."""
    built = {damping: source.build_whole(_with(source.drivetrain, damping)) for damping in _BOTH}
    name = f"whole: {source.name}"
    system = source.whole
    return JoinedParts(name, (part_modes("whole", system, built),), (), dict(system.derived))


def stages(source: Source) -> JoinedParts:
    """The parts, joined at their hubs."""
    drivetrain = source.drivetrain
    bare = drivetrain.model_copy(update={"couplings": ()})
    parts: list[PartModes] = []
    derived: dict[str, tuple[str, float]] = {}
    for part in drivetrain.parts:
        built = {d: source.build_stage(_with(bare, d), part.name) for d in _BOTH}
        parts.append(part_modes(part.name, built[UNDAMPED], built))
        derived |= built[UNDAMPED].derived
    joints: list[JointSpring] = []
    for coupling in drivetrain.couplings:
        joints += _translations(drivetrain, coupling)
        if coupling.massless:
            derived[f"{coupling.name}.w"] = _rigid_hub(drivetrain, coupling)
            joints += _shaft(drivetrain, coupling)
        else:
            parts.append(_hub(coupling))
            joints += _hub_springs(drivetrain, coupling)
    return JoinedParts(f"FBS of {source.name} stages", tuple(parts), tuple(joints), derived)


def part_modes(
    name: str, system: SecondOrderSystem, built: Mapping[Damping, SecondOrderSystem]
) -> PartModes:
    """Modes, and the dampers that are not β k: C(β) = C₀ + β (K − K₀), so C(1) − C(0) = K − K₀.

    K₀ is the stiffness of springs that have dampers C₀ of their own; what is below the round-off
    of K's assembly is none.
    """
    modes = real_modes(system)
    own = built[UNDAMPED].damping
    replaced = system.stiffness - (built[UNIT].damping - own)
    root = np.sqrt(np.abs(np.diag(system.stiffness)))
    beside = np.abs(replaced) > 64 * len(system.dofs) * EPS * np.outer(root, root)
    rows = np.flatnonzero(((own != 0.0) | beside).any(axis=1))
    return PartModes(
        name,
        system.dofs,
        modes.angular_frequency,
        modes.shapes,
        modes.n_rigid,
        tuple(map(int, rows)),
        own[np.ix_(rows, rows)],
        np.where(beside, replaced, 0.0)[np.ix_(rows, rows)],
    )


_BOTH = (UNDAMPED, UNIT)


def _with(drivetrain: Drivetrain, damping: Damping) -> Drivetrain:
    return drivetrain.model_copy(update={"damping": damping})


def _hub(coupling: Coupling) -> PartModes:
    """A hub's inertia: one free mode."""
    none, shape = np.zeros((0, 0)), np.array([[coupling.hub_mass**-0.5]])
    label = f"{coupling.name}.w"
    return PartModes(coupling.name, (label,), np.zeros(1), shape, 1, (), none, none)


def _hub_springs(drivetrain: Drivetrain, coupling: Coupling) -> Iterator[JointSpring]:
    """δ = (r/r_body)·w_body − w_hub at both ends."""
    ratios, hub = hub_ratios(drivetrain), f"{coupling.name}.w"
    for key, (body, stiffness) in zip(("first", "second"), coupling.ends, strict=True):
        terms = ((f"{body}.w", ratios[coupling.name, body]), (hub, -1.0))
        yield JointSpring(f"{coupling.name}.{key}_stiffness", terms, _spring(stiffness))


def _rigid_hub(drivetrain: Drivetrain, coupling: Coupling) -> tuple[str, float]:
    """What a massless hub moves with."""
    body, _ = rigid_end(coupling)
    return f"{body}.w", hub_ratios(drivetrain)[coupling.name, body]


def _shaft(drivetrain: Drivetrain, coupling: Coupling) -> Iterator[JointSpring]:
    """The one spring of a massless hub, between the two bodies."""
    near = rigid_end(coupling)
    far = next(end for end in coupling.ends if end != near)
    key = "first" if far is coupling.ends[0] else "second"
    ratio = hub_ratios(drivetrain)[coupling.name, far[0]]
    terms = (_rigid_hub(drivetrain, coupling), (f"{far[0]}.w", -ratio))
    yield JointSpring(f"{coupling.name}.{key}_stiffness", terms, _spring(far[1]))


def _translations(drivetrain: Drivetrain, coupling: Coupling) -> Iterator[JointSpring]:
    for dof, translation in coupling.dofs.items():
        first, second, sign = translation_ends(drivetrain, coupling, dof)
        terms = ((first, 1.0), (second, -sign))
        own = _spring(translation.stiffness)
        yield JointSpring(f"{coupling.name}.{dof}", terms, own, translation.damping)


def _spring(stiffness: float | str) -> float | None:
    return None if isinstance(stiffness, str) else stiffness
