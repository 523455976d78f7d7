"""Stage types of one's own: what registering them changes, and what is refused."""

from __future__ import annotations

import ast
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from mbs_models import Kind, Member, Part, Role, loads, register_stage, unregister_stage
from mbs_models.errors import ModelError
from mbs_models.gears.power_flow import power_flow
from mbs_models.modal.modes import drivetrain_modes
from mbs_models.model import parameters
from mbs_models.model.model_file import dumps, template
from mbs_models.model.parameters import Drivetrain, stage_types
from mbs_models.sanity.rules import findings
from mbs_models.stages.geometry import Frame
from mbs_models.stages.parallel import ParallelStage
from mbs_models.stages.part import Builder, RigidBody
from mbs_models.stages.planetary import PlanetaryStage
from validation.routes import equations

STAGE_TYPES = {"ParallelStage", "PlanetaryStage", "Inertia"}


class Shaft(Part):
    """Two flanges with a torsion spring between them."""

    type: Literal["shaft"]
    radius: float
    inertia: float
    stiffness: float

    def members(self) -> tuple[Member, ...]:
        inertias = {"w": self.inertia / self.radius**2}
        names = (f"{self.name}.left", f"{self.name}.right")
        return tuple(Member(name, Role.ROTOR, self.radius, inertias) for name in names)

    def build(self, builder: Builder, frame: Frame) -> dict[str, RigidBody]:
        left, right = builder.hub(self.inertia), builder.hub(self.inertia)
        builder.torsion_spring(left, self.stiffness, right)
        bodies = {f"{self.name}.left": left, f"{self.name}.right": right}
        for name, body in bodies.items():
            builder.add_dof(f"{name}.w", (body, body.rotation, frame.facing / self.radius))
        return bodies


SHAFT = """
[[stage]]
type = "shaft"
name = "shaft"
radius = 0.05
inertia = 2e-3
stiffness = 4e4
"""
COUPLED = """
[[coupling]]
name = "joint"
first = "shaft.right"
second = "planetary.sun"
radius = 0.05
inertia = 0.0
first_stiffness = "rigid"
second_stiffness = 1e8

[operation]
input = "shaft.left"
speed_range = [0.0, 3000.0]
"""


@pytest.fixture
def shaft() -> Iterator[type[Part]]:
    register_stage(Shaft)
    yield Shaft
    unregister_stage("shaft")


def test_a_type_is_known_while_it_is_registered(shaft: type[Part]) -> None:
    assert stage_types() == (ParallelStage, PlanetaryStage, shaft)
    (stage,) = loads(f'name = "s"\n{SHAFT}').stages
    assert stage.describe() == "shaft, 2 DoFs"
    unregister_stage("shaft")
    with pytest.raises(ModelError, match=r'type = "shaft": must be "parallel" or "planetary"$'):
        loads(f'name = "s"\n{SHAFT}')
    register_stage(shaft)


def test_messages_and_schema_know_it(shaft: type[Part]) -> None:
    assert "shaft" in str(Drivetrain.model_json_schema()["properties"]["stage"])
    with pytest.raises(ModelError, match=r"stage\[0\] 'shaft': stifness = 40000.0: unknown key;"):
        loads(f'name = "s"\n{SHAFT.replace("stiffness", "stifness")}')
    with pytest.raises(ModelError, match=r'must be "parallel" or "planetary" or "shaft"$'):
        loads(f'name = "s"\n{SHAFT.replace("shaft", "belt", 1)}')


def test_a_model_file_of_it_reads_back(shaft: type[Part]) -> None:
    drivetrain = loads(template("lin-parker-4") + SHAFT + COUPLED)
    assert loads(dumps(drivetrain)) == drivetrain


def test_power_passes_through_it(shaft: type[Part]) -> None:
    """Lin & Parker's ring is held: T_c = T_s (1 + r_r/r_s) with equal pressure angles."""
    drivetrain = loads(template("lin-parker-4") + SHAFT + COUPLED)
    assert findings(drivetrain) == ()
    flow = power_flow(drivetrain, 1000.0, 50.0)
    ratio = 1.0 + (0.0387 + 2.0 * 0.0502) / 0.0387
    assert flow.output == "planetary.carrier"
    assert flow.ratio == pytest.approx(ratio, rel=1e-12)
    assert flow.torques["shaft.left"] == 50.0
    assert flow.torques["planetary.carrier"] == pytest.approx(50.0 * ratio, rel=1e-9)
    assert flow.speeds["shaft.right"] == pytest.approx(1000.0, rel=1e-12)


def test_a_mode_of_it_alone_has_its_kind(shaft: type[Part]) -> None:
    """Two inertias I on a spring k: ω² = 2 k/I."""
    modes = drivetrain_modes(loads(f'name = "s"\n{SHAFT}'))
    assert [mode.kind for mode in modes.modes] == [Kind.RIGID_BODY, Kind.STAGE]
    expected = math.sqrt(2.0 * 4e4 / 2e-3) / (2.0 * math.pi)
    np.testing.assert_allclose(modes.frequencies, [0.0, expected], rtol=1e-12)


def test_a_type_without_equations_is_said_to_have_none(shaft: type[Part]) -> None:
    with pytest.raises(ModelError, match=r"'shaft': Shaft has no equations; register it by valid"):
        equations.drivetrain_system(loads(f'name = "s"\n{SHAFT}'))


class Nameless(Part):
    """Without a ``type``."""


class Taken(Shaft):
    """With a type that comes along."""

    type: Literal["planetary"]  # type: ignore[assignment]


def test_what_is_no_stage_type_is_refused() -> None:
    for wrong in (Nameless, dict):
        with pytest.raises(ModelError, match=r"derives from mbs_models\.Part and has a field for"):
            register_stage(wrong)  # type: ignore[arg-type]
    with pytest.raises(ModelError, match=r"register_stage\(Taken\): type = 'planetary' comes"):
        register_stage(Taken)
    assert stage_types() == (ParallelStage, PlanetaryStage)


def names_in(node: ast.AST) -> set[str]:
    return {n.id for n in ast.walk(node) if isinstance(n, ast.Name)} | {
        n.attr for n in ast.walk(node) if isinstance(n, ast.Attribute)
    }


def asks_for_a_type(node: ast.AST) -> bool:
    """``isinstance(x, T)``, ``type(x) is T``, ``case T():`` and ``x.type == …``."""
    if isinstance(node, ast.Call) and getattr(node.func, "id", "") in ("isinstance", "issubclass"):
        return bool(STAGE_TYPES & names_in(node.args[1]))
    if isinstance(node, ast.MatchClass):
        return bool(STAGE_TYPES & names_in(node.cls))
    if isinstance(node, ast.Compare):
        sides = [node.left, *node.comparators]
        asked = any(isinstance(side, ast.Attribute) and side.attr == "type" for side in sides)
        return asked or bool(STAGE_TYPES & names_in(node) and "type" in names_in(node))
    return False


@pytest.mark.parametrize(
    "code",
    [
        "isinstance(x, ParallelStage | Inertia)",
        "issubclass(x, parameters.PlanetaryStage)",
        "type(x) is Inertia",
        "x.type == 'parallel'",
        "match x:\n case PlanetaryStage():\n  pass",
    ],
)
def test_what_asks_for_a_type(code: str) -> None:
    assert any(asks_for_a_type(node) for node in ast.walk(ast.parse(code)))


def test_nobody_asks_of_which_type_a_stage_is() -> None:
    """What differs is a member of `Part`, or a function registered for the type."""
    root = Path(parameters.__file__).parents[2]
    found = [
        f"{path.relative_to(root)}:{getattr(node, 'lineno', '?')}"
        for package in ("mbs_models", "validation")
        for path in sorted((root / package).rglob("*.py"))
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if asks_for_a_type(node)
    ]
    assert found == []
