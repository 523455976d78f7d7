"""What is asked of a study of truncation, checked and complete before anything is computed."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

from fbs import FbsError, Tolerance
from fbs.axes import axis_ends
from mbs_models.modal.mode_kinds import label_inertias
from mbs_models.model.parameters import Drivetrain, Part

from ..errors import CommandError
from ..routes.bands import Band, band, elastic_frequencies, left_out
from ..routes.routes import known_part
from ..routes.source import equations_source

TOLERANCE = re.compile(r"\s*([-+.\w]+?)\s*(db|scaled)?\s*", re.IGNORECASE)
FIRST, LAST = 1.0, 4000.0  # Hz, where no band is given
MOST_LINES = 4000  # of the default step
HIGHEST_ORDER = 2
LENT = 0.01

Pair = tuple[str, str]


@dataclass(frozen=True)
class TruncationPlan:
    """A study of truncation as laid out.

    Attributes
    ----------
    drivetrain
        What is cut.
    stages
        Stages and inertias whose modes may be left out; the others stay complete.
    band
        The lines.
    tolerance
        What FRFs must meet.
    pairs
        (response, excitation) of the FRFs.
    highest_order
        Of residuals; −1: none are kept.
    loss_factor
        Lent to a drivetrain without damping; 0 otherwise.
    """

    drivetrain: Drivetrain
    stages: tuple[str, ...]
    band: Band
    tolerance: Tolerance
    pairs: tuple[Pair, ...]
    highest_order: int = HIGHEST_ORDER
    loss_factor: float = 0.0

    @property
    def notes(self) -> tuple[str, ...]:
        """What was assumed."""
        elastic = elastic_frequencies(equations_source(self.drivetrain).whole)
        unseen = left_out(self.band, elastic, "--band {0:g}:{1:g}:{2:g}")
        if not self.loss_factor:
            return unseen
        return (
            *unseen,
            f"the model has no damping: a loss factor of {100 * self.loss_factor:g} % is lent to "
            "every stage, so that errors at resonances are finite; joints have none",
        )

    @property
    def unit(self) -> str:
        """Of errors: dB, or none."""
        return "" if self.tolerance.scaled else " dB"


def plan(
    drivetrain: Drivetrain,
    *,
    stages: Sequence[str] = (),
    band_text: str | None = None,
    tolerance: str = "0.1dB",
    responses: Sequence[str] | None = (),
    excitations: Sequence[str] | None = (),
    highest_order: int = HIGHEST_ORDER,
) -> TruncationPlan:
    """Lay a study of truncation out.

    Parameters
    ----------
    drivetrain
        The model.
    stages
        Names; none: all.
    band_text
        As typed, FROM:TO or FROM:TO:STEP (Hz).
    tolerance
        As typed, 0.1dB or 0.001scaled.
    responses, excitations
        DoFs, None: all, empty: the drive points of hubs and of every part's first body, and
        through the drivetrain.
    highest_order
        Of residuals.

    Raises
    ------
    CommandError
        A stage, a DoF, the band or the tolerance is none.
    """
    names = tuple(dict.fromkeys(known_part(drivetrain, name, "--stage") for name in stages))
    damping = drivetrain.damping
    damped = damping.stiffness_proportional or damping.mass_proportional
    return TruncationPlan(
        drivetrain,
        names or tuple(part.name for part in drivetrain.parts),
        parse_band(band_text),
        parse_tolerance(tolerance),
        _pairs(drivetrain, responses, excitations),
        highest_order,
        0.0 if damped else LENT,
    )


def parse_band(text: str | None) -> Band:
    """Lines of FROM:TO or FROM:TO:STEP (Hz).

    Raises
    ------
    CommandError, FbsError
        They cannot be read, or are no axis.
    """
    if text is None:
        return Band(FIRST, LAST, 1.0, default=frozenset({"fmin", "df"}))
    try:
        values = [float(item) for item in text.split(":")]
    except ValueError:
        values = []
    if len(values) not in (2, 3) or not all(map(math.isfinite, values)) or values[1] <= values[0]:
        raise CommandError(f"--band = {text!r}: must be FROM:TO or FROM:TO:STEP, as 1:4000:1 (Hz)")
    if len(values) == 3:
        try:
            axis_ends(*values)
        except FbsError as error:
            raise CommandError(f"--band = {text!r}: {error}") from error
        return Band(values[0], values[1], values[2])
    step = band(None, values[1], None, max(1, int(5e7 / MOST_LINES))).df
    first = max(math.ceil(values[0] / step), 1) * step
    return Band(first, math.floor(values[1] / step) * step, step)


def parse_tolerance(text: str) -> Tolerance:
    """A tolerance: ``0.1dB``, ``0.1`` (dB), or ``0.001scaled``.

    Raises
    ------
    CommandError
        It is none.
    """
    found = TOLERANCE.fullmatch(text)
    try:
        value = float(found[1]) if found else math.nan
    except ValueError:
        value = math.nan
    scaled = found is not None and (found[2] or "").lower() == "scaled"
    if not 0.0 < value < (1.0 if scaled else math.inf):
        raise CommandError(
            f"--tolerance = {text!r}: must be a number of dB above 0, like 0.1dB, or a scaled "
            "error between 0 and 1, like 0.001scaled"
        )
    return Tolerance(value, scaled)


def _pairs(
    drivetrain: Drivetrain, responses: Sequence[str] | None, excitations: Sequence[str] | None
) -> tuple[Pair, ...]:
    known = label_inertias(drivetrain)
    for option, labels in (("--response", responses), ("--excitation", excitations)):
        for label in labels or ():
            if label not in known:
                raise CommandError(f"{option} = {label!r}: no such DoF; known: {', '.join(known)}")
    if responses == () and excitations == ():
        return _default_pairs(drivetrain)
    rows = tuple(known) if responses is None else tuple(responses)
    columns = tuple(known) if excitations is None else tuple(excitations)
    return tuple((i, j) for i in rows or columns for j in columns or rows)


def _default_pairs(drivetrain: Drivetrain) -> tuple[Pair, ...]:
    """Drive points of hubs and of every part's first body, and through the drivetrain."""
    ends = [_first_body(part) for part in drivetrain.parts]
    points = [*(f"{coupling.name}.w" for coupling in drivetrain.couplings), *ends]
    through = ((ends[-1], ends[0]),) if len(ends) > 1 else ()
    return (*((point, point) for point in points), *through)


def _first_body(part: Part) -> str:
    """The rotation of a part's first body."""
    return next(label for label in part.drive_points if label.endswith(".w"))
