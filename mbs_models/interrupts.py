"""Ctrl-C while exudyn computes.

exudyn runs Python inside its solvers: loads, force laws, its own look at Ctrl-C. What an interrupt
raises there comes out as whatever the surrounding C++ makes of it: an error of exudyn's, a
SystemError of a result with an exception set, or nothing at all.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any


@contextmanager
def interrupts_held(mbs: Any) -> Iterator[None]:
    """Let Ctrl-C end a solver of exudyn's after its step, and raise it once that has returned.

    What handles interrupts outside does so then: by default it raises KeyboardInterrupt. Where
    there is no such handler, or in a thread, which gets no signals, nothing is changed.

    Parameters
    ----------
    mbs
        exudyn's system that is solved inside.
    """
    outside = signal.getsignal(signal.SIGINT)
    if not callable(outside) or threading.current_thread() is not threading.main_thread():
        yield
        return
    held = False

    def hold(number: int, frame: FrameType | None) -> None:
        nonlocal held
        held = True
        mbs.SetRenderEngineStopFlag(True)

    signal.signal(signal.SIGINT, hold)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, outside)
        if held:
            mbs.SetRenderEngineStopFlag(False)
            signal.raise_signal(signal.SIGINT)
