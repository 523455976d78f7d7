"""The paper's formulas: each printed one against exudyn's bodies and springs."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from fbs import SecondOrderSystem, direct_frf, real_modes

from ..arrays import FloatArray
from ..checks.frfs import FRF_TOLERANCE
from ..checks.metrics import scaled_error
from ..routes import equations
from ..routes.routes import exudyn_source
from . import printed
from .bench import ZERO, Bench
from .case import PaperCase
from .item import Finding, Verdict, statement
from .printed_values import PROBE_HZ
from .shaft import SplitAtShaft

HELIX_DEG = 20.0
"""A helix angle to try Eq. (9) with; the paper's own is zero."""


def natural_frequencies(system: SecondOrderSystem) -> FloatArray:
    """Hz."""
    return real_modes(system).natural_frequencies


def largest_shift(first: FloatArray, second: FloatArray) -> tuple[float, float, float]:
    """The relative shift of the frequency that moves most, and its two values (Hz)."""
    size = np.where(first > 0.0, first, 1.0)
    mode = int(np.argmax(np.abs(second - first) / size))
    return (
        float(abs(second[mode] - first[mode]) / size[mode]),
        float(first[mode]),
        float(second[mode]),
    )


@statement(
    "eq1", "Ring-planet mesh", "Eq. (1), Sec. 2",
    "δ_rp contains u_c, and φ_rp = φ_p − α_r.",
    "strain of the printed δ_rp in a rigid translation of the stage, and frequencies of "
    "K = Σ k v vᵀ with it, against exudyn's springs between tangent points",
)  # fmt: skip
def ring_mesh(bench: Bench) -> Finding:
    """A rigid translation of the whole stage must not strain a mesh."""
    case = bench.case
    stage = case.planetary
    strain = {
        name: max(_strain_of_translation(case, vector) for vector in vectors)
        for name, vectors in (
            ("printed", _ring_vectors(case, printed.ring_deflection)),
            ("right", _ring_vectors(case, equations.ring_mesh)),
        )
    }
    bare = case.drivetrain.model_copy(update={"couplings": ()})
    exact = natural_frequencies(exudyn_source().stage(bare, stage.name))
    shift, own, misprinted = largest_shift(
        exact, natural_frequencies(_with_ring_mesh(case, printed.ring_deflection))
    )
    agrees = largest_shift(exact, natural_frequencies(equations.stage_system(bare, stage.name)))[0]
    holds = strain["printed"] <= ZERO and shift <= FRF_TOLERANCE
    return Finding(
        Verdict.of(holds, corrected=True),
        f"moving the whole stage by 1 m strains the printed mesh by {strain['printed']:.2f} m, "
        f"with u_r and φ_p + α_r by {strain['right']:.1e} m; the printed one moves {own:.1f} Hz to "
        f"{misprinted:.1f} Hz, the corrected one agrees with exudyn to {agrees:.1e}",
        {"strain_printed": strain["printed"], "strain_corrected": strain["right"],
         "shift_printed": shift, "shift_corrected": agrees},
    )  # fmt: skip


RingMesh = Callable[..., equations.Deflection]


def _ring_vectors(case: PaperCase, mesh: RingMesh) -> list[equations.Deflection]:
    stage = case.planetary
    return [mesh(stage, f"planet{n}", phi) for n, phi in enumerate(stage.angles, start=1)]


def _strain_of_translation(case: PaperCase, vector: Mapping[str, float]) -> float:
    """|δ| when every body moves by one unit along x, and along y; the larger of the two."""
    b, strains = case.planetary.name, []
    for direction in (0.0, np.pi / 2.0):
        motion = {}
        for body in case.planetary.bodies:
            motion[f"{b}.{body}.u"], motion[f"{b}.{body}.v"] = np.cos(direction), np.sin(direction)
        for number, phi in enumerate(case.planetary.angles, start=1):
            motion[f"{b}.planet{number}.u"] = np.cos(direction - phi)
            motion[f"{b}.planet{number}.v"] = np.sin(direction - phi)
        strains.append(abs(sum(c * motion.get(label, 0.0) for label, c in vector.items())))
    return float(max(strains))


def _with_ring_mesh(case: PaperCase, mesh: RingMesh) -> SecondOrderSystem:
    """Subsystem B without hub, its ring meshes deflecting as ``mesh`` says."""
    bare = case.drivetrain.model_copy(update={"couplings": (), "stages": (case.planetary,)})
    right = _ring_vectors(case, equations.ring_mesh)
    other = _ring_vectors(case, mesh)
    lumped = equations.drivetrain_elements(bare)
    springs = tuple(
        equations.Spring(s.stiffness, other[right.index(s.deflection)], s.damping)
        if s.deflection in right
        else s
        for s in lumped.springs
    )
    return equations.assemble(equations.Lumped(lumped.inertias, springs), bare.damping)


@statement(
    "eq7", "Wheel and hub", "Eqs. (4), (7), (15), Sec. 2",
    "θ(2,2) couples the wheel's shaft to the sun's: 'a rigid coupling of inertia I_A'.",
    "size of the printed K_bA against the DoFs of Eq. (4); the full system with nothing "
    "between wheel and hub",
)  # fmt: skip
def wheel_and_hub(bench: Bench) -> Finding:
    """Is the hub tied to the wheel?"""
    case = bench.case
    rows = len(printed.bearing_matrix_a(case.parallel))
    dofs = len(case.internal_a) + 1
    loose = exudyn_source().whole(case.with_wheel_spring(0.0).drivetrain)
    free = real_modes(loose)
    frf = direct_frf(loose, PROBE_HZ, case.internal_b, case.internal_a)
    passed = float(np.max(np.abs(frf.values)))
    tied = bench.modes()
    lowest = float(tied.natural_frequencies[tied.n_rigid])
    return Finding(
        Verdict.of(passed > 0.0 and rows == dofs, corrected=True),
        f"K_bA is {rows} × {rows} for {dofs} DoFs: no printed spring joins r₂θ(2) and θ(2,2). "
        f"Without one the full system has {free.n_rigid} rigid-body modes and the largest FRF "
        f"between the stages is {passed:.1e} m/N. With "
        f"{float(case.coupling.first_stiffness):.0e} N/m between wheel and hub it has "
        f"{tied.n_rigid}, and its lowest elastic mode is at {lowest:.1f} Hz",
        {"rows": float(rows), "dofs": float(dofs), "rigid_modes_untied": float(free.n_rigid),
         "rigid_modes_tied": float(tied.n_rigid), "largest_transfer_untied": passed,
         "lowest_mode_hz": lowest},
    )  # fmt: skip


@statement(
    "eq9", "Mesh of the parallel stage", "Eq. (9), Sec. 2.1",
    "qᵀ = [cos β, −cos β, cos β, −cos β, sin β, −sin β].",
    "natural frequencies with the printed vector against exudyn's helical mesh, at the paper's "
    f"own β and at {HELIX_DEG:g}°",
)  # fmt: skip
def mesh_of_a(bench: Bench) -> Finding:
    """Are six entries enough for eight DoFs?"""
    case = bench.case
    entries = len(printed.mesh_vector(case.parallel))
    own, helical = (_mesh_shift(case, beta) for beta in (case.parallel.helix_angle, HELIX_DEG))
    holds = helical[0] <= FRF_TOLERANCE
    return Finding(
        Verdict.of(holds, corrected=True),
        f"{entries} entries for {len(case.internal_a)} DoFs: sin β·(ρ₁ − ρ₂) is missing. At β = "
        f"{case.parallel.helix_angle:g}° the largest relative shift is {own[0]:.1e}; at "
        f"{HELIX_DEG:g}° {helical[1]:.1f} Hz becomes {helical[2]:.1f} Hz ({helical[0]:.1%})",
        {"shift_own": own[0], "shift_helical": helical[0]},
    )  # fmt: skip


def _mesh_shift(case: PaperCase, helix_angle: float) -> tuple[float, float, float]:
    stage = case.parallel.model_copy(update={"helix_angle": helix_angle})
    bare = case.drivetrain.model_copy(update={"couplings": (), "stages": (stage,)})
    lumped = equations.drivetrain_elements(bare)
    right = equations.parallel_mesh(stage)
    springs = tuple(
        equations.Spring(s.stiffness, printed.mesh_vector(stage), s.damping)
        if s.deflection == right
        else s
        for s in lumped.springs
    )
    misprinted = equations.assemble(equations.Lumped(lumped.inertias, springs), bare.damping)
    exact = exudyn_source().stage(bare, stage.name)
    return largest_shift(natural_frequencies(exact), natural_frequencies(misprinted))


@statement(
    "eq15", "Sign in the coupling formula", "Eq. (15), Sec. 3.1",
    "The last block of Eq. (15)'s column is +B_H_jc.",
    "Eq. (15) as printed against the full system, all FRFs",
)  # fmt: skip
def coupling_sign(bench: Bench) -> Finding:
    """What is the sign of the column's last block?"""
    case, model = bench.case, bench.exudyn()
    a, b = (direct_frf(model.stages[name], PROBE_HZ) for name in (case.a, case.b))
    values, labels = printed.coupled_receptance(a, b, case.hub)
    exact = direct_frf(model.whole, PROBE_HZ, labels, labels).values
    n = len(case.internal_a) + 1
    error = scaled_error(exact, values)
    across = float(np.max(error[:, :n, n:]))
    within = float(max(error[:, :n, :n].max(), error[:, n:, n:].max()))
    turned = values.copy()
    turned[:, :n, n:] *= -1.0
    turned[:, n:, :n] *= -1.0
    corrected = float(scaled_error(exact, turned).max())
    return Finding(
        Verdict.of(max(across, within) <= FRF_TOLERANCE, corrected <= FRF_TOLERANCE),
        f"between the stages the printed formula is wrong by a scaled error of {across:.2g}, "
        f"within them right to {within:.1e}; with −B_H_jc, which u_A = u_B asks for, all agree to "
        f"{corrected:.1e}: printed, every FRF from one stage to the other has the wrong sign",
        {"across_printed": across, "within_printed": within, "all_corrected": corrected},
    )  # fmt: skip


@statement(
    "kernel", "Kernel of the flexible joint", "below Eq. (15), Sec. 3.1",
    "For the flexible joint the kernel (A_H_cc + B_H_cc)⁻¹ is replaced by "
    "(A_H_cc + B_H_cc + K_s⁻¹).",
    "stages cut at the shaft spring and coupled through k_sw by the printed kernel, against "
    "the full system; FRFs of A, where signs play no part",
)  # fmt: skip
def flexible_kernel(bench: Bench) -> Finding:
    """Is the kernel inverted?"""
    case = bench.case
    split = SplitAtShaft(case)
    frfs = split.frfs(PROBE_HZ)
    a, b = frfs.values()
    values, labels = printed.flexibly_coupled_receptance(
        a, b, (case.hub, split.end), case.shaft_stiffness
    )
    keep = [i for i, label in enumerate(labels) if label != split.end]
    names = tuple(labels[i] for i in keep)
    exact = direct_frf(bench.exudyn().whole, PROBE_HZ, names, names).values
    n = len(a.responses)
    own = scaled_error(exact, values[:, keep][:, :, keep])[:, :n, :n]
    right = split.coupled(frfs, case.shaft_stiffness).select(names, names).values
    printed_error, corrected = float(own.max()), float(scaled_error(exact, right).max())
    return Finding(
        Verdict.of(printed_error <= FRF_TOLERANCE, corrected <= FRF_TOLERANCE),
        f"printed, the scaled error is up to {printed_error:.2g} (a flexibility stands where its "
        f"inverse belongs); with (A_H_cc + B_H_cc + K_s⁻¹)⁻¹ it is {corrected:.1e}",
        {"printed": printed_error, "corrected": corrected},
    )  # fmt: skip
