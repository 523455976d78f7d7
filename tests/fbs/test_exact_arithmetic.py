"""Every FRF against 600-bit arithmetic: its error is below what `round_off` claims.

Random systems of stiffness 1e-3 ... 1e15 N/m and mass 1e-9 ... 1e3 kg, lines from mHz and 1e-13
beside poles. A line may be refused instead, or have no bound (infinite), which says as much.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
import pytest

from fbs import (
    DefectiveModesError,
    Frf,
    Joint,
    SecondOrderSystem,
    SingularLineError,
    SparseSystem,
    condense_blocked,
    condense_dynamic_stiffness,
    couple,
    couple_chain,
    direct_frf,
    modal_frf,
    real_modes,
    schur_frf,
    sparse_frf,
    truncate,
)

flint = pytest.importorskip("flint")

from tests.fbs.exact_arithmetic import (  # noqa: E402
    Assembly,
    distance,
    random_joints,
    random_lines,
    random_part,
)

ZERO = 1e-120
"""Below, an exact value is a zero whose ball does not know; it has no relative error."""

METHODS: dict[str, Callable[..., Frf]] = {
    "direct": direct_frf,
    "modal": modal_frf,
    "schur": schur_frf,
    "sparse": lambda system, lines: sparse_frf(SparseSystem.of(system), lines),
}


@dataclass
class Tally:
    """Errors and claims of all FRFs looked at, by route."""

    errors: dict[str, list[tuple[float, float, float]]] = field(
        default_factory=lambda: defaultdict(list)
    )
    refused: dict[str, int] = field(default_factory=lambda: defaultdict(int))
    wrong: list[str] = field(default_factory=list)

    def add(self, route: str, values: np.ndarray, claims: np.ndarray, exact: Any, at: str) -> None:
        for i, row in enumerate(exact):
            for j, true in enumerate(row):
                size, error = float(abs(true).mid()), distance(values[i, j], true)
                self.errors[route].append((error, float(claims[i, j]), size))
                if not error <= claims[i, j]:
                    self.wrong.append(f"{route}, {at}: {error:.3g} against {claims[i, j]:.3g}")

    def median_claim(self, route: str) -> float:
        """Claimed over true error, where there is a claim and an error to speak of."""
        error, claim, size = np.array(self.errors[route]).T
        known = np.isfinite(claim) & (size > ZERO)
        return float(np.median(claim[known] / np.maximum(error[known], 1e-17 * size[known])))


def attempt(tally: Tally, route: str, job: Callable[[], Any]) -> Any:
    try:
        return job()
    except SingularLineError:
        tally.refused[route] += 1
    except DefectiveModesError:
        pass
    return None


def try_system(seed: int, lines: int, tally: Tally) -> None:
    """All routes on one random assembly of two or three parts."""
    rng = np.random.default_rng(seed)
    systems = {f"p{k}": random_part(rng, f"p{k}_") for k in range(int(rng.integers(2, 4)))}
    joints = random_joints(rng, systems)
    poles = np.concatenate([real_modes(system).natural_frequencies for system in systems.values()])
    for line in random_lines(rng, lines, poles):
        for route, parts in synthesised(systems, line, tally, f"seed {seed}, {line!r} Hz"):
            coupled(systems, joints, parts, route, line, tally, f"seed {seed}, {line!r} Hz")
        condensed(rng, systems, line, tally, f"seed {seed}, {line!r} Hz")


def synthesised(
    systems: dict[str, SecondOrderSystem], line: float, tally: Tally, at: str
) -> Iterator[tuple[str, dict[str, Any]]]:
    for route, method in METHODS.items():
        frfs = {
            name: attempt(tally, route, partial(method, system, [line]))
            for name, system in systems.items()
        }
        for name, frf in frfs.items():
            if frf is not None:
                nodes = [(name, label) for label in frf.responses]
                exact = Assembly({name: systems[name]}).receptances(line, nodes, nodes)
                tally.add(route, frf.values[0], frf.round_off[0], exact, at)
        if route in ("direct", "modal") and all(frf is not None for frf in frfs.values()):
            yield route, frfs
    yield "chain", dict(systems)


def coupled(
    systems: dict[str, SecondOrderSystem],
    joints: list[Joint],
    parts: dict[str, Any],
    route: str,
    line: float,
    tally: Tally,
    at: str,
) -> None:
    nodes = [(name, label) for name, system in systems.items() for label in system.labels]
    labels = [label for _, label in nodes]
    name = "chain" if route == "chain" else f"coupled {route}"
    job = (
        (lambda: couple_chain(parts, joints, [line], labels, labels))
        if route == "chain"
        else (lambda: couple(parts, joints, labels, labels))
    )
    found = attempt(tally, name, job)
    if found is not None:
        exact = Assembly(systems, joints).receptances(line, nodes, nodes)
        tally.add(name, found.frf.values[0], found.round_off[0], exact, at)


def blocked_stiffness(system: SecondOrderSystem, line: float, masters: list[str]) -> Frf:
    return condense_blocked(direct_frf(system, [line], system.dofs, system.dofs), masters)


def condensed(
    rng: np.random.Generator,
    systems: dict[str, SecondOrderSystem],
    line: float,
    tally: Tally,
    at: str,
) -> None:
    for name, system in systems.items():
        if len(system.dofs) < 2:
            continue
        masters = [
            str(d) for d in rng.permutation(system.dofs)[: rng.integers(1, len(system.dofs))]
        ]
        nodes = [(name, label) for label in masters]
        locked = [(name, label) for label in system.dofs if label not in masters]
        blocked = attempt(
            tally,
            "blocked",
            partial(blocked_stiffness, system, line, masters),
        )
        if blocked is not None:
            exact = Assembly({name: system}, (), locked).receptances(line, nodes, nodes)
            tally.add("blocked", blocked.values[0], blocked.round_off[0], exact, at)
        stiffness = attempt(
            tally, "stiffness", partial(condense_dynamic_stiffness, system, [line], masters)
        )
        if stiffness is not None:
            free = Assembly({name: system}).receptances(line, nodes, nodes)
            inverse = flint.acb_mat(free).inv()
            exact = [[inverse[i, j] for j in range(len(masters))] for i in range(len(masters))]
            tally.add("stiffness", stiffness.values[0], stiffness.round_off[0], exact, at)


def assert_claims_hold(seeds: range, lines: int) -> None:
    tally = Tally()
    for seed in seeds:
        try_system(seed, lines, tally)
    assert not tally.wrong, "\n".join(tally.wrong[:20])
    for route, errors in tally.errors.items():
        # gamma = (n + 4) eps of the terms' moduli, where signs and roundings average: 10 ... 1000
        assert tally.median_claim(route) < 2000, route
        print(
            f"{route}: {len(errors)} FRFs, {tally.refused[route]} lines refused, median claim "
            f"{tally.median_claim(route):.3g} times the error"
        )


def test_claims_hold() -> None:
    assert_claims_hold(range(1000, 1006), 4)


@pytest.mark.slow
@pytest.mark.parametrize("hundred", range(4))
def test_claims_hold_on_400_random_systems(hundred: int) -> None:
    assert_claims_hold(range(100 * hundred, 100 * (hundred + 1)), 6)


HUB = SecondOrderSystem([[4.48e-8]], [[0.0]], [[0.0]], ("hub",), {"end": ("hub", 0.7)})
HOUSING = SecondOrderSystem([[3.0]], [[0.0]], [[1e9]], ("housing",))
LINES = np.array([1e-3, 1.0, 1e3])


@pytest.mark.parametrize("method", [direct_frf, modal_frf, schur_frf])
def test_a_free_hub_rigid_on_a_stiff_housing_keeps_its_digits(method: Any) -> None:
    parts = {"hub": method(HUB, LINES), "housing": method(HOUSING, LINES)}
    found = couple(parts, [Joint(("hub", "end"), ("housing", "housing"))])
    # one mass m + M / 0.7^2 in the hub's coordinate, on k / 0.7^2
    w = 2 * np.pi * LINES
    housing = 1 / (1e9 - w**2 * (3.0 + 4.48e-8 / 0.7**2))
    np.testing.assert_allclose(found.frf.between("housing", "housing"), housing, rtol=1e-14)
    np.testing.assert_allclose(found.frf.between("hub", "hub"), housing / 0.7**2, rtol=1e-14)
    relative = found.round_off / np.abs(found.frf.values)
    assert relative.max() < 1e-13


def test_frfs_as_bare_arrays_are_refused_where_no_digit_is_left_and_bounded_elsewhere() -> None:
    def bare(system: SecondOrderSystem, lines: np.ndarray) -> Frf:
        frf = direct_frf(system, lines)
        return Frf(lines, frf.values, frf.responses, frf.excitations)

    joint = Joint(("hub", "end"), ("housing", "housing"))
    lines = np.array([1e2, 1e3])
    parts = {"hub": bare(HUB, lines), "housing": bare(HOUSING, lines)}
    found = couple(parts, [joint])
    w = 2 * np.pi * lines
    exact = 1 / (1e9 - w**2 * (3.0 + 4.48e-8 / 0.7**2)) / 0.7**2
    error = np.abs(found.frf.between("hub", "hub") - exact)
    assert (error <= found.round_off[:, 0, 0]).all()
    # eps |Y| / |Y_c| = 2.2e-16 x 0.49e9 / (4.48e-8 w^2) is 6e-6 at 100 Hz; four terms of that size
    # are each taken to be known to some 15 eps, with the arithmetic
    assert (found.round_off[:, 0, 0] / exact < 6e-4 * (100 / lines) ** 2).all()
    slow = {"hub": bare(HUB, np.array([1e-2])), "housing": bare(HOUSING, np.array([1e-2]))}
    with pytest.raises(SingularLineError, match="the joints hold 'hub' so much"):
        couple(slow, [joint])


def test_a_line_next_to_a_parts_own_pole_keeps_its_digits_in_the_assembly() -> None:
    part = SecondOrderSystem([[1.0]], [[0.0]], [[(2 * np.pi * 100.0) ** 2]], ("x",))
    lines = np.array([100.0 * (1 + 1e-13)])
    parts = {"a": direct_frf(part, lines), "b": direct_frf(HOUSING, lines)}
    found = couple(parts, [Joint(("a", "x"), ("b", "housing"))])
    w = 2 * np.pi * lines
    exact = 1 / (1e9 + part.stiffness[0, 0] - w**2 * 4.0)
    np.testing.assert_allclose(found.frf.between("x", "x"), exact, rtol=1e-14)
    assert parts["a"].round_off[0, 0, 0] > 1e-4 * np.abs(parts["a"].values[0, 0, 0])


def test_round_off_goes_with_every_selection_name_quantity_and_sum() -> None:
    rng = np.random.default_rng(3)
    system = random_part(rng, "x")
    frf = direct_frf(system, [1.0, 2.0, 3.0])
    whole = frf.round_off
    assert np.array_equal(frf.band(2, 3).round_off, whole[1:])
    part = frf.select(["x0"], ["x.hub"])
    # the difference to a second solution, which rounds otherwise, is a small part of the bound
    np.testing.assert_allclose(part.round_off, whole[:, :1, -1:], rtol=0.2)
    named = frf.renamed({"x0": "first"})
    np.testing.assert_allclose(named.round_off, whole, rtol=1e-12)
    w = frf.omega[:, None, None]
    np.testing.assert_allclose(frf.to("accelerance").round_off, whole * w**2, rtol=0.5)
    assert ((frf - frf).round_off >= 2 * whole).all()
    np.testing.assert_allclose((-2 * frf).round_off, 2 * whole, rtol=0.5)


def test_modes_left_out_are_no_round_off() -> None:
    rng = np.random.default_rng(5)
    system = SecondOrderSystem(
        np.eye(3), np.zeros((3, 3)), np.diag([1e6, 1e8, 1e9]) + rng.uniform(0, 1e5), ("a", "b", "c")
    )
    modes = truncate(system, slice(0, 1), 0)
    frf = modal_frf(system, [10.0, 50.0], modes=modes)
    full = direct_frf(system, [10.0, 50.0])
    assert (frf.round_off < 1e-12 * np.abs(full.values).max()).all()
    assert np.abs(frf.values - full.values).max() > frf.round_off.max()
