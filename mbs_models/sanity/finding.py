"""What a rule says of a value."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """A value that is probably not meant.

    Attributes
    ----------
    part
        Stage, inertia, coupling or table of the model file.
    key
        The key in it, dotted.
    value
        The value as a reader of the file knows it, with its unit.
    reason
        What is odd, and what is expected.
    """

    part: str
    key: str
    value: str
    reason: str

    @property
    def place(self) -> tuple[str, str]:
        """What the finding is about: one is enough of each."""
        return self.part, self.key

    def __str__(self) -> str:
        return f"{self.part}: {self.key} = {self.value}: {self.reason}"
