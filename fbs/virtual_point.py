"""Virtual points: sensors and impacts around an interface brought to its few motions and forces.

A rigid interface moves by q = (x, y, z, θ_x, θ_y, θ_z) of one point v. A sensor at r along e reads
e·(t + θ × (r − v)), an impact there along e has the force e and the moment (r − v) × e:

    u = R_u q,    m = R_fᵀ f,    row of R = [e, (r − v) × e]

so that, with more channels than motions, by least squares (van der Seijs, van den Bosch, Rixen &
de Klerk 2013, IMAC 31; weights W)

    q = T_u u,  T_u = (R_uᵀ W R_u)⁻¹ R_uᵀ W,    f = T_fᵀ m,  T_fᵀ = R_f (R_fᵀ R_f)⁻¹
    Y_qm = T_u Y T_fᵀ

Further columns of R are flexible interface motions. What the interface does beside its motions is
seen in the channels: u and its part P u = R_u T_u u that the motions explain (consistency). A
channel is held against the others alone, u_i − (u − P u)_i/(1 − P_ii): in P u it would vouch for
itself.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ._kernels.checks import FloatArray, read_only, unique_labels
from ._kernels.door import door
from .errors import FbsError, NonFiniteError
from .frf import Frf
from .metrics import coherence_criterion

MOTIONS = ("x", "y", "z", "rx", "ry", "rz")
RANK = 1e-9
"""Smallest over largest singular value of R, columns scaled, that still tells motions apart."""


@dataclass(frozen=True)
class Channel:
    """A sensor or an impact: its label, its place (m) and its direction (a unit vector)."""

    label: str
    position: tuple[float, float, float]
    direction: tuple[float, float, float]

    def __post_init__(self) -> None:
        for name in ("position", "direction"):
            given = np.asarray(getattr(self, name), dtype=float)
            if given.shape != (3,) or not np.isfinite(given).all():
                raise NonFiniteError(
                    f"{self.label}: {name} = {given}: must be three finite numbers"
                )
        length = float(np.linalg.norm(self.direction))
        if abs(length - 1.0) > 1e-3:
            raise FbsError(f"{self.label}: direction has length {length:.4g}, must be 1")

    def row(self, point: FloatArray) -> FloatArray:
        """[e, (r − v) × e]."""
        e = np.asarray(self.direction) / np.linalg.norm(self.direction)
        return np.concatenate([e, np.cross(np.asarray(self.position) - point, e)])


@dataclass(frozen=True, eq=False)
class VirtualPoint:
    """T of one point: from its channels to its motions, or from its motions to forces.

    Parameters
    ----------
    name
        Motions are labelled ``<name>.x`` … ``<name>.rz``, ``<name>.<flexible>``.
    channels
        At least as many as motions.
    point
        v (m).
    motions
        Of ``MOTIONS``, those that the channels can tell.
    flexible
        Name → (n_channel,) what each channel reads of a flexible motion of 1.
    weights
        (n_channel,) W; 1 if not given.

    Raises
    ------
    FbsError
        Too few channels, or channels that do not tell the motions apart (named).
    """

    name: str
    channels: tuple[Channel, ...]
    point: tuple[float, float, float]
    motions: tuple[str, ...] = MOTIONS
    flexible: Mapping[str, ArrayLike] | None = None
    weights: ArrayLike | None = None

    def __post_init__(self) -> None:
        unique_labels([channel.label for channel in self.channels], "the channels")
        for motion in self.motions:
            if motion not in MOTIONS:
                raise FbsError(
                    f"{self.name}: motion {motion!r}: must be one of {', '.join(MOTIONS)}"
                )
        matrix = self.matrix
        if matrix.shape[0] < matrix.shape[1]:
            raise FbsError(
                f"{self.name}: {matrix.shape[0]} channels for {matrix.shape[1]} motions; at least "
                "as many are needed"
            )
        size = np.linalg.norm(matrix, axis=0)
        values = np.linalg.svd(matrix / np.where(size > 0.0, size, 1.0))
        if not (size.all() and values.S[-1] > RANK * values.S[0]):
            blind = (
                self.labels[int(np.argmax(np.abs(values.Vh[-1])))]
                if size.all()
                else self.labels[int(np.argmin(size))]
            )
            raise FbsError(f"{self.name}: the channels do not tell {blind} from the other motions")

    @property
    def labels(self) -> tuple[str, ...]:
        """Of the motions."""
        return tuple(f"{self.name}.{motion}" for motion in (*self.motions, *(self.flexible or {})))

    @property
    def matrix(self) -> FloatArray:
        """R, (n_channel, n_motion)."""
        rows = np.array([channel.row(np.asarray(self.point)) for channel in self.channels])
        columns = [rows[:, MOTIONS.index(motion)] for motion in self.motions]
        columns += [np.asarray(column, dtype=float) for column in (self.flexible or {}).values()]
        return np.stack(columns, axis=1)

    def to_motions(self) -> FloatArray:
        """T_u = (RᵀWR)⁻¹ RᵀW, (n_motion, n_channel)."""
        r, w = self.matrix, self._weights
        return np.asarray(np.linalg.solve(r.T @ (w[:, None] * r), r.T * w))

    def to_forces(self) -> FloatArray:
        """T_fᵀ = W⁻¹R (RᵀW⁻¹R)⁻¹, (n_channel, n_motion): the least forces that make a load."""
        r, w = self.matrix, self._weights
        spread = r / w[:, None]
        return np.asarray(np.linalg.solve(r.T @ spread, spread.T).T)

    @property
    def _weights(self) -> FloatArray:
        if self.weights is None:
            return np.ones(len(self.channels))
        given = np.asarray(self.weights, dtype=float)
        if given.shape != (len(self.channels),) or not (given > 0.0).all():
            raise FbsError(f"{self.name}: weights must be {len(self.channels)} positive numbers")
        return read_only(given)


@dataclass(frozen=True, eq=False)
class Transformed:
    """What `transform` returns.

    Attributes
    ----------
    frf
        Between the motions of virtual points and what is at none.
    sensors, impacts
        Channel → (nf,) coherence criterion, over all forces (sensor) or responses (impact), of what
        it reads and what the other channels' motions say it should, between 0 and 1: the lowest is
        wrong in place, direction or sign, or the interface is not rigid there. NaN where no other
        channel sees what it sees.
    sensor_share, impact_share
        Virtual point → (nf,) ‖explained‖/‖measured‖ over all its channels.
    """

    frf: Frf
    sensors: Mapping[str, FloatArray]
    impacts: Mapping[str, FloatArray]
    sensor_share: Mapping[str, FloatArray]
    impact_share: Mapping[str, FloatArray]


@door
def transform(
    frf: Frf, sensors: Sequence[VirtualPoint] = (), impacts: Sequence[VirtualPoint] = ()
) -> Transformed:
    """Y_qm = T_u Y T_fᵀ, with how far the channels agree; labels at no point stay as they are.

    Raises
    ------
    UnknownDofError, FbsError
        A channel is not in the FRFs, or at two points.
    """
    left, rows = _transformation(frf.responses, sensors, "responses", forces=False)
    right, columns = _transformation(frf.excitations, impacts, "excitations", forces=True)
    values = left @ frf.values @ right.T
    read = {p.name: _consistency(frf, p, forces=False) for p in sensors}
    hit = {p.name: _consistency(frf, p, forces=True) for p in impacts}
    return Transformed(
        Frf(frf.frequency, values, rows, columns, frf.quantity),
        {label: each for channels, _ in read.values() for label, each in channels.items()},
        {label: each for channels, _ in hit.values() for label, each in channels.items()},
        {name: share for name, (_, share) in read.items()},
        {name: share for name, (_, share) in hit.items()},
    )


def _transformation(
    labels: Sequence[str], points: Sequence[VirtualPoint], role: str, *, forces: bool
) -> tuple[FloatArray, tuple[str, ...]]:
    """T over all labels, and what its rows are."""
    owned = [channel.label for point in points for channel in point.channels]
    unique_labels(owned, "the channels of all virtual points")
    for label in owned:
        if label not in labels:
            raise FbsError(f"channel {label!r} is not among the FRF's {role}")
    kept = [label for label in labels if label not in owned]
    names = (*(label for point in points for label in point.labels), *kept)
    matrix = np.zeros((len(names), len(labels)))
    row = 0
    for point in points:
        places = [labels.index(channel.label) for channel in point.channels]
        block = point.to_forces().T if forces else point.to_motions()
        matrix[row : row + len(block), places] = block
        row += len(block)
    for place, label in enumerate(kept):
        matrix[row + place, labels.index(label)] = 1.0
    return matrix, names


def _consistency(
    frf: Frf, point: VirtualPoint, *, forces: bool
) -> tuple[dict[str, FloatArray], FloatArray]:
    labels = [channel.label for channel in point.channels]
    if forces:
        measured = frf.select(None, labels).values.transpose(0, 2, 1)
        filtering = point.matrix @ point.to_forces().T
    else:
        measured = frf.select(labels).values
        filtering = point.matrix @ point.to_motions()
    explained = filtering @ measured
    share = np.linalg.norm(explained, axis=(1, 2)) / np.linalg.norm(measured, axis=(1, 2))
    leverage = np.diag(filtering)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        # what the other channels say this one reads: its own part in the fit taken out
        by_others = measured - (measured - explained) / np.where(
            leverage < 1.0 - RANK, 1.0 - leverage, np.nan
        )
    single = coherence_criterion(measured, by_others, axis=2)
    return dict(zip(labels, single.T, strict=True)), share
