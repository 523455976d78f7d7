"""Universal files: what is written is read back, and what does not fit is refused by name."""

from __future__ import annotations

import errno
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import pyuff
from hypothesis import given, settings
from hypothesis import strategies as st

from fbs import FbsError, Frf, Joint, couple, direct_frf, frequency_axis
from fbs.files import uff
from fbs.files.uff import read_uff, write_uff
from fbs.files.universal import UffError
from tests.fbs.fbs_systems import random_system

AXIS = frequency_axis(0, 50, 0.1)
RESPONSES = ("planetary.planet2.u", "coupling.w", "reducer.pinion.rho")
EXCITATIONS = ("coupling.w", "planetary.ring.torsional_support_at_the_far_side.w")


def random_frf(
    axis: Any = AXIS,
    responses: Any = RESPONSES,
    excitations: Any = EXCITATIONS,
    quantity: str = "receptance",
) -> Any:
    rng = np.random.default_rng(1)
    shape = (len(axis), len(responses), len(excitations))
    size = 10.0 ** rng.uniform(-14, -3, shape)
    values = size * (rng.normal(size=shape) + 1j * rng.normal(size=shape))
    return Frf(axis, values, responses, excitations, quantity)


def check_round_trip(frf: Frf, path: Path) -> Any:
    write_uff(frf, path)
    back = read_uff(path)
    assert (back.responses, back.excitations) == (frf.responses, frf.excitations)
    assert back.quantity == frf.quantity
    np.testing.assert_allclose(back.frequency, frf.frequency, rtol=1e-12, atol=0)
    for part in (np.real, np.imag):
        np.testing.assert_allclose(part(back.values), part(frf.values), rtol=1e-11, atol=0)
    return back


@pytest.mark.parametrize("quantity", ["receptance", "mobility", "accelerance"])
def test_round_trip(tmp_path: Path, quantity: str) -> None:
    back = check_round_trip(random_frf(quantity=quantity), tmp_path / "a.uff")
    assert back.values.strides[0] == back.values.itemsize  # frequency-contiguous


def test_a_computed_axis_comes_back_in_every_digit_and_couples(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    axis = frequency_axis(1, 400, 0.3 / 3)
    stages = {
        name: direct_frf(random_system(rng, 3, f"{name}.x", beta=lambda _: 1e-6), axis)
        for name in ("a", "b")
    }
    write_uff(stages["a"], tmp_path / "a.uff")
    swapped = {"a": read_uff(tmp_path / "a.uff"), "b": stages["b"]}
    np.testing.assert_array_equal(swapped["a"].frequency, axis)
    joints = [Joint(("a", "a.x2"), ("b", "b.x0"))]
    one, two = couple(stages, joints).frf, couple(swapped, joints).frf
    assert np.abs(two.values - one.values).max() < 1e-9 * np.abs(one.values).max()


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 999999), st.integers(-6, 2), st.integers(0, 2000), st.integers(2, 300))
def test_every_axis_of_a_six_digit_step_fits(
    tmp_path_factory: pytest.TempPathFactory, digits: Any, power: Any, first: Any, count: int
) -> None:
    step = float(f"{digits}e{power}")
    start = float(f"{first * step:.5e}")
    if abs(start / step - round(start / step)) > 1e-9 * max(1, start / step):
        axis = start + step * np.arange(count)
    else:
        axis = frequency_axis(start, (round(start / step) + count - 1) * step, step)
    frf = random_frf(axis, ["r"], ["e"])
    back = check_round_trip(frf, tmp_path_factory.mktemp("uff") / "a.uff")
    np.testing.assert_array_equal(back.frequency, axis)


def test_uneven_lines_of_six_digits_are_kept(tmp_path: Path) -> None:
    check_round_trip(random_frf([0.5, 1.25, 100.375, 2000.5, 15000.0]), tmp_path / "a.uff")
    assert pyuff.UFF(str(tmp_path / "a.uff")).read_sets(1)["abscissa_spacing"] == 0


@pytest.mark.parametrize(
    "axis",
    [
        np.arange(1, 3000) / 3,
        frequency_axis(12345.25, 12400.25, 0.25),
        np.geomspace(1, 4000, 100),
        1000.00025 + 1e-4 * np.arange(100),
    ],
)
def test_an_axis_that_would_shift_is_refused(tmp_path: Path, axis: Any) -> None:
    with pytest.raises(UffError, match="six digits"):
        write_uff(random_frf(axis), tmp_path / "a.uff")
    assert list(tmp_path.iterdir()) == []


def test_one_line_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UffError, match="two lines at least"):
        write_uff(random_frf([10.0]), tmp_path / "a.uff")


@pytest.mark.parametrize("label", ["x" * 69, "sun.w ", "sun\nw"])
def test_labels_that_would_not_survive_are_refused(tmp_path: Path, label: Any) -> None:
    with pytest.raises(UffError, match="label"):
        write_uff(random_frf(responses=[label]), tmp_path / "a.uff")


def test_the_longest_label_survives(tmp_path: Path) -> None:
    check_round_trip(random_frf(responses=["x" * 68], excitations=["θ" * 68]), tmp_path / "a.uff")


def test_writing_replaces_whole_files_and_leaves_nothing_behind(tmp_path: Path) -> None:
    target = tmp_path / "a.uff"
    write_uff(random_frf(), target)
    write_uff(random_frf(responses=["other"]), str(target))
    assert read_uff(target).responses == ("other",)
    assert list(tmp_path.iterdir()) == [target]


def test_a_failed_write_leaves_the_old_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = tmp_path / "a.uff"
    write_uff(random_frf(), target)
    before = target.read_bytes()

    def no_space(*args: object, **kwargs: object) -> bytes:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(uff, "function_text", no_space)
    with pytest.raises(OSError, match="No space"):
        write_uff(random_frf(responses=["other"]), target)
    assert target.read_bytes() == before
    assert list(tmp_path.iterdir()) == [target]


def test_missing_files_and_folders(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"nowhere'"):
        write_uff(random_frf(), tmp_path / "nowhere" / "a.uff")
    with pytest.raises(FileNotFoundError, match=r"none\.uff"):
        read_uff(tmp_path / "none.uff")


def test_fifteen_thousand_lines(tmp_path: Path) -> None:
    axis = frequency_axis(0, 15000, 1)
    check_round_trip(random_frf(axis, ["a", "b"], ["a", "b"]), tmp_path / "a.uff")


# --- files from others --------------------------------------------------------------------------


def function(response: Any, excitation: Any, **changes: Any) -> Any:
    """A function as a measuring system writes it: nodes and directions, no labels."""
    rng = np.random.default_rng(response[0] * 31 + excitation[0])
    return {
        "type": 58,
        "func_type": 4,
        "rsp_node": response[0],
        "rsp_dir": response[1],
        "ref_node": excitation[0],
        "ref_dir": excitation[1],
        "abscissa_spacing": 1,
        "abscissa_spec_data_type": 18,
        "ordinate_spec_data_type": 12,
        "orddenom_spec_data_type": 13,
        "x": 0.5 * np.arange(40),
        "data": rng.normal(size=40) + 1j * rng.normal(size=40),
        **changes,
    }


def units(length: Any, force: Any) -> Any:
    return {
        "type": 164,
        "units_code": 9,
        "temp_mode": 1,
        "length": length,
        "force": force,
        "temp": 1.0,
        "temp_offset": 0.0,
    }


def written(tmp_path: Path, *sets: Any) -> Any:
    path = tmp_path / "theirs.uff"
    path.unlink(missing_ok=True)
    pyuff.UFF(str(path)).write_sets([dict(one) for one in sets], mode="add")
    return path


@pytest.mark.parametrize("binary", [0, 1])
def test_node_numbers_become_labels(tmp_path: Path, binary: int) -> None:
    ends = [((12, 3), (7, 1)), ((13, 0), (7, 1)), ((14, 5), (7, 1))]
    sets = [function(*pair, binary=binary) for pair in ends]
    frf = read_uff(written(tmp_path, *sets))
    assert frf.responses == ("12.z", "13", "14.ry")
    assert frf.excitations == ("7.x",)
    assert frf.quantity == "accelerance"
    np.testing.assert_array_equal(frf.frequency, frequency_axis(0, 19.5, 0.5))
    for label, one in zip(frf.responses, sets, strict=True):
        np.testing.assert_allclose(frf.between(label, "7.x"), one["data"], rtol=1e-10)


@pytest.mark.parametrize("spacing", [0, 1])
@pytest.mark.parametrize("kind", [5, 6])
def test_single_and_double_precision_of_either_spacing(
    tmp_path: Path, kind: int, spacing: int
) -> None:
    one = function((1, 1), (1, 1), abscissa_spacing=spacing, ord_data_type=kind)
    path = tmp_path / "theirs.uff"
    pyuff.UFF(str(path)).write_sets(dict(one), mode="add", force_double=False)
    frf = read_uff(path)
    np.testing.assert_array_equal(frf.frequency, one["x"])
    np.testing.assert_allclose(frf.values[:, 0, 0], one["data"], rtol=1e-5 if kind == 5 else 1e-11)


def test_a_negative_direction_is_the_positive_one_of_other_sign(tmp_path: Path) -> None:
    sets = [function((1, 3), (1, -3)), function((2, -3), (1, -3))]
    frf = read_uff(written(tmp_path, *sets))
    assert (frf.responses, frf.excitations) == (("1.z", "2.z"), ("1.z",))
    np.testing.assert_allclose(frf.between("1.z", "1.z"), -sets[0]["data"], rtol=1e-10)
    np.testing.assert_allclose(frf.between("2.z", "1.z"), sets[1]["data"], rtol=1e-10)


def test_entity_names_keep_nodes_apart(tmp_path: Path) -> None:
    sets = [function((1, 3), (9, 3), rsp_ent_name=name) for name in ("wing", "tail")]
    assert read_uff(written(tmp_path, *sets)).responses == ("wing.1.z", "tail.1.z")


def test_other_datasets_and_functions_are_passed_over(tmp_path: Path) -> None:
    geometry = {"type": 15, "node_nums": [1], "def_cs": [0], "disp_cs": [0], "color": [0]}
    geometry |= {"x": [0.0], "y": [0.0], "z": [0.0]}
    coherence = function((1, 3), (1, 3), func_type=6, data=np.ones(40))
    frf = read_uff(written(tmp_path, geometry, coherence, function((1, 3), (1, 3))))
    assert frf.responses == ("1.z",)


@pytest.mark.parametrize(
    ("response", "excitation", "label", "factor"), [(3, 3, "mm/s2", 1e-3), (6, 6, "rad/s2", 1e3)]
)
def test_units_are_brought_to_si(
    tmp_path: Path, response: int, excitation: int, label: str, factor: float
) -> None:
    one = function((1, response), (1, excitation), ordinate_axis_units_lab=label)
    frf = read_uff(written(tmp_path, units(1000.0, 1.0), one))  # file in mm, N
    np.testing.assert_allclose(frf.values[:, 0, 0], factor * one["data"], rtol=1e-10)


@pytest.mark.parametrize("label", ["m/s^2", "(m/s**2)/N", "m/s²", "M/S2", "NONE"])
def test_si_labels_are_known(tmp_path: Path, label: str) -> None:
    read_uff(written(tmp_path, function((1, 3), (1, 3), ordinate_axis_units_lab=label)))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"data": np.ones(40)}, "is real"),
        ({"ordinate_spec_data_type": 2}, "data type 2 per 13"),
        ({"ordinate_spec_data_type": 13, "orddenom_spec_data_type": 12}, "data type 13 per 12"),
        ({"abscissa_spec_data_type": 17}, "abscissa of data type 17"),
        ({"ordinate_axis_units_lab": "mm/s"}, "unit 'mm/s', which its data type cannot have"),
        ({"ordinate_axis_units_lab": "V"}, "unit 'V' is not known"),
        ({"ordinate_axis_units_lab": "rad/s^2"}, "rotations and translations do not match"),
        ({"abscissa_axis_units_lab": "s"}, "abscissa in 's', no unit of frequency"),
        ({"orddenom_axis_units_lab": "g"}, "is a transmissibility"),
        ({"rsp_dir": 9}, "direction code 9"),
        ({"func_type": 6, "data": np.ones(40)}, r"no FRF .* functions of type \[6\]"),
        ({"x": 5.0 - 0.5 * np.arange(40)}, "with a step of -0.5 Hz"),
        ({"x": np.r_[0:20, 5:25] * 1.0, "abscissa_spacing": 0}, "ascend strictly"),
    ],
)
def test_functions_that_do_not_fit_are_named(
    tmp_path: Path, changes: dict[str, Any], message: str
) -> None:
    path = written(tmp_path, function((1, 3), (7, 3), **changes))
    with pytest.raises(UffError, match=message) as caught:
        read_uff(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize(
    ("sets", "message"),
    [
        ([((1, 3), (1, 3), {}), ((2, 3), (2, 3), {})], "2 of 4 FRFs are missing: '2.z' to '1.z'"),
        ([((1, 3), (1, 3), {}), ((1, -3), (1, 3), {})], "'1.z' to '1.z' is there more than once"),
        (
            [((1, 3), (1, 3), {}), ((2, 3), (1, 3), {"ordinate_spec_data_type": 8})],
            "'1.z' is accelerance, the FRF from '1.z' to '2.z' is receptance",
        ),
        (
            [((1, 3), (1, 3), {}), ((2, 3), (1, 3), {"x": 0.25 * np.arange(40)})],
            "axes of .* to '1.z' and of .* to '2.z' differ: line 1 is 0.5 Hz in one and 0.25 Hz",
        ),
    ],
)
def test_functions_that_make_no_matrix_are_named(
    tmp_path: Path,
    sets: list[tuple[tuple[int, int], tuple[int, int], dict[str, Any]]],
    message: str,
) -> None:
    path = written(tmp_path, *(function(r, e, **changes) for r, e, changes in sets))
    with pytest.raises(UffError, match=message):
        read_uff(path)


def test_contradicting_units_are_refused(tmp_path: Path) -> None:
    one = function((1, 3), (1, 3))
    with pytest.raises(UffError, match="several unit systems"):
        read_uff(written(tmp_path, units(1.0, 1.0), units(1000.0, 1.0), one))
    with pytest.raises(UffError, match="length 0"):
        read_uff(written(tmp_path, units(0.0, 1.0), one))


def test_not_a_number_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path, function((1, 3), (7, 3)))
    lines = path.read_text().splitlines(keepends=True)
    lines[14] = f"{'NaN':>20}" + lines[14][20:]  # the second row of data: lines 2 and 3
    path.write_text("".join(lines))
    with pytest.raises(UffError, match=r"from '7.z' to '1.z' is .*nan.* at 1 Hz"):
        read_uff(path)


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda text: text[: len(text) // 2], "truncated"),
        (lambda text: "".join(text.splitlines(keepends=True)[:16]) + "    -1\n", "announced"),
        (
            lambda text: text.replace("5.00000e-01", "5.00000x-01", 1),
            "abscissa of dataset number 1",
        ),
        (lambda text: text.replace("e-01", "x-01"), "dataset number 1"),
        (lambda text: "", "no FRF"),
        (lambda text: "frequency,real,imag\n1,2,3\n", "no universal file"),
    ],
)
def test_damaged_files_are_refused(
    tmp_path: Path, damage: Callable[..., Any], message: str
) -> None:
    path = written(tmp_path, function((1, 3), (7, 3)))
    path.write_text(damage(path.read_text()))
    with pytest.raises(UffError, match=message):
        read_uff(path)


def test_the_error_is_one_of_the_package() -> None:
    assert issubclass(UffError, FbsError)
