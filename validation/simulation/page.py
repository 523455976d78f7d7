"""The page of a run: head, settings, verdicts."""

from __future__ import annotations

from collections.abc import Iterator

from mbs_models.model.model_file import dumps

from ..report.digits import engineering, grouped, scientific
from ..report.page import (
    Block,
    Bullets,
    Fact,
    Page,
    Section,
    Table,
    Verdict,
    Verdicts,
    model_section,
    source_of,
)
from .describe import describe_excitation, verdict
from .gear_run import GearRun
from .result import SimulationResult
from .sections import sections


def simulation_page(result: SimulationResult) -> Page:
    """What simulation.html says."""
    drivetrain, record = result.drivetrain, result.record
    return Page(
        eyebrow="Drivetrain cross-check · run in time",
        heading=drivetrain.name,
        title="run in time",
        source=source_of(drivetrain.source),
        verdict=Verdict(verdict(result), result.agrees if result.checks else None),
        conclusions=tuple(_conclusions(result)),
        warnings=result.warnings,
        facts=(
            Fact(
                "Integrated",
                f"{record.n_samples / record.sampling_frequency:.4g} s",
                f"{grouped(record.n_samples)} samples at {record.sampling_frequency:g} Hz, in "
                f"{result.seconds['time integration']:.1f} s",
            ),
            Fact(
                "Integrator", record.integrator.name, f"step {scientific(record.integrator.step)} s"
            ),
            *_input(result),
            Fact(
                "Responses",
                str(len(record.labels)),
                f"of {len(record.excitations)} force{'s' * (len(record.excitations) != 1)}",
            ),
        ),
        sections=(_run(result), *sections(result), model_section(dumps(drivetrain))),
        timings=result.seconds,
        footer="verdicts, settings and summaries are in simulation.json beside it; histories, "
        "spectra and FRFs follow from the record (--save npz, csv or uff)",
    )


def _conclusions(result: SimulationResult) -> Iterator[str]:
    for estimated in result.estimated:
        sources = ", ".join(estimated.reference.excitations)
        yield f"FRFs from {sources}: {estimated.judged}. {estimated.rule}."
    if result.levels is not None:
        yield result.levels.conclusion
    if not result.checks and result.no_frfs and result.excitations:
        yield f"No FRFs to hold against FBS: {result.no_frfs}."
    yield from result.hints


def _input(result: SimulationResult) -> tuple[Fact, ...]:
    point = None if result.gears is None else result.gears.point
    if point is None or not point.speed_rpm:
        return ()
    taken = f", taken by {point.output}" if point.output else ""
    return (Fact("Input", f"{point.speed_rpm:g} rpm", f"{point.torque:g} N m{taken}"),)


def _run(result: SimulationResult) -> Section:
    blocks: list[Block] = [Bullets(tuple(_settings(result)))]
    if result.checks:
        blocks.append(Verdicts(result.checks))
    if (gears := result.gears) is not None:
        blocks.append(mesh_table(gears))
        blocks += [gears.loaded_sentence] if gears.loaded_sentence else []
        blocks += [stability.sentence for stability in gears.stability]
    return Section("run", "The run", tuple(blocks))


def _settings(result: SimulationResult) -> Iterator[str]:
    reason = result.record.integrator.reason
    yield from (f"Excitation: {describe_excitation(each)}." for each in result.excitations)
    if result.gears is not None and result.gears.point.mesh_frequencies:
        passed = ", ".join(
            f"{f:.5g} teeth a second in {stage}"
            for stage, f in result.gears.point.mesh_frequencies.items()
        )
        yield f"The meshes pass {passed}."
    yield f"{reason[0].upper()}{reason[1:]}."
    if result.run_in:
        yield f"The first {result.run_in:.3g} s are run-in, and not analysed."
    if result.borrowed_damping:
        damping = result.drivetrain.damping
        yield (
            "The model has no damping; the run and FBS were given Rayleigh damping of 0.5 % at "
            f"40 Hz and 1 kHz (α = {damping.mass_proportional:.4g} 1/s, β = "
            f"{scientific(damping.stiffness_proportional, 3)} s)."
        )
    if result.even_share is not None:
        yield (
            f"{scientific(result.even_share)} of the motion does not change sign with the force: "
            "that is geometry’s share, and it is taken out of the FRFs by a second run with the "
            "force reversed."
        )
    yield (
        "exudyn integrates the multibody system itself; no linear algebra of the other routes is "
        "in it."
    )


def mesh_table(gears: GearRun) -> Table:
    """Force of every mesh."""
    rows = tuple(
        (
            load.name,
            engineering(load.mean, "N", 4),
            engineering(load.largest, "N", 4),
            engineering(load.smallest, "N", 4),
            engineering(load.rms, "N"),
            "–" if load.dynamic_factor is None else f"{load.dynamic_factor:.3f}",
            f"{100.0 * load.open_share:.1f} %",
        )
        for load in gears.loads
    )
    headings = (
        "Mesh", "Mean", "Largest", "Smallest", "RMS about mean", "Dynamic factor", "Teeth apart",
    )  # fmt: skip
    return Table(headings, rows, frozenset(range(1, 7)))
