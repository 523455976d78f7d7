"""Where a printed frequency may come from that the model as stated does not have."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from fbs import SecondOrderSystem, real_modes

from ..routes import equations
from .bench import at_shaft
from .case import PaperCase
from .printed_values import GEAR_INERTIAS_KG, SHAFT_STIFFNESSES, PrintedMode


@dataclass(frozen=True)
class Hypothesis:
    """Another reading of the paper's input, in words, and the frequencies it gives (Hz)."""

    words: str
    frequencies_hz: tuple[float, ...]

    def deviation(self, printed: PrintedMode) -> float:
        """Computed minus printed, of the nearest mode (Hz)."""
        nearest = min(self.frequencies_hz, key=lambda f: abs(f - printed.frequency_hz))
        return nearest - printed.frequency_hz


def hypotheses(case: PaperCase) -> Iterator[Hypothesis]:
    """Every printed k_sw with every printed inertia in the hub's place; stage B alone, and AB."""
    b = case.b
    inertias = [("the hub as printed", case.coupling.hub_mass)]
    inertias += [
        (f"a hub of {mass:g} kg, which is {name}", mass) for name, mass in GEAR_INERTIAS_KG.items()
    ]
    for words, mass in inertias:
        for stiffness in SHAFT_STIFFNESSES:
            shaft = at_shaft(stiffness)
            varied = case.with_shaft(stiffness)
            alone = equations.stage_system(varied.with_hub(2.0 * mass).drivetrain, b)
            yield Hypothesis(
                f"the planetary stage alone carrying {words} on {shaft}", _frequencies(alone)
            )
            whole = equations.drivetrain_system(varied.with_hub(mass).drivetrain)
            yield Hypothesis(f"the full system with {words} and {shaft}", _frequencies(whole))


def explain(
    case: PaperCase, unexplained: Sequence[PrintedMode], tolerance_hz: float
) -> dict[PrintedMode, tuple[Hypothesis, float]]:
    """The hypothesis that explains most of what is left, then the next; with deviations (Hz).

    Of two that explain as much, the one with the smaller deviations is taken.
    """
    found: dict[PrintedMode, tuple[Hypothesis, float]] = {}
    candidates = list(hypotheses(case)) if unexplained else []
    left = list(unexplained)
    while left:
        ranked = [([p for p in left if abs(h.deviation(p)) <= tolerance_hz], h) for h in candidates]
        hits, best = max(
            ranked,
            key=lambda each: (len(each[0]), -sum(abs(each[1].deviation(p)) for p in each[0])),
        )
        if not hits:
            break
        found |= {p: (best, best.deviation(p)) for p in hits}
        left = [p for p in left if p not in hits]
    return found


def _frequencies(system: SecondOrderSystem) -> tuple[float, ...]:
    return tuple(real_modes(system).natural_frequencies.tolist())


@dataclass(frozen=True)
class Parameter:
    """A number of Table 1: its printed name and unit, its value, and the case with another one."""

    name: str
    unit: str
    value: float
    with_value: Callable[[float], PaperCase]


@dataclass(frozen=True)
class Needed:
    """The value of a parameter that puts a mode where it is printed."""

    parameter: Parameter
    value: float

    def __str__(self) -> str:
        p = self.parameter
        return f"{p.name} = {self.value:.4g} {p.unit} instead of {p.value:.4g}"


def table_1_parameters(case: PaperCase) -> list[Parameter]:
    """What Table 1 gives of both gears and their mesh."""
    names = {
        "gear_mass": ("m_i", "kg"),
        "gear_diametral_inertia_over_r2": ("I_i/r²", "kg"),
        "gear_polar_inertia_over_r2": ("J_i/r²", "kg"),
        "gear_bearing_y": ("k_yi", "N/m"),
        "gear_bearing_z": ("k_zi", "N/m"),
        "gear_bearing_rocking_over_r2": ("k_bρyi/r²", "N/m"),
        "mesh_stiffness": ("k_moy", "N/m"),
    }

    def changed(key: str) -> Callable[[float], PaperCase]:
        return lambda value: case.with_parallel(**{key: value})

    parameters = []
    for key, (name, unit) in names.items():
        owner = case.parallel.pinion if key.startswith("gear_") else case.parallel
        value = getattr(owner, key.removeprefix("gear_"))
        if value:
            parameters.append(Parameter(name, unit, float(value), changed(key)))
    return parameters


def what_it_would_take(
    case: PaperCase, printed: PrintedMode, kept_hz: Sequence[float], tolerance_hz: float
) -> list[Needed]:
    """Single changes of Table 1 that give subsystem A a mode at the printed frequency.

    Changes by more than a factor of two, and those that move one of ``kept_hz`` (frequencies the
    paper prints rightly) by more than the tolerance, are left out.
    """
    found = []
    for parameter in table_1_parameters(case):
        value = _solve(parameter, printed.frequency_hz)
        if value is None:
            continue
        frequencies = np.array(_stage_a(parameter.with_value(value)))
        if all(np.min(np.abs(frequencies - f)) <= tolerance_hz for f in kept_hz):
            found.append(Needed(parameter, value))
    return found


def _stage_a(case: PaperCase) -> tuple[float, ...]:
    return _frequencies(equations.stage_system(case.drivetrain, case.a))


def _solve(parameter: Parameter, target_hz: float) -> float | None:
    """The value nearest to the printed one that puts a mode at ``target_hz``."""
    grid = parameter.value * 2.0 ** np.linspace(-1.0, 1.0, 17)
    offsets = np.array([_stage_a(parameter.with_value(v)) for v in grid]) - target_hz
    roots: list[float] = []
    for low, high, first, second in zip(grid, grid[1:], offsets, offsets[1:], strict=False):
        for mode in np.flatnonzero(np.sign(first) != np.sign(second)):

            def offset(value: float, mode: int = int(mode)) -> float:
                return _stage_a(parameter.with_value(value))[mode] - target_hz

            roots.append(float(brentq(offset, low, high, rtol=1e-10)))
    return min(roots, key=lambda r: abs(np.log(r / parameter.value)), default=None)
