"""Which modes may be left out: those above the band, if their residual flexibility stays."""

import numpy as np

from fbs import direct_frf, frequency_axis, modal_frf, real_modes, truncate
from mbs_models import load
from validation import stage_system

stage = stage_system(load("lin-parker-4"), "planetary")
lines = frequency_axis(100.0, 2000.0, 1.0)
exact = direct_frf(stage, lines)

modes = real_modes(stage)
keep = modes.natural_frequencies < 4000.0
errors = {}
for residual in (None, 0, 1):  # no residual; R₀; R₀ + ω² R₁
    kept = modal_frf(stage, lines, modes=truncate(stage, keep, residual, modes))
    errors[residual] = float(np.abs(kept.values - exact.values).max() / np.abs(exact.values).max())
