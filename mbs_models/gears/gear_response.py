"""What a run says of meshes and bodies: dynamic mesh forces, loss of contact, RMS per body."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..errors import ModelError

FloatArray = NDArray[np.float64]

PIECE = 1 << 16  # samples at a time: a record may be a memory map of any length
NO_MEAN = 1e-9  # of the largest force: a mean below is round-off, and no load to refer to


@dataclass(frozen=True)
class MeshLoad:
    """The force of one mesh over a run.

    Attributes
    ----------
    name
        The mesh.
    mean
        F̄ (N), positive where the loaded flanks press.
    largest, smallest
        Of the force (N).
    rms
        Of F − F̄ (N).
    open_share
        Share of the time in which the teeth do not touch.
    reversed_share
        Share of the time in which their backs touch.
    nothing
        A mean force of less (N) is round-off.
    """

    name: str
    mean: float
    largest: float
    smallest: float
    rms: float
    open_share: float
    reversed_share: float
    nothing: float = 0.0

    @property
    def dynamic_factor(self) -> float | None:
        """K_v = max|F|/|F̄|; None without a mean force."""
        extreme = max(abs(self.largest), abs(self.smallest))
        none = max(NO_MEAN * extreme, self.nothing)
        return extreme / abs(self.mean) if abs(self.mean) > none else None


def mesh_loads(
    meshes: Sequence[str], forces: FloatArray, contact: FloatArray, *, nothing: float = 0.0
) -> tuple[MeshLoad, ...]:
    """Mean, extremes, dynamic factor and loss of contact of every mesh.

    Parameters
    ----------
    meshes
        Names.
    forces
        (n, n_mesh) N, positive where the loaded flanks press; may be a memory map.
    contact
        (n, n_mesh) 1 where these touch, −1 where their backs do, 0 where neither: counted on the
        deflection, since a damper may pull or push where teeth hardly touch.
    nothing
        A mean force (N) of less is round-off, and no load to refer to.

    Raises
    ------
    ModelError
        Shapes that do not fit, or a force that is not finite.
    """
    _check(meshes, forces, "meshes")
    _check(meshes, contact, "meshes")
    mean, rms = _mean_and_rms(forces)
    largest, smallest = np.full(len(meshes), -np.inf), np.full(len(meshes), np.inf)
    apart, backs = np.zeros(len(meshes)), np.zeros(len(meshes))
    for start in range(0, len(forces), PIECE):
        piece, touching = forces[start : start + PIECE], contact[start : start + PIECE]
        largest = np.maximum(largest, piece.max(axis=0))
        smallest = np.minimum(smallest, piece.min(axis=0))
        apart += np.sum(touching == 0.0, axis=0)
        backs += np.sum(touching < 0.0, axis=0)
    columns = zip(
        meshes, mean, largest, smallest, rms, apart / len(forces), backs / len(forces), strict=True
    )
    return tuple(
        replace(MeshLoad(name, *map(float, numbers)), nothing=nothing) for name, *numbers in columns
    )


def rms_per_body(labels: Sequence[str], motion: FloatArray) -> Mapping[str, Mapping[str, float]]:
    """Body → DoF → RMS of its motion about the mean.

    The mean is where the load has moved the body; it does not vibrate. All DoFs of a body have
    one unit (w = r·θ), and the root of the sum of squares is the body's.

    Parameters
    ----------
    labels
        DoFs, ``stage.body.dof``.
    motion
        (n, n_dof) displacement, velocity or acceleration; may be a memory map.

    Raises
    ------
    ModelError
        Shapes that do not fit, or a sample that is not finite.
    """
    _check(labels, motion, "DoFs")
    _, rms = _mean_and_rms(motion)
    bodies: dict[str, dict[str, float]] = {}
    for label, value in zip(labels, rms, strict=True):
        body, _, dof = label.rpartition(".")
        bodies.setdefault(body, {})[dof] = float(value)
    return bodies


def _check(labels: Sequence[str], samples: FloatArray, what: str) -> None:
    if samples.ndim != 2 or samples.shape[1] != len(labels) or not len(samples):
        raise ModelError(
            f"record: samples of shape {samples.shape} do not fit {len(labels)} {what}"
        )


def _mean_and_rms(samples: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean, and root mean square about it, of each column; in two passes, for accuracy."""
    mean = np.mean(samples, axis=0)
    wrong = np.flatnonzero(~np.isfinite(mean))
    if wrong.size:
        raise ModelError(f"record: column {wrong[0]} holds values that are not finite")
    square = np.zeros(samples.shape[1])
    for start in range(0, len(samples), PIECE):
        square += np.sum((samples[start : start + PIECE] - mean) ** 2, axis=0)
    return mean, np.sqrt(square / len(samples))
