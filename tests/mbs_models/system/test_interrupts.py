"""Ctrl-C while exudyn computes is Ctrl-C, wherever in exudyn it comes."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from typing import Any

import exudyn as exu
import pytest
from exudyn.itemInterface import LoadCoordinate, MarkerNodeCoordinate, Node1D, ObjectMass1D

from mbs_models.interrupts import interrupts_held

STEPS = 1_000_000  # a fifth of a second; with a load in Python four times that


def mass_under(force: Callable[[Any, float, float], float] | None) -> Any:
    system = exu.SystemContainer().AddSystem()
    node = system.AddNode(
        Node1D(referenceCoordinates=[0.0], initialCoordinates=[0.0], initialVelocities=[0.0])
    )
    system.AddObject(ObjectMass1D(mass=1.0, nodeNumber=node))
    marker = system.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
    if force is not None:
        system.AddLoad(LoadCoordinate(markerNumber=marker, load=1.0, loadUserFunction=force))
    system.Assemble()
    return system


def solve(system: Any) -> None:
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps, settings.timeIntegration.endTime = STEPS, 1.0
    settings.solution.file.write = False
    with interrupts_held(system):
        system.SolveDynamic(settings)


def again_and_again(system: Any) -> None:
    while True:
        solve(system)


def interrupting(step: int) -> Callable[[Any, float, float], float]:
    """A force with an interrupt in it that comes once, where round() asks for a number."""
    interrupts = iter([signal.SIGINT])

    class Time(float):
        def __round__(self) -> int:  # type: ignore[override]
            if self * STEPS > step:
                for interrupt in interrupts:
                    signal.raise_signal(interrupt)
            return 0

    return lambda mbs, time, share: share + round(Time(time))


def test_an_interrupt_in_a_load_is_one(capfd: pytest.CaptureFixture[str]) -> None:
    """What it raises in round() is a SystemError to C++, of which exudyn makes a ModelError."""
    system = mass_under(interrupting(STEPS // 2))
    with pytest.raises(KeyboardInterrupt):
        solve(system)
    ended = system.systemData.GetTime()
    assert 0.5 < ended < 0.50001  # s: the step in which it came was the last
    told = capfd.readouterr()
    assert told.out + told.err == ""
    solve(system)  # it is done with
    assert system.systemData.GetTime() == pytest.approx(1.0, rel=1e-9)


def test_an_interrupt_without_any_python_is_one() -> None:
    """exudyn looks for signals itself and raises what comes of them."""
    system = mass_under(None)
    soon = threading.Timer(0.05, signal.raise_signal, (signal.SIGINT,))
    soon.start()
    with pytest.raises(KeyboardInterrupt):
        again_and_again(system)
    soon.join()


def test_who_handles_interrupts_outside_does_it() -> None:
    heard: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, frame: heard.append(number))
    try:
        solve(mass_under(interrupting(STEPS // 2)))
        assert heard == [signal.SIGINT]
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        system = mass_under(interrupting(STEPS // 2))
        solve(system)
        assert system.systemData.GetTime() == pytest.approx(1.0, rel=1e-9)
    finally:
        signal.signal(signal.SIGINT, before)


def test_another_error_stays_one() -> None:
    def broken(mbs: Any, time: float, share: float) -> float:
        raise ValueError("of its own")

    with pytest.raises(exu.ExudynError, match="of its own"):
        solve(mass_under(broken))


def test_threads_are_let_alone() -> None:
    """Python delivers signals to its main thread only, and allows handlers there only."""
    failed: list[BaseException] = []

    def run() -> None:
        try:
            solve(mass_under(None))
        except BaseException as error:
            failed.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    assert not failed
