"""FRFs of the study by every route, on axes that avoid poles, with their differences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from fbs import Frf, SecondOrderSystem, couple, direct_frf, frequency_axis

from ..routes.source import Source
from .model import PaperCase, Systems, with_loss_factor
from .results import ComplexArray, Curve, Difference, FloatArray

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


@dataclass(frozen=True)
class _Key:
    route: RouteName
    part: str
    shaft: float
    band: PaperBand
    loss_factor: float


class FrfBench:
    """FRFs at the points the figures need, each computed once.

    Whole systems and stages are given with all responses, so that rows have norms; coupled ones
    between the points alone.
    """

    def __init__(self, systems: Systems) -> None:
        self.systems = systems
        self._axes: dict[tuple[PaperBand, float], Axis] = {}
        self._frfs: dict[_Key, Frf] = {}

    @property
    def case(self) -> PaperCase:
        """The drivetrain studied."""
        return self.systems.case

    @property
    def points(self) -> tuple[str, ...]:
        """Labels the figures need."""
        a, b = self.case.parallel.name, self.case.planetary.name
        in_a = (f"{a}.pinion.w", f"{a}.pinion.y", f"{a}.pinion.z", f"{a}.wheel.w")
        planets = [*(f"{b}.planet1.{d}" for d in "uvw"), f"{b}.planet2.u"]
        in_b = [f"{b}.{body}.{d}" for body in ("sun", "carrier", "ring") for d in "uvw"]
        return (*in_a, self.case.hub, *in_b, *planets)

    def axis(self, band: PaperBand, shaft: float) -> Axis:
        """The band's lines, off the poles of the whole, of its stages and of what is locked."""
        key = (band, shaft)
        if key not in self._axes:
            parts = ("", self.case.parallel.name, self.case.planetary.name)
            poles = [self.systems.modes(part, shaft).natural_frequencies for part in parts]
            self._axes[key] = axis(band, np.concatenate(poles))
        return self._axes[key]

    def frf(
        self,
        route: RouteName,
        band: PaperBand,
        shaft: float,
        part: str = "",
        loss_factor: float = 0.0,
    ) -> Frf:
        """FRFs of the whole (``part`` empty) or of a stage with its half hub."""
        key = _Key(route, part, shaft, band, loss_factor)
        if key not in self._frfs:
            self._frfs[key] = self._compute(key)
        return self._frfs[key]

    def _compute(self, key: _Key) -> Frf:
        lines = self.axis(key.band, key.shaft).frequency
        if key.route == RouteName.FBS:
            model = self.systems.exudyn(key.shaft)
            return couple_points(model, lines, self.points, key.loss_factor)
        equations = key.route == RouteName.EQUATIONS
        model = (self.systems.equations if equations else self.systems.exudyn)(key.shaft)
        system = model.stages[key.part] if key.part else model.whole
        damped = with_loss_factor(system, key.loss_factor)
        return direct_frf(damped, lines, excitations=points_of(system, self.points))


def points_of(system: SecondOrderSystem, points: Sequence[str]) -> tuple[str, ...]:
    """Those of the points that a system has."""
    return tuple(label for label in points if label in system.labels)


def couple_points(
    model: Source, lines: FloatArray, points: Sequence[str], loss_factor: float = 0.0
) -> Frf:
    """The stages' FRFs at the points (the hub among them), coupled."""
    stages = {}
    for name, system in model.stages.items():
        labels = points_of(system, points)
        damped = with_loss_factor(system, loss_factor)
        stages[name] = direct_frf(damped, lines, labels, labels)
    return couple(stages, model.joints).frf


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
    frequency: FloatArray, reference: Curve, other: Curve, row_scale: FloatArray | None
) -> Difference:
    """A curve against the reference: in dB, and scaled where row norms are known."""
    h, g = reference.values, other.values
    size = np.abs(h)
    zero = size <= ZERO * row_scale if row_scale is not None else size == 0.0
    decibel = np.full(len(frequency), np.nan)
    ok = ~zero & (np.abs(g) > 0.0)
    decibel[ok] = 20.0 * np.log10(np.abs(g[ok]) / size[ok])
    scaled = np.full(len(frequency), np.nan)
    if row_scale is not None:
        scaled = np.abs(g - h) / row_scale
    worst_db, worst_db_hz = _worst(frequency, np.abs(decibel))
    worst_scaled, worst_scaled_hz = _worst(frequency, scaled)
    return Difference(
        other.name, reference.name, decibel, scaled,
        worst_db, worst_db_hz, worst_scaled, worst_scaled_hz,
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
