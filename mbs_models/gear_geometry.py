"""Lines of action and their tangent points on the base circles (any gear-geometry text).

The mesh force of involute gears acts along the common tangent of the two base circles. Attaching
the mesh spring at the two tangent points makes its length independent, to first order, of a rigid
roll of the pair, and its direction the line of action: the mesh stiffness matrix follows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class LineOfAction:
    """A mesh spring's line: tangent points on the two base circles, each from its gear's centre.

    ``direction`` is the unit vector from which the mesh deflection is counted: positive ``w`` of
    the first gear moves its tangent point along it.
    """

    first_point: Vector  # (3,) m, from the first gear's centre
    second_point: Vector  # (3,) m, from the second gear's centre
    direction: Vector  # (3,) unit vector


def centre_distance(first_radius: float, second_radius: float, pressure_angle: float) -> float:
    """d = (r₁ + r₂)/cos α of an external pair of base radii r₁, r₂ (m; α in rad)."""
    return (first_radius + second_radius) / math.cos(pressure_angle)


def radial(angle: float) -> Vector:
    """e_r at a position angle (rad)."""
    return np.array([math.cos(angle), math.sin(angle), 0.0])


def tangential(angle: float) -> Vector:
    """e_t = ẑ × e_r at a position angle (rad)."""
    return np.array([-math.sin(angle), math.cos(angle), 0.0])


def external_mesh(
    first_radius: float, second_radius: float, pressure_angle: float, angle: float
) -> LineOfAction:
    """Line of action of two external gears, the second at position ``angle`` from the first.

    n = sin α·e_r + cos α·e_t; tangent points ±r(cos α·e_r − sin α·e_t). Counter-clockwise
    rotation of the first gear moves its point along n, of the second against it (Eq. 1's +w_s
    and +w_p).
    """
    e_r, e_t = radial(angle), tangential(angle)
    towards = math.cos(pressure_angle) * e_r - math.sin(pressure_angle) * e_t
    return LineOfAction(
        first_point=first_radius * towards,
        second_point=-second_radius * towards,
        direction=math.sin(pressure_angle) * e_r + math.cos(pressure_angle) * e_t,
    )


def internal_mesh(
    ring_radius: float, planet_radius: float, pressure_angle: float, angle: float
) -> LineOfAction:
    """Line of action of a ring and a planet at position ``angle`` from the ring's centre.

    n = −sin α·e_r + cos α·e_t; both tangent points at r(cos α·e_r + sin α·e_t), for
    counter-clockwise rotation moves both along n (Eq. 1's +w_r and −w_p).
    """
    e_r, e_t = radial(angle), tangential(angle)
    towards = math.cos(pressure_angle) * e_r + math.sin(pressure_angle) * e_t
    return LineOfAction(
        first_point=ring_radius * towards,
        second_point=planet_radius * towards,
        direction=-math.sin(pressure_angle) * e_r + math.cos(pressure_angle) * e_t,
    )
