"""What stands out over the speed range: peaks and their modes, instability, teeth that part."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from mbs_models.modal.energy import ComponentShares
from mbs_models.modal.mode_kinds import Kind, Modes
from mbs_models.system.components import Components

from ..arrays import BoolArray, ComplexArray, FloatArray
from .steady import SteadyStates
from .turning import MeshFamily, Turning

# A peak stands out of the valleys beside it by so much of its family's highest, and by so much of
# the static force: less is no resonance to mind.
PROMINENCE, LEAST = 0.05, 0.01
SAME_SPEED = 0.01  # relative: peaks of several families so close, of one line, are one resonance
NEAR, MATTERS = 0.1, 0.05  # of the frequency; of the mesh's deflection
BESIDE = 0.03  # relative: outside a resonance
REPEATED = 1e-6  # relative: modes of one frequency answer together
GROWING = 1e-6  # ln|μ| over a period that is no round-off of multipliers on the unit circle


@dataclass(frozen=True)
class Peak:
    """A resonance as the meshes feel it.

    Attributes
    ----------
    speed_rpm
        Where it is highest.
    family, mesh
        The meshes, and the one of them, that feel it most.
    line
        Index of the line that makes it.
    frequency_hz, order
        That line's.
    height
        max F / static F, or without static forces the largest vibrating force (N).
    swing
        Largest force less the mean (N).
    mode
        Index of the mode that answers.
    mode_share
        Of the line's mesh deflection, by amplitude, that is this mode's; above 1 where others
        counteract.
    """

    speed_rpm: float
    family: str
    mesh: str
    line: int
    frequency_hz: float
    order: float
    height: float
    swing: float
    mode: int
    mode_share: float


@dataclass(frozen=True)
class SpeedRange:
    """SteadyStates from first to last of those computed (rpm)."""

    first: float
    last: float

    @property
    def description(self) -> str:
        """As ``1200–1310 rpm``."""
        if self.first == self.last:
            return f"{self.first:.5g} rpm"
        return f"{self.first:.5g}–{self.last:.5g} rpm"


@dataclass(frozen=True)
class Parting:
    """Where meshes of a family that carry load would have to pull."""

    family: str
    ranges: tuple[SpeedRange, ...]
    least: float  # smallest force of any of them over its static one


def dynamic_factors(turning: Turning, states: SteadyStates) -> FloatArray:
    """K_v = max F / static F (n, n_mesh); NaN of meshes without a static force."""
    static = turning.static_forces
    factors = np.full(states.mesh_max.shape, np.nan)
    np.divide(states.mesh_max, static, out=factors, where=static > 0.0)
    return factors


def family_heights(turning: Turning, states: SteadyStates) -> dict[str, FloatArray]:
    """Family → (n,) the largest dynamic factor of its meshes; without load, largest swing (N)."""
    factors = dynamic_factors(turning, states)
    swing = states.mesh_max - states.mesh[:, 0].real
    values = factors if np.any(turning.static_forces > 0.0) else swing
    return {family.name: values[:, list(family.columns)].max(axis=1) for family in turning.families}


def peaks(
    turning: Turning, states: SteadyStates, modes: Modes, *, most: int = 20
) -> tuple[Peak, ...]:
    """The resonances that stand out, the highest first."""
    if len(states.rpm) < 3:
        return ()
    kept: list[Peak] = []
    for peak in sorted(_family_peaks(turning, states, modes), key=lambda peak: -peak.height):
        if not any(
            other.line == peak.line
            and abs(other.speed_rpm - peak.speed_rpm) <= SAME_SPEED * peak.speed_rpm
            for other in kept
        ):
            kept.append(peak)
    return tuple(kept[:most])


def _family_peaks(turning: Turning, states: SteadyStates, modes: Modes) -> Iterator[Peak]:
    from scipy.signal import find_peaks  # takes its time to load

    heights = family_heights(turning, states)
    static = turning.static_forces
    base = 1.0 if np.any(static > 0.0) else 0.0
    answers = ModeAnswers.of(turning, modes)
    for family in turning.families:
        curve = np.nan_to_num(heights[family.name], nan=base)
        least = max(PROMINENCE * float(curve.max() - base), LEAST * base)
        if not least > 0.0:
            continue
        for at in find_peaks(curve, prominence=least)[0]:
            column = _loudest(family, states, int(at), static)
            line = _rising_line(states, int(at), column)
            order = float(turning.lines.orders[line])
            speed = float(states.rpm[at])
            mode, share = answers.loudest(
                states.acceleration[at, line], column, order * speed / 60.0
            )
            yield Peak(
                speed, family.name, turning.meshes[column], line, order * speed / 60.0, order,
                float(curve[at]),
                float(states.mesh_max[at, column] - states.mesh[at, 0, column].real),
                mode, share,
            )  # fmt: skip


def _loudest(family: MeshFamily, states: SteadyStates, at: int, static: FloatArray) -> int:
    columns = list(family.columns)
    scale = np.where(static[columns] > 0.0, static[columns], 1.0)
    return columns[int(np.argmax(states.mesh_max[at, columns] / scale))]


def _rising_line(states: SteadyStates, at: int, column: int) -> int:
    """The line that stands out most over what it is a little slower and faster."""
    amplitude = np.nan_to_num(np.abs(states.mesh[:, 1:, column]))
    beside = closest(states.rpm, [states.rpm[at] * (1.0 - BESIDE), states.rpm[at] * (1.0 + BESIDE)])
    return int(np.argmax(amplitude[at] - amplitude[beside].mean(axis=0))) + 1


@dataclass(frozen=True, eq=False)
class ModeAnswers:
    """Which mode answers in a line: by its share of the mesh's deflection.

    q = Σ φ_r η_r, η_r = φ_rᵀ M q with unit modal masses; the deflection v·q is Σ (v·φ_r) η_r.

    Attributes
    ----------
    projection
        (n_mode, n_dof) φ_rᵀ M.
    deflections
        (n_mesh, n_mode) v·φ_r.
    groups, frequencies
        Elastic modes, repeated ones together, and theirs (Hz).
    """

    projection: FloatArray
    deflections: FloatArray
    groups: tuple[tuple[int, ...], ...]
    frequencies: FloatArray

    @classmethod
    def of(cls, turning: Turning, modes: Modes) -> ModeAnswers:
        """Of a drivetrain's modes."""
        system = turning.periodic.system
        shapes = np.real(modes.shapes[[modes.labels.index(dof) for dof in system.dofs]])
        mass = np.einsum("im,ij,jm->m", shapes, system.mass, shapes)
        shapes = shapes / np.sqrt(mass)
        vectors = np.array([spring.vector for spring in turning.periodic.springs])
        groups: list[list[int]] = []
        for number, mode in enumerate(modes.modes):
            if mode.kind == Kind.RIGID_BODY:
                continue
            before = modes.modes[groups[-1][-1]].frequency_hz if groups else -1.0
            if groups and mode.frequency_hz - before <= REPEATED * mode.frequency_hz:
                groups[-1].append(number)
            else:
                groups.append([number])
        return cls(
            shapes.T @ system.mass,
            vectors @ shapes,
            tuple(map(tuple, groups)),
            np.array([modes.modes[group[0]].frequency_hz for group in groups]),
        )

    def loudest(self, acceleration: ComplexArray, mesh: int, frequency: float) -> tuple[int, float]:
        """The mode (the first of repeated ones) with the largest share, and that share.

        Of modes near the line's frequency (Hz) if one of them matters: a mesh's deflection is
        often quasi-static for the most part, by modes far above.
        """
        parts = self.deflections[mesh] * (self.projection @ acceleration)
        sums = np.array([abs(parts[list(group)].sum()) for group in self.groups])
        whole = abs(sum(parts[list(group)].sum() for group in self.groups))
        near = np.abs(self.frequencies / frequency - 1.0) <= NEAR
        among = np.where(near, sums, 0.0)
        best = int(np.argmax(among if among.max() >= MATTERS * whole else sums))
        return self.groups[best][0], float(sums[best] / whole) if whole else 0.0


def ranges(rpm: FloatArray, where: BoolArray) -> tuple[SpeedRange, ...]:
    """Runs of neighbouring speeds."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], where, [False]]).astype(int)))
    return tuple(
        SpeedRange(float(rpm[first]), float(rpm[last - 1]))
        for first, last in zip(edges[::2], edges[1::2], strict=True)
    )


def partings(turning: Turning, states: SteadyStates) -> tuple[Parting, ...]:
    """Families whose loaded teeth the linear steady state parts, and over which speeds."""
    static = turning.static_forces
    parted = []
    for family in turning.families:
        columns = [column for column in family.columns if static[column] > 0.0]
        if not columns:
            continue
        least = (states.mesh_min[:, columns] / static[columns]).min(axis=1)
        open_ = ranges(states.rpm, least < 0.0)
        if open_:
            parted.append(Parting(family.name, open_, float(np.nanmin(least))))
    return tuple(parted)


def loose_meshes(turning: Turning) -> tuple[str, ...]:
    """Families with backlash and without load: nothing says which of their flanks touch."""
    warnings = []
    for family in turning.families:
        loose = [
            column
            for column in family.columns
            if turning.point.laws[turning.meshes[column]].backlash
            and turning.static_forces[column] == 0.0
        ]
        if loose:
            warnings.append(
                f"{family.name}: backlash and no load; the linear steady state keeps their teeth "
                "in contact, and its numbers do not hold"
            )
    return tuple(warnings)


def describe_energy(shares: ComponentShares, mode: int) -> str:
    """Where most of a mode's energy is, as ``mesh a – b 41 %, shaft … 20 %``."""
    most = shares.most("strain", mode, 2)
    return ", ".join(f"{name} {share:.0%}".replace("%", " %") for name, share in most)


def closest(rpm: FloatArray, speeds: Sequence[float]) -> list[int]:
    """Which of the speeds computed are nearest to some others."""
    return [int(np.argmin(np.abs(rpm - speed))) for speed in speeds]


def loudest_dofs(parts: Components, states: SteadyStates) -> tuple[str, ...]:
    """Of every body the DoF that accelerates most (rms, at its worst speed); planets are one."""
    level = np.sqrt(0.5 * np.nansum(np.abs(states.acceleration[:, 1:]) ** 2, axis=1)).max(axis=0)
    best: dict[str, int] = {}
    for number, dof in enumerate(parts.dofs):
        body = dof.rpartition(".")[0].rstrip("0123456789")
        if body not in best or level[number] > level[best[body]] * (1.0 + 1e-9):
            best[body] = number
    return tuple(parts.dofs[number] for number in best.values())
