"""Teeth: numbers that only rounding of the radii or profile shift explains, and too large torques.

A mesh of stiffness k = c_γ b under the force F is pressed together by F/k = (F/b)/c_γ. Teeth carry
line loads F/b of some hundred, at most two thousand N/mm; with c_γ = 14 N/(mm µm) that is 0.15 mm.
"""

from __future__ import annotations

from collections.abc import Iterator

from ..gears.power_flow import PowerFlow
from ..model.parameters import Drivetrain
from ..model.tooth_numbers import another_is_nearer, expected, gear_pairs
from ..stages.part import Part
from .finding import Finding

LARGEST_DEFLECTION = 5e-4  # m: three times that, so that only a wrong unit is beyond


def teeth_fit_radii(part: Part) -> Iterator[Finding]:
    """Tooth numbers that are explained by nothing but the rounding of the radii."""
    for first, second in gear_pairs(part):
        if another_is_nearer(first, second):
            reason = (
                f"{expected(first, second)}; only the rounding of the radii allows another number"
            )
            yield Finding(part.name, f"{second.name}.teeth", f"{second.teeth}", reason)


def ring_closes(part: Part) -> Iterator[Finding]:
    """A ring that is a tooth or two off z_s + 2 z_p, with one pressure angle for both meshes."""
    for planets in part.planet_sets():
        if planets.teeth_over:
            yield Finding(
                part.name,
                "ring.teeth",
                f"{planets.ring_teeth}",
                f"expected z_s + 2 z_p = {planets.standard_ring}; a profile-shifted set may "
                "differ, but its sun and ring meshes have different working pressure angles: give "
                "sun_pressure_angle and ring_pressure_angle",
            )


def teeth_carry_load(drivetrain: Drivetrain, flow: PowerFlow) -> Iterator[Finding]:
    """A torque of ``[operation]`` under which a mesh gives way by more than 0.5 mm.

    N mm are typed for N m, or kN m are taken twice.
    """
    if drivetrain.operation is None or drivetrain.operation.torque is None or not flow.mesh_forces:
        return
    stiffness = {
        mesh: value
        for family in drivetrain.mesh_families
        for mesh, value in zip(family.names, family.stiffness, strict=True)
        if value > 0.0
    }
    worst = max(stiffness, key=lambda name: flow.mesh_forces[name] / stiffness[name])
    deflection = flow.mesh_forces[worst] / stiffness[worst]
    if deflection > LARGEST_DEFLECTION:
        torque = drivetrain.operation.torque
        reason = (
            f"{worst} gives way by {1e3 * deflection:.3g} mm under {flow.mesh_forces[worst]:.3g} N;"
            f" expected at most {1e3 * LARGEST_DEFLECTION:g} mm, that is "
            f"{abs(torque) * LARGEST_DEFLECTION / deflection:.4g} N m"
        )
        yield Finding("operation", "torque", f"{torque:g} N m", reason)
