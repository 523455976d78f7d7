"""The Campbell diagram and its tables: natural frequencies against orders over speed."""

from __future__ import annotations

from dataclasses import dataclass

from mbs_models.gears.resonances import Crossing

from .campbell_figure import campbell_figure
from .resonances import Resonances, phasing_rules, resonances
from .results import CrossCheck

LISTED = 30  # crossings in the table


@dataclass(frozen=True)
class Campbell:
    """The picture, and what is listed under it.

    Attributes
    ----------
    svg
        The picture.
    found
        Orders, crossings and margins.
    listed
        Crossings that are resonances, those with most energy.
    suppressed
        How many more would be but for planet phasing.
    rules
        Mesh order → what its harmonics excite, where planet phasing tells.
    """

    svg: str
    found: Resonances
    listed: tuple[Crossing, ...]
    suppressed: int
    rules: tuple[tuple[str, str], ...]


def draw_campbell(result: CrossCheck) -> Campbell | None:
    """The diagram of a drivetrain whose operation is given, if its input can turn freely."""
    found = resonances(result)
    if found is None:
        return None
    telling = tuple(crossing for crossing in found.crossings if crossing.telling)
    return Campbell(
        svg=campbell_figure(found, result.modes.modes),
        found=found,
        listed=telling[:LISTED],
        suppressed=sum(crossing.suppressed for crossing in found.crossings),
        rules=tuple(phasing_rules(found.orders)),
    )
