"""FRFs in every format both ways, in arrays with labels, and as people write their headers."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fbs import FbsError, Frf, frequency_axis
from fbs.files.frf_files import read_frf, write_frf
from fbs.files.labelled import from_pandas, from_xarray, to_pandas, to_xarray
from fbs.files.measurement import Given
from fbs.files.record_files import read_record

RNG = np.random.default_rng(11)
AXIS = frequency_axis(1, 30, 0.5)
SHAPE = (AXIS.size, 3, 2)
FRF = Frf(
    AXIS,
    RNG.normal(size=SHAPE) + 1j * RNG.normal(size=SHAPE),
    ("a.w", "planetary.planet2.u", "b"),
    ("a.w", "b"),
    "mobility",
)


def same(found: Frf, digits: float = 0.0) -> None:
    assert (found.responses, found.excitations) == (FRF.responses, FRF.excitations)
    assert found.quantity == FRF.quantity
    np.testing.assert_array_equal(found.frequency, FRF.frequency)
    np.testing.assert_allclose(found.values, FRF.values, rtol=digits, atol=0.0)


@pytest.mark.parametrize("ending", [".npz", ".csv", ".mat", ".uff", ".unv"])
def test_what_is_written_is_read(ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"x{ending}"
    write_frf(FRF, path, coherence=np.full(SHAPE, 0.75))
    found = read_frf(path)
    # twelve digits in UFF, real and imaginary part each
    same(found.frf, 1e-10 if ending in (".uff", ".unv") else 0.0)
    assert found.notes == ()
    if ending == ".csv":
        assert found.coherence is None
    else:
        assert found.coherence is not None
        np.testing.assert_allclose(found.coherence, 0.75)
    part = read_frf(path, responses=["b", "a.w"], excitations=["b"]).frf
    assert (part.responses, part.excitations) == (("a.w", "b"), ("b",))


def test_xarray_and_pandas() -> None:
    array = to_xarray(FRF)
    assert array.dims == ("frequency", "response", "excitation")
    assert array.attrs == {"quantity": "mobility", "units": "m/(N s)"}
    assert np.shares_memory(array.values, FRF.values)
    same(from_xarray(array))
    same(from_xarray(array.transpose("excitation", "frequency", "response")))
    frame = to_pandas(FRF)
    np.testing.assert_array_equal(frame["b", "a.w"], FRF.between("b", "a.w"))
    same(from_pandas(frame))
    same(from_pandas(frame[frame.columns[[4, 5, 0, 1, 2, 3]]][frame.columns]))
    refused: tuple[Callable[[], object], ...] = (
        lambda: from_xarray(array.isel(response=0)),
        lambda: from_xarray(array.drop_attrs()),
        lambda: from_pandas(frame.iloc[:, :5]),
        lambda: from_pandas(frame["b"], "mobility"),
    )
    for wrong in refused:
        with pytest.raises(FbsError):
            wrong()


def test_matlab_7_3(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import h5py

    path = tmp_path / "x.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        file["frequency"] = FRF.frequency[None, :]
        values = np.zeros(SHAPE[::-1], dtype=[("real", "f8"), ("imag", "f8")])
        values["real"], values["imag"] = FRF.values.real.T, FRF.values.imag.T
        file["values"] = values
        for name, labels in (("responses", FRF.responses), ("excitations", FRF.excitations)):
            cells = []
            for k, label in enumerate(labels):
                codes = np.array([ord(letter) for letter in label], dtype="u2")[:, None]
                file[f"#refs#/{name}{k}"] = codes
                cells.append(file[f"#refs#/{name}{k}"].ref)
            file.create_dataset(name, data=np.array([cells], dtype=h5py.ref_dtype))
        file["quantity"] = np.array([ord(letter) for letter in "mobility"], dtype="u2")[:, None]
        file["quantity"].attrs["MATLAB_class"] = np.bytes_("char")
    same(read_frf(path).frf)
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(FbsError, match=r"MATLAB 7\.3; to read it install h5py"):
        read_frf(path)


@pytest.mark.parametrize(
    ("header", "rows", "given", "value"),
    [
        ("frequency_hz,re accelerance a <- b (g/N),im accelerance a <- b (g/N)", "1,2,3\n2,2,3", {},
         9.80665 * (2 + 3j)),
        ("Frequency (kHz);Real a/b;Imag a/b\n;m/s/N;m/s/N".replace("\n;", "\nkHz;"),
         "0,001;2,5;3\n0,002;2,5;3", {"quantity": "mobility"}, 2.5 + 3j),
        ("freq [Hz]\tmag receptance a <- b (µm/N)\tphase receptance a <- b (deg)",
         "1\t2\t90\n2\t2\t90", {}, 2e-6j),
        ("f,magnitude mobility a/b (m/s/N),phase mobility a/b (rad)", "1,2,0\n2,2,0", {}, 2.0),
    ],
)  # fmt: skip
def test_tables_as_people_write_them(
    header: str, rows: str, given: dict[str, str], value: complex, tmp_path: Path
) -> None:
    path = tmp_path / "x.csv"
    path.write_text(f"# bench 3\n\n{header}\n{rows}\n", encoding="utf-8")
    from fbs import Quantity

    options = Given(Quantity(given["quantity"])) if given else Given()
    frf = read_frf(path, options).frf
    np.testing.assert_allclose(frf.frequency, [1.0, 2.0])
    np.testing.assert_allclose(frf.between("a", "b"), value, atol=1e-20)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a,b\n1,2\n", "its first column is 'a'; it must be the frequency"),
        ("frequency_hz,x\n1,2\n", "a column is called 'x'"),
        ("frequency_hz,re a <- b,im a <- b\n1,2,3\n", "does not say its quantity"),
        ("frequency_hz,re mobility a <- b\n1,2\n", "has the columns re; needed are re and im"),
        ("frequency_hz,re mobility a <- b (m/N),im mobility a <- b (m/N)\n1,2,3\n", "data type"),
        ("frequency_s,re mobility a <- b,im mobility a <- b\n1,2,3\n", "it must be the frequency"),
        ("1,2\n3,4\n", "no header"),
        ("frequency_hz,re mobility a <- b,im mobility a <- b\n1,2\n", "below the header|columns"),
    ],
)
def test_tables_that_hold_no_frfs(text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text(text)
    with pytest.raises(FbsError, match=words) as caught:
        read_frf(tmp_path / "x.csv")
    assert str(caught.value).startswith(str(tmp_path / "x.csv"))


def test_endings(tmp_path: Path) -> None:
    for path in (tmp_path / "x", tmp_path / "x.xls"):
        with pytest.raises(FbsError, match=r"is not known; allowed: \.npz, \.csv, \.uff, \.unv"):
            read_frf(path)


# --- records -----------------------------------------------------------------------------------

CSV = [
    ("Time [ms],Force hammer.z [lbf],Acc 12.z [g]", 1e-3, 4.4482216152605, 9.80665, "hammer.z"),
    ("t (s);excitation 1.z (N);accel 12.z (mm/s^2)", 1.0, 1.0, 1e-3, "1.z"),
    ("Zeit (s)\thammer\t12.z\ns\tkN\tm/s²", 1.0, 1e3, 1.0, "hammer"),
    ("seconds,input f (N),output 12.z (in/s^2)", 1.0, 1.0, 0.0254, "f"),
]


@pytest.mark.parametrize(("header", "time", "force", "motion", "label"), CSV)
def test_records_as_people_write_them(
    header: str, time: float, force: float, motion: float, label: str, tmp_path: Path
) -> None:
    sign = max(",;\t", key=header.count)
    rows = "\n".join(sign.join(map(str, row)) for row in ((0, 1, 2), (1, 3, 4), (2, 5, 6)))
    (tmp_path / "x.csv").write_text(f"{header}\n{rows}\n", encoding="latin-1")
    record, _ = read_record(tmp_path / "x.csv")
    assert record.excitations == (label,)
    assert record.responses == ("12.z",)
    np.testing.assert_allclose(record.sampling_frequency, 1 / time)
    np.testing.assert_allclose(record.inputs[:, 0], force * np.array([1, 3, 5]))
    np.testing.assert_allclose(record.outputs[:, 0], motion * np.array([2, 4, 6]))


def test_columns_that_the_user_names(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text("time (s),ch1,ch2\n0,1,2\n1,3,4\n")
    channels = {"ch1": ("hammer.z", "2 N"), "ch2": ("12.z", "g")}
    record, _ = read_record(tmp_path / "x.csv", channels)
    np.testing.assert_allclose(record.inputs[:, 0], [2.0, 6.0])
    np.testing.assert_allclose(record.outputs[:, 0], 9.80665 * np.array([2, 4]))


@pytest.mark.parametrize("kind", ["i2", "i4", "f4", "f8"])
def test_foreign_wav(kind: str, tmp_path: Path) -> None:
    from scipy.io import wavfile

    samples = np.array([[0.5, -0.25], [0.0, 1 / 3], [-1.0, 0.125]])
    full = 2.0 ** (8 * int(kind[1]) - 1) if kind.startswith("i") else 1.0
    wavfile.write(tmp_path / "x.wav", 48000, (samples * full).clip(-full, full - 1).astype(kind)
                  if full > 1 else samples.astype(kind))  # fmt: skip
    with pytest.raises(FbsError, match=r"does not say what 1, 2 is; say it .--channel '1="):
        read_record(tmp_path / "x.wav")
    channels = {"1": ("hammer.z", "50 N"), "2": ("12.z", "100 m/s^2")}
    record, _ = read_record(tmp_path / "x.wav", channels)
    assert record.sampling_frequency == 48000.0
    digits = {"i2": 2**-15, "i4": 2**-31, "f4": 2**-24, "f8": 0.0}[kind]
    np.testing.assert_allclose(record.inputs[:, 0], 50 * samples[:, 0], atol=50 * digits)
    np.testing.assert_allclose(record.outputs[:, 0], 100 * samples[:, 1], atol=100 * digits)
