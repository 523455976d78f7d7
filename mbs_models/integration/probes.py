"""What is attached to an exudyn system to run it in time: forces at labels, sensors on nodes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import exudyn as exu
import numpy as np
from exudyn.exudynCPP import NodeIndex
from exudyn.utilities import LoadCoordinate, MarkerNodeCoordinate, SensorNode
from numpy.typing import NDArray

from ..errors import ModelError
from ..system.drivetrain import MultibodySystem

FloatArray = NDArray[np.float64]
# exudyn's user function of a load: (system, time, the load's own value) → value (N).
LoadFunction = Callable[[Any, float, float], float]
INITIAL = exu.ConfigurationType.Initial
CURRENT = exu.ConfigurationType.Current
COORDINATES = (
    exu.OutputVariableType.Coordinates,
    exu.OutputVariableType.Coordinates_t,
    exu.OutputVariableType.Coordinates_tt,
)


def leader(system: MultibodySystem, label: str, what: str) -> tuple[str, float]:
    """The DoF behind a label, and the label's value per unit of it.

    Raises
    ------
    ModelError
        There is none; ``what`` says who asked.
    """
    known = (*(dof.label for dof in system.dofs), *system.derived)
    if label not in known:
        raise ModelError(f"{what} '{label}': no such DoF; known: {', '.join(known)}")
    return system.derived.get(label, (label, 1.0))


def add_force(system: MultibodySystem, label: str, force: LoadFunction) -> None:
    """The force conjugate to a label, on the exudyn coordinates that move with it.

    ``force`` returns its third argument, the coordinate's share, times the force (N).
    """
    followed, ratio = leader(system, label, "excitation at")
    dof = next(dof for dof in system.dofs if dof.label == followed)
    norm = sum(factor**2 for _, _, factor in dof.components)
    mbs = system.mbs
    for node, coordinate, factor in dof.components:
        marker = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))
        share = ratio * factor / norm
        mbs.AddLoad(LoadCoordinate(markerNumber=marker, load=share, loadUserFunction=force))


class NodeSensors:
    """Sensors of the coordinates, and their time derivatives, of every node that has a DoF."""

    def __init__(self, system: MultibodySystem, derivatives: Sequence[int]) -> None:
        self.derivatives = tuple(derivatives)
        self._mbs = system.mbs
        self._size = len(system.mbs.systemData.GetODE2Coordinates(INITIAL))
        nodes = sorted({int(node) for dof in system.dofs for node, _, _ in dof.components})
        self._sensors = {
            (derivative, node): add_sensor(
                system, SensorNode, nodeNumber=NodeIndex(node), kind=COORDINATES[derivative]
            )
            for derivative in derivatives
            for node in nodes
        }

    def read(self, derivative: int) -> FloatArray:
        """(n_step + 1, n_coordinate) of the run that ended last: 0 displacement, 1 velocity, …"""
        columns = {
            self._mbs.GetNodeODE2Index(NodeIndex(node)): stored_samples(self._mbs, sensor)
            for (kind, node), sensor in self._sensors.items()
            if kind == derivative
        }
        values = np.zeros((min(len(samples) for samples in columns.values()), self._size))
        for first, samples in columns.items():
            values[:, first : first + samples.shape[1]] = samples[: len(values)]
        return values


def add_sensor(system: MultibodySystem, sensor: Any, *, kind: Any, **item: Any) -> Any:
    """A sensor that keeps its samples in memory."""
    return system.mbs.AddSensor(
        sensor(storeInternal=True, writeToFile=False, outputVariableType=kind, **item)
    )


def stored_samples(mbs: Any, sensor: Any) -> FloatArray:
    """(n_step + 1, n_value) without the times."""
    samples: FloatArray = mbs.GetSensorStoredData(sensor)[:, 1:]
    return samples


@contextmanager
def as_found(system: MultibodySystem) -> Iterator[None]:
    """Take off again what is attached meanwhile, and put the initial state back.

    Assembling a system, as what is attached asks for, sets its initial state to zero.
    """
    mbs, data = system.mbs, system.mbs.systemData
    loads, sensors = data.NumberOfLoads(), data.NumberOfSensors()
    state, accelerations = data.GetSystemState(INITIAL), data.GetODE2Coordinates_tt(INITIAL)
    try:
        yield
    finally:
        for number in reversed(range(loads, data.NumberOfLoads())):
            mbs.DeleteLoad(number)  # and its marker
        for number in reversed(range(sensors, data.NumberOfSensors())):
            mbs.DeleteSensor(number)
        for mesh in system.meshes.values():
            mesh.samples.sample(0.0, 0.0, 1)
        mbs.Assemble()
        data.SetSystemState(state, INITIAL)
        data.SetODE2Coordinates_tt(accelerations, INITIAL)


def solver_settings(start: float, end: float, steps: int) -> Any:
    """Equal steps from ``start`` to ``end`` (s), every one sampled by the sensors, nothing written.

    Without adaptive steps a time is its step's number times h, not a sum.
    """
    settings = exu.SimulationSettings()
    integration = settings.timeIntegration
    integration.startTime, integration.endTime = start, end
    integration.numberOfSteps = steps
    integration.adaptiveStep = integration.automaticStepSize = False
    integration.verboseMode = 0
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = 0.0
    return settings
