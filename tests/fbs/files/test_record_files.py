"""Records in files: read back to the digit the format has, and what does not fit is refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import pyuff
from hypothesis import given, settings
from hypothesis import strategies as st

from fbs import FbsError, Quantity, Record
from fbs.files.record_files import read_record, write_record

ENDINGS = (".npz", ".csv", ".uff", ".unv", ".mat", ".wav")
METADATA = {"model": "Zwei Stufen, µ", "integrator": "RK44", "step": 1e-6, "pieces": [1, 2]}


def random_record(rate: float = 51200.0, n: int = 500, quantity: str = "accelerance") -> Any:
    rng = np.random.default_rng(n)
    size = 10.0 ** rng.uniform(-12, 3, (n, 5))
    samples = size * rng.standard_normal((n, 5))
    excitations, responses = ("planetary.sun.u", "reducer.pinion.w"), ("a", "b, c", "d (e)")
    return Record(rate, samples[:, :2], samples[:, 2:], excitations, responses, quantity)


@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize("quantity", list(Quantity))
def test_round_trip(tmp_path: Path, ending: Any, quantity: Quantity) -> None:
    record = random_record(quantity=quantity)
    path = tmp_path / f"run{ending}"
    write_record(record, path, METADATA)
    back, metadata = read_record(path)
    assert metadata == METADATA
    for name in ("sampling_frequency", "excitations", "responses", "quantity"):
        assert getattr(back, name) == getattr(record, name)
    # UFF keeps twelve digits (E20.11), the others every one
    digits = 5e-12 if ending in (".uff", ".unv") else 0.0
    np.testing.assert_allclose(back.inputs, record.inputs, rtol=digits, atol=0.0)
    np.testing.assert_allclose(back.outputs, record.outputs, rtol=digits, atol=0.0)
    assert back.inputs.dtype == np.float64
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


@settings(max_examples=40)
@given(rate=st.integers(2, 100_000) | st.floats(1.0, 1e7))
@pytest.mark.parametrize("ending", [".npz", ".csv"])
def test_any_sampling_frequency_is_kept(
    tmp_path_factory: pytest.TempPathFactory, ending: str, rate: int
) -> None:
    record = random_record(rate=float(rate), n=7)
    path = tmp_path_factory.mktemp("rates") / f"run{ending}"
    write_record(record, path)
    assert read_record(path)[0].sampling_frequency == record.sampling_frequency


@settings(max_examples=60)
@given(rate=st.integers(2, 100_000))
def test_whole_sampling_frequencies_survive_six_digits_of_the_step(
    tmp_path_factory: pytest.TempPathFactory, rate: int
) -> None:
    """Neighbours differ by 1/fs relatively, six digits resolve 1e-5 at worst."""
    record = random_record(rate=float(rate), n=7)
    path = tmp_path_factory.mktemp("rates") / "run.uff"
    write_record(record, path)
    assert read_record(path)[0].sampling_frequency == rate


def test_a_step_of_six_digits_survives(tmp_path: Path) -> None:
    record = random_record(rate=1 / 3e-5)
    write_record(record, tmp_path / "run.uff")
    back, _ = read_record(tmp_path / "run.uff")
    assert back.sampling_frequency == pytest.approx(record.sampling_frequency, rel=1e-15)


@pytest.mark.parametrize("rate", [12345.678, 1234567.0])
def test_a_sampling_frequency_that_uff_cannot_carry_is_refused(tmp_path: Path, rate: float) -> None:
    with pytest.raises(FbsError, match=r"six digits of the time step: sampling at .* would"):
        write_record(random_record(rate=rate), tmp_path / "run.uff")
    assert not list(tmp_path.iterdir())


def test_metadata_that_do_not_fit_are_refused(tmp_path: Path) -> None:
    record = random_record()
    with pytest.raises(FbsError, match=r"metadata have \d+ characters as JSON; UFF takes 240"):
        write_record(record, tmp_path / "run.uff", {"notes": "x" * 240})
    for ending in ENDINGS:
        with pytest.raises(FbsError, match="the metadata do not fit into JSON"):
            write_record(record, tmp_path / f"run{ending}", {"when": object()})
        with pytest.raises(FbsError, match="the metadata do not fit into JSON"):
            write_record(record, tmp_path / f"run{ending}", {"value": float("nan")})


def test_npz_is_plain(tmp_path: Path) -> None:
    record = random_record()
    write_record(record, tmp_path / "run.npz", METADATA)
    with np.load(tmp_path / "run.npz") as arrays:
        assert arrays["output_unit"] == "m/s^2"
        assert json.loads(str(arrays["metadata"])) == METADATA
        np.testing.assert_array_equal(arrays["outputs"], record.outputs)


def test_uff_is_what_others_read(tmp_path: Path) -> None:
    """pyuff itself finds functions of time, forces in N and accelerations in m/s^2."""
    record = random_record(n=64)
    write_record(record, tmp_path / "run.uff")
    sets = pyuff.UFF(str(tmp_path / "run.uff")).read_sets()
    assert [int(one["type"]) for one in sets] == [164] + 5 * [58]
    for one in sets[1:]:
        assert (one["func_type"], one["abscissa_spec_data_type"]) == (1, 17)
    units = [(one["ordinate_spec_data_type"], one["ordinate_axis_units_lab"]) for one in sets[1:]]
    assert units == 2 * [(13, "N")] + 3 * [(12, "m/s^2")]
    np.testing.assert_allclose(sets[3]["data"], record.outputs[:, 0], rtol=5e-12)
    np.testing.assert_allclose(sets[1]["x"], record.time, rtol=5e-6)  # six digits of the step


def foreign(path: Path, **changes: Any) -> None:
    """A file from elsewhere: node numbers for labels, a force and an acceleration."""
    file = pyuff.UFF(str(path))
    time = np.arange(8) / 51200
    for kind, node, direction in ((13, 1, 3), (12, 2, -1)):
        file.write_sets(
            {"type": 58, "binary": 0, "func_type": 1, "rsp_node": node, "rsp_dir": direction,
             "ref_node": 0, "ref_dir": 0, "abscissa_spacing": 1, "abscissa_spec_data_type": 17,
             "ordinate_spec_data_type": kind, "orddenom_spec_data_type": 0, "id2": "bench 3",
             "data": np.arange(8.0), "x": time} | changes,
            mode="add",
        )  # fmt: skip


def test_a_file_from_elsewhere(tmp_path: Path) -> None:
    foreign(tmp_path / "bench.uff")
    record, metadata = read_record(tmp_path / "bench.uff")
    assert (record.excitations, record.responses) == (("1.z",), ("2.x",))
    assert record.sampling_frequency == 51200.0  # from 1.95313E-05 s
    np.testing.assert_array_equal(record.inputs[:, 0], np.arange(8.0))
    np.testing.assert_array_equal(record.outputs[:, 0], -np.arange(8.0))
    assert metadata == {}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"func_type": 2}, "no function of time .* functions of type \\[2\\]"),
        ({"ordinate_spec_data_type": 13}, "a force and a motion are needed; .* motions none"),
        ({"ordinate_spec_data_type": 15}, "data type 15; known are"),
        ({"abscissa_spec_data_type": 18}, "abscissa of data type 18, not 17"),
        ({"abscissa_spacing": 0}, "gives every time by itself"),
        ({"ordinate_axis_units_lab": "Pa"}, "unit 'Pa' is not known"),
        ({"ordinate_spec_data_type": 12}, "forces none .* transmissibilities, no FRFs"),
        ({"data": np.ones(8) * 1j}, "is complex"),
    ],
)
def test_universal_files_that_hold_no_record(
    tmp_path: Path, changes: dict[str, Any], words: str
) -> None:
    foreign(tmp_path / "bench.uff", **changes)
    with pytest.raises(FbsError, match=words) as caught:
        read_record(tmp_path / "bench.uff")
    assert str(caught.value).startswith(str(tmp_path))


def test_nan_in_a_universal_file(tmp_path: Path) -> None:
    path = tmp_path / "bench.uff"
    foreign(path)  # pyuff itself would write a NaN as 0
    path.write_text(path.read_text().replace("   3.00000000000e+00", f"{'NaN':>20}"))
    with pytest.raises(FbsError, match=r"input '1\.z' is nan at sample 3"):
        read_record(path)


CSV = "time (s),input f (N),output y (m)\n"
BAD_CSV = [
    ("", "it has no header"),
    ("x (s),f (N),y (m)\n0,1,2\n", "its first column is 'x \\(s\\)', no time"),
    ("t,f,y\n0,1,2\n", "a column is called 'f', without a unit"),
    ("time (s),f,y\n0,1,2\n", "a column is called 'f'"),
    (CSV + "0,1,2\n1,x,2\n", "below the header: .*'x'"),
    (CSV + "0,1,2\n1,1\n", "below the header"),
    (CSV + "0,1\n1,1\n", "the header has 3 columns, the rows have 2"),
    (CSV + "0,1,2\n1,nan,2\n", "input 'f' is nan at sample 1"),
    (CSV + "0,1,2\n1,1,2\n2,1,2\n3.5,1,2\n4,0,0\n5,0,0\n", "not uniform: sample 3 is at 3.5 s"),
    (CSV.replace("(N)", "(kg)") + "0,1,2\n1,1,2\n", "in 'kg', neither a force nor a motion"),
    (CSV.replace("(N)", "(m)") + "0,1,2\n1,1,2\n", "called 'input f \\(m\\)', but its unit is 'm'"),
    (CSV.replace("(m)", "(rad)") + "0,1,2\n1,1,2\n", "does not end in .rx, .ry or .rz"),
    ("time (s),acc a (g),acc b (g)\n0,1,2\n1,1,2\n", "forces none .* transmissibilities, no FRFs"),
    ("time (N),force f (N),acc b (g)\n0,1,2\n1,1,2\n", "in no unit of time"),
    ("# sampling_frequency_hz: 2.0\n" + CSV + "0,1,2\n1,1,2\n", "say 2 Hz, its times 1 Hz"),
    ("# sampling_frequency_hz: two\n" + CSV + "0,1,2\n1,1,2\n", "'two', no number"),
    ("# metadata: [1]\n" + CSV + "0,1,2\n1,1,2\n", "no table of keys and values"),
]


@pytest.mark.parametrize(("text", "words"), BAD_CSV)
def test_csv_files_that_hold_no_record(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "run.csv"
    path.write_text(text)
    with pytest.raises(FbsError, match=words) as caught:
        read_record(path)
    assert str(caught.value).startswith(str(path))


def test_a_csv_written_by_hand(tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text(CSV + "0,1,2\n0.1,3,4\n")
    record, metadata = read_record(tmp_path / "run.csv")
    assert (record.sampling_frequency, metadata) == (10.0, {})
    assert record.quantity is Quantity.RECEPTANCE


def test_npz_files_that_hold_no_record(tmp_path: Path) -> None:
    path = tmp_path / "run.npz"
    np.savez(path, inputs=np.ones((2, 1)))
    with pytest.raises(FbsError, match="no array sampling_frequency and no outputs"):
        read_record(path)
    path.write_bytes(b"nothing")
    with pytest.raises(FbsError, match=r"damaged, or no \.npz"):
        read_record(path)
    whole = random_record()
    write_record(whole, path)
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(FbsError, match=r"damaged, or no \.npz"):
        read_record(path)


def test_endings_and_folders(tmp_path: Path) -> None:
    with pytest.raises(FbsError, match=r"the ending \.txt is not known; allowed: \.npz, \.csv"):
        write_record(random_record(), tmp_path / "run.txt")
    with pytest.raises(FbsError, match=r"the ending \(none\) is not known"):
        read_record(tmp_path / "run")
    with pytest.raises(FileNotFoundError):
        write_record(random_record(), tmp_path / "none" / "run.npz")
    with pytest.raises(FileNotFoundError):
        read_record(tmp_path / "none.uff")
