"""Evidence that is a few numbers: natural frequencies, and matrices."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fbs import FbsError, SecondOrderSystem, real_modes
from fbs.damped_modes import modal_damping

from ..arrays import FloatArray, IndexArray
from .evidence import Remainder, Slope, differenced, stepped

WIDTH = 0.05  # relative: a frequency that far off counts half of what any does
DIGITS = 5e-4  # relative: what tables that were computed from rounded numbers are off by
NOWHERE_HZ = 1e12
ONE_GROUP = 1e-3  # relative: modes so near each other may be mixed in any way
EXACT = 1e-9  # of matrices' entries


@dataclass(frozen=True, eq=False)
class FrequencyEvidence:
    """Natural frequencies, all or some of them.

    Attributes
    ----------
    frequencies_hz
        (n,) ascending, elastic modes only.
    tolerance
        (n,) relative: half a digit, or their scatter.
    rigid
        How many zeros stand among them; None: none, it may list elastic modes only.
    damping
        (n,) ratios; None: not given.
    labels, shapes
        DoFs, and (n, n_label) real mode shapes between them; empty: not given.
    """

    frequencies_hz: FloatArray
    tolerance: FloatArray
    rigid: int | None = None
    damping: FloatArray | None = None
    labels: tuple[str, ...] = ()
    shapes: FloatArray | None = None

    @property
    def lines(self) -> FloatArray:
        """A band around them (Hz)."""
        low, high = self.frequencies_hz[0], self.frequencies_hz[-1]
        return np.geomspace(0.8 * low, 1.25 * high, 400)

    @property
    def alike(self) -> float:
        """What its digits leave open."""
        return float(np.sqrt(np.mean(self._allowed(len(self.frequencies_hz)) ** 2)))

    @property
    def count(self) -> str:
        """How many."""
        with_what = " with damping" if self.damping is not None else ""
        return f"{len(self.frequencies_hz)} natural frequencies{with_what}"

    def modelled(self, system: SecondOrderSystem) -> FloatArray:
        """(n,) a system's own natural frequencies that are matched with them (Hz)."""
        modes = real_modes(system)
        elastic = self._enough(modes.natural_frequencies[modes.n_rigid :])
        return np.asarray(elastic[matched(elastic, self.frequencies_hz)])

    def _enough(self, elastic: FloatArray) -> FloatArray:
        """As many frequencies as there are at least; those that ours has not lie far away."""
        lacking = max(len(self.frequencies_hz) - len(elastic), 0)
        return np.append(elastic, np.full(lacking, NOWHERE_HZ))

    def residual(self, system: SecondOrderSystem) -> FloatArray:
        """d/(|d| + width), d = ln(ours/theirs) of modes matched in order; then damping, shapes."""
        modes = real_modes(system)
        elastic = self._enough(modes.natural_frequencies[modes.n_rigid :])
        chosen = matched(elastic, self.frequencies_hz)
        parts = [_bounded(np.log(elastic[chosen] / self.frequencies_hz))]
        if self.rigid is not None:
            parts.append(np.array([0.5 * (modes.n_rigid - self.rigid)]))
        place = np.minimum(chosen + modes.n_rigid, len(modes.natural_frequencies) - 1)
        if self.damping is not None:
            decay = np.diag(modal_damping(modes, system.damping))[place]
            own = decay / (2.0 * modes.angular_frequency[place]) + system.loss_factor / 2.0
            parts.append((own - self.damping) / (own + self.damping + 1e-9))
        if self.shapes is not None:
            index, factor = system.locate(self.labels)
            parts.append(
                self._shape_residual(modes.shapes[index] * factor[:, None], place, elastic)
            )
        return np.concatenate(parts)

    def _shape_residual(
        self, shapes: FloatArray, place: IndexArray, elastic: FloatArray
    ) -> FloatArray:
        """√(1 − MAC) of each with the modes of the group that it is matched with."""
        assert self.shapes is not None
        rigid = max(shapes.shape[1] - len(elastic), 0)
        elastic = elastic[: shapes.shape[1] - rigid]
        found = []
        for theirs, at in zip(self.shapes, place, strict=True):
            own = elastic[min(max(at - rigid, 0), len(elastic) - 1)]
            near = rigid + np.flatnonzero(np.abs(elastic / own - 1.0) < ONE_GROUP)
            basis = np.linalg.svd(shapes[:, near], full_matrices=False)[0]
            size = float(np.linalg.norm(theirs))  # 0: these DoFs stand still, which says nothing
            inside = float(np.linalg.norm(basis.T @ theirs)) / size if size else 1.0
            found.append(max(1.0 - inside**2, 0.0) ** 0.5)
        return np.array(found)

    def remainder(self, residual: FloatArray) -> Remainder:
        """Structured where one is beyond its digits."""
        allowed = self._allowed(residual.size)
        beyond = not np.all(np.abs(residual) <= allowed)
        rms, noise = (float(np.sqrt(np.mean(v**2))) for v in (residual, allowed))
        return Remainder(rms, noise, beyond, float(residual.size))

    def _allowed(self, size: int) -> FloatArray:
        own = np.abs(_bounded(np.maximum(self.tolerance, DIGITS)))
        rest = size - own.size
        return np.append(own, np.full(rest, 0.05))

    def thinned(self) -> FrequencyEvidence:
        """All of it: it is little."""
        return self

    def along(self, system: SecondOrderSystem, slope: Slope, amounts: FloatArray) -> FloatArray:
        """One system after the other."""
        return stepped(self, system, slope, amounts)

    def sensitivities(
        self, system: SecondOrderSystem, changes: Sequence[SecondOrderSystem], steps: FloatArray
    ) -> FloatArray:
        """By differences."""
        return differenced(self, system, changes, steps)


def _bounded(d: FloatArray) -> FloatArray:
    return np.asarray(d / (np.abs(d) + WIDTH))


def matched(ours: FloatArray, theirs: FloatArray) -> IndexArray:
    """Which of our ascending frequencies theirs are, in order, none twice: least Σ|e|."""
    cost = np.abs(_bounded(np.log(ours[None, :] / theirs[:, None])))
    n, m = cost.shape
    best = np.full((n + 1, m + 1), np.inf)
    best[0] = 0.0
    for i in range(1, n + 1):
        best[i, 1:] = np.minimum.accumulate(best[i - 1, :-1] + cost[i - 1])
    chosen, j = np.empty(n, dtype=np.intp), m
    for i in range(n, 0, -1):
        # the last column that gives this minimum is the one taken
        ways = best[i - 1, :j] + cost[i - 1, :j]
        j = int(np.argmin(ways))
        chosen[i - 1] = j
    return chosen


@dataclass(frozen=True, eq=False)
class MatrixEvidence:
    """M, C, K: some or all of them, in the order of the model's DoFs.

    Attributes
    ----------
    matrices
        "mass", "damping", "stiffness" → (n, n).
    dofs
        Labels of the rows.
    """

    matrices: Mapping[str, FloatArray]
    dofs: tuple[str, ...]

    @property
    def lines(self) -> FloatArray:
        """1 Hz to 15 kHz."""
        return np.geomspace(1.0, 15000.0, 400)

    @property
    def alike(self) -> float:
        """Round-off."""
        return EXACT

    @property
    def count(self) -> str:
        """Which."""
        letters = {"mass": "M", "damping": "C", "stiffness": "K"}
        names = ", ".join(letter for name, letter in letters.items() if name in self.matrices)
        return f"{names} of {len(self.dofs)} DoFs"

    def residual(self, system: SecondOrderSystem) -> FloatArray:
        """Entries' differences over their sizes, or over `EXACT` of their DoFs' own."""
        if set(self.dofs) != set(system.dofs):
            raise FbsError("the matrices are of other DoFs than the system")
        order = [system.dofs.index(dof) for dof in self.dofs]
        parts = []
        for name, theirs in self.matrices.items():
            ours = getattr(system, name)[np.ix_(order, order)]
            own = np.abs(np.diag(ours)) + np.abs(np.diag(theirs))
            floor = 1e-6 * np.sqrt(np.outer(own, own))
            size = np.maximum(np.abs(ours) + np.abs(theirs) + floor, np.finfo(float).tiny)
            parts.append(((theirs - ours) / size).ravel())
        return np.concatenate(parts)

    def remainder(self, residual: FloatArray) -> Remainder:
        """Structured beyond round-off."""
        rms = float(np.sqrt(np.mean(residual**2)))
        return Remainder(rms, EXACT, rms > EXACT, float(residual.size))

    def thinned(self) -> MatrixEvidence:
        """All of it: it costs little."""
        return self

    def along(self, system: SecondOrderSystem, slope: Slope, amounts: FloatArray) -> FloatArray:
        """One system after the other."""
        return stepped(self, system, slope, amounts)

    def sensitivities(
        self, system: SecondOrderSystem, changes: Sequence[SecondOrderSystem], steps: FloatArray
    ) -> FloatArray:
        """By differences."""
        return differenced(self, system, changes, steps)
