"""One sample of a sweep after the other, computed from what the last ones left.

A varied coupling spring costs one interface solve: H = H₀ − H₀ b (bᵀH₀b + 1/z)⁻¹ bᵀH₀ couples a
joint z = (k − k₀)(1 + jωβ) across the spring, whose deflection is bᵀq, to FRFs H₀ computed with
k₀ in its place. k₀ is within a factor of 32 of k, so that no more than two digits are lost. H₀
itself is coupled from the FRFs of the parts, each computed anew only if something in it changes.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from fbs import Frf, SecondOrderSystem, couple, direct_frf, real_modes
from fbs.errors import FbsError, SingularLineError, unknown_dof
from mbs_models.errors import ModelError
from mbs_models.mode_kinds import StageStiffness, classify
from mbs_models.parameters import Coupling, Drivetrain
from mbs_models.placement import facings, turning

from .errors import CommandError
from .modes import damped_modes
from .routes import EQUATIONS, Source, coupling_joints, exudyn_source
from .sweep_parameters import Step, Values, changed, steps_to
from .sweep_task import Outcome, Task, base_values, blank

FloatArray = NDArray[np.float64]
T = TypeVar("T")

BASES, PARTS = 2, 24  # FRFs remembered: samples come sorted by what they share


def evaluate(task: Task, samples: Sequence[Values]) -> Outcome:
    """Compute some samples here; one that fails says why in its status."""
    bench, outcome = _bench(task), blank(task, len(samples))
    status = list(outcome.status)
    for i, values in enumerate(samples):
        try:
            sample = bench.sample(values)
            if task.n_modes:
                found, kinds = bench.modes(sample)
                n = min(task.n_modes, len(found))
                outcome.frequency_hz[i, :n], outcome.kind[i, :n] = found[:n], kinds[:n]
            if task.response:
                np.abs(bench.frf(sample), out=outcome.magnitude[i])
        except (CommandError, ModelError, FbsError) as error:
            status[i] = " ".join(str(error).split())
            outcome.frequency_hz[i], outcome.kind[i] = np.nan, ""
    return replace(outcome, status=np.array(status))


@dataclass(frozen=True, eq=False)
class Sample:
    """A sample's drivetrain, its base, and how much stiffer each varied spring is there (N/m)."""

    drivetrain: Drivetrain
    base: Base
    stiffer: Values


@dataclass(frozen=True, eq=False)
class Base:
    """What samples share that differ in coupling springs only.

    Attributes
    ----------
    drivetrain
        With the varied springs at their references.
    springs
        Deflection of each varied spring: label → coefficient.
    """

    drivetrain: Drivetrain
    springs: tuple[dict[str, float], ...]

    @property
    def beta(self) -> float:
        """Damping of a spring per stiffness (s)."""
        return self.drivetrain.damping.stiffness_proportional


class Bench:
    """Computes samples of a task and remembers what the next one shares."""

    def __init__(self, task: Task) -> None:
        self.task = task
        self.data: dict[str, Any] = json.loads(task.model)
        self.places = [steps_to(self.data, path) for path in task.paths]
        self.source: Source = EQUATIONS if task.route == "equations" else exudyn_source()
        self.frequency = task.band.frequency()
        self._bases: dict[Values, Base] = {}
        self._frfs: dict[Base, NDArray[Any]] = {}
        self._parts: dict[tuple[str, ...], Frf | None] = {}
        self._systems: dict[Base, SecondOrderSystem] = {}
        self._stiffness: dict[Base, dict[str, StageStiffness]] = {}

    def sample(self, values: Values) -> Sample:
        """Validate a sample and find its base."""
        drivetrain = self._drivetrain(values)
        shared = base_values(self.task, values)
        base = _remembered(self._bases, shared, lambda: self._base(shared), BASES)
        stiffer = tuple(
            value - of_base
            for value, of_base, anchor in zip(values, shared, self.task.anchors, strict=True)
            if anchor is not None
        )
        return Sample(drivetrain, base, stiffer)

    def _drivetrain(self, values: Values) -> Drivetrain:
        given: dict[tuple[Step, ...], float] = dict(zip(self.places, values, strict=True))
        return changed(self.data, given)

    def _base(self, values: Values) -> Base:
        drivetrain = self._drivetrain(values)
        paths = zip(self.task.paths, self.task.anchors, strict=True)
        varied = [path.split(".") for path, anchor in paths if anchor is not None]
        return Base(drivetrain, tuple(spring_deflection(drivetrain, *path) for path in varied))

    def frf(self, sample: Sample) -> NDArray[Any]:
        """H of the FRF asked for: the sample's springs joined to the base, one after the other."""
        base = sample.base
        h = _remembered(self._frfs, base, lambda: self._base_frf(base), BASES)
        omega = 2.0 * np.pi * self.frequency
        for k in reversed(range(len(sample.stiffer))):
            z: Any = sample.stiffer[k]
            if base.beta:
                z = z * (1.0 + 1j * omega * base.beta)
            # the last row and column are this spring's; they are not needed any more
            flexibility = z / (1.0 + z * h[-1, -1])
            h = h[:-1, :-1] - h[:-1, -1:] * (flexibility * h[-1:, :-1])
        values: NDArray[Any] = h[0, 0]
        if not np.isfinite(values).all():
            raise FbsError("the FRF is infinite: a line lies on an undamped pole")
        return values

    def _base_frf(self, base: Base) -> NDArray[Any]:
        """(1 + m, 1 + m, n_frequency): response and deflections, excitation and spring forces."""
        assert self.task.response is not None
        assert self.task.excitation is not None
        left = ({self.task.response: 1.0}, *base.springs)
        right = ({self.task.excitation: 1.0}, *base.springs)
        frf = self._between(base, {label for row in (*left, *right) for label in row})
        rows, columns = _coefficients(left, frf.responses), _coefficients(right, frf.excitations)
        h = np.einsum("ia,fab,jb->ijf", rows, frf.values, columns)
        return np.ascontiguousarray(h if h.imag.any() else h.real)

    def _between(self, base: Base, labels: set[str]) -> Frf:
        """FRFs between some DoFs of a base, coupled from its parts; or of the whole.

        The whole is solved where no line of a part can be: a free part at 0 Hz.
        """
        drivetrain = base.drivetrain
        joints = [j for c in drivetrain.couplings for j in coupling_joints(drivetrain, c)]
        ends = {label for joint in joints for _, label in (joint.first, joint.second)}
        try:
            parts = {
                p.name: self._part(drivetrain, p.name, labels | ends) for p in drivetrain.parts
            }
            present = {name: frf for name, frf in parts.items() if frf is not None}
            known = {label for frf in present.values() for label in frf.responses}
            for label in sorted(labels - known):
                raise unknown_dof(label, self.source.whole(drivetrain).labels, "the drivetrain")
            wanted = sorted(labels)
            return couple(present, joints).frf.select(wanted, wanted)
        except SingularLineError:
            wanted = sorted(labels)
            return direct_frf(self.source.whole(drivetrain), self.frequency, wanted, wanted)

    def _part(self, drivetrain: Drivetrain, name: str, labels: set[str]) -> Frf | None:
        """FRFs of a part with its halves of the hubs, between those of the labels it has."""

        def solve() -> Frf | None:
            system = self.source.stage(drivetrain, name)
            own = sorted(labels & set(system.labels))
            return direct_frf(system, self.frequency, own, own) if own else None

        return _remembered(
            self._parts, (*part_key(drivetrain, name), *sorted(labels)), solve, PARTS
        )

    def modes(self, sample: Sample) -> tuple[FloatArray, tuple[str, ...]]:
        """Natural frequencies (Hz, ascending) and kinds of all modes."""
        base = sample.base
        system = stiffened(
            _remembered(self._systems, base, lambda: self.source.whole(base.drivetrain), BASES),
            base,
            sample.stiffer,
        )
        alone = _remembered(self._stiffness, base, lambda: self._alone(base.drivetrain), BASES)
        modes = real_modes(system)
        frequencies, _ = damped_modes(system, modes)
        at, factors = system.locate()
        kinds, _ = classify(
            sample.drivetrain,
            system.labels,
            modes.natural_frequencies,
            factors[:, None] * modes.shapes[at],
            modes.n_rigid,
            alone,
        )
        return frequencies, tuple(str(kind) for kind, _ in kinds)

    def _alone(self, drivetrain: Drivetrain) -> dict[str, StageStiffness]:
        bare = drivetrain.model_copy(update={"couplings": ()})
        systems = {part.name: self.source.stage(bare, part.name) for part in bare.parts}
        return {name: StageStiffness(s.dofs, s.stiffness) for name, s in systems.items()}


@lru_cache(maxsize=1)
def _bench(task: Task) -> Bench:
    return Bench(task)


def _remembered(cache: dict[Any, T], key: object, make: Callable[[], T], most: int) -> T:
    """The value of a key, made if it is not there; the oldest beyond ``most`` are forgotten."""
    if key not in cache:
        cache[key] = make()
        while len(cache) > most:
            del cache[next(iter(cache))]
    return cache[key]


def part_key(drivetrain: Drivetrain, name: str) -> tuple[str, ...]:
    """Everything that a part's own FRFs depend on."""
    return (
        name,
        drivetrain.part(name).model_dump_json(),
        drivetrain.damping.model_dump_json(),
        *(_half(coupling, name) for coupling in drivetrain.couplings),
    )


def _half(coupling: Coupling, name: str) -> str:
    """A coupling's half in a part: the hub, and the springs of its own end (far: rigid or not)."""
    springs = [
        stiffness if body.partition(".")[0] == name else stiffness == "rigid"
        for body, stiffness in coupling.ends
    ]
    if name not in {body.partition(".")[0] for body, _ in coupling.ends}:
        return coupling.name
    return f"{coupling.name} {coupling.radius!r} {coupling.hub_mass!r} {springs!r}"


def spring_deflection(drivetrain: Drivetrain, coupling: str, key: str) -> dict[str, float]:
    """δ = (r/r_body)·w_body − w_hub of a coupling's first or second spring."""
    hub = next(c for c in drivetrain.couplings if c.name == coupling)
    body = hub.first if key == "first_stiffness" else hub.second
    facing = facings(drivetrain)
    alike = turning(facing, hub.first) * turning(facing, body)
    return {f"{body}.w": alike * hub.radius / drivetrain.radius(body), f"{hub.name}.w": -1.0}


def _coefficients(rows: Sequence[dict[str, float]], labels: Sequence[str]) -> FloatArray:
    return np.array([[row.get(label, 0.0) for label in labels] for row in rows])


def stiffened(system: SecondOrderSystem, base: Base, stiffer: Values) -> SecondOrderSystem:
    """The base's system with its varied springs made stiffer: K + Δk v vᵀ, C + β Δk v vᵀ."""
    stiffness, damping = system.stiffness.copy(), system.damping.copy()
    for deflection, more in zip(base.springs, stiffer, strict=True):
        at, factors = system.locate(deflection)
        v = np.zeros(len(system.dofs))
        np.add.at(v, at, factors * np.array(list(deflection.values())))
        stiffness += more * np.outer(v, v)
        damping += base.beta * more * np.outer(v, v)
    return SecondOrderSystem(system.mass, damping, stiffness, system.dofs, system.derived)
