"""FRFs as functions of a universal file: nodes, directions, units, axes of six digits."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from .._kernels.checks import FloatArray
from ..axes import frequency_axis
from ..frf import Frf, Quantity
from .universal import (
    COHERENCE,
    EVEN,
    FRF,
    LINE,
    UNEVEN,
    Axis,
    End,
    Function,
    UffError,
)
from .universal_text import six_digits

RESPONSE, EXCITATION = "response: ", "excitation: "

FREQUENCY, FORCE = 18, 13
DATA_TYPES = {8: Quantity.RECEPTANCE, 11: Quantity.MOBILITY, 12: Quantity.ACCELERANCE}
UNITS = {Quantity.RECEPTANCE: "m", Quantity.MOBILITY: "m/s", Quantity.ACCELERANCE: "m/s^2"}
ANGULAR_UNITS = {unit: unit.replace("m", "rad") for unit in UNITS.values()}


@dataclass(frozen=True)
class Channel:
    """Where a DoF stands in a universal file.

    Attributes
    ----------
    node : int
    direction : int
        -6 to 6; above 3 a rotation, then written in rad and N m.
    radius : float
        r of a rotation carried as w = r·θ.
    """

    node: int
    direction: int = 0
    radius: float = 1.0

    @property
    def rotation(self) -> bool:
        """Whether it turns."""
        return abs(self.direction) > 3

    @property
    def end(self) -> End:
        """Node and direction."""
        return End(self.node, self.direction)


def refuse_unfit_label(label: str) -> None:
    """Refuse a label that does not survive an ID line."""
    longest = LINE - max(len(RESPONSE), len(EXCITATION))
    if len(label) > longest:
        raise UffError(f"label {label!r} has {len(label)} characters; UFF takes {longest}")
    if not label.isprintable() or label != label.strip():
        raise UffError(f"label {label!r} would not survive: unprintable, or blanks at its ends")


def _places(labels: Mapping[str, None], channels: Mapping[str, Channel]) -> dict[str, Channel]:
    next_node = max((c.node for c in channels.values()), default=0) + 1
    places = dict(channels)
    for label in labels:
        if label not in places:
            places[label] = Channel(next_node)
            next_node += 1
    return places


def functions(
    frf: Frf,
    channels: Mapping[str, Channel],
    coherence: FloatArray | None,
    averages: Mapping[str, int],
) -> Iterator[Function]:
    """Yield FRFs, each with its coherence; see `uff.write_uff_to`.

    Raises
    ------
    UffError
        Frequencies of more than six digits, fewer than two lines, labels that do not fit.
    """
    spacing = _spacing(frf.frequency)
    labels = dict.fromkeys(frf.responses + frf.excitations)
    for label in labels:
        refuse_unfit_label(label)
    places = _places(labels, channels)
    for j, excitation in enumerate(frf.excitations):
        for i, response in enumerate(frf.responses):
            to, at = places[response], places[excitation]
            values = frf.values[:, i, j] / (
                (to.radius if to.rotation else 1.0) * (at.radius if at.rotation else 1.0)
            )
            unit = UNITS[frf.quantity]
            data_type = {quantity: code for code, quantity in DATA_TYPES.items()}[frf.quantity]
            axes = (
                Axis(data_type, str(frf.quantity), ANGULAR_UNITS[unit] if to.rotation else unit),
                Axis(FORCE, "Moment" if at.rotation else "Force", "N m" if at.rotation else "N"),
            )
            yield _function(frf, (response, excitation), (to.end, at.end), axes, values, spacing)
            if coherence is not None:
                none = (Axis(0, "Coherence"), Axis(0))
                known = np.asarray(coherence[:, i, j])
                ends = (to.end, at.end)
                function = _function(
                    frf, (response, excitation), ends, none, known, spacing, kind=COHERENCE
                )
                if excitation in averages:
                    words = f"{averages[excitation]} averages"
                    function = replace(function, ids=(*function.ids[:2], words, *function.ids[3:]))
                yield function


def _function(
    frf: Frf,
    pair: tuple[str, str],
    ends: tuple[End, End],
    axes: tuple[Axis, Axis],
    values: np.ndarray,
    spacing: int,
    kind: int = FRF,
) -> Function:
    response, excitation = pair
    name = str(frf.quantity) if kind == FRF else "coherence"
    return Function(
        (
            f"{name} {response} / {excitation}"[:LINE],
            "NONE",
            "NONE",
            RESPONSE + response,
            EXCITATION + excitation,
        ),
        kind,
        *ends,
        Axis(FREQUENCY, "Frequency", "Hz"),
        *axes,
        frf.frequency,
        values,
        spacing,
        float(frf.frequency[1] - frf.frequency[0]),
    )


def _spacing(axis: FloatArray) -> int:
    """Return EVEN or UNEVEN: which of the two carries the axis through E13.5 unharmed."""
    if axis.size < 2:
        raise UffError(f"UFF needs two lines at least, there is only {axis[0]:.10g} Hz")
    first, step = six_digits([axis[0], axis[1] - axis[0]])
    if step > 0 and _same(even_axis(first, step, axis.size), axis):
        return EVEN
    stored = six_digits(axis)
    if _same(stored, axis):
        return UNEVEN
    worst = int(np.argmax(np.abs(stored - axis)))
    raise UffError(
        f"UFF keeps six digits of a frequency: neither a start of {axis[0]:.10g} Hz with a step "
        f"of {axis[1] - axis[0]:.10g} Hz nor every line fits ({axis[worst]:.12g} Hz would become "
        f"{stored[worst]:.12g} Hz); choose a start and a step of at most six digits, such as "
        f"{first:.10g} and {step:.10g} Hz, or another format"
    )


def _same(stored: FloatArray, axis: FloatArray) -> bool:
    return bool((np.abs(stored - axis) <= 1e-12 * axis).all())


def even_axis(first: float, step: float, count: int) -> FloatArray:
    """Return first + k step, by `frequency_axis` where `first` is a multiple of the step."""
    start = first / step
    if abs(start - round(start)) <= 1e-9 * max(1.0, start):
        return frequency_axis(first, (round(start) + count - 1) * step, step)
    return np.asarray(first + step * np.arange(count))
