"""The involute equations written out again, to hold exudyn's against: nothing of it is imported.

Newton's and Euler's equations, integrated by SciPy; the plane of the gears is that of the complex
numbers. No involute function is in them: of two gears whose centres are d apart, e the unit vector
from the first to the second, teeth touch along a line that leans off the one across e by the
working pressure angle,

    cos α = (r₁ ± r₂)/d,    n = (j cos α ± sin α) e    (upper signs: external mesh)

n being the way in which the first gear, turning counter-clockwise, pushes the second. What they
approach each other by along it is carried along as one more unknown,

    δ̇ = n·(v₁ − v₂) + r₁ω₁ ± r₂ω₂,    of a helical mesh δ̇ cos β + (ζ̇₁ − ζ̇₂) sin β

with ζ the way of the tangent point along the shafts. The force F presses with −F ∂δ̇/∂q̇.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Curve = Callable[[FloatArray], FloatArray]
EXTERNAL, INTERNAL = 1.0, -1.0
FULL = 2.0 * np.pi
# Of SciPy's steps, relative and in m (m/s, rad): a thousandth of what is asked of exudyn, and a
# millionth of the µm by which teeth press.
RELATIVE, ABSOLUTE = 1e-8, 1e-12


def nothing(turns: FloatArray) -> FloatArray:
    return np.zeros_like(turns)


def sines(*terms: tuple[float, float]) -> tuple[Curve, Curve]:
    """Σ A_l cos(2πlτ + φ_l), φ_l in degrees, and its derivative by τ."""

    def value(turns: FloatArray) -> FloatArray:
        angles = ((a, FULL * (n * turns + p / 360.0)) for n, (a, p) in enumerate(terms, 1))
        return np.asarray(sum(a * np.cos(angle) for a, angle in angles))

    def slope(turns: FloatArray) -> FloatArray:
        angles = ((a * n, FULL * (n * turns + p / 360.0)) for n, (a, p) in enumerate(terms, 1))
        return np.asarray(-FULL * sum(a * np.sin(angle) for a, angle in angles))

    return value, slope


def trapezoid(contact_ratio: float, peak_to_peak: float, ramp: float) -> Curve:
    """Low about τ = 0, high for the share ε − 1 between the ramps' middles, mean 0."""
    share = contact_ratio - 1.0
    low, high = -share * peak_to_peak, (1.0 - share) * peak_to_peak
    start, end = (1.0 - share - ramp) / 2.0, (1.0 - share + ramp) / 2.0

    def value(turns: FloatArray) -> FloatArray:
        return np.interp(turns % 1.0, [0.0, start, end, 1.0 - end, 1.0 - start, 1.0],
                         [low, low, high, high, low, low])  # fmt: skip

    return value


@dataclass(frozen=True)
class Teeth:
    """Meshes alike but for their phases: F = k g(x) + c ẋ in contact, x = δ − e; none pulls.

    δ counts from teeth that just touch, and is positive where the loaded flanks press.
    """

    stiffness: float  # N/m, mean
    damping: float  # N s/m
    frequency: float  # Hz
    phases: FloatArray  # mesh periods later than the reference
    variation: Curve = nothing  # k/k_m − 1 over τ
    error: Curve = nothing  # e (m) over τ
    error_slope: Curve = nothing
    backlash: float = 0.0  # m

    def forces(self, t: FloatArray | float, delta: FloatArray, rate: FloatArray) -> FloatArray:
        turns = self.frequency * t - self.phases
        x, x_t = delta - self.error(turns), rate - self.frequency * self.error_slope(turns)
        beyond = np.abs(x) - self.backlash / 2.0
        stiffness = self.stiffness * (1.0 + self.variation(turns))
        if not self.backlash:
            return stiffness * x + self.damping * x_t
        force = np.sign(x) * stiffness * beyond + self.damping * x_t
        return np.where((beyond > 0.0) & (force * x > 0.0), force, 0.0)


def line_of_action(apart: ComplexArray, kind: float, base: float) -> ComplexArray:
    """n between gears whose centres are ``apart``, r₁ ± r₂ = ``base``."""
    distance = np.abs(apart)
    cos = base / distance
    return np.asarray((1j * cos + kind * np.sqrt(1.0 - cos**2)) * apart / distance)


def along(line: ComplexArray, velocity: ComplexArray) -> FloatArray:
    """The component of a velocity."""
    return np.asarray((line.conj() * velocity).real)


@dataclass(frozen=True)
class Witness:
    """A drivetrain by its equations of motion in coordinates q (n,), m and rad.

    ``equations`` makes of t, q, q̇ and δ the accelerations q̈, and δ̇ and F of the meshes.
    """

    labels: tuple[str, ...]
    place: FloatArray  # (n, n_label): what a DoF of the model moves the coordinates by
    meshes: tuple[str, ...]
    equations: Callable[
        [float, FloatArray, FloatArray, FloatArray], tuple[FloatArray, FloatArray, FloatArray]
    ]

    def deflection(self, q: FloatArray) -> FloatArray:
        """δ of a place near the one where teeth just touch, q = 0: ∫ δ̇ along the straight way.

        Six points of Gauss are exact to the eleventh power of the way.
        """
        points, weights = np.polynomial.legendre.leggauss(6)
        none = np.zeros(len(self.meshes))
        rates = [self.equations(0.0, (1.0 + x) / 2.0 * q, q, none)[1] for x in points]
        return np.asarray(weights @ np.array(rates) / 2.0)

    def run(self, start: tuple[FloatArray, FloatArray], time: FloatArray) -> FloatArray:
        """Mesh forces (n, n_mesh) N at some instants (s), from displacement and velocity on.

        The way from one instant to the next is a piece of its own: k(t) may have a kink there.
        """
        n, (q, v) = len(self.place), (self.place @ part for part in start)

        def slope(t: float, state: FloatArray) -> FloatArray:
            v = state[n : 2 * n]
            acceleration, rate, _ = self.equations(t, state[:n], v, state[2 * n :])
            return np.concatenate([v, acceleration, rate])

        states = [np.concatenate([q, v, self.deflection(q)])]
        for t, later in pairwise(time):
            piece = solve_ivp(
                slope, (t, later), states[-1], method="DOP853", first_step=later - t,
                rtol=RELATIVE, atol=ABSOLUTE,
            )  # fmt: skip
            assert piece.success
            states.append(piece.y[:, -1])
        forces = []
        for t, state in zip(time, states, strict=True):
            forces.append(self.equations(t, *np.split(state, [n, 2 * n]))[2])
        return np.array(forces)


def pair(stage: Mapping[str, Any], beta: float, teeth: Teeth, torque: float) -> Witness:
    """Two gears on parallel shafts, each with y, z, rocking about y, rotation; x is held.

    The wheel stands at the pressure angle seen from the pinion, so that the line of action is y: it
    touches the base circles at x = r₁ and −r₂. ``torque`` (N m) is the pinion's; the wheel takes
    what does no work on the rolling of the two.
    """
    gears = stage["pinion"], stage["wheel"]
    r_1, r_2 = (gear["base_radius"] for gear in gears)
    angle = math.radians(stage.get("pressure_angle", 20.0))
    helix = math.radians(stage.get("helix_angle", 0.0))
    centre = (r_1 + r_2) / math.cos(angle) * cmath.exp(1j * angle)
    cos, sin = math.cos(helix), math.sin(helix)
    inertia, spring, load = np.zeros(8), np.zeros(8), np.zeros(8)
    for first, gear, r in zip((0, 4), gears, (r_1, r_2), strict=True):
        inertia[first : first + 2] = gear["mass"]
        inertia[first + 2] = gear["diametral_inertia_over_r2"] * r**2
        inertia[first + 3] = gear["polar_inertia_over_r2"] * r**2
        spring[first : first + 2] = gear["bearing_y"], gear["bearing_z"]
        spring[first + 2] = gear["bearing_rocking_over_r2"] * r**2
    load[[3, 7]] = torque, torque * r_2 / r_1

    def equations(
        t: float, q: FloatArray, v: FloatArray, delta: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        y = line_of_action(np.array(centre + 1j * (q[4] - q[0])), EXTERNAL, r_1 + r_2).imag
        row = np.array([cos * y, sin, -sin * r_1, cos * r_1, -cos * y, -sin, -sin * r_2, cos * r_2])
        rate = np.array([row @ v])
        forces = teeth.forces(t, delta, rate)
        return (load - spring * (q + beta * v) - row * forces[0]) / inertia, rate, forces

    name = stage["name"]
    members = ("pinion", "wheel")
    return Witness(
        tuple(f"{name}.{gear}.{dof}" for gear in members for dof in ("y", "z", "rho", "w")),
        # w and ρ are what rotation and rocking move the tangent point by, along y and z.
        np.diag([1.0, 1.0, -1.0 / r_1, 1.0 / r_1, 1.0, 1.0, 1.0 / r_2, -1.0 / r_2]),
        (f"mesh {name}.pinion – wheel",),
        equations,
    )


def planetary(
    stage: Mapping[str, Any],
    beta: float,
    alpha: float,
    sun_teeth: Teeth,
    ring_teeth: Teeth,
    torque: float,
) -> Witness:
    """Sun, ring, carrier and equally spaced planets in the plane, carrier and all free to turn.

    Coordinates: x of all bodies, their y, their rotations. ``torque`` (N m) is the sun's; the
    carrier takes what does no work where the ring stands still, (r_s + r_r)/r_s of it.
    """
    count, cos = stage["planets"], math.cos(math.radians(stage["pressure_angle"]))
    r_s, r_p = stage["sun"]["base_radius"], stage["planet"]["base_radius"]
    r_r, d = r_s + 2.0 * r_p, (r_s + r_p) / cos
    out = np.exp(2j * np.pi * np.arange(count) / count)  # towards the planets
    bodies = [stage[member] for member in ("sun", "ring", "carrier", *["planet"] * count)]
    n, radii = len(bodies), np.array([r_s, r_r, d] + [r_p] * count)
    mass = np.array([body["mass"] for body in bodies])
    inertia = np.array([body["polar_inertia_over_r2"] for body in bodies]) * radii**2
    bearing = np.array([body["bearing"] for body in bodies[:3]])
    support = np.array([body["torsional_support"] for body in bodies[:3]]) * radii[:3] ** 2
    load = torque * np.array([1.0, 0.0, -(r_s + r_r) / r_s])

    def equations(
        t: float, q: FloatArray, v: FloatArray, delta: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        (x, y, turned), (v_x, v_y, turns) = q.reshape(3, n), v.reshape(3, n)
        shift, moving = x + 1j * y, v_x + 1j * v_y
        centres = shift[3:] + d * out
        sun = line_of_action(centres - shift[0], EXTERNAL, r_s + r_p)
        ring = line_of_action(centres - shift[1], INTERNAL, r_r - r_p)
        sun_rate = along(sun, moving[0] - moving[3:]) + r_s * turns[0] + r_p * turns[3:]
        ring_rate = along(ring, moving[1] - moving[3:]) + r_r * turns[1] - r_p * turns[3:]
        of_sun = sun_teeth.forces(t, delta[:count], sun_rate)
        of_ring = ring_teeth.forces(t, delta[count:], ring_rate)
        # Each planet's bearing holds its centre to a point of the carrier.
        arm = d * out * np.exp(1j * turned[2])
        parting = moving[3:] - moving[2] - 1j * turns[2] * arm
        held = stage["planet_bearing"] * (centres - shift[2] - arm + beta * parting)
        force, moment = np.zeros(n, complex), np.zeros(n)
        force[:3] = -bearing * (shift[:3] + beta * moving[:3])
        force[:3] += -of_sun @ sun, -of_ring @ ring, held.sum()
        force[3:] = of_sun * sun + of_ring * ring - held
        moment[:3] = load - support * (turned[:3] + beta * turns[:3])
        moment[:3] += -r_s * of_sun.sum(), -r_r * of_ring.sum(), along(1j * arm, held).sum()
        moment[3:] = r_p * (of_ring - of_sun)
        acceleration = np.concatenate([force.real / mass, force.imag / mass, moment / inertia])
        acceleration -= alpha * v
        rates, forces = np.concatenate([sun_rate, ring_rate]), np.concatenate([of_sun, of_ring])
        return acceleration, rates, forces

    name = stage["name"]
    members = ("sun", "ring", "carrier", *(f"planet{i + 1}" for i in range(count)))
    u, zero = np.array([1.0, 1.0, 1.0, *out]), np.zeros((n, n))  # planets: u outwards, v across
    return Witness(
        tuple(f"{name}.{member}.{dof}" for dof in "uvw" for member in members),
        np.block(
            [
                [np.diag(u.real), np.diag(-u.imag), zero],
                [np.diag(u.imag), np.diag(u.real), zero],
                [zero, zero, np.diag(1.0 / radii)],
            ]
        ),
        tuple(f"mesh {name}.{m} – planet{i + 1}" for m in ("sun", "ring") for i in range(count)),
        equations,
    )
