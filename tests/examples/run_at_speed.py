"""A loaded gearbox turns: its mean mesh forces are those of statics, torque / base radius."""

import numpy as np

from mbs_models import (
    build_drivetrain,
    choose_integrator,
    linearize,
    load,
    operating_point,
    simulate,
)

drivetrain = load("paper-table2")
point = operating_point(drivetrain, speed_rpm=1500.0, torque=100.0)
system = build_drivetrain(drivetrain, point.laws)
integrator = choose_integrator(linearize(system), fmax=4000.0)

record = simulate(
    system,
    point.loads,
    duration=0.05,
    integrator=integrator,
    start_state=(point.displacement, np.zeros_like(point.displacement)),
    record=("mesh_forces",),
)
assert record.mesh_forces is not None
mean = dict(zip(record.meshes, np.mean(record.mesh_forces, axis=0), strict=True))
statics = 100.0 / drivetrain.radius("reducer.pinion")  # N
