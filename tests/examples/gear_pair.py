"""Two gears in mesh: a rigid-body rotation, and ω² = k (1/m₁ + 1/m₂) of the teeth's spring."""

import numpy as np

from mbs_models import drivetrain_modes, loads

K, M_1, M_2 = 2e8, 1.2, 3.4  # N/m; inertias I/r² seen along the line of action (kg)
GEAR = (
    "mass = 1.0, base_radius = {r}, polar_inertia_over_r2 = {m}, diametral_inertia_over_r2 = 1.0, \
bearing_y = 1e15, bearing_z = 1e15, bearing_rocking_over_r2 = 1e15"
)

pair = loads(f"""
name = "pair"
[[stage]]
type = "parallel"
name = "g"
mesh_stiffness = {K}
pinion = {{ {GEAR.format(r=0.05, m=M_1)} }}
wheel = {{ {GEAR.format(r=0.15, m=M_2)} }}
""")
frequencies = drivetrain_modes(pair).frequencies
by_hand = np.sqrt(K * (1.0 / M_1 + 1.0 / M_2)) / (2.0 * np.pi)
