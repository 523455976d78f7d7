"""The paper's formulas as printed, faults included. Nothing else in the project uses them.

Where the print is ambiguous the reading is stated. What is right stands in `equations` (vectors of
Eqs. 1 and 9), `fbs.coupling` (Eq. 15) and `fbs.condensation` (Eqs. 18–22, 28–31).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, radians, sin

import numpy as np

from fbs import Frf
from mbs_models.model.parameters import ParallelStage, PlanetaryStage

from ..arrays import ComplexArray, FloatArray
from ..routes.equations import Deflection


def ring_deflection(stage: PlanetaryStage, planet: str, phi: float) -> Deflection:
    """δ_rp = v_r cos φ_rp − u_c sin φ_rp + u_p sin α_r − v_p cos α_r + w_r − w_p (Eq. 1).

    With u_c as printed (for u_r) and φ_rp = φ_p − α_r as printed (for φ_p + α_r).
    """
    alpha = stage.ring_mesh_angle
    phi_rp = phi - alpha
    at = stage.name
    return {
        f"{at}.ring.v": cos(phi_rp),
        f"{at}.carrier.u": -sin(phi_rp),
        f"{at}.{planet}.u": sin(alpha),
        f"{at}.{planet}.v": -cos(alpha),
        f"{at}.ring.w": 1.0,
        f"{at}.{planet}.w": -1.0,
    }


def mesh_vector(stage: ParallelStage) -> Deflection:
    """qᵀ = [cos β, −cos β, cos β, −cos β, sin β, −sin β] (Eq. 9): six entries for the eight DoFs
    of Eq. (4); the two rocking ones are left over."""
    beta = radians(stage.helix_angle)
    weights = {"w": cos(beta), "y": cos(beta), "z": sin(beta)}
    return {
        f"{stage.name}.{gear}.{dof}": sign * weight
        for dof, weight in weights.items()
        for gear, sign in (("pinion", 1.0), ("wheel", -1.0))
    }


def bearing_matrix_a(stage: ParallelStage) -> FloatArray:
    """K_bA = diag(0, 0, k_by1, k_by2, k_bz1, k_bz2, k_bρy1, k_bρy2) (Eq. 7).

    It is 8 × 8 for the nine DoFs of Eq. (4): θ(2,2) has no row, and no spring joins it to r₂θ(2).
    """
    gears = (stage.pinion, stage.wheel)
    diagonal = [
        *(0.0 for _ in gears),
        *(gear.support.stiffness[0][0] for gear in gears),
        *(gear.support.stiffness[1][1] for gear in gears),
        *(gear.rocking_stiffness for gear in gears),
    ]
    return np.diag(diagonal)


def masses_a(stage: ParallelStage, hub: float) -> list[float]:
    """Diagonal of M_A (Eq. 6), in the order of Eq. (4); ``hub`` stands for the printed I_A."""
    gears = (stage.pinion, stage.wheel)
    return [
        *(gear.rotary_mass(gear.base_radius) for gear in gears),
        *(gear.mass for gear in gears * 2),
        *(gear.rocking_mass for gear in gears),
        hub / 2.0,
    ]


def masses_b(stage: PlanetaryStage, hub: float) -> list[float]:
    """Diagonal of M_B (Eq. 10), in the order of Eq. (5); ``hub`` stands for the printed I_A."""
    members = [(getattr(stage, name), stage.radius(name)) for name in ("sun", "carrier", "ring")]
    members += [(stage.planet, stage.planet.base_radius)] * stage.planet_count
    return [
        hub / 2.0,
        *(m for body, r in members for m in (body.mass, body.mass, body.rotary_mass(r))),
    ]


@dataclass(frozen=True)
class Blocks:
    """Blocks of Eqs. (25) and (26) for one planet, as printed (N/m).

    ``s1``, ``c1``, ``r1``: on the diagonal of sun (with the hub's row), carrier, ring; ``s2``,
    ``c2``, ``r2``: between those and the planet; ``s3``, ``c3``, ``r3``: on the planet's.
    """

    s1: FloatArray
    c1: FloatArray
    r1: FloatArray
    s2: FloatArray
    c2: FloatArray
    r2: FloatArray
    s3: FloatArray
    c3: FloatArray
    r3: FloatArray


def appendix_blocks(stage: PlanetaryStage, number: int) -> Blocks:
    """The blocks of planet ``number`` (from 0), entry by entry as Appendix A prints them.

    Read: ksp, krp, kp for k_sp, k_rp, K_p; ``sin φ`` in K_c1 as sin φ_p; ``φ_s`` in K_s2 as φ_sp;
    the factors ``kp`` of K_s3 and ``kr`` of K_r3 as k_sp and k_rp; φ_rp = φ_p − α_r (below Eq. 1).
    """
    phi, alpha_s, alpha_r = stage.angles[number], stage.sun_mesh_angle, stage.ring_mesh_angle
    k_sp, k_rp = stage.sun_meshes[number], stage.ring_meshes[number]
    k_p = stage.planet_support.stiffness[0][0]
    s, c = sin(phi), cos(phi)
    s_sp, c_sp = sin(phi - alpha_s), cos(phi - alpha_s)
    s_rp, c_rp = sin(phi - alpha_r), cos(phi - alpha_r)
    s_as, c_as, s_ar, c_ar = sin(alpha_s), cos(alpha_s), sin(alpha_r), cos(alpha_r)

    def block(k: float, *rows: Sequence[float]) -> FloatArray:
        return k * np.array(rows, dtype=float)

    return Blocks(
        s1=block(
            k_sp,
            (0, 0, 0, 0),
            (0, s_sp**2, -c_sp * c_as, -s_sp),
            (0, -c_sp * c_as, c_sp**2, c_sp),
            (0, -s_sp, c_sp, 1),
        ),
        c1=block(k_p, (1, 0, -s), (0, 1, c), (-s, c, 0)),
        r1=block(
            k_rp,
            (s_rp**2, -c_rp * c_ar, s_rp),
            (-c_rp * c_ar, c_rp**2, c_rp),
            (s_rp, c_rp, 1),
        ),
        s2=block(
            k_sp,
            (0, 0, 0),
            (s_sp * s_as, s_sp * c_as, -s_sp),
            (-c_sp * s_as, -(c_sp**2), -c_sp),
            (-s_sp, -c_sp, 1),
        ),
        c2=block(k_p, (-c, s, 0), (-s, -c, 0), (0, 1, 0)),
        r2=block(
            k_rp,
            (-s_rp * s_ar, -c_sp * c_as, -s_sp),
            (-c_sp * c_as, c_sp**2, c_sp),
            (-s_sp, c_sp, 1),
        ),
        s3=block(
            k_sp, (s_as**2, c_as * s_as, -s_as), (c_as * s_as, c_as**2, -c_as), (-s_as, -c_as, 1)
        ),
        c3=np.diag([k_p, k_p, 0.0]),
        r3=block(
            k_rp, (s_ar**2, -c_ar * s_ar, -s_ar), (-c_ar * s_ar, c_ar**2, c_ar), (-s_ar, c_ar, 1)
        ),
    )


def carrier_blocks(stage: PlanetaryStage) -> tuple[FloatArray, FloatArray]:
    """What Eq. (25) prints above and below the diagonal for carrier and last planet: both K_c2ⁿ.

    No transpose is printed. (Below the diagonal K_s2, 4 × 3, does not even fit without one.)
    """
    last = appendix_blocks(stage, stage.planet_count - 1)
    return last.c2, last.c2


def stiffness_b(stage: PlanetaryStage, shaft: float) -> FloatArray:
    """K_B = K_mB + K_ss + K_bB (Eqs. 23–27), in the order of Eq. (5).

    The block row of the carrier is printed ``K_c1¹ … K_c2ⁿ``, that of the ring ``K_r1¹ … K_r2ⁿ``:
    the first of each is read as K_c2¹ and K_r2¹, as at the end of the row and below the diagonal.
    The blocks below the diagonal are read as transposes, without which K_s2 (4 × 3) would not fit.
    """
    n = stage.planet_count
    k = np.zeros((10 + 3 * n, 10 + 3 * n))
    central = {"s": slice(0, 4), "c": slice(4, 7), "r": slice(7, 10)}
    for number in range(n):
        blocks = appendix_blocks(stage, number)
        planet = slice(10 + 3 * number, 13 + 3 * number)
        for name, rows in central.items():
            k[rows, rows] += getattr(blocks, f"{name}1")
            k[rows, planet] = getattr(blocks, f"{name}2")
            k[planet, rows] = getattr(blocks, f"{name}2").T
        k[planet, planet] = blocks.s3 + blocks.c3 + blocks.r3
    k[np.ix_((0, 3), (0, 3))] += shaft * np.array([[1.0, -1.0], [-1.0, 1.0]])  # Eq. (24)
    for member, first, torsion in (
        (stage.sun, 1, 0.0),
        (stage.carrier, 4, stage.carrier.torsional_support_at(stage.radius("carrier"))),
        (stage.ring, 7, stage.ring.torsional_support_at(stage.radius("ring"))),
    ):  # Eq. (23)
        support = member.support.stiffness
        k[range(first, first + 3), range(first, first + 3)] += (
            support[0][0], support[1][1], torsion,
        )  # fmt: skip
    return k


def coupled_receptance(a: Frf, b: Frf, interface: str) -> tuple[ComplexArray, tuple[str, ...]]:
    """Eq. (15) as printed, over the DoFs (A_i, c, B_j).

        [A_H 0; 0 B_H_jj] − [A_H_ic; A_H_cc; B_H_jc] (A_H_cc + B_H_cc)⁻¹ [A_H_ic; A_H_cc; B_H_jc]ᵀ

    with the printed sign of B_H_jc.

    Parameters
    ----------
    a, b
        FRFs of the subsystems; both have ``interface``, the coupling DoF.
    interface
        Its label.
    """
    of_a = (*(label for label in a.responses if label != interface), interface)
    of_b = tuple(label for label in b.responses if label != interface)
    kernel = 1.0 / (a.between(interface, interface) + b.between(interface, interface))
    columns = (a.select(of_a, (interface,)).values, b.select(of_b, (interface,)).values)
    return _subtracted(a.select(of_a, of_a), b.select(of_b, of_b), columns, kernel)


def flexibly_coupled_receptance(
    a: Frf, b: Frf, ends: tuple[str, str], stiffness: float
) -> tuple[ComplexArray, tuple[str, ...]]:
    """Eq. (15) with the kernel that the text gives for the flexible joint, as printed.

    "The Kernel matrix (A_H_cc + B_H_cc)⁻¹ must be replaced by (A_H_cc + B_H_cc + K_s⁻¹)": without
    the inverse of the whole.

    Parameters
    ----------
    a, b
        FRFs of the subsystems.
    ends
        The joint's DoF in A and in B.
    stiffness
        K_s (N/m).
    """
    in_a, in_b = ends
    kernel = a.between(in_a, in_a) + b.between(in_b, in_b) + 1.0 / stiffness
    columns = (a.select(excitations=(in_a,)).values, b.select(excitations=(in_b,)).values)
    return _subtracted(a, b, columns, kernel)


def _subtracted(
    a: Frf, b: Frf, columns: tuple[ComplexArray, ComplexArray], kernel: ComplexArray
) -> tuple[ComplexArray, tuple[str, ...]]:
    """[A_H 0; 0 B_H] − column · kernel · columnᵀ."""
    column = np.concatenate(columns, axis=1)
    coupled = -column @ (kernel[:, None, None] * column.transpose(0, 2, 1))
    n = len(a.responses)
    coupled[:, :n, :n] += a.values
    coupled[:, n:, n:] += b.values
    return coupled, a.responses + b.responses


def condensed(ab: Frf, a: tuple[str, ...], c: tuple[str, ...], b: tuple[str, ...]) -> ComplexArray:
    """A_H = H_aa − H_ac (H_cc − H_cb H_bb⁻¹ H_bc)⁻¹ H_ca (Eq. 21), letter by letter.

    Eq. (22) is the same with a and b changed over. It is Eq. (31) with c and b as slaves, but for
    H_ab, which the paper sets to zero under Eq. (19) and which no coupled system has.
    """

    def h(rows: tuple[str, ...], columns: tuple[str, ...]) -> ComplexArray:
        return ab.select(rows, columns).values

    inner = h(c, c) - h(c, b) @ np.linalg.solve(h(b, b), h(b, c))
    return np.asarray(h(a, a) - h(a, c) @ np.linalg.solve(inner, h(c, a)))
