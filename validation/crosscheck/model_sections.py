"""The report's pictures of the model: its drawing, its components' energies, its mode shapes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from mbs_models.modal.energy import ComponentShares
from mbs_models.modal.mode_kinds import Mode

from ..picture.axial import draw_shafts
from ..picture.drawing import draw_model
from ..picture.energy_map import energy_map
from ..picture.layout import lay_out
from ..picture.mode_shapes import MOST, ModeShapes, draw_mode_shapes
from ..report.style import KIND_COLORS
from .campbell import Campbell, draw_campbell
from .results import CrossCheck


@dataclass(frozen=True)
class EnergyRow:
    """A mode, and the components that hold most of its energy."""

    number: int
    mode: Mode
    kinetic: tuple[tuple[str, float], ...]
    strain: tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class Anatomy:
    """Pictures and tables of the model and its modes."""

    shafts: str
    model: str
    energy_map: str
    energies: tuple[EnergyRow, ...]
    shapes: ModeShapes
    campbell: Campbell | None


def draw_anatomy(result: CrossCheck) -> Anatomy:
    """Draw the model, and where its modes' energy sits."""
    layout = lay_out(result.drivetrain, result.components)
    return Anatomy(
        shafts=draw_shafts(result.drivetrain, layout, result.components),
        model=draw_model(result.drivetrain, layout),
        energy_map=energy_map(result.component_energy, result.modes.modes),
        shapes=draw_mode_shapes(layout, result.components, result.modes),
        campbell=draw_campbell(result),
        energies=tuple(_energy_rows(result.component_energy, result.modes.modes)),
    )


def _energy_rows(shares: ComponentShares, modes: Sequence[Mode]) -> list[EnergyRow]:
    return [
        EnergyRow(i + 1, mode, shares.most("kinetic", i), shares.most("strain", i))
        for i, mode in enumerate(modes)
    ]


def kinds_drawn(result: CrossCheck) -> dict[str, str]:
    """The kinds of the modes drawn, and their colours."""
    drawn = result.modes.modes[:MOST]
    return {mode.kind: KIND_COLORS[mode.kind] for mode in drawn}


def first_shown(result: CrossCheck) -> int:
    """Number of the mode that moves first: the lowest that strains anything."""
    modes = result.modes.modes
    elastic = [i for i, mode in enumerate(modes, start=1) if mode.frequency_hz > 0.0]
    return elastic[0] if elastic and elastic[0] <= MOST else 1


def short_frequency(frequency: float) -> str:
    """A natural frequency in few characters."""
    return f"{frequency:.4g}" if frequency < 1e4 else f"{frequency:.3g}".replace("e+0", "e")
