"""The numbers of a sweep beside its table: what was varied, extremes, sensitivities."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import FloatArray
from ..report.documents import document_head
from ..report.provenance import Provenance
from .describe import failures, method, verdict
from .result import SweepResult
from .sensitivity import is_slope, sensitivities


def sweep_document(result: SweepResult, made: Provenance) -> dict[str, Any]:
    """What sweep.json holds; sample by sample, results are in sweep.csv and sweep.npz."""
    ok = result.results.ok
    head = document_head(
        result.drivetrain, made, verdict=verdict(result), agrees=None, warnings=result.warnings,
        seconds=result.seconds,
    )  # fmt: skip
    return head | {
        "route": result.plan.route,
        "response": result.plan.response,
        "excitation": result.plan.excitation,
        "method": method(result) if result.has_frf else None,
        "band_hz": [result.frequency[0], result.frequency[-1]] if result.has_frf else None,
        "lines": result.plan.n_lines,
        "sampled": result.samples.sampled,
        "samples": len(ok),
        "computed": int(ok.sum()),
        "failures": failures(result, len(ok)),
        "varied": [
            {"path": path, "unit": unit, "lowest": values.min(), "highest": values.max(),
             "values": len(np.unique(values))}
            for path, unit, values in zip(
                result.samples.paths, result.units, result.values.T, strict=True
            )
        ],
        "metrics": [_metric(result, name, column) for name, column in result.metrics.items()],
        "sensitivity_measure": "log slope" if is_slope(result) else "Spearman's rank correlation",
        "sensitivities": sensitivities(result),
    }  # fmt: skip


def _metric(result: SweepResult, name: str, column: FloatArray) -> dict[str, Any]:
    """Percentiles and extremes of a metric over the samples that have it; null where none has."""
    values = column[result.results.ok & np.isfinite(column)]
    at = (0.0, 5.0, 50.0, 95.0, 100.0)
    levels = np.percentile(values, at).tolist() if len(values) else [None] * len(at)
    words = ("lowest", "percentile_5", "median", "percentile_95", "highest")
    return {
        "name": name,
        "label": result.metric_labels[name],
        "samples": len(values),
        **dict(zip(words, levels, strict=True)),
    }
