"""The page's FRFs and modes, computed in a real browser, against Python's."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings

from fbs import Frf, SecondOrderSystem, direct_frf, modal_frf, real_modes
from mbs_models import load
from mbs_models.model.parameters import Damping, Drivetrain
from tests.browser import Browser, browser, needs_chromium
from tests.strategies import damped, drivetrains, with_coupling, with_stage
from validation.checks.frfs import round_off_floor
from validation.explorer.assembly import JoinedParts, stages, whole
from validation.explorer.page import script
from validation.routes.source import Source, equations_source, exudyn_source

pytestmark = [needs_chromium, pytest.mark.browser, pytest.mark.slow]

# Of the scaled error. A curve's error is round-off; where a free drivetrain's rigid-body motion is
# the whole of it (1 Hz of the paper's), the last digit of K makes 7e-10 of either side.
TOLERANCE = 1e-9
AS_MODELLED: dict[str, Any] = {"stiffness": {}, "scales": {}}
COMPUTE = r"""
async (route, setting, lines, labels) => {
  const assembly = assemble(route, setting), size = 2 * lines.length;
  const values = new Float64Array(labels.length ** 2 * size);
  let at = 0;
  for (const i of labels) for (const j of labels) {
    const { re, im } = receptance(assembly, assembly.dof(i), assembly.dof(j), lines);
    values.set(re, at);
    values.set(im, at + lines.length);
    at += size;
  }
  const natural = naturalModes(assembly, route.parts.length, 0).map((mode) => mode.frequency);
  const text = await new Promise((done) => {
    const reader = new FileReader();
    reader.onload = () => done(reader.result);
    reader.readAsDataURL(new Blob([values]));
  });
  return { values: text.split(",")[1], natural };
}
"""


@pytest.fixture(scope="module")
def tab() -> Iterator[Browser]:
    with browser() as opened:
        opened.run(
            script(("algebra.js", "synthesis.js", "modes.js")) + f"; var compute = {COMPUTE}"
        )
        yield opened


def curves(
    tab: Browser,
    route: JoinedParts,
    damping: Damping,
    lines: np.ndarray,
    labels: Sequence[str],
    setting: Mapping[str, Any] = AS_MODELLED,
) -> tuple[np.ndarray, np.ndarray]:
    """(n_line, n, n) receptances, and natural frequencies (Hz), as the page computes them."""
    own = {"alpha": damping.mass_proportional, "beta": damping.stiffness_proportional}
    arguments = [route.document(), own | dict(setting), lines.tolist(), list(labels)]
    found = tab.run(f"compute({', '.join(map(json.dumps, arguments))})")
    raw = np.frombuffer(base64.b64decode(found["values"]))
    parts = raw.reshape(len(labels), len(labels), 2, lines.size)
    values = (parts[:, :, 0] + 1j * parts[:, :, 1]).transpose(2, 0, 1)
    return values, np.array(found["natural"])


def scaled_errors(values: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """(n_line,) largest of every line."""
    size = np.linalg.norm(reference, axis=2)
    scale = np.sqrt(size[:, :, None] * size[:, None, :])
    return np.asarray(np.max(np.abs(values - reference) / scale, axis=(1, 2)))


def scaled_error(values: np.ndarray, reference: np.ndarray) -> float:
    return float(scaled_errors(values, reference).max())


def check(
    tab: Browser,
    source: Source,
    lines: np.ndarray,
    *,
    reference: Callable[..., Frf] = direct_frf,
    floor: np.ndarray | float = 0.0,
) -> None:
    """All FRFs between all labels, by FBS and at once, and the natural frequencies."""
    system, damping = source.whole, source.drivetrain.damping
    solved = reference(system, lines).values
    expected = real_modes(system)
    for route in (stages(source), whole(source)):
        values, natural = curves(tab, route, damping, lines, system.labels)
        errors = scaled_errors(values, solved)
        assert (errors < np.maximum(TOLERANCE, floor)).all(), (route.name, errors.max())
        assert natural.size == expected.natural_frequencies.size
        # Of the whole's Jacobi rotations eps × the largest ω² remains in every ω².
        rest = 100 * np.finfo(float).eps * expected.angular_frequency[-1] ** 2
        square = (2 * np.pi * natural) ** 2
        assert np.abs(square - expected.angular_frequency**2).max() < rest


@pytest.mark.parametrize("make", [exudyn_source, equations_source])
@pytest.mark.parametrize(
    "damping", [Damping(), Damping(stiffness_proportional=1e-6, mass_proportional=1.0)]
)
def test_all_900_frfs_of_the_paper(tab: Browser, make: Any, damping: Damping) -> None:
    lines = np.unique([*np.geomspace(1, 15000, 400), *np.arange(1.0, 21.0)])
    source = make(damped(load("paper"), damping))
    assert len(source.whole.labels) == 30
    check(tab, source, lines)


def test_twenty_random_drivetrains(tab: Browser) -> None:
    """Trees of stages and inertias with hubs, massless ones, rigid ends and coupled translations.

    Held against modal synthesis of the whole: the direct solution's round-off at 1 Hz of a
    free drivetrain is up to 2e-8 here.
    """
    drawn: list[Drivetrain] = []

    @settings(max_examples=20)
    @given(drivetrains())
    def draw(drivetrain: Drivetrain) -> None:
        drawn.append(drivetrain)

    draw()
    assert len(drawn) == 20
    for drivetrain in drawn:
        check(tab, equations_source(drivetrain), np.geomspace(1, 15000, 60), reference=modal_frf)


@pytest.mark.parametrize("preset", ["geared-torsional", "wind-turbine", "lin-parker-3"])
def test_presets(tab: Browser, preset: str) -> None:
    """Within what a last digit of K explains, as the routes of `crosscheck run` are."""
    source, lines = exudyn_source(damped(load(preset))), np.geomspace(5, 8000, 40)
    check(tab, source, lines, floor=round_off_floor(source.whole, lines))


def test_bearings_with_dampers_of_their_own(tab: Browser) -> None:
    """They do not follow β; with and without β on everything else."""
    for beta in (0.0, 1e-6):
        drivetrain = damped(load("paper"), Damping(stiffness_proportional=beta))
        stage = drivetrain.stage("reducer")
        gear = stage.model_dump(exclude_unset=True)["pinion"]
        drivetrain = with_stage(
            drivetrain, "reducer", pinion=gear | {"bearing_damping": [[300.0, 50.0], [50.0, 80.0]]}
        )
        check(tab, exudyn_source(drivetrain), np.geomspace(20, 15000, 60))


def test_what_is_dragged_is_what_a_changed_model_gives(tab: Browser) -> None:
    """Coupling stiffness, damping, and a part as a whole stiffer and heavier."""
    lines = np.geomspace(5, 15000, 80)
    route = stages(equations_source(damped(load("paper"))))
    damping = Damping(stiffness_proportional=3e-6, mass_proportional=7.0)
    model = with_coupling(damped(load("paper"), damping), second_stiffness=4.2e6)
    system = equations_source(model).whole
    setting = AS_MODELLED | {"stiffness": {"coupling.second_stiffness": 4.2e6}}
    values, _ = curves(tab, route, damping, lines, system.labels, setting)
    assert scaled_error(values, direct_frf(system, lines).values) < TOLERANCE

    heavier = {"mass": 2.5, "stiffness": 0.6}
    own = [label.startswith("planetary.") for label in system.dofs]
    bare = equations_source(model).build_stage(changed_couplings(model), "planetary")
    at = np.ix_(*2 * ([k for k, is_own in enumerate(own) if is_own],))
    stiffness, mass = np.array(system.stiffness), np.array(system.mass)
    order = [bare.dofs.index(system.dofs[k]) for k, is_own in enumerate(own) if is_own]
    stiffness[at] += (heavier["stiffness"] - 1) * bare.stiffness[np.ix_(order, order)]
    mass[at] += (heavier["mass"] - 1) * bare.mass[np.ix_(order, order)]
    replaced = SecondOrderSystem(
        mass, 3e-6 * stiffness + 7.0 * mass, stiffness, system.dofs, system.derived
    )
    setting = setting | {"scales": {"planetary": heavier}}
    values, _ = curves(tab, route, damping, lines, system.labels, setting)
    assert scaled_error(values, direct_frf(replaced, lines).values) < TOLERANCE


def changed_couplings(drivetrain: Drivetrain) -> Drivetrain:
    """Without any."""
    return drivetrain.model_copy(update={"couplings": ()})


def test_a_line_on_an_undamped_pole_of_a_part_is_none_of_the_whole(tab: Browser) -> None:
    """There receptances of the part are infinite, and those of the whole are not."""
    source = equations_source(load("paper"))
    route = stages(source)
    part = route.parts[1]
    moved = np.abs(part.shapes[part.dofs.index("planetary.sun.w")]) > 1e-3
    lines = np.array([f for f in part.omega[moved] / (2 * np.pi) if 1 < f < 15000])
    assert lines.size >= 3
    values, _ = curves(tab, route, Damping(), lines, source.whole.labels)
    assert scaled_error(values, modal_frf(source.whole, lines).values) < TOLERANCE


def test_on_a_pole_of_the_whole_there_is_no_number(tab: Browser) -> None:
    """A planet mode, which no joint moves; undamped."""
    source = equations_source(load("lin-parker-4"))
    route = stages(source)
    pole = route.parts[0].omega[-1] / (2 * np.pi)
    values, _ = curves(tab, route, Damping(), np.array([pole]), source.whole.labels)
    assert not np.isfinite(values).all() or np.abs(values).max() > 1e3
