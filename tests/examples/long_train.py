"""Many parts in a row: coupled one by one, at a cost that grows with their number, no faster."""

import numpy as np

from fbs import Joint, SecondOrderSystem, couple_chain, frequency_axis

N, MASS, SPRING = 50, 1.0, 1e6
lines = frequency_axis(1.0, 300.0, 1.0)
mass, stiffness = MASS * np.eye(2) / 2.0, SPRING * np.array([[1.0, -1.0], [-1.0, 1.0]])
parts = {
    f"part{n}": SecondOrderSystem(mass, 0.0 * mass, stiffness, [f"x{n}", f"x{n + 1}"])
    for n in range(N)
}
joints = [Joint((f"part{n - 1}", f"x{n}"), (f"part{n}", f"x{n}")) for n in range(1, N)]
chain = couple_chain(parts, joints, lines, ["x0"], ["x0"])

# The chain of N springs between N + 1 masses (ends half): ω_r = 2 √(k/m) sin(r π / 2N)
resonances = 2.0 * np.sqrt(SPRING / MASS) * np.sin(np.arange(1, N) * np.pi / (2 * N)) / (2 * np.pi)
