"""What a study of truncation finds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ..arrays import BoolArray, ComplexArray, FloatArray
from ..checks.check import Check
from ..report.page import Page
from ..report.provenance import Provenance
from ..runtime.output_folder import Writer
from .plan import Pair, TruncationPlan


@dataclass(frozen=True)
class StageBasis:
    """Which modes of a stage are kept.

    Attributes
    ----------
    stage
        Its name.
    modes
        How many it has.
    rigid
        How many of them are rigid-body modes.
    kept
        Numbers of the kept ones, from 1.
    residual_order
        Of what the others leave; None: nothing is kept of them.
    kept_hz
        (n_kept,) their natural frequencies (Hz).
    first_left_out_hz
        Of the first left-out mode that moves what is joined or asked for; infinite without one.
    silent
        How many modes move neither, and are left out at no cost.
    """

    stage: str
    modes: int
    rigid: int
    kept: tuple[int, ...]
    residual_order: int | None
    kept_hz: FloatArray
    first_left_out_hz: float
    silent: int


@dataclass(frozen=True, eq=False)
class TruncatedFrf:
    """An FRF of the truncated stages, its bound, and its error; (n_frequency,) each.

    Attributes
    ----------
    pair
        (response, excitation).
    truncated, exact
        With the modes kept, and with all (m/N).
    bound, error
        Guaranteed, and true; dB, or scaled. Infinite where there is none.
    """

    pair: Pair
    truncated: ComplexArray
    exact: ComplexArray
    bound: FloatArray
    error: FloatArray


@dataclass(frozen=True, eq=False)
class BasisErrors:
    """A way of choosing modes, and what it gives.

    Attributes
    ----------
    name
        In words.
    modes
        Kept of all stages together.
    bound, error
        Largest guaranteed and largest true error of all FRFs, dB or scaled.
    unbounded
        Lines without a guarantee.
    """

    name: str
    modes: int
    bound: float
    error: float
    unbounded: int


@dataclass(frozen=True, eq=False)
class TruncationResult:
    """What a study of truncation finds.

    Attributes
    ----------
    plan
        What was asked.
    frequency
        (n_frequency,) Hz.
    stages
        The smallest basis.
    frfs
        By pair.
    guaranteed
        Largest guaranteed error where the tolerance can be met, dB or scaled.
    unreachable
        (n_pair, n_frequency) where it cannot, round-off being more.
    reason
        (n_frequency,) `fbs.Reason`, why a line has no bound.
    alternatives
        Other residual orders, and rules of thumb.
    checks, warnings, seconds
        Verdicts, what to mind, and how long each step took.
    """

    files: ClassVar = ("truncation.html", "truncation.json")

    plan: TruncationPlan
    frequency: FloatArray
    stages: tuple[StageBasis, ...]
    frfs: tuple[TruncatedFrf, ...]
    guaranteed: float
    unreachable: BoolArray
    reason: NDArray[np.int8]
    alternatives: tuple[BasisErrors, ...]
    checks: tuple[Check, ...] = ()
    warnings: tuple[str, ...] = ()
    seconds: Mapping[str, float] = field(default_factory=dict)

    @property
    def agrees(self) -> bool:
        """Whether no true error exceeds its bound."""
        return all(check.agrees for check in self.checks)

    @property
    def kept(self) -> int:
        """Modes kept, of all stages together."""
        return sum(len(stage.kept) for stage in self.stages)

    @property
    def modes(self) -> int:
        """Modes of all stages together."""
        return sum(stage.modes for stage in self.stages)

    @property
    def meets(self) -> bool:
        """Whether the tolerance is guaranteed at every line."""
        return self.guaranteed <= self.plan.tolerance.value and not bool(np.any(self.unreachable))

    def page(self) -> Page:
        """What truncation.html says."""
        from .sections import truncation_page  # pictures take their time to load

        return truncation_page(self)

    def document(self, made: Provenance) -> dict[str, Any]:
        """What truncation.json holds."""
        from .document import truncation_document

        return truncation_document(self, made)

    def companions(self, made: Provenance) -> dict[str, str | Writer]:
        """Nothing else."""
        return {}
