"""The command line's excitations: the tables they stand for, defaults, and what is refused."""

from __future__ import annotations

import pytest

from mbs_models.model.excitation import excitation_of
from mbs_models.model.model_file import load
from validation.errors import CommandError
from validation.simulation.excitation_spec import DEFAULTS, parse_excitation

FORMS = [
    (
        "sweep@reducer.pinion.w:fmin=20,fmax=2e3,amplitude=1.5,duration=5,law=logarithmic",
        {"dof": "reducer.pinion.w", "fmin": 20.0, "fmax": 2000.0, "amplitude": 1.5,
         "duration": 5.0, "law": "logarithmic"},
    ),
    (
        "multisine@planetary.sun.u:fmin=10,fmax=4000,df=1,amplitude=0.1",
        {"dof": "planetary.sun.u", "fmin": 10.0, "fmax": 4000.0, "df": 1.0, "amplitude": 0.1},
    ),
    ("noise @ planetary.sun.u : fmax = 300", {"fmin": 10.0, "fmax": 300.0, "amplitude": 1.0}),
    ("noise@planetary.sun.w:moment=2", {"moment": 2.0, "amplitude": None}),
    (
        "stepped-sine@planetary.sun.u:frequencies=[10, 20,40],dwell=1",
        {"frequencies": (10.0, 20.0, 40.0), "dwell": 1.0, "fmin": None, "periods": None},
    ),
    ("impulse@planetary.sun.u:contact_time=1e-3", {"contact_time": 1e-3, "fmax": None}),
    ("record@planetary.sun.u:file=12,scale=3", {"file": "12", "scale": 3.0}),
]  # fmt: skip


@pytest.mark.parametrize(("text", "expected"), FORMS)
def test_keys(text: str, expected: dict[str, object]) -> None:
    table = parse_excitation(text)
    assert {key: getattr(table, key) for key in expected} == expected
    assert table.type == text.partition("@")[0].strip()


@pytest.mark.parametrize("kind", [kind for kind in DEFAULTS if kind not in ("harmonic", "record")])
def test_a_bare_word_excites_from_10_hz_to_4_khz(kind: str) -> None:
    signal = excitation_of(load("paper"), parse_excitation(f"{kind}@planetary.sun.u")).signal
    # the impulse's band ends at its first zero, 1.5 times where it is 9.5 dB down
    assert signal.band == pytest.approx((0.0, 6000.0) if kind == "impulse" else (10.0, 4000.0))


BAD = [
    ("noise", "must be TYPE@DOF"),
    ("noise@", "must be TYPE@DOF"),
    ("@planetary.sun.u", "must be TYPE@DOF"),
    ("", "must be TYPE@DOF"),
    ("nois@planetary.sun.u", 'type = "nois": must be "harmonic" or "impulse" or "multisine"'),
    ("harmonic@planetary.sun.u", "frequency: missing; must be a number, greater than 0 (Hz)"),
    ("record@planetary.sun.u", "file: missing; must be text"),
    ("noise@planetary.sun.u:fmin", "'fmin' is no key=value"),
    ("noise@planetary.sun.u:fmin=", "'fmin=' is no key=value"),
    ("noise@planetary.sun.u:fmin=1,", "'' is no key=value"),
    ("noise@planetary.sun.u:fmin=1,fmin=2", "fmin: is given twice"),
    ("noise@planetary.sun.u:dof=a", "dof: stands before the colon already"),
    ("noise@planetary.sun.u:fmn=1", "fmn = 1: unknown key; did you mean 'fmin'?"),
    ("noise@planetary.sun.u:fmin=ten", 'fmin = "ten": must be a number, greater than 0 (Hz)'),
    ("noise@planetary.sun.u:fmin=-3", "fmin = -3: must be a number, greater than 0 (Hz)"),
    ("noise@planetary.sun.u:fmin=nan", "fmin = nan: must be a number, greater than 0 (Hz)"),
    ("noise@planetary.sun.u:fmin=5e3", "fmin = 5000.0: must be less than fmax = 4000.0 (Hz)"),
    ("noise@planetary.sun.u:amplitude=0", "amplitude = 0: must be a number, greater than 0 (N)"),
    ("noise@planetary.sun.u:amplitude=1,moment=2", "exactly one of 'amplitude' or 'moment'"),
    ("noise@planetary.sun.u:moment=2", "planetary.sun.u is a translation"),
    ("stepped-sine@a.u:frequencies=[1,b]", 'frequencies[1] = "b": must be a number'),
    ("noise@a.u:seed=1.5", "seed = 1.5: must be a whole number, at least 0"),
]


@pytest.mark.parametrize(("text", "words"), BAD)
def test_what_is_refused(text: str, words: str) -> None:
    with pytest.raises(CommandError) as caught:
        parse_excitation(text)
    message = str(caught.value)
    assert message.startswith(f"--excitation {text}: ")
    assert words in message
    assert "\n" not in message
