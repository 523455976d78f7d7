"""What a run in time leaves: forces and motions, sampled together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..representation import counted, html_table, listing
from .integrators import Integrator

if TYPE_CHECKING:
    from ..plotting import Axes, Panels

FloatArray = NDArray[np.float64]
MOTIONS = ("displacement", "velocity", "acceleration")
QUANTITIES = (*MOTIONS, "mesh_forces", "contact", "energy", "work")
PLAIN = ("energy", "work")  # one number a sample
MOTION_UNITS = ("m", "m/s", "m/s²")
SMOOTH = (*MOTIONS, "mesh_forces")  # what a slower sampling folds back


@dataclass(frozen=True)
class RunDescription:
    """What a run samples; everything of its record but the samples.

    Attributes
    ----------
    sampling_frequency
        Hz.
    samples
        How many.
    labels, excitations, meshes
        Names of the columns of motions, forces and mesh forces.
    recorded
        Which of ``QUANTITIES``.
    integrator
        What integrated it.
    """

    sampling_frequency: float
    samples: int
    labels: tuple[str, ...]
    excitations: tuple[str, ...]
    meshes: tuple[str, ...]
    recorded: tuple[str, ...]
    integrator: Integrator

    def columns(self) -> dict[str, tuple[str, ...]]:
        """Names of the columns of each array; energy and work have none."""
        named = {motion: self.labels for motion in MOTIONS}
        named |= {"mesh_forces": self.meshes, "contact": self.meshes} | dict.fromkeys(PLAIN, ())
        return {"forces": self.excitations} | {what: named[what] for what in self.recorded}

    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Shape of each array."""
        return {
            what: (self.samples,) if what in PLAIN else (self.samples, len(names))
            for what, names in self.columns().items()
        }


@dataclass(frozen=True, eq=False)
class TransientRecord:
    """One run in time, or a piece of it. Sample k is at start + k/sampling_frequency.

    Attributes
    ----------
    sampling_frequency
        Hz.
    start
        Time of the first sample (s).
    labels
        DoFs of the columns of the motions.
    excitations, forces
        DoFs with a force, and (n, n_excitation) the force at each (N).
    integrator
        What integrated it; its step may be shorter than the sampling interval.
    displacement, velocity, acceleration
        (n, n_dof) m, m/s, m/s²; None if not asked for. They may be memory maps.
    meshes, mesh_forces
        Names of the meshes, and (n, n_mesh) the force of each (N), positive where the loaded
        flanks press; None if not asked for.
    contact
        (n, n_mesh) which flanks touch: 1 the loaded ones, −1 their backs, 0 none; None if not
        asked for.
    energy
        (n,) J, kinetic and of all springs and meshes (`energy_balance`); None if not asked for.
    work
        (n,) J, done on the drivetrain from each sample to the next; None if not asked for.
    aliasing
        Share of a response's variance that lies above half the sampling frequency and is folded
        back: the largest of all. 0 where every step is a sample.
    warnings
        What to know before using it.
    """

    sampling_frequency: float
    start: float
    labels: tuple[str, ...]
    excitations: tuple[str, ...]
    forces: FloatArray
    integrator: Integrator
    displacement: FloatArray | None = None
    velocity: FloatArray | None = None
    acceleration: FloatArray | None = None
    meshes: tuple[str, ...] = ()
    mesh_forces: FloatArray | None = None
    contact: FloatArray | None = None
    energy: FloatArray | None = None
    work: FloatArray | None = None
    aliasing: float = 0.0
    warnings: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"<TransientRecord: {self._sampling}, {counted(len(self.labels), 'DoF')}>"

    def _repr_html_(self) -> str:
        rows = (
            ("samples", f"{self._sampling} from {self.start:g} s on"),
            ("integrator", f"{self.integrator.name}, h = {self.integrator.step:.3g} s"),
            ("excitations", listing(self.excitations)),
            ("DoFs", listing(self.labels)),
            ("recorded", ", ".join(what for what in QUANTITIES if getattr(self, what) is not None)),
            ("warnings", listing(self.warnings)),
        )
        return html_table("TransientRecord", [row for row in rows if row[1]])

    @property
    def _sampling(self) -> str:
        duration = self.n_samples / self.sampling_frequency
        rate = f"{self.sampling_frequency:g} Hz"
        return f"{counted(self.n_samples, 'sample')} at {rate}, {duration:g} s"

    @property
    def n_samples(self) -> int:
        """Number of samples."""
        return len(self.forces)

    @property
    def time(self) -> FloatArray:
        """(n,) s."""
        return np.asarray(self.start + np.arange(self.n_samples) / self.sampling_frequency)

    def span(self, first: int, last: int | None = None) -> TransientRecord:
        """Samples first, … last − 1, as views."""
        begin, end, _ = slice(first, last).indices(self.n_samples)
        arrays = {what: getattr(self, what) for what in ("forces", *QUANTITIES)}
        cut = {what: a[begin:end] for what, a in arrays.items() if a is not None}
        return replace(self, start=self.start + begin / self.sampling_frequency, **cut)

    def plot(self, axes: Sequence[Axes] | None = None) -> Panels:
        """Draw forces, recorded motions and mesh forces over time, every sample.

        matplotlib is imported for it. Of a long record draw a `span`.

        Parameters
        ----------
        axes
            One matplotlib Axes for each of these that there is, in this order. None: a new figure.

        Raises
        ------
        ModelError
            Fewer or more axes are given, or nothing that is drawn was recorded.
        """
        from ..plotting import traces

        return traces(self.time, tuple(self._panels()), axes)

    def _panels(self) -> Iterator[tuple[str, tuple[str, ...], FloatArray]]:
        """Ordinate, names of the columns and samples of what is drawn."""
        if self.excitations:
            yield "force, N", self.excitations, self.forces
        motions = (self.displacement, self.velocity, self.acceleration)
        for what, unit, samples in zip(MOTIONS, MOTION_UNITS, motions, strict=True):
            if samples is not None:
                yield f"{what}, {unit}", self.labels, samples
        if self.mesh_forces is not None:
            yield "mesh force, N", self.meshes, self.mesh_forces


def as_record(
    description: RunDescription,
    arrays: Mapping[str, FloatArray],
    aliasing: float,
    warnings: tuple[str, ...],
) -> TransientRecord:
    """The record of a finished run."""
    return TransientRecord(
        sampling_frequency=description.sampling_frequency,
        start=0.0,
        labels=description.labels,
        excitations=description.excitations,
        integrator=description.integrator,
        meshes=description.meshes,
        aliasing=aliasing,
        warnings=warnings,
        **arrays,
    )
