"""Model files: what is written loads again, and what is wrong is named in one line."""

from __future__ import annotations

import re
import time
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from mbs_models.errors import ModelError
from mbs_models.model.model_file import (
    dumps,
    load,
    loads,
    preset_names,
    template,
    write_new,
)
from mbs_models.model.parameters import Drivetrain
from mbs_models.model.placement import place_parts

PAPER = template("paper")
REDUCER = "stage[0] 'reducer': "
PLANETARY = "stage[1] 'planetary': "
COUPLING = "coupling[0] 'coupling': "
A_MASS = "must be a number, greater than 0 (kg)"
BODIES = "reducer.pinion, reducer.wheel, planetary.sun, planetary.ring, planetary.carrier"


def message(text: str) -> str:
    """The error that a text ends in, without the file's name."""
    with pytest.raises(ModelError) as caught:
        loads(text, origin="gear.toml")
    line = str(caught.value)
    assert line.startswith("gear.toml: ")
    assert "\n" not in line
    assert "Input should" not in line
    return line.removeprefix("gear.toml: ")


def changed(old: str, new: str) -> str:
    """The paper's file with the first ``old`` replaced."""
    assert old in PAPER
    return PAPER.replace(old, new, 1)


VALUES = [
    ("mass = 2.0", "mass = -2.0", REDUCER + "pinion.mass = -2.0: " + A_MASS),
    ("mass = 2.0", "mass = 0.0", REDUCER + "pinion.mass = 0.0: " + A_MASS),
    ("mass = 2.0", "mass = nan", REDUCER + "pinion.mass = nan: " + A_MASS),
    ("mass = 2.0", "mass = inf", REDUCER + "pinion.mass = inf: " + A_MASS),
    ("mass = 2.0", "mass = true", REDUCER + "pinion.mass = true: " + A_MASS),
    ("mass = 2.0", 'mass = "2"', REDUCER + 'pinion.mass = "2": ' + A_MASS),
    ("mass = 2.0, ", "", REDUCER + "pinion.mass: missing; " + A_MASS),
    (
        "mesh_stiffness = 2.0e8",
        "mesh_stiffness = -2.0e8",
        REDUCER + "mesh_stiffness = -2.0e8: must be a number, at least 0 (N/m)",
    ),
    (
        "stiffness_proportional = 0.0",
        "stiffness_proportional = -1e-6",
        "damping.stiffness_proportional = -1.0e-6: must be a number, at least 0 (s)",
    ),
    (
        "helix_angle = 0.0",
        "helix_angle = 90",
        REDUCER + "helix_angle = 90: must be a number, greater than -90 and less than 90 (deg)",
    ),
    (
        "radius = 0.0387  ",
        "radius = 0.0  ",
        COUPLING + "radius = 0.0: must be a number, at least 1e-06 and at most 1000 (m)",
    ),
    (
        "planets = 4",
        "planets = 1",
        PLANETARY + "planets = 1: must be a whole number, at least 2 and at most 100",
    ),
    (
        "planets = 4",
        "planets = 4.0",
        PLANETARY + "planets = 4.0: must be a whole number, at least 2 and at most 100",
    ),
    (
        "planets = 4",
        "planet_angles = [0.0]",
        PLANETARY + "planet_angles = [0.0]: must be a list of at least 2 angles (deg)",
    ),
    (
        "planets = 4",
        'planet_angles = [0.0, "a"]',
        PLANETARY + 'planet_angles[1] = "a": must be a number (deg)',
    ),
    (
        "second_stiffness = 1.0e5",
        'second_stiffness = "rigd"',
        COUPLING + 'second_stiffness = "rigd": must be a number, at least 0 (N/m) or "rigid"',
    ),
    (
        'name = "reducer"',
        'name = "a.b"',
        "stage[0] 'a.b': name = \"a.b\": must be a letter or _, then letters, digits, _ or -",
    ),
    (
        'type = "parallel"',
        'type = "bevel"',
        REDUCER + 'type = "bevel": must be "parallel" or "planetary"',
    ),
    (
        'type = "parallel"',
        "",
        REDUCER + 'type: missing; must be "parallel" or "planetary"',
    ),
    (
        "planet  = {",
        "planet = 3 #",
        PLANETARY + "planet = 3: must be a table with mass, polar_inertia, "
        "polar_inertia_over_r2, base_radius, teeth",
    ),
    (
        'name = "Two-stage reducer"',
        "",
        "name: missing; must be text",
    ),
]


@pytest.mark.parametrize(("old", "new", "expected"), VALUES)
def test_wrong_value_names_place_key_value_and_what_is_allowed(
    old: str, new: str, expected: str
) -> None:
    assert message(changed(old, new)) == expected


CONTRADICTIONS = [
    (
        "polar_inertia_over_r2 = 1.16",
        "polar_inertia_over_r2 = 1.16, polar_inertia = 0.5",
        REDUCER + "pinion: give exactly one of 'polar_inertia' or 'polar_inertia_over_r2'; both "
        "are there (polar_inertia = 0.5, polar_inertia_over_r2 = 1.16)",
    ),
    (
        "polar_inertia_over_r2 = 1.16, ",
        "",
        REDUCER + "pinion: give exactly one of 'polar_inertia' or 'polar_inertia_over_r2'; "
        "neither is there",
    ),
    (
        " bearing = 1.0e8",
        " bearing_u = 1.0e8",
        PLANETARY + "sun: 'bearing_v' is missing; 'bearing' or 'bearing_u' and 'bearing_v' must "
        "be given in full",
    ),
    (
        "planets = 4",
        "",
        PLANETARY + "give exactly one of 'planets' or 'planet_angles'; neither is there",
    ),
    (
        "planets = 4",
        "planets = 7",
        PLANETARY + "planets = 7: makes planets 1 and 2 overlap; their centres are 0.08485 m "
        "apart, less than two pitch radii (0.1104 m); use fewer or smaller planets, or wider "
        "angles",
    ),
    (
        "planets = 4",
        "planet_angles = [0, 90, 360]",
        PLANETARY + "planet_angles = [0.0, 90.0, 360.0]: puts planets 1 and 3 at the same place; "
        "every planet needs its own angle",
    ),
    (
        "ring    = {",
        "ring = { base_radius = 0.2,",
        PLANETARY + "ring.base_radius = 0.2: contradicts the geometry; the base radii and "
        "pressure angles give 0.1391 m (agree within 0.5%, or leave the key out)",
    ),
    (
        "carrier = {",
        "carrier = { radius = 0.1,",
        PLANETARY + "carrier.radius = 0.1: contradicts the geometry; the base radii and pressure "
        "angles give 0.0977744 m (agree within 0.5%, or leave the key out)",
    ),
    (
        '"reducer.wheel"',
        '"reducer.whel"',
        COUPLING + f"first = 'reducer.whel': not a body of this drivetrain; allowed: {BODIES}",
    ),
    (
        '"reducer.wheel"',
        '"planetary.ring"',
        COUPLING + "second = 'planetary.sun': lies in the same stage as first = "
        "'planetary.ring'; a coupling joins bodies of two stages",
    ),
    (
        "inertia_over_r2 = 4.48e-8",
        "inertia_over_r2 = 0.0",
        COUPLING + "inertia_over_r2 = 0.0: a hub between two springs needs an inertia greater "
        'than 0; it may be 0 only where one end is "rigid"',
    ),
    (
        'name = "planetary"',
        'name = "reducer"',
        "name = 'reducer': used 2 times; every stage, inertia and coupling needs a name of its own",
    ),
]


@pytest.mark.parametrize(("old", "new", "expected"), CONTRADICTIONS)
def test_contradiction_names_both_sides(old: str, new: str, expected: str) -> None:
    assert message(changed(old, new)) == expected


UNKNOWN_KEYS = [
    ("mass = 2.0", "mas = 2.0", REDUCER + "pinion.mas = 2.0", "mass"),
    ("planet_bearing =", "planet_baring =", PLANETARY + "planet_baring = 1.0e8", "planet_bearing"),
    ("[damping]", "[dampng]", "dampng = { stiffness_proportional", "damping"),
    ("[[coupling]]", "[[couplings]]", "couplings = [{ name", "coupling"),
    (
        "second_stiffness",
        "second_stifness",
        COUPLING + "second_stifness = 1.0e5",
        "second_stiffness",
    ),
]


@pytest.mark.parametrize(("old", "new", "start", "nearest"), UNKNOWN_KEYS)
def test_unknown_key_is_answered_with_the_nearest_right_one(
    old: str, new: str, start: str, nearest: str
) -> None:
    line = message(changed(old, new))
    assert line.startswith(start)
    assert f": unknown key; did you mean '{nearest}'? allowed: " in line
    assert "more:" not in line


def test_unknown_key_without_a_near_one_lists_all() -> None:
    line = message(changed("mass_proportional = 0.0", "zeta = 0.01"))
    assert line == (
        "damping.zeta = 0.01: unknown key; allowed: stiffness_proportional, mass_proportional"
    )


def test_further_errors_are_counted_and_placed() -> None:
    text = changed("mass = 2.0", "mass = -2.0").replace("second_stiffness = 1.0e5", "")
    assert message(text) == (
        f"{REDUCER}pinion.mass = -2.0: must be a number, greater than 0 (kg) "
        f"(and 1 more: {COUPLING}second_stiffness)"
    )


@pytest.mark.parametrize("text", ["", "\n", "# only a comment\n"])
def test_empty_file(text: str) -> None:
    assert message(text) == (
        "the file is empty; it needs a name and at least one [[stage]] or [[inertia]] table"
    )


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('name = "a"', "there is nothing in it; give at least one [[stage]] or [[inertia]]"),
        (
            'name = "a"\nstage = []',
            "there is nothing in it; give at least one [[stage]] or [[inertia]]",
        ),
        ('name = "a"\nstage = 1', "stage = 1: must be [[stage]] tables"),
        (
            'name = "a"\nstage = [1]',
            'stage[0] = 1: must be a table with type "parallel" or "planetary"',
        ),
    ],
)
def test_no_stage(text: str, expected: str) -> None:
    assert message(text) == expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('name = "a"\nstage =', r"line 2, column 8|end of document"),
        ("name", "end of document|line 1"),
        ("x = " + "[" * 100_000, "recursion"),
        ("x = " + "1" * 5_000, "digits"),
        ('name = "a"\nname = "b"\n', "is there already .at line 2, column 11.: name = .b.$"),
        ("teeth = 3,5", "line 1, column 10.: teeth = 3,5$"),
    ],
    ids=["no value", "no equals sign", "deep", "long number", "key twice", "comma"],
)
def test_broken_toml(text: str, expected: str) -> None:
    line = message(text)
    assert line.startswith("not valid TOML: ")
    assert re.search(expected, line)


def test_broken_toml_gives_line_and_column() -> None:
    assert message('name = "a"\nx = ,\n').endswith("(at line 2, column 5): x = ,")


@pytest.mark.parametrize(
    "key_and_value", ['"a\\nb" = 3', 'name = "a\\nb"', 'pressure_angle = "\\n"']
)
def test_message_stays_on_one_line(key_and_value: str) -> None:
    key = key_and_value.partition(" = ")[0]
    text = changed('name = "reducer"', "" if key == "name" else 'name = "reducer"')
    assert "\\n" in message(text.replace("helix_angle = 0.0", key_and_value))


# Files


def test_load_reads_a_file(tmp_path: Path) -> None:
    file = tmp_path / "gear.toml"
    file.write_text(PAPER, encoding="utf-8-sig")  # with a byte order mark, as some editors write
    assert load(file) == load(str(file)) == load("paper")


def test_load_names_the_file(tmp_path: Path) -> None:
    file = tmp_path / "gear.toml"
    file.write_text(changed("mass = 2.0", "mass = 0.0"), encoding="utf-8")
    with pytest.raises(ModelError, match=re.escape(f"{file}: {REDUCER}pinion.mass = 0.0: must")):
        load(file)


def test_load_of_neither_preset_nor_file_suggests_a_preset() -> None:
    with pytest.raises(ModelError) as caught:
        load("papr")
    assert str(caught.value) == (
        "papr: neither a file nor a preset; did you mean 'paper'? "
        f"allowed: {', '.join(preset_names())}"
    )


def test_load_of_a_directory(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=f"^{re.escape(str(tmp_path))}: cannot be read: "):
        load(tmp_path)


def test_load_without_permission(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any, **__: Any) -> str:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open", refuse)
    with pytest.raises(ModelError, match=r"gear\.toml: cannot be read: Permission denied$"):
        load(tmp_path / "gear.toml")


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="needs a device")
def test_what_is_no_file_or_too_large_is_not_read(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="/dev/zero: is a device or a pipe, no file"):
        load("/dev/zero")
    sparse = tmp_path / "gear.toml"
    with sparse.open("wb") as file:
        file.truncate(1 << 40)
    with pytest.raises(ModelError, match=r"gear\.toml: is larger than 16 MB, as no model file is"):
        load(sparse)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("mass = 2.0", "mass = 1e300", "pinion.mass = 1.0e300: must be within 1e-15 to 1e9 kg"),
        ("mass = 2.0", "mass = 5e-324", "pinion.mass = 5.0e-324: must be within 1e-15 to 1e9 kg"),
        ("mesh_stiffness = 2.0e8", "mesh_stiffness = 1e-9", "must be within 0.001 to 1e15 N/m"),
        ('name = "Two', 'name = "\\u001b[2JTwo', "has the character U+001B; must be printable"),
        ('name = "Two', 'name = "\\u202eTwo', "has the character U+202E; must be printable"),
    ],
)
def test_what_is_not_physical_is_named(old: str, new: str, told: str) -> None:
    assert old in template()
    with pytest.raises(ModelError, match=re.escape(told)):
        loads(template().replace(old, new, 1))


def test_more_parts_than_anybody_waits_for() -> None:
    text = 'name = "x"\n' + 10_001 * "[[inertia]]\n"
    with pytest.raises(ModelError, match=r"\[\[inertia\]\]: 10001 tables; at most 10000 are"):
        loads(text)


def test_a_chain_of_two_thousand_parts_is_read_in_a_moment() -> None:
    """Quadratic cost would take minutes, a recursion would end at a thousand."""
    rotor = '[[inertia]]\nname = "r{0}"\nradius = 0.1\npolar_inertia = 0.5\n'
    hub = (
        '[[coupling]]\nname = "c{0}"\nfirst = "r{0}"\nsecond = "r{1}"\nradius = 0.1\n'
        "inertia = 0.01\nfirst_stiffness = 1e8\nsecond_stiffness = 1e8\n"
    )
    text = 'name = "chain"\n' + "".join(rotor.format(i) for i in range(2000))
    text += "".join(hub.format(i, i + 1) for i in range(1999))
    began = time.perf_counter()
    drivetrain = loads(text)
    assert len(place_parts(drivetrain)) == 2000
    assert len(drivetrain.groups()) == 1
    assert drivetrain.warnings() == ()
    assert time.perf_counter() - began < 20.0


def test_a_copy_forgets_what_was_derived_of_its_original() -> None:
    paper = load("paper")
    assert paper.part("reducer").name == "reducer"
    renamed = paper.stages[0].model_copy(update={"name": "other"})
    copy = paper.model_copy(update={"stages": (renamed,), "couplings": ()})
    assert copy.part("other").name == "other"
    assert set(copy.facing) == {"other"}
    assert len(copy.groups()) == 1


def test_load_of_what_is_not_utf_8(tmp_path: Path) -> None:
    file = tmp_path / "gear.toml"
    file.write_bytes(b'name = "\xff"')
    with pytest.raises(
        ModelError, match=r"gear\.toml: not a text file in UTF-8 \(byte 8 is not\)$"
    ):
        load(file)


def test_write_new_writes_what_loads_to_the_same(tmp_path: Path) -> None:
    write_new(tmp_path / "gear.toml", PAPER)
    assert load(tmp_path / "gear.toml") == load("paper")
    assert [file.name for file in tmp_path.iterdir()] == ["gear.toml"]


def test_write_new_refuses_to_overwrite(tmp_path: Path) -> None:
    file = tmp_path / "gear.toml"
    file.write_text("mine")
    with pytest.raises(ModelError, match=r"gear\.toml: exists already and is not overwritten"):
        write_new(file, PAPER)
    assert file.read_text() == "mine"


def test_write_new_names_a_place_that_does_not_exist(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=r"gear\.toml: cannot be written: No such file"):
        write_new(tmp_path / "nowhere" / "gear.toml", PAPER)


# Round trip

Table = dict[str, Any]


def numbers(low: float = 1e-3, high: float = 1e6) -> SearchStrategy[float]:
    """Within what every key holds for physical."""
    return st.floats(low, high)


positive = numbers()


@st.composite
def inertias(draw: st.DrawFn, key: str) -> Table:
    """One of the two forms of a quantity."""
    return {key + draw(st.sampled_from(["", "_over_r2"])): draw(positive)}


@st.composite
def gears(draw: st.DrawFn) -> Table:
    rocking = draw(st.sampled_from(["bearing_rocking", "bearing_rocking_over_r2"]))
    return {
        "mass": draw(positive),
        "base_radius": draw(numbers(1e-3, 10.0)),
        **draw(inertias("polar_inertia")),
        **draw(inertias("diametral_inertia")),
        "bearing_y": draw(numbers()),
        "bearing_z": draw(numbers()),
        rocking: draw(numbers()),
    }


@st.composite
def central_members(draw: st.DrawFn, /, **radius: float) -> Table:
    bearings = draw(st.sampled_from([("bearing",), ("bearing_u", "bearing_v")]))
    support = draw(st.sampled_from(["torsional_support", "torsional_stiffness"]))
    return {
        "mass": draw(positive),
        **draw(inertias("polar_inertia")),
        **{key: draw(numbers()) for key in bearings},
        support: draw(numbers()),
        **radius,
    }


@st.composite
def parallel_stages(draw: st.DrawFn, name: str) -> Table:
    stage = {"type": "parallel", "name": name, "mesh_stiffness": draw(numbers())}
    if draw(st.booleans()):
        stage["helix_angle"] = draw(numbers(-45.0, 45.0))
    return {**stage, "pinion": draw(gears()), "wheel": draw(gears())}


@st.composite
def planetary_stages(draw: st.DrawFn, name: str) -> Table:
    spacings: list[Table] = [{"planets": 3}, {"planet_angles": [0.0, 100.5, 230.0]}]
    angles = draw(
        st.sampled_from([("pressure_angle",), ("sun_pressure_angle", "ring_pressure_angle")])
    )
    bearings = draw(
        st.sampled_from(
            [("planet_bearing",), ("planet_bearing_radial", "planet_bearing_tangential")]
        )
    )
    return {
        "type": "planetary",
        "name": name,
        **draw(st.sampled_from(spacings)),
        **{key: draw(numbers(5.0, 30.0)) for key in angles},
        "sun_mesh_stiffness": draw(numbers()),
        "ring_mesh_stiffness": draw(numbers()),
        **{key: draw(numbers()) for key in bearings},
        "sun": draw(central_members(base_radius=0.04)),
        "ring": draw(central_members()),
        "carrier": draw(central_members()),
        "planet": {"mass": draw(positive), "base_radius": 0.02, **draw(inertias("polar_inertia"))},
    }


# what can be read, and no character that steers a terminal or the direction of writing
titles = st.text(
    st.characters(exclude_categories=("C", "Zl", "Zp"), include_characters="\xad"), max_size=200
)


@st.composite
def drivetrains(draw: st.DrawFn) -> Drivetrain:
    stiffness = numbers() | st.just("rigid")
    data: Table = {"name": draw(titles), "stage": [draw(parallel_stages("a"))]}
    if draw(st.booleans()):
        data["source"] = draw(titles)
    if draw(st.booleans()):
        data["damping"] = {"mass_proportional": draw(numbers())}
    if draw(st.booleans()):
        data["stage"].append(draw(planetary_stages("b")))
        data["coupling"] = [
            {
                "name": "c",
                "first": draw(st.sampled_from(["a.pinion", "a.wheel"])),
                "second": draw(st.sampled_from(["b.sun", "b.ring", "b.carrier"])),
                "radius": draw(numbers(1e-3, 10.0)),
                **draw(inertias("inertia")),
                "first_stiffness": draw(stiffness),
                "second_stiffness": draw(stiffness),
            }
        ]
    return Drivetrain.model_validate(data)


@given(drivetrains())
def test_what_is_written_loads_to_an_equal_drivetrain(drivetrain: Drivetrain) -> None:
    again = loads(dumps(drivetrain))
    assert again == drivetrain
    assert dumps(again) == dumps(drivetrain)


@pytest.mark.parametrize("preset", preset_names())
def test_presets_survive_the_round_trip(preset: str) -> None:
    assert loads(dumps(load(preset))) == load(preset)


def test_written_text_keeps_the_keys_given_and_inline_tables() -> None:
    text = dumps(load("paper"))
    assert "planet = { mass = 0.66, polar_inertia_over_r2 = 0.61, base_radius = 0.0502 }" in text
    assert "mesh_stiffness = 2.0e8" in text
    assert "pressure_angle = 20" not in text  # a default that the file does not give
