"""New model files: whole, computable as they stand, and every wrong edit answered."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np
import pytest

from mbs_models import build_drivetrain
from mbs_models.errors import ModelError
from mbs_models.model import excitation_tables
from mbs_models.model.couplings import Coupling
from mbs_models.model.model_file import loads
from mbs_models.model.new_train import KINDS, new_train
from mbs_models.model.operation import Operation
from mbs_models.model.parameters import Damping, Inertia, ParallelStage, PlanetaryStage
from mbs_models.sanity.rules import findings
from mbs_models.stages.bodies import Carrier, ParallelGear, Planet, Ring, Sun, Table
from mbs_models.system.linearization import linearize

TRAIN = ("motor", "parallel", "planetary", "load")
TEXT = new_train(TRAIN, "gearbox.toml")
TABLES: dict[str, type[Table]] = {
    "[damping]": Damping,
    "[operation]": Operation,
    "[[inertia]] motor": Inertia,
    "[[stage]] parallel": ParallelStage,
    "[stage.pinion]": ParallelGear,
    "[stage.wheel]": ParallelGear,
    "[[stage]] planetary": PlanetaryStage,
    "[stage.sun]": Sun,
    "[stage.ring]": Ring,
    "[stage.carrier]": Carrier,
    "[stage.planet]": Planet,
    "[[coupling]] shaft1": Coupling,
    "[[excitation]] harmonic": excitation_tables.HarmonicTable,
    "[[excitation]] stepped-sine": excitation_tables.SteppedSineTable,
    "[[excitation]] sweep": excitation_tables.SweepTable,
    "[[excitation]] multisine": excitation_tables.MultisineTable,
    "[[excitation]] noise": excitation_tables.NoiseTable,
    "[[excitation]] impulse": excitation_tables.ImpulseTable,
    "[[excitation]] record": excitation_tables.RecordTable,
}
BODIES = ("pinion", "wheel", "sun", "ring", "carrier", "planet")  # tables of their own


def sections(text: str) -> dict[str, str]:
    """Header, with the table's name (excitation: type) where it has one, → lines to the next."""
    found = {}
    for part in re.split(r"(?m)^(?=\[)", text)[1:]:
        header = part[: part.index("]\n") if "]\n" in part[:40] else part.index("] ")] + "]"
        name = re.search(r'(?m)^name = "(.+?)"', part) or re.search(r'(?m)^type = "(.+?)"', part)
        found[f"{header} {name[1]}" if name and header.startswith("[[") else header] = part
    return found


def with_excitations(text: str) -> str:
    """The text with its examples of excitations as tables."""
    start = text.index("# [[excitation]]")
    return text[:start] + re.sub(r"(?m)^# ?", "", text[start:])


@pytest.mark.parametrize("header", TABLES)
def test_every_key_of_every_table_is_there(header: str) -> None:
    table, text = TABLES[header], sections(with_excitations(TEXT))[header]
    missing = [
        key
        for key in table.model_fields
        if key not in BODIES and not re.search(rf"\b{key} = ", text)
    ]
    if header.startswith("[[excitation]]") and "harmonic" not in header:
        missing.remove("moment") if "moment" in missing else None  # said of all at the first
    assert not missing


@pytest.mark.parametrize(
    "kinds",
    [
        *((kind,) for kind in ("parallel", "planetary")),
        *((kind, "load") for kind in KINDS if kind != "load"),
        TRAIN,
        ("generator", "parallel", "planetary", "planetary", "rotor"),
    ],
)
def test_a_new_train_is_sound_as_it_stands(kinds: tuple[str, ...]) -> None:
    drivetrain = loads(new_train(kinds, "gearbox.toml"))
    assert not drivetrain.warnings()
    assert not findings(drivetrain)
    assert [part.name.rstrip("0123456789") for part in drivetrain.stages] == [
        kind for kind in kinds if kind.startswith("p")
    ]
    assert len(drivetrain.couplings) == len(kinds) - 1
    assert len(drivetrain.groups()) == 1


def test_its_gears_are_what_their_comments_say() -> None:
    """Module 2.5 mm, 20°: r_b = m z cos α/2; steel discs of that radius."""
    drivetrain = loads(TEXT)
    for member in drivetrain.members.values():
        if member.teeth is not None:
            expected = 2.5e-3 * member.teeth * np.cos(np.radians(20.0)) / 2.0
            assert member.radius == pytest.approx(expected, rel=1e-4)
    parallel, planetary = (
        drivetrain.stages_of(ParallelStage)[0],
        drivetrain.stages_of(PlanetaryStage)[0],
    )
    for gear, width in (
        (parallel.pinion, 0.03), (parallel.wheel, 0.03), (planetary.sun, 0.035)
    ):  # fmt: skip
        pitch = gear.base_radius / np.cos(np.radians(20.0))
        mass = 7850.0 * np.pi * pitch**2 * width
        assert gear.mass == pytest.approx(mass, rel=0.01)
        assert gear.polar_inertia == pytest.approx(mass * pitch**2 / 2.0, rel=0.01)


def commented_keys() -> Iterator[tuple[str, str]]:
    for header, text in sections(TEXT[: TEXT.index("# What `crosscheck simulate`")]).items():
        for key in re.findall(r"(?m)^# (\w+) = ", text):
            if key != "dofs" or "shaft2" in header:  # motor and load have no translations
                yield header, key


@pytest.mark.parametrize(("header", "key"), list(commented_keys()))
def test_a_key_left_out_may_be_given(header: str, key: str) -> None:
    """Twins in the place of each other, which say the same: K and M hardly change."""
    start = TEXT.index(sections(TEXT)[header])
    end = start + len(sections(TEXT)[header])
    text = re.sub(rf"(?m)^# (?={key} = )", "", TEXT[start:end], count=1)
    if text.count(f"\n{key} = ") > 1:  # another form of a key that is there
        text = re.sub(rf"(?m)^{key} = .*\n", "", text, count=1)
    for _ in range(5):
        try:
            drivetrain = loads(TEXT[:start] + text + TEXT[end:])
        except ModelError as error:
            message = str(error)
            if missing := re.search(r"'(\w+)' is missing", message):
                text = re.sub(rf"(?m)^# (?={missing[1]} = )", "", text, count=1)
            else:
                given = re.search(r"both are there \((.*)\)$", message)
                assert given, message
                for other in re.findall(r"(\w+) = ", given[1]):
                    if other not in (key, key.replace("_u", "_v"), key.replace("_v", "_u")):
                        text = re.sub(rf"(?m)^{other} = .*\n", "", text, count=1)
        else:
            break
    ours, theirs = (linearize(build_drivetrain(d)) for d in (loads(TEXT), drivetrain))
    for name in ("mass", "stiffness"):
        a, b = (np.diag(getattr(d, name)) for d in (ours, theirs))
        slack = 0.5 if key in ("planet_bearing_tangential", "torsional_stiffness", "dofs") else 0.02
        loose = header.startswith("[[inertia]]") and key.startswith("torsional")  # it was free
        loose |= key in ("dofs", "planet_bearing_radial")
        assert loose or np.all(np.abs(a - b) <= slack * np.abs(a))


WRONG = [
    ("base_radius = 0.027017", "base_radius = 27.017", "is 27.017 m in mm?"),
    ("mass = 5.83", "mass = -5.83", "wheel.mass = -5.83: must be a number, greater than 0 (kg)"),
    ("teeth = 71", "teeth = 17", "wheel.teeth = 17: contradicts"),
    ("planets = 3 ", "planets = 9 ", "planets 1 and 2 overlap"),
    ("angle = 20.0                   # deg, of both", "angle = 200.0 #", "pressure_angle = 200.0"),
    ('first = "motor"', 'first = "moter"', "first = 'moter': not a body"),
    ("speed_range = [300.0, 3000.0]", "speed_range = [3000.0, 300.0]", "the second must be larger"),
    ("mesh_stiffness = 4.2e8", 'mesh_stiffness = "4.2e8"', "mesh_stiffness = \"4.2e8\""),
    ("inertia = 1.0e-3", "inertia = 0.0", "a hub between two springs needs an inertia"),
    ("torsional_stiffness = 1.0e7", "torsional_stifness = 1.0e7", "torsional_stiffness"),
]  # fmt: skip


@pytest.mark.parametrize(("right", "wrong", "said"), WRONG)
def test_a_wrong_edit_is_answered_in_one_sentence(right: str, wrong: str, said: str) -> None:
    assert right in TEXT
    with pytest.raises(ModelError) as caught:
        loads(TEXT.replace(right, wrong, 1), "gearbox.toml")
    message = str(caught.value)
    assert said in message
    assert "\n" not in message
    assert message.startswith("gearbox.toml: ")


@pytest.mark.parametrize(
    ("kinds", "said"),
    [
        (("motor", "planetry"), "'planetry': no part of that kind; did you mean 'planetary'?"),
        (("",), "'': no part of that kind"),
        (("motor",), "'motor' alone has no spring"),
        (("parallel",) * 51, "51 parts; 1 to 50 are possible"),
    ],
)
def test_a_train_that_cannot_be_is_refused(kinds: tuple[str, ...], said: str) -> None:
    with pytest.raises(ModelError, match=re.escape(said)):
        new_train(kinds, "x.toml")
