"""Reductions printed by JuliaFEM: Craig–Bampton's matrices and Guyan's, to the printed digit.

JuliaFEM, ModelReduction.jl, https://github.com/JuliaFEM/ModelReduction.jl: README.md,
test/test_craig_bampton.jl, test/test_guyan_reduction.jl (described in Rapo, Aho & Frondelius 2018,
Rakenteiden mekaniikka 51(1), doi:10.23998/rm.69026). The signs of modes are free, and ours may be
the other ones.
"""

from __future__ import annotations

import numpy as np
import pytest

from fbs import SecondOrderSystem, craig_bampton, guyan, real_modes

# 2 kg masses in a row, the last of 1 kg; springs of 1 N/m, the first to the ground
STIFFNESS = np.array([[2, -1, 0, 0], [-1, 2, -1, 0], [0, -1, 2, -1], [0, 0, -1, 1]], dtype=float)
MASS = np.diag([2.0, 2.0, 2.0, 1.0])
CHAIN = SecondOrderSystem(MASS, 0 * MASS, STIFFNESS, ("1", "2", "3", "4"))

PRINTED_MASS = np.array(
    [
        [2.75, -1.207107, 0.5, 0.207107],
        [-1.207107, 1.0, 0.0, 0.0],
        [0.5, 0.0, 1.0, 0.0],
        [0.207107, 0.0, 0.0, 1.0],
    ]
)
PRINTED_STIFFNESS = np.diag([0.25, 0.292893, 1.0, 1.707107])
HALF_DIGIT = 0.5e-6


@pytest.mark.parametrize("count", [1, 2, 3])
def test_craig_bamptons_matrices(count: int) -> None:
    """All three modes with the last mass held, and fewer of them: the same entries."""
    reduced = craig_bampton(CHAIN, ["4"], count).system
    signs = np.sign(reduced.mass[0]) * np.sign(PRINTED_MASS[0, : count + 1])
    own = slice(count + 1)
    mass = reduced.mass * np.outer(signs, signs)
    assert np.abs(mass - PRINTED_MASS[own, own]).max() <= HALF_DIGIT
    assert np.abs(reduced.stiffness - PRINTED_STIFFNESS[own, own]).max() <= HALF_DIGIT


def test_with_three_modes_the_frequencies_are_the_chains() -> None:
    """2 kg masses and half a one at the end of a held rod: ω² = 1 − cos((2 n − 1) π/8)."""
    exact = 1.0 - np.cos((2 * np.arange(1, 5) - 1) * np.pi / 8)
    for system in (CHAIN, craig_bampton(CHAIN, ["4"], 3).system):
        squares = real_modes(system).angular_frequency ** 2
        assert np.abs(squares / exact - 1.0).max() < 1e-13


def test_guyans_stiffness() -> None:
    """Four springs of 1 N/m in a row are one of 0.25 N/m."""
    springs = 2 * np.eye(5) - np.eye(5, k=1) - np.eye(5, k=-1)
    springs[0, 0] = springs[4, 4] = 1.0
    free = SecondOrderSystem(np.eye(5), np.zeros((5, 5)), springs, ("1", "2", "3", "4", "5"))
    found = guyan(free, ["1", "5"]).system.stiffness
    assert np.abs(found - [[0.25, -0.25], [-0.25, 0.25]]).max() < 1e-14
