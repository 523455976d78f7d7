"""What looks typed wrong, however far off it is."""

from __future__ import annotations

import re

import pytest
from hypothesis import HealthCheck, given, settings

from mbs_models.errors import ModelError
from mbs_models.model.model_file import load, loads, template
from mbs_models.model.parameters import Drivetrain, ParallelStage
from mbs_models.sanity.free_motion import count_free_rotations, free_to_move, input_turns
from mbs_models.sanity.rules import findings
from mbs_models.sanity.stiffnesses import off_their_neighbours
from mbs_models.system.read_back import drivetrain_components
from tests.strategies import changed, drivetrains, with_stage

PAPER = template("paper-table2")
MESH = "\nmesh_stiffness = 2.0e8"


def far_off(drivetrain: Drivetrain) -> tuple[str, ...]:
    """What is a thousand times off its neighbours."""
    return tuple(str(note) for item in drivetrain.items for note in off_their_neighbours(item))


@pytest.mark.parametrize(
    ("stiffness", "told"),
    [
        # The median of the stage's seven: two bearings of 3.5e8, four of 1e8 are its others.
        ("2.0e11", "2e+11 N/m: 2000 times its neighbours (1.0e+8 N/m)"),
        ("5.0e4", "50000 N/m: a 2000th of its neighbours (1.0e+8 N/m)"),
        ("1e15", "1e+15 N/m: 1.0e+7 times its neighbours (1.0e+8 N/m)"),
        ("1e-3", "0.001 N/m: 1.0e-11 times its neighbours (1.0e+8 N/m)"),
    ],
)
def test_how_far_off_is_told_in_few_digits(stiffness: str, told: str) -> None:
    drivetrain = loads(PAPER.replace(MESH, f"\nmesh_stiffness = {stiffness}", 1))
    assert far_off(drivetrain) == (f"reducer: mesh_stiffness = {told}; is the unit right?",)


def test_odd_stiffnesses_are_pointed_out() -> None:
    (reducer,) = load("paper").stages_of(ParallelStage)
    pinion = reducer.pinion.model_dump(exclude_unset=True)
    drivetrain = with_stage(load("paper"), "reducer", pinion=pinion | {"bearing_y": 3.5e5})
    assert far_off(load("paper")) == ()
    (note,) = far_off(with_stage(load("paper"), "reducer", pinion=pinion | {"bearing_y": 3.5e4}))
    assert "reducer: pinion.bearing_y = 35000 N/m" in note
    assert far_off(drivetrain) == ()  # 300 times softer may be meant


NUMBER = re.compile(r"= ?(-?[0-9][0-9.e+-]*)")


@pytest.mark.parametrize("value", ["0.0", "1", "5e-324", "1e-300", "1e300", "1.7e308"])
def test_rules_bear_any_number(value: str) -> None:
    """Whatever a file may have for one of its numbers: refused, or judged in one line each."""
    text = "\n".join(line.partition("#")[0] for line in PAPER.splitlines())
    for number in NUMBER.finditer(text):
        try:
            drivetrain = loads(text[: number.start(1)] + value + text[number.end(1) :])
        except ModelError:
            continue
        for finding in findings(drivetrain):
            assert "\n" not in str(finding)
            assert finding.place[0] in ("operation", "reducer", "planetary", "coupling")


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(drivetrains())
def test_a_tree_of_any_parts_turns_as_its_groups_do(drivetrain: Drivetrain) -> None:
    """Bearings hold all: nothing moves sideways, and only planetary stages branch the rotation.

    A parallel stage and a coupling leave as many rotations as there were; a planetary stage has two
    of its own, less one for each member that is held.
    """
    parts = drivetrain_components(drivetrain)
    for finding in findings(drivetrain):
        assert "\n" not in str(finding)
    counts = [count_free_rotations(drivetrain, parts, group) for group in drivetrain.groups()]
    differential = any(count > 1 for count in counts)
    assert bool(list(free_to_move(drivetrain, parts))) == differential


def planetary(**members: dict[str, float]) -> Drivetrain:
    """Lin & Parker's stage with keys of its members changed."""
    drivetrain = load("lin-parker-4")
    (stage,) = drivetrain.stages
    tables = {
        name: getattr(stage, name).model_dump(exclude_unset=True) | keys
        for name, keys in members.items()
    }
    return with_stage(drivetrain, "planetary", **tables)


def test_a_stage_with_no_member_held() -> None:
    drivetrain = planetary(ring={"torsional_support": 0.0})
    parts = drivetrain_components(drivetrain)
    assert [count_free_rotations(drivetrain, parts, g) for g in drivetrain.groups()] == [2]
    (finding,) = free_to_move(drivetrain, parts)
    assert str(finding).startswith(
        "planetary: ring.torsional_support = 0 N/m: the ring turns freely (carrier and sun too): "
    )


def test_a_differential_that_is_meant_is_called_one() -> None:
    """Ring, carrier and sun each on an inertia: two speeds are free, and nothing is loose."""
    base = planetary(ring={"torsional_support": 0.0})
    members = ("sun", "ring", "carrier")
    rotors = [{"name": f"on_{m}", "radius": 1.0, "polar_inertia": 1.0} for m in members]
    shafts = [
        {"name": f"to_{m}", "first": f"planetary.{m}", "second": f"on_{m}", "radius": 0.1,
         "inertia": 0.0, "first_stiffness": 1e7, "second_stiffness": "rigid"}
        for m in members
    ]  # fmt: skip
    drivetrain = changed(base, inertia=rotors, coupling=shafts)
    (finding,) = free_to_move(drivetrain, drivetrain_components(drivetrain))
    assert str(finding).endswith(
        "free rotations = 2: expected 1: a differential, one speed does not tell the others"
    )


def test_a_sun_that_floats_in_its_meshes_is_held() -> None:
    """The meshes of three and more planets hold it; two opposite ones hold it too, by 2α."""
    drivetrain = planetary(sun={"bearing": 0.0})
    assert not list(free_to_move(drivetrain, drivetrain_components(drivetrain)))


@pytest.mark.parametrize(
    ("speed", "is_odd"), [(1450.0, False), (-1450.0, False), (14500.0, True), (0.5, True)]
)
def test_a_speed_outside_its_range(speed: float, is_odd: bool) -> None:
    """Margins at a speed the range leaves out: one of the two is typed wrong."""
    operation = {"input": "reducer.pinion", "speed_range": (300.0, 3000.0), "speed": speed}
    found = findings(changed(load("paper"), operation=operation))
    said = f"operation: speed = {speed:g} rpm: expected within speed_range = [300, 3000] rpm"
    assert [str(finding) for finding in found] == ([said] if is_odd else [])


def test_an_input_that_turns_nothing() -> None:
    text = PAPER[: PAPER.index("[[coupling]]")] + (
        '[[inertia]]\nname = "motor"\nradius = 1.0\npolar_inertia = 1.0\n'
    )
    drivetrain = loads(text.replace('input = "reducer.pinion"', 'input = "motor"'))
    (finding,) = input_turns(drivetrain, drivetrain_components(drivetrain))
    assert str(finding) == (
        "operation: input = 'motor': turns nothing but itself; expected a body that is geared or "
        "coupled to others"
    )
