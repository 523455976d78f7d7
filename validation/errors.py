"""What can be wrong with a command."""


class CommandError(ValueError):
    """A command that cannot be carried out: one message with what, value and what is allowed."""
