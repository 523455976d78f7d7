"""Tables on the terminal."""

from __future__ import annotations

from rich.console import Console


def console() -> Console:
    """Where tables are printed; wide in a file or a pipe."""
    made = Console()
    # A table cut to 80 columns in a file or a pipe would hide what it is read for.
    return made if made.is_terminal else Console(width=160)
