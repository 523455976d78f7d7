"""inspect and estimate: what files hold, and hammer records that become a part's FRFs."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import f as f_distribution

from fbs import Frf, Record, direct_frf, frequency_axis, write_uff
from fbs.files.channel_map import map_of
from fbs.files.frf_files import read_frf, write_frf
from fbs.files.record_files import write_record
from fbs.measured.from_records import frf_from_records
from mbs_models.integration.integrators import Integrator
from mbs_models.integration.time_integration import simulate
from mbs_models.model.excitation import Excitation
from mbs_models.model.model_file import load
from mbs_models.signals.sines import HalfSine
from mbs_models.system.drivetrain import build_stage
from tests.validation.command_line import call
from validation.inspection.nodes import dof_channels
from validation.routes import multibody

RIG = """
name = "reducer and brake"
[damping]
stiffness_proportional = 2e-6
mass_proportional = 60.0
[[stage]]
type = "parallel"
name = "reducer"
mesh_stiffness = 2.0e8
[stage.pinion]
mass = 3.0
base_radius = 0.05
polar_inertia = 0.005
diametral_inertia = 0.004
bearing_y = 2e8
bearing_z = 1e8
bearing_rocking = 1e6
[stage.wheel]
mass = 9.0
base_radius = 0.12
polar_inertia = 0.06
diametral_inertia = 0.04
bearing_y = 3e8
bearing_z = 1e8
bearing_rocking = 2e6
[[inertia]]
name = "brake"
radius = 0.1
polar_inertia = 0.2
torsional_stiffness = 1.0e5
[[coupling]]
name = "shaft"
first = "reducer.wheel"
second = "brake"
radius = 0.1
inertia = 0.002
first_stiffness = 4.0e7
second_stiffness = 4.0e7
"""
DOFS = ("brake.w", "shaft.w")
AXIS = frequency_axis(2, 400, 2)


@pytest.fixture
def rig(tmp_path: Path) -> Path:
    (tmp_path / "rig.toml").write_text(RIG)
    return tmp_path / "rig.toml"


def brake(rig: Path) -> Frf:
    return direct_frf(multibody.stage_system(load(str(rig)), "brake"), AXIS).to("accelerance")


# --- inspect -----------------------------------------------------------------------------------


def test_inspect_says_what_a_file_holds_and_prints_a_map(
    rig: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    frf = brake(rig).renamed({"brake.w": "12.z", "shaft.w": "7.z"})
    write_uff(frf, tmp_path / "x.uff", coherence=np.full(frf.values.shape, 0.97))
    assert call("inspect", str(tmp_path / "x.uff"), "--model", str(rig)) == 0
    told = capsys.readouterr().out
    for words in (
        "4 FRFs", "4 coherences", "data type 12 per 13, units m/s^2 per N, 200 values",
        "unit system (dataset 164): SI, length 1, force 1",
        "taken: accelerance, 2 × 2, 200 lines from 2 to 400 Hz",
        "nothing that a passive, reciprocal structure does not have",
        "coherence: median 0.9700, least 0.970", "# DoFs of the model: brake.w",
        '"DOF" = "12.z"  # response and reference',
    ):  # fmt: skip
        assert words in told
    text = told[told.index("[map]") :].replace('"DOF"', '"brake.w"', 1).replace("DOF", "shaft.w", 1)
    (tmp_path / "map.toml").write_text(text)
    assert set(map_of(tomllib.loads(text)["map"]).responses) == set(DOFS)
    out = str(tmp_path / "out")
    replaced = ["run", str(rig), "--replace", f"brake={tmp_path / 'x.uff'}", "--out", out]
    assert call(*replaced) == 2
    assert "none of its DoFs are wanted here: it has 12.z, 7.z" in capsys.readouterr().err
    assert call(*replaced, "--map", str(tmp_path / "map.toml")) == 0
    assert "changes nothing" in capsys.readouterr().out


def test_inspect_finds_what_no_structure_has(
    rig: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    frf = brake(rig)
    values = frf.values.copy()
    values[50:60, 0, 1] *= 1.5
    values[:, 1, 1] *= -1
    write_uff(Frf(AXIS, values, DOFS, DOFS, "accelerance"), tmp_path / "x.uff")
    assert call("inspect", str(tmp_path / "x.uff")) == 0
    told = capsys.readouterr().out
    assert "not reciprocal: brake.w, shaft.w differ by" in told
    assert "drive point shaft.w: mobility's phase beyond ±90°" in told
    assert "not passive as a matrix: λ_min = −" in told


def test_inspect_a_record(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "x.csv").write_text(
        "time (s),force h (N),acc 1.z (g)\n" + "".join(f"{k},{k % 7},1\n" for k in range(20))
    )
    assert call("inspect", str(tmp_path / "x.csv")) == 0
    told = capsys.readouterr().out
    assert "record: 20 samples at 1 Hz, 20 s; outputs as acceleration, m/s²" in told
    assert "force h: peak 6" in told
    assert "motion 1.z: peak 9.807, rms 9.807, mean 9.8, clipped?" in told


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("x.toml", "", "the ending .toml is not known; allowed: .npz"),
        ("x.csv", "a,b\n1,2\n", "as FRFs: its first column is 'a'; it must be the frequency"),
        ("x.npz", "junk", "as FRFs: the file is damaged, or no .npz"),
        ("x.wav", "junk", "as a record: the file is damaged, or no WAV"),
        ("none.uff", None, "as FRFs: cannot be read: No such file"),
    ],
)
def test_inspect_names_what_is_wrong(
    name: str, content: str | None, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if content is not None:
        (tmp_path / name).write_text(content)
    assert call("inspect", str(tmp_path / name)) == 2
    told = capsys.readouterr().err
    assert told.startswith(f"crosscheck: {tmp_path / name}: ")
    assert words in told
    assert told.count("\n") == 1


# --- what frf writes ---------------------------------------------------------------------------


def test_nodes_and_directions_of_a_drivetrain(rig: Path) -> None:
    channels = dof_channels(load(str(rig)))
    assert {label: (c.node, c.direction) for label, c in channels.items()} == {
        "reducer.pinion.w": (1, 6), "reducer.pinion.y": (1, 2), "reducer.pinion.z": (1, 3),
        "reducer.pinion.rho": (1, -5), "reducer.wheel.w": (2, -6), "reducer.wheel.y": (2, 2),
        "reducer.wheel.z": (2, 3), "reducer.wheel.rho": (2, 5), "brake.w": (3, 6),
        "shaft.w": (4, 6),
    }  # fmt: skip
    assert channels["reducer.wheel.w"].radius == 0.12
    assert len({(c.node, abs(c.direction)) for c in channels.values()}) == len(channels)


@pytest.mark.parametrize("ending", [".uff", ".csv", ".mat"])
def test_what_frf_writes_is_taken_by_run(
    ending: str, rig: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, both = str(tmp_path / f"brake{ending}"), ",".join(DOFS)
    every = ["--response", both, "--excitation", both, "--fmin", "2", "--fmax", "400", "--df", "2"]
    assert call("frf", str(rig), "--stage", "brake", *every, "--output", path) == 0
    if ending == ".uff":
        found = read_frf(path)
        assert found.angles == found.moments == set(DOFS)  # rad per N m, at true nodes
    out = str(tmp_path / "out")
    assert call("run", str(rig), "--replace", f"brake={path}", "--out", out) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    assert "changes nothing" in captured.out


def test_noise_gives_bands(rig: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    frf = brake(rig)
    write_uff(Frf(AXIS, frf.values * 1.05, DOFS, DOFS, "accelerance"), tmp_path / "x.uff")
    given = ["run", str(rig), "--replace", f"brake={tmp_path / 'x.uff'}"]
    assert call(*given, "--noise", "0.2%,0.1deg", "--out", str(tmp_path / "out")) == 0
    told = capsys.readouterr().out
    assert "(95 %) at" in told
    assert "of it by brake's shaft.w ← shaft.w" in told
    assert "the change there is beyond that" in told  # 5 % of the FRFs against 0.2 %
    sampled = [*given, "--noise", "0.2%,0.1deg", "--samples"]
    assert call(*sampled, "200", "--out", str(tmp_path / "out")) == 0
    told = capsys.readouterr().out
    assert re.search(r"known to −\S+ to \+\S+ dB \(95 %\) at .*the change there is beyond", told)
    for wrong, words in (
        ([*sampled, "20"], "--samples = 20: must be at least 100"),
        ([*sampled, "9000000"], "--samples = 9000000: with 200 lines and"),
        ([*given, "--samples", "200"], "nothing is known of any file's errors; --noise or"),
    ):
        assert call(*wrong, "--out", str(tmp_path / "out")) == 2
        assert words in capsys.readouterr().err
    assert call(*given, "--noise", "2", "--out", str(tmp_path / "out")) == 2
    assert "--noise = '2': give a percentage" in capsys.readouterr().err


def test_quality_and_bands_stand_in_the_report(
    rig: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A pair 1.3 times the other from 202 to 260 Hz, a drive point of other sign, poor coherence.

    The coherence's averages are said by the file, by the user, or by nobody.
    """
    frf = brake(rig)
    values = frf.values.copy()
    values[100:130, 0, 1] *= 1.3
    coherence = np.full(values.shape, 0.999)
    coherence[60:70, 1, 0] = 0.6
    bad = Frf(AXIS, values, DOFS, DOFS, "accelerance")
    for ending in ("uff", "npz", "mat"):
        write_frf(bad, tmp_path / f"x.{ending}", coherence=coherence)
        write_frf(bad, tmp_path / f"n.{ending}", None, coherence, dict.fromkeys(DOFS, 8))
    out = tmp_path / "out"

    def told(name: str, *more: str) -> tuple[str, str]:
        assert call("run", str(rig), "--replace", f"brake={tmp_path / name}", *more, "--out",
                    str(out)) == 0  # fmt: skip
        captured = capsys.readouterr()
        return captured.out, captured.err

    def of_the_brake(printed: str) -> list[str]:
        """What is said of the FRF that changes most."""
        lines = printed.splitlines()
        return [line for line in lines if line.startswith("  brake.w: ") and "(95 %)" in line]

    printed, warned = told("x.uff")
    assert "(95 %)" not in printed
    assert "does not say of how many averages: no bands follow from them (--averages N)" in warned
    said, warned = told("x.uff", "--averages", "8")
    assert "known to ±" in said
    assert "averages" not in warned
    bands = of_the_brake(said)
    assert bands
    for ending in ("uff", "npz", "mat"):
        printed, warned = told(f"n.{ending}")
        assert of_the_brake(printed) == bands
        assert "averages" not in warned
    html = (out / "report.html").read_text(encoding="utf-8")
    page = html[html.index('<h2 id="quality">') :]
    for words in (
        "reciprocity", "at 30 of 200 lines (202–260 Hz)", "1 − coherence",
        "at 10 of 200 lines (122–140 Hz)", "How well the FRFs are known", "in doubt",
    ):  # fmt: skip
        assert words in page
    swap = json.loads((out / "results.json").read_text(encoding="utf-8"))["swap"]
    (reciprocity,) = (d for d in swap["parts"][0]["doubts"] if d["property"] == "reciprocity")
    assert reciprocity["bands_hz"] == [[202.0, 260.0]]
    known = swap["known"][0]
    assert 0 < known["median_db"] < known["at_largest_change_db"]
    assert sum(share["share"] for share in known["shares"]) == pytest.approx(1.0, abs=0.04)
    with np.load(out / "results.npz") as arrays:
        assert arrays["swap_known_db"].shape == (len(swap["known"]), 2, 200)
        shares = arrays["swap_error_share_brake"]
    np.testing.assert_allclose(shares.sum(axis=(1, 2)), 1.0)


def test_the_mass_of_a_part_is_held_against_the_models(rig: Path, tmp_path: Path) -> None:
    """The reducer alone turns freely: 1.5 times its FRFs is two thirds of its inertia.

    With little damping of its mass: that of the rig holds it back at all lines.
    """
    rig.write_text(RIG.replace("mass_proportional = 60.0", "mass_proportional = 1.0"))
    frf = direct_frf(multibody.stage_system(load(str(rig)), "reducer"), AXIS)
    write_frf(Frf(AXIS, 1.5 * frf.values, frf.responses, frf.excitations), tmp_path / "x.npz")
    given = f"reducer={tmp_path / 'x.npz'}"
    assert call("run", str(rig), "--replace", given, "--out", str(tmp_path / "out")) == 0
    swap = json.loads((tmp_path / "out" / "results.json").read_text(encoding="utf-8"))["swap"]
    doubts = {tuple(d["dofs"]): d for d in swap["parts"][0]["doubts"]}
    assert {d["property"] for d in doubts.values()} == {"mass"}
    assert doubts["shaft.w",]["worst"] == pytest.approx(1.5, rel=0.025)  # half of the noise
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "times the model’s rigid body" in page


@pytest.mark.parametrize(
    ("value", "averages", "words"),
    [
        (0.9, "1", "--averages = 1: coherence needs two at least"),
        (1.2, "8", "the coherence of brake.w ← brake.w is 1.2 at 2 Hz; must be above 0"),
        (None, "8", "--averages = 8: "),
    ],
)
def test_coherence_that_is_none(
    value: float | None,
    averages: str,
    words: str,
    rig: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    frf = brake(rig)
    path = tmp_path / "x.npz"
    write_frf(frf, path, coherence=None if value is None else np.full(frf.values.shape, value))
    given = ["run", str(rig), "--replace", f"brake={path}", "--averages", averages]
    assert call(*given, "--out", str(tmp_path / "out")) == 2
    assert words in capsys.readouterr().err


def test_files_of_other_lines_are_interpolated_when_asked(
    rig: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    drivetrain, out = load(str(rig)), str(tmp_path / "out")
    files = {}
    for part, axis in (("brake", frequency_axis(3, 399, 1)), ("reducer", AXIS)):
        files[part] = tmp_path / f"{part}.npz"
        write_frf(direct_frf(multibody.stage_system(drivetrain, part), axis), files[part])
    given = ["run", str(rig), "--out", out]
    for part, path in files.items():
        given += ["--replace", f"{part}={path}"]
    assert call(*given) == 2
    told = capsys.readouterr().err
    assert "they have 3 to 399 Hz in common" in told
    assert "--resample interpolates" in told
    assert call(*given, "--resample") == 0
    captured = capsys.readouterr()
    assert (
        "reducer.npz ('reducer'): interpolated to 397 lines, with an error of up to" in captured.err
    )
    assert call(*given, "--resample", "--df", "2.5") == 0


# --- estimate ----------------------------------------------------------------------------------

BLOWS, NOISE = 6, 2e-3


def hammered(rig: Path, rng: np.random.Generator, motion: str) -> list[Record]:
    """Blows at both DoFs of the brake alone, by exudyn in time; sensors' noise is added.

    Sampled at every step: a half-sine's corners have all frequencies, and there is no filter. The
    sum of its samples is off its integral by (π/51.2)²/12 = 3e-4 where a blow has 51.2 of them.
    """
    system = build_stage(load(str(rig)), "brake")
    integrator = Integrator("RK44", 1 / 51200, "")
    records = []
    for dof in DOFS:
        blow = Excitation(dof, HalfSine(100.0, 1e-3, start=2e-3))
        run = simulate(
            system, [blow], duration=0.5, integrator=integrator, sampling_frequency=51200.0,
            responses=DOFS, record=(motion,),
        )  # fmt: skip
        sensed = getattr(run, motion)
        size = np.abs(sensed).max(axis=0)
        for _ in range(BLOWS):
            strength = rng.uniform(0.5, 2.0)
            noise = NOISE * size * rng.standard_normal(sensed.shape)
            output = strength * sensed + noise
            quantity = {"displacement": "receptance", "acceleration": "accelerance"}[motion]
            records.append(Record(51200.0, strength * run.forces, output, (dof,), DOFS, quantity))
    return records


@pytest.mark.parametrize(
    ("motion", "quantity"), [("displacement", "receptance"), ("acceleration", "accelerance")]
)
def test_hammer_records_become_a_part(
    motion: str, quantity: str, rig: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """And the model's own FRFs, of the part and of the whole, lie in the bands estimated."""
    records = hammered(rig, np.random.default_rng(12), motion)
    paths = []
    for number, record in enumerate(records):
        paths.append(str(tmp_path / f"blow{number}.npz"))
        write_record(record, paths[-1])
    target = str(tmp_path / "brake.uff")
    band = ["--fmin", "10", "--fmax", "400"]
    assert call("estimate", *paths, "--output", target, *band) == 0
    told = capsys.readouterr().out
    assert f"{quantity} by H1 (hammer), 2 × 2, 196 lines from 10 to 400 Hz" in told
    assert "averages: brake.w: 6, shaft.w: 6" in told
    found = frf_from_records(records, fmin=10.0, fmax=400.0)
    assert found.variance is not None
    exact = brake(rig).band(10.0, 400.0).to(quantity).values
    # F(2, 2 (6 − 1)) of |ΔH|² / variance; 784 values, of which a line's four share their blows
    limit = f_distribution.ppf(0.95, 2, 10)
    inside = np.abs(found.frf.values - exact) ** 2 < limit * found.variance
    assert 0.90 < inside.mean() < 0.99
    out = str(tmp_path / "out")
    assert call("run", str(rig), "--replace", f"brake={target}", "--out", out) == 0
    assert "The swap (brake from brake.uff" in capsys.readouterr().out
    # of the whole: the file says of how many averages its coherence is, so that bands are those of
    # Student's t of 2 (6 − 1) degrees of freedom
    with np.load(tmp_path / "out" / "results.npz") as arrays:
        model = 20 * np.log10(
            np.abs(arrays["swap_before_m_per_n"]) / np.abs(arrays["swap_after_m_per_n"])
        )
        low, high = np.moveaxis(arrays["swap_known_db"], 1, 0)
        within = (low < model) & (model < high)
    assert 0.92 < within.mean() < 0.99


def test_motions_without_a_force_are_no_frfs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "x.csv").write_text("time (s),acc a (g),acc b (g)\n0,1,2\n1,2,1\n")
    target = tmp_path / "x.uff"
    assert call("estimate", str(tmp_path / "x.csv"), "--output", str(target)) == 2
    assert "motions alone give transmissibilities, no FRFs" in capsys.readouterr().err
    assert not target.exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--output", "x.xls"], "--output = x.xls: the ending .xls is not known; allowed: .npz"),
        (["--output", "x.npz", "--method", "H3"], "--method = 'H3': must be one of H1, H2, Hv"),
        (["--output", "x.npz", "--signal", "sine"], "--signal = 'sine': must be one of hammer"),
        (["--output", "x.npz", "--df", "0"], "--df = 0.0: must be greater than 0 (Hz)"),
        (["--output", "r.csv"], "--output = r.csv: is r.csv itself, which is read"),
        (["--output", "x.npz", "--channel", "1=N"], "--channel = '1=N': give NAME=LABEL UNIT"),
    ],
)
def test_options_of_estimate(
    arguments: list[str],
    words: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("r.csv").write_text("time (s),force f (N),acc a (g)\n0,1,2\n1,2,1\n2,0,0\n3,0,0\n")
    assert call("estimate", "r.csv", *arguments) == 2
    assert words in capsys.readouterr().err


def test_the_step_of_noise_is_not_taken_for_blows(
    rig: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Their lines are the record's; the option was passed over."""
    times = np.arange(256) / 256.0
    rows = [f"{t},{float(k == 3)},{np.exp(-30 * t) * (k > 3)}" for k, t in enumerate(times)]
    (tmp_path / "r.csv").write_text("\n".join(["time (s),force f (N),acc a (g)", *rows]))
    target = str(tmp_path / "x.npz")
    given = ["estimate", str(tmp_path / "r.csv"), "--output", target, "--signal", "hammer"]
    assert call(*given) == 0
    assert call(*given, "--df", "0.5") == 2
    assert "--df = 0.5: is for noise" in capsys.readouterr().err
