"""The bound of truncated drivetrains against their exact FRFs, and the smallest basis it finds.

    python -m tests.benchmarks.truncation_bound [DRIVETRAINS [FIRST_SEED [DOFS]]]

Random drivetrains of 1 to 5 stages, 2 to 7 planets, every kind of damping, hubs from nearly
massless to heavy, cut anywhere, on 200 lines of which a third lie beside natural frequencies, with
all FRFs between 12 DoFs (DOFS: so many). Exact FRFs: the whole drivetrain assembled and solved line
by line, the residual in 80-bit arithmetic. Then 50 small drivetrains whose smallest basis is held
against the fewest modes that would do, found by trying all. What bounds cost: `bound_speed`.
"""

from __future__ import annotations

import itertools
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fbs import (
    Reason,
    TruncatedPart,
    bounded_frf,
    real_modes,
    smallest_basis,
)
from tests.random_drivetrains import DAMPINGS, Trial, Whole, random_parts

LINES, DOFS = 200, 12
LEVELS = (0.5, 0.95, 0.99)
SAID = 500  # drivetrains after which the figures are printed
SMALL, TOLERANCE = 50, 0.1


@dataclass
class Tally:
    """Violations, lines by reason, and how many bounds are so many times the error.

    Ratios are counted in classes that are 0.5 % wide: all of them would take gigabytes.
    """

    edges: np.ndarray = field(default_factory=lambda: np.geomspace(0.1, 1e15, 7370))
    counts: dict[str, np.ndarray] = field(default_factory=dict)
    reasons: np.ndarray = field(default_factory=lambda: np.zeros(len(Reason), int))
    violations: int = 0
    values: int = 0

    def add(self, trial: Trial) -> int:
        """Hold a drivetrain's bounds against its errors; return the violations."""
        found = trial.bounded()
        error = np.abs(found.frf.values - trial.exact).astype(float)
        beyond = int((error > found.bound).sum())
        round_off = np.empty_like(error)
        for (i, one), (j, other) in itertools.product(enumerate(trial.labels), repeat=2):
            round_off[:, i, j] = found.round_off(one, other)
        told = (found.reason == 0)[:, None, None] & (error > round_off)
        ratio = (found.bound[told] / error[told]).clip(max=self.edges[-1])
        own = self.counts.setdefault(trial.parts.damping, np.zeros(self.edges.size - 1, int))
        own += np.histogram(ratio, self.edges)[0]
        self.violations += beyond
        self.values += error.size
        self.reasons += np.bincount(found.reason, minlength=len(Reason))
        return beyond

    def lines(self) -> Iterator[str]:
        """Say what was found."""
        yield "lines: " + ", ".join(
            f"{r.name} {n}" for r, n in zip(Reason, self.reasons, strict=True)
        )
        every = {kind: self.counts[kind] for kind in DAMPINGS if kind in self.counts}
        for kind, counts in {**every, "all": np.sum([*every.values()], axis=0)}.items():
            share = np.cumsum(counts) / max(1, counts.sum())
            middle, high, most = (self.edges[1 + np.searchsorted(share, q)] for q in LEVELS)
            yield (
                f"{kind:10} bound / error where above round-off ({counts.sum()}): median "
                f"{middle:.3f}, 95 % below {high:.3g}, 99 % below {most:.3g}"
            )


def bounds(count: int, first: int, dofs: int = DOFS) -> None:
    """Print violations, and how far bounds are from the errors."""
    tally, start = Tally(), time.process_time()
    for done, seed in enumerate(range(first, first + count), start=1):
        trial = Trial.of(np.random.default_rng(seed), LINES, dofs)
        beyond = tally.add(trial)
        if beyond:
            print(f"seed {seed}: {beyond} violations, {trial.parts.damping}", flush=True)
        if done % SAID == 0 or done == count:
            print(
                f"{done} drivetrains from seed {first}, {tally.values} values, "
                f"{time.process_time() - start:.0f} s: {tally.violations} violations\n"
                + "\n".join(tally.lines()),
                flush=True,
            )


def basis_trial(seed: int) -> tuple[int, int, float]:
    """Return modes of the smallest basis, those of the optimum, and the true error (dB)."""
    rng = np.random.default_rng(seed)
    parts = random_parts(rng, stages=2, damping=str(rng.choice(["hysteretic", "rayleigh", "both"])))
    nodes = [(n, next(d for d in s.dofs if d.endswith(".w"))) for n, s in parts.systems.items()]
    labels = [dof for _, dof in nodes]
    pairs = [(labels[0], labels[0]), (labels[1], labels[1]), (labels[1], labels[0])]
    modes = {name: real_modes(system) for name, system in parts.systems.items()}
    band = float(np.median([m.natural_frequencies[m.n_rigid + 2] for m in modes.values()]))
    axis = np.linspace(band / 100, band, 100)
    found = smallest_basis(parts.systems, parts.joints, pairs, axis, TOLERANCE)
    exact = Whole.of(parts).frf(2 * np.pi * axis, nodes)

    def error(truncated: dict[str, Any]) -> float:
        values = bounded_frf(truncated, parts.joints, axis, labels, labels).frf.values
        with np.errstate(divide="ignore"):
            decibels = np.abs(20 * np.log10(np.abs(values / exact).astype(float)))
        at = [(labels.index(i), labels.index(j)) for i, j in pairs]
        return float(max(decibels[:, i, j].max() for i, j in at))

    own = {name: _audible(parts, name, labels) for name in modes}
    sizes = {name: range(modes[name].n_rigid, len(own[name]) + 1) for name in modes}
    for total in range(sum(s.start for s in sizes.values()), 10**3):
        for counts in itertools.product(*sizes.values()):
            if sum(counts) != total:
                continue
            truncated = {
                name: TruncatedPart.of(parts.systems[name], own[name][:n], 2, modes[name])
                for (name, n) in zip(sizes, counts, strict=True)
            }
            if error(truncated) <= TOLERANCE:
                kept = sum(len(k) for k in found.kept.values())
                return kept, total, error(dict(found.parts))
    raise AssertionError("even all modes miss the tolerance")


def _audible(parts: Any, name: str, labels: list[str]) -> list[int]:
    """Modes that move what is joined or asked for, and the rigid-body ones."""
    system = parts.systems[name]
    modes = real_modes(system)
    ends = (end for joint in parts.joints for end in (joint.first, joint.second))
    ports = [label for owner, label in ends if owner == name]
    ports += [label for label in labels if label in system.labels]
    size = np.abs(modes.shapes[system.locate(dict.fromkeys(ports))[0]]).max(axis=0)
    heard = size > 1e-12 * np.abs(modes.shapes).max(axis=0)
    heard[: modes.n_rigid] = True
    return [int(k) for k in np.flatnonzero(heard)]


def bases() -> None:
    """Print how the smallest basis compares with the optimum."""
    found = [basis_trial(seed) for seed in range(SMALL)]
    ratios = np.array([kept / best for kept, best, _ in found])
    worst = max(error for *_, error in found)
    print(
        f"smallest basis, {SMALL} drivetrains: modes / optimum at most {ratios.max():.2f}, mean "
        f"{ratios.mean():.2f}; largest true error {worst:.4f} dB of {TOLERANCE} dB"
    )


if __name__ == "__main__":
    given = [int(value) for value in sys.argv[1:]]
    bases()
    bounds(*(given + [200, 0, DOFS][len(given) :]))
