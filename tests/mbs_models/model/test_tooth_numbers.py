"""Tooth numbers against base radii: to the rounding of their digits, and to a tooth."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mbs_models.errors import ModelError
from mbs_models.model.model_file import load
from mbs_models.model.parameters import Drivetrain, PlanetaryStage
from mbs_models.model.tooth_numbers import refuse_impossible
from mbs_models.sanity.teeth import ring_closes, teeth_fit_radii
from mbs_models.stages.teeth import half_a_digit
from tests.strategies import with_stage


def pair(z_1: int, z_2: int, r_1: float, r_2: float) -> Drivetrain:
    """The paper's reducer with other gears."""
    stage = load("paper").stage("reducer")
    gears: dict[str, Any] = {}
    for name, teeth, radius in (("pinion", z_1, r_1), ("wheel", z_2, r_2)):
        table = getattr(stage, name).model_dump(exclude_unset=True)
        gears[name] = table | {"teeth": teeth, "base_radius": radius}
    return with_stage(load("paper"), "reducer", **gears)


def planetary(z_s: int, z_p: int, z_r: int, *, planets: int = 4) -> Drivetrain:
    """A planetary stage of module 2 mm and 20°, all digits given."""
    drivetrain = load("lin-parker-4")
    (stage,) = drivetrain.stages
    gears = ("sun", "planet", "ring")
    tables = {name: getattr(stage, name).model_dump(exclude_unset=True) for name in gears}
    base = 0.001 * math.cos(math.radians(20.0))
    tables["sun"] |= {"teeth": z_s, "base_radius": base * z_s}
    tables["planet"] |= {"teeth": z_p, "base_radius": base * z_p}
    tables["ring"] |= {"teeth": z_r}
    return with_stage(drivetrain, "planetary", **tables, pressure_angle=20.0, planets=planets)


@pytest.mark.parametrize(
    ("value", "half"), [(0.024, 5e-4), (0.4017185, 5e-8), (21.34, 5e-3), (1e-7, 5e-8), (1e22, 5e21)]
)
def test_half_of_what_the_last_digit_is_worth(value: float, half: float) -> None:
    assert half_a_digit(value) == pytest.approx(half, rel=1e-12)


@given(
    z_1=st.integers(17, 120),
    ratio=st.floats(1.0, 6.0),
    module=st.floats(0.5e-3, 40e-3),
    digits=st.integers(4, 6),
    diameters=st.booleans(),
)
def test_rounded_radii_of_a_right_pair_are_never_refused(
    z_1: int, ratio: float, module: float, digits: int, diameters: bool
) -> None:
    """r to 4 digits and more, or half of a diameter to as many."""
    z_2 = round(ratio * z_1)
    per = 2.0 if diameters else 1.0
    r_1, r_2 = (
        float(f"{per * module * z * math.cos(0.35) / 2.0:.{digits}g}") / per for z in (z_1, z_2)
    )
    refuse_impossible(pair(z_1, z_2, r_1, r_2))


@given(z_1=st.integers(17, 120), ratio=st.floats(1.0, 4.0), at_pinion=st.booleans())
def test_one_tooth_is_always_noticed(z_1: int, ratio: float, at_pinion: bool) -> None:
    z_2 = round(ratio * z_1)
    wrong = (z_1 + 1, z_2) if at_pinion else (z_1, z_2 + 1)
    with pytest.raises((ModelError, ValueError), match=r"teeth = \d+: contradicts"):
        refuse_impossible(pair(*wrong, 0.00123456 * z_1, 0.00123456 * z_2))


def test_what_rounding_may_explain_is_pointed_out() -> None:
    """61/92 with 0.061 and 0.091: 91 to the digits, 92 with 0.0605 and 0.0915 at the worst."""
    drivetrain = pair(61, 92, 0.061, 0.091)
    refuse_impossible(drivetrain)
    (note,) = teeth_fit_radii(drivetrain.stage("reducer"))
    assert str(note) == (
        "reducer: wheel.teeth = 92: expected 91 with pinion.teeth = 61 and base radii of 0.061 and "
        "0.091 m; only the rounding of the radii allows another number"
    )
    with pytest.raises(ModelError, match=r"wheel\.teeth = 92: contradicts the base radii"):
        refuse_impossible(pair(61, 92, 0.06100001, 0.09100001))


def test_a_ring_of_a_standard_set() -> None:
    """z_r = z_s + 2 z_p; one or two teeth more are a profile shift that two angles would tell."""
    refuse_impossible(planetary(60, 80, 220))
    assert not list(ring_closes(planetary(60, 80, 220).stage("planetary")))
    shifted = planetary(60, 80, 222, planets=3)
    refuse_impossible(shifted)
    (note,) = ring_closes(shifted.stage("planetary"))
    assert "ring.teeth = 222: expected z_s + 2 z_p = 220" in str(note)
    with pytest.raises(ModelError, match=r"ring\.teeth = 223: contradicts z_s \+ 2 z_p = 220"):
        refuse_impossible(planetary(60, 80, 223))


def test_presets_with_profile_shift_close() -> None:
    """19 + 2 · 17 = 53, but the ring has 56: two working pressure angles say so."""
    for stage in load("wind-turbine").stages:
        assert not [*ring_closes(stage), *teeth_fit_radii(stage)]
    refuse_impossible(load("wind-turbine"))


@pytest.mark.parametrize("given", [True, False])
def test_a_ring_is_judged_by_its_radius_or_by_the_pressure_angles(given: bool) -> None:
    drivetrain = load("wind-turbine")
    stage = drivetrain.stage("low_speed")
    assert isinstance(stage, PlanetaryStage)
    ring = stage.ring.model_dump(exclude_unset=True)
    ring |= {"teeth": 55, "base_radius": ring["base_radius"] if given else None}
    ring = {key: value for key, value in ring.items() if value is not None}
    with pytest.raises((ModelError, ValueError), match=r"ring\.teeth = 55: contradicts"):
        refuse_impossible(with_stage(drivetrain, "low_speed", ring=ring))
