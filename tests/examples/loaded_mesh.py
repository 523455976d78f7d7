"""Static transmission: what an input torque does to every mesh, and the angle it winds up."""

from mbs_models import load, operating_point

drivetrain = load("paper-table2")
point = operating_point(drivetrain, speed_rpm=0.0, torque=500.0)  # N m at the input, at standstill
for mesh, force in point.mesh_forces.items():
    print(f"{mesh}: {force:8.1f} N")
winding = dict(zip(point.dofs, point.displacement, strict=True))
