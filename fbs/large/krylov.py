"""FRFs of large systems over a band: a Galerkin model that meets the solution at a few lines."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._kernels.checks import ComplexArray, FloatArray, ascending_frequency, read_only
from .._kernels.door import door
from .._kernels.elimination import EPS
from ..damped_modes import ComplexModes, complex_modes, is_proportional, modal_damping
from ..errors import FbsError, first_few, singular_dynamic_stiffness
from ..frf import Frf, Quantity
from ..modal_synthesis import modal_frf
from ..second_order_system import SecondOrderSystem
from ..undamped_modes import SYMMETRY_TOLERANCE, RealModes, real_modes
from .sparse_system import DynamicStiffness, SparseSystem

if TYPE_CHECKING:
    from scipy.sparse import csc_array

BLOCK = 512
"""Lines evaluated at once."""

SKETCH = 32
"""Random projections of a residual: chi^2 of 32 falls below a ninth with P = 1e-10, so that the
norm is not underestimated by more than a factor of 3 on any line."""

SCOUTED = 600
"""Lines looked at while the model is coarse; all of them are once these are accurate."""

SAFETY = 4.0
"""Of the estimate over the largest ratio of error to residual that was measured."""

LEARNT = 8
"""How many of the last ratios count: the coarse models before were another matter."""

PARTS = 4
"""Parts of the band that get a line each in every step, which saves evaluations."""

UNKNOWN = 1e100
"""The ratio before any was measured: no model is accurate enough."""

NEAR_POLE = 1e7
"""Equilibrated response above which a line may lie on an undamped pole: it is solved directly."""


class ReductionError(FbsError):
    """A reduced model does not reach the accuracy asked for."""


@dataclass(frozen=True, eq=False)
class ReducedFrf:
    """What `reduced_frf` returns.

    Parameters
    ----------
    frf : Frf
    error_estimate : array, shape (nf,)
        Of the scaled error |dH_ij| / sqrt(h_i h_j), h_i the norm of row i of H between the DoFs
        asked for, with what round-off leaves: eps times the condition of Z, so that it may
        exceed the tolerance next to an undamped pole, or near 0 Hz of a system free to move.
    system : SecondOrderSystem
        The reduced model; the DoFs asked for are its first coordinates, by their own labels.
    vectors : array, shape (n, order)
        V: x = V q of its coordinates q. `galerkin_bound` guarantees what it can of them.
    expansion : array, Hz
        Lines where the model was made to meet the direct solution.
    checked : array, Hz
        Lines the model never used, where it was compared with the direct solution.
    checked_error : array
        Scaled errors found there, beyond the round-off of the direct solution.
    """

    frf: Frf
    error_estimate: FloatArray
    system: SecondOrderSystem
    vectors: FloatArray
    expansion: FloatArray
    checked: FloatArray
    checked_error: FloatArray


@door
def reduced_frf(
    system: SparseSystem,
    frequency: ArrayLike,
    responses: Iterable[str],
    excitations: Iterable[str],
    quantity: Quantity | str = Quantity.RECEPTANCE,
    tolerance: float = 1e-8,
    largest: int | None = None,
) -> ReducedFrf:
    """Project on V = span of Re, Im Z(w_k)^-1 F: H = F^T V (V^T Z(w) V)^-1 V^T F.

    A rational Krylov (second-order, one moment per point) model with points chosen greedily where
    the residual is largest (Grimme 1997, Krylov projection methods for model reduction). F holds
    the unit forces at every DoF asked for, response or excitation: the matrices being symmetric,
    the error is then of second order,

        dH_ij = rho_i^T Z^-1 rho_j,  rho_j = f_j - Z V (V^T Z V)^-1 V^T f_j.

    Its estimate on every line is eta a max_j |rho_j|^2 / h_j, a the amplification of the nearest
    resonance in the DoFs asked for. |rho_j| is the norm of the residual scaled by the springs and
    inertias at each DoF, found from `SKETCH` random projections of the residual itself (Balabanov
    & Nouy 2019, Randomized linear algebra for model reduction, Adv. Comput. Math. 45), which does
    not cancel as a Gram matrix of residuals would. eta, with a factor `SAFETY` over it, is
    measured where the solution is known, at lines not used before. The model is refined until the
    estimate is below `tolerance` on every line, and lines never used, the least accurate by the
    estimate and those nearest to poles, prove it by a direct solution.

    Parameters
    ----------
    system : SparseSystem
        M, C, K symmetric; M positive definite, K positive semi-definite.
    frequency : array, shape (nf,), Hz
    responses, excitations : labels
    quantity : Quantity
    tolerance : float
        Largest scaled error; 1e-10 is near what round-off leaves.
    largest : int, optional
        Largest order of the reduced model; default: that of the system.

    Raises
    ------
    ReductionError
        The tolerance is not reached.
    SingularLineError
        A line on an undamped pole, or at 0 Hz of a system free to move.
    UnknownDofError, IndefiniteMassError, IndefiniteStiffnessError, FbsError
    """
    axis = ascending_frequency(frequency)
    rows, columns = tuple(responses), tuple(excitations)
    asked = list(dict.fromkeys(system.locate(rows)[0] + system.locate(columns)[0]))
    if not 0 < tolerance < 1:
        raise FbsError(f"the tolerance must be between 0 and 1, got {tolerance}")
    for name in ("mass", "damping", "stiffness"):
        _require_symmetry(getattr(system, name), name)
    search = _Search(system, axis, asked, tolerance, largest or len(system.dofs))
    model, estimate = search.run()
    labels = {
        label: system.derived[label] for label in (*rows, *columns) if label in system.derived
    }
    reduced = model.system(labels)
    return ReducedFrf(
        modal_frf(reduced, axis, rows, columns, quantity),
        read_only(estimate),
        reduced,
        read_only(model.vectors),
        read_only(axis[sorted(search.used)]),
        read_only(axis[list(search.checks)]),
        read_only(np.array(list(search.checks.values()))),
    )


def _require_symmetry(matrix: csc_array, name: str) -> None:
    size = np.sqrt(np.abs(matrix.diagonal()))
    difference = abs(matrix - matrix.T).tocoo()
    i, j = difference.coords
    excess = difference.data > SYMMETRY_TOLERANCE * size[i] * size[j]
    if excess.any():
        where = int(i[excess][0]), int(j[excess][0])
        raise FbsError(
            f"the {name} matrix is not symmetric at {where}; a reduced model needs symmetry "
            "(use sparse_frf)"
        )


@dataclass(frozen=True, eq=False)
class _Model:
    """The projection on V = [unit vectors of the DoFs asked for, basis]."""

    full: SparseSystem
    asked: list[int]
    weight: FloatArray  # d_i^(-1/2): residuals and basis are judged in x sqrt(d), f / sqrt(d)
    sketch: FloatArray  # (SKETCH, n)
    basis: FloatArray  # (n, r), columns orthonormal once divided by `weight`

    @property
    def order(self) -> int:
        return len(self.asked) + int(self.basis.shape[1])

    def extended(self, solution: NDArray[Any]) -> _Model:
        """Return the model that also contains a solution's real and imaginary parts."""
        parts = [solution.real, solution.imag] if np.iscomplexobj(solution) else [solution]
        fresh = np.hstack(parts) / self.weight[:, None]
        fresh[self.asked] = 0.0  # the unit vectors stand for them
        fresh = fresh[:, np.abs(fresh).max(axis=0) > 0]
        fresh = fresh / np.linalg.norm(fresh, axis=0)
        known = self.basis / self.weight[:, None]
        for _ in range(2):  # the second pass removes the first's round-off
            fresh = fresh - known @ (known.T @ fresh)
        left, size, _ = np.linalg.svd(fresh, full_matrices=False)
        room = len(self.weight) - self.order
        fresh = left[:, :room][:, size[:room] > 1e-13]
        fresh[self.asked] = 0.0  # where a singular value is small, zeros come back as round-off
        fresh = fresh - known @ (known.T @ fresh)
        fresh, _ = np.linalg.qr(fresh)
        basis = np.hstack([self.basis, fresh * self.weight[:, None]])
        return _Model(self.full, self.asked, self.weight, self.sketch, basis)

    @property
    def vectors(self) -> FloatArray:
        unit = np.zeros((len(self.weight), len(self.asked)))
        unit[self.asked, range(len(self.asked))] = 1.0
        return np.hstack([unit, self.basis])

    def system(self, derived: dict[str, tuple[str, float]] | None = None) -> SecondOrderSystem:
        v = self.vectors
        projected = (
            v.T @ (matrix @ v)
            for matrix in (self.full.mass, self.full.damping, self.full.stiffness)
        )
        mass, damping, stiffness = ((matrix + matrix.T) / 2 for matrix in projected)
        names = (*(self.full.dofs[k] for k in self.asked), *self._numbered())
        return SecondOrderSystem(
            mass, damping, stiffness, names, derived or {}, self.full.loss_factor
        )

    def _numbered(self) -> Iterable[str]:
        return (f"krylov {k}" for k in range(1, self.basis.shape[1] + 1))

    def sketches(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the sketched, scaled M V, C V and K V, shape (SKETCH, order)."""
        v, s = self.vectors, self.sketch * self.weight
        full = self.full
        return s @ (full.mass @ v), s @ (full.damping @ v), s @ (full.stiffness @ v)


@dataclass(frozen=True, eq=False)
class _Evaluation:
    """A model on some lines: the FRFs between the DoFs asked for, and the indicator."""

    values: ComplexArray  # (nf, n_asked, n_asked)
    indicator: FloatArray  # (1 + response) max over j of |rho_j|^2 / h_j
    response: FloatArray  # the largest equilibrated |H_ii|

    @property
    def round_off(self) -> FloatArray:
        """What round-off leaves of the scaled error: eps times the condition of Z."""
        return 4 * EPS * (1 + self.response)


@dataclass(eq=False)
class _Search:
    """The greedy choice of expansion lines, and what it has learnt."""

    system: SparseSystem
    axis: FloatArray
    asked: list[int]
    tolerance: float
    largest: int
    used: set[int] = field(default_factory=set)
    ratios: list[float] = field(default_factory=list)
    checks: dict[int, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.stiffness = DynamicStiffness.of(self.system)

    def run(self) -> tuple[_Model, FloatArray]:
        """Return a model accurate on every line, and its error estimate."""
        model = self._started()
        scouts = np.unique(np.linspace(0, self.axis.size - 1, SCOUTED).astype(int))
        every = np.arange(self.axis.size)
        candidates = scouts
        while True:
            evaluation = self._evaluate(model, candidates)
            if len(self.used) == self.axis.size:  # the model meets every line's solution
                return model, evaluation.round_off
            if not self._estimate(evaluation).max() <= self.tolerance:
                model = self._refined(model, evaluation, candidates)
            elif candidates.size < every.size:
                candidates = every
            else:
                accurate, model = self._proved(model, evaluation)
                if accurate:
                    return model, self._estimate(evaluation) + evaluation.round_off

    def _started(self) -> _Model:
        n, centre = len(self.system.dofs), 2 * np.pi * self.axis[-1]
        mass, _, stiffness = self.stiffness.diagonals
        size = stiffness + centre**2 * mass
        rng = np.random.default_rng(0)
        sketch = rng.standard_normal((SKETCH, n)) / np.sqrt(SKETCH)
        model = _Model(self.system, self.asked, 1 / np.sqrt(size), sketch, np.zeros((n, 0)))
        first = sorted({0, self.axis.size // 2, self.axis.size - 1})
        for line, solution in self._solved(first).items():
            self.used.add(line)
            model = model.extended(solution)
        return model

    def _solved(self, lines: Iterable[int]) -> dict[int, NDArray[Any]]:
        """Solve lines directly; name those that are singular."""
        found = {k: self.stiffness.solve(2 * np.pi * self.axis[k], self.asked) for k in lines}
        singular = [k for k, solution in found.items() if solution is None]
        if singular:
            raise singular_dynamic_stiffness(self.axis[singular])
        return {k: solution for k, solution in found.items() if solution is not None}

    def _evaluate(self, model: _Model, lines: NDArray[np.intp]) -> _Evaluation:
        reduced = model.system()
        modes = _modes(reduced)
        sketches = model.sketches()
        blocks = [
            _evaluated(model, reduced, modes, sketches, self.axis[lines[k : k + BLOCK]])
            for k in range(0, lines.size, BLOCK)
        ]
        values, indicator, response = (np.concatenate(part) for part in zip(*blocks, strict=True))
        indicator[np.isin(lines, list(self.used))] = 0.0  # there it meets the solution
        return _Evaluation(values, indicator, response)

    def _estimate(self, evaluation: _Evaluation) -> FloatArray:
        return SAFETY * max(self.ratios[-LEARNT:], default=UNKNOWN) * evaluation.indicator

    def _unused(self, lines: NDArray[np.intp], measure: FloatArray) -> list[int]:
        """Return where in each part of the band the measure is largest and nothing was solved."""
        fresh = np.flatnonzero(~np.isin(lines, list(self.used)))
        parts = np.array_split(fresh, PARTS)
        return [int(part[np.argmax(measure[part])]) for part in parts if part.size]

    def _refined(self, model: _Model, evaluation: _Evaluation, lines: NDArray[np.intp]) -> _Model:
        """Return the model with more lines solved: the worst of each part of the band."""
        estimate = self._estimate(evaluation)
        places = self._unused(lines, estimate)
        worst = max(places, key=lambda place: float(evaluation.indicator[place]))
        chosen = [place for place in places if place == worst or estimate[place] > self.tolerance]
        solutions = self._solved(int(lines[place]) for place in chosen)
        errors = [self._learn(evaluation, place, solutions[int(lines[place])]) for place in chosen]
        return self._grown(model, solutions, max(errors) <= self.tolerance)

    def _learn(self, evaluation: _Evaluation, place: int, solution: NDArray[Any]) -> float:
        """Return the true scaled error at a line not used yet, and note error / indicator.

        The direct solution has round-off of its own; only what is beyond it counts.
        """
        exact = solution[self.asked]
        row = np.linalg.norm(exact, axis=1)
        scale = np.sqrt(np.outer(row, row))
        error = float((np.abs(evaluation.values[place] - exact) / scale).max())
        error = max(error - float(evaluation.round_off[place]), 0.0)
        indicator = float(evaluation.indicator[place])
        # where both are small, their ratio is one of round-off
        if error > self.tolerance / 100 or indicator >= 0.01 * evaluation.indicator.max():
            self.ratios.append(error / max(indicator, np.finfo(float).tiny))
        return error

    def _grown(
        self, model: _Model, solutions: Mapping[int, NDArray[Any]], accurate: bool
    ) -> _Model:
        """Return the model with more solutions; one that is accurate may have them already."""
        larger = model
        for solution in solutions.values():
            larger = larger.extended(solution)
        self.used.update(solutions)
        stuck = larger.order == model.order and not accurate
        if stuck or larger.order > self.largest:
            raise ReductionError(
                f"a reduced model of order {model.order} (of {len(self.system.dofs)}, at most "
                f"{self.largest}) does not reach the tolerance {self.tolerance:g} at "
                f"{first_few(self.axis[sorted(solutions)])} Hz; expanded at "
                f"{first_few(self.axis[sorted(self.used)])} Hz: raise the tolerance or the "
                "order, narrow the band, or use sparse_frf"
            )
        return larger

    def _proved(self, model: _Model, evaluation: _Evaluation) -> tuple[bool, _Model]:
        """Compare with the direct solution where it was not used; refine where that fails.

        These lines are the worst by the estimate and by response, and all near poles.
        """
        every = np.arange(self.axis.size)
        near = np.flatnonzero(evaluation.response > NEAR_POLE)
        chosen = [
            *self._unused(every, evaluation.indicator),
            *self._unused(every, evaluation.response),
            *near[~np.isin(near, list(self.used))].tolist(),
        ]
        solutions = self._solved(dict.fromkeys(chosen))
        errors = {k: self._learn(evaluation, k, x) for k, x in solutions.items()}
        failed = [k for k, error in errors.items() if not error <= self.tolerance]
        if not failed and self._estimate(evaluation).max() <= self.tolerance:
            self.checks = errors
            return True, model
        added = failed or [max(errors, key=lambda k: errors[k])]
        model = self._grown(model, {k: solutions[k] for k in added}, not failed)
        return False, model


def _modes(system: SecondOrderSystem) -> RealModes | ComplexModes:
    """Solve once what `modal_frf` would solve for every block of lines."""
    real = real_modes(system)
    proportional = is_proportional(modal_damping(real, system.damping))
    return real if proportional else complex_modes(system, real)


def _evaluated(
    model: _Model,
    reduced: SecondOrderSystem,
    modes: RealModes | ComplexModes,
    sketches: tuple[FloatArray, FloatArray, FloatArray],
    axis: FloatArray,
) -> tuple[ComplexArray, FloatArray, FloatArray]:
    n = len(model.asked)
    frf = modal_frf(reduced, axis, reduced.dofs, reduced.dofs[:n], modes=modes)
    solution = frf.values.transpose(1, 2, 0)  # (order, n_asked, nf)
    flat = solution.reshape(len(solution), -1)
    omega = np.tile(2 * np.pi * axis, n)
    mass, damping, stiffness = (
        (sketch @ flat.real + 1j * (sketch @ flat.imag)) for sketch in sketches
    )
    dynamic = stiffness * (1 + 1j * reduced.loss_factor) - omega**2 * mass + 1j * omega * damping
    force = (model.sketch * model.weight)[:, model.asked]
    residual = np.repeat(force, axis.size, axis=1) - dynamic
    square = (np.abs(residual) ** 2).sum(axis=0).reshape(n, axis.size)
    h = np.linalg.norm(solution[:n], axis=1)  # (n_asked, nf)
    driven = np.abs(solution[range(n), range(n)]) / model.weight[model.asked, None] ** 2
    response = driven.max(axis=0)
    return frf.values[:, :n], (square / h).max(axis=0) * (1 + response), response
