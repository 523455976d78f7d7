"""Eq. (3): what the varying part k(t) of the mesh stiffness, left out in the paper, would do.

    M q̈ + [K + Σ_j k_j κ(f_mesh t − γ_j) v_j v_jᵀ] q = 0,    κ(τ) = a cos 2πτ

by Floquet theory (`routes.floquet`) and by Hill's method for an FRF. The paper gives no variation:
a share a of the mean is assumed.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from threadpoolctl import threadpool_limits

from mbs_models.contact.mesh_excitation import MeshLaw
from mbs_models.signals.waveforms import FourierSeries
from mbs_models.stages.part import mesh_name
from mbs_models.stages.planet_set import mesh_phases

from ..arrays import FloatArray
from ..report.page import Note, Table
from ..routes.floquet import ParametricSystem, Tongue, growth_rate, parametric_system, tongues
from .bench import Bench
from .case import TABLE_2, PaperCase
from .item import Finding, Verdict, statement
from .printed_values import TABLE_2 as PRINTED
from .printed_values import TABLE_BAND_HZ

VARIATION = 0.1
"""a, of the mean stiffness: half of a peak-to-peak variation of a fifth, little for spur teeth."""

LEAST_WIDTH_HZ = 1.0
"""Half width of the regions that count."""

LISTED = 6

SPEEDS_RPM = (1000.0, 3000.0, 6000.0)
"""Of the sun, at which FRFs are compared."""

LINES = np.arange(103.0, 4000.0, 30.0)
"""Hz, off the poles of Table 2's stage."""


def varying_stage(bench: Bench) -> ParametricSystem:
    """The planetary stage of Table 2, whose teeth are printed, its meshes in their phases."""
    case = PaperCase(bench.cases[TABLE_2].drivetrain)
    stage = case.planetary
    bare = case.drivetrain.model_copy(update={"couplings": (), "stages": (stage,)})
    phases = mesh_phases(stage.planet_set)
    wave = FourierSeries((VARIATION,), (0.0,))
    laws = {
        mesh_name(f"{stage.name}.{member}", f"{stage.name}.planet{n}"): MeshLaw(1.0, phase, wave)
        for member, own in (("sun", phases.sun), ("ring", phases.ring))
        for n, phase in enumerate(own, start=1)
    }
    return parametric_system(bare, laws, highest_hz=TABLE_BAND_HZ)


def mesh_frequency(sun_rpm: float) -> float:
    """f_mesh = (n_s/60) z_s z_r / (z_s + z_r), ring held (Hz)."""
    teeth = {gear.name: gear.teeth for gear in PRINTED.gears}
    per_turn = teeth["sun"] * teeth["ring"] / (teeth["sun"] + teeth["ring"])
    return sun_rpm / 60.0 * per_turn


def sun_speed(frequency: float) -> float:
    """The sun's rpm at a mesh frequency (Hz)."""
    return frequency / mesh_frequency(1.0)


def changed_frf(system: ParametricSystem, mesh_frequency: float) -> FloatArray:
    """(n_frequency,) |ΔH|/|H| of the first mesh's deflection by its own force, sideband 0.

    With η = Σ_m η_m exp(j(ω + m ω_mesh)t) and κ_j = a cos, the lines m = −1, 0, 1 are tied by

        (Ω² − (ω + m ω_mesh)²) η_m + (E* η_{m+1} + E η_{m−1})/2 = f δ_{m0},    E = Σ_j c_j w_j w_jᵀ
    """
    n, rows = len(system.omega), system.participation
    phasors = VARIATION * np.exp(-2j * np.pi * np.array([law.phase for law in system.laws]))
    up = np.einsum("j,jp,jq->pq", phasors, rows, rows) / 2.0
    hill = np.zeros((len(LINES), 3, n, 3, n), dtype=complex)
    for m in range(3):
        omega = 2.0 * np.pi * (LINES + (m - 1) * mesh_frequency)
        hill[:, m, range(n), m, range(n)] = system.omega**2 - omega[:, None] ** 2
    for m in range(2):
        hill[:, m + 1, :, m, :], hill[:, m, :, m + 1, :] = up, up.conj()
    force = np.zeros((3, n))
    force[1] = rows[0]
    size = 3 * n
    motion = np.linalg.solve(hill.reshape(-1, size, size), force.ravel()[:, None])
    varying = motion.reshape(-1, 3, n)[:, 1] @ rows[0]
    constant = (rows[0] ** 2 / (system.omega**2 - (2.0 * np.pi * LINES[:, None]) ** 2)).sum(axis=1)
    change: FloatArray = np.abs(varying / constant - 1.0)
    return change


@statement(
    "eq3", "Mesh stiffness taken as constant", "Eq. (3), Sec. 2.1",
    "K_i = K_bi + K(t); the mesh stiffness is assumed constant and its varying part is neglected.",
    "the planetary stage of Table 2, whose teeth are printed, with every mesh varying by "
    f"±{VARIATION:.0%} in its own phase: Floquet multipliers where the mesh frequency is a sum of "
    "two natural frequencies, and an FRF at other speeds", subject="formulas",
)  # fmt: skip
def constant_stiffness(bench: Bench) -> Finding:
    """At which speeds does leaving k(t) out change the answer?"""
    with threadpool_limits(1, "blas"):  # many small matrices
        system = varying_stage(bench)
        found = sorted(tongues(system, (1,), narrowest_hz=LEAST_WIDTH_HZ), key=lambda r: r.centre)
        regions = found[:LISTED]
        grown = [growth_rate(system, each.centre) for each in regions]
        changes = {n: float(np.median(changed_frf(system, mesh_frequency(n)))) for n in SPEEDS_RPM}
    unstable = [r for r, rate in zip(regions, grown, strict=True) if rate > r.growth_rate / 2.0]
    speeds = ", ".join(f"{sun_speed(r.centre):.0f}" for r in unstable)
    listed = ", ".join(f"{change:.1%} at {n:.0f} rpm" for n, change in changes.items())
    return Finding(
        Verdict.of(not unstable, corrected=True),
        f"where the mesh frequency is f_p + f_q the undamped stage is unstable and has no steady "
        f"FRF: first at {speeds} rpm of the sun. At other speeds a force at f is answered at "
        f"f ± f_mesh as well, and the FRF at f itself changes by a median of {listed}, which is of "
        f"second order in the variation. At rest k(t) is constant and nothing is left out",
        {"unstable_regions": float(len(unstable)), "largest_growth": max(grown),
         **{f"unstable_{i}_rpm": sun_speed(r.centre) for i, r in enumerate(unstable, start=1)},
         **{f"median_change_{n:.0f}_rpm": change for n, change in changes.items()}},
        blocks=(_table(regions, grown), Note(
            f"Every mesh varies by ±{VARIATION:.0%}; widths and growth rates are in proportion to "
            "that. The reducer has no printed tooth numbers, and so no mesh frequency.")),
    )  # fmt: skip


def _table(regions: Sequence[Tongue], grown: Sequence[float]) -> Table:
    headings = (
        "Natural frequencies (Hz)", "Mesh frequency (Hz)", "Sun (rpm)", "Half width (rpm)",
        "Growth, first order (1/s)", "Growth, Floquet (1/s)",
    )  # fmt: skip
    rows = tuple(
        (f"{r.modes[0]:.1f} + {r.modes[1]:.1f}", f"{r.centre:.1f}", f"{sun_speed(r.centre):.0f}",
         f"{sun_speed(r.half_width):.0f}", f"{r.growth_rate:.3g}", f"{rate:.3g}")
        for r, rate in zip(regions, grown, strict=True)
    )  # fmt: skip
    return Table(headings, rows, frozenset(range(1, 6)))
