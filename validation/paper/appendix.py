"""Appendix A: is the printed K_B a stiffness matrix at all?"""

from __future__ import annotations

import numpy as np

from mbs_models.model.parameters import PlanetaryStage

from ..arrays import FloatArray
from ..routes import equations
from . import printed
from .bench import ZERO, Bench
from .case import PaperCase
from .item import Finding, Verdict, statement


@statement(
    "appendix-symmetry", "Symmetry of K_B", "Eq. (25), Appendix A",
    "K_B is the stiffness matrix of subsystem B.",
    "the printed block of carrier and planet below the diagonal against the transpose of the one "
    "above",
)  # fmt: skip
def symmetry(bench: Bench) -> Finding:
    """Does Eq. (25) print a symmetric matrix?"""
    above, below = printed.carrier_blocks(bench.case.planetary)
    asymmetry = float(np.max(np.abs(above.T - below)) / np.max(np.abs(above)))
    return Finding(
        Verdict.of(asymmetry <= ZERO, corrected=True),
        f"K_c2 stands above and below the diagonal without a transpose, and differs from its own "
        f"transpose by {asymmetry:.2g} of its largest entry; K_s2 is 4 × 3 and fits below only as "
        "a transpose. So read, the matrix is symmetric",
        {"asymmetry": asymmetry},
    )


@statement(
    "appendix-definite", "Definiteness of K_B", "Eqs. (23)–(27), Appendix A",
    "K_B = K_mB + K_ss + K_bB with the blocks of Eqs. (23)–(26).",
    "lowest eigenvalue of K_B as printed (blocks below the diagonal read as transposes), and each "
    "block against k v vᵀ of Eq. (1) put right",
)  # fmt: skip
def definiteness(bench: Bench) -> Finding:
    """Does the printed K_B push back?"""
    case = bench.case
    stiffness = printed.stiffness_b(case.planetary, case.shaft_stiffness)
    right = equations.stage_system(case.drivetrain, case.b)
    place = [right.dofs.index(label) for label in (case.hub, *case.internal_b)]
    lowest = _lowest_eigenvalue(stiffness)
    own = _lowest_eigenvalue(right.stiffness[np.ix_(place, place)])
    wrong = wrong_blocks(case)
    k = case.planetary.sun_meshes[0]
    return Finding(
        Verdict.of(lowest >= -ZERO * k and not wrong),
        f"the printed K_B has the eigenvalue {lowest:.3g} N/m, which no springs have; "
        f"Σ k v vᵀ has {own:.1e} N/m. Blocks that are no part of an outer product: "
        f"{', '.join(wrong) or 'none'}",
        {"lowest_eigenvalue_printed": lowest, "lowest_eigenvalue_springs": own,
         "wrong_blocks": float(len(wrong))},
    )  # fmt: skip


def _lowest_eigenvalue(stiffness: FloatArray) -> float:
    return float(np.linalg.eigvalsh((stiffness + stiffness.T) / 2.0)[0])


def wrong_blocks(case: PaperCase) -> list[str]:
    """Printed blocks that differ from k v vᵀ for some planet, with the equations' vectors."""
    stage, b = case.planetary, case.planetary.name
    wrong: dict[str, None] = {}
    for number, phi in enumerate(stage.angles):
        planet = f"planet{number + 1}"
        blocks = printed.appendix_blocks(stage, number)
        for name, springs in _springs_behind(stage, planet, phi, number).items():
            body = {"s": "sun", "c": "carrier", "r": "ring"}[name]
            member = [f"{b}.{body}.{d}" for d in "uvw"]
            own = [f"{b}.{planet}.{d}" for d in "uvw"]
            for suffix, rows, columns in (("1", member, member), ("2", member, own),
                                          ("3", own, own)):  # fmt: skip
                exact = sum(
                    k * np.outer([v.get(r, 0.0) for r in rows], [v.get(c, 0.0) for c in columns])
                    for k, v in springs
                )
                given = getattr(blocks, f"{name}{suffix}")
                given = given[-3:, -len(columns) :]  # the hub's row and column are zero
                if np.max(np.abs(given - exact)) > ZERO * stage.sun_meshes[0]:
                    wrong[f"K_{name}{suffix}"] = None
    return list(wrong)


Springs = list[tuple[float, equations.Deflection]]


def _springs_behind(
    stage: PlanetaryStage, planet: str, phi: float, number: int
) -> dict[str, Springs]:
    """The springs whose k v vᵀ the blocks of sun, carrier and ring are."""
    b, (s, c) = stage.name, (np.sin(phi), np.cos(phi))
    k_p = stage.planet_support.stiffness
    radial = {f"{b}.carrier.u": c, f"{b}.carrier.v": s, f"{b}.{planet}.u": -1.0}
    tangential = {
        f"{b}.carrier.u": -s, f"{b}.carrier.v": c, f"{b}.carrier.w": 1.0, f"{b}.{planet}.v": -1.0,
    }  # fmt: skip
    return {
        "s": [(stage.sun_meshes[number], equations.sun_mesh(stage, planet, phi))],
        "c": [(k_p[0][0], radial), (k_p[1][1], tangential)],
        "r": [(stage.ring_meshes[number], equations.ring_mesh(stage, planet, phi))],
    }
