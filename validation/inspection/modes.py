"""`crosscheck modes`: natural frequencies, damping and kinds of all modes."""

from __future__ import annotations

from typing import Any

from mbs_models.modal.mode_kinds import Kind, Mode, Modes
from mbs_models.model.parameters import Drivetrain

from ..errors import CommandError
from ..report.console import console, print_table
from ..report.page import Table
from ..routes.modes import known_to, round_off_warnings
from ..routes.source import equations_source, exudyn_source
from ..runtime.streams import warn


def print_modes(
    title: str,
    route: str,
    found: Modes,
    at_rest: Modes | None = None,
    torque: float | None = None,
) -> None:
    """Print a table of modes, in the digits that are known; warn of those that round-off hides.

    Under a torque (N m) with each one's frequency at rest.
    """
    known = [known_to(mode) for mode in found.modes]
    if route == "exudyn":
        warn(round_off_warnings(found))
    hidden = any(error for _, error in known)
    under = "" if torque is None else f" under {torque:g} N m"
    rest = () if at_rest is None else ("at rest, Hz", "change")
    numbers = ("#", "frequency, Hz", *(("±",) if hidden else ()), *rest, "damping ratio")
    rows = []
    for number, mode in enumerate(found.modes, start=1):
        shares = sorted(mode.shares.kinetic.items(), key=lambda item: -item[1])
        where = ", ".join(f"{name} {share:.0%}" for name, share in shares if share >= 0.005)
        frequency, error = known[number - 1]
        cells = [str(number), frequency, *([error] if hidden else [])]
        if at_rest is not None:
            cells += _at_rest(mode, at_rest.modes[number - 1])
        rows.append((*cells, f"{mode.damping_ratio:.5f}", mode.kind, where))
    table = Table((*numbers, "kind", "kinetic energy"), tuple(rows), frozenset(range(len(numbers))))
    print_table(console(), f"{title}: modes by {route}{under}", table)


def _at_rest(mode: Mode, rest: Mode) -> tuple[str, str]:
    """A mode's frequency at rest, and how far the torque shifts it."""
    shift = mode.frequency_hz / rest.frequency_hz - 1.0 if rest.frequency_hz else 0.0
    return known_to(rest)[0], f"{shift:+.3%}" if mode.kind != Kind.RIGID_BODY else "–"


def solved_modes(
    drivetrain: Drivetrain, route: str, torque: float | None = None
) -> tuple[Modes, Modes | None]:
    """Modes by a route's name; under a torque (N m) beside those at rest.

    Raises
    ------
    CommandError
        There is no such route, or it knows no torque.
    """
    if route not in ("exudyn", "equations"):
        raise CommandError(f"--route = {route!r}: must be exudyn or equations")
    if route == "equations":
        if torque is not None:
            raise CommandError(
                "--torque: the equations are linear about the unloaded state; use --route exudyn"
            )
        return equations_source(drivetrain).modes, None
    at_rest = exudyn_source(drivetrain).modes
    if torque is None:
        return at_rest, None
    from mbs_models.gears.operating_point import operating_point
    from mbs_models.modal.modes import drivetrain_modes

    point = operating_point(drivetrain, speed_rpm=0.0, torque=torque)
    return drivetrain_modes(drivetrain, point), at_rest


def modes_document(found: Modes, at_rest: Modes | None = None) -> list[dict[str, Any]]:
    """Modes as JSON has them; under a torque with their frequencies at rest."""
    listed: list[dict[str, Any]] = [
        {
            "frequency_hz": mode.frequency_hz,
            "damping_ratio": mode.damping_ratio,
            "kind": str(mode.kind),
            "round_off_hz": mode.round_off_hz,
            "kinetic_energy": dict(mode.shares.kinetic),
            "strain_energy": dict(mode.shares.strain),
        }
        for mode in found.modes
    ]
    if at_rest is not None:
        for entry, mode in zip(listed, at_rest.modes, strict=True):
            entry["at_rest_hz"] = mode.frequency_hz
    return listed
