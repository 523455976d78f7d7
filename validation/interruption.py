"""Ctrl-C: an interrupt, whatever it was made of on its way, that says what it left."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sys import UnraisableHookArgs

AGAIN_SECONDS = 0.01  # long for a destructor to end, short for whoever waits


class Interrupted(KeyboardInterrupt):
    """Ctrl-C, with what is left of the command."""


@contextmanager
def on_interrupt(left: str) -> Iterator[None]:
    """Turn an interrupt inside into `Interrupted`, with what it leaves; the innermost one says.

    C code that runs Python in its course, as an extension module does while it is imported, makes
    an error of its own of a KeyboardInterrupt, which then is that error's cause.

    Raises
    ------
    Interrupted
        For a KeyboardInterrupt, and for what is caused by one.
    """
    try:
        yield
    except Interrupted:
        raise
    except (KeyboardInterrupt, Exception) as error:
        if not _of_interrupt(error):
            raise
        raise Interrupted(left) from error


@contextmanager
def unheard_interrupts_again() -> Iterator[None]:
    """Raise Ctrl-C again where Python drops it, in the callbacks of its garbage collection."""
    others = sys.unraisablehook

    def hook(dropped: UnraisableHookArgs) -> None:
        if not issubclass(dropped.exc_type, KeyboardInterrupt):
            others(dropped)
            return
        again = threading.Timer(AGAIN_SECONDS, signal.raise_signal, (signal.SIGINT,))
        again.daemon = True
        again.start()

    sys.unraisablehook = hook
    try:
        yield
    finally:
        sys.unraisablehook = others


def _of_interrupt(error: BaseException | None) -> bool:
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__
    return error is not None
