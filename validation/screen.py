"""What the commands print: tables, warnings, progress."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from math import cos
from time import monotonic

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

from mbs_models.mode_kinds import Kind, Modes, label_inertias
from mbs_models.parameters import Drivetrain, ParallelStage, PlanetaryStage

from .modes import known_to, round_off_warnings
from .resonances import Resonances, resonances
from .results import CrossCheck

BETWEEN_LINES = 10.0  # s, of progress where there is no terminal
CLOSEST = 5  # margins printed; all that are called close are


def warn(warnings: Sequence[str]) -> None:
    """Print warnings to standard error."""
    for warning in warnings:
        print(f"warning: {warning}", file=sys.stderr)


@contextmanager
def progress() -> Iterator[Callable[[str, int, int], None]]:
    """A progress bar on standard error, gone when done; where nobody watches, a line now and then.

    A line every ten seconds: what is done before is not worth one.
    """
    console = Console(stderr=True)
    if not console.is_terminal:
        yield _Lines()
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, transient=True) as bars:
        tasks = {}

        def step(name: str, done: int, total: int) -> None:
            if name not in tasks:
                tasks[name] = bars.add_task(name, total=total)
            bars.update(tasks[name], completed=done, total=total)

        yield step


class _Lines:
    """Progress line by line."""

    def __init__(self) -> None:
        self.began = self.told = monotonic()

    def __call__(self, name: str, done: int, total: int) -> None:
        now = monotonic()
        if now - self.told >= BETWEEN_LINES:
            self.told = now
            print(f"{name}: {done} of {total}, {now - self.began:.0f} s", file=sys.stderr)


def verdicts(result: CrossCheck) -> None:
    """Print the verdict table and, where routes disagree, where and by what.

    Whatever the report warns of is a warning here too; what was known of the input before the
    check began has been told then.
    """
    told = {*result.drivetrain.warnings()}
    if result.swap is not None:
        told.update(warning for part in result.swap.replacements for warning in part.warnings)
    warn([warning for warning in result.warnings if warning not in told])
    table = Table(title=f"{result.drivetrain.name}: cross-check", title_justify="left")
    for header in ("comparison", "of", "routes"):
        table.add_column(header)
    for header in ("value", "allowed"):
        table.add_column(header, justify="right")
    table.add_column("verdict")
    for check in result.checks:
        verdict = "[green]agree[/]" if check.agrees else "[bold red]DISAGREE[/]"
        table.add_row(
            check.name,
            check.subject,
            " – ".join(check.routes),
            f"{check.value:.1e}",
            f"{check.tolerance:.0e}",
            verdict,
        )
    console = _console()
    console.print(table)
    for check in result.checks:
        if not check.agrees:
            console.print(f"[bold red]{check.name}, {check.subject}: {' – '.join(check.routes)}[/]")
            for finding in check.findings:
                console.print(f"  {finding}", markup=False)
    if result.time_domain is not None:
        console.print(f"FRFs from time integration: {result.time_domain.judged}.", markup=False)
    found = resonances(result)
    if found is not None and found.speed_rpm is not None:
        _margins(console, found)
    worst = max(float(c.line_max.max()) for c in result.comparisons)
    n_frf = len(result.dofs) ** 2
    console.print(
        f"{'All routes agree' if result.agrees else 'The routes DISAGREE'}: {n_frf} FRFs, "
        f"{len(result.frequency)} line{'s' * (len(result.frequency) != 1)} each, "
        f"largest scaled error {worst:.1e}."
    )


def _margins(console: Console, found: Resonances) -> None:
    """The closest resonances at the operating speed."""
    speed = f"{found.operation.input} at {found.speed_rpm:g} rpm"
    if not found.margins:
        console.print(f"{speed}: no order excites any mode.", markup=False)
        return
    table = Table(title=f"{speed}: nearest resonances", title_justify="left")
    table.add_column("order")
    for header in ("Hz", "resonance, Hz", "mode"):
        table.add_column(header, justify="right")
    table.add_column("kind")
    for header in ("energy share", "speed change"):
        table.add_column(header, justify="right")
    shown = max(CLOSEST, len(found.close))
    for margin in found.margins[:shown]:
        table.add_row(
            margin.order.label(margin.harmonic),
            f"{margin.order_hz:.2f}",
            f"{margin.mode_hz:.2f}",
            f"{margin.mode + 1}" + (f"–{margin.mode + margin.repeated}" * (margin.repeated > 1)),
            margin.kind,
            f"{margin.share:.1%}",
            f"{margin.change:+.1%}",
            style="bold" if margin.close else None,
        )
    console.print(table)
    if len(found.margins) > shown:
        console.print(f"{len(found.margins) - shown} more orders are farther from a resonance.")


def modes(
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
    table = Table(title=f"{title}: modes by {route}{under}", title_justify="left")
    table.add_column("#", justify="right")
    table.add_column("frequency, Hz", justify="right")
    if hidden:
        table.add_column("±", justify="right")
    if at_rest is not None:
        table.add_column("at rest, Hz", justify="right")
        table.add_column("change", justify="right")
    table.add_column("damping ratio", justify="right")
    table.add_column("kind")
    table.add_column("kinetic energy")
    for number, mode in enumerate(found.modes, start=1):
        shares = sorted(mode.shares.kinetic.items(), key=lambda item: -item[1])
        where = ", ".join(f"{name} {share:.0%}" for name, share in shares if share >= 0.005)
        frequency, error = known[number - 1]
        cells = [str(number), frequency, *([error] if hidden else [])]
        if at_rest is not None:
            rest = at_rest.modes[number - 1]
            shift = mode.frequency_hz / rest.frequency_hz - 1.0 if rest.frequency_hz else 0.0
            elastic = mode.kind != Kind.RIGID_BODY
            cells += [known_to(rest)[0], f"{shift:+.3%}" if elastic else "–"]
        table.add_row(*cells, f"{mode.damping_ratio:.5f}", mode.kind, where)
    _console().print(table)


def understood(drivetrain: Drivetrain, expected: int, found: int) -> None:
    """Print what a model file was understood to say."""
    print(f"{drivetrain.name}: valid")
    for stage in drivetrain.stages:
        print(f"  stage '{stage.name}': {_stage(stage)}")
    for rotor in drivetrain.inertias:
        print(f"  inertia '{rotor.name}': {rotor.rotary_mass * rotor.radius**2:g} kg m²")
    for coupling in drivetrain.couplings:
        springs = " and ".join(k if isinstance(k, str) else f"{k:g} N/m" for _, k in coupling.ends)
        moves = f", and along {', '.join(coupling.dofs)}" if coupling.dofs else ""
        ends = f"{coupling.first} – {coupling.second}"
        print(f"  coupling '{coupling.name}': {ends}, {springs}{moves}")
    print(f"  {len(label_inertias(drivetrain))} DoF labels in all")
    verdict = "as found in K" if expected == found else f"but {found} found in K"
    print(f"  rigid-body modes: {expected} by what springs there are, {verdict}")


def _stage(stage: ParallelStage | PlanetaryStage) -> str:
    if isinstance(stage, ParallelStage):
        ratio = stage.wheel.base_radius / stage.pinion.base_radius
        return f"parallel, ratio {ratio:.4g}, helix angle {stage.helix_angle:g}°, 8 DoFs"
    # w_s + w_r = w_c (cos α_s + cos α_r) where no mesh is strained (Eq. 1)
    cosines = cos(stage.sun_mesh_angle) + cos(stage.ring_mesh_angle)
    ratio = stage.carrier_radius * cosines / stage.sun.base_radius
    n = stage.planet_count
    return (
        f"planetary, {n} planets, sun to carrier {ratio:.4g} with the ring held, ring radius "
        f"{stage.ring_radius:.4g} m, carrier radius {stage.carrier_radius:.4g} m, {9 + 3 * n} DoFs"
    )


def _console() -> Console:
    console = Console()
    # A table cut to 80 columns in a file or a pipe would hide what it is read for.
    return console if console.is_terminal else Console(width=160)
