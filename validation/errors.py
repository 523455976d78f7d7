"""What can be wrong with a command."""

from __future__ import annotations

HIGHEST = 1e15  # Hz; far above anything that vibrates, and ω² is a number still


class CommandError(ValueError):
    """A command that cannot be carried out: one message with what, value and what is allowed."""


def ill_conditioned(where: str, error: Exception) -> CommandError:
    """What linear algebra raises (a LinAlgError), as the condition of what it was given."""
    return CommandError(
        f"{where}: linear algebra fails ({error}): its masses, stiffnesses or dampings are too far "
        "apart for double precision"
    )


def require_frequencies(**options: float | None) -> None:
    """Refuse what is no finite frequency (Hz); None is one not given.

    Raises
    ------
    CommandError
        Naming the first such option.
    """
    for name, value in options.items():
        if value is not None and not abs(value) <= HIGHEST:
            raise CommandError(f"--{name} = {value}: must be finite, at most {HIGHEST:g} (Hz)")
