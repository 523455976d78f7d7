"""A drivetrain at an operating point as a system with periodic springs (`fbs.periodic`)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fbs.periodic.periodic_springs import PeriodicSpring
from fbs.second_order_system import SecondOrderSystem
from mbs_models.contact.mesh_excitation import MeshLaw
from mbs_models.gears.operating_point import OperatingPoint
from mbs_models.gears.orders import free_motions
from mbs_models.gears.static_state import straining
from mbs_models.model.parameters import Drivetrain
from mbs_models.signals.waveforms import Waveform
from mbs_models.system.components import SpringKind
from mbs_models.system.drivetrain import build_drivetrain
from mbs_models.system.read_back import components

from ..arrays import ComplexArray, FloatArray
from ..errors import CommandError

SERIES = 64  # harmonics of κ and e: a trapezoid's fall as 1/l², to 1e-4 of the first


@dataclass(frozen=True, eq=False)
class PeriodicDrivetrain:
    """The constant system, and every mesh as a spring of it.

    Attributes
    ----------
    system
        Linearised with all meshes at their mean.
    springs
        One for each mesh, its force positive where the loaded flanks press; ratios are per turn of
        the input: f = ratio · rpm/60.
    """

    system: SecondOrderSystem
    springs: tuple[PeriodicSpring, ...]


def parametric(
    drivetrain: Drivetrain, point: OperatingPoint, *, series: int = SERIES
) -> PeriodicDrivetrain:
    """The drivetrain at an operating point, for any speed: mesh frequencies go with it.

    Parameters
    ----------
    drivetrain, point
        The point needs a speed; its torque gives the static forces and the flanks.
    series
        How many harmonics of the laws are taken.

    Raises
    ------
    CommandError
        The point has no speed.
    """
    if point.speed_rpm is None:
        raise CommandError("mesh frequencies need a speed: the operating point has none")
    system = build_drivetrain(drivetrain)
    linear = point.linear
    turns = abs(point.speed_rpm) / 60.0
    # Where the torque has moved them, meshes close by the free rotation to second order only.
    keep = straining(linear, free_motions(components(system)))
    springs = []
    for spring in components(system, point.displacement).springs:
        if spring.kind is not SpringKind.MESH:
            continue
        law = point.laws.get(spring.name, MeshLaw())
        stiffness = float(spring.stiffness[0, 0])
        static_force = point.mesh_forces[spring.name]
        springs.append(
            PeriodicSpring(
                name=spring.name,
                vector=_pressed(spring.deflection[0] @ keep, law, static_force, point),
                stiffness=stiffness,
                ratio=law.frequency / turns if law.varies else 1.0,
                variation=_series(law.stiffness, law.phase, series),
                error=_series(law.transmission_error, law.phase, series),
                damping=drivetrain.damping.stiffness_proportional * stiffness,
                static_force=static_force,
            )
        )
    constant = SecondOrderSystem(
        linear.mass, linear.damping, linear.stiffness, linear.dofs, linear.derived
    )
    return PeriodicDrivetrain(constant, tuple(springs))


def _pressed(
    deflection: FloatArray, law: MeshLaw, static_force: float, point: OperatingPoint
) -> FloatArray:
    """The deflection, positive where the flanks that carry the mean load are pressed together.

    The static force is positive there; without one the law says which flanks those are.
    """
    stretch = float(deflection @ point.displacement)
    if static_force and stretch:
        return math.copysign(1.0, stretch * static_force) * deflection
    return law.flank * deflection


def _series(waveform: Waveform, phase: float, count: int) -> ComplexArray:
    """c_l e^{−j2πlγ}: a law that is γ periods late."""
    orders = np.arange(1, count + 1)
    own = np.array([waveform.harmonic(int(order)) for order in orders], dtype=complex)
    late: ComplexArray = own * np.exp(-2j * np.pi * orders * phase)
    return late
