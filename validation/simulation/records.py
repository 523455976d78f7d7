"""The record of a run as a file, where it is kept."""

from __future__ import annotations

from typing import Any, BinaryIO

from fbs import Quantity, Record
from fbs.files.record_files import write_record_to

from ..report.provenance import Provenance
from ..runtime.output_folder import Writer
from .describe import describe_excitation
from .result import SimulationResult

FORMATS = ("npz", "csv", "uff")


def record_writer(result: SimulationResult, made: Provenance, kind: str) -> Writer:
    """Writes forces and accelerations to a file of one of the formats."""
    metadata = _metadata(result, made)
    if kind == "uff":  # which has room for 240 characters
        metadata = {key: metadata[key] for key in ("date", "exudyn")}

    def write(file: BinaryIO) -> None:
        write_record_to(accelerations(result), file, f"record.{kind}", metadata)

    return write


def accelerations(result: SimulationResult) -> Record:
    """All forces and accelerations of a run."""
    record = result.record
    assert record.acceleration is not None
    return Record(
        record.sampling_frequency,
        record.forces,
        record.acceleration,
        record.excitations,
        record.labels,
        Quantity.ACCELERANCE,
    )


def _metadata(result: SimulationResult, made: Provenance) -> dict[str, Any]:
    return {
        "model": result.drivetrain.name,
        "excitations": [describe_excitation(excitation) for excitation in result.excitations],
        "integrator": result.record.integrator.reason,
        "date": made.date,
        "exudyn": made.versions["exudyn"],
    }
