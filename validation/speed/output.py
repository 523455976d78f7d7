"""The files of a speed study: page, findings, and every line at every speed."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from mbs_models.model.model_file import dumps

from ..report.digits import SIGNIFICANT_DIGITS, engineering, rounded
from ..report.pages import environment
from ..report.provenance import Provenance, provenance
from ..runtime.output_folder import Writer, write_together
from .findings import SpeedRange, family_heights
from .lines import line_names
from .sections import sections
from .steady import Speeds
from .study import SpeedResult
from .words import conclusions, peak_energy, verdict

SCHEMA_VERSION = 1
FILES = ("speed.html", "speed.json", "speed.npz")


def publish(result: SpeedResult, directory: Path) -> tuple[Path, ...]:
    """Write ``speed.html``, ``speed.json`` and, where something vibrates, ``speed.npz``.

    Raises
    ------
    ReportError
        A file cannot be written there.
    """
    made = provenance()
    contents: list[str | Writer] = [
        speed_html(result, made),
        json.dumps(speed_document(result, made), ensure_ascii=False) + "\n",
    ]
    if (found := result.found) is not None:
        contents.append(lambda file: _write_arrays(result, found, file))
    return write_together(directory, dict(zip(FILES, contents, strict=False)))


def _write_arrays(result: SpeedResult, found: Speeds, file: BinaryIO) -> None:
    """Every line at every speed; amplitudes are complex, Re x exp(jωt)."""
    turning = result.turning
    arrays: dict[str, NDArray[Any]] = {
        "rpm": found.rpm,
        "status": found.status,
        "orders": turning.lines.orders,
        "line_names": np.array(line_names(turning)),
        "meshes": np.array(turning.meshes),
        "static_force_n": turning.static_forces,
        "mesh_force_n": found.mesh,
        "mesh_force_max_n": found.mesh_max,
        "mesh_force_min_n": found.mesh_min,
        "mesh_force_rms_n": found.mesh_rms,
        "bearings": np.array([bearing.name for bearing in turning.bearings], dtype=str),
        "bearing_force_n": found.bearing,
        "bearing_force_peak_n": found.bearing_peak,
        "dofs": np.array(turning.parts.dofs),
        "acceleration_m_s2": found.acceleration,
        "growth_rate_1_s": found.growth,
    }
    np.savez_compressed(file, allow_pickle=False, **arrays)


def speed_html(result: SpeedResult, made: Provenance) -> str:
    """The text of speed.html."""
    plan = result.turning.plan
    return (
        environment()
        .get_template("speed.html")
        .render(
            result=result,
            turning=result.turning,
            plan=plan,
            made=made,
            torque=engineering(plan.torque, "N m", 4),
            verdict=verdict(result),
            conclusions=conclusions(result),
            sections=sections(result),
            reasons=list(dict.fromkeys(check.reason for check in result.checks)),
            parameters=dumps(plan.drivetrain),
        )
    )


def speed_document(result: SpeedResult, made: Provenance) -> dict[str, Any]:
    """Findings and curves as nested dicts and lists."""
    turning = result.turning
    plan, found = turning.plan, result.found
    return {
        "schema_version": SCHEMA_VERSION,
        "model": plan.drivetrain.name,
        "verdict": verdict(result),
        "conclusions": list(conclusions(result)),
        "agrees": result.agrees,
        "excited": found is not None,
        "warnings": list(result.warnings),
        "date": made.date,
        "versions": dict(made.versions),
        "parameters": plan.drivetrain.model_dump(mode="json", by_alias=True, exclude_none=True),
        "input": plan.input,
        "torque_nm": plan.torque,
        "harmonics": plan.harmonics,
        "rpm": rounded(plan.speeds if found is None else found.rpm, SIGNIFICANT_DIGITS),
        "mesh_orders": {
            stage: frequency * 60.0 / abs(turning.point.speed_rpm or 1.0)
            for stage, frequency in turning.point.mesh_frequencies.items()
        },
        "static_forces_n": dict(zip(turning.meshes, turning.static_forces.tolist(), strict=True)),
        "families": {
            family.name: [turning.meshes[column] for column in family.columns]
            for family in turning.families
        },
        "curves": {} if found is None else _curves(result, found),
        "peaks": _peaks(result),
        "unstable": [
            {
                **_range(unstable.range),
                "fastest_rpm": unstable.fastest,
                "growth_rate_1_s": unstable.growth,
                "tongue": None if unstable.tongue is None else unstable.tongue.in_words,
            }
            for unstable in result.unstable
        ],
        "teeth_part": [
            {
                "meshes": parting.family,
                "least_force_over_static": parting.least,
                "ranges": [_range(reach) for reach in parting.ranges],
            }
            for parting in result.partings
        ],
        "margins": [
            {
                "order": margin.order.name,
                "harmonic": margin.harmonic,
                "order_hz": margin.order_hz,
                "mode_hz": margin.mode_hz,
                "kind": str(margin.kind),
                "margin": margin.change,
                "energy_share": margin.share,
            }
            for margin in result.margins
        ],
        "checks": [
            {
                "name": check.name,
                "subject": check.subject,
                "routes": list(check.routes),
                "measure": check.measure,
                "value": check.value if math.isfinite(check.value) else None,
                "tolerance": check.tolerance,
                "reason": check.reason,
                "agrees": check.agrees,
                "findings": list(check.findings),
                "note": check.note,
            }
            for check in result.checks
        ],
        "timings_s": dict(result.seconds),
    }


def _range(reach: SpeedRange) -> dict[str, float]:
    return {"first_rpm": reach.first, "last_rpm": reach.last}


def _curves(result: SpeedResult, found: Speeds) -> dict[str, Any]:
    """What is drawn over the speeds; null where there is no steady state."""
    bearings = [bearing.name for bearing in result.turning.bearings]
    return {
        "status": found.status.tolist(),
        "height": {
            family: _numbers(values)
            for family, values in family_heights(result.turning, found).items()
        },
        "bearing_force_peak_n": {
            name: _numbers(found.bearing_peak[:, column]) for column, name in enumerate(bearings)
        },
        "growth_rate_1_s": _numbers(found.growth),
        "truncation": _numbers(found.truncation),
    }


def _numbers(values: NDArray[np.float64]) -> Sequence[float | None]:
    return [number if math.isfinite(number) else None for number in rounded(values, 6)]


def _peaks(result: SpeedResult) -> list[dict[str, Any]]:
    if result.found is None:
        return []
    names = line_names(result.turning)
    return [
        {
            "speed_rpm": peak.speed_rpm,
            "family": peak.family,
            "mesh": peak.mesh,
            "line": names[peak.line],
            "order": peak.order,
            "frequency_hz": peak.frequency_hz,
            "height": peak.height,
            "above_mean_n": peak.swing,
            "mode": peak.mode + 1,
            "mode_hz": result.modes.modes[peak.mode].frequency_hz,
            "mode_kind": str(result.modes.modes[peak.mode].kind),
            "mode_share": peak.mode_share,
            "strain_energy": peak_energy(result, peak),
        }
        for peak in result.peaks
    ]
