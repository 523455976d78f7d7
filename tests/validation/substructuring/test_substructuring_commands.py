"""`crosscheck couple`, `decouple`, `identify`: the paper's stages, joined and taken apart."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fbs import FbsError, Frf, Joint, couple, direct_frf, frequency_axis, read_frf, write_frf
from fbs.joint_identification import Spring
from fbs.measured.uncertainty import Scatter, coupled_uncertainty
from fbs.transfer_paths import Spectra, source_forces
from mbs_models.model.model_file import load, template
from tests.fbs.fbs_systems import scaled_error
from tests.strategies import damped
from tests.validation.command_line import call
from validation import equations_source
from validation.substructuring.doubts import contradict, scattered
from validation.substructuring.inputs import RIGID, Part
from validation.substructuring.run import DecouplingOptions, run_couple, run_decouple

LINES = frequency_axis(20.0, 3000.0, 20.0)
HUB = "coupling.w"
K_SW = 1e6  # N/m, the paper's


@pytest.fixture(scope="module")
def stages() -> dict[str, Frf]:
    """The paper's stages with their halves of the hub, and the whole."""
    source = equations_source(damped(load("paper")))
    asked = {
        "reducer": (HUB, "reducer.pinion.w", "reducer.wheel.y"),
        "planetary": (HUB, "planetary.sun.w", "planetary.ring.w"),
    }
    found = {
        name: direct_frf(source.stage(name), LINES, labels, labels)
        for name, labels in asked.items()
    }
    every = tuple(dict.fromkeys(label for labels in asked.values() for label in labels))
    return found | {"whole": direct_frf(source.whole, LINES, every, every)}


@pytest.fixture
def files(stages: dict[str, Frf], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name, frf in stages.items():
        write_frf(frf, tmp_path / f"{name}.npz")
    return tmp_path


def read(path: Path) -> Frf:
    return read_frf(path).frf


def document(path: Path) -> Any:
    return json.loads(path.read_text(encoding="utf-8"))


def test_the_papers_stages_coupled_are_the_whole(files: Path, stages: dict[str, Frf]) -> None:
    assert (
        call(
            *["couple", "reducer.npz", "planetary.npz", "--at", "coupling.w", "--output", "ab.npz"]
        )
        == 0
    )
    found, whole = read(files / "ab.npz"), stages["whole"]
    assert scaled_error(found.select(whole.responses, whole.excitations), whole.values).max() < 1e-9
    numbers = document(files / "crosscheck-couple" / "couple.json")
    assert numbers["verdict"] == "Coupled at 1 DoF: every line drawn has a digit"
    assert numbers["at"] == [[HUB, HUB]]
    assert len(numbers["condition"]) == LINES.size


def test_a_stage_that_was_never_measured_comes_out(files: Path, stages: dict[str, Frf]) -> None:
    for known, unknown in (("planetary", "reducer"), ("reducer", "planetary")):
        line = f"decouple whole.npz {known}.npz --at coupling.w --output part.npz --out out"
        assert call(*line.split()) == 0
        found, part = read(files / "part.npz"), stages[unknown]
        assert set(found.responses) == set(part.responses)
        assert (
            scaled_error(found.select(part.responses, part.excitations), part.values).max() < 1e-6
        )


def loose(stages: dict[str, Frf], rng: Any = None) -> dict[str, Frf]:
    """The stages' halves of the hub under names of their own, joined by k_sw."""
    a = stages["reducer"].renamed({HUB: "a"})
    b = stages["planetary"].renamed({HUB: "b"})
    joined = couple({"A": a, "B": b}, [Joint(("A", "a"), ("B", "b"), K_SW)]).frf
    found = {"AB": joined, "A": a, "B": b}
    if rng is None:
        return found
    return {name: noisy(frf, 0.01, rng) for name, frf in found.items()}


def noisy(frf: Frf, relative: float, rng: np.random.Generator) -> Frf:
    shape = frf.values.shape
    error = (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2.0)
    return Frf(frf.frequency, frf.values * (1 + relative * error), frf.responses, frf.excitations)


@pytest.mark.parametrize(("noise", "within"), [(False, 1e-7), (True, 0.01)])
def test_k_sw_comes_back(files: Path, stages: dict[str, Frf], noise: bool, within: float) -> None:
    """Exact without noise; within 1 % at 1 % noise, and within its interval."""
    rng = np.random.default_rng(6) if noise else None
    for name, frf in loose(stages, rng).items():
        write_frf(frf, files / f"{name}.csv")
    line = "identify AB.csv A.csv B.csv --at a=b --output joint.csv"
    assert call(*line.split(), *(["--noise", "1%"] if noise else [])) == 0
    numbers = document(files / "crosscheck-identify" / "identify.json")
    for spring in numbers["springs"]:
        assert spring["stiffness_told"]
        assert abs(spring["stiffness"] / K_SW - 1.0) < within
        if noise:  # three times: 95 % intervals of two forms that share their data
            assert abs(spring["stiffness"] - K_SW) < 1.5 * spring["stiffness_interval"]
    # what was found joins them again
    assert (
        call(
            *[
                "couple",
                "A.csv",
                "B.csv",
                "--at",
                "a=b",
                "--joint",
                "joint.csv",
                "--output",
                "again.npz",
            ]
        )
        == 0
    )
    again, exact = read(files / "again.npz"), loose(stages)["AB"]
    error = scaled_error(again.select(exact.responses, exact.excitations), exact.values)
    assert np.median(error) < (0.1 if noise else 1e-8)


def test_what_noise_does_not_tell_is_said_first(files: Path, stages: dict[str, Frf]) -> None:
    """A hub a thousand times stiffer than what it joins hardly shows."""
    parts = loose(stages)
    stiff = couple({"A": parts["A"], "B": parts["B"]}, [Joint(("A", "a"), ("B", "b"), 1e13)]).frf
    rng = np.random.default_rng(2)
    for name, frf in {**parts, "AB": stiff}.items():
        write_frf(noisy(frf, 0.01, rng), files / f"{name}.npz")
    line = "identify AB.npz A.npz B.npz --at a=b --noise 1%"
    assert call(*line.split()) == 0
    verdict = document(files / "crosscheck-identify" / "identify.json")["verdict"]
    assert verdict.startswith("The data do not tell the stiffness")


def test_noise_is_never_taken_for_digits(files: Path, stages: dict[str, Frf]) -> None:
    """Without --noise the lines' own scatter makes the interval."""
    rng = np.random.default_rng(4)
    for name, frf in loose(stages, rng).items():
        write_frf(frf, files / f"{name}.npz")
    line = "identify AB.npz A.npz B.npz --at a=b"
    assert call(*line.split()) == 0
    (direct, _) = document(files / "crosscheck-identify" / "identify.json")["springs"]
    assert 1e-5 * K_SW < direct["stiffness_interval"] < 0.05 * K_SW


def test_one_map_serves_all_files(files: Path, stages: dict[str, Frf]) -> None:
    rows = {"reducer": ("11.x", "12.x", "13.x"), "planetary": ("21.x", "22.x", "23.x")}
    for name, nodes in rows.items():
        frf = stages[name]
        write_frf(frf.renamed(dict(zip(frf.responses, nodes, strict=True))), files / f"{name}.npz")
    (files / "map.toml").write_text('[map]\n"a.hub" = "11.x"\n"b.hub" = "21.x"\n"b.sun" = "22.x"\n')
    line = "couple reducer.npz planetary.npz --at a.hub=b.hub --map map.toml --output ab.npz"
    assert call(*line.split()) == 0
    found = read(files / "ab.npz")
    assert found.responses == ("a.hub", "b.hub", "b.sun")
    whole = stages["whole"]
    assert scaled_error(
        found.select(["b.sun"], ["b.sun"]),
        whole.select(["planetary.sun.w"], ["planetary.sun.w"]).values,
    ).max() < 1e-8  # fmt: skip


BAD = [
    ("couple reducer.npz planetary.npz", "--at is missing"),
    ("couple reducer.npz planetary.npz --at hub", r"--at: reducer.npz (A) has no response 'hub'"),
    ("couple reducer.npz planetary.npz --at coupling.w=sun",
     "--at: planetary.npz (B) has no response 'sun'"),
    ("couple reducer.npz planetary.npz --at coupling.w,coupling.w", "more than once"),
    ("couple reducer.npz planetary.npz --at =x", "--at = '=x'"),
    ("couple reducer.npz short.npz --at coupling.w",
     "short.npz: its lines are not those of reducer.npz"),
    ("couple reducer.npz none.npz --at coupling.w", "none.npz: cannot be read"),
    ("couple reducer.npz planetary.npz --at coupling.w --joint stiff", "--joint = 'stiff'"),
    ("couple reducer.npz planetary.npz --at coupling.w --joint none.csv", "--joint = none.csv"),
    ("couple reducer.npz planetary.npz --at coupling.w --joint 1,2,3", "give k or k,c"),
    ("couple reducer.npz planetary.npz --at coupling.w --noise 200%", "--noise = '200%'"),
    ("couple reducer.npz planetary.npz --at coupling.w --output ab.xyz", "--output = ab.xyz"),
    ("decouple whole.npz heavy.npz --at coupling.w", "stiffer than the assembly at coupling.w"),
    ("decouple whole.npz whole.npz --at coupling.w", "singular to working precision"),
    ("decouple whole.npz planetary.npz --at coupling.w --form other", "--form = 'other'"),
    ("decouple whole.npz planetary.npz --at coupling.w --rank 2", "rank = 2"),
    ("decouple twin.npz twinned.npz --at coupling.w,twin", "singular to working precision"),
    ("identify whole.npz reducer.npz planetary.npz --at coupling.w", "under two names"),
    ("couple reducer.npz planetary.npz --at q --map q=1.x", "of no DoF in the map"),
    ("identify whole.npz reducer.npz planetary.npz --at coupling.w=sun",
     "planetary.npz (B) has no response 'sun'"),
    ("identify whole.npz reducer.npz planetary.npz --at coupling.w --output z.npz",
     "a joint is written as .csv"),
]  # fmt: skip


@pytest.mark.parametrize(("line", "words"), BAD)
def test_bad_input_is_one_message(
    files: Path, stages: dict[str, Frf], line: str, words: str, capfd: Any
) -> None:
    planetary, whole = stages["planetary"], stages["whole"]
    write_frf(planetary.band(100.0, 2000.0), files / "short.npz")
    # twice the stiffness of whatever the stage has: a tenth of its receptance at the hub
    stiff = couple(
        {"A": planetary, "B": wall()}, [Joint(("A", HUB), ("B", "wall"), 5e10)]
    ).frf.select(planetary.responses, planetary.excitations)
    write_frf(stiff, files / "heavy.npz")
    write_frf(doubled(whole), files / "twin.npz")
    write_frf(doubled(planetary), files / "twinned.npz")
    for command in ("couple", "decouple", "identify"):
        (files / f"crosscheck-{command}").mkdir()
        (files / f"crosscheck-{command}" / f"{command}.html").write_text("earlier")
    assert call(*line.split()) == 2
    error = capfd.readouterr().err
    assert words in error
    assert len(error.strip().splitlines()) == 1
    command = line.split()[0]
    assert (files / f"crosscheck-{command}" / f"{command}.html").read_text() == "earlier"
    assert not list(files.glob("crosscheck-*/*.json"))


def wall() -> Frf:
    """A mass too heavy to move."""
    return Frf(LINES, -1.0 / (1e15 * (2 * np.pi * LINES) ** 2)[:, None, None], ("wall",), ("wall",))


def doubled(frf: Frf) -> Frf:
    """With the hub's motion twice, under another name: a rank-deficient interface."""
    k = frf.responses.index(HUB)
    rows = (*range(len(frf.responses)), k)
    labels = (*frf.responses, "twin")
    return Frf(LINES, frf.values[:, rows][:, :, rows], labels, labels)


def test_a_gears_excitation_is_one_blocked_force_whatever_it_drives(tmp_path: Path) -> None:
    """The mesh's force pair in the reducer, as a force at the hub: the same for 3, 4, 5 planets."""
    found = []
    reducer = equations_source(damped(load("paper"))).stage("reducer")
    mesh = ("reducer.pinion.w", "reducer.wheel.w")
    source = direct_frf(reducer, LINES, (HUB, *mesh), (HUB, *mesh))
    unit = np.array([1.0, -1.0]) * 1e3  # N: what the mesh's transmission error makes, both ways
    for planets in (3, 4, 5):
        model = tmp_path / f"{planets}.toml"
        model.write_text(template("paper").replace("planets = 4 ", f"planets = {planets} "))
        receiver = equations_source(damped(load(str(model)))).stage("planetary")
        assert f"planetary.planet{planets}.w" in receiver.dofs
        assert f"planetary.planet{planets + 1}.w" not in receiver.dofs
        other = direct_frf(receiver, LINES, (HUB, "planetary.sun.w"), (HUB, "planetary.sun.w"))
        whole = couple({"A": source, "B": other}, [Joint(("A", HUB), ("B", HUB))]).frf
        heard = ("planetary.sun.w",)
        motion = whole.select(heard, mesh).values @ unit
        forces = source_forces(whole.select(heard, (HUB,)), Spectra(LINES, motion, heard))
        found.append(forces.spectra.values)
    first, *others = found
    assert all(np.abs(one - first).max() < 1e-9 * np.abs(first).max() for one in others)


OVERWRITING = [
    "couple reducer.npz planetary.npz --at coupling.w --output planetary.npz",
    "decouple whole.npz planetary.npz --at coupling.w --output ./whole.npz",
    "identify AB.csv A.csv B.csv --at a=b --output B.csv",
]


@pytest.mark.parametrize("line", OVERWRITING)
def test_a_file_that_is_read_is_never_written_over(
    files: Path, stages: dict[str, Frf], line: str, capfd: Any
) -> None:
    for name, frf in loose(stages).items():
        write_frf(frf, files / f"{name}.csv")
    target = files / line.split()[-1]
    before = target.read_bytes()
    assert call(*line.split()) == 2
    assert "which is read and would be lost" in capfd.readouterr().err
    assert target.read_bytes() == before


def test_a_known_part_that_is_not_in_the_assembly_is_doubted(
    files: Path, stages: dict[str, Frf], capfd: Any
) -> None:
    """By what is left, which is not passive, and by how the part's inside moves with its hub."""
    own = stages["planetary"]
    loss = Frf(LINES, own.values * (1.0 - 0.3j), own.responses, own.excitations)  # more damped
    write_frf(loss, files / "damped.npz")
    line = "decouple whole.npz {}.npz --at coupling.w"
    assert call(*line.format("damped").split()) == 0
    verdict = document(files / "crosscheck-decouple" / "decouple.json")["verdict"]
    assert verdict.startswith("Decoupled, in doubt,")
    assert "no passive, reciprocal structure" in capfd.readouterr().err
    # as stiff at the hub, but another inside
    values = np.array(own.values)
    values[:, own.responses.index("planetary.sun.w")] *= 1.3
    write_frf(Frf(LINES, values, own.responses, own.excitations), files / "other.npz")
    assert call(*line.format("other").split()) == 0
    assert "not in the assembly as it is alone: at planetary.sun.w" in capfd.readouterr().err
    # what is there is not doubted, with noise either
    rng = np.random.default_rng(8)
    for name in ("whole", "planetary"):
        write_frf(noisy(stages[name], 1e-3, rng), files / f"noisy_{name}.npz")
    noisy_line = "decouple noisy_whole.npz noisy_planetary.npz --at coupling.w --noise 0.1%"
    for command in (line.format("planetary"), noisy_line):
        assert call(*command.split()) == 0
        assert "in the assembly as it is alone" not in capfd.readouterr().err


def test_a_regularised_result_says_that_its_bias_is_not_known(files: Path) -> None:
    line = "decouple whole.npz planetary.npz --at coupling.w --tikhonov 0.1"
    assert call(*line.split()) == 0
    assert any(
        "What regularising takes away" in told
        for told in document(files / "crosscheck-decouple" / "decouple.json")["conclusions"]
    )


@pytest.mark.parametrize("joint", ["1e6,-10", "1e6-1e4j"])
def test_a_joint_that_puts_energy_in_is_said(files: Path, joint: str, capfd: Any) -> None:
    line = f"couple reducer.npz planetary.npz --at coupling.w --joint {joint}"
    assert call(*line.split()) == 0
    told = " ".join(capfd.readouterr().err.split())
    assert f"its damping is negative at {LINES.size} of {LINES.size} lines" in told


def test_labels_that_both_files_have_are_named_once(
    files: Path, stages: dict[str, Frf], capfd: Any
) -> None:
    assert (
        call(*["couple", "reducer.npz", "reducer.npz", "--at", "coupling.w", "--joint", "0"]) == 2
    )
    assert "joint A.coupling.w - B.coupling.w:" in capfd.readouterr().err


def test_another_part_contradicts_what_the_assembly_says_alone(
    files: Path, stages: dict[str, Frf], capfd: Any
) -> None:
    """Of B measured too small by half the direct form is wrong, in situ not; and that is said."""
    parts = loose(stages, np.random.default_rng(9))
    b = parts["B"]
    parts["B"] = Frf(LINES, 0.5 * b.values, b.responses, b.excitations)
    for name, frf in parts.items():
        write_frf(frf, files / f"{name}.npz")
    assert call(*["identify", "AB.npz", "A.npz", "B.npz", "--at", "a=b", "--noise", "1%"]) == 0
    numbers = document(files / "crosscheck-identify" / "identify.json")
    assert numbers["verdict"].startswith("Not told: the direct and the in-situ form contradict")
    assert "A or B is not what the assembly is made of" in numbers["warnings"][0]
    _, in_situ = numbers["springs"]
    assert in_situ["stiffness_told"]
    assert abs(in_situ["stiffness"] / K_SW - 1.0) < 0.01


def test_two_intervals_with_nothing_in_common_contradict() -> None:
    assert contradict(Spring(1.0, 0.0, 0.1, 1.0, 1.0), Spring(1.3, 0.0, 0.1, 1.0, 1.0))
    assert not contradict(Spring(1.0, 0.0, 0.1, 1.0, 1.0), Spring(1.15, 0.0, 0.1, 1.0, 1.0))
    assert not contradict(Spring(1.0, 0.0, 0.0, 1.0, 1.0), Spring(1.0 + 1e-9, 0.0, 0.0, 1.0, 1.0))


def test_few_runs_make_wider_bands_than_a_known_noise(stages: dict[str, Frf]) -> None:
    """Student: of two runs the radius of 95 % is 8.2 times that of a variance that is known."""
    rng = np.random.default_rng(10)
    runs = tuple(noisy(stages["planetary"], 0.01, rng) for _ in range(2))
    labels = runs[0].responses
    mean = Frf(LINES, (runs[0].values + runs[1].values) / 2.0, labels, labels)
    part = Part("B", Path("b.uff"), mean, (), (), runs)
    parts = {"A": Part("A", Path("a.uff"), stages["reducer"], (), ()), "B": part}
    result, _ = run_couple(parts, ((HUB, HUB),), RIGID, None)
    scatter = Scatter.of_repeats(runs)
    joints = [Joint(("A", HUB), ("B", HUB))]
    frfs = {"A": stages["reducer"], "B": mean}
    known = coupled_uncertainty(frfs, joints, "B", scatter, (HUB,), (HUB,)).variance[:, 0, 0]
    factor = np.sqrt(0.5 * np.expm1(2.0 * -np.log(0.05)))  # of F(2, 1), to the modulus
    np.testing.assert_allclose(result.curves[0].error, factor * np.sqrt(known), rtol=1e-12)
    # decoupling does not carry it, and says so
    assert "the scatter of its runs" in scattered({"B": part})[0]


def test_a_known_part_that_is_too_stiff_is_refused_regularised_too(
    stages: dict[str, Frf],
) -> None:
    planetary = stages["planetary"]
    heavy = couple({"A": planetary, "B": wall()}, [Joint(("A", HUB), ("B", "wall"), 5e10)])
    known = heavy.frf.select(planetary.responses, planetary.excitations)
    parts = {
        "AB": Part("AB", Path("ab"), stages["whole"], (), ()),
        "A": Part("A", Path("a"), known, (), ()),
    }
    for options in (DecouplingOptions(tikhonov=1e-3), DecouplingOptions(rank=1)):
        with pytest.raises(FbsError, match="stiffer than the assembly"):
            run_decouple(parts, ((HUB, HUB),), options, None)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("--at coupling.w --internal x", "--internal: whole.npz (AB) has no response 'x'"),
        ("--at coupling.w --internal coupling.w", "--internal: coupling.w is in --at too"),
        ("--at coupling.w=planetary.sun.w", "it has another DoF of that name"),
    ],
)
def test_labels_that_do_not_fit_are_told_with_their_file(
    files: Path, line: str, words: str, capfd: Any
) -> None:
    assert call(*f"decouple whole.npz planetary.npz {line}".split()) == 2
    assert words in capfd.readouterr().err


def test_a_file_that_is_no_passive_structure_is_in_the_verdict(
    files: Path, stages: dict[str, Frf], capfd: Any
) -> None:
    """Of e^{-jωt}, a sensor turned round or a gain: it has all its digits, and is wrong."""
    own = stages["planetary"]
    write_frf(Frf(LINES, own.values.conj(), own.responses, own.excitations), files / "turned.npz")
    assert call(*["couple", "reducer.npz", "turned.npz", "--at", "coupling.w"]) == 0
    verdict = document(files / "crosscheck-couple" / "couple.json")["verdict"]
    assert verdict.endswith("; B in doubt for quality")
    assert "turned.npz: " in capfd.readouterr().err
