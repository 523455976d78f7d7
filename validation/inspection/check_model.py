"""``crosscheck check``: what a model file was understood to say, and what is odd about it."""

from __future__ import annotations

from collections.abc import Iterator

from mbs_models.errors import ModelError
from mbs_models.gears.power_flow import PowerFlow, power_flow
from mbs_models.modal.mode_kinds import label_inertias, rigid_body_count
from mbs_models.model.model_file import load
from mbs_models.model.parameters import Drivetrain
from mbs_models.representation import listing
from mbs_models.sanity.free_motion import count_free_rotations, free_to_move, input_turns
from mbs_models.sanity.rules import findings
from mbs_models.sanity.teeth import teeth_carry_load
from mbs_models.system.read_back import drivetrain_components

from ..checks.model_warnings import model_warnings
from ..routes.equations import drivetrain_system, rigid_body_motions
from ..runtime.streams import warn

MOST_DOFS = 1000  # whose free motions are counted: the time grows with their cube
PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""))


def check_model(model: str) -> None:
    """Validate a model, print what was understood, and warn of what is probably typed wrong.

    Raises
    ------
    ModelError
        It is no drivetrain.
    """
    drivetrain = load(model)
    understood(drivetrain)
    n_dofs = len(label_inertias(drivetrain))
    print(f"  {n_dofs} DoF labels in all")
    if n_dofs > MOST_DOFS:
        print(f"  more than {MOST_DOFS}: what moves freely is not counted")
        warn([*drivetrain.warnings(), *map(str, findings(drivetrain))])
        return
    expected = rigid_body_motions(drivetrain)
    found = rigid_body_count(drivetrain_system(drivetrain).stiffness)
    verdict = "as found in K" if expected == found else f"but {found} found in K"
    print(f"  rigid-body modes: {expected} by what springs there are, {verdict}")
    parts = drivetrain_components(drivetrain)
    for group in drivetrain.groups():
        names = listing([part.name for part in drivetrain.parts if part.name in group])
        print(f"  {names}: {_free(count_free_rotations(drivetrain, parts, group))}")
    unmoved = tuple(input_turns(drivetrain, parts))
    notes = [*findings(drivetrain), *free_to_move(drivetrain, parts), *unmoved]
    warnings = [*model_warnings(drivetrain), *map(str, notes)]
    if drivetrain.operation is None:
        print("  no [operation] table: no speeds, mesh frequencies or torques")
    elif not unmoved:
        warnings += _at_work(drivetrain)
    warn(warnings)


def _free(count: int) -> str:
    if count == 0:
        return "held, nothing turns freely"
    return "turns freely as one" if count == 1 else f"{count} free rotations"


def _at_work(drivetrain: Drivetrain) -> list[str]:
    """Print the drivetrain at its operating point; returns what is odd there."""
    operation = drivetrain.operation
    assert operation is not None
    speed = operation.speed_range[1] if operation.speed is None else operation.speed
    warnings: list[str] = []
    for torque in dict.fromkeys((operation.torque, None)):
        try:
            flow = power_flow(drivetrain, speed, torque)
        except ModelError as error:
            warnings.append(str(error))
            continue
        where = " (end of speed_range)" if operation.speed is None else ""
        print("\n".join(f"  {line}" for line in _lines(drivetrain, flow, torque, where)))
        return [*warnings, *map(str, teeth_carry_load(drivetrain, flow))]
    return list(dict.fromkeys(warnings))


def _lines(
    drivetrain: Drivetrain, flow: PowerFlow, torque: float | None, where: str
) -> Iterator[str]:
    if flow.ratio is not None:
        sense = "the same sense" if flow.ratio > 0.0 else "opposite senses"
        yield f"ratio {flow.input} to {flow.output}: {_to_one(abs(flow.ratio))}, {sense}"
    given = with_prefix(torque, "N m") if torque else "no torque given"
    yield f"at {flow.speed_rpm:g} rpm of {flow.input}{where}, {given}:"
    width = max(map(len, drivetrain.bodies))
    for body in drivetrain.bodies:
        carried = f"  {with_prefix(flow.torques[body], 'N m')}" if body in flow.torques else ""
        yield f"  {body:{width}}  {_rounded(flow.speeds[body]):>8} rpm{carried}"
    for stage in (stage for stage in drivetrain.stages if stage.mesh_families()):
        frequency = flow.mesh_frequencies.get(stage.name)
        known = "none without teeth that turn"
        if frequency is not None:
            known = with_prefix(frequency, "Hz")
        yield f"  mesh frequency of {stage.name}: {known}"


def _to_one(ratio: float) -> str:
    return f"{ratio:.4g} : 1" if ratio >= 1.0 else f"1 : {1.0 / ratio:.4g}"


def with_prefix(value: float, unit: str) -> str:
    """A quantity as engineers write it, in four digits: 8.676 MN m."""
    factor, prefix = next((each for each in PREFIXES if abs(value) >= each[0]), PREFIXES[-1])
    return f"{value / factor:.4g} {prefix}{unit}"


def _rounded(speed: float) -> str:
    """Four digits; round-off of a body that stands still is 0."""
    return f"{round(speed, 6) + 0.0:.4g}"


def understood(drivetrain: Drivetrain) -> None:
    """Print what a model file was understood to say."""
    print(f"{drivetrain.name}: valid")
    for stage in drivetrain.stages:
        print(f"  stage '{stage.name}': {stage.describe()}")
    for rotor in drivetrain.inertias:
        print(f"  inertia '{rotor.name}': {rotor.describe()}")
    for coupling in drivetrain.couplings:
        springs = " and ".join(k if isinstance(k, str) else f"{k:g} N/m" for _, k in coupling.ends)
        moves = f", and along {', '.join(coupling.dofs)}" if coupling.dofs else ""
        ends = f"{coupling.first} – {coupling.second}"
        print(f"  coupling '{coupling.name}': {ends}, {springs}{moves}")
