"""The numbers of a run: verdicts, settings and summaries."""

from __future__ import annotations

from typing import Any

from ..report.documents import document_head, rounded_lists
from ..report.provenance import Provenance
from .describe import describe_excitation, verdict
from .estimates import EstimatedFrfs
from .result import SimulationResult


def simulation_document(result: SimulationResult, made: Provenance) -> dict[str, Any]:
    """Verdicts, settings and summaries as nested dicts and lists; no histories and no curves."""
    record = result.record
    head = document_head(
        result.drivetrain, made, verdict=verdict(result), agrees=result.agrees,
        warnings=result.warnings, seconds=result.seconds,
    )  # fmt: skip
    return head | {
        "excitations": [describe_excitation(excitation) for excitation in result.excitations],
        "integrator": {
            "name": record.integrator.name,
            "step_s": record.integrator.step,
            "reason": record.integrator.reason,
        },
        "sampling_frequency_hz": record.sampling_frequency,
        "samples": record.n_samples,
        "run_in_s": result.run_in,
        "aliasing": record.aliasing,
        "checks": result.checks,
        "frfs": [_frfs(estimated) for estimated in result.estimated],
        "even_share": result.even_share,
        "no_frfs": result.no_frfs,
        "levels": _levels(result),
        "gears": _gears(result),
    }


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
        "judged_share": rounded_lists(estimated.compared.mean(axis=0), 6),
        "worst_db": rounded_lists(estimated.decibels.max(axis=0), 6),
        "worst_degrees": rounded_lists(estimated.degrees.max(axis=0), 6),
        "lowest_coherence": None if coherence is None else rounded_lists(coherence.min(axis=0), 6),
    }


def _levels(result: SimulationResult) -> dict[str, Any] | None:
    if result.levels is None:
        return None
    return {
        "conclusion": result.levels.conclusion,
        "levels": [
            {
                "factor": level.factor,
                "peak_force_n": level.peak_force,
                "rms_force_n": level.rms_force,
                "worst_db": level.worst_db,
                "median_db": level.median_db,
                "period_change": level.period_change,
            }
            for level in result.levels.levels
        ],
    }


def _gears(result: SimulationResult) -> dict[str, Any] | None:
    gears = result.gears
    if gears is None:
        return None
    return {
        "speed_rpm": gears.point.speed_rpm,
        "torque_nm": gears.point.torque,
        "mesh_frequencies_hz": dict(gears.point.mesh_frequencies),
        "natural_frequencies_hz": {
            "at_rest": gears.frequencies_at_rest,
            "under_torque": gears.frequencies_loaded,
        },
        "stability": [stability.sentence for stability in gears.stability],
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
                "orders": sensor.orders,
                "frequency_hz": sensor.frequency,
                "measured_n": rounded_lists(sensor.measured, 6),
                "expected_n": rounded_lists(sensor.expected, 6),
                "of_other_meshes": sensor.foreign.tolist(),
            }
            for sensor in gears.sensors
        ],
    }
