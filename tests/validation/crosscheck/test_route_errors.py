"""What goes wrong inside a route is a disagreement, named with its reason, not bad input."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fbs import Frf, SecondOrderSystem
from fbs.errors import FbsError, SingularLineError
from mbs_models.errors import ModelError
from mbs_models.model.parameters import Drivetrain
from tests.strategies import damped, paper
from validation.crosscheck.result import CrossCheck
from validation.crosscheck.study import cross_check
from validation.report.publish import publish
from validation.routes import equations
from validation.routes.bands import Band
from validation.routes.source import Source

BAND = Band(100.0, 15000.0, 100.0)


def whole_fails(_: Drivetrain) -> SecondOrderSystem:
    raise ModelError("the sun has no radius")


def stage_fails(_: Drivetrain, name: str) -> SecondOrderSystem:
    raise FbsError(f"{name} was lost")


def renamed(drivetrain: Drivetrain) -> SecondOrderSystem:
    system = equations.drivetrain_system(drivetrain)
    dofs = tuple(dof.replace("sun.w", "sun.theta") for dof in system.dofs)
    return replace(system, dofs=dofs, derived={})


def indefinite(drivetrain: Drivetrain) -> SecondOrderSystem:
    system = equations.drivetrain_system(drivetrain)
    return replace(system, stiffness=system.stiffness - 1e9 * np.eye(len(system.dofs)))


def weightless(drivetrain: Drivetrain) -> SecondOrderSystem:
    system = equations.drivetrain_system(drivetrain)
    return replace(system, mass=0.0 * system.mass)


def checked(
    whole: Callable[[Drivetrain], SecondOrderSystem] = equations.drivetrain_system,
    stage: Callable[[Drivetrain, str], SecondOrderSystem] = equations.stage_system,
) -> CrossCheck:
    return cross_check(
        damped(paper()), BAND, equations=lambda d: Source("equations", d, whole, stage)
    )


def failures(result: CrossCheck) -> set[tuple[str, str]]:
    return {
        (check.routes[1], finding)
        for check in result.checks
        if not check.agrees
        for finding in check.findings
    }


@pytest.mark.parametrize(
    ("whole", "reason"),
    [
        (whole_fails, "equations: the sun has no radius (ModelError)"),
        (renamed, "these DoFs are in one of the two only"),
        (indefinite, "stiffness"),
        (weightless, "mass"),
    ],
    ids=["no matrices", "other labels", "indefinite", "no mass"],
)
def test_a_whole_that_fails_is_a_disagreement(
    whole: Callable[[Drivetrain], SecondOrderSystem], reason: str, tmp_path: Path
) -> None:
    result = checked(whole)
    assert not result.agrees
    named = [words for route, words in failures(result) if route == "equations"]
    assert any(reason in words for words in named), named
    # the others are compared as ever
    others = [c for c in result.checks if c.routes[1] == "FBS of exudyn stages"]
    assert others
    assert all(check.agrees for check in others)
    page, numbers, *_ = publish(result, tmp_path)
    assert "equations" in page.read_text()
    assert numbers.exists()


def test_stages_that_fail_are_a_disagreement(tmp_path: Path) -> None:
    result = checked(stage=stage_fails)
    assert not result.agrees
    assert ("equations stages", "equations stages: reducer was lost (FbsError)") in failures(result)
    assert (
        "FBS of equations stages",
        "FBS of equations stages: reducer was lost (FbsError)",
    ) in failures(result)
    whole = [check for check in result.checks if check.routes == ("exudyn", "equations")]
    assert any(check.agrees for check in whole)
    publish(result, tmp_path)


def test_a_synthesis_that_fails_is_a_disagreement(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object) -> Frf:
        raise FbsError("a mode was lost")

    monkeypatch.setattr("validation.routes.routes.modal_frf", fails)
    result = checked()
    failed = {route for route, words in failures(result) if "a mode was lost" in words}
    assert len(failed) == 2


def test_a_line_on_a_pole_stays_bad_input() -> None:
    with pytest.raises(SingularLineError):
        cross_check(paper(), Band(0.0, 100.0, 10.0))
