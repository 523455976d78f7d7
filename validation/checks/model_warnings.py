"""What a model allows but probably does not mean."""

from __future__ import annotations

from mbs_models.model.parameters import Drivetrain

from ..routes import equations


def model_warnings(drivetrain: Drivetrain) -> tuple[str, ...]:
    """What a model allows but probably does not mean: parts apart, loops that lock."""
    loops = tuple(
        f"coupling '{name}' closes a loop whose radii contradict each other: the mechanism is "
        "locked, nothing turns freely; without it the train would"
        for name in equations.locking_couplings(drivetrain)
    )
    return (*drivetrain.warnings(), *loops)
