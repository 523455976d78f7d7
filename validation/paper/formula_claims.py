"""Claims about the paper's formulas: each printed one against exudyn's bodies and springs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import numpy as np

from fbs import SecondOrderSystem, direct_frf, real_modes
from fbs.condensation import block_dofs

from ..checks.frfs import FRF_TOLERANCE
from ..checks.metrics import scaled_error
from ..routes import equations
from ..routes.source import exudyn_source
from . import printed
from .appendix_claims import appendix_claims
from .condensation import condensations, locked_check
from .curves import ZERO, FrfBench, couple_points
from .model import PaperCase
from .results import Claim, FloatArray, Verdict
from .timing import SplitAtShaft

PROBE_HZ = np.arange(105.0, 4000.0, 10.0)
"""Lines on which printed formulas are compared, off the poles of the presets."""

HELIX_DEG = 20.0
"""A helix angle to try Eq. (9) with; the paper's own is zero."""


def formula_claims(bench: FrfBench) -> Iterator[Claim]:
    """Eqs. (1), (4), (7), (9), (15), (19), (21), (30), (31) and Appendix A."""
    case = bench.case
    yield ring_mesh_claim(case)
    yield unconnected_claim(bench)
    yield helix_claim(case)
    yield sign_claim(bench)
    yield kernel_claim(bench)
    yield from condensation_claims(bench)
    yield from appendix_claims(case)


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


def ring_mesh_claim(case: PaperCase) -> Claim:
    """Eq. (1): a rigid translation of the whole stage must not strain a mesh."""
    stage = case.planetary
    strain = {
        name: max(_strain_of_translation(case, vector) for vector in vectors)
        for name, vectors in (
            ("printed", _ring_vectors(case, printed.ring_deflection)),
            ("right", _ring_vectors(case, equations.ring_mesh)),
        )
    }
    bare = case.drivetrain.model_copy(update={"couplings": ()})
    exact = natural_frequencies(exudyn_source(bare).stage(stage.name))
    shift, own, misprinted = largest_shift(
        exact, natural_frequencies(_with_ring_mesh(case, printed.ring_deflection))
    )
    agrees = largest_shift(exact, natural_frequencies(equations.stage_system(bare, stage.name)))[0]
    holds = strain["printed"] <= ZERO and shift <= FRF_TOLERANCE
    return Claim(
        "eq1", "Ring-planet mesh",
        "δ_rp contains u_c, and φ_rp = φ_p − α_r.", "Eq. (1), Sec. 2",
        "strain of the printed δ_rp in a rigid translation of the stage, and frequencies of "
        "K = Σ k v vᵀ with it, against exudyn's springs between tangent points",
        Verdict.HOLDS if holds else Verdict.CORRECTED,
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


def unconnected_claim(bench: FrfBench) -> Claim:
    """Eqs. (4), (7): is the hub tied to the wheel?"""
    case = bench.case
    rows = len(printed.bearing_matrix_a(case.parallel))
    dofs = len(case.internal_a) + 1
    loose = exudyn_source(case.with_wheel_spring(0.0).drivetrain).whole
    free = real_modes(loose)
    frf = direct_frf(loose, PROBE_HZ, case.internal_b, case.internal_a)
    passed = float(np.max(np.abs(frf.values)))
    tied = bench.systems.modes()
    lowest = float(tied.natural_frequencies[tied.n_rigid])
    return Claim(
        "eq7", "Wheel and hub",
        "θ(2,2) couples the wheel's shaft to the sun's: 'a rigid coupling of inertia I_A'.",
        "Eqs. (4), (7), (15), Sec. 2",
        "size of the printed K_bA against the DoFs of Eq. (4); the full system with nothing "
        "between wheel and hub",
        Verdict.HOLDS if passed > 0.0 and rows == dofs else Verdict.CORRECTED,
        f"K_bA is {rows} × {rows} for {dofs} DoFs: no printed spring joins r₂θ(2) and θ(2,2). "
        f"Without one the full system has {free.n_rigid} rigid-body modes and the largest FRF "
        f"between the stages is {passed:.1e} m/N. With "
        f"{float(case.coupling.first_stiffness):.0e} N/m between wheel and hub it has "
        f"{tied.n_rigid}, and its lowest elastic mode is at {lowest:.1f} Hz",
        {"rows": float(rows), "dofs": float(dofs), "rigid_modes_untied": float(free.n_rigid),
         "rigid_modes_tied": float(tied.n_rigid), "largest_transfer_untied": passed,
         "lowest_mode_hz": lowest},
    )  # fmt: skip


def helix_claim(case: PaperCase) -> Claim:
    """Eq. (9): six entries for eight DoFs."""
    entries = len(printed.mesh_vector(case.parallel))
    own, helical = (_mesh_shift(case, beta) for beta in (case.parallel.helix_angle, HELIX_DEG))
    holds = helical[0] <= FRF_TOLERANCE
    return Claim(
        "eq9", "Mesh of the parallel stage",
        "qᵀ = [cos β, −cos β, cos β, −cos β, sin β, −sin β].", "Eq. (9), Sec. 2.1",
        f"natural frequencies with the printed vector against exudyn's helical mesh, β = "
        f"{case.parallel.helix_angle:g}° and {HELIX_DEG:g}°",
        Verdict.HOLDS if holds else Verdict.CORRECTED,
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
    exact = exudyn_source(bare).stage(stage.name)
    return largest_shift(natural_frequencies(exact), natural_frequencies(misprinted))


def sign_claim(bench: FrfBench) -> Claim:
    """Eq. (15): the sign of the column's last block."""
    case, model = bench.case, bench.systems.exudyn()
    a, b = (direct_frf(model.stages[n], PROBE_HZ) for n in (case.parallel.name,
                                                            case.planetary.name))  # fmt: skip
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
    return Claim(
        "eq15", "Sign in the coupling formula",
        "The last block of Eq. (15)'s column is +B_H_jc.", "Eq. (15), Sec. 3.1",
        "Eq. (15) as printed against the full system, all FRFs",
        _corrected(max(across, within), corrected),
        f"between the stages the printed formula is wrong by a scaled error of {across:.2g}, "
        f"within them right to {within:.1e}; with −B_H_jc, which u_A = u_B asks for, all agree to "
        f"{corrected:.1e}: printed, every FRF from one stage to the other has the wrong sign",
        {"across_printed": across, "within_printed": within, "all_corrected": corrected},
    )  # fmt: skip


def _corrected(printed_error: float, corrected_error: float) -> Verdict:
    if printed_error <= FRF_TOLERANCE:
        return Verdict.HOLDS
    return Verdict.CORRECTED if corrected_error <= FRF_TOLERANCE else Verdict.FAILS


def kernel_claim(bench: FrfBench) -> Claim:
    """The flexible joint's kernel."""
    case = bench.case
    split = SplitAtShaft(case)
    frfs = split.frfs(PROBE_HZ)
    a, b = frfs.values()
    values, labels = printed.flexibly_coupled_receptance(
        a, b, (case.hub, split.end), case.shaft_stiffness
    )
    keep = [i for i, label in enumerate(labels) if label != split.end]
    names = tuple(labels[i] for i in keep)
    exact = direct_frf(bench.systems.exudyn().whole, PROBE_HZ, names, names).values
    n = len(a.responses)
    own = scaled_error(exact, values[:, keep][:, :, keep])[:, :n, :n]
    right = split.coupled(frfs, case.shaft_stiffness).select(names, names).values
    printed_error, corrected = float(own.max()), float(scaled_error(exact, right).max())
    return Claim(
        "kernel", "Kernel of the flexible joint",
        "For the flexible joint the kernel (A_H_cc + B_H_cc)⁻¹ is replaced by "
        "(A_H_cc + B_H_cc + K_s⁻¹).", "below Eq. (15), Sec. 3.1",
        "stages cut at the shaft spring and coupled through k_sw by the printed kernel, against "
        "the full system; FRFs of A, where signs play no part",
        _corrected(printed_error, corrected),
        f"printed, the scaled error is up to {printed_error:.2g} (a flexibility stands where its "
        f"inverse belongs); with (A_H_cc + B_H_cc + K_s⁻¹)⁻¹ it is {corrected:.1e}",
        {"printed": printed_error, "corrected": corrected},
    )  # fmt: skip


def condensation_claims(bench: FrfBench) -> Iterator[Claim]:
    """Eqs. (19), (21), (30), (31)."""
    case, model = bench.case, bench.systems.exudyn()
    labels = tuple(dof.label for dof in case.dofs)
    ab = couple_points(model, PROBE_HZ, labels)
    a, b, hub = case.internal_a, case.internal_b, (case.hub,)
    check = locked_check(bench, condensations(case)[0])
    free = ab.select(a, a).values
    full = direct_frf(model.whole, PROBE_HZ, labels, labels)
    right = float(scaled_error(full.values, ab.select(labels, labels).values).max())
    locked = direct_frf(_stage_locked(model.stages[case.parallel.name], a), PROBE_HZ, a, a).values
    apart = float(scaled_error(locked, free).max())
    below = [f for f in check.frequencies_hz if f < 1e5]
    yield Claim(
        "eq31", "Meaning of the condensed receptance",
        "With no force on the slaves, the condensed receptance is H_MM − H_MS H_SS⁻¹ H_SM.",
        "Eqs. (29)–(31), Appendix B",
        "Eq. (31) for A in AB against exudyn with hub and B locked in the model, and against H_MM",
        Verdict.FAILS if apart > FRF_TOLERANCE else Verdict.HOLDS,
        f"Eq. (31) equals exudyn's model with the {check.locked} slave coordinates locked to "
        f"{check.formula_error:.1e} (natural frequencies {_listed(below)} Hz, to "
        f"{check.frequency_error:.1e}): it is u_S = 0, not f_S = 0. For f_S = 0 the receptance is "
        f"H_MM, which the coupled FRFs give to {right:.1e}; the two differ by a scaled error of up "
        f"to {apart:.2g}. The formula is right for a dynamic stiffness",
        {"formula_against_locked": check.formula_error, "frequency_error": check.frequency_error,
         "locked_against_free": apart},
    )  # fmt: skip
    whole = float(np.max(scaled_error(full.values, np.zeros_like(full.values))
                         [:, : len(a), len(a) + 1 :]))  # fmt: skip
    yield Claim(
        "eq19", "No FRF between the stages",
        "[H]_ab = 0.", "below Eq. (19), Sec. 3.3",
        "largest |H_ab|/√(h_a h_b) of the full system",
        Verdict.HOLDS if whole <= ZERO else Verdict.FAILS,
        f"|H_ab|/√(h_a h_b) is up to {whole:.2g}: a force on A moves B through the hub. It is the "
        "dynamic stiffness that has no entry between them",
        {"largest": whole},
    )  # fmt: skip
    literal = scaled_error(locked, printed.condensed_a(ab, a, hub, b)).max(axis=(1, 2))
    yield Claim(
        "eq21", "Condensed subsystem A",
        "A_H = H_aa − H_ac (H_cc − H_cb H_bb⁻¹ H_bc)⁻¹ H_ca.", "Eq. (21), Sec. 3.3",
        "Eq. (21) letter by letter with the coupled FRFs, against exudyn with hub and B locked",
        Verdict.HOLDS if float(literal.max()) <= FRF_TOLERANCE else Verdict.CORRECTED,
        f"it is Eq. (31) less the terms with H_ab: {np.median(literal):.1e} (median) but up to "
        f"{literal.max():.2g} (at {PROBE_HZ[int(np.argmax(literal))]:.0f} Hz) from the system with "
        f"hub and B locked, at {_listed(below)} Hz; by Eq. (31) with c and b as slaves it is that "
        f"to {check.formula_error:.1e}",
        {"median": float(np.median(literal)), "worst": float(literal.max())},
    )  # fmt: skip


def _stage_locked(stage: SecondOrderSystem, kept: tuple[str, ...]) -> SecondOrderSystem:
    return block_dofs(stage, [label for label in stage.dofs if label not in kept])


def _listed(frequencies: list[float]) -> str:
    unique = list(dict.fromkeys(f"{f:.1f}" for f in frequencies))
    counts = [sum(f"{f:.1f}" == u for f in frequencies) for u in unique]
    return ", ".join(f"{u}({n})" if n > 1 else u for u, n in zip(unique, counts, strict=True))
