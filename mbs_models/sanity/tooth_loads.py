"""Torques that teeth cannot carry: N mm typed for N m, or kN m taken twice.

A mesh of stiffness k = c_γ b under the force F is pressed together by F/k = (F/b)/c_γ. Teeth carry
line loads F/b of some hundred, at most two thousand N/mm; with c_γ = 14 N/(mm µm) that is 0.15 mm.
"""

from __future__ import annotations

from collections.abc import Iterator

from ..gears.power_flow import PowerFlow
from ..model.parameters import Drivetrain
from .finding import Finding

LARGEST_DEFLECTION = 5e-4  # m: three times that, so that only a wrong unit is beyond


def teeth_carry_load(drivetrain: Drivetrain, flow: PowerFlow) -> Iterator[Finding]:
    """A torque of ``[operation]`` under which a mesh gives way by more than 0.5 mm."""
    if drivetrain.operation is None or drivetrain.operation.torque is None or not flow.mesh_forces:
        return
    stiffness = _mesh_stiffness(drivetrain)
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


def _mesh_stiffness(drivetrain: Drivetrain) -> dict[str, float]:
    """Mesh → N/m, of the meshes that are springs at all."""
    return {
        mesh: value
        for family in drivetrain.mesh_families
        for mesh, value in zip(family.names, family.stiffness, strict=True)
        if value > 0.0
    }
