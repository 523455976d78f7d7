"""The [[excitation]] tables of a model file: a signal, and the DoF it acts at."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from ..signals.lines import (
    ROUNDING,
    BandNoise,
    Harmonic,
    Multisine,
    Signal,
    fitted_spacing,
    random_multisine,
    schroeder_multisine,
)
from ..signals.sampled import read_sampled
from ..signals.sines import HalfSine, SteppedSine, Sweep, stepped_sine
from ..stages.bodies import Angle, Table, physical

MOST_STEPS = 100_000  # of a stepped sine

Force = Annotated[float, Field(gt=0.0, json_schema_extra={"unit": "N"}), physical(1e-30, 1e30, "N")]
Moment = Annotated[
    float, Field(gt=0.0, json_schema_extra={"unit": "N m"}), physical(1e-30, 1e30, "N m")
]
Frequency = Annotated[
    float, Field(gt=0.0, json_schema_extra={"unit": "Hz"}), physical(1e-9, 1e12, "Hz")
]
Seconds = Annotated[
    float, Field(gt=0.0, json_schema_extra={"unit": "s"}), physical(1e-12, 1e9, "s")
]
Delay = Annotated[float, Field(ge=0.0, json_schema_extra={"unit": "s"}), physical(1e-12, 1e9, "s")]
Seed = Annotated[int, Field(ge=0), physical(0, 2**63 - 1, "")]
Frequencies = Annotated[
    tuple[Frequency, ...],
    Field(
        min_length=1,
        max_length=MOST_STEPS,
        strict=False,
        description="a list of frequencies (Hz)",
    ),
]

ROTATIONS = ("w", "rho")
NOISE_PERIOD = 100.0  # s, where neither the table nor a record says: longer than most runs


@dataclass(frozen=True)
class Setting:
    """What a table's signal depends on beside the table.

    Attributes
    ----------
    folder
        Where a record's relative path starts: the folder of the model file.
    duration
        Of the record that is run (s); None if that is not decided yet.
    sampling_frequency
        Of that record (Hz), likewise.
    seed
        For a table that has none.
    share
        (i, n): the share of the lines that is this multisine's where n act at once.
    """

    folder: Path = Path()
    duration: float | None = None
    sampling_frequency: float | None = None
    seed: int = 0
    share: tuple[int, int] = (0, 1)


class _Force(Table):
    """A force at ``dof``: ``amplitude`` (N), or for a rotation ``moment`` (N m), force = M/r."""

    dof: str
    amplitude: Force | None = None
    moment: Moment | None = None

    @model_validator(mode="after")
    def _one_amplitude(self) -> Self:
        self._require_one_of(("amplitude",), ("moment",))
        if self.moment is not None:
            _require_rotation(f"moment = {self.moment}", self.dof)
        return self

    def force(self, radius: float | None) -> float:
        """The force conjugate to the label (N)."""
        if self.amplitude is not None:
            return self.amplitude
        assert self.moment is not None
        assert radius is not None
        return self.moment / radius


class _BandForce(_Force):
    fmin: Frequency
    fmax: Frequency

    @model_validator(mode="after")
    def _a_band(self) -> Self:
        _require_ascending(self.fmin, self.fmax)
        return self


class HarmonicTable(_Force):
    """A cos(2π f t + φ): ``frequency`` (Hz) and ``phase`` (deg)."""

    type: Literal["harmonic"]
    frequency: Frequency
    phase: Angle = 0.0

    def signal(self, radius: float | None, setting: Setting) -> Harmonic:
        """The signal."""
        return Harmonic(self.force(radius), self.frequency, math.radians(self.phase))


class SteppedSineTable(_Force):
    """A sine held at ``frequencies``, or at fmin, fmin + df, … fmax, one after the other.

    Each is held for ``dwell`` (s) or for so many of its ``periods``; ``ramp`` (s) is the length of
    the half cosines at both ends.
    """

    type: Literal["stepped-sine"]
    frequencies: Frequencies | None = None
    fmin: Frequency | None = None
    fmax: Frequency | None = None
    df: Frequency | None = None
    dwell: Seconds | None = None
    periods: Annotated[float, Field(gt=0.0), physical(0.01, 1e6, "")] | None = None
    ramp: Delay = 0.0

    @model_validator(mode="after")
    def _steps_and_dwell(self) -> Self:
        self._require_one_of(("frequencies",), ("fmin", "fmax", "df"))
        self._require_one_of(("dwell",), ("periods",))
        if self.fmin is not None and self.fmax is not None and self.df is not None:
            _require_ascending(self.fmin, self.fmax)
            if (self.fmax - self.fmin) / self.df > MOST_STEPS:
                raise ValueError(f"df = {self.df}: makes more than {MOST_STEPS} steps")
        return self

    @property
    def steps(self) -> tuple[float, ...]:
        """The frequencies (Hz)."""
        if self.frequencies is not None:
            return self.frequencies
        assert self.fmin is not None
        assert self.fmax is not None
        assert self.df is not None
        count = int((self.fmax - self.fmin) / self.df * (1.0 + ROUNDING)) + 1
        return tuple((self.fmin + self.df * np.arange(count)).tolist())

    def signal(self, radius: float | None, setting: Setting) -> SteppedSine:
        """The signal."""
        if self.periods is not None:
            return stepped_sine(
                self.steps, self.force(radius), periods=self.periods, ramp=self.ramp
            )
        assert self.dwell is not None
        dwells = (self.dwell,) * len(self.steps)
        return SteppedSine(self.steps, dwells, self.force(radius), self.ramp)


class SweepTable(_BandForce):
    """A sine gliding through the band in ``duration`` (s), ``law`` linear or logarithmic.

    ``taper`` (s) is the length of the half cosines at both ends.
    """

    type: Literal["sweep"]
    duration: Seconds
    law: Literal["linear", "logarithmic"] = "linear"
    direction: Literal["up", "down"] = "up"
    taper: Delay = 0.0

    def signal(self, radius: float | None, setting: Setting) -> Sweep:
        """The signal."""
        return Sweep(
            self.fmin,
            self.fmax,
            self.duration,
            self.force(radius),
            logarithmic=self.law == "logarithmic",
            down=self.direction == "down",
            taper=self.taper,
        )


class MultisineTable(_BandForce):
    """Sines at the multiples of ``df`` (Hz) in the band, each of the amplitude given.

    The spacing is ``df`` or, where a record's length is known, the nearest below whose period fits
    the record a whole number of times. Where several multisines of one spacing act at once, each
    has its own share of the lines (``lines = "shared"``), so that one record tells them apart, or
    all have all (``"all"``).
    """

    type: Literal["multisine"]
    df: Frequency
    phases: Literal["schroeder", "random"] = "schroeder"
    seed: Seed | None = None
    lines: Literal["shared", "all"] = "shared"

    @model_validator(mode="after")
    def _seed_where_random(self) -> Self:
        if self.seed is not None and self.phases != "random":
            raise ValueError(
                f'seed = {self.seed}: has no effect with phases = "{self.phases}"; set phases = '
                '"random", or leave the seed out'
            )
        return self

    def spacing(self, setting: Setting) -> float:
        """The spacing of the lines, fitted to the record (Hz)."""
        if setting.duration is None:
            return self.df
        return fitted_spacing(setting.duration, self.df, setting.sampling_frequency)

    def signal(self, radius: float | None, setting: Setting) -> Multisine:
        """The signal."""
        df, force = self.spacing(setting), self.force(radius)
        if self.phases == "random":
            seed = setting.seed if self.seed is None else self.seed
            whole = random_multisine(self.fmin, self.fmax, df, force, seed)
        else:
            whole = schroeder_multisine(self.fmin, self.fmax, df, force)
        return whole.share(*setting.share)


class NoiseTable(_BandForce):
    """Gaussian noise of a flat spectrum in the band and none outside; the amplitude is its RMS.

    It repeats after ``period`` (s): without it the record's length, or 100 s.
    """

    type: Literal["noise"]
    period: Seconds | None = None
    seed: Seed | None = None

    def signal(self, radius: float | None, setting: Setting) -> BandNoise:
        """The signal."""
        period = self.period or setting.duration or NOISE_PERIOD
        seed = setting.seed if self.seed is None else self.seed
        return BandNoise(self.fmin, self.fmax, self.force(radius), period, seed)


class ImpulseTable(_Force):
    """A half sine of the amplitude as peak, ``contact_time`` (s) long; begins at ``start`` (s).

    ``fmax`` (Hz) instead of the contact time is its reciprocal: there the spectrum is 9.5 dB down.
    """

    type: Literal["impulse"]
    contact_time: Seconds | None = None
    fmax: Frequency | None = None
    start: Delay = 0.0

    @model_validator(mode="after")
    def _one_length(self) -> Self:
        self._require_one_of(("contact_time",), ("fmax",))
        return self

    def signal(self, radius: float | None, setting: Setting) -> HalfSine:
        """The signal."""
        contact_time = self.contact_time
        if contact_time is None:
            assert self.fmax is not None
            contact_time = 1.0 / self.fmax
        return HalfSine(self.force(radius), contact_time, self.start)


class RecordTable(Table):
    """What a CSV ``file`` holds, time (s) and force, times ``scale``; ``unit`` is "N" or "N m".

    A relative path starts at the folder of the model file.
    """

    type: Literal["record"]
    dof: str
    file: str
    unit: Literal["N", "N m"] = "N"
    scale: Annotated[float, physical(1e-30, 1e30, "")] = 1.0

    @model_validator(mode="after")
    def _a_force_or_a_moment(self) -> Self:
        if self.scale == 0.0:
            raise ValueError("scale = 0.0: leaves nothing; must not be 0")
        if self.unit == "N m":
            _require_rotation('unit = "N m"', self.dof)
        return self

    def signal(self, radius: float | None, setting: Setting) -> Signal:
        """The signal."""
        per_unit = 1.0
        if self.unit == "N m":
            assert radius is not None
            per_unit = 1.0 / radius
        return read_sampled(setting.folder / self.file, self.scale * per_unit)


ExcitationTable = Annotated[
    HarmonicTable
    | SteppedSineTable
    | SweepTable
    | MultisineTable
    | NoiseTable
    | ImpulseTable
    | RecordTable,
    Field(discriminator="type"),
]


def require_dof(where: str, dof: str, known: Mapping[str, object]) -> None:
    """Refuse a label that a drivetrain does not have (ValueError, as validators raise)."""
    if dof not in known:
        near = "".join(f"did you mean {n!r}? " for n in difflib.get_close_matches(dof, known, n=1))
        raise ValueError(
            f"{where}dof = {dof!r}: not a DoF of this drivetrain; {near}allowed: {', '.join(known)}"
        )


def _require_rotation(given: str, dof: str) -> None:
    if dof.rpartition(".")[2] not in ROTATIONS:
        raise ValueError(
            f"{given}: {dof} is a translation; give a force (N), or a DoF ending in "
            f"{' or '.join('.' + name for name in ROTATIONS)}"
        )


def _require_ascending(fmin: float, fmax: float) -> None:
    if fmin >= fmax:
        raise ValueError(f"fmin = {fmin}: must be less than fmax = {fmax} (Hz)")
