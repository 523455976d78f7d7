"""The pictures of the model: what is drawn is where exudyn has it."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from mbs_models.modal.modes import drivetrain_modes
from mbs_models.model.model_file import load
from mbs_models.model.parameters import Drivetrain, ParallelStage
from mbs_models.system.components import SpringKind
from mbs_models.system.read_back import drivetrain_components
from tests.strategies import changed, paper, with_coupling, with_stage
from validation.picture.axial import draw_shafts
from validation.picture.drawing import draw_model
from validation.picture.layout import WIDTH, Layout, in_order, lay_out
from validation.picture.mode_shapes import MOST, draw_mode_shapes
from validation.picture.motion import displacements, largest_motion, mesh_motion

PRESETS = ["paper", "lin-parker-3", "lin-parker-5", "wind-turbine", "geared-torsional"]


def laid_out(drivetrain: Drivetrain) -> Layout:
    return lay_out(drivetrain, drivetrain_components(drivetrain))


def chain(stages: int) -> Drivetrain:
    """The paper's two stages, again and again."""
    drivetrain = paper()
    parallel, planetary = (s.model_dump(exclude_unset=True) for s in drivetrain.stages)
    coupling = drivetrain.couplings[0].model_dump(exclude_unset=True)
    kinds = [parallel | {"name": f"s{i}"} for i in range(stages)]
    kinds[1::2] = [planetary | {"name": f"s{i}"} for i in range(1, stages, 2)]
    ends = {0: ("pinion", "wheel"), 1: ("sun", "carrier")}
    joined = [
        coupling
        | {
            "name": f"c{i}",
            "first": f"s{i}.{ends[i % 2][1]}",
            "second": f"s{i + 1}.{ends[(i + 1) % 2][0]}",
        }
        for i in range(stages - 1)
    ]
    return changed(drivetrain, stage=kinds, coupling=joined)


@pytest.mark.parametrize("preset", PRESETS)
def test_meshes_are_tangent_to_the_base_circles(preset: str) -> None:
    """exudyn's ends of a mesh lie on the parameters' circles, its line at right angles to both."""
    for panel in laid_out(load(preset)).panels:
        for spring in panel.springs:
            if spring.kind is not SpringKind.MESH:
                continue
            for end in spring.ends:
                disc = panel.disc(end.body)
                from_centre = (end.point - disc.centre)[:2]
                assert np.linalg.norm(from_centre) == pytest.approx(disc.radius)
                along = spring.axes[:2, 0]
                assert from_centre @ along == pytest.approx(0.0, abs=1e-9 * disc.radius)


@pytest.mark.parametrize("preset", PRESETS)
def test_panels_hold_every_body_once_and_do_not_overlap(preset: str) -> None:
    drivetrain = load(preset)
    layout = laid_out(drivetrain)
    drawn = [disc.body for panel in layout.panels for disc in panel.discs]
    assert sorted(drawn) == sorted(drivetrain_components(drivetrain).masses)
    boxes = [(*panel.corner, *panel.size) for panel in layout.panels]
    for i, (x, y, w, h) in enumerate(boxes):
        assert x >= 0.0
        assert x + w <= WIDTH
        for left, top, wide, high in boxes[:i]:
            assert x >= left + wide or left >= x + w or y >= top + high or top >= y + h


def test_parts_stand_in_the_trains_order() -> None:
    names = [item.name for item in in_order(load("wind-turbine"))]
    assert names == [
        "rotor", "main_shaft", "low_speed", "low_speed_shaft", "intermediate",
        "intermediate_shaft", "high_speed", "high_speed_shaft", "generator",
    ]  # fmt: skip
    assert [item.name for item in in_order(paper())] == ["reducer", "coupling", "planetary"]


def test_planets_stand_at_their_angles() -> None:
    angles = [0.0, 80.0, 170.0, 260.0]
    drivetrain = with_stage(load("lin-parker-4"), "planetary", planets=None, planet_angles=angles)
    (panel,) = laid_out(drivetrain).panels
    x, y = panel.at(panel.disc("planetary.carrier").centre)
    for number, angle in enumerate(angles, start=1):
        px, py = panel.at(panel.disc(f"planetary.planet{number}").centre)
        found = math.degrees(math.atan2(-(py - y), px - x)) % 360.0
        assert found == pytest.approx(angle, abs=1e-6)


def test_a_small_stage_is_enlarged_and_says_so() -> None:
    drivetrain = paper()
    (reducer,) = drivetrain.stages_of(ParallelStage)
    gear = reducer.pinion
    small = changed(gear, base_radius=gear.base_radius / 10.0).model_dump(exclude_unset=True)
    drivetrain = with_stage(drivetrain, "reducer", pinion=small, wheel=small)
    assert [panel.enlargement for panel in laid_out(drivetrain).panels] == [10, 0, 1]
    assert "(enlarged 10×)" in draw_model(drivetrain, laid_out(drivetrain))


def test_stages_left_apart_are_seen() -> None:
    joined, apart = paper(), with_coupling(paper(), second_stiffness=0.0)
    for drivetrain, broken in ((joined, False), (apart, True)):
        parts = drivetrain_components(drivetrain)
        drawn = draw_shafts(drivetrain, lay_out(drivetrain, parts), parts)
        assert ("not connected" in drawn) is broken


@pytest.mark.parametrize("drivetrain", [*map(load, PRESETS), chain(10)], ids=[*PRESETS, "chain"])
def test_pictures_are_well_formed_and_refer_to_what_is_there(drivetrain: Drivetrain) -> None:
    parts = drivetrain_components(drivetrain)
    layout = lay_out(drivetrain, parts)
    shapes = draw_mode_shapes(layout, parts, drivetrain_modes(drivetrain))
    pictures = [p.svg for p in shapes.pictures]
    assert len(pictures) == min(MOST, shapes.total)
    rest = ET.fromstring(f"<g>{shapes.still_parts}</g>")
    ids = {f"#{element.attrib['id']}" for element in rest}
    for text in (
        draw_model(drivetrain, layout), draw_shafts(drivetrain, layout, parts), shapes.moving,
        *pictures,
    ):  # fmt: skip
        root = ET.fromstring(text)
        assert root.attrib["aria-label"]
        assert {e.attrib["href"] for e in root.iter("use")} <= ids
        assert not re.search(r"\b(nan|inf)\b", text)
    classes = set(re.findall(r'class="mv (k\d+)"', shapes.moving))
    assert set(re.findall(r"\.(k\d+)\{", shapes.rules)) <= classes


def test_names_are_escaped() -> None:
    drivetrain = paper().model_copy(update={"name": '<b>"&'})
    assert ET.fromstring(draw_model(drivetrain, laid_out(drivetrain))).attrib["aria-label"]


def test_gears_roll_in_the_moving_picture() -> None:
    """A rigid-body motion stretches no mesh, however large it is drawn."""
    drivetrain = load("wind-turbine")
    parts = drivetrain_components(drivetrain)
    layout = lay_out(drivetrain, parts)
    modes: Any = drivetrain_modes(drivetrain)
    rows = [modes.labels.index(dof) for dof in parts.dofs]
    moved = displacements(parts, modes.shapes[rows, 0])
    largest = largest_motion(layout, moved)
    for panel in layout.panels:
        for spring in panel.springs:
            if spring.kind is SpringKind.MESH:
                length = math.dist(*(panel.at(end.point) for end in spring.ends))
                motion = mesh_motion(panel, spring, moved, largest, reach=1.0)
                across = math.hypot(*(motion.x, motion.y)) + abs(motion.turn) * length
                assert abs(motion.stretch) * length < 0.05 * across**2 / length + 1e-4


def test_a_wrong_mesh_would_show() -> None:
    """The drawing takes a mesh's ends from the system, not from the parameters."""
    drivetrain = paper()
    parts = drivetrain_components(drivetrain)
    mesh = next(s for s in parts.springs if s.kind is SpringKind.MESH)
    moved = replace(mesh.ends[1], point=mesh.ends[1].point + np.array([0.0, 0.02, 0.0]))
    wrong = replace(mesh, ends=(mesh.ends[0], moved))
    changed_parts = replace(parts, springs=tuple(wrong if s is mesh else s for s in parts.springs))
    right = draw_model(drivetrain, lay_out(drivetrain, parts))
    assert draw_model(drivetrain, lay_out(drivetrain, changed_parts)) != right
