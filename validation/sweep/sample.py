"""The samples of a sweep, computed from what those before them left.

A varied coupling spring costs one interface solve: H = H₀ − H₀ b (bᵀH₀b + 1/z)⁻¹ bᵀH₀ couples a
joint z = (k − k₀)(1 + jωβ) across the spring, whose deflection is bᵀq, to FRFs H₀ computed with
k₀ in its place. k₀ is within a factor of 32 of k, so that no more than two digits are lost. H₀
itself is coupled from the FRFs of the parts, each computed anew only if something in it changes.
"""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby
from typing import Any, TypeVar

import numpy as np

from fbs import Frf, RealModes, SecondOrderSystem, couple, direct_frf, real_modes
from fbs._kernels.blas_threads import one_blas_thread
from fbs.errors import FbsError, SingularLineError, unknown_dof
from mbs_models.errors import ModelError
from mbs_models.modal.mode_kinds import StageStiffness, classify, mode_groups
from mbs_models.model.parameters import Coupling, Drivetrain
from mbs_models.model.placement import hub_ratios

from ..arrays import FloatArray
from ..errors import CommandError, ill_conditioned
from ..routes.model_parameters import Step, changed, steps_to
from ..routes.modes import damped_modes
from ..routes.routes import source_by_name
from ..routes.source import Source
from .interface import Interface
from .metrics import Findings, FoundModes
from .parameters import Values
from .plan import SampleResults, SweepPlan, base_values, blank

T = TypeVar("T")

BASES, PARTS = 2, 24  # FRFs remembered: samples come sorted by what they share
FAILURES = (CommandError, ModelError, FbsError, np.linalg.LinAlgError)
INFINITE = "the FRF is infinite: a line lies on an undamped pole"


def evaluate(plan: SweepPlan, samples: Sequence[Values]) -> SampleResults:
    """Compute some samples here; one that fails says why in its status.

    The same bits come out whoever computes, since matrices this small are left to one thread.
    """
    bench, results = _bench(plan), blank(plan, len(samples))
    status = list(results.status)
    modes: list[FoundModes] = [(np.zeros(0), ())] * len(samples)
    with one_blas_thread():
        for rows in _alike(plan, samples):
            try:
                base = bench.base(samples[rows.start])
                stiffer = bench.stiffer(samples[rows.start : rows.stop])
                if plan.response:
                    bench.magnitude(base, stiffer, results.magnitude[rows.start : rows.stop])
            except FAILURES as error:
                status[rows.start : rows.stop] = [_in_one_line(error)] * len(rows)
                continue
            for i, more in zip(rows, stiffer if plan.modes_needed else (), strict=False):
                try:
                    modes[i] = bench.modes(base, tuple(more))
                except FAILURES as error:
                    status[i] = _in_one_line(error)
        for row in np.flatnonzero(~np.isfinite(results.magnitude).all(axis=1)):
            status[row] = INFINITE if status[row] == "ok" else status[row]
        results = replace(results, status=np.array(status))
        _fill(bench, results, modes)
    return results


def _in_one_line(error: Exception) -> str:
    if isinstance(error, np.linalg.LinAlgError):
        error = ill_conditioned("the sample", error)
    return " ".join(str(error).split())


def _alike(plan: SweepPlan, samples: Sequence[Values]) -> Iterator[range]:
    """Stretches of samples that differ in coupling springs only."""
    start = 0
    for _, group in groupby(samples, key=lambda values: base_values(plan, values)):
        stop = start + len(list(group))
        yield range(start, stop)
        start = stop


def _fill(bench: Bench, results: SampleResults, modes: Sequence[FoundModes]) -> None:
    """Fill in what is found of the samples that are ok, and NaN for the others."""
    plan, ok = bench.plan, np.flatnonzero(results.ok).tolist()
    for i in ok:
        frequencies, kinds = modes[i]
        n = min(plan.n_modes, len(frequencies))
        results.frequency_hz[i, :n], results.kind[i, :n] = frequencies[:n], kinds[:n]
    if ok and plan.metrics:
        magnitude = results.magnitude if len(ok) == len(modes) else results.magnitude[ok]
        findings = Findings(bench.frequency, magnitude, [modes[i] for i in ok], bench.nominal)
        results.metrics[ok] = np.hstack([metric.values(findings) for metric in plan.metrics])
    results.magnitude[~results.ok] = np.nan


@dataclass(frozen=True, eq=False)
class Base:
    """What samples share that differ in coupling springs only.

    Attributes
    ----------
    drivetrain
        With the varied springs at their references.
    source
        Its matrices.
    springs
        Deflection of each varied spring: label → coefficient.
    """

    drivetrain: Drivetrain
    source: Source
    springs: tuple[dict[str, float], ...]

    @property
    def beta(self) -> float:
        """Damping of a spring per stiffness (s)."""
        return self.drivetrain.damping.stiffness_proportional


class Bench:
    """Computes samples of a plan and remembers what the next one shares."""

    def __init__(self, plan: SweepPlan) -> None:
        self.plan = plan
        self.data: dict[str, Any] = json.loads(plan.model)
        self.places = [steps_to(self.data, path) for path in plan.paths]
        self.varied = [k for k, anchor in enumerate(plan.anchors) if anchor is not None]
        self.frequency = plan.band.frequency()
        self._bases: dict[Values, Base] = {}
        self._interfaces: dict[Base, Interface] = {}
        self._parts: dict[tuple[str, ...], Frf | None] = {}
        self._stiffness: dict[tuple[str, ...], StageStiffness] = {}
        self._nominal: dict[float, float] = {}

    def base(self, values: Values) -> Base:
        """Validate a sample, and find its base.

        Its springs are as valid as the base's: a stiffness greater than 0 breaks no rule that
        another one keeps, and any other is its own reference.
        """
        shared = base_values(self.plan, values)
        return _remembered(self._bases, shared, lambda: self._base(shared), BASES)

    def _base(self, values: Values) -> Base:
        drivetrain = self._drivetrain(values)
        varied = [self.plan.paths[k].split(".") for k in self.varied]
        springs = tuple(spring_deflection(drivetrain, *path) for path in varied)
        return Base(drivetrain, self._source(drivetrain), springs)

    def _source(self, drivetrain: Drivetrain) -> Source:
        return source_by_name(self.plan.route, drivetrain)

    def _drivetrain(self, values: Values) -> Drivetrain:
        given: dict[tuple[Step, ...], float] = dict(zip(self.places, values, strict=True))
        return changed(self.data, given)

    def stiffer(self, samples: Sequence[Values]) -> FloatArray:
        """(n_sample, m) how much stiffer each varied spring is than in the base (N/m)."""
        rows = [
            [values[k] - shared[k] for k in self.varied]
            for values, shared in ((v, base_values(self.plan, v)) for v in samples)
        ]
        return np.array(rows, dtype=float).reshape(len(samples), len(self.varied))

    def magnitude(self, base: Base, stiffer: FloatArray, out: FloatArray) -> None:
        """|H| of the FRF asked for, (n_sample, n_frequency), with springs joined to the base."""
        interface = _remembered(self._interfaces, base, lambda: self._interface(base), BASES)
        interface.magnitude(stiffer, out)

    def nominal(self, line: float) -> float:
        """|H| of the model as it is at one line (Hz)."""
        return _remembered(self._nominal, line, lambda: self._nominal_at(line), len(self.frequency))

    def _nominal_at(self, line: float) -> float:
        assert self.plan.response is not None
        assert self.plan.excitation is not None
        system = self._source(changed(self.data, {})).whole
        frf = direct_frf(system, [line], [self.plan.response], [self.plan.excitation])
        return float(np.abs(frf.values[0, 0, 0]))

    def _interface(self, base: Base) -> Interface:
        assert self.plan.response is not None
        assert self.plan.excitation is not None
        left = ({self.plan.response: 1.0}, *base.springs)
        right = ({self.plan.excitation: 1.0}, *base.springs)
        frf = self._between(base, {label for row in (*left, *right) for label in row})
        rows, columns = _coefficients(left, frf.responses), _coefficients(right, frf.excitations)
        h = np.einsum("ia,fab,jb->ijf", rows, frf.values, columns)
        loss = 2.0 * np.pi * self.frequency * base.beta if base.beta else None
        return Interface.of(np.ascontiguousarray(h if h.imag.any() else h.real), loss)

    def _between(self, base: Base, labels: set[str]) -> Frf:
        """FRFs between some DoFs of a base, coupled from its parts; or of the whole.

        The whole is solved where no line of a part can be: a free part at 0 Hz.
        """
        joints = base.source.joints
        ends = {label for joint in joints for _, label in (joint.first, joint.second)}
        try:
            parts = {p.name: self._part(base, p.name, labels | ends) for p in base.drivetrain.parts}
            present = {name: frf for name, frf in parts.items() if frf is not None}
            known = {label for frf in present.values() for label in frf.responses}
            for label in sorted(labels - known):
                raise unknown_dof(label, base.source.whole.labels, "the drivetrain")
            wanted = sorted(labels)
            return couple(present, joints).frf.select(wanted, wanted)
        except SingularLineError:
            wanted = sorted(labels)
            return direct_frf(base.source.whole, self.frequency, wanted, wanted)

    def _part(self, base: Base, name: str, labels: set[str]) -> Frf | None:
        """FRFs of a part with its halves of the hubs, between those of the labels it has."""

        def solve() -> Frf | None:
            system = base.source.stage(name)
            own = sorted(labels & set(system.labels))
            return direct_frf(system, self.frequency, own, own) if own else None

        return _remembered(
            self._parts, (*part_key(base.drivetrain, name), *sorted(labels)), solve, PARTS
        )

    def modes(self, base: Base, stiffer: Values) -> FoundModes:
        """Natural frequencies (Hz, ascending) and kinds of the modes needed, or some more."""
        system = stiffened(base.source.whole, base, stiffer)
        modes = real_modes(system)
        frequencies, _ = damped_modes(system, modes)
        needed = self._needed(modes)
        at, factors = system.locate()
        kinds, _ = classify(
            self._stiffened_drivetrain(base, stiffer),
            system.labels,
            modes.natural_frequencies[:needed],
            factors[:, None] * modes.shapes[at, :needed],
            modes.n_rigid,
            self._alone(base.drivetrain),
        )
        return frequencies[:needed], tuple(str(kind) for kind, _ in kinds)

    def _needed(self, modes: RealModes) -> int:
        """How many modes to classify: repeated ones are told apart together."""
        groups = mode_groups(modes.natural_frequencies, modes.n_rigid)
        ends = (group[-1] + 1 for group in groups)
        everything = len(modes.natural_frequencies)
        if self.plan.modes_needed <= modes.n_rigid:
            return modes.n_rigid
        return next((end for end in ends if end >= self.plan.modes_needed), everything)

    def _stiffened_drivetrain(self, base: Base, stiffer: Values) -> Drivetrain:
        couplings = {coupling.name: coupling for coupling in base.drivetrain.couplings}
        for k, more in zip(self.varied, stiffer, strict=True):
            name, key = self.plan.paths[k].split(".")
            stiffness = getattr(couplings[name], key) + more
            couplings[name] = couplings[name].model_copy(update={key: stiffness})
        return base.drivetrain.model_copy(update={"couplings": tuple(couplings.values())})

    def _alone(self, drivetrain: Drivetrain) -> dict[str, StageStiffness]:
        """Stiffness of each part without couplings, computed anew only if the part changes."""
        bare = drivetrain.model_copy(update={"couplings": ()})

        alone = self._source(bare)

        def solve(name: str) -> StageStiffness:
            system = alone.stage(name)
            return StageStiffness(system.dofs, system.stiffness)

        return {
            part.name: _remembered(
                self._stiffness, part_key(bare, part.name), partial(solve, part.name), PARTS
            )
            for part in bare.parts
        }


class _Benches(threading.local):
    """The last plan's bench, one for every thread that computes."""

    bench: Bench | None = None


_OWN = _Benches()


def forget() -> None:
    """Forget what this thread has computed of the last plan."""
    _OWN.bench = None


def _bench(plan: SweepPlan) -> Bench:
    if _OWN.bench is None or _OWN.bench.plan != plan:
        _OWN.bench = Bench(plan)
    return _OWN.bench


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
    return {f"{body}.w": hub_ratios(drivetrain)[coupling, body], f"{hub.name}.w": -1.0}


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
