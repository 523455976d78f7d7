"""A known part B taken off an assembly leaves A: Y_A = Y − Y_·c (Y_cc − Y^B_cc)⁻¹ Y_c·."""

import numpy as np

from fbs import Joint, SecondOrderSystem, couple, direct_frf, frequency_axis
from fbs.decoupling import decouple

lines = frequency_axis(1.0, 80.0, 0.5)
ones, damping = np.eye(2), 0.5 * np.eye(2)  # kg, N s/m
springs_a = np.array([[1e4 + 2e4, -2e4], [-2e4, 2e4]])  # N/m: ground – a – c
springs_b = np.array([[3e4, -3e4], [-3e4, 3e4 + 4e4]])  # N/m: c – b – ground
part = direct_frf(SecondOrderSystem(ones, damping, springs_a, ("a", "c")), lines)
known = direct_frf(SecondOrderSystem(ones, damping, springs_b, ("c", "b")), lines)

assembly = couple({"A": part, "B": known}, [Joint(("A", "c"), ("B", "c"))]).frf
found = decouple(assembly, known, ["c"])
error = np.abs(found.frf.values - part.values).max() / np.abs(part.values).max()
spread = found.spread(0.01)  # of every FRF, at 1 % noise of all data
