"""Shweiki et al. 2016, ISMA, pp. 1407–1416, Tables 1 and 2: mesh phases of the NREL GRC planets.

Their Eqs. (7)–(9) are Parker & Lin's (2004): γ_sn = z_s ψ_n/2π, γ_rn = −z_r ψ_n/2π, ψ_n = 2π p_n/
(z_r + z_s), and γ_rs is added. γ_rs = 0.2805 is taken as printed: its tooth thicknesses are not
given.

The ring's phases of the second row are printed 0.9305 and 0.5805, which is + z_r ψ_n/2π + γ_rs: the
minus of their Eq. (8) is lost. With it γ_rn − γ_rs = γ_sn, as Eqs. (7)–(9) demand of any planets
that can be put in; so it is here.
"""

from __future__ import annotations

import pytest

from mbs_models.model.model_file import load
from mbs_models.model.parameters import PlanetaryStage
from mbs_models.stages.planet_set import mesh_phases

SUN, PLANET, RING = 21, 39, 99
SUN_TO_RING = 0.2805
# p_n, γ_sn and γ_rn as printed.
IN_PHASE = ((0, 40, 80), (0.0, 0.0, 0.0), (0.2805, 0.2805, 0.2805))
SEQUENTIAL = ((0, 42, 84), (0.0, 0.35, 0.70), (0.2805, 0.9305, 0.5805))


def stage_with(places: tuple[int, ...]) -> PlanetaryStage:
    """The planets at ψ_n = 2π p_n/(z_r + z_s)."""
    (stage,) = load("lin-parker-3").stages
    tables = stage.model_dump(exclude_unset=True)
    tables.pop("planets")
    tables["planet_angles"] = [360.0 * place / (RING + SUN) for place in places]
    tables["ring_mesh_phase"] = SUN_TO_RING
    for gear, teeth in (("sun", SUN), ("planet", PLANET), ("ring", RING)):
        tables[gear] |= {"teeth": teeth}
    tables["planet"] |= {"base_radius": tables["sun"]["base_radius"] * PLANET / SUN}
    return PlanetaryStage.model_validate(tables)


@pytest.mark.parametrize("case", [IN_PHASE, SEQUENTIAL], ids=["in phase", "sequentially phased"])
def test_phases_to_the_printed_digit(case: tuple[tuple[float, ...], ...]) -> None:
    places, sun, ring = case
    found = mesh_phases(stage_with(places).planet_set)  # type: ignore[arg-type]
    assert found.sun == pytest.approx(sun, abs=1e-9)
    expected = ring if case is IN_PHASE else tuple((2 * SUN_TO_RING - r) % 1.0 for r in ring)
    assert found.ring == pytest.approx(expected, abs=1e-9)
    assert [(r - SUN_TO_RING) % 1.0 for r in found.ring] == pytest.approx(sun, abs=1e-9)
