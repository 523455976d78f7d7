"""A stage known by its FRFs alone (measured, or another program's) in place of the model's."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from fbs import couple, direct_frf, frequency_axis, read_uff, write_uff
from mbs_models import load
from validation import exudyn_source

source = exudyn_source(load("paper"))
lines = frequency_axis(10.0, 3000.0, 1.0)
stages = {name: direct_frf(system, lines) for name, system in source.stages.items()}

with TemporaryDirectory() as folder:  # as if a test rig had written it
    file = Path(folder) / "planetary.uff"
    write_uff(stages["planetary"], file)
    measured = read_uff(file)

whole = direct_frf(source.whole, lines).between("planetary.sun.w", "reducer.pinion.w")
swapped = couple({**stages, "planetary": measured}, source.joints).frf
through = swapped.between("planetary.sun.w", "reducer.pinion.w")
worst_db = float(np.abs(20.0 * np.log10(np.abs(through / whole))).max())
