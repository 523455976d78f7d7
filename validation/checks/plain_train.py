"""A model file's numbers put together by hand: how the train turns, and what its path yields by.

w = r·θ. Meshing gears have equal w; through a coupling θ is the same; sun, ring and carrier have
w_s + w_r = w_c (cos α_s + cos α_r). A static path bears what statics say, and yields Σ F²/k.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import cos, pi, radians, sin
from typing import Any

import numpy as np

Table = Mapping[str, Any]
FIRST = "Stiffness of the first stage"


@dataclass
class Train:
    """What is known by hand.

    Attributes
    ----------
    mass
        Of everything that can move along the first transverse direction (kg).
    sideways
        Labels' share in a motion of 1 m along it.
    turning
        Label → w of the train turned by its ratios, 1 m at the first; empty: there are loops.
    inertia
        wᵀMw of that (kg).
    supported
        Label → torsional support (N/m).
    paths
        Name → (label pushed, label held, compliance of the one, m/N).
    """

    mass: float = 0.0
    sideways: dict[str, float] = field(default_factory=dict)
    turning: dict[str, float] = field(default_factory=dict)
    inertia: float = 0.0
    supported: dict[str, float] = field(default_factory=dict)
    paths: dict[str, tuple[str, str, float]] = field(default_factory=dict)


def plain_train(data: Table) -> Train | None:
    """Everything that follows from a model file's tables; None where a stage is of another type."""
    stages, inertias = data.get("stage", []), data.get("inertia", [])
    if any(stage["type"] not in ("parallel", "planetary") for stage in stages):
        return None
    parts: dict[str, Table] = {part["name"]: part for part in (*stages, *inertias)}
    train = Train()
    for part in parts.values():
        _add_masses(train, part)
    couplings = data.get("coupling", [])
    if _without_loops(parts, couplings):
        _turn(train, parts, couplings)
        if _determinate(parts, couplings):
            _paths(train, parts, couplings)
    return train


def _without_loops(parts: Mapping[str, Table], couplings: Sequence[Table]) -> bool:
    """Whether every coupling joins parts that nothing else does."""
    group = {name: {name} for name in parts}
    for coupling in couplings:
        first, second = (group[_part(coupling[end])] for end in ("first", "second"))
        if first is second:
            return False
        first |= second
        group.update(dict.fromkeys(second, first))
    return True


def _part(body: str) -> str:
    return str(body).partition(".")[0]


def _over_r2(table: Table, key: str, radius: float) -> float:
    if f"{key}_over_r2" in table:
        return float(table[f"{key}_over_r2"])
    return float(table[key]) / radius**2


def _angles(stage: Table) -> tuple[float, float]:
    both = stage.get("pressure_angle")
    sun, ring = (
        stage.get(f"{name}_pressure_angle") if both is None else both for name in ("sun", "ring")
    )
    return radians(float(sun)), radians(float(ring))  # type: ignore[arg-type]


def _planet_angles(stage: Table) -> list[float]:
    if "planet_angles" in stage:
        return [radians(float(angle)) for angle in stage["planet_angles"]]
    n = int(stage["planets"])
    return [2.0 * pi * k / n for k in range(n)]


def _radii(part: Table) -> dict[str, float]:
    """Body's label without .w → r."""
    name = part["name"]
    if part.get("type") == "parallel":
        return {f"{name}.{gear}": float(part[gear]["base_radius"]) for gear in ("pinion", "wheel")}
    if part.get("type") == "planetary":
        sun, ring = _angles(part)
        r_s, r_p = float(part["sun"]["base_radius"]), float(part["planet"]["base_radius"])
        centre = (r_s + r_p) / cos(sun)
        return {
            f"{name}.sun": r_s,
            f"{name}.ring": r_p + centre * cos(ring),
            f"{name}.carrier": centre,
            f"{name}.planet": r_p,
        }
    return {name: float(part["radius"])}


def _add_masses(train: Train, part: Table) -> None:
    name = part["name"]
    if part.get("type") == "parallel":
        for gear in ("pinion", "wheel"):
            train.mass += float(part[gear]["mass"])
            train.sideways[f"{name}.{gear}.y"] = 1.0
    elif part.get("type") == "planetary":
        for member in ("sun", "ring", "carrier"):
            train.mass += float(part[member]["mass"])
            train.sideways[f"{name}.{member}.u"] = 1.0
        for number, angle in enumerate(_planet_angles(part), start=1):
            train.mass += float(part["planet"]["mass"])
            train.sideways[f"{name}.planet{number}.u"] = cos(angle)
            train.sideways[f"{name}.planet{number}.v"] = -sin(angle)


# Turning


def _support(table: Table, radius: float) -> float:
    if "torsional_stiffness" in table:
        return float(table["torsional_stiffness"]) / radius**2
    return float(table.get("torsional_support", 0.0))


def _held(stage: Table, driven: str) -> str:
    """The member that stands still while another drives: one that is supported, or the ring."""
    others = [m for m in ("ring", "carrier", "sun") if m != driven]
    radii = _radii(stage)
    name = stage["name"]
    supported = [m for m in others if _support(stage[m], radii[f"{name}.{m}"]) > 0.0]
    return (supported or others)[0]


def _turn(train: Train, parts: Mapping[str, Table], couplings: Sequence[Table]) -> None:
    """w of every body from 1 m at the first, over all couplings of each group."""
    first = next(iter(parts.values()))
    waiting = [(next(iter(_radii(first))), 1.0)]
    passed: set[str] = set()
    while waiting:
        body, w = waiting.pop()
        part = parts[_part(body)]
        for other, value in _turned(train, part, body, w).items():
            for coupling in couplings:
                ends = coupling["first"], coupling["second"]
                if other not in ends or coupling["name"] in passed:
                    continue
                passed.add(coupling["name"])
                far = ends[1] if ends[0] == other else ends[0]
                r_near, r_far = _radii(part)[other], _radii(parts[_part(far)])[far]
                hub = value * float(coupling["radius"]) / r_near
                train.turning[f"{coupling['name']}.w"] = hub
                train.inertia += _over_r2(coupling, "inertia", float(coupling["radius"])) * hub**2
                waiting.append((far, value * r_far / r_near))


def _turned(train: Train, part: Table, body: str, w: float) -> dict[str, float]:
    """w of a part's bodies where one of them turns; into the train's turning and inertia."""
    name, radii = part["name"], _radii(part)
    if part.get("type") == "parallel":
        found = dict.fromkeys(radii, w)
        for gear in ("pinion", "wheel"):
            r = radii[f"{name}.{gear}"]
            train.inertia += _over_r2(part[gear], "polar_inertia", r) * w**2
    elif part.get("type") == "planetary":
        found = _turned_planets(train, part, body.rpartition(".")[2], w)
    else:
        found = {name: w}
        r = radii[name]
        train.inertia += _over_r2(part, "polar_inertia", r) * w**2
        train.supported[f"{name}.w"] = _support(part, r)
    train.turning.update({f"{label}.w": value for label, value in found.items()})
    return found


def _turned_planets(train: Train, stage: Table, driven: str, w: float) -> dict[str, float]:
    """w_s + w_r = w_c (cos α_s + cos α_r); planets spin by w_c cos α_s − w_s, and go round."""
    name, radii = stage["name"], _radii(stage)
    sun, ring = _angles(stage)
    gain = {"sun": 1.0, "ring": 1.0, "carrier": -(cos(sun) + cos(ring))}
    held = _held(stage, driven)
    third = next(m for m in gain if m not in (driven, held))
    members = {driven: w, held: 0.0, third: -gain[driven] * w / gain[third]}
    for member, value in members.items():
        r = radii[f"{name}.{member}"]
        train.inertia += _over_r2(stage[member], "polar_inertia", r) * value**2
        train.supported[f"{name}.{member}.w"] = _support(stage[member], r)
    spin = members["carrier"] * cos(sun) - members["sun"]
    planet = stage["planet"]
    inertia = _over_r2(planet, "polar_inertia", radii[f"{name}.planet"])
    for number in range(1, len(_planet_angles(stage)) + 1):
        train.turning[f"{name}.planet{number}.w"] = spin
        train.turning[f"{name}.planet{number}.v"] = members["carrier"]
        train.inertia += inertia * spin**2 + float(planet["mass"]) * members["carrier"] ** 2
    return {f"{name}.{member}": value for member, value in members.items()}


# Static paths


def _determinate(parts: Mapping[str, Table], couplings: Sequence[Table]) -> bool:
    """Whether no branch bears a load: one supported member in a planetary stage, none elsewhere.

    A member that is supported and coupled as well takes a load through its coupling.
    """
    ends = {coupling[end] for coupling in couplings for end in ("first", "second")}
    for part in parts.values():
        radii = _radii(part)
        if part.get("type") == "planetary":
            members = [f"{part['name']}.{member}" for member in ("sun", "ring", "carrier")]
            held = [m for m in members if _support(part[m.rpartition(".")[2]], radii[m]) > 0.0]
            if len(held) > 1 or ends.intersection(held):
                return False
        elif "type" not in part and _support(part, radii[part["name"]]) > 0.0:
            return False
    return not any(coupling.get("dofs") for coupling in couplings)


def _paths(train: Train, parts: Mapping[str, Table], couplings: Sequence[Table]) -> None:
    """Compliance from the first body through the chain; it ends where statics do not decide."""
    body = next(iter(_radii(next(iter(parts.values())))))
    start, force, total = f"{body}.w", 1.0, 0.0
    passed: set[str] = set()
    end = ""
    while True:
        part = parts[_part(body)]
        yielded = _through(part, body, force)
        if yielded is None:
            break
        compliance, end, force = yielded
        total += compliance
        if total > 0.0 and FIRST not in train.paths and part.get("type"):
            train.paths[FIRST] = (start, f"{end}.w", total)
        onward = [c for c in couplings if end in (c["first"], c["second"])
                  and c["name"] not in passed]  # fmt: skip
        alone = [c for c in couplings if _part(end) in (_part(c["first"]), _part(c["second"]))]
        if len(onward) != 1 or len(alone) > 2 or "dofs" in onward[0]:
            break
        coupling = onward[0]
        passed.add(coupling["name"])
        stiffnesses = [coupling["first_stiffness"], coupling["second_stiffness"]]
        if 0.0 in stiffnesses:
            break
        far = coupling["second"] if coupling["first"] == end else coupling["first"]
        force *= _radii(part)[end] / float(coupling["radius"])
        total += sum(force**2 / float(k) for k in stiffnesses if k != "rigid")
        force *= float(coupling["radius"]) / _radii(parts[_part(far)])[far]
        body = end = far
    if end and total > 0.0 and len(passed) > 0:
        train.paths["Stiffness from input to output"] = (start, f"{end}.w", total)


def _through(part: Table, body: str, force: float) -> tuple[float, str, float] | None:
    """Σ F²/k of a part, the body it leaves by, and the force there; None: statics do not say."""
    name = part["name"]
    if part.get("type") == "parallel":
        other = "wheel" if body.endswith(".pinion") else "pinion"
        compliance = _gears(part, force)
        return None if compliance is None else (compliance, f"{name}.{other}", force)
    if part.get("type") == "planetary":
        return _planets(part, body.rpartition(".")[2], force)
    return (0.0, name, force) if _support(part, float(part["radius"])) == 0.0 else None


def _gears(stage: Table, force: float) -> float | None:
    """F = f/cos β in the mesh; both gears' bearings bear it along y, z and rocking."""
    beta = radians(float(stage.get("helix_angle", 0.0)))
    along = np.array([force, force * sin(beta) / cos(beta)])
    total = _yield(float(stage["mesh_stiffness"]), force / cos(beta))
    for gear in (stage["pinion"], stage["wheel"]):
        each = gear.get("bearing") or [
            [gear.get("bearing_y"), 0.0], [0.0, gear.get("bearing_z")],
        ]  # fmt: skip
        total += _bearing(np.array(each, dtype=float), along)
        rocking = _over_r2(gear, "bearing_rocking", float(gear["base_radius"]))
        total += _yield(rocking, float(along[1]))
    return total if np.isfinite(total) else None


def _planets(stage: Table, driven: str, force: float) -> tuple[float, str, float] | None:
    """λ (1, 1, −(cos α_s + cos α_r)) on sun, ring and carrier; λ/N in every mesh."""
    meshes = stage["sun_mesh_stiffness"], stage["ring_mesh_stiffness"]
    if "planets" not in stage or any(isinstance(k, list) for k in meshes):
        return None  # planets that differ move the sun
    name, radii = stage["name"], _radii(stage)
    sun, ring = _angles(stage)
    gain = {"sun": 1.0, "ring": 1.0, "carrier": cos(sun) + cos(ring)}
    held = _held(stage, driven)
    third = next(m for m in gain if m not in (driven, held))
    supports = {m: _support(stage[m], radii[f"{name}.{m}"]) for m in gain}
    if supports[held] == 0.0 or supports[driven] or supports[third]:
        return None
    whole = force / gain[driven]
    n = int(stage["planets"])
    both = stage.get("planet_bearing")
    radial, tangential = (
        both if both is not None else stage.get(f"planet_bearing_{way}")
        for way in ("radial", "tangential")
    )
    matrix = both if isinstance(both, list) else [[radial, 0.0], [0.0, tangential]]
    each = whole / n
    on_planet = each * np.array([sin(ring) - sin(sun), -(cos(sun) + cos(ring))])
    total = n * (
        sum(_yield(float(k), each) for k in meshes)
        + _bearing(np.array(matrix, dtype=float), on_planet)
    )
    total += _yield(supports[held], gain[held] * whole)
    if not np.isfinite(total):
        return None
    return total, f"{name}.{third}", gain[third] * whole


def _yield(stiffness: float, force: float) -> float:
    """F²/k; nothing where there is no force."""
    if force == 0.0:
        return 0.0
    return force**2 / stiffness if stiffness > 0.0 else np.inf


def _bearing(matrix: np.ndarray, force: np.ndarray) -> float:
    """fᵀ K⁻¹ f of a 2 × 2 bearing; infinite where it bears no force of that direction."""
    if np.count_nonzero(matrix - np.diag(np.diag(matrix))) == 0:
        return sum(_yield(float(k), float(f)) for k, f in zip(np.diag(matrix), force, strict=True))
    if np.linalg.det(matrix) <= 0.0:
        return np.inf
    return float(force @ np.linalg.solve(matrix, force))
