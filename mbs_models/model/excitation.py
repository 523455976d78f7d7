"""What a drivetrain is excited with: a signal at a DoF."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Generic, TypeVar

from ..errors import ModelError
from ..signals.lines import BandNoise, Signal, own_seeds
from .excitation_tables import ExcitationTable, MultisineTable, Setting, require_dof
from .parameters import Drivetrain

S = TypeVar("S", bound=Signal, covariant=True)


@dataclass(frozen=True)
class Excitation(Generic[S]):
    """A force at a DoF. Several may act at one DoF: they add up.

    Attributes
    ----------
    dof
        Label of the DoF; the force is the one conjugate to it (rotations: torque / r), in N.
    signal
        The force over time.
    """

    dof: str
    signal: S


def excitation_of(
    drivetrain: Drivetrain, table: ExcitationTable, setting: Setting | None = None
) -> Excitation[Signal]:
    """One table of a model file as a signal at a DoF; a moment M becomes the force M/r.

    Raises
    ------
    ModelError
        The drivetrain has no such DoF, a record cannot be read, or a multisine's period is longer
        than the record.
    """
    radii = drivetrain.dof_radii()
    try:
        require_dof("", table.dof, radii)
        signal: Signal = table.signal(radii[table.dof], setting or Setting())
    except ValueError as error:
        raise ModelError(f"excitation at {table.dof}: {error}") from error
    return Excitation(table.dof, signal)


def excitations_of(
    drivetrain: Drivetrain,
    tables: Sequence[ExcitationTable] | None = None,
    *,
    folder: str | Path = "",
    duration: float | None = None,
    sampling_frequency: float | None = None,
    seed: int = 0,
) -> tuple[Excitation[Signal], ...]:
    """Several tables at once, uncorrelated.

    Each random one without a seed draws its own from ``seed``. Multisines of one spacing share
    their lines out in turn, unless they say ``lines = "all"``.

    Parameters
    ----------
    drivetrain
        What is excited.
    tables
        Default: the drivetrain's own.
    folder
        Where relative paths of records start: the model file's folder.
    duration, sampling_frequency
        Of the record that is run, where that is decided: multisines' periods are fitted to it, and
        noise repeats after it.
    seed
        Another one gives other noise.

    Raises
    ------
    ModelError
        As for `excitation_of`.
    """
    given = drivetrain.excitations if tables is None else tuple(tables)
    common = Setting(Path(folder), duration, sampling_frequency)
    spacings = [
        table.spacing(common)
        if isinstance(table, MultisineTable) and table.lines == "shared"
        else 0
        for table in given
    ]
    inputs = Counter(spacings)
    return tuple(
        excitation_of(
            drivetrain,
            table,
            replace(
                common,
                seed=own,
                share=(spacings[:i].count(spacing), inputs[spacing]) if spacing else (0, 1),
            ),
        )
        for i, (table, spacing, own) in enumerate(
            zip(given, spacings, own_seeds(seed, len(given)), strict=True)
        )
    )


def check_record(
    excitation: Excitation[Signal], *, duration: float, sampling_frequency: float
) -> None:
    """Refuse an excitation that a record cannot show.

    Parameters
    ----------
    excitation
        What acts during the record.
    duration
        Of the record (s).
    sampling_frequency
        Of the record (Hz).

    Raises
    ------
    ModelError
        The band reaches the Nyquist frequency, or the record is shorter than one period.
    """
    signal = excitation.signal
    highest = signal.band[1]
    if highest >= sampling_frequency / 2.0:
        raise ModelError(
            f"excitation at {excitation.dof}: reaches {highest:g} Hz; must be below the Nyquist "
            f"frequency {sampling_frequency / 2.0:g} Hz of a record sampled at "
            f"{sampling_frequency:g} Hz"
        )
    if isinstance(signal, BandNoise):
        return  # a part of it is noise as well
    # A period missed by rounding alone is a whole one.
    if signal.period is not None and duration < signal.period * (1.0 - 1e-9):
        raise ModelError(
            f"excitation at {excitation.dof}: a record of {duration:g} s is shorter than one "
            f"period of {signal.period:g} s; record longer"
        )
