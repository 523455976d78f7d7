"""Two beams coupled by their FRFs at a node are the long beam: no gears needed."""

import numpy as np

from fbs import Joint, SecondOrderSystem, couple, direct_frf, frequency_axis

E_I, RHO_A = 2.1e11 * 1e-8, 7800.0 * 1e-3  # bending stiffness (N m²), mass per length (kg/m)


def beam(first: int, last: int, clamped: bool = False) -> SecondOrderSystem:
    """Euler–Bernoulli beam, nodes 0.1 m apart; DoFs ``<node>.v`` (m) and ``<node>.t`` (rad)."""
    n, h = 2 * (last - first + 1), 0.1
    mass, stiffness = np.zeros((n, n)), np.zeros((n, n))
    k = E_I / h**3 * np.array(
        [[12, 6*h, -12, 6*h], [6*h, 4*h*h, -6*h, 2*h*h],
         [-12, -6*h, 12, -6*h], [6*h, 2*h*h, -6*h, 4*h*h]]
    )  # fmt: skip
    m = RHO_A * h / 420 * np.array(
        [[156, 22*h, 54, -13*h], [22*h, 4*h*h, 13*h, -3*h*h],
         [54, 13*h, 156, -22*h], [-13*h, -3*h*h, -22*h, 4*h*h]]
    )  # fmt: skip
    for e in range(last - first):
        at = slice(2 * e, 2 * e + 4)
        mass[at, at] += m
        stiffness[at, at] += k
    labels = [f"{node}.{dof}" for node in range(first, last + 1) for dof in "vt"]
    free = slice(2, None) if clamped else slice(None)
    return SecondOrderSystem(
        mass[free, free], np.zeros((n, n))[free, free], stiffness[free, free], labels[free]
    )


lines = frequency_axis(1.0, 500.0, 0.25)
parts = {"root": direct_frf(beam(0, 6, clamped=True), lines), "tip": direct_frf(beam(6, 10), lines)}
node = [Joint(("root", label), ("tip", label)) for label in ("6.v", "6.t")]
coupled = couple(parts, node).frf.between("10.v", "10.v")
whole = direct_frf(beam(0, 10, clamped=True), lines).between("10.v", "10.v")
error = np.abs(coupled - whole).max() / np.abs(whole).max()
