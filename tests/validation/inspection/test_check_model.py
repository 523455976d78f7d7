"""`crosscheck check`: one mistake in a preset's text is one message that names it."""

from __future__ import annotations

from pathlib import Path

import pytest

from mbs_models.model.model_file import preset_names, template
from tests.validation.command_line import call
from validation.inspection.check_model import with_prefix

TABLE_2, TURBINE = template("paper-table2"), template("wind-turbine")
# 38.7/50.2 = 0.7709, 27/35 = 0.7714; (27 + 97)/4 = 31, and (27 + 98)/5 = 25.
WITH_TEETH = (
    template("lin-parker-4")
    .replace("base_radius = 0.0387", "base_radius = 0.0387, teeth = 27")
    .replace("base_radius = 0.0502", "base_radius = 0.0502, teeth = 35")
    .replace("ring    = {", "ring    = { teeth = 97,")
)

# What is typed wrong: preset, what it has, what is typed, and words of the one message.
REFUSED = {
    "three planets do not fit 100 teeth": (
        TABLE_2, "planets = 4", "planets = 3",
        ["planets = 3: (z_s + z_r)/N = 33.3333", "ring.teeth = 69 or 72, sun.teeth = 29 or 32"],
    ),
    "planets at angles that no tooth is at": (
        TABLE_2, "planets = 4", "planet_angles = [0.0, 88.0, 180.0, 270.0]",
        ["planet 2 (z_s + z_r) ψ/2π = 24.44", "nearest are planet_angles = [0, 86.4, 180, 270]"],
    ),
    "a tooth too many at the sun": (
        TURBINE, "teeth = 19", "teeth = 20",
        ["planet.teeth = 17: contradicts sun.teeth = 20; base_radius 0.359432 and 0.401718 m give "
         "17.89"],
    ),
    "a tooth too many at the wheel": (
        TURBINE, "teeth = 95", "teeth = 96", ["wheel.teeth = 96", "expected 95 with pinion.teeth"],
    ),
    "a tooth too few at the ring": (
        TURBINE, "teeth = 93", "teeth = 92", ["ring.teeth = 92", "expected 93 with sun.teeth = 18"],
    ),
    "three teeth too many in a standard ring": (
        WITH_TEETH, "teeth = 97", "teeth = 100", ["ring.teeth = 100: contradicts", "give 97.05"],
    ),
    "a sun's base radius in mm": (
        TABLE_2, "base_radius = 0.024, teeth", "base_radius = 24, teeth",
        ["planet.teeth = 20: contradicts sun.teeth = 30", "is 24 m in mm?"],
    ),
}  # fmt: skip

ODD = {
    "a ring that is a tooth off": (
        WITH_TEETH.replace("planets = 4", "planets = 5"), "teeth = 97", "teeth = 98",
        ["planetary: ring.teeth = 98: expected z_s + 2 z_p = 97", "sun_pressure_angle"],
    ),
    "a gear's radius in mm": (
        TABLE_2,
        "wheel  = { mass = 2.0, base_radius = 0.0",
        "wheel  = { mass = 2.0, base_radius = ",
        ["reducer: wheel.base_radius = 24 m: expected 0.0005 to 10 m; 24 mm are 0.024 m"],
    ),
    "a hub's radius in mm": (
        TABLE_2, "radius = 0.024     ", "radius = 24     ",
        ["coupling: radius = 24 m: expected 0.0005 to 10 m; 24 mm are 0.024 m"],
    ),
    "a pressure angle in radians": (
        TABLE_2, "pressure_angle = 21.34", "pressure_angle = 0.3725",
        ["planetary: pressure_angle = 0.3725°: expected 10 to 40°; 0.3725 rad are 21.34°"],
    ),
    "a helix angle in radians": (
        TURBINE, "helix_angle = 9.391", "helix_angle = 0.1639",
        ["high_speed: helix_angle = 0.1639°: expected 0 or at least 1°", "0.1639 rad are 9.391°"],
    ),
    "backlash in mm": (
        TABLE_2, "\nmesh_stiffness", "\nmesh_backlash = 0.05\nmesh_stiffness",
        ["reducer: mesh_backlash = 0.05 m: expected at most 0.005 m; is it in mm or µm?"],
    ),
    "a transmission error in µm": (
        TABLE_2,
        "\nsun_mesh_stiffness",
        "\nsun_mesh_transmission_error = { harmonics = [[1.5, 0.0]] }\nsun_mesh_stiffness",
        ["planetary: sun_mesh_transmission_error.harmonics = 1.5 m: expected at most 0.0005 m"],
    ),
    "kg m² for I/r²": (
        TABLE_2, "polar_inertia_over_r2 = 0.1 }", "polar_inertia_over_r2 = 2.56e-5 }",
        ["planetary: planet.polar_inertia_over_r2 = 2.56e-05 kg: expected 0.0177 to 0.531 kg for a "
         "gear of 0.177 kg; it fits planet.polar_inertia (kg m²)"],
    ),
    "I/r² for kg m²": (
        TABLE_2, "polar_inertia_over_r2 = 0.759", "polar_inertia = 0.759",
        ["planetary: ring.polar_inertia = 0.759 kg m²: expected 0.000922 to 0.00738 kg m² for a "
         "ring of 0.588 kg; it fits ring.polar_inertia_over_r2 (kg)"],
    ),
    "a mass in g": (
        TABLE_2, "carrier = { mass = 3.0", "carrier = { mass = 3000.0",
        ["planetary: carrier.mass = 3000 kg: expected 0.00195 to 195 kg for a radius of 0.04294 m"],
    ),
    "less inertia about a diameter than a disc has": (
        TABLE_2, "diametral_inertia_over_r2 = 0.58", "diametral_inertia_over_r2 = 0.058",
        ["reducer: pinion.diametral_inertia_over_r2 = 0.058 kg: expected 0.58 to 200 kg"],
    ),
    "a mesh in N/mm": (
        TABLE_2, "\nmesh_stiffness = 2.0e8", "\nmesh_stiffness = 2.0e5",
        ["reducer: mesh_stiffness = 200000 N/m: expected 1.2e+07 to 7.7e+09 N/m",
         "51.1 mm in diameter; 200000 N/mm are 2e+08 N/m"],
    ),
    "a mesh a thousand times too stiff": (
        TABLE_2, "\nring_mesh_stiffness = 2.0e8", "\nring_mesh_stiffness = 2.0e11",
        ["planetary: ring_mesh_stiffness = 2e+11 N/m: expected 8.0e+06 to 5.2e+09 N/m"],
    ),
    "a mesh of nothing": (
        TABLE_2, "\nmesh_stiffness = 2.0e8", "\nmesh_stiffness = 0.0",
        ["reducer: mesh_stiffness = 0 N/m: expected 1.2e+07 to"],
    ),
    "a bearing in N/mm": (
        TABLE_2, "bearing_y = 3.5e8", "bearing_y = 3.5e5",
        ["reducer: pinion.bearing_y = 350000 N/m: expected 1.0e+06 to 1.0e+11 N/m for a bearing; "
         "350000 N/mm are 3.5e+08 N/m"],
    ),
    "N m/rad for N/m": (
        TABLE_2, "bearing_rocking_over_r2 = 1.0e8", "bearing_rocking_over_r2 = 57600.0",
        ["reducer: pinion.bearing_rocking_over_r2 = 57600 N/m: expected 1.0e+05 to"],
    ),
    "a shaft in N/mm": (
        TABLE_2, "second_stiffness = 1.0e5", "second_stiffness = 1.0e2",
        ["coupling: second_stiffness = 100 N/m: expected 1.0e+03 to 1.0e+12 N/m for a shaft"],
    ),
    "no bearing": (
        TABLE_2, "bearing_z = 1.0e8", "bearing_z = 0.0",
        ["reducer: pinion.bearing_z = 0 N/m: nothing holds pinion.z; expected 1.0e+06 to"],
    ),
    "a ring that nothing holds": (
        TABLE_2, "torsional_support = 1.0e9", "torsional_support = 0.0",
        ["planetary: ring.torsional_support = 0 N/m: the ring turns freely (carrier too): no "
         "torque passes through the stage; expected it held"],
    ),
    "an input that is held": (
        TABLE_2, 'input = "reducer.pinion"', 'input = "planetary.ring"',
        ["operation: input = 'planetary.ring': cannot turn, a torsional support holds it; expected "
         "one of reducer.pinion, reducer.wheel, planetary.sun, planetary.carrier"],
    ),
    "an output that is held": (
        TABLE_2, "[operation]", '[operation]\noutput = "planetary.ring"',
        ["operation: output = 'planetary.ring': does not turn with the input; expected one of "
         "reducer.wheel, planetary.sun, planetary.carrier"],
    ),
    "a torque in N mm": (
        TABLE_2, "[operation]", "[operation]\ntorque = 20000.0",
        ["operation: torque = 20000 N m: mesh reducer.pinion – wheel gives way by 4.17 mm under "
         "8.33e+05 N; expected at most 0.5 mm, that is 2400 N m"],
    ),
}  # fmt: skip


def check(text: str, folder: Path) -> int:
    path = folder / "gear.toml"
    path.write_text(text, encoding="utf-8")
    return call("check", str(path))


@pytest.mark.parametrize("mistake", REFUSED)
def test_what_no_drivetrain_can_be_is_refused(
    mistake: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text, old, new, words = REFUSED[mistake]
    assert old in text
    assert check(text.replace(old, new, 1), tmp_path) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    for word in ["gear.toml", *words]:
        assert word in captured.err


@pytest.mark.parametrize("mistake", ODD)
def test_one_mistake_is_one_warning(
    mistake: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text, old, new, words = ODD[mistake]
    assert old in text
    assert check(text.replace(old, new, 1), tmp_path) == 0
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("warning: ")
    for word in words:
        assert word in line


# The marine drive's source has pinions without inertia: theirs is next to none, their mass chosen.
PINIONS = {
    "geared-torsional": [
        "warning: lp_first: pinion.polar_inertia = 1 kg m²: expected 4 to 120 kg m² for a gear "
        "of 1000 kg",
        "warning: hp_first: pinion.polar_inertia = 0.5 kg m²: expected 1 to 30 kg m² for a gear of "
        "1000 kg",
    ]
}


@pytest.mark.parametrize("preset", preset_names())
def test_presets_are_not_odd(preset: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert call("check", preset) == 0
    assert capsys.readouterr().err.splitlines() == PINIONS.get(preset, [])


def test_ratios_speeds_and_torques(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """NREL's turbine at 4.18 MN m: 97 times less at the generator, z_s/z_c by (z_s + z_r)/z_s.

    Sun to carrier 1 + 56/19 = 3.947 and 1 + 93/18 = 6.167, wheel to pinion 95/24 = 3.958, in all
    96.35; f = z Ω of the pinion is 24 · 1166/60 = 466 Hz. What enters a stage less what leaves it
    is held by its ring: 4.18 (1 − 1/3.947) = 3.121.
    """
    text = TURBINE.replace("[operation]", "[operation]\ntorque = 4.18e6")
    assert check(text, tmp_path) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    assert captured.out[captured.out.index("  low_speed, ") :] == (
        "  low_speed, intermediate, high_speed, rotor, generator: turns freely as one\n"
        "  ratio rotor to generator: 1 : 96.35, opposite senses\n"
        "  at 12.1 rpm of rotor (end of speed_range), 4.18 MN m:\n"
        "    low_speed.sun            47.76 rpm  1.059 MN m\n"
        "    low_speed.ring               0 rpm  3.121 MN m\n"
        "    low_speed.carrier         12.1 rpm  4.18 MN m\n"
        "    intermediate.sun         294.5 rpm  171.7 kN m\n"
        "    intermediate.ring            0 rpm  887.2 kN m\n"
        "    intermediate.carrier     47.76 rpm  1.059 MN m\n"
        "    high_speed.pinion        -1166 rpm  43.38 kN m\n"
        "    high_speed.wheel         294.5 rpm  171.7 kN m\n"
        "    rotor                     12.1 rpm  4.18 MN m\n"
        "    generator                -1166 rpm  43.38 kN m\n"
        "    mesh frequency of low_speed: 11.29 Hz\n"
        "    mesh frequency of intermediate: 74.03 Hz\n"
        "    mesh frequency of high_speed: 466.4 Hz\n"
    )


def test_a_torque_without_an_output_is_told_and_speeds_are_printed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Two turbines drive one propeller: which takes the reaction the file must say."""
    operation = '[operation]\ninput = "propeller"\nspeed_range = [1.0, 100.0]\ntorque = 1e6\n'
    text = template("geared-torsional").replace("[[inertia]]", operation + "\n[[inertia]]", 1)
    assert check(text, tmp_path) == 0
    captured = capsys.readouterr()
    told = [line for line in captured.err.splitlines() if line not in PINIONS["geared-torsional"]]
    assert len(told) == 1
    assert "needs a reaction at the other end of the drivetrain, but there are 2" in told[0]
    assert "  at 100 rpm of propeller (end of speed_range), no torque given:\n" in captured.out
    assert "hp_turbine            7824 rpm\n" in captured.out  # 78.2365 times, as the source has it


@pytest.mark.parametrize(
    ("value", "written"),
    [(8.676e6, "8.676 MN m"), (43381.0, "43.38 kN m"), (12.0, "12 N m"), (0.0, "0 N m")],
)
def test_prefixes(value: float, written: str) -> None:
    assert with_prefix(value, "N m") == written
