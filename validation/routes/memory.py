"""How much memory a command holds, so that what does not fit is refused before it begins."""

from __future__ import annotations

from collections.abc import Sequence

from mbs_models.model.parameters import Drivetrain

from ..errors import CommandError
from .bands import Band
from .routes import has_loops, known_part
from .source import equations_source

MOST_BYTES = 2e9  # a sweep's results have the same limit
COMPLEX = 16  # bytes

# `run` keeps every curve of its report by every route: the complex number of each value, once more
# on its way to results.npz, what grows with the lines beside them, and the blocks of lines that are
# being compared (150 bytes measured, all of it on 24 000 lines).
BYTES_PER_CURVE_VALUE = 160
ROUTES = 6

# `frf` holds the matrix and the one it is made from (coupled and selected, or converted);
# matplotlib keeps x, y and the path of every curve.
MATRICES, MATRICES_DRAWN = 2, 9
# The axis, ω, and what one FRF is turned into on its way to a file (11 measured).
ARRAYS_BY_LINE = 12

# A piece of a sweep: ten samples and the FRFs of the parts they are coupled from (1 to 1.9 kB
# measured).
BYTES_PER_SWEPT_LINE = 2000


def require_memory(
    lines: Band,
    bytes_per_line: float,
    what: str,
    remedy: str = "a larger --df or a narrower band (--fmin, --fmax)",
) -> None:
    """Refuse a band whose lines take more than `MOST_BYTES`.

    Parameters
    ----------
    lines
        The band; nothing of its size is made.
    bytes_per_line
        What the command holds at its most.
    what
        Of which there are so many lines.
    remedy
        What makes it smaller.

    Raises
    ------
    CommandError
        With the size and what to do.
    FbsError
        The band is no axis.
    """
    size = lines.count * bytes_per_line
    if size > MOST_BYTES:
        raise CommandError(
            f"{lines.count:.10g} lines of {what} take {size / 1e9:.3g} GB of memory, more than "
            f"{MOST_BYTES / 1e9:g} GB; give {remedy}"
        )


def run_bytes(drivetrain: Drivetrain) -> int:
    """Bytes per line of a cross-check: of each part two curves, of each hub one, one across."""
    curves = 2 * len(drivetrain.parts) + len(drivetrain.couplings) + 1
    return curves * ROUTES * BYTES_PER_CURVE_VALUE


def frf_count(
    drivetrain: Drivetrain,
    route: str,
    responses: Sequence[str] | None,
    excitations: Sequence[str] | None,
    stage: str | None = None,
) -> int:
    """How many FRFs are computed for those asked for, as `routes.frf_by_name` does it.

    Raises
    ------
    CommandError
        There is no such stage.
    """
    source = equations_source(drivetrain)
    if stage is None:
        n_dofs = len(source.whole.labels)
    else:
        n_dofs = len(source.stage(known_part(drivetrain, stage, "--stage")).labels)
    if route == "fbs" and (responses is None or excitations is None or has_loops(drivetrain)):
        return n_dofs**2  # the stages are coupled with all they have
    return _number(responses, n_dofs) * _number(excitations, n_dofs)


def _number(labels: Sequence[str] | None, n_dofs: int) -> int:
    return n_dofs if labels is None else len(labels)


def frf_bytes(n_frfs: int, drawn: bool) -> int:
    """Bytes per line of FRFs, as numbers or drawn to a picture."""
    return COMPLEX * (n_frfs * (MATRICES_DRAWN if drawn else MATRICES) + ARRAYS_BY_LINE)
