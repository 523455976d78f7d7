"""Ctrl-C or SIGTERM: an interrupt, whatever becomes of it on its way, that says what it left."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sys import UnraisableHookArgs

AGAIN_SECONDS = 0.01  # long for a destructor to end, short for whoever waits


class Interrupted(KeyboardInterrupt):
    """Ctrl-C, with what is left of the command."""


@contextmanager
def on_interrupt(left: str) -> Iterator[None]:
    """Turn an interrupt inside into `Interrupted`, with what it leaves; the innermost one says.

    Raises
    ------
    Interrupted
        For a KeyboardInterrupt.
    """
    try:
        yield
    except Interrupted:
        raise
    except KeyboardInterrupt as error:
        raise Interrupted(left) from error


@contextmanager
def interrupts_later() -> Iterator[None]:
    """Hold Ctrl-C and SIGTERM until this is over; Ctrl-C never comes to processes started inside.

    An interrupt between the taking of a lock and what lets go of it leaves it taken, in the
    standard library's executors, too; and a terminal sends Ctrl-C to a process that has just begun,
    which would end in a traceback.
    """
    if threading.current_thread() is not threading.main_thread():
        yield  # there are none
        return
    heard: list[int] = []
    handlers = {
        number: handler
        for number in (signal.SIGINT, signal.SIGTERM)
        if (handler := signal.getsignal(number)) is not None  # not Python's
    }
    for number in handlers:
        signal.signal(number, lambda number, _: heard.append(number))
    try:
        with _kept_from_children():
            yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        if heard:
            signal.raise_signal(heard[0])


@contextmanager
def _kept_from_children() -> Iterator[None]:
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # which they inherit
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def every_interrupt() -> Iterator[None]:
    """Let no Ctrl-C inside get lost, nor pass for something else; SIGTERM is one, too.

    C code that runs Python in its course, as an extension module does while it is imported, makes
    an error of its own of a KeyboardInterrupt: what is raised after a Ctrl-C is one here. What
    Python drops, in the callbacks of its garbage collection, is raised again.

    Raises
    ------
    KeyboardInterrupt
        For any exception after a Ctrl-C.
    """
    handler, hook = signal.getsignal(signal.SIGINT), sys.unraisablehook
    if not callable(handler) or threading.current_thread() is not threading.main_thread():
        yield  # there are none
        return
    heard = False
    timers: list[threading.Timer] = []

    def noting(number: int, frame: FrameType | None) -> None:
        nonlocal heard
        heard = True
        handler(number, frame)

    def again(dropped: UnraisableHookArgs) -> None:
        if not issubclass(dropped.exc_type, KeyboardInterrupt):
            hook(dropped)
            return
        later = threading.Timer(AGAIN_SECONDS, signal.raise_signal, (signal.SIGINT,))
        later.daemon = True
        later.start()
        timers.append(later)

    signal.signal(signal.SIGINT, noting)
    ended = signal.signal(signal.SIGTERM, lambda *_: signal.raise_signal(signal.SIGINT))
    sys.unraisablehook = again
    try:
        yield
    except Exception as error:  # whatever C code made of it
        if heard:
            raise KeyboardInterrupt from error
        raise
    finally:
        sys.unraisablehook = hook
        signal.signal(signal.SIGTERM, ended)
        # what is still to be raised again would end the process, which ends already
        signal.signal(signal.SIGINT, lambda *_: None)
        for timer in timers:
            timer.cancel()
            timer.join()
        signal.signal(signal.SIGINT, handler)
