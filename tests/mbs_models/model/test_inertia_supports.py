"""Supports of plain inertias, strain shares, and where parts stand, by closed forms."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from mbs_models import drivetrain_modes
from mbs_models.model.model_file import loads
from mbs_models.model.placement import place_parts
from tests.strategies import paper
from validation.routes.source import equations_source, exudyn_source

R, HUB = 0.2, 0.05  # m: the inertias' radius, and the coupling's
I_A, I_B, K_A, K_C = 3.0, 5.0, 4e4, 9e4  # kg m², N m/rad; the coupling's at its radius is K_C/HUB²


def two(support: str) -> str:
    return f"""name = "two"
[[inertia]]
name = "a"
radius = {R}
polar_inertia = {I_A}
{support}
[[inertia]]
name = "b"
radius = {R}
polar_inertia = {I_B}
[[coupling]]
name = "c"
first = "a"
second = "b"
radius = {HUB}
inertia_over_r2 = 0.0
first_stiffness = "rigid"
second_stiffness = {K_C / HUB**2}
"""


SUPPORTS = (f"torsional_stiffness = {K_A}", f"torsional_support = {K_A / R**2}")


@pytest.mark.parametrize("support", SUPPORTS)
def test_a_support_is_in_newton_metres_or_at_the_radius(support: str) -> None:
    """K θ = ω² I θ of two inertias, one on K_A; strain by spring."""
    stiffness = np.array([[K_A + K_C, -K_C], [-K_C, K_C]])
    root = np.diag([I_A**-0.5, I_B**-0.5])
    squares, shapes = np.linalg.eigh(root @ stiffness @ root)
    drivetrain = loads(two(support))
    for source in (exudyn_source(drivetrain), equations_source(drivetrain)):
        found = [mode.frequency_hz for mode in source.modes.modes]
        np.testing.assert_allclose(found, np.sqrt(squares) / (2.0 * np.pi), rtol=1e-9)
    for mode, theta in zip(drivetrain_modes(drivetrain).modes, (root @ shapes).T, strict=True):
        part, coupling = K_A * theta[0] ** 2, K_C * (theta[0] - theta[1]) ** 2
        assert mode.shares.strain["c"] == pytest.approx(coupling / (part + coupling), rel=1e-8)
        assert mode.shares.strain["a"] == pytest.approx(part / (part + coupling), rel=1e-8)


def test_coupled_bodies_are_coaxial_wherever_they_are_in_the_train() -> None:
    """Three stages and a load: each is placed from its neighbour, not from the first."""
    stage = paper().stages[0].model_dump(exclude_none=True)
    parts = [f"s{k}" for k in range(1, 4)]
    base = paper()
    data = base.model_dump(by_alias=True, exclude_unset=True, exclude_none=True)
    data["stage"] = [{**stage, "name": name} for name in parts]
    link = data["coupling"][0]
    data["coupling"] = [
        {**link, "name": f"c{k}", "first": f"{a}.wheel", "second": f"{b}.pinion"}
        for k, (a, b) in enumerate(pairwise(parts))
    ]
    drivetrain = type(base).model_validate(data)
    frames = place_parts(drivetrain)
    for coupling in drivetrain.couplings:
        first, second = (
            frames[body.partition(".")[0]].point(drivetrain.members[body].centre)
            for body in coupling.bodies
        )
        np.testing.assert_allclose(first[:2], second[:2], atol=1e-12)
    ends = [frames[name].point(np.zeros(3)) for name in parts]
    assert len({tuple(np.round(end[:2], 9)) for end in ends}) == 3
