"""What is asked of a comparison of reductions, checked before anything is computed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from fbs import Tolerance
from mbs_models.model.parameters import Drivetrain

from ..errors import CommandError
from ..routes.bands import Band
from ..routes.routes import known_part
from ..routes.source import Source, equations_source
from ..routes.substitution import interface_labels
from ..truncation.plan import LENT, parse_band, parse_tolerance

BAND = "10:4000:10"


@dataclass(frozen=True)
class ReductionPlan:
    """A comparison of reductions as laid out.

    Attributes
    ----------
    drivetrain, stage
        Which stage of what.
    ports
        DoFs that stay, and between which FRFs are compared.
    band
        The lines.
    tolerance
        What the FRFs must meet.
    sizes
        Numbers of coordinates to try; empty: some of all there are.
    loss_factor
        Lent to a drivetrain without damping; 0 otherwise.
    """

    drivetrain: Drivetrain
    stage: str
    ports: tuple[str, ...]
    band: Band
    tolerance: Tolerance
    sizes: tuple[int, ...] = ()
    loss_factor: float = 0.0

    @property
    def notes(self) -> tuple[str, ...]:
        """What was assumed."""
        if not self.loss_factor:
            return ()
        return (
            f"the model has no damping: a loss factor of {100 * self.loss_factor:g} % is lent to "
            "the stage, so that errors at resonances are finite and can be bounded",
        )


def plan(
    drivetrain: Drivetrain,
    stage: str,
    *,
    band: str | None = None,
    tolerance: str = "0.1dB",
    dofs: Sequence[str] = (),
    sizes: str | None = None,
) -> ReductionPlan:
    """Lay a comparison of reductions out; the options as typed.

    Parameters
    ----------
    dofs
        Of the stage, beside those where it is coupled; none: the rotation of its first body.

    Raises
    ------
    CommandError
        A stage, a DoF, the band, the tolerance or the sizes are none.
    """
    if not stage:
        names = ", ".join(part.name for part in drivetrain.parts)
        raise CommandError(f"--stage is missing: give a stage or inertia, {names}")
    name = known_part(drivetrain, stage, "--stage")
    source = equations_source(drivetrain)
    damping = drivetrain.damping
    damped = damping.stiffness_proportional or damping.mass_proportional
    return ReductionPlan(
        drivetrain,
        name,
        _ports(source, name, dofs),
        parse_band(band or BAND),
        parse_tolerance(tolerance),
        parse_sizes(sizes),
        0.0 if damped else LENT,
    )


def _ports(source: Source, stage: str, dofs: Sequence[str]) -> tuple[str, ...]:
    known = source.stage(stage).labels
    for label in dofs:
        if label not in known:
            raise CommandError(f"--dof = {label!r}: no such DoF; known: {', '.join(known)}")
    first = next(x for x in source.drivetrain.part(stage).drive_points if x.endswith(".w"))
    return tuple(dict.fromkeys((*interface_labels(source, stage), *(dofs or (first,)))))


def parse_sizes(text: str | None) -> tuple[int, ...]:
    """Numbers of coordinates, ``4,8,12`` or ``4:20``.

    Raises
    ------
    CommandError
    """
    if text is None:
        return ()
    try:
        if ":" in text:
            first, last = map(int, text.split(":"))
            found = tuple(range(first, last + 1))
        else:
            found = tuple(sorted({int(word) for word in text.split(",")}))
    except ValueError:
        found = ()
    if not found or found[0] < 1:
        raise CommandError(f"--sizes = {text!r}: give numbers of coordinates, as 4,8,12 or 4:20")
    return found
