"""Runs in time drawn by matplotlib: what `TransientRecord.plot` does.

The one module of this package that knows matplotlib. It is imported when a `plot` method is
called: models and runs need no pictures.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .errors import ModelError

if TYPE_CHECKING:
    from matplotlib.axes import Axes as Axes

    Panels: TypeAlias = tuple[Axes, ...]

FloatArray = NDArray[np.float64]
MOST_NAMED = 20  # curves that a legend names: more would hide them


def traces(
    time: FloatArray,
    panels: Sequence[tuple[str, Sequence[str], FloatArray]],
    axes: Sequence[Axes] | None = None,
) -> Panels:
    """Draw samples over time, one panel below the other.

    Parameters
    ----------
    time
        (n,) s.
    panels
        Ordinate, names and samples (n, n_name) of each.
    axes
        Where to draw, as many as panels. None: a new figure of pyplot's.

    Raises
    ------
    ModelError
        There are no panels, or fewer or more axes than panels.
    """
    if not panels:
        raise ModelError("the record holds no force, motion or mesh force to draw")
    drawn = _new(len(panels)) if axes is None else tuple(axes)
    if len(drawn) != len(panels):
        wanted = ", ".join(ordinate for ordinate, _, _ in panels)
        raise ModelError(f"{len(panels)} axes are needed ({wanted}); got {len(drawn)}")
    for panel, (ordinate, names, samples) in zip(drawn, panels, strict=True):
        for name, column in zip(names, samples.T, strict=True):
            panel.plot(time, column, label=name, lw=1)
        panel.set_ylabel(ordinate)
        panel.grid(visible=True, alpha=0.3)
        if 0 < len(names) <= MOST_NAMED:
            # "best" tries every point of every curve
            legend = panel.legend(fontsize="small", loc="upper right")
            for text in legend.get_texts():
                text.set_parse_math(False)  # a $ in a label is a $
    drawn[-1].set_xlabel("time, s")
    return drawn


def _new(count: int) -> Panels:
    from matplotlib import pyplot

    _, axes = pyplot.subplots(count, sharex=True, squeeze=False, layout="constrained")
    return tuple(axes[:, 0])
