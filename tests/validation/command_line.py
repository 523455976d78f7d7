"""The command line, called."""

from __future__ import annotations

from validation import cli


def call(*arguments: str) -> int:
    """Run the command line in this process; returns the exit code."""
    try:
        cli.main(list(arguments))
    except SystemExit as exit_:
        return int(exit_.code or 0)
    return 0
