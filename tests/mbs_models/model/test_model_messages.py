"""Whatever stands anywhere in a model file: it loads, or one line says where and what is wrong."""

from __future__ import annotations

import copy
import datetime
import math
import tomllib
from collections.abc import Iterator
from typing import Any

import pytest

from mbs_models.errors import ModelError
from mbs_models.model import messages as model_messages
from mbs_models.model.model_file import loads, template
from mbs_models.model.parameters import Drivetrain
from mbs_models.model.toml_text import bare, inline

Path = tuple[str | int, ...]

PAPER = tomllib.loads(template("paper-table2"))
RING = "stage[1] 'planetary': ring.bearing"
PLANETARY = "stage[1] 'planetary': "
A_BEARING = "must be a number, at least 0 (N/m) or a symmetric matrix [[a, b], [b, d]]"
DOFS = "coupling[0] 'coupling': dofs"

# Every key there is, each once at least: of two forms of a quantity another table has the other.
COMPLETE = """
name = "all keys"
source = "nowhere"
[damping]
stiffness_proportional = 1e-6
mass_proportional = 1.0
[operation]
input = "reducer.pinion"
speed_range = [0.0, 3000.0]
speed = 1500.0
torque = 100.0
output = "planetary.carrier"

[[stage]]
type = "parallel"
name = "reducer"
helix_angle = 15.0
pressure_angle = 20.0
mesh_stiffness = 2.0e8
mesh_transmission_error = { harmonics = [[1e-6, 0.0], [1e-7, 90.0]] }
mesh_backlash = 1e-5
[stage.mesh_variation]
shape = "trapezoid"
contact_ratio = 1.6
amplitude = 0.5
transition = 0.1
phase = 0.2
[stage.pinion]
mass = 2.0
base_radius = 0.024
teeth = 30
polar_inertia = 6e-4
diametral_inertia = 3e-4
bearing_y = 3.5e8
bearing_z = 1.0e8
bearing_damping = 20.0
bearing_rocking = 6e4
[stage.wheel]
mass = 2.0
base_radius = 0.048
teeth = 60
polar_inertia_over_r2 = 1.16
diametral_inertia_over_r2 = 0.58
bearing = [[3.5e8, 1e6], [1e6, 1.0e8]]
bearing_damping = [[20.0, 1.0], [1.0, 20.0]]
bearing_rocking_over_r2 = 1.0e8

[[stage]]
type = "planetary"
name = "planetary"
planets = 4
pressure_angle = 21.34
sun_mesh_stiffness = [2.0e8, 2.1e8, 2.2e8, 2.3e8]
ring_mesh_stiffness = 2.0e8
sun_mesh_variation = { shape = "harmonics", harmonics = [[0.2, 0.0], [0.1, 90.0]] }
ring_mesh_variation = { shape = "constant" }
sun_mesh_transmission_error = { harmonics = [[1e-6, 0.0]] }
ring_mesh_transmission_error = { harmonics = [[1e-6, 0.0]] }
sun_mesh_backlash = 1e-5
ring_mesh_backlash = 1e-5
ring_mesh_phase = 0.5
planet_bearing = [[1.0e8, 0.0], [0.0, 2.0e8]]
planet_bearing_damping = 10.0
[stage.sun]
mass = 0.46
base_radius = 0.024
teeth = 30
polar_inertia_over_r2 = 0.272
bearing = 1.0e8
bearing_damping = 10.0
torsional_support = 0.0
[stage.ring]
mass = 0.588
base_radius = 0.056
teeth = 70
polar_inertia_over_r2 = 0.759
bearing_u = 1.0e8
bearing_v = 2.0e8
torsional_stiffness = 1.0e6
[stage.carrier]
mass = 3.0
radius = 0.04294
polar_inertia = 2e-3
bearing = [[1.0e8, 1e6], [1e6, 1.0e8]]
bearing_damping = [[10.0, 0.0], [0.0, 10.0]]
torsional_support = 1.0
[stage.planet]
mass = 0.177
base_radius = 0.016
teeth = 20
polar_inertia_over_r2 = 0.1

[[stage]]
type = "planetary"
name = "second"
planet_angles = [0.0, 100.0, 200.0]
sun_pressure_angle = 21.0
ring_pressure_angle = 20.0
sun_mesh_stiffness = 2.0e8
ring_mesh_stiffness = 2.0e8
planet_bearing_radial = 1.0e8
planet_bearing_tangential = 1.0e8
planet_bearing_damping = [[10.0, 0.0], [0.0, 10.0]]
ring = { mass = 0.588, polar_inertia = 2e-3, bearing = 1.0e8, torsional_support = 1.0e9 }
carrier = { mass = 3.0, polar_inertia = 2e-3, bearing = 1.0e8, torsional_support = 0.0 }
planet = { mass = 0.177, base_radius = 0.016, polar_inertia = 1e-4 }
[stage.sun]
mass = 0.46
base_radius = 0.024
polar_inertia = 2e-4
bearing = 1.0e8
torsional_support = 0.0

[[inertia]]
name = "motor"
radius = 0.05
polar_inertia = 0.1
torsional_stiffness = 10.0
[[inertia]]
name = "generator"
radius = 0.05
polar_inertia_over_r2 = 10.0
torsional_support = 10.0

[[coupling]]
name = "hub"
first = "reducer.wheel"
second = "planetary.sun"
radius = 0.024
inertia_over_r2 = 4.48e-8
first_stiffness = 1.0e8
second_stiffness = 1.0e5
[coupling.dofs]
u = { stiffness = 1e8, damping = 5.0 }
[[coupling]]
name = "shaft"
first = "planetary.carrier"
second = "second.sun"
radius = 0.024
inertia = 1e-4
first_stiffness = "rigid"
second_stiffness = 1.0e5
[coupling.dofs]
u = { stiffness = "rigid" }
v = { stiffness = 1e8 }
[[coupling]]
name = "flange"
first = "second.carrier"
second = "generator"
radius = 0.05
inertia = 1e-4
first_stiffness = 1.0e5
second_stiffness = 1.0e5

[[excitation]]
type = "harmonic"
dof = "reducer.pinion.w"
moment = 10.0
frequency = 100.0
phase = 30.0
[[excitation]]
type = "stepped-sine"
dof = "reducer.pinion.y"
amplitude = 10.0
frequencies = [100.0, 200.0]
dwell = 1.0
ramp = 0.1
[[excitation]]
type = "stepped-sine"
dof = "reducer.pinion.w"
amplitude = 10.0
fmin = 100.0
fmax = 200.0
df = 10.0
periods = 20
[[excitation]]
type = "sweep"
dof = "motor.w"
amplitude = 10.0
fmin = 100.0
fmax = 200.0
duration = 1.0
law = "linear"
direction = "up"
taper = 0.1
[[excitation]]
type = "multisine"
dof = "hub.w"
amplitude = 10.0
fmin = 100.0
fmax = 200.0
df = 1.0
phases = "random"
seed = 3
lines = "all"
[[excitation]]
type = "noise"
dof = "planetary.sun.u"
amplitude = 10.0
fmin = 100.0
fmax = 200.0
period = 10.0
seed = 3
[[excitation]]
type = "impulse"
dof = "planetary.sun.v"
amplitude = 10.0
contact_time = 1e-3
start = 0.1
[[excitation]]
type = "impulse"
dof = "planetary.sun.w"
amplitude = 10.0
fmax = 1000.0
[[excitation]]
type = "record"
dof = "planetary.ring.w"
file = "measured.csv"
unit = "N m"
scale = 2.0
"""

LONG = "x" * 3000
WRONG: list[Any] = [
    "x",
    True,
    math.nan,
    -1,
    0,
    [],
    {},
    [1, "a"],
    datetime.date(1979, 5, 27),
    LONG,
    math.inf,
    1e300,
    10**400,
    [[1.0, 2.0], [3.0]],
    [{}],
    {"x": {"x": 1}},
    "a\nb",
]


def text_of(data: dict[str, Any]) -> str:
    return "\n".join(f"{bare(key)} = {inline(value)}" for key, value in data.items())


def at(data: Any, path: Path) -> Any:
    for step in path:
        data = data[step]
    return data


def replaced(data: dict[str, Any], path: Path, value: Any) -> dict[str, Any]:
    """A copy with another value at a path."""
    data = copy.deepcopy(data)
    at(data, path[:-1])[path[-1]] = value
    return data


def message(data: dict[str, Any]) -> str:
    with pytest.raises(ModelError) as caught:
        loads(text_of(data), origin="b.toml")
    return str(caught.value).removeprefix("b.toml: ")


def paths(value: Any, start: Path = ()) -> Iterator[Path]:
    """Paths of all tables, lists and leaves of a file, itself excepted."""
    inner = value.items() if isinstance(value, dict) else enumerate(value)
    for step, below in inner:
        yield (*start, step)
        if isinstance(below, dict | list):
            yield from paths(below, (*start, step))


def test_the_complete_file_has_every_key_there_is() -> None:
    data = tomllib.loads(COMPLETE)
    loads(COMPLETE)
    given = {step for path in paths(data) for step in path}
    schema = Drivetrain.model_json_schema(by_alias=True)
    known = {key for table in (schema, *schema["$defs"].values()) for key in table["properties"]}
    assert known - given == set()


@pytest.fixture
def complete(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """What `loads` finds in any text: parsing takes longer than all the rest."""
    data = tomllib.loads(COMPLETE)
    monkeypatch.setattr(tomllib, "loads", lambda text: data)
    return data


def refusal(table: Any, key: str | int, value: Any) -> str | None:
    """What `loads` says of another value in a table or list."""
    kept = copy.copy(table)
    table[key] = value
    try:
        loads("", origin="b.toml")
    except ModelError as error:
        return str(error)
    finally:
        table.clear()
        (table.update if isinstance(table, dict) else table.extend)(kept)
    return None


def test_any_value_anywhere_loads_or_is_named_in_one_line(complete: dict[str, Any]) -> None:
    # A value that may stand there, but that another key refers to or must fit: it is told of that.
    of_others = ("not a body of", "not a DoF of", "is a translation", "makes more than")
    refused = 0
    for path in list(paths(complete)):
        key = [step for step in path if isinstance(step, str)][-1]
        for value in WRONG:
            told = refusal(at(complete, path[:-1]), path[-1], value)
            if told is not None:
                refused += 1
                assert told.startswith("b.toml: "), (path, value, told)
                assert "\n" not in told, (path, value, told)
                assert "Input should" not in told, (path, value, told)
                assert any(words in told for words in (key, *of_others)), (path, value, told)
    assert refused > 1000


def test_unknown_keys_anywhere_are_named(complete: dict[str, Any]) -> None:
    for path in [(), *paths(complete)]:
        table = at(complete, path)
        if isinstance(table, dict):
            for value in WRONG:
                told = refusal(table, "zzz", value)
                assert told is not None
                assert "zzz = " in told, (path, value, told)
                assert "unknown key; allowed: " in told, (path, value, told)


@pytest.mark.parametrize(
    ("path", "value", "told"),
    [
        # A number or a matrix
        ("stage.1.ring.bearing", -1.0e8, f"{RING} = -1.0e8: {A_BEARING}"),
        ("stage.1.ring.bearing", math.nan, f"{RING} = nan: {A_BEARING}"),
        ("stage.1.ring.bearing", "x", f'{RING} = "x": {A_BEARING}'),
        ("stage.1.ring.bearing", [[1.0, 0.0]], f"{RING} = [[1.0, 0.0]]: {A_BEARING}"),
        (
            "stage.1.ring.bearing",
            [[1.0, 0.0], [0.0]],
            f"{RING}[1] = [0.0]: must be a list of 2, each a number",
        ),
        (
            "stage.1.ring.bearing",
            [[1.0, "a"], [0.0, 1.0]],
            f'{RING}[0][1] = "a": must be a number',
        ),
        (
            "stage.1.ring.bearing",
            [[1.0, 2.0], [3.0, 9.0]],
            f"{RING} = [[1.0, 2.0], [3.0, 9.0]]: the cross terms 2.0 and 3.0 differ: only "
            "symmetric bearings can be analysed",
        ),
        (
            "stage.1.ring.bearing",
            [[1.0, 2.0], [2.0, 1.0]],
            f"{RING} = [[1.0, 2.0], [2.0, 1.0]]: the matrix is not positive semi-definite: the "
            "bearing would push",
        ),
        ("stage.1.planet_bearing", -1.0, f"{PLANETARY}planet_bearing = -1.0: {A_BEARING}"),
        (
            "stage.1.planet_bearing_damping",
            -1.0,
            f"{PLANETARY}planet_bearing_damping = -1.0: {A_BEARING.replace('N/m', 'N s/m')}",
        ),
        # A number or a list
        (
            "stage.1.sun_mesh_stiffness",
            [2e8, -1e8, 2e8, 2e8],
            f"{PLANETARY}sun_mesh_stiffness[1] = -1.0e8: must be a number, at least 0 (N/m)",
        ),
        (
            "stage.1.sun_mesh_stiffness",
            [1e8, "a", 1e8, 1e8],
            f'{PLANETARY}sun_mesh_stiffness[1] = "a": must be a number, at least 0 (N/m)',
        ),
        # A pair
        (
            "operation.speed_range",
            [3000.0, 0.0],
            "operation.speed_range[1] = 0.0: must be a number, greater than 0 (rpm)",
        ),
        (
            "operation.speed_range",
            [3000.0, 1.0],
            "operation: speed_range = [3000.0, 1.0]: the second must be larger",
        ),
        (
            "operation.speed_range",
            [1.0],
            "operation.speed_range = [1.0]: must be a list of two speeds (rpm)",
        ),
        (
            "operation.speed_range",
            [0.0, 1.0, 2.0],
            "operation.speed_range = [0.0, 1.0, 2.0]: must be a list of two speeds (rpm)",
        ),
        (
            "operation.speed_range",
            [-1.0, 5.0],
            "operation.speed_range[0] = -1.0: must be a number, at least 0 (rpm)",
        ),
        (
            "operation.speed_range",
            ["a", "b"],
            'operation.speed_range[0] = "a": must be a number, at least 0 (rpm) (and 1 more: '
            "operation.speed_range[1])",
        ),
        (
            "operation.speed_range",
            [0.0, math.nan],
            "operation.speed_range[1] = nan: must be a number, greater than 0 (rpm)",
        ),
        # A table with keys of one kind
        (
            "coupling.0.dofs",
            {"q": {"stiffness": "soft"}},
            f'{DOFS}.q = {{ stiffness = "soft" }}: unknown key; allowed: u, v, x, y, z',
        ),
        (
            "coupling.0.dofs",
            {"u": 1e8},
            f"{DOFS}.u = 1.0e8: must be a table with stiffness, damping",
        ),
        (
            "coupling.0.dofs",
            {"u": {"stiffness": -1.0}},
            f'{DOFS}.u.stiffness = -1.0: must be a number, at least 0 (N/m) or "rigid"',
        ),
        (
            "coupling.0.dofs",
            {"u": {"stiffness": "soft"}},
            f'{DOFS}.u.stiffness = "soft": must be a number, at least 0 (N/m) or "rigid"',
        ),
        (
            "coupling.0.dofs",
            {"u": {}},
            f'{DOFS}.u.stiffness: missing; must be a number, at least 0 (N/m) or "rigid"',
        ),
        ("coupling.0.dofs", 3, f"{DOFS} = 3: must be a table with u, v, x, y, z"),
    ],
)
def test_wrong_values_where_several_kinds_are_allowed(path: str, value: Any, told: str) -> None:
    steps = tuple(int(step) if step.isdigit() else step for step in path.split("."))
    assert message(replaced(PAPER, steps, value)) == told


def test_where_the_schema_says_nothing_pydantic_does(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever kind of parameter is added one day: the place and the value are told."""
    monkeypatch.setattr(model_messages, "_drivetrain_schema", dict)
    assert message(replaced(PAPER, ("damping", "mass_proportional"), -1.0)) == (
        "damping.mass_proportional = -1.0: Input should be greater than or equal to 0"
    )
    assert message(replaced(PAPER, ("operation", "speed_range"), [0.0, "a"])) == (
        'operation.speed_range[1] = "a": Input should be a valid number'
    )
    assert message(replaced(PAPER, ("operation",), {"input": "reducer.pinion"})) == (
        "operation.speed_range: missing; Field required"
    )
