"""The cross-check: every route, every comparison, every verdict."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from mbs_models.errors import ModelError, OrbitError
from mbs_models.modal.energy import component_shares
from mbs_models.modal.mode_kinds import Kind, Modes
from mbs_models.model.model_file import dumps
from mbs_models.model.parameters import Drivetrain, Part

from ..arrays import FloatArray
from ..checks.check import or_failed
from ..checks.frfs import Candidate, compare_frfs, frf_checks, round_off_floor
from ..checks.matrices import assembly_checks, matrix_checks
from ..checks.model_warnings import model_warnings
from ..checks.modes import published_check, rigid_body_check
from ..checks.part_uncertainty import Noise
from ..checks.plain_file import plain_checks
from ..checks.pole_checks import pole_checks
from ..checks.published import PUBLISHED
from ..checks.time_domain import time_domain_checks
from ..routes.bands import Band, left_out
from ..routes.modes import round_off_warnings
from ..routes.multibody import ExudynSource
from ..routes.routes import comparison_routes, substituted_route, whole_route
from ..routes.source import Source, equations_source, exudyn_source
from ..routes.substitution import Substitution
from ..routes.time_domain import TimeDomain, time_domain, with_damping
from ..runtime.clock import Clock
from ..runtime.progress import Progress, silent
from .resonances import resonances
from .result import CrossCheck
from .substitution import what_changes


def cross_check(
    drivetrain: Drivetrain,
    band: Band | None = None,
    *,
    equations: Callable[[Drivetrain], Source] = equations_source,
    text: str | None = None,
    published: str = "",
    progress: Progress = silent,
    substitutions: Sequence[Substitution] = (),
    noise: Noise | None = None,
    repetitions: int = 0,
    in_time: bool = False,
) -> CrossCheck:
    """Build a drivetrain by every route, compare all with exudyn's whole system.

    Parameters
    ----------
    drivetrain
        What to check.
    band
        Frequency lines (default 1–15 000 Hz at 1 Hz).
    equations
        The source that exudyn is held against.
    text
        The model file's, which some numbers are taken from by hand; None: as it would be written.
    published
        A preset's name: its published frequencies are checked too, if there are any.
    progress
        Called with a step's name, how much of it is done, and of how much.
    substitutions
        Parts from files, on the band's lines: what they change is found too.
    noise
        Stated noise of the files' FRFs (None: the scatter of their runs, if there are several).
    repetitions
        By which their bands are found (0: to first order).
    in_time
        Whether to integrate a multisine in time as well.

    Raises
    ------
    ValueError
        The band is no axis, or a line falls on an undamped pole (named).
    ModelError
        Nothing in the drivetrain vibrates.
    """
    band = band or Band()
    frequency, clock = band.frequency(), Clock()
    progress("building systems", 0, 1)
    exudyn, other = exudyn_source(drivetrain), equations(drivetrain)
    modes = clock.timed("building and eigensolution", lambda: exudyn.modes)
    _require_springs(drivetrain, modes)
    progress("building systems", 1, 1)

    checks = [
        *or_failed(
            "Rigid-body modes", "whole drivetrain", (exudyn.name, "topology"),
            lambda: [rigid_body_check(drivetrain, modes)],
        ),
        *plain_checks(dumps(drivetrain) if text is None else text, exudyn.whole, exudyn.name),
        *matrix_checks(exudyn, other),
        *assembly_checks(exudyn, other),
    ]  # fmt: skip
    poles = clock.timed("matrices and poles", lambda: pole_checks(exudyn, other, modes))
    checks += poles.checks

    reference, routes, dofs = (
        whole_route(exudyn),
        comparison_routes(exudyn, other),
        exudyn.whole.labels,
    )
    candidates = [Candidate(route, dofs, dofs) for route in routes]
    if substitutions:
        candidates.append(_with_files(exudyn, substitutions, frequency))
    compared = clock.timed(
        "FRFs",
        lambda: compare_frfs(
            exudyn, reference, candidates, report_pairs(drivetrain), frequency, progress
        ),
    )
    floor = round_off_floor(exudyn.whole, frequency)
    comparisons = tuple(compared.by_route[route.name] for route in routes)
    for route, comparison in zip(routes, comparisons, strict=True):
        checks += frf_checks(comparison, reference, route, floor, frequency, exudyn.whole)
    changes = None
    if substitutions:
        changes = clock.timed(
            "swap",
            lambda: what_changes(
                exudyn,
                reference,
                candidates[-1],
                substitutions,
                compared,
                frequency,
                floor,
                noise,
                repetitions,
            ),
        )
    warnings = [*model_warnings(drivetrain), *(w for each in substitutions for w in each.warnings)]
    warnings += [*round_off_warnings(modes), *poles.warnings]
    elastic = [m.frequency_hz for m in modes.modes if m.kind != Kind.RIGID_BODY]
    warnings += left_out(band, np.array(elastic))
    record = None
    if in_time:
        try:
            record = clock.timed("time integration", lambda: _in_time(exudyn, progress))
            checks += time_domain_checks(record)
        except OrbitError as error:
            warnings.append(f"no FRFs from time integration: {error}")
    if published in PUBLISHED:
        checks.append(published_check(PUBLISHED[published], modes))
    names = {reference.name, *(route.name for route in routes)}
    return CrossCheck(
        drivetrain=drivetrain,
        band=band,
        warnings=tuple(warnings),
        checks=tuple(checks),
        modes=modes,
        poles=poles.rows,
        dofs=dofs,
        frequency=frequency,
        reference=reference.name,
        comparisons=comparisons,
        round_off=floor,
        curves={
            pair: {name: values for name, values in by_route.items() if name in names}
            for pair, by_route in compared.curves.items()
        },
        kernel_condition=compared.kernel_condition,
        components=exudyn.components,
        component_energy=component_shares(exudyn.components, modes),
        resonances=resonances(drivetrain, exudyn.components, modes),
        timings=clock.seconds,
        substitution=changes,
        time_domain=record,
    )


def _with_files(
    exudyn: Source, substitutions: Sequence[Substitution], frequency: FloatArray
) -> Candidate:
    """The coupling with parts from files, between the labels that it has."""
    route = substituted_route(exudyn, {each.part: each.frf for each in substitutions})
    first = route.frf(frequency[:1])
    responses, excitations = (
        tuple(label for label in exudyn.whole.labels if label in labels)
        for labels in (first.responses, first.excitations)
    )
    return Candidate(route, responses, excitations)


def _in_time(exudyn: ExudynSource, progress: Progress) -> TimeDomain:
    """A multisine at the first part's end; what has no damping is built once more with some."""
    drivetrain = with_damping(exudyn.drivetrain)
    source = exudyn if drivetrain is exudyn.drivetrain else exudyn_source(drivetrain)
    return time_domain(source, _end(drivetrain.parts[0]), progress=progress)


def report_pairs(drivetrain: Drivetrain) -> tuple[tuple[str, str], ...]:
    """(response, excitation) of the FRFs a report draws: drive points, and through the train."""
    points = [f"{coupling.name}.w" for coupling in drivetrain.couplings]
    points += [point for part in drivetrain.parts for point in part.drive_points]
    through = (_end(drivetrain.parts[-1]), _end(drivetrain.parts[0]))
    drive = tuple((point, point) for point in points)
    return (*drive, through) if len(drivetrain.parts) > 1 else drive


def _end(part: Part) -> str:
    return f"{part.members()[0].body}.w"


def _require_springs(drivetrain: Drivetrain, modes: Modes) -> None:
    if all(mode.kind == Kind.RIGID_BODY for mode in modes.modes):
        raise ModelError(
            f"{drivetrain.name}: nothing in it vibrates: no spring holds a body or joins two, and "
            "every mode is a rigid-body one; give a stiffness greater than 0 (a torsional_support, "
            "a bearing, a mesh) or a [[coupling]] that is not rigid"
        )
