"""The files of a run: report, numbers, and the record where it is asked for."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from fbs import Quantity, Record
from fbs.files.record_files import write_record_to
from mbs_models.integration.run_store import remove_run
from mbs_models.model.model_file import dumps

from ..checks.check import Check
from ..report.digits import rounded
from ..report.pages import environment
from ..report.provenance import Provenance, provenance
from ..routes.comparable_lines import percent
from ..runtime.output_folder import Writer, write_together
from .describe import in_words
from .estimates import EstimatedFrfs
from .gear_run import GearRun
from .results import Simulation
from .run import BACKWARD, FORWARD
from .sections import sections

FORMATS = ("npz", "csv", "uff")
SCHEMA_VERSION = 1


def write_simulation(found: Simulation, directory: Path, formats: Sequence[str]) -> list[Path]:
    """Write ``simulation.html`` and ``simulation.json``, and ``record.<format>`` for each format.

    Parameters
    ----------
    found
        What the run found.
    directory
        Where to.
    formats
        Of ``FORMATS``.

    Returns
    -------
    The files written.

    Raises
    ------
    ReportError, FbsError
        A file cannot be written there, or the record does not fit a format.
    """
    made = provenance()
    contents: dict[str, str | Writer] = {
        "simulation.html": simulation_html(found, made),
        "simulation.json": json.dumps(simulation_document(found, made), ensure_ascii=False) + "\n",
        **{f"record.{name}": _record_writer(found, made, f"record.{name}") for name in formats},
    }
    return list(write_together(directory, contents))


def _record_writer(found: Simulation, made: Provenance, name: str) -> Writer:
    metadata = _metadata(found, made)
    if name.endswith("uff"):  # which has room for 240 characters
        metadata = {key: metadata[key] for key in ("date", "exudyn")}

    def write(file: BinaryIO) -> None:
        write_record_to(accelerations(found), file, name, metadata)

    return write


def accelerations(found: Simulation) -> Record:
    """All forces and accelerations of a run."""
    record = found.record
    assert record.acceleration is not None
    return Record(
        record.sampling_frequency,
        record.forces,
        record.acceleration,
        record.excitations,
        record.labels,
        Quantity.ACCELERANCE,
    )


def _metadata(found: Simulation, made: Provenance) -> dict[str, Any]:
    return {
        "model": found.drivetrain.name,
        "excitations": [in_words(excitation) for excitation in found.excitations],
        "integrator": found.record.integrator.reason,
        "date": made.date,
        "exudyn": made.versions["exudyn"],
    }


def simulation_html(found: Simulation, made: Provenance) -> str:
    """The text of simulation.html."""
    return (
        environment()
        .get_template("simulation.html")
        .render(
            found=found,
            made=made,
            verdict=verdict(found),
            excitations=[in_words(excitation) for excitation in found.excitations],
            lasted=found.record.n_samples / found.record.sampling_frequency,
            sections=sections(found),
            reasons=dict.fromkeys(check.reason for check in found.checks),
            parameters=dumps(found.drivetrain),
        )
    )


def verdict(found: Simulation) -> str:
    """The run in a sentence."""
    said = []
    if found.estimated:
        said.append(_against_fbs(found))
    if found.gears is not None and not found.excitations:
        said.append(_operated(found.gears))
    broken = [check.name for check in found.checks if not check.agrees and check not in _frf(found)]
    if broken:
        said.append(f"the run contradicts mechanics: {', '.join(broken)}")
    return "; ".join(said) or "The drivetrain was run in time"


def _frf(found: Simulation) -> tuple[Check, ...]:
    """The checks on FRFs."""
    return tuple(check for check in found.checks if check.name.startswith("FRFs"))


def _against_fbs(found: Simulation) -> str:
    checks = _frf(found)
    worst = max(check.value for check in checks if "magnitude" in check.name)
    alike = all(check.agrees for check in checks)
    agree = "agree with FBS" if alike else "do not agree with FBS everywhere"
    size = f"{worst:.2g} dB" if worst >= 1e-3 else "below 0.001 dB"
    averaged = any(part.estimate.kind == "H1" for part in found.estimated)
    beyond = ", the estimate’s own scatter allowed for" if averaged else ""
    judged = np.concatenate([part.compared.ravel() for part in found.estimated])
    lines = "all lines" if judged.all() else f"the lines judged, {percent(judged)} of all"
    return (
        f"FRFs from exudyn’s time integration {agree}: largest difference {size} on {lines}{beyond}"
    )


def _operated(gears: GearRun) -> str:
    point = gears.point
    where = [f"{point.speed_rpm:g} rpm"] if point.speed_rpm else ["At standstill"]
    where += [f"{point.torque:g} N m"] if point.torque else []
    factors = [load.dynamic_factor for load in gears.loads if load.dynamic_factor is not None]
    largest = f"largest dynamic factor {max(factors):.3g}" if factors else "meshes without load"
    return f"{' and '.join(where)}: {largest}"


def simulation_document(found: Simulation, made: Provenance) -> dict[str, Any]:
    """Verdicts, settings and summaries as nested dicts and lists; no histories and no curves."""
    record = found.record
    return {
        "schema_version": SCHEMA_VERSION,
        "model": found.drivetrain.name,
        "verdict": verdict(found),
        "agrees": found.agrees,
        "warnings": list(found.warnings),
        "date": made.date,
        "versions": dict(made.versions),
        "parameters": found.drivetrain.model_dump(mode="json", by_alias=True, exclude_none=True),
        "excitations": [in_words(excitation) for excitation in found.excitations],
        "integrator": {
            "name": record.integrator.name,
            "step_s": record.integrator.step,
            "reason": record.integrator.reason,
        },
        "sampling_frequency_hz": record.sampling_frequency,
        "samples": record.n_samples,
        "run_in_s": found.run_in,
        "aliasing": record.aliasing,
        "timings_s": dict(found.seconds),
        "checks": [
            {
                "name": check.name,
                "subject": check.subject,
                "value": _finite(check.value),
                "tolerance": check.tolerance,
                "agrees": check.agrees,
                "findings": list(check.findings),
                "note": check.note,
            }
            for check in found.checks
        ],
        "frfs": [_frfs(estimated) for estimated in found.estimated],
        "even_share": found.even_share,
        "no_frfs": found.no_frfs,
        "levels": _levels(found),
        "gears": _gears(found),
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _frfs(estimated: EstimatedFrfs) -> dict[str, Any]:
    frf, coherence = estimated.estimate.frf, estimated.estimate.coherence
    return {
        "estimator": estimated.estimate.kind,
        "averages": estimated.estimate.n_averages,
        "unit": "m/N",
        "responses": list(frf.responses),
        "excitations": list(frf.excitations),
        "lines": len(frf.frequency),
        "band_hz": [float(frf.frequency[0]), float(frf.frequency[-1])],
        "judged": estimated.judged,
        "judged_share": [rounded(row, 6) for row in estimated.compared.mean(axis=0)],
        "worst_db": [rounded(row, 6) for row in estimated.decibels.max(axis=0)],
        "worst_degrees": [rounded(row, 6) for row in estimated.degrees.max(axis=0)],
        "lowest_coherence": None if coherence is None else rounded(coherence.min(axis=0), 6),
    }


def _levels(found: Simulation) -> dict[str, Any] | None:
    if found.levels is None:
        return None
    return {
        "conclusion": found.levels.conclusion,
        "levels": [
            {
                "factor": level.factor,
                "peak_force_n": level.peak_force,
                "rms_force_n": level.rms_force,
                "worst_db": _finite(level.worst_db),
                "median_db": _finite(level.median_db),
                "period_change": _finite(level.period_change),
            }
            for level in found.levels.levels
        ],
    }


def _gears(found: Simulation) -> dict[str, Any] | None:
    gears = found.gears
    if gears is None:
        return None
    return {
        "speed_rpm": gears.point.speed_rpm,
        "torque_nm": gears.point.torque,
        "mesh_frequencies_hz": dict(gears.point.mesh_frequencies),
        "natural_frequencies_hz": {
            "at_rest": rounded(gears.frequencies_at_rest, 9),
            "under_torque": rounded(gears.frequencies_loaded, 9),
        },
        "stability": [stability.in_words for stability in gears.stability],
        "meshes": [
            {
                "name": load.name,
                "mean_n": load.mean,
                "largest_n": load.largest,
                "smallest_n": load.smallest,
                "rms_n": load.rms,
                "dynamic_factor": load.dynamic_factor,
                "open_share": load.open_share,
                "reversed_share": load.reversed_share,
            }
            for load in gears.loads
        ],
        "lines": {
            mesh: [
                {
                    "name": line.name,
                    "frequency_hz": line.frequency,
                    "amplitude_n": line.amplitude,
                    "distinct": line.distinct,
                }
                for line in lines
            ]
            for mesh, lines in gears.lines.items()
        },
        "sidebands": [
            {
                "stage": sensor.stage,
                "passing_hz": sensor.passing,
                "orders": sensor.orders.tolist(),
                "frequency_hz": rounded(np.asarray(sensor.frequency), 9),
                "measured_n": rounded(np.asarray(sensor.measured), 6),
                "expected_n": rounded(np.asarray(sensor.expected), 6),
            }
            for sensor in gears.sensors
        ],
    }


def remove_pieces(store: Path) -> None:
    """Remove what is kept of a run that is finished and reported, and nothing else."""
    for direction in (FORWARD, BACKWARD):
        remove_run(store / direction)
    if store.exists() and not any(store.iterdir()):
        store.rmdir()
