"""`crosscheck explore` without a browser: its numbers, its page's safety, and what is missing."""

from __future__ import annotations

import builtins
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mbs_models import load
from tests.contracts.pins import call
from tests.gearboxes import pair
from tests.strategies import changed, with_stage
from validation.explorer.assembly import stages, whole
from validation.explorer.motions import moving_drawing
from validation.explorer.page import explorer_page
from validation.explorer.plots import MISSING
from validation.routes.source import equations_source, exudyn_source


def test_a_hub_is_a_part_of_one_free_mode_between_two_joints() -> None:
    route = stages(equations_source(load("paper")))
    assert [part.name for part in route.parts] == ["reducer", "planetary", "coupling"]
    hub = route.parts[-1]
    assert hub.omega.tolist() == [0.0]
    assert hub.shapes.item() == pytest.approx(load("paper").couplings[0].hub_mass ** -0.5)
    assert [(joint.name, joint.stiffness) for joint in route.joints] == [
        ("coupling.first_stiffness", 1e8),
        ("coupling.second_stiffness", 1e5),
    ]


def test_only_dampers_of_their_own_are_listed() -> None:
    """A bearing with c of its own: its two directions, its c, and the k that has no β k."""
    drivetrain = load("paper")
    assert all(not part.rows for part in stages(exudyn_source(drivetrain)).parts)
    own = [[300.0, 50.0], [50.0, 80.0]]
    pinion = drivetrain.stage("reducer").model_dump(exclude_unset=True)["pinion"]
    damped = with_stage(drivetrain, "reducer", pinion=pinion | {"bearing_damping": own})
    for source in (exudyn_source(damped), equations_source(damped)):
        (part,) = whole(source).parts
        assert [part.dofs[row] for row in part.rows] == ["reducer.pinion.y", "reducer.pinion.z"]
        assert part.damping == pytest.approx(np.array(own), rel=1e-12)
        held = np.diag([pinion["bearing_y"], pinion["bearing_z"]])
        assert part.stiffness == pytest.approx(held, rel=1e-9)


def test_what_the_drawing_is_told_of_a_rotation() -> None:
    """w = r θ turns the disc by w / r on the page: 1 / (page units per metre · r) a metre."""
    source = exudyn_source(pair())
    motions = moving_drawing(source).motions
    first = motions["bodies"][0]
    turning = motions["dofs"].index("pair.pinion.w")
    ((dof, turn),) = [term for term in first["rows"][2] if term[0] == turning]
    assert dof == turning
    assert abs(turn) * first["radius"] == pytest.approx(1.0)


def test_nothing_in_a_name_leaves_its_place() -> None:
    pytest.importorskip("bokeh")
    name = "</script><img src=x onerror=alert(1)>\"'&"
    drivetrain = changed(pair(), name=name, source=name)
    text = explorer_page(exudyn_source(drivetrain), equations_source(drivetrain))
    assert "<img" not in text
    assert text.count("</script>") == 3
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)
    assert found is not None
    assert {"routes", "modes", "motions", "figures"} <= json.loads(found[1]).keys()
    assert "default-src 'none'" in text


def test_without_bokeh_it_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    real = builtins.__import__

    def refused(name: str, *arguments: Any, **more: Any) -> Any:
        if name == "bokeh":
            raise ImportError(name)
        return real(name, *arguments, **more)

    monkeypatch.setattr(builtins, "__import__", refused)
    for command in (("explore",), ("run", "--explore")):
        called = call(*command, "--out", str(tmp_path / "new"))
        assert called.code == 2
        assert MISSING in called.err
    assert not (tmp_path / "new").exists()


def test_run_links_it(tmp_path: Path) -> None:
    pytest.importorskip("bokeh")
    out = str(tmp_path)
    called = call("run", "lin-parker-3", "--df", "500", "--no-time", "--explore", "--out", out)
    assert called.code == 0
    assert '<a href="explore.html">' in (tmp_path / "report.html").read_text(encoding="utf-8")
    assert (tmp_path / "explore.html").stat().st_size > 1e6


def test_bad_models_are_told_and_write_nothing(tmp_path: Path) -> None:
    pytest.importorskip("bokeh")
    called = call("explore", "papr", "--out", str(tmp_path / "new"))
    assert called.code == 2
    assert "paper" in called.err
    assert not (tmp_path / "new").exists()
