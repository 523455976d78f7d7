"""What the items are examined on: the paper's systems and their FRFs, each computed once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any, TypeVar

import numpy as np

from fbs import Frf, RealModes, SecondOrderSystem, couple, direct_frf, frequency_axis, real_modes
from mbs_models.model.parameters import Drivetrain

from ..arrays import ComplexArray, FloatArray
from ..routes.source import Source
from .case import PAPER, PaperCase, parameter_sets
from .item import Curve, Difference

T = TypeVar("T")

ZERO = 1e-12
"""An FRF this small against √(h_i h_j) is zero to round-off: symmetry forbids it."""

ON_POLE = 1e-9
"""A line this close to an undamped natural frequency (relative) is moved."""


class RouteName(StrEnum):
    """Where a curve comes from."""

    EXUDYN = "exudyn"
    EQUATIONS = "equations"
    FBS = "FBS of exudyn stages"


@dataclass(frozen=True)
class PaperBand:
    """Lines of a figure: multiples of ``step`` above 0 Hz up to ``end`` (Hz).

    ``stated`` says whether the paper gives the band.
    """

    end: float
    step: float
    stated: bool = True


@dataclass(frozen=True)
class Axis:
    """The lines of a band (Hz), and what was done to them, in words."""

    frequency: FloatArray
    note: str


def axis(band: PaperBand, natural_frequencies: FloatArray) -> Axis:
    """Lines step, 2·step … end; those on an undamped pole moved by a thousandth of a step."""
    lines = frequency_axis(band.step, band.end, band.step).copy()
    elastic = natural_frequencies[natural_frequencies > 0.0]
    gap = np.abs(lines[:, None] - elastic[None, :]) / elastic
    hit = (gap <= ON_POLE).any(axis=1)
    lines[hit] += band.step / 1000.0
    origin = "as the paper" if band.stated else "the paper states none for this figure"
    note = (
        f"0–{band.end:g} Hz in steps of {band.step:g} Hz ({origin}), from {band.step:g} Hz on: at "
        "0 Hz a free system's receptance is infinite"
    )
    if hit.any():
        moved = ", ".join(f"{f:g}" for f in lines[hit])
        note += f"; moved off undamped poles: lines now at {moved} Hz"
    return Axis(lines, note)


class Bench:
    """The paper's drivetrain by every source, whole and in stages; each result made once.

    Parameters
    ----------
    preset
        A drivetrain of the paper's form in the place of the preset ``paper``.
    tolerance_db
        Largest error allowed where modes are left out (dB).
    """

    def __init__(self, preset: Drivetrain | None = None, tolerance_db: float = 0.1) -> None:
        self.cases = parameter_sets(preset)
        self.case: PaperCase = self.cases[PAPER]
        self.tolerance_db = tolerance_db
        self._memory: dict[Any, Any] = {}

    @property
    def tolerance(self) -> float:
        """The tolerance as a share of |H|: 0.1 dB is 1.2 %."""
        return float(10.0 ** (self.tolerance_db / 20.0) - 1.0)

    def once(self, make: Callable[..., T], *given: Any) -> T:
        """``make(bench, *given)``, computed at the first call."""
        key = (make, *given)
        if key not in self._memory:
            self._memory[key] = make(self, *given)
        found: T = self._memory[key]
        return found

    # --- systems ---

    def with_shaft(self, shaft: float | None = None) -> PaperCase:
        """The drivetrain with k_sw = ``shaft`` (default: the case's own), and its systems."""
        return self.once(_with_shaft, self._shaft(shaft))

    def exudyn(self, shaft: float | None = None) -> Source:
        """exudyn's systems."""
        return self.with_shaft(shaft).exudyn

    def modes(self, part: str = "", shaft: float | None = None) -> RealModes:
        """Modes of exudyn's matrices: of the whole (``""``), or of a stage with its half hub."""
        return self.once(_modes, part, self._shaft(shaft))

    def _shaft(self, shaft: float | None) -> float:
        return self.case.shaft_stiffness if shaft is None else shaft

    # --- FRFs ---

    @property
    def points(self) -> tuple[str, ...]:
        """Labels the figures need."""
        bodies = [f"B.{body}.{d}" for body in ("sun", "carrier", "ring", "planet1") for d in "uvw"]
        gears = ("A.pinion.w", "A.pinion.y", "A.pinion.z", "A.wheel.w")
        return tuple(map(self.case.label, (*gears, "hub", *bodies, "B.planet2.u")))

    def axis(self, band: PaperBand, shaft: float | None = None) -> Axis:
        """The band's lines, off the poles of the whole and of its stages."""
        return self.once(_axis, band, self._shaft(shaft))

    def frf(
        self,
        route: RouteName,
        band: PaperBand,
        shaft: float | None = None,
        part: str = "",
        loss_factor: float = 0.0,
    ) -> Frf:
        """FRFs at the points, of the whole (``part`` empty) or of a stage with its half hub.

        Whole systems and stages are given with all responses, so that rows have norms; coupled ones
        between the points alone.
        """
        return self.once(_frf, route, band, self._shaft(shaft), part, loss_factor)


def _with_shaft(bench: Bench, shaft: float) -> PaperCase:
    return bench.case.with_shaft(shaft)


def _modes(bench: Bench, part: str, shaft: float) -> RealModes:
    source = bench.exudyn(shaft)
    return real_modes(source.stage(part) if part else source.whole)


def _axis(bench: Bench, band: PaperBand, shaft: float) -> Axis:
    parts = ("", bench.case.a, bench.case.b)
    poles = [bench.modes(part, shaft).natural_frequencies for part in parts]
    return axis(band, np.concatenate(poles))


def _frf(
    bench: Bench, route: RouteName, band: PaperBand, shaft: float, part: str, loss_factor: float
) -> Frf:
    lines = bench.axis(band, shaft).frequency
    if route == RouteName.FBS:
        return couple_points(bench.exudyn(shaft), lines, bench.points, loss_factor)
    case = bench.with_shaft(shaft)
    source = case.equations if route == RouteName.EQUATIONS else case.exudyn
    system = source.stage(part) if part else source.whole
    damped = with_loss_factor(system, loss_factor)
    return direct_frf(damped, lines, excitations=points_of(system, bench.points))


def with_loss_factor(system: SecondOrderSystem, loss_factor: float) -> SecondOrderSystem:
    """The same system with structural damping K(1 + jη)."""
    return replace(system, loss_factor=loss_factor)


def points_of(system: SecondOrderSystem, points: Sequence[str]) -> tuple[str, ...]:
    """Those of the points that a system has."""
    return tuple(label for label in points if label in system.labels)


def couple_points(
    source: Source, lines: FloatArray, points: Sequence[str], loss_factor: float = 0.0
) -> Frf:
    """The stages' FRFs at the points (the hub among them), coupled."""
    stages = {}
    for name, system in source.stages.items():
        labels = points_of(system, points)
        damped = with_loss_factor(system, loss_factor)
        stages[name] = direct_frf(damped, lines, labels, labels)
    return couple(stages, source.joints).frf


def curve(name: str, route: str, frf: Frf, response: str, excitation: str) -> Curve:
    """One FRF as a curve, without a reference to the rest."""
    return Curve(name, route, frf.between(response, excitation).copy())


def scale(reference: Frf, response: str, excitation: str) -> FloatArray:
    """√(h_i h_j) per line, h the norms of the rows of a symmetric H with all its responses."""
    norms = [
        np.linalg.norm(reference.values[:, :, reference.excitations.index(label)], axis=1)
        for label in (response, excitation)
    ]
    product: FloatArray = np.sqrt(norms[0] * norms[1])
    return product


def difference(
    frequency: FloatArray, reference: Curve, other: Curve, row_scale: FloatArray
) -> Difference:
    """A curve against the reference: in dB, and scaled by the norms of the reference's rows."""
    h, g = reference.values, other.values
    size = np.abs(h)
    decibel = np.full(len(frequency), np.nan)
    ok = (size > ZERO * row_scale) & (np.abs(g) > 0.0)
    decibel[ok] = 20.0 * np.log10(np.abs(g[ok]) / size[ok])
    scaled = np.abs(g - h) / row_scale
    return Difference(
        other.name, reference.name, decibel, scaled,
        *_worst(frequency, np.abs(decibel)), *_worst(frequency, scaled),
    )  # fmt: skip


def _worst(frequency: FloatArray, values: FloatArray) -> tuple[float, float]:
    if np.isnan(values).all():
        return float("nan"), float("nan")
    line = int(np.nanargmax(values))
    return float(values[line]), float(frequency[line])


def peaks(frequency: FloatArray, values: ComplexArray) -> FloatArray:
    """Frequencies of the local maxima of |H| (Hz)."""
    size = np.abs(values)
    inner = (size[1:-1] > size[:-2]) & (size[1:-1] > size[2:])
    found: FloatArray = frequency[1:-1][inner]
    return found


def at_shaft(stiffness: float) -> str:
    """``k_sw = 1e5 N/m``."""
    return f"k_sw = {stiffness:.0e} N/m".replace("e+0", "e")
