"""The numbers of coupling, decoupling and identification."""

from __future__ import annotations

from typing import Any

from ..report.documents import SCHEMA_VERSION
from ..report.provenance import Provenance
from .result import SubstructuringResult


def substructuring_document(result: SubstructuringResult, made: Provenance) -> dict[str, Any]:
    """As nested dicts and lists."""
    return {
        "schema_version": SCHEMA_VERSION,
        "command": result.command,
        "verdict": result.verdict,
        "conclusions": result.conclusions,
        "warnings": result.warnings,
        "date": made.date,
        "platform": made.platform,
        "versions": made.versions,
        "timings_s": result.seconds,
        "parts": [
            {
                "name": part.name,
                "file": part.path,
                "responses": part.frf.responses,
                "excitations": part.frf.excitations,
                "quality": part.quality,
            }
            for part in result.parts
        ],
        "at": result.at,
        "how": result.how,
        "frequency_hz": result.frequency,
        "condition": result.condition,
        "error_is": result.error_is,
        "curves": [
            {"name": c.name, "values": c.values, "error": c.error, "lost": int(c.lost.sum())}
            for c in result.curves
        ],
        "springs": [
            {
                "pair": pair,
                "form": found.form,
                "stiffness": spring.stiffness,
                "stiffness_interval": spring.stiffness_interval,
                "stiffness_told": spring.tells_stiffness,
                "damping": spring.damping,
                "damping_interval": spring.damping_interval,
                "damping_told": spring.tells_damping,
                "misfit_over_spread": spring.residual,
            }
            for found in result.identified
            for pair, spring in zip(found.joint.at, found.springs, strict=True)
        ],
    }
