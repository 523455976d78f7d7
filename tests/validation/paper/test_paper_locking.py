"""Coordinates locked in exudyn's model are coordinates taken out of the equations."""

from __future__ import annotations

import numpy as np
import pytest

from fbs import direct_frf, real_modes
from fbs.condensation import block_dofs
from mbs_models.errors import ModelError
from mbs_models.model.model_file import load
from mbs_models.model.parameters import Drivetrain
from mbs_models.system.drivetrain import build_drivetrain
from mbs_models.system.locking import lock_dofs, project
from validation.checks.metrics import scaled_error
from validation.routes import equations


@pytest.fixture(scope="module")
def paper() -> Drivetrain:
    return load("paper")


LINES = np.arange(105.0, 4000.0, 50.0)


@pytest.mark.parametrize(
    "slaves",
    [
        ("coupling.w",),
        # planets 2 and 3 stand across: their u and v are two of exudyn's coordinates each
        ("planetary.planet2.u", "planetary.planet3.v", "planetary.planet1.w"),
        ("reducer.pinion.y", "reducer.wheel.rho", "planetary.sun.u"),
    ],
)
def test_locked_in_exudyn_is_blocked_in_the_equations(
    paper: Drivetrain, slaves: tuple[str, ...]
) -> None:
    locked = project(lock_dofs(build_drivetrain(paper), slaves))
    blocked = block_dofs(equations.drivetrain_system(paper), slaves)
    assert locked.dofs == blocked.dofs
    expected = direct_frf(blocked, LINES).values
    assert scaled_error(expected, locked.receptance(LINES)).max() < 1e-8


def test_a_derived_label_locks_what_it_follows(paper: Drivetrain) -> None:
    rigid = paper.couplings[0].model_copy(update={"first_stiffness": "rigid"})
    drivetrain = paper.model_copy(update={"couplings": (rigid,)})
    by_either = [
        project(lock_dofs(build_drivetrain(drivetrain), [label]))
        for label in ("coupling.w", "reducer.wheel.w")
    ]
    for found in by_either:
        assert "coupling.w" not in found.dofs
        assert "reducer.wheel.w" not in found.dofs
    expected = real_modes(block_dofs(equations.drivetrain_system(drivetrain), ["coupling.w"]))
    assert by_either[0].shapes.shape == (len(expected.dofs),) * 2


def test_unknown_and_all_are_refused(paper: Drivetrain) -> None:
    with pytest.raises(ModelError, match=r"unknown DoF 'nothing\.w'"):
        lock_dofs(build_drivetrain(paper), ["nothing.w"])
    system = build_drivetrain(paper)
    with pytest.raises(ModelError, match="nothing is left"):
        lock_dofs(system, [dof.label for dof in system.dofs])
