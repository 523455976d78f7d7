"""A stage's FRFs from a file: read, coupled, and what they change."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fbs import Frf, direct_frf, frequency_axis, write_uff
from mbs_models.modal.modes import drivetrain_modes
from mbs_models.model.model_file import dumps, load
from mbs_models.model.parameters import Drivetrain
from tests.strategies import damped, paper, with_coupling, with_stage
from tests.validation.command_line import call
from validation.checks.peaks import Peak, Resonance, find, match, merge
from validation.crosscheck.document import results_document
from validation.crosscheck.result import Changes
from validation.crosscheck.study import cross_check
from validation.crosscheck.substitution import headline
from validation.errors import CommandError
from validation.report.documents import plain
from validation.routes import multibody
from validation.routes.bands import Band
from validation.routes.source import equations_source
from validation.routes.substitution import interface_labels, read_substitutions
from validation.routes.substitution_checks import where

FREQUENCY = frequency_axis(10.0, 9000.0, 10.0)
DAMPED = damped(paper())
SOFTER = with_stage(DAMPED, "planetary", ring_mesh_stiffness=4.5e8)


def stage_frf(drivetrain: Drivetrain, stage: str = "planetary") -> Frf:
    return direct_frf(multibody.stage_system(drivetrain, stage), FREQUENCY)


def save(path: Path, frf: Frf, **changes: Any) -> Path:
    arrays = {
        "frequency": frf.frequency,
        "values": frf.values,
        "responses": np.array(frf.responses),
        "excitations": np.array(frf.excitations),
        "quantity": np.array(str(frf.quantity)),
    }
    arrays |= changes
    kept: dict[str, Any] = {name: a for name, a in arrays.items() if a is not None}
    np.savez(path, **kept)
    return path


def changes(drivetrain: Drivetrain, *given: str) -> Changes:
    found = read_substitutions(drivetrain, given)
    result = cross_check(drivetrain, Band.of(found[0].frf.frequency), substitutions=found)
    assert result.agrees  # what a file changes is no disagreement of the model's routes
    assert result.substitution is not None
    return result.substitution


@pytest.fixture
def model_file(tmp_path: Path) -> str:
    path = tmp_path / "damped.toml"
    path.write_text(dumps(DAMPED), encoding="utf-8")
    return str(path)


@pytest.fixture(scope="module")
def softer(tmp_path_factory: pytest.TempPathFactory) -> Changes:
    path = save(tmp_path_factory.mktemp("softer") / "softer.npz", stage_frf(SOFTER))
    return changes(DAMPED, f"planetary={path}")


# --- round trip -----------------------------------------------------------------------------


@pytest.mark.parametrize("ending", [".npz", ".uff"])
def test_what_frf_writes_run_reads(
    ending: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / f"planetary{ending}"
    every = ["--response", "all", "--excitation", "all"]
    if ending == ".uff":  # pyuff takes 10 ms for each FRF
        every = ["--response", "coupling.w,planetary.sun.w", "--excitation", "coupling.w"]
        every[-1] += ",planetary.sun.w"
    lines = ["--fmin", "20", "--fmax", "4000", "--df", "20"]
    written = ["frf", "paper", "--stage", "planetary", *every, "--output", str(path)]
    assert call(*written, *lines) == 0
    out = tmp_path / "report"
    assert call("run", "paper", "--replace", f"planetary={path}", "--out", str(out)) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    assert f"The swap (planetary from {path.name}) changes nothing" in captured.out
    results = json.loads((out / "results.json").read_text(encoding="utf-8"))
    assert results["swap"]["changes"] is False
    assert results["swap"]["worst"]["scaled_error"] < (1e-9 if ending == ".npz" else 1e-6)
    assert results["band_hz"] == {"fmin": 20.0, "fmax": 4000.0, "df": 20.0}
    # The tick is the model's own routes'; the swap has a headline of its own.
    assert results["verdict"] == "All routes agree on the model before the swap"
    assert "the swap (planetary from" in results["swap"]["headline"]
    html = (out / "report.html").read_text(encoding="utf-8")
    assert '<h2 id="swap">' in html
    assert "planetary alone" in html


def test_no_swap_no_section(tmp_path: Path) -> None:
    assert call("run", "paper", "--out", str(tmp_path), "--df", "100", "--fmin", "100") == 0
    assert 'id="swap"' not in (tmp_path / "report.html").read_text(encoding="utf-8")
    assert json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))["swap"] is None


@pytest.mark.parametrize("quantity", ["mobility", "accelerance"])
def test_any_quantity_becomes_receptance(quantity: str, tmp_path: Path) -> None:
    path = save(tmp_path / "x.npz", stage_frf(DAMPED).to(quantity))
    (found,) = read_substitutions(DAMPED, [f"planetary={path}"])
    np.testing.assert_allclose(found.frf.values, stage_frf(DAMPED).values, rtol=1e-12)
    assert found.warnings == ()


def test_two_parts_from_files_in_limits(tmp_path: Path) -> None:
    paths = {s: save(tmp_path / f"{s}.npz", stage_frf(DAMPED, s)) for s in ("reducer", "planetary")}
    given = [f"{stage}={path}" for stage, path in paths.items()]
    found = read_substitutions(DAMPED, given, fmin=95.0, fmax=500.0, df=10.0)
    assert [r.part for r in found] == ["reducer", "planetary"]
    np.testing.assert_array_equal(found[0].frf.frequency, frequency_axis(100.0, 500.0, 10.0))
    result = cross_check(DAMPED, Band.of(found[0].frf.frequency), substitutions=found)
    assert result.substitution is not None
    assert not result.substitution.changes
    assert result.substitution.comparison.pair_max.shape == (30, 30)


def test_uneven_lines(tmp_path: Path) -> None:
    lines = np.geomspace(20.0, 5000.0, 200)
    frf = direct_frf(multibody.stage_system(SOFTER, "planetary"), lines)
    found = changes(DAMPED, f"planetary={save(tmp_path / 'x.npz', frf)}")
    np.testing.assert_array_equal(found.substitutions[0].frf.frequency, lines)
    assert found.changes


def test_couplings_of_every_kind_are_found() -> None:
    assert interface_labels(equations_source(paper()), "planetary") == ("coupling.w",)
    shaft = with_coupling(
        paper(), inertia_over_r2=0.0, first_stiffness="rigid", dofs={"u": {"stiffness": 1e8}}
    )
    assert interface_labels(equations_source(shaft), "reducer") == ("coupling.w", "reducer.wheel.y")
    assert interface_labels(equations_source(shaft), "planetary") == (
        "planetary.sun.w",
        "planetary.sun.u",
    )


# --- what a changed stage changes -----------------------------------------------------------


def test_swapped_assembly_is_the_changed_drivetrain(softer: Changes) -> None:
    """Ring meshes 10 % softer: the numbers are those of the exact model with that stage."""
    assert softer.changes
    before = direct_frf(multibody.drivetrain_system(DAMPED), FREQUENCY)
    after = direct_frf(multibody.drivetrain_system(SOFTER), FREQUENCY)
    assert softer.not_compared == ()
    for curve in softer.curves:
        h, g = (x.between(curve.response, curve.excitation) for x in (before, after))
        np.testing.assert_allclose(curve.before, h, rtol=1e-6)
        np.testing.assert_allclose(curve.after, g, rtol=1e-6)
        decibel = 20.0 * np.log10(np.abs(g / h))
        line = int(np.argmax(np.abs(decibel)))
        assert curve.largest_db == pytest.approx(decibel[line], rel=1e-6, abs=1e-6)
        if abs(decibel[line]) > 1e-3:
            assert curve.at_hz == FREQUENCY[line]
        assert curve.rms_db == pytest.approx(np.sqrt(np.mean(decibel**2)), rel=1e-5, abs=1e-6)
    norm = np.linalg.norm(before.values, axis=2)
    error = np.abs(after.values - before.values) / np.sqrt(norm[:, :, None] * norm[:, None, :])
    assert softer.comparison.line_max.max() == pytest.approx(error.max(), rel=1e-6)
    where, i, j = np.unravel_index(int(np.argmax(error)), error.shape)
    at, response, excitation = softer.comparison.worst
    assert at == FREQUENCY[where]
    assert error[where, before.responses.index(response), before.excitations.index(excitation)] == (
        pytest.approx(error[where, i, j])
    )


def test_resonances_move_as_the_modes_do(softer: Changes) -> None:
    """To a fifth of the line spacing, though the peaks are narrower than that."""
    before, after = (
        np.array([m.frequency_hz for m in drivetrain_modes(d).modes]) for d in (DAMPED, SOFTER)
    )
    sharp = [r for r in softer.resonances if 500.0 < r.frequency_hz < 2500.0 and r.shift]
    assert len(sharp) >= 7
    for resonance in sharp:
        assert resonance.before is not None
        assert resonance.after is not None
        mode = int(np.argmin(np.abs(before - resonance.before.frequency_hz)))
        assert resonance.before.frequency_hz == pytest.approx(before[mode], abs=2.0)
        assert resonance.after.frequency_hz == pytest.approx(after[mode], abs=2.0)
    assert min(r.shift for r in sharp if r.shift) == pytest.approx(
        after[8] / before[8] - 1.0, rel=0.02
    )


def test_the_part_alone_shows_the_file(softer: Changes) -> None:
    (curve, *inner) = softer.alone["planetary"]
    assert curve.name == "coupling.w"
    assert {c.name for c in inner} == {"planetary.sun.u", "planetary.sun.w"}
    np.testing.assert_array_equal(
        curve.after, stage_frf(SOFTER).between("coupling.w", "coupling.w")
    )
    np.testing.assert_allclose(
        curve.before, stage_frf(DAMPED).between("coupling.w", "coupling.w"), rtol=1e-12
    )


def test_findings_leave_the_exit_code_at_0(
    model_file: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = save(tmp_path / "softer.npz", stage_frf(SOFTER))
    out = tmp_path / "report"
    assert call("run", model_file, "--replace", f"planetary={path}", "--out", str(out)) == 0
    printed = capsys.readouterr().out
    assert "All routes agree" in printed
    assert "The swap (planetary from softer.npz) changes FRFs by up to " in printed
    assert "; resonances move by up to −4.6 %" in printed
    assert "planetary alone at coupling.w" in printed


def test_the_headline_is_of_no_antiresonance_and_of_no_move_below_the_lines(tmp_path: Path) -> None:
    """An FRF 10 % up between resonances: the scaled error tells it, no peak goes anywhere."""
    values = stage_frf(DAMPED).values.copy()
    between = np.abs(FREQUENCY - 400.0) <= 20.0  # no mode of this drivetrain, 42 to 727 Hz
    values[between] *= 1.1
    found = changes(
        DAMPED, f"planetary={save(tmp_path / 'x.npz', stage_frf(DAMPED), values=values)}"
    )
    largest = found.comparison.line_max.max()
    at, response, excitation = found.comparison.worst
    assert headline(found) == (
        f"the swap (planetary from x.npz) changes FRFs by up to {largest:.2g} (scaled error) at "
        f"{at:.6g} Hz, {response} ← {excitation}; resonances stay"
    )


def test_the_headline_says_that_a_file_is_warned_of(tmp_path: Path) -> None:
    frf = stage_frf(DAMPED)
    values = frf.values.copy()
    values[:, frf.responses.index("coupling.w"), frf.excitations.index("planetary.sun.w")] *= 1.2
    found = changes(DAMPED, f"planetary={save(tmp_path / 'x.npz', frf, values=values)}")
    assert "not reciprocal" in found.substitutions[0].warnings[0]
    assert headline(found).startswith("the swap (planetary from x.npz, warned of) changes FRFs")


def test_dofs_the_file_lacks_are_left_out_and_said(tmp_path: Path) -> None:
    """Driven at the hub alone, with responses at the hub and the sun: an ordinary measurement."""
    few = stage_frf(SOFTER).select(["coupling.w", "planetary.sun.w"], ["coupling.w"])
    found = changes(DAMPED, f"planetary={save(tmp_path / 'few.npz', few)}")
    (substitution,) = found.substitutions
    assert len(substitution.left_out) == 21
    assert "planetary.sun.w" in found.responses
    assert "planetary.sun.w" not in found.excitations
    assert found.not_compared == (
        ("planetary.sun.u", "planetary.sun.u"), ("planetary.sun.w", "planetary.sun.w"),
    )  # fmt: skip
    through = next(c for c in found.curves if c.response != c.excitation)
    exact = direct_frf(multibody.drivetrain_system(SOFTER), FREQUENCY)
    np.testing.assert_allclose(
        through.after, exact.between(through.response, through.excitation), rtol=1e-6
    )


def test_results_hold_the_swap(softer: Changes) -> None:
    result = cross_check(load("paper"), Band(100.0, 900.0, 100.0))
    made = type("Made", (), {"date": "", "platform": "", "versions": {}})()
    document = plain(results_document(replace(result, substitution=softer), made)["swap"])
    assert document["headline"].startswith("the swap (planetary from softer.npz) changes FRFs")
    assert document["parts"][0]["interface"] == ["coupling.w"]
    assert {c["response"] for c in document["alone"]["planetary"]} >= {"coupling.w"}
    assert any(r["relative_shift"] for r in document["resonances"])


# --- odd files: warned ----------------------------------------------------------------------


def odd(tmp_path: Path, change: Callable[[Any, Frf], Any]) -> tuple[str, ...]:
    frf = stage_frf(DAMPED).select(
        ["coupling.w", "planetary.sun.w"], ["coupling.w", "planetary.sun.w"]
    )
    values = frf.values.copy()
    change(values, frf)
    path = save(tmp_path / "odd.npz", frf, values=values)
    (found,) = read_substitutions(DAMPED, [f"planetary={path}"])
    assert all(str(path) in warning for warning in found.warnings)
    return found.warnings


def test_an_active_drive_point_is_warned_of_with_its_band(
    tmp_path: Path, model_file: str, capsys: pytest.CaptureFixture[str]
) -> None:
    def change(values: Any, frf: Frf) -> None:
        inside = (frf.frequency >= 1500.0) & (frf.frequency <= 1600.0)
        values[inside, 1, 1] = np.conj(values[inside, 1, 1])

    (warning,) = odd(tmp_path, change)
    assert "not passive" in warning
    assert "planetary.sun.w at" in warning
    assert "(1500–" in warning or "(1510–" in warning or "(1520–" in warning
    out = tmp_path / "report"
    given = f"planetary={tmp_path / 'odd.npz'}"
    assert call("run", model_file, "--replace", given, "--out", str(out)) == 0
    assert f"warning: {warning}" in capsys.readouterr().err
    html = (out / "report.html").read_text(encoding="utf-8")
    section = html[html.index('<h2 id="swap">') : html.index("FRFs before and after")]
    assert "not passive, Re(mobility) &lt; −5 % of it" in section


def test_noise_is_no_activity(tmp_path: Path) -> None:
    def change(values: Any, frf: Frf) -> None:
        values *= np.exp(0.02j)  # 1° of phase

    assert odd(tmp_path, change) == ()


def test_frfs_that_are_not_reciprocal_are_warned_of(tmp_path: Path) -> None:
    def change(values: Any, frf: Frf) -> None:
        values[:, 0, 1] *= 1.2

    (warning,) = odd(tmp_path, change)
    assert "not reciprocal, |H_ij − H_ji| beyond 5 % of √(h_i h_j)" in warning
    assert "coupling.w and planetary.sun.w" in warning


def test_millimetres_are_pointed_out(tmp_path: Path) -> None:
    def change(values: Any, frf: Frf) -> None:
        values *= 1e3

    (warning,) = odd(tmp_path, change)
    assert "another unit" in warning
    assert "1e+03 times the model's" in warning


def test_the_line_at_0_hz_is_left_out_and_said(tmp_path: Path) -> None:
    frf = stage_frf(DAMPED)
    path = save(tmp_path / "x.npz", frf, frequency=np.append(0.0, frf.frequency[:-1]))
    (found,) = read_substitutions(DAMPED, [f"planetary={path}"])
    assert found.frf.frequency[0] == 10.0
    assert any("0 Hz is left out" in warning for warning in found.warnings)


def test_labels_the_model_lacks_are_left_out_and_said(tmp_path: Path) -> None:
    frf = stage_frf(DAMPED).renamed({"planetary.ring.u": "12.z"})
    path = save(tmp_path / "x.npz", frf)
    (found,) = read_substitutions(DAMPED, [f"planetary={path}"])
    assert found.unknown == ("12.z",)
    assert found.left_out == ("planetary.ring.u",)
    assert "12.z" in found.warnings[0]


def test_lines_in_words() -> None:
    frequency = frequency_axis(1.0, 6.0, 1.0)
    mask = np.array([True, True, False, True, False, False])
    assert where(frequency, mask) == "at 3 of 6 lines (1–2 Hz, 4 Hz)"


# --- wrong input: one message, exit code 2 --------------------------------------------------


def with_nan(frf: Frf) -> Any:
    values = frf.values.copy()
    values[7, 1, 0] = np.nan
    return values


def small() -> Frf:
    both = ["coupling.w", "planetary.sun.w"]
    return stage_frf(DAMPED).select(both, both)


BAD_NPZ: dict[str, tuple[Callable[[Frf], dict[str, Any]], list[str]]] = {
    "NaN": (
        lambda f: {"values": with_nan(f)}, ["'coupling.w' to 'planetary.sun.w' is", "nan", "80 Hz"],
    ),
    "no excitation at the interface": (
        lambda f: {"values": f.values[:, :, 1:], "excitations": np.array(["planetary.sun.w"])},
        ["coupling.w is missing as excitation", "excitations are planetary.sun.w"],
    ),
    "no response at the interface": (
        lambda f: {"responses": np.array(["planetary.ring.w", "planetary.sun.w"])},
        ["coupling.w is missing as response", "responses are planetary.ring.w, planetary.sun.w"],
    ),
    "shape": (lambda f: {"values": f.values[:, :, :1]}, ["shape", "(900, 2, 1)", "2 excitations"]),
    "quantity": (lambda f: {"quantity": np.array("dB")}, ["'dB'", "receptance, mobility"]),
    "magnitude only": (lambda f: {"values": np.abs(f.values)}, ["values", "float64", "complex"]),
    "labels are numbers": (lambda f: {"responses": np.array([1, 2])}, ["responses", "text"]),
    "array missing": (lambda f: {"responses": None}, ["no array responses", "it has frequency"]),
    "falling axis": (lambda f: {"frequency": f.frequency[::-1]}, ["ascend"]),
    "other part's DoFs": (
        lambda f: {"responses": np.array(["coupling.w", "reducer.pinion.w"])},
        ["'reducer.pinion.w' belongs to 'reducer'", "--stage planetary"],
    ),
    "twice the same": (
        lambda f: {"responses": np.array(["coupling.w", "coupling.w"])}, ["more than once"],
    ),
}  # fmt: skip


@pytest.mark.parametrize("fault", BAD_NPZ)
def test_files_that_do_not_fit(
    fault: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    change, words = BAD_NPZ[fault]
    frf = small()
    path = save(tmp_path / "bad.npz", frf, **change(frf))
    refused(capsys, ["run", "paper", "--replace", f"planetary={path}"], ["bad.npz", *words])


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("missing.npz", None, ["No such file"]),
        ("missing.uff", None, ["No such file"]),
        ("table.csv", b"1,2", ["no header"]),
        ("table.xls", b"1,2", [".xls", ".npz, .csv, .uff"]),
        ("text.npz", b"this is no archive", ["damaged"]),
        ("empty.npz", b"", ["damaged"]),
        ("cut.npz", b"PK\x03\x04", ["damaged"]),
        ("text.uff", b"this is no universal file", ["no universal file"]),
        ("cut.uff", b"    -1\n   164\n", ["truncated"]),
    ],
)
def test_unreadable_files(
    name: str,
    content: bytes | None,
    words: list[str],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    refused(capsys, ["run", "paper", "--replace", f"planetary={path}"], [name, *words])


def test_a_damaged_archive(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = save(tmp_path / "bad.npz", small())
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0xFF
    path.write_bytes(content)
    refused(capsys, ["run", "paper", "--replace", f"planetary={path}"], ["bad.npz", "damaged"])


def test_foreign_units(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "inches.uff"
    write_uff(small(), path)
    text = path.read_text(encoding="ascii")
    path.write_text(text.replace("m                   \n", "in                  \n"), "ascii")
    assert "in   " in path.read_text(encoding="ascii")
    words = ["inches.uff", "labels say in per N", "SI"]
    refused(capsys, ["run", "paper", "--replace", f"planetary={path}"], words)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--replace", "planetery={x}"], ["planetery", "did you mean planetary", "reducer"]),
        (["--replace", "planetary"], ["'planetary'", "planetary=measured.uff"]),
        (["--replace", "={x}"], ["give a stage and a file"]),
        (["--replace", "planetary={x}", "--replace", "planetary={x}"], ["already"]),
        (["--replace", "planetary={x}", "--fmin", "20000"], ["fmin = 20000", "10 to 9000 Hz"]),
        (["--replace", "planetary={x}", "--fmax", "5"], ["fmax = 5", "10 to 9000 Hz"]),
        (["--replace", "planetary={x}", "--df", "1"], ["--df = 1", "10 to 10 Hz apart"]),
        (
            ["--replace", "planetary={x}", "--replace", "reducer={y}"],
            ["x.npz", "y.npz", "lines", "--fmin"],
        ),
    ],
)  # fmt: skip
def test_options_that_do_not_fit(
    arguments: list[str], words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    paths = {"x": save(tmp_path / "x.npz", small())}
    reducer = stage_frf(DAMPED, "reducer")
    paths["y"] = save(tmp_path / "y.npz", reducer, frequency=reducer.frequency + 1.0)
    refused(capsys, ["run", "paper", *(a.format(**paths) for a in arguments)], words)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--stage", "planetery"], ["--stage", "planetery", "did you mean planetary"]),
        (["--stage", "planetary", "--route", "fbs"], ["--stage", "exudyn or equations"]),
    ],
)
def test_stages_that_frf_refuses(
    arguments: list[str], words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    dofs = ["--response", "all", "--excitation", "all"]
    refused(capsys, ["frf", "paper", *dofs, *arguments], words)


def refused(capsys: pytest.CaptureFixture[str], arguments: list[str], words: list[str]) -> None:
    assert call(*arguments) == 2
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1
    assert captured.out == ""
    for word in words:
        assert word in captured.err


def test_a_part_without_dofs_of_its_own_is_refused(tmp_path: Path) -> None:
    alone = load("lin-parker-4")
    path = save(
        tmp_path / "x.npz", small().renamed({"coupling.w": "1.x", "planetary.sun.w": "2.x"})
    )
    with pytest.raises(CommandError, match="none of its DoFs are wanted here"):
        read_substitutions(alone, [f"planetary={path}"])


# --- peaks ----------------------------------------------------------------------------------


@pytest.mark.parametrize("uneven", [False, True])
def test_a_peak_between_the_lines(uneven: bool) -> None:
    lines = np.geomspace(50.0, 150.0, 100) if uneven else frequency_axis(50.0, 150.0, 1.0)
    values = 1.0 / (100.3**2 - lines**2 + 2j * 0.005 * 100.3 * lines)
    (peak,) = find(lines, values)
    assert peak.frequency_hz == pytest.approx(100.3, abs=0.02)
    assert peak.level_db == pytest.approx(20 * np.log10(1 / (0.01 * 100.3**2)), abs=0.3)


def test_peaks_are_matched_with_their_nearest() -> None:
    before = [Peak(f, 0.0, 10.0) for f in (100.0, 200.0, 300.0)]
    after = [Peak(f, 0.0, 10.0) for f in (98.0, 205.0, 400.0)]
    found = match("a.w", before, after)
    assert found == (
        Resonance("a.w", before[0], after[0]),
        Resonance("a.w", before[1], after[1]),
        Resonance("a.w", before[2], None),
        Resonance("a.w", None, after[2]),
    )
    assert match("a.w", [], after[:1]) == (Resonance("a.w", None, after[0]),)


def test_a_resonance_seen_twice_is_told_once() -> None:
    weak = Resonance("a.w", Peak(100.0, 0.0, 10.0), Peak(98.0, 0.0, 10.0))
    strong = Resonance("b.w", Peak(100.05, 0.0, 30.0), Peak(98.05, 0.0, 30.0))
    half = Resonance("c.w", Peak(100.0, 0.0, 40.0), None)
    other = Resonance("d.w", Peak(100.0, 0.0, 5.0), Peak(101.0, 0.0, 5.0))
    lines = frequency_axis(90.0, 110.0, 0.5)
    assert merge(lines, [weak, half, strong, other]) == (other, strong)
