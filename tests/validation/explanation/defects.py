"""Planted differences: what another code's or a rig's result would look like."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fbs import Frf, SecondOrderSystem, synthesize
from mbs_models import load
from mbs_models.model.parameters import Drivetrain
from validation.explanation.candidates import Case, Parameter, parameters
from validation.explanation.describe import causes
from validation.explanation.evidence import FrfEvidence, Remainder
from validation.explanation.identifiability import identifiability
from validation.explanation.search import Answer, explain
from validation.routes.equations import drivetrain_system
from validation.routes.model_parameters import changed, known_parameters, model_data, steps_to

Array = NDArray[Any]

LINES = np.linspace(200.0, 8000.0, 400)  # Hz
# 8 of the 36 labels, less than a quarter; 12 FRFs of 1296
RESPONSES = (
    "reducer.pinion.w", "reducer.wheel.y", "planetary.sun.u", "planetary.sun.w",
    "planetary.planet1.v", "planetary.carrier.w",
)  # fmt: skip
EXCITATIONS = ("reducer.pinion.w", "planetary.sun.u")


def with_values(drivetrain: Drivetrain, values: Mapping[str, object]) -> Drivetrain:
    """A drivetrain with other numbers, by their paths."""
    data = model_data(drivetrain)
    return changed(data, {steps_to(data, p): v for p, v in values.items()})  # type: ignore[misc]


def damped_paper() -> Drivetrain:
    """The paper's drivetrain with 0.3 % of damping at 1 kHz."""
    return with_values(load("paper"), {"damping.stiffness_proportional": 1e-6})


DRIVETRAIN = damped_paper()
PARAMETERS = {p.name: p for p in parameters(DRIVETRAIN)}
SINGLE = tuple(p for p in PARAMETERS.values() if len(p.paths) == 1 and not p.unit)


def frfs_of(system: SecondOrderSystem) -> FrfEvidence:
    """The measured FRFs of a system."""
    return FrfEvidence(synthesize(system, LINES, RESPONSES, EXCITATIONS).frf)


def noisy(evidence: FrfEvidence, noise: float, seed: int) -> FrfEvidence:
    """With complex Gaussian noise of a share of each value."""
    rng = np.random.default_rng(seed)
    values = evidence.frf.values
    errors = rng.normal(size=values.shape) + 1j * rng.normal(size=values.shape)
    return evidence.with_values(values * (1.0 + noise * errors / np.sqrt(2.0)))


def case_of(evidence: FrfEvidence) -> Case:
    """The model as it is, against evidence."""
    return Case(DRIVETRAIN, drivetrain_system, evidence)


def planted(changes: Mapping[Parameter, float], noise: float = 0.0, seed: int = 0) -> FrfEvidence:
    """FRFs of the drivetrain with parameters changed by ln(p/p₀)."""
    case = Case(DRIVETRAIN, drivetrain_system, frfs_of(drivetrain_system(DRIVETRAIN)))
    for parameter, log in changes.items():
        case = parameter.at(case, log)
    evidence = frfs_of(case.system)
    return noisy(evidence, noise, seed) if noise else evidence


def answered(evidence: FrfEvidence) -> Answer:
    """What is said of FRFs."""
    return explain(case_of(evidence))


def said(answer: Answer) -> list[str]:
    """Every cause that is said, the best and those like it."""
    return [word for each in (answer.best, *answer.alike) for word in causes(each)]


def named(answer: Answer) -> list[set[str]]:
    """The parameters of the best explanation, and of each like it."""
    return [{c.parameter.name for c in e.changes} for e in (answer.best, *answer.alike)]


def samples(count: int, number: int) -> list[dict[Parameter, float]]:
    """Seeded defects of so many parameters, each 3 to 10 % off; fewer are the first of more."""
    rng = np.random.default_rng(17)
    found = []
    for _ in range(count):
        chosen = rng.choice(len(SINGLE), number, replace=False)
        sizes = rng.uniform(0.03, 0.1, number) * rng.choice([-1.0, 1.0], number)
        found.append({SINGLE[k]: float(x) for k, x in zip(chosen, sizes, strict=True)})
    return found


def visible_at(noise: float) -> set[str]:
    """Parameters of which 2 % shows."""
    remainder = Remainder(0.0, noise / 2.0, False, 1.0)
    case = case_of(frfs_of(drivetrain_system(DRIVETRAIN)))
    told = identifiability(case, SINGLE, remainder)
    return {v.parameter.name for v in told.visible if v.smallest_change < 0.02}


def missed_defects(number: int, count: int, noise: float) -> list[tuple[set[str], list[str]]]:
    """What was planted and what is said, where that is not right.

    Right is what was planted, as far as it shows, among what these data cannot tell from it; and
    "no difference" where nothing of it shows.
    """
    visible, wrong = visible_at(noise), []
    for seed, changes in enumerate(samples(count, number)):
        answer = answered(planted(changes, noise, seed))
        true = {p.name for p in changes}
        seen = true & visible
        right = answer.settled and seen in named(answer) if seen else answer.agrees
        if not right:
            wrong.append((true, said(answer) if answer.settled else ["none of these"]))
    return wrong


@dataclass(frozen=True)
class Gross:
    """A slip, and a word of what must be said of it."""

    words: str
    evidence: Callable[[], FrfEvidence]


def _as_is() -> FrfEvidence:
    return frfs_of(drivetrain_system(DRIVETRAIN))


def _values(change: Callable[[Array, Array], Array]) -> Callable[[], FrfEvidence]:
    """FRFs, changed; the second argument is jω, of their shape."""
    omega = (2j * np.pi * LINES)[:, None, None]
    return lambda: _as_is().with_values(change(_as_is().frf.values, omega))


def _model(values: Mapping[str, object]) -> Callable[[], FrfEvidence]:
    return lambda: frfs_of(drivetrain_system(with_values(DRIVETRAIN, values)))


def _stage(name: str, update: Mapping[str, object]) -> Callable[[], FrfEvidence]:
    stages = tuple(s.model_copy(update=update) if s.name == name else s for s in DRIVETRAIN.stages)
    return lambda: frfs_of(drivetrain_system(DRIVETRAIN.model_copy(update={"stages": stages})))


def _radii(labels: tuple[str, ...]) -> NDArray[np.float64]:
    known = DRIVETRAIN.dof_radii()
    return np.array([known[label] or 1.0 for label in labels])


def _rotating(labels: tuple[str, ...]) -> NDArray[np.bool_]:
    return np.array([label.endswith(".w") for label in labels])


def _relabelled(names: Mapping[str, str]) -> Callable[[], FrfEvidence]:
    """The same values, called otherwise; the FRFs are first computed between the new ones."""

    def evidence() -> FrfEvidence:
        own = _as_is().frf
        back = {v: k for k, v in names.items()}
        true = [back.get(x, x) for x in own.responses], [back.get(x, x) for x in own.excitations]
        values = synthesize(drivetrain_system(DRIVETRAIN), LINES, *true).frf.values
        return FrfEvidence(Frf(LINES, values, own.responses, own.excitations))

    return evidence


def _hysteretic() -> FrfEvidence:
    system = drivetrain_system(DRIVETRAIN)
    return frfs_of(replace(system, damping=0.0 * system.damping, loss_factor=0.013))


def _inertias_with_r2() -> FrfEvidence:
    values: dict[str, object] = {
        path: value * DRIVETRAIN.radius(path.rpartition(".")[0]) ** 2
        for path, value in known_parameters(DRIVETRAIN).items()
        if path.startswith("reducer.") and "inertia" in path and isinstance(value, float)
    }
    return _model(values)()


SUN, CARRIER = "planetary.sun.w", "planetary.carrier.w"
ROWS, COLUMNS = _radii(RESPONSES), _radii(EXCITATIONS)
DEGREES = np.where(_rotating(RESPONSES), 180.0 / np.pi, 1.0)
SIGNS = np.where(_rotating(RESPONSES), -1.0, 1.0), np.where(_rotating(EXCITATIONS), -1.0, 1.0)
SUN_REVERSED = np.where(np.array(RESPONSES) == "planetary.sun.u", -1.0, 1.0)

GROSS = {
    "mm": Gross("mm for m", _values(lambda h, s: 1e3 * h)),
    "µm": Gross("µm for m", _values(lambda h, s: 1e6 * h)),
    "inch": Gross("inches for m", _values(lambda h, s: h / 25.4e-3)),
    "lbf": Gross("lbf for N", _values(lambda h, s: 4.4482216 * h)),
    "2π": Gross("2π too much", _values(lambda h, s: 2.0 * np.pi * h)),
    "twice": Gross("two-sided", _values(lambda h, s: 2.0 * h)),
    "RMS": Gross("RMS for peak", _values(lambda h, s: np.sqrt(2.0) * h)),
    "mobility": Gross("mobility given as receptance", _values(lambda h, s: s * h)),
    "accelerance": Gross("accelerance given as receptance", _values(lambda h, s: s**2 * h)),
    "accelerance in g": Gross("g for m/s²", _values(lambda h, s: s**2 * h / 9.80665)),
    "conjugate": Gross("e^{−jωt}", _values(lambda h, s: h.conj())),
    "sign": Gross(
        "planetary.sun.u has the wrong sign", _values(lambda h, s: h * SUN_REVERSED[:, None])
    ),
    "rotations": Gross(
        "all rotations count the other way", _values(lambda h, s: h * np.outer(*SIGNS))
    ),
    "rad/s": Gross("in rad/s", lambda: _as_is().with_lines(2.0 * np.pi * LINES)),
    "angles": Gross("r = 1 was used", _values(lambda h, s: h / np.outer(ROWS, COLUMNS))),
    "rad": Gross("responses of rotations are in rad", _values(lambda h, s: h / ROWS[:, None])),
    "degrees": Gross(
        "responses of rotations are in degrees",
        _values(lambda h, s: h / ROWS[:, None] * DEGREES[:, None]),
    ),
    "swapped": Gross(
        "swapped",
        _relabelled(
            {"planetary.sun.w": "planetary.carrier.w", "planetary.carrier.w": "planetary.sun.w"}
        ),
    ),
    "planets shifted": Gross(
        "planetary.planet1.v is planetary.planet2.v",
        _relabelled({"planetary.planet2.v": "planetary.planet1.v"}),
    ),
    "support": Gross(
        "the support planetary.sun.bearing is missing", _model({"planetary.sun.bearing": 0.0})
    ),
    "coupling": Gross(
        "coupling is missing",
        _model({"coupling.first_stiffness": 0.0, "coupling.second_stiffness": 0.0}),
    ),
    "rigid": Gross("second_stiffness is rigid", _model({"coupling.second_stiffness": "rigid"})),
    "five planets": Gross("5 planets, not 4", _model({"planetary.planets": 5})),
    "radians": Gross(
        "in degrees was taken as radians", _stage("planetary", {"pressure_angle": np.degrees(24.6)})
    ),
    "hysteretic": Gross("hysteretic", _hysteretic),
    "r²": Gross("inertias of reducer: I or k taken for I/r²", _inertias_with_r2),
    "preset": Gross(
        "of the preset paper-table2",
        lambda: frfs_of(
            drivetrain_system(
                DRIVETRAIN.model_copy(
                    update={"stages": (DRIVETRAIN.stages[0], load("paper-table2").stages[1])}
                )
            )
        ),
    ),
}
