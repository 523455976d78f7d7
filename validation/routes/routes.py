"""The routes to an FRF, side by side.

What differs between them is where M, C, K come from (exudyn, or the paper's equations), whether
the whole is solved or its parts are coupled, how an FRF is made (solved line by line, summed over
modes, or estimated from a run in time), and whether a part comes from a file.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Protocol

import numpy as np

from fbs import CoupledFrf, Frf, couple, couple_chain, direct_frf, modal_frf
from mbs_models.model.parameters import Drivetrain

from ..arrays import FloatArray
from ..errors import CommandError, ill_conditioned
from .source import Source, Synthesis, equations_source, exudyn_source

Labels = Sequence[str] | None

MODAL = ", modal synthesis"


class Route(Protocol):
    """A way to FRFs of the whole drivetrain."""

    @property
    def name(self) -> str:
        """As reports have it."""

    def frf(self, lines: FloatArray, responses: Labels = None, excitations: Labels = None) -> Frf:
        """Receptances on some lines (Hz) between labels (None: all there are)."""


@dataclass(frozen=True)
class MatrixRoute:
    """FRFs solved from matrices, or coupled from those of parts.

    Attributes
    ----------
    name
        As reports have it.
    solve
        (n_line,) Hz → receptances between all labels there are.
    modal
        Whether they are summed over modes, not solved line by line.
    """

    name: str
    solve: Callable[[FloatArray], Frf]
    modal: bool = False

    def frf(self, lines: FloatArray, responses: Labels = None, excitations: Labels = None) -> Frf:
        """Receptances on some lines (Hz) between labels (None: all there are).

        Raises
        ------
        FbsError, CommandError
            There is no finite FRF, or the matrices are too badly conditioned.
        """
        try:
            frf = self.solve(lines)
        except np.linalg.LinAlgError as error:
            raise ill_conditioned(self.name, error) from error
        if (responses, excitations) in ((None, None), (frf.responses, frf.excitations)):
            return frf
        return frf.select(responses, excitations)


def whole_route(source: Source, synthesis: Synthesis | None = None) -> MatrixRoute:
    """The whole system's own FRF, by the source's synthesis or another one."""
    chosen = synthesis or source.synthesis
    modal = chosen is modal_frf
    name = source.name + (MODAL if modal else "")
    return MatrixRoute(name, lambda lines: chosen(source.whole, lines), modal)


def fbs_route(source: Source, synthesis: Synthesis = direct_frf) -> MatrixRoute:
    """FBS: the parts' FRFs, coupled at the hubs."""
    modal = synthesis is modal_frf
    name = f"FBS of {source.name} stages" + (MODAL if modal else "")
    return MatrixRoute(name, lambda lines: couple_stages(source, lines, synthesis).frf, modal)


def substituted_route(source: Source, files: Mapping[str, Frf]) -> MatrixRoute:
    """FBS with some parts' FRFs from files; its lines must be among theirs."""
    return MatrixRoute(
        f"FBS with {', '.join(files)} from file",
        lambda lines: couple_stages(source, lines, files=files).frf,
    )


def couple_stages(
    source: Source,
    lines: FloatArray,
    synthesis: Synthesis = direct_frf,
    files: Mapping[str, Frf] | None = None,
) -> CoupledFrf:
    """The parts' FRFs, a source's or from files, coupled at the hubs."""
    given = files or {}
    parts = {
        part.name: given[part.name].at_lines(lines)
        if part.name in given
        else synthesis(source.stage(part.name), lines)
        for part in source.drivetrain.parts
    }
    return couple(parts, source.joints)


def kernel_condition(source: Source, lines: FloatArray) -> FloatArray:
    """Amplification of the parts' errors in the interface kernel, per line.

    Only the interface DoFs' FRFs are needed for it, not all that the parts have.
    """
    ends = [end for joint in source.joints for end in (joint.first, joint.second)]
    interface = {
        name: direct_frf(system, lines, wanted, wanted)
        for name, system in source.stages.items()
        if (wanted := list(dict.fromkeys(label for part, label in ends if part == name)))
    }
    return couple(interface, source.joints).kernel_condition


def comparison_routes(exudyn: Source, equations: Source) -> tuple[MatrixRoute, ...]:
    """Every route that is held against exudyn's whole system line by line."""
    return (
        whole_route(equations),
        fbs_route(exudyn),
        fbs_route(equations),
        whole_route(exudyn, modal_frf),
        fbs_route(exudyn, modal_frf),
    )


def frf_by_name(
    drivetrain: Drivetrain,
    route: str,
    frequency: FloatArray,
    responses: Labels,
    excitations: Labels,
    stage: str | None = None,
) -> tuple[Frf, str]:
    """The FRFs of one route, by its name on the command line, and how they were made.

    Parameters
    ----------
    drivetrain
        What is computed.
    route
        The route's name.
    frequency
        (n_frequency,) Hz.
    responses, excitations
        Labels (None: all there are).
    stage
        A stage or inertia alone, with its halves of the hubs (None: the whole).

    Returns
    -------
    frf, method
        What was asked for only; the method in words.

    Raises
    ------
    CommandError
        There is no such route or stage.
    """
    if route not in ("exudyn", "fbs", "equations"):
        raise CommandError(f"--route = {route!r}: must be exudyn, fbs or equations")
    part = None if stage is None else known_part(drivetrain, stage, "--stage")
    if route == "fbs":
        if part is not None:
            raise CommandError(
                f"--stage = {stage!r}: route fbs couples the stages; for one alone, --route "
                "must be exudyn or equations"
            )
        source: Source = exudyn_source(drivetrain)
        if responses is None or excitations is None or has_loops(drivetrain):
            frf = fbs_route(source).frf(frequency, responses, excitations)
            return frf, "direct solve of the stages, coupled all at once"
        chain = couple_chain(
            source.stages, source.joints, frequency, responses, excitations, synthesis=direct_frf
        )
        return chain.frf, "direct solve of the stages at their interfaces, coupled one by one"
    source = source_by_name(route, drivetrain)
    system = source.whole if part is None else source.stage(part)
    # Summed modes would be as fast, but FRFs far below the largest would be their round-off.
    return direct_frf(system, frequency, responses, excitations), "direct solve, line by line"


def source_by_name(name: str, drivetrain: Drivetrain) -> Source:
    """The equations, or else exudyn."""
    return equations_source(drivetrain) if name == "equations" else exudyn_source(drivetrain)


def has_loops(drivetrain: Drivetrain) -> bool:
    """Whether couplings close a loop of parts: each group of n parts has n − 1 if not."""
    joining = sum(coupling.transmits or bool(coupling.dofs) for coupling in drivetrain.couplings)
    return joining > len(drivetrain.parts) - len(drivetrain.groups())


def known_part(drivetrain: Drivetrain, name: str, option: str) -> str:
    """The name of a stage or inertia, as an option gives it.

    Raises
    ------
    CommandError
        There is none of that name; the nearest is named.
    """
    names = [part.name for part in drivetrain.parts]
    if name not in names:
        near = get_close_matches(name, names, n=1)
        hint = f"did you mean {near[0]}? " if near else ""
        raise CommandError(
            f"{option} = {name!r}: is no stage or inertia of '{drivetrain.name}'; {hint}"
            f"there are {', '.join(names)}"
        )
    return name
