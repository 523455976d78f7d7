"""What `crosscheck explain` is asked: a model, what it is held against, and what may be wrong."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path

from fbs import Frf, SecondOrderSystem
from fbs.axes import require_same_frequency
from mbs_models.model.parameters import Drivetrain

from ..checks.part_uncertainty import Noise
from ..errors import CommandError
from ..routes.equations import drivetrain_system, stage_system
from ..routes.frf_input import NOTHING_SAID, FileOptions
from ..routes.routes import known_part
from .candidates import Case, Parameter, parameters
from .evidence import FrfEvidence
from .few_numbers import FrequencyEvidence
from .reading import read_evidence


@dataclass(frozen=True, eq=False)
class ExplanationPlan:
    """A question.

    Attributes
    ----------
    case
        The model against the evidence.
    theirs, ours
        The files; ours is None where the model's own result is.
    candidates
        Parameters that may be wrong.
    warnings
        What to mind about the files.
    stage
        The part whose result it is; empty: the whole's.
    """

    case: Case
    theirs: Path
    ours: Path | None
    candidates: tuple[Parameter, ...]
    warnings: tuple[str, ...] = ()
    stage: str = ""

    @property
    def drivetrain(self) -> Drivetrain:
        """The model."""
        return self.case.drivetrain


def plan(
    drivetrain: Drivetrain,
    theirs: Path,
    *,
    ours: Path | None = None,
    stage: str | None = None,
    only: Sequence[str] = (),
    options: FileOptions = NOTHING_SAID,
    noise: Noise | None = None,
) -> ExplanationPlan:
    """Read the evidence and choose the candidates.

    Parameters
    ----------
    drivetrain
        The model.
    theirs, ours
        Files: what is to be explained, and ours in place of the model's.
    stage
        The part alone whose result it is, with its halves of the hubs; None: the whole.
    only
        Patterns of parameters that may be wrong, as reducer.*; none: all.
    options
        What the user says of the files.
    noise
        Of natural frequencies, one standard deviation of their amplitude (relative).

    Raises
    ------
    CommandError
        A file, a stage or a pattern that does not fit.
    """
    part = None if stage is None else known_part(drivetrain, stage, "--stage")

    def build(other: Drivetrain) -> SecondOrderSystem:
        return drivetrain_system(other) if part is None else stage_system(other, part)

    system = build(drivetrain)
    evidence, notes = read_evidence(theirs, drivetrain, system.labels, system.dofs, options)
    if isinstance(evidence, FrequencyEvidence) and noise is not None:
        evidence = replace(evidence, tolerance=evidence.tolerance + 3.0 * noise.amplitude)
    if isinstance(evidence, FrfEvidence):
        evidence = evidence.known_as(system)
    case = Case(drivetrain, build, evidence)
    if ours is not None:
        own, more = read_evidence(ours, drivetrain, system.labels, system.dofs, options)
        if not (isinstance(own, FrfEvidence) and isinstance(evidence, FrfEvidence)):
            raise CommandError(f"--ours = {ours}: both files must hold FRFs")
        case = case.held_against(_with_ours(evidence, own, case, ours))
        notes = (*notes, *more)
    chosen = _candidates(drivetrain, only, part)
    return ExplanationPlan(case, theirs, ours, chosen, notes, part or "")


def _with_ours(evidence: FrfEvidence, own: FrfEvidence, case: Case, path: Path) -> FrfEvidence:
    """Theirs, with what our file has beyond the model: added to whatever the model becomes."""
    rows = [x for x in evidence.frf.responses if x in own.frf.responses]
    columns = [x for x in evidence.frf.excitations if x in own.frf.excitations]
    if not (rows and columns):
        raise CommandError(f"--ours = {path}: has no FRF between the DoFs of the other file")
    require_same_frequency(
        evidence.lines, own.lines, f"--ours = {path}: its lines are not those of the other file"
    )
    theirs, given = (each.frf.select(rows, columns) for each in (evidence, own))
    found = FrfEvidence(Frf(evidence.lines, theirs.values, rows, columns))
    return FrfEvidence(found.frf, given.values - found.ours(case.system))


def _candidates(
    drivetrain: Drivetrain, only: Sequence[str], part: str | None
) -> tuple[Parameter, ...]:
    known = parameters(drivetrain)
    if part is not None:  # other parts' are not in its result
        others = {each.name for each in drivetrain.parts} - {part}
        known = tuple(p for p in known if p.paths[0].partition(".")[0] not in others)
    for pattern in only:
        if not any(fnmatchcase(path, pattern) for p in known for path in p.paths):
            raise CommandError(
                f"--only = {pattern!r}: no parameter of '{drivetrain.name}' is like that; one is "
                f"{known[0].name}"
            )
    if not only:
        return known
    return tuple(p for p in known if all(any(fnmatchcase(x, o) for o in only) for x in p.paths))
