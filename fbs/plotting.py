"""Curves drawn by matplotlib: what the `plot` methods do.

The one module of this package that knows matplotlib. It is imported when a `plot` method is
called: numbers need no pictures.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from ._kernels.checks import ComplexArray, FloatArray
from .errors import FbsError

if TYPE_CHECKING:
    from matplotlib.axes import Axes as Axes

    Panels: TypeAlias = tuple[Axes, ...]

MOST_NAMED = 20
"""Curves that a legend names: more would hide them."""


def magnitude_and_phase(
    frequency: FloatArray,
    curves: Iterable[tuple[str, ComplexArray]],
    ordinate: str,
    axes: Sequence[Axes] | None = None,
) -> Panels:
    """Draw |H| on a logarithmic scale above the phase in degrees.

    Parameters
    ----------
    frequency : array, shape (nf,), Hz
    curves : iterable of (name, complex array of shape (nf,))
    ordinate : str
        What |H| is, and its unit.
    axes : two matplotlib Axes, optional
        Where to draw; default: a new figure of pyplot's.

    Raises
    ------
    FbsError
        Other than two axes are given.
    """
    magnitude, phase = _panels(axes, (3.0, 1.0))
    for name, values in curves:
        magnitude.semilogy(frequency, np.abs(values), label=name, lw=1)
        phase.plot(frequency, np.degrees(np.angle(values)), lw=1)
    magnitude.set_ylabel(ordinate)
    phase.set(xlabel="frequency, Hz", ylabel="phase, °", yticks=(-180, -90, 0, 90, 180))
    _finish((magnitude, phase))
    return magnitude, phase


def traces(
    time: FloatArray,
    panels: Sequence[tuple[str, Sequence[str], FloatArray]],
    axes: Sequence[Axes] | None = None,
) -> Panels:
    """Draw samples over time, one panel below the other.

    Parameters
    ----------
    time : array, shape (n_sample,), s
    panels : sequence of (ordinate, names, array of shape (n_sample, n_name))
    axes : as many matplotlib Axes, optional
        Where to draw; default: a new figure of pyplot's.

    Raises
    ------
    FbsError
        Fewer or more axes are given than panels.
    """
    drawn = _panels(axes, (1.0,) * len(panels))
    for panel, (ordinate, names, samples) in zip(drawn, panels, strict=True):
        for name, column in zip(names, samples.T, strict=True):
            panel.plot(time, column, label=name, lw=1)
        panel.set_ylabel(ordinate)
    drawn[-1].set_xlabel("time, s")
    _finish(drawn)
    return drawn


def _panels(axes: Sequence[Axes] | None, heights: Sequence[float]) -> Panels:
    if axes is None:
        from matplotlib import pyplot

        _, new = pyplot.subplots(
            len(heights), sharex=True, squeeze=False, height_ratios=heights, layout="constrained"
        )
        return tuple(new[:, 0])
    if len(axes) != len(heights):
        raise FbsError(f"{len(heights)} axes are needed, one a panel; got {len(axes)}")
    return tuple(axes)


def _finish(panels: Panels) -> None:
    for panel in panels:
        panel.grid(visible=True, alpha=0.3)
        if 0 < len(panel.get_legend_handles_labels()[1]) <= MOST_NAMED:
            # "best" tries every point of every curve
            legend = panel.legend(fontsize="small", loc="upper right")
            for text in legend.get_texts():
                text.set_parse_math(False)  # a $ in a label is a $
