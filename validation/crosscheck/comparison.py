"""The cross-check: every route, every comparison, every verdict."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from mbs_models.errors import ModelError, OrbitError
from mbs_models.modal.energy import component_shares
from mbs_models.modal.mode_kinds import Kind, Modes
from mbs_models.model.parameters import Drivetrain, Part

from ..checks.check import Check
from ..checks.frfs import Progress, compare_frfs, frf_checks, round_off_floor
from ..checks.matrices import assembly_checks, matrix_checks
from ..checks.model_warnings import model_warnings
from ..checks.pole_checks import pole_checks
from ..checks.published import PUBLISHED
from ..checks.time_domain import time_domain_checks
from ..routes import equations
from ..routes.bands import Band
from ..routes.modes import round_off_warnings
from ..routes.routes import (
    EQUATIONS,
    Source,
    build_model,
    comparison_routes,
    exudyn_source,
    whole_route,
)
from ..routes.substitution import Replacement
from ..routes.time_domain import time_domain
from .results import CrossCheck
from .swap import compare_swap


def cross_check(
    drivetrain: Drivetrain,
    band: Band | None = None,
    *,
    sources: tuple[Source, Source] | None = None,
    published: str = "",
    progress: Progress | None = None,
    replacements: Sequence[Replacement] = (),
    in_time: bool = False,
) -> CrossCheck:
    """Build a drivetrain by every route, compare all with exudyn's whole system.

    Parameters
    ----------
    drivetrain
        What to check.
    band
        Frequency lines (default 1–15 000 Hz at 1 Hz).
    sources
        The multibody source and the witness (default: exudyn and the equations).
    published
        A preset's name: its published frequencies are checked too, if there are any.
    progress
        Called with a step's name, how much of it is done, and of how much.
    replacements
        Parts from files, on the band's lines: what they change is found too.
    in_time
        Whether to integrate a multisine in time as well.

    Raises
    ------
    ValueError
        The band is no axis, or a line falls on an undamped pole (named).
    ModelError
        Nothing in the drivetrain vibrates.
    """
    from mbs_models.modal.modes import drivetrain_modes  # exudyn takes its time to load
    from mbs_models.system.read_back import drivetrain_components

    band = band or Band()
    frequency = band.frequency()
    report = progress or (lambda step, done, total: None)
    clock = _Clock()

    report("building systems", 0, 1)
    multibody, witness = sources or (exudyn_source(), EQUATIONS)
    model, check_model = build_model(multibody, drivetrain), build_model(witness, drivetrain)
    modes, components = drivetrain_modes(drivetrain), drivetrain_components(drivetrain)
    _require_springs(drivetrain, modes)
    clock.lap("building and eigensolution")
    report("building systems", 1, 1)

    checks = [
        _rigid_body_check(drivetrain, modes),
        *matrix_checks(model, check_model),
        *assembly_checks(model, check_model),
    ]
    poles = pole_checks(model, check_model, modes)
    checks += poles.checks
    clock.lap("matrices and poles")

    reference = whole_route(model, multibody.synthesis)
    routes = comparison_routes(model, check_model)
    comparisons, curves, kernel = compare_frfs(
        model, reference, routes, model.whole.labels, report_pairs(drivetrain), frequency, report
    )
    floor = round_off_floor(model.whole, frequency)
    for route, comparison in zip(routes, comparisons, strict=True):
        checks += frf_checks(comparison, reference, route, floor, frequency, model.whole)
    clock.lap("FRFs")
    swap = None
    if replacements:
        pairs = report_pairs(drivetrain)
        swap = compare_swap(model, reference, replacements, pairs, frequency, floor, report)
        clock.lap("swap")
    warnings = [*model_warnings(drivetrain), *(w for r in replacements for w in r.warnings)]
    warnings += [*round_off_warnings(modes), *poles.warnings]
    record = None
    if in_time:
        try:
            record = time_domain(drivetrain, _end(drivetrain.parts[0]), progress=report)
            checks += time_domain_checks(record)
        except OrbitError as error:
            warnings.append(f"no FRFs from time integration: {error}")
        clock.lap("time integration")
    if published in PUBLISHED:
        checks.append(_published_check(published, modes))
    return CrossCheck(
        drivetrain=drivetrain,
        band=band,
        warnings=tuple(warnings),
        checks=tuple(checks),
        modes=modes,
        poles=poles.rows,
        dofs=model.whole.labels,
        frequency=frequency,
        reference=reference.name,
        comparisons=comparisons,
        round_off=floor,
        curves=curves,
        kernel_condition=kernel,
        components=components,
        component_energy=component_shares(components, modes),
        timings=clock.laps,
        swap=swap,
        time_domain=record,
    )


class _Clock:
    def __init__(self) -> None:
        self.laps: dict[str, float] = {}
        self._last = time.perf_counter()

    def lap(self, name: str) -> None:
        now = time.perf_counter()
        self.laps[name] = now - self._last
        self._last = now


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


def _rigid_body_check(drivetrain: Drivetrain, modes: Modes) -> Check:
    expected = equations.rigid_body_motions(drivetrain)
    found = sum(mode.kind == Kind.RIGID_BODY for mode in modes.modes)
    findings = () if found == expected else (f"{expected} expected, {found} found",)
    return Check(
        "Rigid-body modes", "whole drivetrain", ("topology", "exudyn"),
        "expected − found", float(abs(expected - found)), 0.0,
        "what springs there are says how many motions strain nothing, before any eigensolution",
        findings,
    )  # fmt: skip


def _published_check(name: str, modes: Modes) -> Check:
    published = PUBLISHED[name]
    elastic = [mode.frequency_hz for mode in modes.modes if mode.kind != Kind.RIGID_BODY]
    groups = [("elastic", elastic[: len(published.lowest)], published.lowest)]
    for kind, expected in published.by_kind.items():
        found = [mode.frequency_hz for mode in modes.modes if mode.kind == kind]
        groups.append((str(kind), found, expected))
    errors, findings = [0.0], []
    for name, found, expected in groups:
        if len(found) != len(expected):
            errors.append(np.inf)
            findings.append(f"{len(found)} {name} modes found, {len(expected)} published")
            continue
        for f, target in zip(found, expected, strict=True):
            errors.append(abs(f - target) / target if target else abs(f))
            if not errors[-1] <= published.tolerance:
                findings.append(f"{name} mode: {f:.6g} Hz found, {target:.6g} Hz published")
    count = sum(len(expected) for _, _, expected in groups)
    return Check(
        "Published natural frequencies", f"{count} modes", (published.source, "exudyn"),
        "largest relative difference", max(errors), published.tolerance, published.reason,
        tuple(findings),
    )  # fmt: skip
