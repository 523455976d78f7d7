"""What coupling, decoupling and identification of files find."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fbs.joint_identification import JointStiffness, Spring

from ..arrays import BoolArray, ComplexArray, FloatArray
from ..checks.check import Check
from ..report.page import Page
from ..report.provenance import Provenance
from ..runtime.output_folder import Writer
from .inputs import Pair, Part


@dataclass(frozen=True, eq=False)
class Curve:
    """A result over frequency, (n_frequency,) each.

    Attributes
    ----------
    name
        Response ← excitation, or the joint and the form.
    values
        FRF (m/N), or dynamic stiffness (N/m).
    error
        Around it: 95 % of the noise, or a bound of round-off where there is none.
    before
        What it is shown beside; None: nothing.
    """

    name: str
    values: ComplexArray
    error: FloatArray
    before: ComplexArray | None = None

    @property
    def lost(self) -> BoolArray:
        """Where it has no digit: the error is as large as itself."""
        return ~(self.error < np.abs(self.values))


@dataclass(frozen=True, eq=False)
class Identified:
    """A joint by one of the two forms: its dynamic stiffness, and springs fitted pair by pair."""

    form: str
    joint: JointStiffness
    springs: tuple[Spring, ...]


@dataclass(frozen=True, eq=False)
class SubstructuringResult:
    """What one of the commands finds.

    Attributes
    ----------
    command
        couple, decouple or identify.
    parts
        The files.
    at
        Pairs of DoFs that were joined.
    how
        The joint, or the form.
    verdict, conclusions, warnings
        In sentences.
    frequency
        (n_frequency,) Hz.
    condition
        (n_frequency,) amplification of the data's relative errors; None where the forms have none.
    error_is
        What the curves' error is.
    curves
        What is drawn.
    identified
        Of identify.
    seconds
        How long it took.
    """

    command: str
    parts: tuple[Part, ...]
    at: tuple[Pair, ...]
    how: str
    verdict: str
    conclusions: tuple[str, ...]
    warnings: tuple[str, ...]
    frequency: FloatArray
    condition: FloatArray | None
    error_is: str
    curves: tuple[Curve, ...]
    identified: tuple[Identified, ...] = ()
    seconds: Mapping[str, float] = field(default_factory=dict)

    @property
    def files(self) -> tuple[str, str]:
        """Names of the page and of the numbers."""
        return file_names(self.command)

    @property
    def checks(self) -> tuple[Check, ...]:
        """None: there is no second route to files."""
        return ()

    def page(self) -> Page:
        """The one page."""
        from .sections import substructuring_page  # pictures take their time to load

        return substructuring_page(self)

    def document(self, made: Provenance) -> dict[str, Any]:
        """The numbers."""
        from .document import substructuring_document

        return substructuring_document(self, made)

    def companions(self, made: Provenance) -> dict[str, str | Writer]:
        """Nothing else."""
        return {}


def file_names(command: str) -> tuple[str, str]:
    """The page and the numbers of a command."""
    return f"{command}.html", f"{command}.json"
