"""Chains of planetary stages: a drivetrain of any length, all its stages different."""

from __future__ import annotations

from mbs_models.model.parameters import Damping, Drivetrain, PlanetaryStage


def planetary_chain(
    stage: PlanetaryStage,
    count: int,
    *,
    variation: float = 0.2,
    shaft_stiffness: float = 1e8,
    hub_inertia: float = 0.05,
    damping: Damping | None = None,
) -> Drivetrain:
    """Stages in a row, each one's carrier on the next one's sun.

    Parameters
    ----------
    stage
        What each stage is like.
    count
        How many.
    variation
        Stage i of n is stiffer by 1 + variation · i/n in every mesh: no two are alike.
    shaft_stiffness
        Of both springs of the couplings between them (N/m at the sun's base radius).
    hub_inertia
        Of each coupling's hub, over the sun's base radius squared (kg).
    damping
        Of the drivetrain (None: undamped).
    """
    stages = [_stiffer(stage, f"stage{i + 1}", 1.0 + variation * i / count) for i in range(count)]
    couplings = [
        {
            "name": f"shaft{i}",
            "first": f"stage{i}.carrier",
            "second": f"stage{i + 1}.sun",
            "radius": stage.sun.base_radius,
            "inertia_over_r2": hub_inertia,
            "first_stiffness": shaft_stiffness,
            "second_stiffness": shaft_stiffness,
        }
        for i in range(1, count)
    ]
    return Drivetrain.model_validate(
        {
            "name": f"{count} planetary stages",
            "damping": (damping or Damping()).model_dump(),
            "stage": [s.model_dump(exclude_unset=True) for s in stages],
            "coupling": couplings,
        }
    )


def _stiffer(stage: PlanetaryStage, name: str, factor: float) -> PlanetaryStage:
    table = stage.model_dump(exclude_unset=True)
    meshes = {
        key: [k * factor for k in values]
        for key, values in (
            ("sun_mesh_stiffness", stage.sun_meshes),
            ("ring_mesh_stiffness", stage.ring_meshes),
        )
    }
    return PlanetaryStage.model_validate(table | meshes | {"name": name})
