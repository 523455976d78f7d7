"""A coupling's stiffness over three decades: the drop of a peak, and the mode it moves."""

import numpy as np

from mbs_models import load
from validation import Band
from validation.sweep.parameters import samples_of
from validation.sweep.plan import sweep_plan
from validation.sweep.run import sweep

drivetrain = load("paper")
samples = samples_of(drivetrain, ["coupling.second_stiffness=1e4:1e7:13log"])
pair = ("planetary.sun.w", "reducer.pinion.w")
plan = sweep_plan(drivetrain, samples, Band(10.0, 2000.0, 10.0), pair, 2, "equations")
results = sweep(plan, samples.rows)

stiffness = np.array([k for (k,) in samples.rows])  # N/m at the coupling's radius
lowest = results.frequency_hz[:, 1]  # Hz, the first elastic mode: the two stages on the coupling
