"""The paper's formulas: each printed one against exudyn's bodies and springs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from fbs import RealModes, SecondOrderSystem, direct_frf, real_modes

from ..arrays import FloatArray
from ..checks.frfs import FRF_TOLERANCE
from ..checks.metrics import scaled_error
from ..routes import equations
from ..routes.source import exudyn_source
from . import printed
from .bench import ZERO, Bench
from .case import PaperCase
from .item import Finding, Verdict, statement
from .printed_values import PROBE_HZ
from .shaft import split_at_shaft

PRINTED_DOFS = (9, 22)
"""Of subsystems A and B, Sec. 2.1."""

RAYLEIGH = 1e-6
"""β (s) of C = βK, to try Eq. (17) with damping; the paper neglects it."""

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
    exact = natural_frequencies(case.uncoupled.stage(stage.name))
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
    "eq5", "Order and number of DoFs", "Eqs. (4), (5), (11), Sec. 2.1",
    "Subsystem A has 9 DoFs, subsystem B 22, and AB those of both with θ(2,2) counted once.",
    "DoFs counted in Eqs. (4), (5) and (11), against those of exudyn's systems",
)  # fmt: skip
def order_of_dofs(bench: Bench) -> Finding:
    """Are the vectors of DoFs as long as the systems?"""
    case, model = bench.case, bench.exudyn()
    written = {case.a: (*case.internal_a, case.hub), case.b: (case.hub, *case.internal_b)}
    alike = all(sorted(model.stages[name].dofs) == sorted(own) for name, own in written.items())
    a, b, ab = len(written[case.a]), len(written[case.b]), len(case.dofs)
    whole = sorted(dof.label for dof in case.dofs) == sorted(model.whole.dofs)
    return Finding(
        Verdict.of(alike and whole and (a, b) == PRINTED_DOFS and ab == a + b - 1),
        f"with {case.planetary.planet_count} planets: {a}, {b} = 10 + 3N and {ab} = {a} + {b} − 1, "
        f"as many as exudyn's systems have {'and' if alike and whole else 'but not'} the same ones",
        {"dofs_a": float(a), "dofs_b": float(b), "dofs_ab": float(ab)},
    )


@statement(
    "eq6", "Mass matrices, and the hub as an angle", "Eqs. (6), (10), (12), (24), Sec. 2.1",
    "M_A and M_B end and begin with I_A/2, M_AB has I_A; θ(2,2) is an angle among lengths r θ.",
    "the printed diagonals, I_A read as I/r², against exudyn's mass matrices; and what a rigid "
    "rotation strains k_sw of Eq. (24) if θ(2,2) is an angle in rad",
)  # fmt: skip
def mass_matrices(bench: Bench) -> Finding:
    """Do the printed masses and the printed shaft spring mean the same coordinate?"""
    case, model = bench.case, bench.exudyn()
    hub, radius = case.coupling.hub_mass, case.coupling.radius
    a, b = printed.masses_a(case.parallel, hub), printed.masses_b(case.planetary, hub)
    whole = [*a[:-1], 2.0 * b[0], *b[1:]]
    labels = [dof.label for dof in case.dofs]
    n = len(a)
    errors = [
        _diagonal_error(model.stages[case.a], labels[:n], a),
        _diagonal_error(model.stages[case.b], labels[n - 1 :], b),
        _diagonal_error(model.whole, labels, whole),
    ]
    strain = 1.0 - radius  # of k_sw per rad: the sun moves by w_s = r, the hub by θ = 1
    return Finding(
        Verdict.of(max(errors) <= ZERO and strain == 0.0, max(errors) <= ZERO),
        f"with I_A as I/r² in kg the diagonals are exudyn's masses, to {max(errors):.1e}, in the "
        f"order of the DoFs. As printed, I_A is in kg m² and θ(2,2) in rad: then a rigid rotation "
        f"by 1 rad (w_s = {radius:g} m) strains k_sw by {strain:.3g}, of m and rad mixed. With "
        "r θ(2,2) and I_A/r², as for the other bodies, it is not strained",
        {"largest_error": max(errors), "strain_of_rigid_rotation": strain},
    )


def _diagonal_error(system: SecondOrderSystem, labels: list[str], masses: list[float]) -> float:
    """Largest difference of a printed diagonal from M, against the masses of both DoFs."""
    at = [system.dofs.index(label) for label in labels]
    size = np.sqrt(np.outer(masses, masses))
    return float(np.max(np.abs(system.mass[np.ix_(at, at)] - np.diag(masses)) / size))


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
    loose = case.with_wheel_spring(0.0).exudyn.whole
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
    exact = exudyn_source(bare).stage(stage.name)
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
    split = bench.once(split_at_shaft)
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


@statement(
    "eq17", "FRF as a sum over modes", "Eqs. (16), (17), Sec. 3.2",
    "For proportionally damped systems H_jk = Σ_r φ_j φ_k/(ω_r² − ω² + 2jξ_r ω_r ω), n the number "
    "of DoFs.",
    f"the sum over all modes of exudyn's matrices against H⁻¹ = K − ω²M + jωC, undamped and with "
    f"C = βK, β = {RAYLEIGH:g} s",
)  # fmt: skip
def sum_over_modes(bench: Bench) -> Finding:
    """Is the printed sum the receptance, rigid-body modes included?"""
    whole = bench.exudyn().whole
    modes = bench.modes()
    errors = {
        beta: _modal_error(replace(whole, damping=beta * whole.stiffness), modes, beta)
        for beta in (0.0, RAYLEIGH)
    }
    short = _modal_error(whole, modes, 0.0, modes.n_rigid)
    return Finding(
        Verdict.of(max(errors.values()) <= FRF_TOLERANCE),
        f"all FRFs agree to {errors[0.0]:.1e} undamped and to {errors[RAYLEIGH]:.1e} damped, "
        f"ξ_r = β ω_r/2, when the sum includes the {modes.n_rigid} rigid-body mode (ω_r = 0); "
        f"without it they are off by up to {short:.2g}",
        {"undamped": errors[0.0], "damped": errors[RAYLEIGH], "without_rigid_body": short},
    )


def _modal_error(system: SecondOrderSystem, modes: RealModes, beta: float, first: int = 0) -> float:
    """Largest scaled error of Eq. (17) against Eq. (16) (``first``: modes before are left out)."""
    exact = direct_frf(system, PROBE_HZ, system.dofs, system.dofs).values
    omega = 2.0 * np.pi * PROBE_HZ[:, None]
    w = 2.0 * np.pi * modes.natural_frequencies[first:]
    shapes = modes.shapes[:, first:]
    weights = 1.0 / (w**2 - omega**2 + 1j * omega * beta * w**2)
    summed = np.einsum("jr,fr,kr->fjk", shapes, weights, shapes)
    return float(scaled_error(exact, summed).max())
