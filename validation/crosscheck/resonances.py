"""What a cross-check says of resonances: crossings over a speed range, margins at one speed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from mbs_models.gears.orders import Order, orders
from mbs_models.gears.resonances import CLOSE, Crossing, Margin, crossings, margins
from mbs_models.modal.mode_kinds import Modes
from mbs_models.model.parameters import Drivetrain, Operation
from mbs_models.system.components import Components

LISTED = 30  # crossings in the table


@dataclass(frozen=True)
class Resonances:
    """Orders of a drivetrain's input, and what they meet.

    Attributes
    ----------
    operation
        The input, and how it turns.
    speed_range
        The speeds looked at (rpm): the operation's, and what is close to its operating speed.
    orders
        Of shafts and meshes.
    crossings
        Within those speeds, the largest share first.
    margins
        At the operating speed, the closest first; empty where none is given.
    """

    operation: Operation
    speed_range: tuple[float, float]
    orders: tuple[Order, ...]
    crossings: tuple[Crossing, ...]
    margins: tuple[Margin, ...]

    @property
    def speed_rpm(self) -> float | None:
        """The operating speed, whichever way the input turns."""
        return None if self.operation.speed is None else abs(self.operation.speed)

    @property
    def close(self) -> tuple[Margin, ...]:
        """Margins that are called out."""
        return tuple(margin for margin in self.margins if margin.close)

    @property
    def listed(self) -> tuple[Crossing, ...]:
        """Crossings that are resonances, those with most energy."""
        return tuple(crossing for crossing in self.crossings if crossing.telling)[:LISTED]

    @property
    def suppressed(self) -> int:
        """How many more would be but for planet phasing."""
        return sum(crossing.suppressed for crossing in self.crossings)


def resonances(drivetrain: Drivetrain, parts: Components, modes: Modes) -> Resonances | None:
    """Crossings and margins; None where no operation is given or the input cannot turn freely."""
    operation = drivetrain.operation
    found = orders(drivetrain, parts)
    if operation is None or not found:
        return None
    first, last = operation.speed_range
    near: tuple[Margin, ...] = ()
    if operation.speed is not None:
        speed = abs(operation.speed)
        first, last = min(first, (1.0 - CLOSE) * speed), max(last, (1.0 + CLOSE) * speed)
        near = margins(found, modes, parts, speed)
    met = crossings(found, modes, parts, (first, last))
    return Resonances(operation, (first, last), found, met, near)


def phasing_rules(found: tuple[Order, ...]) -> Iterator[tuple[str, str]]:
    """(Order, "×1 ×2 translational, ×3 rotational"): what each harmonic excites in its stage."""
    for order in found:
        rules = [(rule.excited, rule.harmonic) for rule in order.phasing]
        looked_at = [rule for rule in rules if rule[1] in order.harmonics]
        runs = groupby(looked_at, key=lambda rule: rule[0])
        kinds = [f"{' '.join(f'×{number}' for _, number in run)} {kind}" for kind, run in runs]
        if kinds:
            yield order.name, ", ".join(kinds)


def crossings_document(found: Resonances | None) -> list[dict[str, Any]]:
    """The crossings as results.json has them."""
    return [
        {
            "order": crossing.order.name,
            "harmonic": crossing.harmonic,
            "per_turn": crossing.harmonic * crossing.order.factor,
            "speed_rpm": crossing.speed_rpm,
            "frequency_hz": crossing.frequency_hz,
            "mode": crossing.mode + 1,
            "energy_share": crossing.energy,
            "excited_share": crossing.share,
        }
        for crossing in (found.crossings if found else ())
    ]


def margins_document(found: Resonances | None) -> dict[str, Any] | None:
    """The margins at the operating speed as results.json has them."""
    if found is None or found.speed_rpm is None:
        return None
    return {
        "input": found.operation.input,
        "speed_rpm": found.speed_rpm,
        "close_within": CLOSE,
        "margins": [
            {
                "order": margin.order.name,
                "harmonic": margin.harmonic,
                "order_hz": margin.order_hz,
                "mode": margin.mode + 1,
                "repeated": margin.repeated,
                "mode_hz": margin.mode_hz,
                "kind": str(margin.kind),
                "excited_share": margin.share,
                "speed_change": margin.change,
            }
            for margin in found.margins
        ],
    }
