"""What real files of FRFs contain: right to 1e-9, or refused in one true sentence."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fbs import FbsError, Frf, Quantity
from fbs.files.channel_map import in_lengths, map_of, mapped, parse_map
from fbs.files.frf_files import read_frf, write_frf
from fbs.files.measurement import Given, Measurement, complete_block
from fbs.files.record_files import read_record
from tests.fbs.files.foreign_files import (
    AXIS,
    NUMBERS,
    Foreign,
    accelerance,
    rig,
    stored,
    units_text,
    written,
)

WANTED = tuple(NUMBERS)


def check(found: Measurement, *notes: str) -> None:
    frf = found.frf
    assert set(frf.responses) == set(frf.excitations) == set(WANTED)
    assert frf.quantity is Quantity.ACCELERANCE
    np.testing.assert_allclose(frf.frequency, AXIS, rtol=1e-12)
    for response in WANTED:
        for excitation in WANTED:
            np.testing.assert_allclose(
                frf.between(response, excitation), stored(accelerance(response, excitation)),
                rtol=1e-9,
            )  # fmt: skip
    assert found.notes == notes


def test_a_file_as_it_should_be(tmp_path: Path) -> None:
    check(read_frf(written(tmp_path / "good.uff", *rig())))


def test_the_latin_1_squared_sign(tmp_path: Path) -> None:
    functions = rig(units=("m/s²", "N"))
    for encoding in ("latin-1", "utf-8"):
        check(read_frf(written(tmp_path / "x.uff", *functions, encoding=encoding)))


def test_accelerations_in_g(tmp_path: Path) -> None:
    functions = rig(units=("g", "N"))
    found = read_frf(written(tmp_path / "x.uff", *functions))
    np.testing.assert_allclose(
        found.frf.between("brake.w", "brake.w"),
        9.80665 * stored(accelerance("brake.w", "brake.w")),
        rtol=1e-12,
    )
    contradicting = units_text(1e3, 1e3, 5, "MM (milli newton)")
    with pytest.raises(FbsError, match=r"labels say g per N .× 9.80665 is SI., dataset 164 .MM"):
        read_frf(written(tmp_path / "x.uff", contradicting, *functions))


def test_si_labels_in_a_file_of_millimetres(tmp_path: Path) -> None:
    path = written(tmp_path / "x.uff", units_text(1e3, 1.0, 9, "MM (newton)"), *rig())
    with pytest.raises(FbsError, match=r"says? m/s\^2 per N .* length 1000 and force 1") as caught:
        read_frf(path)
    assert "give the right unit (--unit)" in str(caught.value)
    check(
        read_frf(path, Given(units=("m/s^2/N",))),
        "taken as m/s^2/N, as given, where labels say m/s^2 per N",
    )


def test_data_types_1_and_0(tmp_path: Path) -> None:
    path = written(tmp_path / "x.uff", *rig(codes=(1, 0), units=("(m/s^2)/N", "NONE")))
    with pytest.raises(FbsError, match="data type 1 per 0"):
        read_frf(path)
    check(read_frf(path, Given(Quantity.ACCELERANCE, ("m/s^2/N",))))
    check(read_frf(path, Given(Quantity.ACCELERANCE)))


@pytest.mark.parametrize(
    "record",
    [
        "         0         1        -1\n         1         2\n",
        "        -1\n        -1\n",
        "     1    -1\n",
        "    -1    -1\n",
        "  -1.0 -1\n x -1\n",
    ],
)
def test_records_of_other_datasets_that_end_in_minus_one(record: str, tmp_path: Path) -> None:
    elements = f"{-1:6d}\n{2412:6d}\n{1:10d}{21:10d}\n{record}{-1:6d}\n"
    check(read_frf(written(tmp_path / "x.uff", elements, *rig())))
    check(read_frf(written(tmp_path / "x.uff", *rig(), elements)))
    windows = "".join(f.text() for f in rig()) + elements
    check(read_frf(written(tmp_path / "x.uff", windows.replace("\n", "\r\n"))))


def test_a_cut_file_is_told_as_cut(tmp_path: Path) -> None:
    text = "".join(f.text() for f in rig())
    for end in (len(text) // 2 + 37, len(text) - 8, len(text) - 30, 200):
        with pytest.raises(FbsError, match=r"truncated|announced"):
            read_frf(written(tmp_path / "x.uff", text[:end]))


def test_nan_at_0_hz_is_left_out(tmp_path: Path) -> None:
    functions = [
        replace(f, first=0.0, values=np.concatenate([[complex(np.nan, np.nan)], f.values]))
        for f in rig()
    ]
    path = written(tmp_path / "x.uff", *functions)
    check(read_frf(path), "its line at 0 Hz holds no numbers and is left out")
    functions[2].values[7] = np.nan
    with pytest.raises(FbsError, match=r"from 'shaft.w' to 'brake.w' is .*nan.* at 14 Hz"):
        read_frf(written(tmp_path / "x.uff", *functions))


def test_a_microphone_and_coherences_are_left_out_and_listed(tmp_path: Path) -> None:
    microphone = replace(
        rig(named=False)[0], response=("MIC", 900, 0), codes=(15, 13), units=("Pa", "N")
    )
    coherences = [
        replace(
            f,
            kind=6,
            codes=(0, 0),
            units=("NONE", "NONE"),
            complex=False,
            values=0.9 + 0 * f.values,
        )
        for f in rig()
    ]
    strain = replace(microphone, response=("NONE", 4, 1), codes=(3, 13), units=("NONE", "N"))
    housing = replace(
        rig(named=False)[0], response=("NONE", 99, 3), ids=("NONE", "excitation: brake.w")
    )
    path = written(tmp_path / "x.uff", *rig(), microphone, *coherences, strain, housing)
    found = read_frf(path)
    check(
        found,
        "left out: 1 pressure (data type 15 per 13) (MIC.900)",
        "left out: 1 strain (data type 3 per 13) (4.x)",
        "left out: the responses 99.z",
    )
    assert found.coherence is not None
    np.testing.assert_allclose(found.coherence, 0.9, rtol=1e-6)


def test_runs_are_averaged_or_chosen(tmp_path: Path) -> None:
    functions = [*rig(), *rig(scale=1.1), *rig(scale=1.2)]
    path = written(tmp_path / "x.uff", *functions)
    mean = read_frf(path)
    assert mean.notes == ("it holds 3 complete runs: their mean is taken",)
    assert len(mean.repeats) == 3
    np.testing.assert_allclose(
        mean.frf.between("shaft.w", "brake.w"), 1.1 * accelerance("shaft.w", "brake.w"), rtol=1e-5
    )
    second = read_frf(path, Given(run=2))
    assert second.notes == ("it holds 3 complete runs: run 2 is taken",)
    np.testing.assert_allclose(second.frf.values, mean.repeats[1].values, rtol=0)
    with pytest.raises(FbsError, match="run 4 was asked for; the complete runs are 1 to 3"):
        read_frf(path, Given(run=4))
    aborted = read_frf(written(tmp_path / "x.uff", *functions[:6]))
    assert aborted.notes == (
        "left out: 2 FRFs of runs that are not complete (brake.w to brake.w, brake.w to shaft.w)",
    )


NO_RADII: dict[str, float] = {}


def test_node_numbers_by_a_map(tmp_path: Path) -> None:
    path = written(tmp_path / "x.uff", *rig(named=False))
    found = read_frf(path)
    assert found.frf.responses == ("12", "7")
    check(mapped(found, parse_map("brake.w=12, shaft.w=7"), NO_RADII.get))
    check(
        mapped(
            found, map_of({"brake.w": "-12", "shaft.w": {"channel": "7", "sign": -1}}), NO_RADII.get
        )
    )


def test_eleven_characters_of_an_entity_name(tmp_path: Path) -> None:
    """A writer that does not cut shifts what follows by a column."""
    for one in (
        Foreign(response=("PF-I-0301yz", 12, 1)),
        Foreign(reference=("PF-I-0301yz", 12, 1)),
        Foreign(response=("PF-I-0301yz", 1234567890, 1)),
    ):
        path = written(tmp_path / "x.uff", one)
        with pytest.raises(FbsError, match=r"record 6 .*an entity name has at most 10 characters"):
            read_frf(path)
    shifted = Foreign(response=("PF-I-0301y", 12, 1)).text().replace(" PF-I-0301y", "PF-I-0301yz")
    with pytest.raises(FbsError, match="at most 10 characters"):
        read_frf(written(tmp_path / "x.uff", shifted))
    whole = read_frf(written(tmp_path / "x.uff", Foreign(response=("PF-I-0301y", 12, 1))))
    assert whole.frf.responses == ("PF-I-0301y.12.x",)


def test_a_record_in_g(tmp_path: Path) -> None:
    samples = np.sin(np.arange(256.0)) + 0j
    both: dict[str, Any] = {
        "kind": 1,
        "complex": False,
        "first": 0.0,
        "step": 1 / 2048,
        "abscissa": (17, "s"),
    }
    force = Foreign(("NONE", 1, 3), values=samples, codes=(13, 0), units=("N", "NONE"), **both)
    motion = Foreign(("NONE", 2, 3), values=samples, codes=(12, 0), units=("g", "NONE"), **both)
    record, _ = read_record(written(tmp_path / "x.uff", force, motion))
    assert (record.excitations, record.responses) == (("1.z",), ("2.z",))
    assert record.sampling_frequency == 2048.0
    np.testing.assert_allclose(record.inputs[:, 0], stored(samples).real, rtol=1e-12)
    np.testing.assert_allclose(record.outputs[:, 0], 9.80665 * stored(samples).real, rtol=1e-12)
    with pytest.raises(FbsError, match="contradicts itself: its label says 'g'"):
        read_record(written(tmp_path / "x.uff", units_text(1e3, 1.0), force, motion))
    with pytest.raises(FbsError, match="transmissibilities, no FRFs"):
        read_record(written(tmp_path / "x.uff", motion, replace(motion, response=("NONE", 3, 3))))


# --- blocks, rotations, maps -------------------------------------------------------------------


@pytest.mark.parametrize(
    ("pairs", "block"),
    [
        ("aa ab ba bb", ("ab", "ab")),
        ("aa ab ba bb ca", ("ab", "ab")),
        ("aa ab ba bb ac bc", ("ab", "abc")),
        ("aa ab ba bb ca cb cc", ("abc", "ab")),
        ("aa bb", ("a", "a")),
        ("ba aa", ("ba", "a")),
        ("aa ba ca ad", ("abc", "a")),
    ],
)
def test_the_complete_block(pairs: str, block: tuple[str, str]) -> None:
    rows, columns = complete_block([(pair[0], pair[1]) for pair in pairs.split()])
    assert ("".join(rows), "".join(columns)) == block


def turning(tmp_path: Path) -> Measurement:
    ends = [("NONE", 12, 4), ("NONE", 7, 3)]
    functions = [
        Foreign(r, e, values=np.full(500, 1.0 + i + 10 * j, complex), units=("NONE", "NONE"))
        for j, e in enumerate(ends)
        for i, r in enumerate(ends)
    ]
    return read_frf(written(tmp_path / "x.uff", *functions))


def test_a_rotation_is_never_taken_for_a_length(tmp_path: Path) -> None:
    found = turning(tmp_path)
    assert found.angles == found.moments == {"12.rx"}
    with pytest.raises(FbsError, match=r"12\.rx is a rotation .* needs the radius of its body"):
        in_lengths(found, NO_RADII.get)
    lengths = in_lengths(found, {"12.rx": 0.1}.get).frf.values
    np.testing.assert_allclose(lengths[0], [[0.01 * 1, 0.1 * 11], [0.1 * 2, 12]], rtol=1e-12)


def test_a_map_takes_the_radius_given_or_the_model_s(tmp_path: Path) -> None:
    found = turning(tmp_path)
    own = mapped(found, parse_map("brake.w=-12.rx,g.y=7:-Z"), {"brake.w": 0.2, "g.y": None}.get)
    np.testing.assert_allclose(own.frf.values[0], [[0.04 * 1, 0.2 * 11], [0.2 * 2, 12]], rtol=1e-12)
    assert own.frf.responses == own.frf.excitations == ("brake.w", "g.y")
    assert not own.angles
    stated = mapped(found, map_of({"brake.w": {"channel": "12.rx", "radius": 0.1}}), NO_RADII.get)
    np.testing.assert_allclose(stated.frf.values, 0.01, rtol=1e-12)
    with pytest.raises(FbsError, match="combines rotations and translations"):
        mapped(found, map_of({"a.w": {"12.rx": 1.0, "7.z": 1.0, "radius": 1.0}}), NO_RADII.get)


@pytest.mark.parametrize("ending", ["uff", "npz", "csv", "mat"])
def test_labels_as_people_write_them_are_those_of_a_map(ending: str, tmp_path: Path) -> None:
    """ "8:-Z" is "8.z" of other sign, in the file as in the map."""
    values = np.arange(1.0, 9.0).reshape(2, 2, 2) * (1 + 2j)
    labels = ("7:+Z", "8:-Z")
    frf = Frf(np.array([1.0, 2.0]), values, labels, labels)
    coherence = np.full(values.shape, 0.9)
    path = tmp_path / f"x.{ending}"
    write_frf(frf, path, coherence=coherence, averages=dict.fromkeys(labels, 5))
    found = read_frf(path)
    assert found.frf.responses == found.frf.excitations == ("7.z", "8.z")
    signs = np.array([[1, -1], [-1, 1]])
    np.testing.assert_allclose(found.frf.values, values * signs, rtol=1e-11)
    if ending != "csv":  # which has no room for it
        assert found.coherence is not None
        np.testing.assert_allclose(found.coherence, 0.9)
        assert found.averages == 5
    again = mapped(found, map_of({"a.y": "7:+Z", "b.y": "8:-Z"}), NO_RADII.get)
    np.testing.assert_allclose(again.frf.values, values, rtol=1e-11)
    assert again.averages == found.averages


def test_two_accelerometers_make_a_rotation(tmp_path: Path) -> None:
    """Of a rigid bar of mass m and inertia J, points ±d/2 from its centre: H_ww = r²/(−ω² J) ω²…

    As accelerance H_ab = 1/m + x_a x_b / J; then H_ww = r² / J, H_yy = 1/m and H_wy = 0.
    """
    mass, inertia, distance, r = 3.0, 0.01, 0.08, 0.05
    places = {1: distance / 2, 2: -distance / 2}
    functions = [
        Foreign(
            ("NONE", i, 3), ("NONE", j, 3),
            values=np.full(500, 1 / mass + x * y / inertia, complex),
        )
        for j, y in places.items()
        for i, x in places.items()
    ]  # fmt: skip
    found = read_frf(written(tmp_path / "x.uff", *functions))
    table = {
        "hub.w": {"1.z": r / distance, "2.z": -r / distance},
        "hub.y": {"1.z": 0.5, "2.z": 0.5},
    }
    values = mapped(found, map_of(table), {"hub.w": r}.get).frf.values
    expected = np.diag([r**2 / inertia, 1 / mass])
    np.testing.assert_allclose(values, expected[None].repeat(500, 0), atol=1e-5 * 1 / mass)
    hammer = map_of(table | {"excitations": {"hub.w": {"1.z": r / (distance / 2)}}})
    one_sided = mapped(found, hammer, NO_RADII.get).frf
    np.testing.assert_allclose(one_sided.between("hub.w", "hub.w"), r**2 / inertia, rtol=1e-5)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({}, "the map is empty"),
        ({"a.w": 3}, "map.\"a.w\" = 3; it must be a channel"),
        ({"a.w": {}}, "it must be a channel"),
        ({"a.w": {"1.z": 0}}, "1.z = 0; the weight must be a number, not 0"),
        ({"a.w": {"1.z": float("inf")}}, "the weight must be a number"),
        ({"a.w": {"1.z": True}}, "the weight must be a number"),
        ({"a.w": {"radius": 0.1}}, "names no channel"),
        ({"a.w": {"channel": "1.z", "radius": -1}}, "radius = -1; it must be greater than 0"),
        ({"a.w": {"channel": "1.z", "sign": 2}}, "sign .1 or -1."),
        ({"a.w": {"channel": "1.z", "2.z": 1.0}}, "with channel"),
        ({"responses": 1, "a.w": "1.z"}, "map.responses is 1"),
    ],
)  # fmt: skip
def test_maps_that_say_nothing_clear(table: dict[str, object], words: str) -> None:
    with pytest.raises(FbsError, match=words):
        map_of(table)


def test_maps_of_a_command_line() -> None:
    for text, words in (("a.w", "give DoF=CHANNEL"), ("a.w=1,a.w=2", "is there already")):
        with pytest.raises(FbsError, match=words):
            parse_map(text)


def test_one_run_written_twice_is_no_repetition(tmp_path: Path) -> None:
    """Else its errors would be known, and nought."""
    found = read_frf(written(tmp_path / "x.uff", *rig(), *rig()))
    assert found.notes[-1].startswith("they are one run written several times")
    assert found.repeats == ()
