"""Gross causes in the other model: supports or parts that are not there, units, damping."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from fbs import SecondOrderSystem
from mbs_models.model.model_file import load, preset_names
from mbs_models.model.parameters import Drivetrain, Part
from mbs_models.stages.bodies import Table

from ..routes.model_parameters import changed, known_parameters, model_data, steps_to
from .candidates import Case
from .file_hypotheses import Hypothesis

LOG_LOSS = (math.log(1e-5), math.log(0.3))
SCANNED = 4.8  # ln of the largest change a parameter is scanned for
SUPPORTS = ("bearing", "support", "torsional_stiffness", "rocking")
SWAPPED = (
    ("sun_mesh_stiffness", "ring_mesh_stiffness", "sun's and ring's mesh stiffness"),
    ("pinion", "wheel", "pinion and wheel"),
)
PAIRS = (("bearing_y", "bearing_z"), ("bearing_u", "bearing_v"))


def on_model(kind: str, words: str, change: Callable[[Drivetrain], Drivetrain]) -> Hypothesis:
    """A hypothesis about the model behind the evidence."""
    return Hypothesis(kind, words, lambda c: replace(c, drivetrain=change(c.drivetrain)))


def on_values(kind: str, words: str, values: Mapping[str, Any]) -> Hypothesis:
    """Other values at some places of the model file."""

    def change(drivetrain: Drivetrain) -> Drivetrain:
        data = model_data(drivetrain)
        return changed(data, {steps_to(data, path): value for path, value in values.items()})

    return on_model(kind, words, change)


def model_hypotheses(case: Case) -> Iterator[Hypothesis]:
    """Every gross cause in the model that the evidence may be of."""
    drivetrain = case.drivetrain
    known = known_parameters(drivetrain)
    yield from _missing(drivetrain, known)
    yield from _reduced(drivetrain, known)
    yield from _angles(drivetrain)
    yield from _couplings(drivetrain)
    yield from _planets(drivetrain)
    yield from _exchanged(drivetrain, known)
    yield from _of_others(known)
    yield from _of_presets(drivetrain)
    yield from _damping(drivetrain)


def _missing(drivetrain: Drivetrain, known: Mapping[str, object]) -> Iterator[Hypothesis]:
    for path, value in known.items():
        key = path.rpartition(".")[2]
        if isinstance(value, float) and value > 0.0 and any(word in key for word in SUPPORTS):
            yield on_values("support", f"the support {path} is missing", {path: 0.0})
        if key in ("mesh_stiffness", "sun_mesh_stiffness", "ring_mesh_stiffness"):
            yield on_values("support", f"the mesh {path} is missing", {path: 0.0})
    for part in drivetrain.parts:
        name = part.name
        supports = {
            path: 0.0
            for path, value in known.items()
            if path.startswith(f"{name}.") and isinstance(value, float) and value > 0.0
            and any(word in path.rpartition(".")[2] for word in SUPPORTS)
        }  # fmt: skip
        if len(supports) > 1:
            yield on_values("support", f"all supports of {name} are missing", supports)


def _reduced(drivetrain: Drivetrain, known: Mapping[str, object]) -> Iterator[Hypothesis]:
    """Moments of inertia and rotary stiffnesses with r² once too often, or too rarely."""
    for words, key_word in (("inertias", "inertia"), ("rotary stiffnesses", "rocking|torsional")):
        for owner in ("", *(f"{part.name}." for part in drivetrain.parts)):
            for sign, text in (
                (2.0, "I or k taken for I/r² or k/r²"),
                (-2.0, "divided by r² twice"),
            ):
                values = {
                    path: value * radius**sign
                    for path, value in known.items()
                    if path.startswith(owner) and isinstance(value, float) and value > 0.0
                    and any(word in path.rpartition(".")[2] for word in key_word.split("|"))
                    and (radius := _radius(drivetrain, path)) is not None
                }  # fmt: skip
                whose = f"of {owner[:-1]}" if owner else "everywhere"
                if values:
                    yield on_values("r²", f"{words} {whose}: {text}", values)


def _radius(drivetrain: Drivetrain, path: str) -> float | None:
    """Of the body, inertia or coupling that a path belongs to."""
    owner = path.rpartition(".")[0]
    for coupling in drivetrain.couplings:
        if coupling.name == owner:
            return float(coupling.radius)
    member = drivetrain.members.get(owner) or drivetrain.members.get(f"{owner}1")
    return None if member is None else member.radius


def _angles(drivetrain: Drivetrain) -> Iterator[Hypothesis]:
    """Angles in the wrong unit or sense; values that no file may have."""
    keys = ("helix_angle", "pressure_angle", "sun_pressure_angle", "ring_pressure_angle")
    for stage in drivetrain.stages:
        for key in keys:
            value = getattr(stage, key, None)
            if not value:
                continue
            for words, new in (
                (f"{stage.name}.{key} in degrees was taken as radians", math.degrees(value)),
                (f"{stage.name}.{key} in radians was taken as degrees", math.radians(value)),
                (f"{stage.name}.{key} has the other sign (other flanks, other hand)", -value),
                (f"sine and cosine of {stage.name}.{key} are exchanged", 90.0 - value),
            ):
                yield on_model("angle", words, _with_key(stage.name, key, new))


def _with_key(stage: str, key: str, value: float) -> Callable[[Drivetrain], Drivetrain]:
    """A stage with a value that is not asked whether it may be."""

    def change(drivetrain: Drivetrain) -> Drivetrain:
        return _with_stage(drivetrain, stage, lambda part: part.model_copy(update={key: value}))

    return change


def _with_stage(drivetrain: Drivetrain, name: str, change: Callable[[Part], Part]) -> Drivetrain:
    stages = tuple(change(s) if s.name == name else s for s in drivetrain.stages)
    return drivetrain.model_copy(update={"stages": stages})


def _couplings(drivetrain: Drivetrain) -> Iterator[Hypothesis]:
    for coupling in drivetrain.couplings:
        name = coupling.name
        yield on_model("part", f"{name} is missing: nothing passes through it", _opened(name))
        for key in ("first_stiffness", "second_stiffness"):
            if coupling.__dict__[key] != "rigid":
                yield on_values("part", f"{name}.{key} is rigid", {f"{name}.{key}": "rigid"})
        for key in ("inertia", "inertia_over_r2"):
            value = coupling.__dict__[key]
            if value:
                yield on_values(
                    "part", f"the hub of {name} counts half", {f"{name}.{key}": value / 2}
                )
                yield on_values(
                    "part", f"the hub of {name} counts twice", {f"{name}.{key}": 2 * value}
                )


def _opened(name: str) -> Callable[[Drivetrain], Drivetrain]:
    """No torque passes: its springs are 0."""

    def change(drivetrain: Drivetrain) -> Drivetrain:
        couplings = tuple(
            c.model_copy(update={"first_stiffness": 0.0, "second_stiffness": 0.0, "dofs": {}})
            if c.name == name
            else c
            for c in drivetrain.couplings
        )
        return drivetrain.model_copy(update={"couplings": couplings})

    return change


def _planets(drivetrain: Drivetrain) -> Iterator[Hypothesis]:
    for stage in drivetrain.stages:
        n = getattr(stage, "planets", None)
        if not isinstance(n, int):
            continue
        for count in (n - 1, n + 1):
            words = f"{stage.name} has {count} planets, not {n}"
            yield on_values("part", words, {f"{stage.name}.planets": count})
        for words, offset in ((f"half a pitch, {180.0 / n:g}°", 180.0 / n), ("90°", 90.0)):
            angles = tuple(360.0 * k / n + offset for k in range(n))
            update: dict[str, Any] = {"planets": None, "planet_angles": angles}
            yield on_model(
                "angle",
                f"planets of {stage.name} are turned by {words}",
                _updated(stage.name, update),
            )


def _updated(stage: str, update: Mapping[str, Any]) -> Callable[[Drivetrain], Drivetrain]:
    return lambda d: _with_stage(d, stage, lambda part: part.model_copy(update=update))


def _exchanged(drivetrain: Drivetrain, known: Mapping[str, object]) -> Iterator[Hypothesis]:
    for stage in drivetrain.stages:
        for first, second, words in SWAPPED:
            values = stage.__dict__.get(first), stage.__dict__.get(second)
            if None not in values and values[0] != values[1]:
                yield on_model(
                    "exchanged", f"{words} of {stage.name} are exchanged",
                    _updated(stage.name, {first: values[1], second: values[0]}),
                )  # fmt: skip
    for path, value in known.items():
        owner, _, key = path.rpartition(".")
        for first, second in PAIRS:
            other = known.get(f"{owner}.{second}")
            if key == first and other is not None and other != value:
                yield on_values(
                    "exchanged", f"{first} and {second} of {owner} are exchanged",
                    {path: other, f"{owner}.{second}": value},
                )  # fmt: skip


def _of_others(known: Mapping[str, object]) -> Iterator[Hypothesis]:
    """Inertias and stiffnesses that have another's value, further off than the scan goes."""
    numbers = {p: v for p, v in known.items() if isinstance(v, float) and v > 0.0 and _kind(p)}
    for path, value in numbers.items():
        for other, new in {v: p for p, v in numbers.items() if _kind(p) == _kind(path)}.items():
            if abs(math.log(other / value)) > SCANNED:
                words = f"{path} is {other:g} instead of {value:g}, as {new} is"
                yield on_values("value", words, {path: other})


def _kind(path: str) -> str:
    """What may be mistaken for what."""
    key = path.rpartition(".")[2]
    if key == "mass" or key.endswith("inertia_over_r2"):
        return "inertia"
    return "stiffness" if key.endswith(("stiffness", "bearing", "support")) else ""


def _of_presets(drivetrain: Drivetrain) -> Iterator[Hypothesis]:
    """A stage that is another drivetrain's of the presets."""
    for preset in preset_names():
        for stage in load(preset).stages:
            for own in drivetrain.stages:
                named = stage.model_copy(update={"name": own.name})
                if type(stage) is type(own) and not _same(named, own):
                    words = f"{own.name} is the {stage.name} stage of the preset {preset}"
                    yield on_model("set", words, _replaced(own.name, named))


def _same(first: Table, second: Table) -> bool:
    return first.model_dump(exclude_none=True) == second.model_dump(exclude_none=True)


def _replaced(name: str, stage: Part) -> Callable[[Drivetrain], Drivetrain]:
    return lambda d: _with_stage(d, name, lambda _: stage)


def _damping(drivetrain: Drivetrain) -> Iterator[Hypothesis]:
    beta, alpha = drivetrain.damping.stiffness_proportional, drivetrain.damping.mass_proportional
    if beta or alpha:
        nothing = {"damping.stiffness_proportional": 0.0, "damping.mass_proportional": 0.0}
        yield on_values("damping", "there is no damping", nothing)
    yield Hypothesis("damping", "damping is hysteretic, not viscous", _best_hysteretic)


def _best_hysteretic(case: Case) -> Case:
    """With the loss factor that leaves least."""

    def power(log: float) -> float:
        return float(np.mean(_hysteretic(case, math.exp(log)).residual ** 2))

    found = minimize_scalar(power, bounds=LOG_LOSS, method="bounded", options={"xatol": 1e-6})
    return _hysteretic(case, math.exp(float(found.x)))


def _hysteretic(case: Case, loss: float) -> Case:
    def built(drivetrain: Drivetrain) -> SecondOrderSystem:
        system = case.build(drivetrain)
        return replace(system, damping=0.0 * system.damping, loss_factor=loss)

    return replace(case, build=built)
