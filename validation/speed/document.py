"""The numbers of a speed study: its findings, and every line at every speed."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import FloatArray
from ..report.documents import document_head, rounded_lists
from ..report.provenance import Provenance
from ..runtime.output_folder import Writer
from .describe import conclusions, peak_energy, verdict
from .findings import SpeedRange, family_heights
from .lines import line_names
from .result import SpeedResult
from .steady import SteadyStates

CURVE_DIGITS = 6


def arrays_writer(result: SpeedResult, states: SteadyStates) -> Writer:
    """Writes every line at every speed; amplitudes are complex, Re x exp(jωt)."""
    turning = result.turning
    arrays: dict[str, NDArray[Any]] = {
        "rpm": states.rpm,
        "status": states.status,
        "orders": turning.lines.orders,
        "line_names": np.array(line_names(turning)),
        "meshes": np.array(turning.meshes),
        "static_force_n": turning.static_forces,
        "mesh_force_n": states.mesh,
        "mesh_force_max_n": states.mesh_max,
        "mesh_force_min_n": states.mesh_min,
        "mesh_force_rms_n": states.mesh_rms,
        "bearings": np.array([bearing.name for bearing in turning.bearings], dtype=str),
        "bearing_force_n": states.bearing,
        "bearing_force_peak_n": states.bearing_peak,
        "dofs": np.array(turning.parts.dofs),
        "acceleration_m_s2": states.acceleration,
        "growth_rate_1_s": states.growth,
    }
    return lambda file: np.savez_compressed(file, allow_pickle=False, **arrays)


def speed_document(result: SpeedResult, made: Provenance) -> dict[str, Any]:
    """Findings and curves as nested dicts and lists."""
    turning = result.turning
    plan, states = turning.plan, result.states
    head = document_head(
        plan.drivetrain, made, verdict=verdict(result), agrees=result.agrees,
        warnings=result.warnings, seconds=result.seconds,
    )  # fmt: skip
    return head | {
        "conclusions": conclusions(result),
        "excited": states is not None,
        "input": plan.input,
        "torque_nm": plan.torque,
        "harmonics": plan.harmonics,
        "rpm": plan.speeds if states is None else states.rpm,
        "mesh_orders": {
            stage: frequency * 60.0 / abs(turning.point.speed_rpm or 1.0)
            for stage, frequency in turning.point.mesh_frequencies.items()
        },
        "static_forces_n": dict(zip(turning.meshes, turning.static_forces.tolist(), strict=True)),
        "families": {
            family.name: [turning.meshes[column] for column in family.columns]
            for family in turning.families
        },
        "curves": {} if states is None else _curves(result, states),
        "peaks": _peaks(result),
        "unstable": [
            {
                **_range(unstable.range),
                "fastest_rpm": unstable.fastest,
                "growth_rate_1_s": unstable.growth,
                "tongue": None if unstable.tongue is None else unstable.tongue.description,
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
        "checks": result.checks,
    }


def _range(reach: SpeedRange) -> dict[str, float]:
    return {"first_rpm": reach.first, "last_rpm": reach.last}


def _curves(result: SpeedResult, states: SteadyStates) -> dict[str, Any]:
    """What is drawn over the speeds; null where there is no steady state."""
    bearings = [bearing.name for bearing in result.turning.bearings]
    return {
        "status": states.status.tolist(),
        "height": {
            family: _numbers(values)
            for family, values in family_heights(result.turning, states).items()
        },
        "bearing_force_peak_n": {
            name: _numbers(states.bearing_peak[:, column]) for column, name in enumerate(bearings)
        },
        "growth_rate_1_s": _numbers(states.growth),
        "truncation": _numbers(states.truncation),
    }


def _numbers(values: FloatArray) -> Any:
    return rounded_lists(values, CURVE_DIGITS)


def _peaks(result: SpeedResult) -> list[dict[str, Any]]:
    if result.states is None:
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
