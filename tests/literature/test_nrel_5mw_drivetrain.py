"""NREL/TP-500-38060 and Nejad et al. 2016: the 5-MW turbine with the 5-MW reference gearbox."""

import numpy as np
import pytest

from fbs import real_modes
from mbs_models.modal.mode_kinds import Kind
from mbs_models.modal.modes import drivetrain_modes
from mbs_models.model.model_file import load
from validation.routes import multibody

DRIVETRAIN = load("wind-turbine")


def test_gear_ratios_follow_from_the_meshes() -> None:
    """Nejad et al. 2016, Table V: 3.947, 6.167, 3.958 – from the rigid-body mode, not typed in."""
    system = multibody.drivetrain_system(DRIVETRAIN)
    modes = real_modes(system)
    assert modes.n_rigid == 1
    speed = {
        body: modes.shapes[system.dofs.index(f"{body}.w"), 0] / DRIVETRAIN.radius(body)
        for body in DRIVETRAIN.bodies
    }
    assert speed["low_speed.sun"] / speed["low_speed.carrier"] == pytest.approx(3.947, abs=5e-4)
    ratio = speed["intermediate.sun"] / speed["intermediate.carrier"]
    assert ratio == pytest.approx(6.167, abs=5e-4)
    assert speed["high_speed.pinion"] / speed["high_speed.wheel"] == pytest.approx(3.958, abs=5e-4)
    assert abs(speed["generator"] / speed["rotor"]) == pytest.approx(96.354, rel=1e-3)


def test_stiffness_from_rotor_to_held_generator() -> None:
    """Table 5-1: 867 637 000 N m/rad; the main shaft was chosen so, the rest is the gearbox."""
    system = multibody.drivetrain_system(DRIVETRAIN)
    free = [i for i, dof in enumerate(system.dofs) if dof != "generator.w"]
    flexibility = np.linalg.inv(system.stiffness[np.ix_(free, free)])
    rotor = [system.dofs[i] for i in free].index("rotor.w")  # radius 1 m: N/m is N m/rad
    assert 1.0 / flexibility[rotor, rotor] == pytest.approx(867.637e6, rel=1e-4)


def test_first_torsional_frequency() -> None:
    """2.18 Hz (Anaya-Lara et al. 2019); 2 % for what unprinted shafts and bearings leave open."""
    modes = drivetrain_modes(DRIVETRAIN).modes
    assert modes[1].kind == Kind.GLOBAL
    assert modes[1].frequency_hz == pytest.approx(2.18, rel=0.02)
