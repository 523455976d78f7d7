"""Which change makes two results equal: planted differences, and what is said of them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from fbs import direct_frf
from fbs.files.frf_files import write_frf
from mbs_models import load
from mbs_models.model.model_file import dumps
from tests.validation.command_line import call
from tests.validation.explanation.defects import (
    DRIVETRAIN,
    EXCITATIONS,
    GROSS,
    LINES,
    PARAMETERS,
    RESPONSES,
    SINGLE,
    answered,
    case_of,
    frfs_of,
    missed_defects,
    named,
    noisy,
    planted,
    said,
)
from validation.explanation.candidates import Case, slope_of, steps_of
from validation.explanation.describe import causes, recognised, verdict
from validation.explanation.evidence import FrfEvidence, Remainder
from validation.explanation.few_numbers import FrequencyEvidence, matched
from validation.explanation.fit import Change, Explanation, scanned
from validation.explanation.identifiability import identifiability, rank_of
from validation.explanation.plan import plan
from validation.explanation.reading import half_digit
from validation.explanation.run import run
from validation.explanation.search import Answer, explain
from validation.routes.equations import drivetrain_system
from validation.routes.source import exudyn_source
from validation.runtime.progress import silent

NOTHING = frfs_of(drivetrain_system(DRIVETRAIN))


# Residuals


def test_residuals_are_half_the_relative_error_where_it_is_small() -> None:
    case = case_of(NOTHING.with_values(1.002 * NOTHING.frf.values))
    errors = np.hypot(*case.residual.reshape(2, *NOTHING.frf.values.shape))
    # (1.002 − 1)/(1.002 + 1 + the floor's 0.01) where an FRF is alone on its line, less elsewhere
    assert errors.max() == pytest.approx(0.002 / 2.012, rel=5e-3)


def test_noise_is_no_structure_and_a_constant_factor_is() -> None:
    noise = case_of(noisy(NOTHING, 0.01, 3))
    remainder = noise.evidence.remainder(noise.residual)
    assert not remainder.structured
    # |e| of relative noise n is n/2 where the floor does not count
    assert remainder.noise == pytest.approx(0.005, rel=0.5)
    factor = case_of(noisy(NOTHING.with_values(1.01 * NOTHING.frf.values), 0.01, 3))
    assert factor.evidence.remainder(factor.residual).structured


def test_a_difference_in_one_frf_alone_is_structure() -> None:
    values = NOTHING.frf.values.copy()
    values[:, 2, 1] *= 1.01
    case = case_of(noisy(NOTHING.with_values(values), 0.001, 1))
    assert case.evidence.remainder(case.residual).structured


def test_garbage_is_structure_though_it_is_independent_from_line_to_line() -> None:
    rng = np.random.default_rng(5)
    noise = 1e-9 * (rng.normal(size=(400, 6, 2)) + 1j * rng.normal(size=(400, 6, 2)))
    one = NOTHING.frf.values.copy()
    one[:, 2, 1] = noise[:, 2, 1]
    for values in (noise.astype(complex), one.astype(complex)):
        case = case_of(NOTHING.with_values(values))
        assert case.evidence.remainder(case.residual).structured


def test_few_lines_tell_no_noise() -> None:
    frf = noisy(NOTHING, 0.02, 1).frf.band(1000.0, 1900.0)
    case = case_of(FrfEvidence(frf))
    assert len(frf.frequency) <= 50
    assert case.evidence.remainder(case.residual).structured


def test_a_difference_under_noise_that_resonances_hide_is_found() -> None:
    # lines 20 Hz apart: a resonance of 0.3 % damping is on one or two, which keep no phase
    evidence = noisy(planted({PARAMETERS["planetary.sun.mass"]: 0.05}), 0.05, 3)
    case = case_of(evidence)
    assert not case.evidence.remainder(case.residual).structured
    answer = answered(evidence)
    assert answer.settled
    assert {"planetary.sun.mass"} in named(answer)


def test_sensitivities_are_derivatives_of_the_residual() -> None:
    case = case_of(NOTHING)
    parameter = PARAMETERS["planetary.sun.mass"]
    _, systems, steps = steps_of(case, [parameter])
    found = case.evidence.sensitivities(case.system, systems, steps)[:, 0]
    step = 1e-6
    moved = [parameter.at(case, sign * step).residual for sign in (1.0, -1.0)]
    expected = (moved[0] - moved[1]) / (2.0 * step)
    # residuals have a round-off of 1e-10, over steps of 1e-6
    assert np.abs(found - expected).max() < 1e-4 * np.abs(expected).max()


def test_scans_by_woodbury_are_those_of_rebuilt_drivetrains() -> None:
    case = case_of(planted({PARAMETERS["planetary.planet.mass"]: 0.3})).thinned()
    parameter = PARAMETERS["planetary.planet.mass"]
    slope = slope_of(case, parameter)
    assert slope is not None
    assert slope.basis().shape[1] == 8  # u and v of four planets
    logs = np.array([-0.5, 0.1, 0.9])
    found = case.evidence.along(case.system, slope, np.expm1(logs))
    built = [np.mean(parameter.at(case, log).residual ** 2) for log in logs]
    assert found == pytest.approx(built, rel=1e-7)
    assert scanned(case, parameter)[1] == pytest.approx(0.3, abs=0.01)


def test_a_pressure_angle_has_no_slope() -> None:
    assert slope_of(case_of(NOTHING), PARAMETERS["planetary.pressure_angle"]) is None


# What is said


def test_nothing_is_said_where_there_is_no_difference() -> None:
    assert answered(NOTHING).agrees
    assert answered(noisy(NOTHING, 0.01, 2)).agrees


def test_a_changed_mass_is_found_to_its_digits() -> None:
    answer = answered(planted({PARAMETERS["planetary.sun.mass"]: np.log(1.05)}))
    assert answer.settled
    assert not answer.alike
    (change,) = answer.best.changes
    assert change.parameter.name == "planetary.sun.mass"
    assert change.value == pytest.approx(0.42, rel=1e-8)
    assert "0.42 instead of 0.4 (+5 %)" in " ".join(causes(answer.best))


def test_the_interval_under_noise_holds_the_value() -> None:
    asked = case_of(planted({PARAMETERS["planetary.sun.mass"]: np.log(1.05)}, 0.01, 7))
    from validation.explanation.plan import ExplanationPlan

    result = run(ExplanationPlan(asked, Path("t"), None, tuple(PARAMETERS.values())), silent)
    low, high = result.intervals["planetary.sun.mass"]
    # 2σ of a true value at 3σ at most: two intervals wide
    assert low - (high - low) < 0.42 < high + (high - low)
    assert high - low < 0.002
    assert result.checks[0].agrees


def test_parameters_that_look_alike_are_one_answer_with_the_frf_that_tells(tmp_path: Path) -> None:
    # k r² counts: a spring at another radius is a spring of another stiffness
    evidence = planted({PARAMETERS["coupling.second_stiffness"]: 0.1})
    answer = answered(evidence)
    assert {"coupling.radius"} in named(answer)
    assert {"coupling.second_stiffness"} in named(answer)


def test_a_foreign_cause_is_none_of_these() -> None:
    rng = np.random.default_rng(1)
    bent = 1.0 + 0.2 * np.sin(LINES / 300.0)[:, None, None] * rng.uniform(0.5, 1.0, (1, 6, 2))
    answer = answered(NOTHING.with_values(NOTHING.frf.values * bent))
    assert not answer.settled
    assert answer.explained < 0.9


def test_zero_sensitivity_is_cannot_tell() -> None:
    remainder = Remainder(0.0, 0.0, False, 1.0)
    told = identifiability(case_of(NOTHING).thinned(), SINGLE, remainder)
    names = {p.name for p in told.invisible}
    # a spur stage's axial and rocking motions, and radii without a coupling at them
    assert {"reducer.pinion.bearing_z", "reducer.wheel.diametral_inertia_over_r2"} <= names
    assert "planetary.planet.base_radius" in names
    assert "planetary.sun.mass" not in names
    assert answered(planted({PARAMETERS["reducer.pinion.bearing_z"]: 0.1})).agrees


def test_what_is_told_is_what_another_route_finds_by_differences() -> None:
    """exudyn's M, C, K by direct solution, central differences of ln p by 1e-3."""
    lines = LINES[::4]
    start = case_of(NOTHING)

    def frfs(case: Case) -> np.ndarray:
        system = exudyn_source(case.drivetrain).whole
        return direct_frf(system, lines, RESPONSES, EXCITATIONS).values

    base = np.abs(frfs(start))
    rows, others = (np.sqrt(np.sum(base**2, axis=axis, keepdims=True)) for axis in (2, 1))
    size = 2.0 * base + 0.01 * np.sqrt(rows * others)
    # What is zero by symmetry is round-off, 1e-15 of the others; what passes the coupling is 1e-5
    there = (base / base.max(axis=(1, 2), keepdims=True)).max(axis=0) > 1e-9
    columns = []
    for parameter in SINGLE:
        moved = [frfs(parameter.at(start, sign * 1e-3)) for sign in (1.0, -1.0)]
        slope = ((moved[0] - moved[1]) / 2e-3 / size)[:, there].ravel()
        columns.append(np.concatenate([slope.real, slope.imag]))
    slopes = np.column_stack(columns)
    sizes = np.linalg.norm(slopes, axis=0)
    told = identifiability(start, SINGLE, Remainder(0.0, 0.0, False, 1.0))
    # Round-off 1e-16 of a direct solution times its condition, over steps of 1e-3; the hub of
    # 45 mg shows 3e-8
    seen = sizes > 1e-7 * sizes.max()
    invisible = {p.name for p, shows in zip(SINGLE, seen, strict=True) if not shows}
    assert {p.name for p in told.invisible} == invisible
    directions = slopes[:, seen] / sizes[seen]
    singular = np.linalg.svd(directions, compute_uv=False)
    # Differences of steps h = 1e-3 are off by h²/6 of the third derivative, 1e-6
    assert told.rank == int(np.sum(singular > 1e-6 * singular[0]))
    # k r² counts, of the coupling's springs
    assert [{p.name for p in group} for group in told.alike] == [
        {"coupling.second_stiffness", "coupling.radius"}
    ]


def test_rank_counts_directions_that_can_be_told_apart() -> None:
    a, b = np.eye(3)[:, :2].T
    assert rank_of(np.column_stack([a, b, (a + b) / np.sqrt(2.0)])) == 2


@pytest.mark.parametrize("slip", ["accelerance in g", "conjugate", "swapped", "radians"])
def test_gross_causes_are_named(slip: str) -> None:
    _named_gross(slip)


@pytest.mark.slow
@pytest.mark.parametrize("slip", GROSS)
def test_every_gross_cause_is_named(slip: str) -> None:
    _named_gross(slip)


def _named_gross(slip: str) -> None:
    answer = answered(GROSS[slip].evidence())
    assert answer.settled
    assert any(GROSS[slip].words in words for words in said(answer)), said(answer)


def test_a_gross_cause_and_a_parameter_are_both_found() -> None:
    evidence = planted({PARAMETERS["planetary.sun.mass"]: 0.05})
    answer = answered(evidence.with_values(1e3 * evidence.frf.values))
    assert answer.settled
    assert "mm for m" in answer.best.gross[0]
    assert named(answer)[0] == {"planetary.sun.mass"}


def test_a_usual_factor_is_recognised() -> None:
    start = Explanation(case_of(NOTHING))
    parameter = PARAMETERS["planetary.sun.bearing"]
    assert "N/mm" in recognised(start, Change(parameter, np.log(1e3)))
    mass = PARAMETERS["planetary.sun.mass"]
    assert "planetary.planet.mass" in recognised(start, Change(mass, np.log(0.66 / 0.4)))


# Natural frequencies

# Lin & Parker 1999, Table 2, N = 4; the seed paper's Table 3 lists the same
TABLE_3 = """0
727.0(2) 1091.0(2) 1536.6 1808.2 1892.8(2) 1970.6 2342.5(2) 2625.7 5963.8 6981.7
7189.9(2) 7773.6 10437.6(2) 13071.1
"""


def from_list(text: str, model: str, stage: str | None, folder: Path) -> Answer:
    (folder / "list.txt").write_text(text)
    asked = plan(load(model), folder / "list.txt", stage=stage)
    return explain(asked.case, asked.candidates)


def test_table_3_is_not_of_table_2_but_of_lin_and_parker(tmp_path: Path) -> None:
    answer = from_list(TABLE_3, "paper-table2", "planetary", tmp_path)
    assert answer.settled
    assert any("planetary stage of the preset lin-parker-4" in words for words in said(answer))


@pytest.mark.parametrize("model", ["lin-parker-3", "lin-parker-5"])
def test_lin_and_parkers_sets_mixed_up(model: str, tmp_path: Path) -> None:
    answer = from_list(TABLE_3, model, None, tmp_path)
    assert answer.settled
    assert any("planetary has 4 planets" in words for words in said(answer))


def test_71_hz_is_a_hub_of_a_gear(tmp_path: Path) -> None:
    answer = from_list("71.07", "paper", "planetary", tmp_path)
    # the stage has half of the hub: 0.58 kg
    assert answer.best.gross[0].startswith("coupling.inertia_over_r2 is 1.16 instead of 4.48e-08")
    assert answer.alike  # one number says little, and that is said


def test_2202_hz_needs_another_rocking_inertia(tmp_path: Path) -> None:
    answer = from_list("0 1125.4(2) 1566.4 2202(2) 2105.4 3972.4", "paper", "reducer", tmp_path)
    assert answer.settled
    values = {
        c.parameter.paths[0]: c.value for e in (answer.best, *answer.alike) for c in e.changes
    }
    assert values["reducer.pinion.diametral_inertia_over_r2"] == pytest.approx(0.522, abs=5e-4)
    # or the rocking stiffness: 1/(2π)·√(k/0.58) = 2202 Hz
    assert values["reducer.pinion.bearing_rocking_over_r2"] == pytest.approx(1.110e8, rel=1e-3)


def test_frequencies_are_matched_in_order() -> None:
    ours = np.array([10.0, 11.0, 50.0, 100.0])
    assert matched(ours, np.array([10.9, 99.0])).tolist() == [1, 3]
    assert matched(ours, np.array([10.4, 10.6])).tolist() == [0, 1]


def test_damping_ratios_and_shapes_are_compared(tmp_path: Path) -> None:
    from fbs import real_modes

    modes = real_modes(drivetrain_system(DRIVETRAIN))
    chosen = [3, 6, 11]
    rows = ["frequency_hz,damping_ratio,planetary.sun.w,reducer.pinion.w"]
    index = [modes.dofs.index(x) for x in ("planetary.sun.w", "reducer.pinion.w")]
    for k in chosen:
        f = modes.natural_frequencies[k]
        # ζ = βω/2 of β = 2e-6, twice the model's
        shape = ",".join(f"{x:.8g}" for x in modes.shapes[index, k])
        rows.append(f"{f:.8g},{2e-6 * np.pi * f:.8g},{shape}")
    (tmp_path / "modes.csv").write_text("\n".join(rows))
    asked = plan(DRIVETRAIN, tmp_path / "modes.csv")
    assert isinstance(asked.case.evidence, FrequencyEvidence)
    answer = explain(asked.case, asked.candidates)
    assert answer.best.changes[0].parameter.name == "damping.stiffness_proportional"
    assert answer.best.changes[0].value == pytest.approx(2e-6, rel=1e-3)


def test_half_a_digit_is_that_of_the_last_one_printed() -> None:
    assert half_digit("1125.4") == pytest.approx(0.05)
    assert half_digit("2202") == 0.5
    assert half_digit("1.2e3") == pytest.approx(50.0)


# The command


@pytest.fixture
def model(tmp_path: Path) -> Path:
    path = tmp_path / "model.toml"
    path.write_text(dumps(DRIVETRAIN))
    return path


def test_the_command_writes_page_and_numbers(tmp_path: Path, model: Path) -> None:
    write_frf(planted({PARAMETERS["planetary.sun.mass"]: 0.05}, 0.01, 1).frf, tmp_path / "t.npz")
    out = tmp_path / "out"
    code = call(
        "explain", str(model), str(tmp_path / "t.npz"), "--only", "planetary.*", "--out", str(out)
    )
    assert code == 0
    document = json.loads((out / "explanation.json").read_text())
    assert document["best"]["changes"][0]["parameters"] == ["planetary.sun.mass"]
    page = (out / "explanation.html").read_text()
    assert "planetary.sun.mass is 0.42" in page
    assert page.count("<svg") >= 4  # before and after


def test_ours_from_a_file_stands_for_the_model(tmp_path: Path, model: Path) -> None:
    write_frf(planted({PARAMETERS["planetary.sun.mass"]: 0.05}).frf, tmp_path / "theirs.npz")
    own = planted({PARAMETERS["planetary.sun.mass"]: 0.05})
    write_frf(own.frf, tmp_path / "ours.npz")
    asked = plan(DRIVETRAIN, tmp_path / "theirs.npz", ours=tmp_path / "ours.npz")
    assert explain(asked.case, asked.candidates).agrees


@pytest.mark.parametrize("kind", ["npz", "mat", "mtx"])
def test_matrices_are_read_and_explained(kind: str, tmp_path: Path) -> None:
    from scipy.io import mmwrite, savemat

    start = case_of(NOTHING)
    system = PARAMETERS["planetary.ring.mass"].at(start, np.log(1.1)).system
    arrays = {"M": system.mass, "K": system.stiffness}
    path = tmp_path / f"theirs.{kind}"
    if kind == "npz":
        np.savez(path, M=system.mass, K=system.stiffness)
    elif kind == "mat":
        savemat(path, arrays)
    else:
        path.mkdir()
        for name, matrix in arrays.items():
            mmwrite(path / f"{name}.mtx", matrix, precision=17)
    asked = plan(DRIVETRAIN, path)
    answer = explain(asked.case, asked.candidates)
    (change,) = answer.best.changes
    assert change.parameter.name == "planetary.ring.mass"
    assert change.value == pytest.approx(2.585, rel=1e-6)


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("list.txt", "1125.4 -3", "a natural frequency must be 0 or more"),
        ("list.txt", "", "the file is empty"),
        ("list.txt", "0 0", "no natural frequency above 0 Hz"),
        ("modes.csv", "frequency,damping\n100,0.01,3\n", "the heading 2"),
        ("modes.csv", "frequency,damping\nabc,0.01\n", "is no natural frequency"),
        ("frfs.xyz", "1", "frfs.xyz"),
    ],
)
def test_bad_files_end_in_one_message(
    name: str, text: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / name).write_text(text)
    out = tmp_path / "out"
    assert call("explain", "paper", str(tmp_path / name), "--out", str(out)) == 2
    assert message in " ".join(capsys.readouterr().err.split())
    assert not out.exists()


def test_matrices_of_another_size_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    np.savez(tmp_path / "t.npz", M=np.eye(3), K=np.eye(3))
    assert call("explain", "paper", str(tmp_path / "t.npz"), "--out", str(tmp_path / "o")) == 2
    assert "mass is 3 × 3; must be 30 × 30" in " ".join(capsys.readouterr().err.split())


def test_an_unknown_pattern_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "l.txt").write_text("71.07")
    code = call(
        "explain", "paper", str(tmp_path / "l.txt"), "--only", "nothing.*", "--out", str(tmp_path)
    )
    assert code == 2
    assert "no parameter of 'Two-stage reducer' is like that" in " ".join(
        capsys.readouterr().err.split()
    )


# The numbers that must hold


@pytest.mark.slow
@pytest.mark.parametrize(
    ("causes", "count", "noise", "missed"),
    # At most so many missed: of 40 singles and 10 doubles (tests/benchmarks/explain_defects.py) 2
    # and 2 may be at no noise, 6 and 4 at 1 %; of the first quarter or third the same share,
    # rounded down
    [(1, 10, 0.0, 0), (2, 3, 0.0, 0), (1, 10, 0.01, 1), (2, 3, 0.01, 1)],
)
def test_planted_parameters_are_found(causes: int, count: int, noise: float, missed: int) -> None:
    wrong = missed_defects(causes, count, noise)
    assert len(wrong) <= missed, wrong


def test_verdicts_say_what_was_found() -> None:
    from validation.explanation.plan import ExplanationPlan

    asked = ExplanationPlan(case_of(NOTHING), Path("t"), None, SINGLE)
    assert verdict(run(asked, silent)).startswith("No difference beyond noise")


def test_frfs_of_a_stage_alone(tmp_path: Path) -> None:
    from validation.routes.equations import stage_system

    system = stage_system(DRIVETRAIN, "reducer")
    write_frf(
        direct_frf(system, LINES, ["reducer.pinion.w"], ["reducer.wheel.w"]), tmp_path / "r.npz"
    )
    asked = plan(DRIVETRAIN, tmp_path / "r.npz", stage="reducer")
    assert isinstance(asked.case, Case)
    assert isinstance(asked.case.evidence, FrfEvidence)
    assert explain(asked.case, asked.candidates).agrees
