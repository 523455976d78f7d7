"""Forces of a run, sampled piece by piece at the instants an integrator asks for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ModelError
from ..model.excitation import Excitation
from ..signals.lines import Signal
from ..system.drivetrain import MultibodySystem
from .probes import add_force

FloatArray = NDArray[np.float64]


class Loads:
    """The forces at each DoF, sampled for one piece at the integrator's own instants."""

    def __init__(
        self,
        system: MultibodySystem,
        excitations: Sequence[Excitation[Signal]],
        step_rate: float,
        per_step: int,
    ) -> None:
        self.dofs = tuple(dict.fromkeys(excitation.dof for excitation in excitations))
        self._signals = {
            dof: [each.signal for each in excitations if each.dof == dof] for dof in self.dofs
        }
        self._rate, self._per_step = step_rate * per_step, per_step
        self._origin, self._steps = 0.0, 0
        self._samples: dict[str, list[float]] = {dof: [] for dof in self.dofs}
        for dof, samples in self._samples.items():
            add_force(system, dof, self._force(samples))

    def _force(self, samples: list[float]) -> Callable[[Any, float, float], float]:
        def force(mbs: Any, time: float, share: float) -> float:
            return share * samples[round((time - self._origin) * self._rate)]

        return force

    def sample(self, first: int, steps: int) -> None:
        """The forces from step ``first`` to ``first + steps``, both ends included."""
        self._steps, begin = steps, first * self._per_step
        instants = np.arange(begin, begin + steps * self._per_step + 1) / self._rate
        self._origin = float(instants[0])
        for dof, signals in self._signals.items():
            force = np.sum([signal.values(instants) for signal in signals], axis=0)
            if not np.isfinite(force).all():
                wrong = int(np.flatnonzero(~np.isfinite(force))[0])
                raise ModelError(
                    f"excitation at '{dof}': the force is {force[wrong]} at {instants[wrong]:.6g} s"
                )
            self._samples[dof][:] = force.tolist()

    def forces(self, *, last: bool = False) -> FloatArray:
        """(n_step, n_excitation) N at each step's beginning; with ``last`` at the end as well."""
        forces = np.empty((self._steps + 1, len(self.dofs)))
        for column, samples in enumerate(self._samples.values()):
            forces[:, column] = samples[:: self._per_step]
        return forces if last else forces[:-1]
