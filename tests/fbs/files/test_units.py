"""Units of measured FRFs: every spelling, data type and unit system, against pint."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pint
import pytest

from fbs import FbsError, Quantity
from fbs.files.frf_files import read_frf
from fbs.files.measurement import Given
from fbs.files.units import FORCE, LENGTH, TIME, UnitError, read_unit, readings, times
from tests.fbs.files.foreign_files import Foreign, units_text, written

REGISTRY: pint.UnitRegistry[Any] = pint.UnitRegistry()
REGISTRY.define("none = 1")
SPELLINGS = {
    "m/s^2": "m/s**2", "m/s2": "m/s**2", "m/s**2": "m/s**2", "m/s²": "m/s**2", "M/S2": "m/s**2",
    "m s-2": "m/s**2", "m·s⁻²": "m/s**2", "m/s/s": "m/s**2", "m/sec^2": "m/s**2",
    "m*s^-2": "m/s**2", "[m/s²]": "m/s**2", "m/sÂ²": "m/s**2", "m/(s^2)": "m/s**2",
    "g": "standard_gravity", "G": "standard_gravity", "gn": "standard_gravity",
    "g_n": "standard_gravity", "g0": "standard_gravity",
    "mm/s^2": "mm/s**2", "MM/S**2": "mm/s**2", "cm/s²": "cm/s**2", "µm/s²": "um/s**2",
    "μm/s²": "um/s**2", "um/s^2": "um/s**2",
    "in/s^2": "inch/s**2", "inch/sec2": "inch/s**2", "ft/s^2": "foot/s**2",
    "m/s": "m/s", "mm/s": "mm/s", "ips": "inch/s", "in/sec": "inch/s", "mm s^-1": "mm/s",
    "m": "m", "mm": "mm", "µm": "um", "mil": "mil_length", "in": "inch", "inches": "inch",
    "nm": "nm",
    "N": "N", "kN": "kN", "KN": "kN", "mN": "mN", "lbf": "lbf", "LBF": "lbf", "lb": "lbf",
    "kgf": "kgf", "kp": "kgf", "dyn": "dyne",
    "rad": "rad", "mrad": "mrad", "deg": "deg", "°": "deg", "rad/s^2": "rad/s**2",
    "deg/s": "deg/s", "rpm": "rpm",
    "N m": "N*m", "Nm": "N*m", "N-m": "N*m", "N.m": "N*m", "N·m": "N*m", "NM": "N*m", "kNm": "kN*m",
    "lbf in": "lbf*inch", "in-lbf": "lbf*inch", "lbf.ft": "lbf*foot", "Nmm": "N*mm",
    "(m/s^2)/N": "m/s**2/N", "m/s²/N": "m/s**2/N", "1/kg": "1/kg", "kg^-1": "1/kg", "kg-1": "1/kg",
    "1/g": "1/gram", "g/N": "standard_gravity/N", "g/lbf": "standard_gravity/lbf",
    "(in/s^2)/lb": "inch/s**2/lbf", "m/(N s)": "m/(N*s)", "m/N s": "m/(N*s)", "m/Ns": "m/(N*s)",
    "mm/s/N": "mm/s/N", "m/N": "m/N", "µm/N": "um/N", "in/lbf": "inch/lbf", "mm/kN": "mm/kN",
    "m/(N s²)": "m/(N*s**2)", "in/s²": "inch/s**2", "mm/s2": "mm/s**2", "(m/s²)/N": "m/s**2/N",
    "rad/s²/(N m)": "rad/s**2/(N*m)", "rad/Nm": "rad/(N*m)",
    "deg/(lbf in)": "deg/(lbf*inch)", "rad/(N·m·s)": "rad/(N*m*s)",
}  # fmt: skip


def pint_factor(expression: str) -> float:
    return float(REGISTRY(expression).to_base_units().magnitude)


@pytest.mark.parametrize(("label", "expression"), SPELLINGS.items())
def test_spellings_against_pint(label: str, expression: str) -> None:
    quantity = REGISTRY(expression).to_base_units()
    powers = dict(quantity.unit_items() if hasattr(quantity, "unit_items") else ())
    powers = {str(unit): round(float(str(power))) for unit, power in powers.items()}
    dimension = tuple(powers.get(u, 0) for u in ("meter", "kilogram", "second", "radian"))
    unit = read_unit(label, [dimension])  # type: ignore[list-item]
    assert unit is not None, readings(label)
    np.testing.assert_allclose(unit.factor, quantity.magnitude, rtol=1e-12)


def test_every_letter_of_a_label_counts() -> None:
    for label in ("", "V", "m/s^", "m//s", "((m", "m)", "dB", "m/s^99", "x" * 100, "m^2^3", "%"):
        with pytest.raises(UnitError):
            readings(label)
    assert read_unit("m/s", [times(LENGTH, TIME, -2)]) is None
    assert read_unit("kg", [FORCE]) is None


# --- labels, data types and dataset 164 together ------------------------------------------------

SYSTEMS = {
    None: ("m", "N"),
    (1.0, 1.0, 1): ("m", "N"),
    (1e3, 1.0, 10): ("mm", "N"),
    (1e3, 1e3, 5): ("mm", "mN"),
    (39.37007874015748, 0.22480894309971047, 7): ("inch", "lbf"),
    (39.37, 0.224809, 9): ("inch", "lbf"),
}
LABELS = {
    8: [("NONE", "NONE"), ("m", "N"), ("mm", "N"), ("µm", "kN"), ("in", "lbf"), ("m/N", "NONE")],
    11: [("NONE", "NONE"), ("m/s", "N"), ("mm/s", "N"), ("ips", "lbf"), ("m/(N s)", "N")],
    12: [("NONE", "NONE"), ("m/s^2", "N"), ("g", "N"), ("g", "lbf"), ("in/s²", "lbf"),
         ("mm/s2", "mN"), ("1/kg", "N"), ("(m/s²)/N", "NONE")],
}  # fmt: skip
TIMES = {8: "", 11: "/s", 12: "/s**2"}
COMBINATIONS = [
    (code, top, below, system)
    for code, labels in LABELS.items()
    for top, below in labels
    for system in SYSTEMS
]


def expected(code: int, top: str, below: str, system: Any) -> float | None:
    """Return the factor to SI by pint, or None where label and dataset 164 contradict."""
    length, force = SYSTEMS[system]
    by_system = pint_factor(f"{length}{TIMES[code]}/{force}")
    if top == below == "NONE":
        return by_system
    stated = pint_factor(SPELLINGS[top])
    if "/N" not in SPELLINGS[top] and SPELLINGS[top] not in ("1/kg", "m/(N*s)"):
        stated /= pint_factor(SPELLINGS[below])
    return stated if system is None or abs(stated / by_system - 1) < 1e-4 else None


def test_there_are_enough_combinations() -> None:
    assert len(COMBINATIONS) == 114
    refused = [c for c in COMBINATIONS if expected(*c) is None]
    assert 0.3 < len(refused) / len(COMBINATIONS) < 0.7


@pytest.mark.parametrize(("code", "top", "below", "system"), COMBINATIONS)
def test_labels_and_dataset_164_together(
    code: int, top: str, below: str, system: Any, tmp_path: Path
) -> None:
    parts: list[Foreign | str] = [Foreign(codes=(code, 13), units=(top, below))]
    if system is not None:
        parts.insert(0, units_text(*system))
    path = written(tmp_path / "x.uff", *parts)
    factor = expected(code, top, below, system)
    if factor is None:
        with pytest.raises(FbsError, match="contradicts itself: its labels say") as caught:
            read_frf(path)
        assert f"length {system[0]:g} and force {system[1]:g}" in str(caught.value)
        assert f"{top} per {below}" in str(caught.value)
        return
    # factors of dataset 164 have the digits they have: six here where they are ours to choose
    digits = 1e-12 if (top, below) != ("NONE", "NONE") or system != (39.37, 0.224809, 9) else 3e-5
    values = read_frf(path).frf.values
    np.testing.assert_allclose(values, factor, rtol=digits)


@pytest.mark.parametrize(
    ("directions", "units", "factor"),
    [
        ((4, 6), ("rad/s^2", "N m"), 1.0),
        ((4, 6), ("deg/s^2", "N·m"), np.pi / 180),
        ((4, 6), ("rad/s²/(N m)", "NONE"), 1.0),
        ((4, 6), ("NONE", "NONE"), 1.0),
        ((4, 6), ("rad/s2", "lbf in"), 1 / (4.4482216152605 * 0.0254)),
        ((3, 6), ("mm/s^2", "Nm"), 1e-3),
        ((5, 3), ("rad/s^2", "kN"), 1e-3),
        ((0, 0), ("rad/s^2", "Nm"), 1.0),
        ((0, 0), ("m/s^2", "Nm"), 1.0),
        ((4, 6), ("m/s^2", "N m"), None),
        ((4, 6), ("rad/s^2", "N"), None),
        ((3, 3), ("rad/s^2", "N"), None),
        ((3, 3), ("m/s^2", "N m"), None),
        ((3, 4), ("1/kg", "NONE"), None),
    ],
)
def test_rotations(
    directions: tuple[int, int], units: tuple[str, str], factor: float | None, tmp_path: Path
) -> None:
    ends = [("NONE", node, direction) for node, direction in zip((1, 2), directions, strict=True)]
    path = written(tmp_path / "x.uff", Foreign(ends[0], ends[1], units=units))
    if factor is None:
        with pytest.raises(FbsError, match="rotations and translations do not match"):
            read_frf(path)
        return
    found = read_frf(path)
    np.testing.assert_allclose(found.frf.values, factor, rtol=1e-12)
    assert bool(found.angles) == ("rad" in units[0] or "deg" in units[0] or directions[0] > 3)
    assert bool(found.moments) == (directions[1] > 3 or "Nm" in units[1])


@pytest.mark.parametrize(
    ("codes", "units", "given", "factor"),
    [
        ((1, 0), ("(m/s^2)/N", "NONE"), Given(Quantity("accelerance")), 1.0),
        ((1, 0), ("NONE", "NONE"), Given(Quantity("accelerance"), ("g/N",)), 9.80665),
        ((1, 0), ("(m/s^2)/N", "NONE"), Given(Quantity("accelerance"), ("g/N",)), 9.80665),
        ((0, 0), ("mm/s/N", "NONE"), Given(Quantity("mobility")), 1e-3),
        ((12, 0), ("NONE", "NONE"), Given(Quantity("accelerance"), ("1/kg",)), 1.0),
        ((1, 13), ("NONE", "N"), Given(Quantity("receptance"), ("µm/N",)), 1e-6),
        ((12, 13), ("NONE", "NONE"), Given(None, ("m/N", "in/s^2/lbf")), 0.0254 / 4.4482216152605),
    ],
)
def test_general_data_types_are_what_the_user_says(
    codes: tuple[int, int], units: tuple[str, str], given: Given, factor: float, tmp_path: Path
) -> None:
    path = written(tmp_path / "x.uff", Foreign(codes=codes, units=units))
    np.testing.assert_allclose(read_frf(path, given).frf.values, factor, rtol=1e-12)


@pytest.mark.parametrize(
    ("codes", "units", "given", "words"),
    [
        (
            (1, 0),
            ("(m/s^2)/N", "NONE"),
            Given(),
            "data type 1 per 0.*--quantity accelerance --unit",
        ),
        ((1, 0), ("NONE", "NONE"), Given(Quantity("accelerance")), "data type 1 per 0.*--quantity"),
        ((12, 0), ("m/s^2", "NONE"), Given(Quantity("accelerance")), "data type 12 per 0.*--unit"),
        (
            (12, 13),
            ("m/s^2", "N"),
            Given(Quantity("mobility")),
            "is accelerance .data type 12., not mobility",
        ),
        (
            (1, 0),
            ("mm/N", "NONE"),
            Given(Quantity("accelerance")),
            "unit 'mm/N', which its data type",
        ),
        (
            (1, 0),
            ("NONE", "NONE"),
            Given(Quantity("mobility"), ("m/N",)),
            "which no unit given has",
        ),
        ((12, 12), ("m/s^2", "m/s^2"), Given(), "transmissibilities .data type 12 per 12."),
        ((12, 13), ("m/s^2", "g"), Given(), "is a transmissibility"),
        ((12, 13), ("g", "m/s^2"), Given(Quantity("accelerance")), "is a transmissibility"),
        ((12, 13), ("g/g", "NONE"), Given(), "unit 'g/g', which its data type cannot have"),
        ((15, 13), ("Pa", "N"), Given(), "no FRF .*pressure .data type 15 per 13. of 12"),
        ((12, 13), ("V", "N"), Given(), "the unit 'V' is not known"),
        ((12, 13), ("g/lbf", "N"), Given(), "its ordinate is in 'g/lbf', its denominator in 'N'"),
    ],
)
def test_what_nobody_says_is_refused(
    codes: tuple[int, int], units: tuple[str, str], given: Given, words: str, tmp_path: Path
) -> None:
    path = written(tmp_path / "x.uff", Foreign(codes=codes, units=units))
    with pytest.raises(FbsError, match=words) as caught:
        read_frf(path, given)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


def test_a_unit_given_overrules_and_says_so(tmp_path: Path) -> None:
    path = written(tmp_path / "x.uff", units_text(1e3, 1.0), Foreign(units=("m/s^2", "N")))
    found = read_frf(path, Given(units=("m/s^2/N",)))
    np.testing.assert_allclose(found.frf.values, 1.0)
    assert found.notes == ("taken as m/s^2/N, as given, where labels say m/s^2 per N",)


def test_what_is_assumed_is_said(tmp_path: Path) -> None:
    found = read_frf(written(tmp_path / "x.uff", Foreign(units=("NONE", "NONE"))))
    assert found.notes == ("no unit is stated: taken as SI",)


def test_a_unit_code_with_other_factors_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path / "x.uff", units_text(1e3, 1.0, code=1), Foreign())
    with pytest.raises(FbsError, match="unit code 1, which is length 1 and force 1, but"):
        read_frf(path)


@pytest.mark.parametrize(
    ("label", "factor"), [("kHz", 1e3), ("rad/s", 0.5 / np.pi), ("rpm", 1 / 60)]
)
def test_other_units_of_frequency(label: str, factor: float, tmp_path: Path) -> None:
    found = read_frf(written(tmp_path / "x.uff", Foreign(abscissa=(18, label))))
    np.testing.assert_allclose(found.frf.frequency, factor * 2.0 * np.arange(1, 501), rtol=1e-12)
