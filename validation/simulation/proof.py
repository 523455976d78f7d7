"""What a run under torque must show by itself: statics, energy, and nothing that grows.

In a steady state every body's mean acceleration is zero, so that the mean mesh forces are those of
statics whatever varies, and a planet's two meshes carry the same on their one base radius. The
drivetrain as a whole turns on with the mean rotation and no faster, energy changes by the work
done, and what vibrates stays as large as it is.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.linalg import eigh
from scipy.signal.windows import blackmanharris

from mbs_models.gears.operating_point import OperatingPoint
from mbs_models.integration.integrators import TRAPEZOIDAL
from mbs_models.integration.transient_record import TransientRecord
from mbs_models.model.parameters import Drivetrain
from mbs_models.system.drivetrain import build_drivetrain
from mbs_models.system.linearization import round_off_force

from ..arrays import FloatArray
from ..checks.check import Check
from ..routes.equations import drivetrain_system, rigid_body_motions
from ..routes.floquet import mesh_vectors

ROUTES = ("statics of the equations", "exudyn in time")
# Relative, where nothing varies: 1e-9 by Newton's method and round-off, with room for a long run.
STEADY = 1e-6
# Largest sidelobe of the four-term Blackman-Harris window is −92 dB (Harris 1978, Proc. IEEE 66):
# what 3e-5 of each line leaves in the mean; a mesh force has four lines as large as its swing.
LEAKAGE = 1e-4
SEGMENTS = 8
MAY_RISE = 0.05  # over the whole run: a twentieth, below which beats are not told from growth
STANDARD_ERRORS = 4.0  # of the slope: one run in 300 with eight segments
VIBRATES = 1e-6  # of the mean mesh force: below is round-off, and whether it grows says nothing
GROWTH = "growth of the mesh forces"
GEOMETRY = 1e-3  # of a static force: a millimetre of displacement on a metre of radius
VAGUE = 0.1  # a tolerance, relative, that lets almost anything pass
WORK_EXACT = 1e-6  # of the energy exchanged; the trapezoidal rule's own sum leaves 1e-9


@dataclass(frozen=True)
class _Means:
    """Windowed means of the mesh forces, and how far each swings about its own (N)."""

    mean: dict[str, float]
    swing: float
    nothing: float

    @property
    def scale(self) -> float:
        """The largest mean force; round-off, which is ``nothing``, is none to refer to."""
        return max(max(map(abs, self.mean.values())), self.nothing / STEADY)


def run_checks(
    drivetrain: Drivetrain,
    point: OperatingPoint,
    record: TransientRecord,
    run_in: float,
    highest: float,
    *,
    only_energy: bool = False,
) -> tuple[tuple[Check, ...], tuple[str, ...]]:
    """Verdicts of physics on a run under torque or at speed, and what could not be judged.

    Parameters
    ----------
    drivetrain, point
        What was run, and where.
    record
        With mesh forces, energy and work, and the displacement of all DoFs (else the free rotation
        is not judged).
    run_in
        What is left out at the start (s).
    highest
        Highest frequency that counts (Hz).
    only_energy
        Whether no more can be judged than energy against work: forces from outside act, or the run
        is too short.
    """
    nothing = round_off_force(build_drivetrain(drivetrain))
    energy = _energy(record, run_in, highest, nothing)
    if only_energy:
        return (energy,), ()
    first = round(run_in * record.sampling_frequency)
    measured = record.span(first)
    means = _means(measured, nothing)
    unsteady = STEADY + (LEAKAGE + _stage_error(point, record)) * means.swing / means.scale
    checks = [_statics(drivetrain, point, means)]
    checks.append(_against_statics(drivetrain, point, means, unsteady))
    checks += _sun_against_ring(drivetrain, means, unsteady)
    checks += [_growth(measured, means), energy]
    if set(point.dofs) <= set(record.labels):
        checks.append(_free_rotation(drivetrain, point, measured))
    vague = [check.name for check in checks if check.name != GROWTH and check.tolerance > VAGUE]
    warnings = (
        f"cannot be told: {', '.join(vague)}; what swings is so much larger than what is held "
        "against it that any value would pass",
    )
    comparable = tuple(check for check in checks if check.name not in vague)
    return comparable, warnings if vague else ()


def _means(record: TransientRecord, nothing: float) -> _Means:
    assert record.mesh_forces is not None
    window = blackmanharris(record.n_samples, sym=False)
    forces = np.asarray(record.mesh_forces)
    mean = window @ forces / window.sum()
    return _Means(
        dict(zip(record.meshes, mean.tolist(), strict=True)),
        float(np.ptp(forces, axis=0).max() / 2.0),
        nothing,
    )


def _stage_error(point: OperatingPoint, record: TransientRecord) -> float:
    """How far the forces at an explicit step's ends are from those it went by, of what swings.

    (ωh)⁴/120 of the highest mode that may swing, its error in a step of RK44 (`integrators`). The
    trapezoidal rule goes by the forces at its ends.
    """
    if record.integrator.name == TRAPEZOIDAL:
        return 0.0
    squares = eigh(point.linear.stiffness, point.linear.mass, eigvals_only=True)
    return float((squares[-1] * record.integrator.step**2) ** 2 / 120.0)


def _by_family(
    drivetrain: Drivetrain, forces: Mapping[str, float], others: Mapping[str, float]
) -> dict[str, tuple[float, float]]:
    """Two sets of mesh forces (N), summed over each family of meshes."""
    return {
        f"{family.stage} {family.key}": (
            sum(forces[name] for name in family.names),
            sum(others[name] for name in family.names),
        )
        for family in drivetrain.mesh_families
    }


def _statics(drivetrain: Drivetrain, point: OperatingPoint, means: _Means) -> Check:
    """What exudyn starts from against K q = f of the equations, family by family."""
    expected = static_mesh_forces(drivetrain, point)
    scale = max(*map(abs, expected.values()), means.nothing / STEADY)
    off = _by_family(drivetrain, point.mesh_forces, expected)
    worst = max(abs(one - other) for one, other in off.values()) / scale
    return Check(
        "static mesh forces",
        f"{len(off)} mesh famil{'y' if len(off) == 1 else 'ies'}",
        (ROUTES[0], "exudyn's equilibrium"),
        "largest difference, of the largest static force",
        worst,
        GEOMETRY,
        "the torque alone decides on a family's force; where paths share it, their displacements "
        "do too, by what they are of the radii",
        tuple(
            f"{name}: {one:.6g} N in exudyn, {other:.6g} N by the equations"
            for name, (one, other) in off.items()
            if abs(one - other) > GEOMETRY * scale
        ),
    )


def _against_statics(
    drivetrain: Drivetrain, point: OperatingPoint, means: _Means, tolerance: float
) -> Check:
    """The mean force of each mesh family against K q = f of the equations.

    Of a family, not of each mesh: how planets share depends on play and on deflections, their sum
    on the torque alone.
    """
    expected = static_mesh_forces(drivetrain, point)
    scale = max(*map(abs, expected.values()), means.scale)
    off = _by_family(drivetrain, means.mean, expected)
    worst = max(abs(mean - static) for mean, static in off.values()) / scale
    return Check(
        "mean mesh forces",
        f"{len(off)} mesh famil{'y' if len(off) == 1 else 'ies'}",
        ROUTES,
        "largest difference, of the static force",
        worst,
        tolerance,
        "in a steady state nothing accelerates in the mean; a window keeps 1e-4 of what swings out "
        "of it, an explicit integrator is off by (ωh)⁴/120 of it, and 1e-6 is left to round-off",
        tuple(
            f"{name}: mean {mean:.6g} N, statics {static:.6g} N"
            for name, (mean, static) in off.items()
            if abs(mean - static) > tolerance * scale
        ),
    )


def static_mesh_forces(drivetrain: Drivetrain, point: OperatingPoint) -> dict[str, float]:
    """Force of every mesh (N) by the equations' matrices, positive where loaded flanks press."""
    system = drivetrain_system(drivetrain)
    load = np.zeros(len(system.dofs))
    for each in point.loads:
        leader, factor = system.derived.get(each.dof, (each.dof, 1.0))
        load[system.dofs.index(leader)] += factor * each.signal.force
    scale = np.sqrt(np.diag(system.stiffness))
    scale[scale == 0.0] = 1.0
    scaled = system.stiffness / np.outer(scale, scale)
    rank = len(load) - rigid_body_motions(drivetrain)
    values, vectors = np.linalg.eigh(scaled)
    held = np.argsort(values)[len(values) - rank :]
    motion = (vectors[:, held] / values[held]) @ (vectors[:, held].T @ (load / scale)) / scale
    return {
        name: float(stiffness * (row @ motion)) * point.laws[name].flank
        for name, (stiffness, row) in mesh_vectors(drivetrain, system).items()
    }


def _sun_against_ring(drivetrain: Drivetrain, means: _Means, tolerance: float) -> list[Check]:
    """Both meshes of a planet carry the same on its base radius, in the mean."""
    pairs = []
    for stage in drivetrain.stages:
        for _, sun, ring in stage.planet_meshes():
            pairs += list(zip(sun.names, ring.names, strict=True))
    if not pairs:
        return []
    apart = {sun: abs(means.mean[sun] - means.mean[ring]) / means.scale for sun, ring in pairs}
    return [
        Check(
            "sun and ring force of each planet",
            f"{len(pairs)} planets",
            ("torque balance of a planet", ROUTES[1]),
            "largest difference, of the largest mean force",
            max(apart.values()),
            tolerance,
            "a planet's two meshes act on one base radius; tolerance as for the means",
            tuple(
                f"{sun}: {means.mean[sun]:.6g} N, its ring mesh {means.mean[ring]:.6g} N"
                for sun, ring in pairs
                if apart[sun] > tolerance
            ),
        )
    ]


def _growth(record: TransientRecord, means: _Means) -> Check:
    """Slope of ln rms of the mesh forces about their means, over eight parts of the run."""
    assert record.mesh_forces is not None
    ends = np.linspace(0, record.n_samples, SEGMENTS + 1).astype(int)
    mean = np.array([means.mean[name] for name in record.meshes])
    rms = np.array(
        [
            np.sqrt(np.mean((np.asarray(record.mesh_forces[a:b]) - mean) ** 2, axis=0))
            for a, b in pairwise(ends)
        ]
    )
    lasted = record.n_samples / record.sampling_frequency
    time = (ends[:-1] + ends[1:]) / 2.0 / record.sampling_frequency
    telling = rms.max(axis=0) > VIBRATES * means.scale
    slopes, allowed = np.zeros(len(mean)), np.full(len(mean), MAY_RISE / lasted)
    for column in np.flatnonzero(telling):
        slopes[column], error = _line(time, np.log(np.maximum(rms[:, column], 1e-300)))
        allowed[column] += STANDARD_ERRORS * error
    worst = int(np.argmax(slopes - allowed))
    return Check(
        GROWTH,
        f"{len(mean)} mesh{'es' * (len(mean) > 1)}",
        ("steady state", ROUTES[1]),
        "rate of ln rms about the mean, 1/s",
        float(slopes[worst]),
        float(allowed[worst]),
        "a steady state does not grow: a twentieth over the run, and four standard errors of the "
        "fitted slope",
        tuple(
            f"{name}: grows by a factor of e in {1.0 / slope:.3g} s"
            for name, slope, limit in zip(record.meshes, slopes, allowed, strict=True)
            if slope > limit
        ),
        "" if telling.any() else "nothing vibrates by more than 1e-6 of the mean force",
    )


def _line(time: FloatArray, values: FloatArray) -> tuple[float, float]:
    """Slope of a straight line through values, and its standard error."""
    centred = time - time.mean()
    slope = float(centred @ values / (centred @ centred))
    left = values - values.mean() - slope * centred
    error = np.sqrt(left @ left / (len(time) - 2) / (centred @ centred))
    return slope, float(error)


def _energy(record: TransientRecord, run_in: float, highest: float, nothing: float) -> Check:
    """E(t) − E(0) against W(t) after the run-in, at whose beginning what varies sets in."""
    assert record.energy is not None
    assert record.work is not None
    assert record.displacement is not None
    assert record.mesh_forces is not None
    first = round(run_in * record.sampling_frequency)
    energy, work = np.asarray(record.energy[first:]), np.asarray(record.work[first:])
    gap = energy[1:] - energy[0] - np.cumsum(work[:-1])
    # What is done to and fro; where hardly anything is, a thousandth of what is stored, and what
    # round-off of the springs' forces does on the way that anything goes.
    exchanged = float(np.abs(work).sum() + np.abs(np.diff(energy)).sum())
    stored = float(np.abs(energy).max())
    unknown = nothing * float(np.abs(np.asarray(record.displacement)).max()) / WORK_EXACT
    exchanged = max(exchanged, 1e-3 * stored, unknown, np.finfo(float).tiny)
    step = 2.0 * np.pi * highest * record.integrator.step
    exact = record.integrator.name == TRAPEZOIDAL
    tolerance = WORK_EXACT if exact else WORK_EXACT + step**2 / 12.0
    worst = float(np.abs(gap).max(initial=0.0)) / exchanged
    if float(np.ptp(np.asarray(record.mesh_forces[first:]), axis=0).max()) <= nothing:
        worst = 0.0  # nothing moves: round-off over round-off
    return Check(
        "energy against work",
        "the whole run" if not first else "the run after its run-in",
        ("work of torques, meshes and dampers", ROUTES[1]),
        "largest difference, of the energy exchanged",
        worst,
        tolerance,
        "the trapezoidal integrator keeps this balance step by step; the sum over another's steps "
        "is off by (ωh)²/12",
        (f"energy and work part by {worst:.3g} of what is exchanged",) if worst > tolerance else (),
    )


def _free_rotation(drivetrain: Drivetrain, point: OperatingPoint, record: TransientRecord) -> Check:
    """How fast the drivetrain turns beside its mean rotation, of that."""
    assert record.displacement is not None
    linear = point.linear
    _, shapes = eigh(linear.stiffness, linear.mass)
    free = shapes[:, : rigid_body_motions(drivetrain)]
    rows = [point.dofs.index(label) if label in point.dofs else -1 for label in record.labels]
    reading = np.array([(linear.mass @ free)[row] if row >= 0 else 0.0 * free[0] for row in rows])
    along = np.asarray(record.displacement) @ reading
    time = np.arange(record.n_samples) / record.sampling_frequency
    window = blackmanharris(record.n_samples, sym=False)
    drift = _window_slopes(window, time, along) @ free.T
    twist = max(float(np.abs(point.displacement).max()), np.finfo(float).tiny)
    pace = max(_mean_pace(drivetrain, point), twist)  # m/s; at standstill the twist in a second
    swing = float(np.ptp(along, axis=0).max(initial=0.0) * np.abs(free).max(initial=0.0))
    lasted = record.n_samples / record.sampling_frequency
    vibration = _vibration(drivetrain, point, record)
    tolerance = STEADY + (LEAKAGE * swing / lasted + vibration) / pace
    worst = int(np.abs(drift).argmax()) if drift.size else 0
    value = float(np.abs(drift).max(initial=0.0)) / pace
    return Check(
        "free rotation",
        f"{free.shape[1]} free motion{'' if free.shape[1] == 1 else 's'}",
        ("mean rotation", ROUTES[1]),
        "creep, of the mean rotation",
        value,
        tolerance,
        "torque and reaction balance, and a preload does no work on the free rotation: it creeps "
        "by round-off, and by what vibrating centres do to the angular momentum, which is of "
        "second order; a window keeps 1e-4 of what swings out of the slope",
        (f"{point.dofs[worst]} creeps by {drift[worst]:.3g} m/s beside the mean rotation",)
        if value > tolerance
        else (),
    )


def _mean_pace(drivetrain: Drivetrain, point: OperatingPoint) -> float:
    """Fastest mean r·ω of any body (m/s)."""
    paces = [
        abs(speed) * drivetrain.radius(body)
        for body, speed in point.speeds.items()
        if body in drivetrain.bodies
    ]
    return max(paces, default=0.0)


def _vibration(drivetrain: Drivetrain, point: OperatingPoint, record: TransientRecord) -> float:
    """|q| |q̇|/r of the largest vibration: what centres that move add to an angular momentum."""
    assert record.displacement is not None
    assert record.velocity is not None
    moved = np.abs(np.asarray(record.displacement) - record.displacement[0]).max()
    radius = min(drivetrain.radius(body) for body in drivetrain.bodies)
    return float(moved * np.abs(np.asarray(record.velocity)).max() / radius)


def _window_slopes(window: FloatArray, time: FloatArray, values: FloatArray) -> FloatArray:
    """Slope of the weighted straight line through each column."""
    centred = time - window @ time / window.sum()
    mean = window @ values / window.sum()
    weighted = window * centred
    slopes: FloatArray = weighted @ (values - mean) / (weighted @ centred)
    return slopes
