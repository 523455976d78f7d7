"""Natural frequencies as a table lists them: repeated ones once, with kind and multiplicity."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from mbs_models.modal.mode_kinds import REPEATED, Kind, Mode

from .printed_values import PrintedMode


@dataclass(frozen=True)
class Line:
    """A natural frequency (Hz), how often it occurs, and what motion it is."""

    frequency_hz: float
    multiplicity: int
    kind: Kind

    def __str__(self) -> str:
        repeated = f"({self.multiplicity})" if self.multiplicity > 1 else ""
        return f"{self.frequency_hz:.1f}{repeated} Hz"


def spectrum(modes: Iterable[Mode]) -> tuple[Line, ...]:
    """Ascending modes, those of one kind and (to round-off) one frequency taken together."""
    lines: list[Line] = []
    for mode in modes:
        f = mode.frequency_hz
        near = max(REPEATED * f, 2.0 * mode.round_off_hz)
        twin = next(
            (line for line in lines if line.kind == mode.kind and f - line.frequency_hz <= near),
            None,
        )
        if twin is None or f == 0.0 != twin.frequency_hz:
            lines.append(Line(f, 1, mode.kind))
        else:
            lines[lines.index(twin)] = Line(twin.frequency_hz, twin.multiplicity + 1, twin.kind)
    return tuple(lines)


def matches(printed: PrintedMode, line: Line, tolerance_hz: float) -> bool:
    """Whether a line is at the printed frequency, as often as printed, whatever its kind."""
    return (
        abs(line.frequency_hz - printed.frequency_hz) <= tolerance_hz
        and line.multiplicity == printed.multiplicity
    )
