"""How long each step of a study takes."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter
from typing import TypeVar

T = TypeVar("T")


class Clock:
    """Seconds by step."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    def timed(self, name: str, step: Callable[[], T]) -> T:
        """Run a step and note how long it took."""
        began = perf_counter()
        result = step()
        self.seconds[name] = perf_counter() - began
        return result
