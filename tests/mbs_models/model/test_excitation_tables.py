"""[[excitation]] tables: to signals, to files and back, and what is wrong with them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mbs_models.errors import ModelError
from mbs_models.model.excitation import Excitation, check_record, excitation_of, excitations_of
from mbs_models.model.excitation_tables import Setting
from mbs_models.model.model_file import (
    dumps,
    excitation_table,
    folder_of,
    load,
    loads,
    preset_names,
    template,
)
from mbs_models.model.parameters import Drivetrain
from mbs_models.signals.lines import BandNoise, Harmonic, Multisine, schroeder_multisine
from mbs_models.signals.sines import HalfSine, SteppedSine, Sweep
from mbs_models.system.drivetrain import build_drivetrain
from mbs_models.system.linearization import linearize

PAPER = template("paper")
BAND = "fmin = 10.0\nfmax = 4000.0\n"
SUN = 'dof = "planetary.sun.u"\namplitude = 2.0\n'
TABLES = {
    "harmonic": SUN + "frequency = 50.0\nphase = 90.0\n",
    "stepped-sine": SUN + "fmin = 10.0\nfmax = 12.0\ndf = 0.5\nperiods = 10\nramp = 0.1\n",
    "sweep": SUN + BAND + 'duration = 5.0\nlaw = "logarithmic"\ndirection = "down"\ntaper = 0.1\n',
    "multisine": SUN + BAND + 'df = 1.0\nphases = "random"\nseed = 4\n',
    "noise": SUN + BAND + "period = 3.0\nseed = 5\n",
    "impulse": SUN + "contact_time = 0.001\nstart = 0.2\n",
    "record": 'dof = "planetary.sun.u"\nfile = "force.csv"\nscale = 2.0\n',
}


def excited(*tables: str) -> Drivetrain:
    return loads(PAPER + "".join(f"\n[[excitation]]\n{table}" for table in tables))


def table(kind: str) -> str:
    return f'type = "{kind}"\n{TABLES[kind]}'


@pytest.mark.parametrize("preset", preset_names())
def test_dofs_are_those_of_the_multibody_system(preset: str) -> None:
    drivetrain = load(preset)
    built = linearize(build_drivetrain(drivetrain))
    assert set(drivetrain.dof_radii()) == set(built.labels)


def test_tables_become_signals(tmp_path: Path) -> None:
    (tmp_path / "force.csv").write_text("0.0,1.0\n0.1,2.0\n0.2,0.5\n")
    found = excitations_of(excited(*map(table, TABLES)), folder=tmp_path)
    harmonic, stepped, sweep, multisine, noise, impulse, record = (e.signal for e in found)
    assert {excitation.dof for excitation in found} == {"planetary.sun.u"}
    assert harmonic == Harmonic(2.0, 50.0, np.pi / 2.0)
    assert isinstance(stepped, SteppedSine)
    assert stepped.frequencies == (10.0, 10.5, 11.0, 11.5, 12.0)
    assert stepped.dwells == pytest.approx(tuple(10.0 / f for f in stepped.frequencies))
    assert sweep == Sweep(10.0, 4000.0, 5.0, 2.0, logarithmic=True, down=True, taper=0.1)
    assert isinstance(multisine, Multisine)
    assert (multisine.period, len(multisine.harmonics)) == (1.0, 3991)
    assert noise == BandNoise(10.0, 4000.0, 2.0, 3.0, 5)
    assert impulse == HalfSine(2.0, 0.001, 0.2)
    np.testing.assert_allclose(record.values(np.array([0.0, 0.1, 0.2])), [2.0, 4.0, 1.0])


def test_tables_are_written_as_they_were_read() -> None:
    drivetrain = excited(*map(table, TABLES))
    assert loads(dumps(drivetrain)) == drivetrain
    assert dumps(loads(dumps(drivetrain))) == dumps(drivetrain)
    assert dumps(drivetrain).count("[[excitation]]") == len(TABLES)


def test_the_example_of_a_new_file_loads() -> None:
    """What a new model file shows commented out works when the signs are taken away."""
    start = PAPER.index("# [[excitation]]")
    shown = [line.removeprefix("# ") for line in PAPER[start:].splitlines()]
    (found,) = excitations_of(loads("\n".join([PAPER[:start], *shown])))
    assert found.dof == "planetary.sun.u"


def test_a_moment_is_the_force_at_the_radius() -> None:
    moment = 'type = "harmonic"\ndof = "{}"\nmoment = 3.0\nfrequency = 5.0\n'
    drivetrain = excited(
        *(moment.format(dof) for dof in ("reducer.pinion.rho", "planetary.planet2.w", "coupling.w"))
    )
    amplitudes = [e.signal.values(np.zeros(1))[0] for e in excitations_of(drivetrain)]
    np.testing.assert_allclose(amplitudes, [3.0 / 0.0387, 3.0 / 0.0502, 3.0 / 0.0387], rtol=1e-14)


def test_a_record_of_moments(tmp_path: Path) -> None:
    (tmp_path / "torque.csv").write_text("0,1\n1,2\n")
    record = 'type = "record"\ndof = "planetary.sun.w"\nfile = "torque.csv"\nunit = "N m"\n'
    (found,) = excitations_of(excited(record), folder=tmp_path)
    np.testing.assert_allclose(found.signal.values(np.array([1.0])), [2.0 / 0.0387], rtol=1e-12)


def test_where_paths_start(tmp_path: Path) -> None:
    assert folder_of("paper") == Path()
    assert folder_of(tmp_path / "gear.toml") == tmp_path


def test_noise_of_several_inputs_is_uncorrelated() -> None:
    """The mean product of two independent ones scatters by 1/√(2BT)."""
    noise = 'type = "noise"\ndof = "planetary.sun.{}"\namplitude = 1.0\n' + BAND
    drivetrain = excited(noise.format("u"), noise.format("v"))
    first, second = (e.signal for e in excitations_of(drivetrain, duration=5.0))
    assert (first.period, second.period) == (5.0, 5.0)
    time = np.arange(50_000) / 10_000.0
    mean = np.mean(first.values(time) * second.values(time))
    assert abs(mean) < 6.0 / np.sqrt(2.0 * 3990.0 * 5.0)
    again = excitations_of(drivetrain, duration=5.0)
    assert [e.signal for e in again] == [first, second]
    assert excitations_of(drivetrain, duration=5.0, seed=1)[0].signal != first


def harmonics_of(excitation: Excitation[Any]) -> np.ndarray:
    assert isinstance(excitation.signal, Multisine)
    return excitation.signal.harmonics


def test_multisines_at_once_share_their_lines() -> None:
    sines = [f'type = "multisine"\ndof = "planetary.sun.{d}"\namplitude = 1.0\ndf = 1.0\n' + BAND
             for d in "uvw"]  # fmt: skip
    lines = [set(harmonics_of(e).tolist()) for e in excitations_of(excited(*sines))]
    assert set.union(*lines) == set(range(10, 4001))
    assert sum(map(len, lines)) == 3991
    together = [sine + 'lines = "all"\n' for sine in sines]
    assert all(len(harmonics_of(e)) == 3991 for e in excitations_of(excited(*together)))


def test_multisine_is_fitted_to_the_record() -> None:
    drivetrain = excited(SUN + 'type = "multisine"\ndf = 1.0\n' + BAND)
    (found,) = excitations_of(drivetrain, duration=10.5, sampling_frequency=25_000.0)
    assert found.signal.period == pytest.approx(1.05, rel=1e-14)
    with pytest.raises(ModelError, match=r"df = 1 Hz: a record of 0\.5 s is shorter"):
        excitations_of(drivetrain, duration=0.5)


BAD = [
    (table("noise").replace("sun.u", "sun.y"), "excitation[0]: dof = 'planetary.sun.y': not a DoF"),
    (table("noise").replace('"noise"', '"nois"'), 'type = "nois": must be "harmonic" or '),
    (table("noise").replace("= 2.0", "= 0.0"), "excitation[0]: amplitude = 0.0: must be a number"),
    (table("noise").replace("= 10.0", "= -1"), "fmin = -1: must be a number, greater than 0 (Hz)"),
    (table("noise").replace("= 4000.0", "= 5.0"), "fmin = 10.0: must be less than fmax = 5.0"),
    (table("noise").replace("= 4000.0", "= inf"), "fmax = inf: must be a number, greater than 0"),
    (table("noise") + "moment = 1.0\n", "exactly one of 'amplitude' or 'moment'; both"),
    (table("noise").replace("amplitude", "moment"), "planetary.sun.u is a translation"),
    (table("noise").replace("amplitude = 2.0", ""), "exactly one of 'amplitude' or 'moment'; nei"),
    (table("noise") + "fmux = 1.0\n", "fmux = 1.0: unknown key; did you mean 'fmax'?"),
    (table("sweep").replace('"down"', '"left"'), 'direction = "left": must be "up" or "down"'),
    (table("multisine").replace('"random"', '"schroeder"'), "seed = 4: has no effect"),
    (table("stepped-sine") + "dwell = 1.0\n", "exactly one of 'dwell' or 'periods'; both"),
    (table("stepped-sine").replace("df = 0.5", "df = 1e-9"), "makes more than 100000 steps"),
    (table("stepped-sine").replace("df = 0.5", ""), "'df' is missing"),
    (table("impulse") + "fmax = 100.0\n", "exactly one of 'contact_time' or 'fmax'; both"),
    (table("record") + 'unit = "N m"\n', 'unit = "N m": planetary.sun.u is a translation'),
    (table("record").replace("= 2.0", "= 0.0"), "scale = 0.0: leaves nothing"),
]


@pytest.mark.parametrize(("text", "words"), BAD)
def test_tables_that_are_none(text: str, words: str) -> None:
    with pytest.raises(ModelError) as caught:
        excited(text)
    assert words in str(caught.value)
    assert str(caught.value).startswith("<string>: excitation[0]: ")
    assert "\n" not in str(caught.value)


def test_what_shows_only_when_it_is_built(tmp_path: Path) -> None:
    drivetrain = load("paper")
    unknown = excitation_table(
        {"type": "harmonic", "dof": "planetary.sun.x", "amplitude": 1.0, "frequency": 5.0}
    )
    with pytest.raises(ModelError, match=r"excitation at planetary\.sun\.x: dof = .*allowed: red"):
        excitation_of(drivetrain, unknown)
    record = excitation_table({"type": "record", "dof": "planetary.sun.u", "file": "none.csv"})
    with pytest.raises(ModelError, match=r"sun\.u: record .*none\.csv: cannot be read"):
        excitation_of(drivetrain, record, Setting(folder=tmp_path))


def test_records_that_cannot_show_an_excitation() -> None:
    one = Excitation("planetary.sun.u", schroeder_multisine(10.0, 4000.0, 1.0, 1.0))
    check_record(one, duration=1.0, sampling_frequency=8001.0)
    with pytest.raises(ModelError, match="reaches 4000 Hz; must be below the Nyquist frequency"):
        check_record(one, duration=1.0, sampling_frequency=8000.0)
    with pytest.raises(ModelError, match=r"a record of 0\.5 s is shorter than one period of 1 s"):
        check_record(one, duration=0.5, sampling_frequency=10_000.0)
