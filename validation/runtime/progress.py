"""How far a study is: what studies are given to tell."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, int, int], None]  # a step's name, how far it is, how far it goes


def silent(_: str, done: int, total: int) -> None:
    """Tell nobody."""
