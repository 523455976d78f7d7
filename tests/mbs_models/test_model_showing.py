"""How systems, modes and runs in time show themselves: a line, a table, a picture."""

from __future__ import annotations

import io
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.figure import Figure

from mbs_models import (
    Integrator,
    ModelError,
    TransientRecord,
    build_drivetrain,
    drivetrain_modes,
    linearize,
)
from mbs_models.model.parameters import PlanetaryStage
from tests.showing import WORST_LABEL, line_of, text_of
from tests.strategies import paper


@pytest.fixture(autouse=True)
def _close_figures() -> Iterator[None]:
    yield
    pyplot.close("all")


def test_systems() -> None:
    # pinion, wheel, hub; sun, ring, carrier, four planets; a mesh each with sun and ring, and one
    system = build_drivetrain(paper())
    (stage,) = paper().stages_of(PlanetaryStage)
    planets = stage.planet_count
    expected = f"{6 + planets} bodies, {1 + 2 * planets} meshes, 30 DoFs"
    assert line_of(system) == f"<MultibodySystem: {expected}>"
    assert "mesh reducer.pinion – wheel" in text_of(system, "reducer.pinion.w")
    linear = linearize(system)
    assert line_of(linear) == "<LinearizedSystem: 30 DoFs, undamped>"
    text_of(linear, "reducer.pinion.w")
    odd = replace(linear, dofs=(WORST_LABEL, *linear.dofs[1:]), derived={"hub": (WORST_LABEL, 0.5)})
    assert "1 derived label" in line_of(odd)
    assert f"hub = 0.5 {WORST_LABEL}" in text_of(odd, WORST_LABEL)


def test_modes() -> None:
    modes = drivetrain_modes(paper())
    assert line_of(modes).startswith("<Modes: 30 modes, 1 rigid-body, up to 7.52")
    text = text_of(modes)
    assert f"{modes.frequencies[1]:.6g}" in text
    assert "and 18 more" in text
    assert "1 rigid-body" in text


def run(**recorded: Any) -> TransientRecord:
    """A run of 100 samples at two DoFs and a mesh."""
    time = np.arange(100) / 1000.0
    motion = np.column_stack([np.sin(time), np.cos(time)])
    given: dict[str, Any] = {"displacement": motion, "mesh_forces": motion[:, :1]} | recorded
    return TransientRecord(
        1000.0, 0.5, (WORST_LABEL, "b.w"), ("b.w",), motion[:, 1:], Integrator("RK44", 1e-3, ""),
        meshes=("mesh a – b",), warnings=("<b>mind</b>",), **given,
    )  # fmt: skip


def test_a_run() -> None:
    made = run()
    assert line_of(made) == "<TransientRecord: 100 samples at 1000 Hz, 0.1 s, 2 DoFs>"
    text = text_of(made, WORST_LABEL)
    assert "displacement, mesh_forces" in text
    assert "RK44, h = 0.001 s" in text
    assert "<b>mind</b>" in text


def test_a_run_drawn() -> None:
    made = run()
    axes = made.plot()
    assert [panel.get_ylabel() for panel in axes] == [
        "force, N", "displacement, m", "mesh force, N",
    ]  # fmt: skip
    assert made.displacement is not None
    np.testing.assert_array_equal(axes[1].lines[1].get_ydata(), made.displacement[:, 1])
    np.testing.assert_array_equal(axes[1].lines[1].get_xdata(), made.time)
    figure = axes[0].figure
    assert isinstance(figure, Figure)
    figure.savefig(io.BytesIO())  # what a label holds is no formula
    assert made.span(50).plot(axes) == axes
    with pytest.raises(ModelError, match=r"3 axes are needed \(force, N, .*\); got 2"):
        made.plot(axes[:2])


def test_a_run_with_nothing_to_draw() -> None:
    bare = replace(
        run(displacement=None, mesh_forces=None), excitations=(), forces=np.zeros((9, 0))
    )
    with pytest.raises(ModelError, match="no force, motion or mesh force"):
        bare.plot()
