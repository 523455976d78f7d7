"""Drivetrains coupled stage by stage, and through sparse and reduced systems."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fbs import (
    SparseSystem,
    couple_chain,
    direct_frf,
    frequency_axis,
    modal_frf,
    reduced_frf,
    sparse_frf,
)
from mbs_models.model.model_file import load
from mbs_models.model.parameters import PlanetaryStage
from tests.planetary_chain import planetary_chain
from tests.strategies import DAMPED, damped
from validation.checks.metrics import scaled_error
from validation.routes.source import equations_source

AXIS = frequency_axis(50, 5000, 10)


@pytest.fixture(scope="module")
def chain() -> Any:
    (stage,) = load("lin-parker-4").stages_of(PlanetaryStage)
    return equations_source(planetary_chain(stage, 4, damping=DAMPED))


def test_no_two_stages_are_alike(chain: Any) -> None:
    matrices = [stage.stiffness for stage in chain.stages.values()]
    middle = matrices[1:-1]  # those at the ends carry one hub only
    assert len(middle) == 2
    assert not np.allclose(middle[0], middle[1])


def test_a_planetary_chain_stage_by_stage(chain: Any) -> None:
    asked = ["stage1.sun.w", "stage2.planet1.u", "shaft2.w", "stage4.carrier.w"]
    found = couple_chain(chain.stages, chain.joints, AXIS, asked, asked)
    exact = direct_frf(chain.whole, AXIS, asked, asked)
    error = scaled_error(exact.values, found.frf.values).max(axis=(1, 2))
    # eps times the stages' condition, below 1e5 from 50 Hz on, times the kernel's
    assert (error <= 1e-11 * found.kernel_condition).all()


@pytest.mark.parametrize("preset", ["paper", "geared-torsional", "wind-turbine"])
def test_presets_by_every_route_for_large_systems(preset: str) -> None:
    model = equations_source(damped(load(preset)))
    exact = direct_frf(model.whole, AXIS)
    sparse = SparseSystem.of(model.whole)
    # the hub of the paper's preset, 4e-8 kg on 1e8 N/m, leaves the direct solution 1e-9
    assert scaled_error(exact.values, sparse_frf(sparse, AXIS).values).max() < 1e-9
    asked = (model.whole.dofs[0], model.whole.dofs[-1])
    reduced = reduced_frf(sparse, AXIS, asked, asked)
    some = exact.select(asked, asked).values
    assert scaled_error(some, reduced.frf.values).max() < 2e-8  # its tolerance, and round-off
    chain = couple_chain(model.stages, model.joints, AXIS, exact.responses, exact.excitations)
    whole = modal_frf(model.whole, AXIS)
    error = scaled_error(whole.values, chain.frf.values).max(axis=(1, 2))
    assert (error <= 1e-10 * chain.kernel_condition).all()  # eps times the stages' condition
