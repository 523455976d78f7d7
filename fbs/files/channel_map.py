"""From the channels of a measurement to the DoFs of a model: sign, radius, linear combinations.

    q = R u,  H_q = R_response H_u R_excitation^T

A row of R says how a DoF follows from channels: u of two accelerometers on a hub d apart make its
rotation θ = (u_1 − u_2) / d, and w = r θ. The same row serves the excitations where the same points
were hit: forces ±r/d at both have no resultant and the moment r, which is the unit of the force
conjugate to w. (De Klerk, Rixen & Voormeeren (2008), AIAA J. 46(5); van der Seijs et al. (2013),
An improved methodology for the virtual point transformation, IMAC XXXI.)

A map is a table of a TOML file:

    [map]
    "reducer.wheel.y" = "-12.y"                          # one channel, of other sign
    "brake.w" = { "7.z" = 6.25, "8.z" = -6.25 }          # a linear combination
    "shaft.w" = { channel = "9.rx", radius = 0.1 }       # an angle: w = r θ
    [map.excitations]                                    # where others were hit than measured
    "brake.w" = { "20.z" = 0.8 }
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from .._kernels.checks import FloatArray
from ..errors import FbsError
from ..frf import Frf
from .measurement import Measurement, few
from .untrusted import read_plain

RESERVED = ("channel", "sign", "radius")
MOST_COMBINED = 1000

Radius = Callable[[str], float | None]
"""r of the DoF that a label names: a rotation carried as w = r·θ; None for a translation."""


@dataclass(frozen=True)
class Combination:
    """A DoF as Σ weight × channel, times a radius.

    Attributes
    ----------
    weights : mapping of str to float
    radius : float or None
        None: the model's own where the channels are angles, 1 where they are not.
    """

    weights: Mapping[str, float]
    radius: float | None = None


@dataclass(frozen=True)
class ChannelMap:
    """DoF → combination of channels, of responses and of excitations."""

    responses: Mapping[str, Combination]
    excitations: Mapping[str, Combination]


def read_map(path: str | Path) -> ChannelMap:
    """Read the table [map] of a TOML file.

    Raises
    ------
    FbsError
        No such table, or an entry that is none; file and key are named.
    OSError
    """
    import tomllib

    try:
        document = tomllib.loads(read_plain(path).decode("utf-8-sig"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise FbsError(f"{path}: no TOML ({error})") from error
    table = document.get("map")
    if not isinstance(table, dict):
        raise FbsError(f'{path}: it has no table [map] with entries such as "brake.w" = "12.rx"')
    try:
        return map_of(table)
    except FbsError as error:
        raise FbsError(f"{path}: {error}") from error


def map_of(table: Mapping[str, Any]) -> ChannelMap:
    """Return the map a table states.

    Parameters
    ----------
    table : mapping
        DoF → "-12.y", or {channel = weight, …} or {channel = "12.rx", sign = -1, radius = 0.1};
        tables `responses` and `excitations` hold what differs between the two.

    Raises
    ------
    FbsError
        An entry that is none of these.
    """
    common = {k: v for k, v in table.items() if k not in ("responses", "excitations")}
    sides = []
    for side in ("responses", "excitations"):
        own = table.get(side, {})
        if not isinstance(own, Mapping):
            raise FbsError(f"map.{side} is {own!r}; it must be a table of DoFs")
        sides.append({dof: _combination(dof, given) for dof, given in {**common, **own}.items()})
    if not any(sides):
        raise FbsError('the map is empty; it takes entries such as "brake.w" = "12.rx"')
    return ChannelMap(*sides)


def parse_map(text: str) -> ChannelMap:
    """Return the map of a command line: "brake.w=12.rx,reducer.wheel.y=-12.y".

    Raises
    ------
    FbsError
        An entry without an equals sign, or a DoF twice.
    """
    table: dict[str, str] = {}
    for item in filter(None, (part.strip() for part in text.split(","))):
        dof, sign, channel = (part.strip() for part in item.partition("="))
        if not (dof and sign and channel):
            raise FbsError(f"{item!r}: give DoF=CHANNEL, such as brake.w=12.rx or wheel.y=-12.y")
        if dof in table:
            raise FbsError(f"{item!r}: {dof} is there already; combinations go into a map file")
        table[dof] = channel
    return map_of(table)


def channels_of(combinations: Mapping[str, Combination]) -> tuple[str, ...]:
    """Return the channels that a side of a map needs."""
    return tuple(dict.fromkeys(c for one in combinations.values() for c in one.weights))


def mapped(measurement: Measurement, channel_map: ChannelMap, radius: Radius) -> Measurement:
    """Return the measurement between the DoFs of a map whose channels it has.

    Parameters
    ----------
    measurement : Measurement
    channel_map : ChannelMap
    radius : callable
        The model's radius of a DoF.

    Raises
    ------
    FbsError
        No DoF of the map has its channels here, an angle nobody gives the radius of, a moment
        combined with a force.
    """
    frf = measurement.frf
    sides, labels, notes = [], [], list(measurement.notes)
    for what, combinations, known, turning in (
        ("response", channel_map.responses, frf.responses, measurement.angles),
        ("excitation", channel_map.excitations, frf.excitations, measurement.moments),
    ):
        usable = {d: c for d, c in combinations.items() if set(c.weights) <= set(known)}
        if not usable:
            raise FbsError(
                f"the map names no {what} that is there: it needs "
                f"{few(channels_of(combinations))}; the {what}s are {few(known)}"
            )
        absent = [dof for dof in combinations if dof not in usable]
        if absent:
            notes.append(f"the map's {few(absent)} has no channels here as {what}")
        sides.append(_matrix(usable, known, turning, radius))
        labels.append(tuple(usable))
    combine = _combined(sides[0], sides[1], labels)
    repeats = tuple(combine(one) for one in measurement.repeats)
    coherence = _mapped_coherence(measurement.coherence, sides)
    return Measurement(
        combine(frf),
        notes=tuple(notes),
        repeats=repeats,
        coherence=coherence,
        averages=measurement.averages,
    )


def in_lengths(measurement: Measurement, radius: Radius) -> Measurement:
    """Return a measurement whose rotations are w = r·θ, by the model's radii.

    Raises
    ------
    FbsError
        A rotation whose radius is not known: it is never taken for a length.
    """
    if not (measurement.angles or measurement.moments):
        return measurement
    frf = measurement.frf
    rows, columns = (
        {label: Combination({label: 1.0}) for label in labels}
        for labels in (frf.responses, frf.excitations)
    )
    return mapped(measurement, ChannelMap(rows, columns), radius)


# --- parts -------------------------------------------------------------------------------------


def _combination(dof: str, given: Any) -> Combination:
    key = f'map."{dof}"'
    if isinstance(given, str):
        channel, sign = signed(given)
        return Combination({channel: sign})
    if not isinstance(given, Mapping) or not given or len(given) > MOST_COMBINED:
        raise FbsError(
            f"{key} = {given!r}; it must be a channel, such as '-12.y', or a table, such as "
            "{ '7.z' = 6.25, '8.z' = -6.25 }"
        )
    radius = given.get("radius")
    if radius is not None and not (_is_number(radius) and radius > 0):
        raise FbsError(f"{key}: radius = {radius!r}; it must be greater than 0 (m)")
    weights = {k: v for k, v in given.items() if k not in RESERVED}
    for channel, weight in weights.items():
        if not (_is_number(weight) and weight != 0):
            raise FbsError(f"{key}: {channel} = {weight!r}; the weight must be a number, not 0")
    combined = {signed(c)[0]: float(w) * signed(c)[1] for c, w in weights.items()}
    if "channel" in given:
        sign = given.get("sign", 1)
        if weights or not isinstance(given["channel"], str) or sign not in (1, -1):
            raise FbsError(
                f"{key} = {dict(given)!r}; with channel (a text) it takes sign (1 or -1) and radius"
            )
        channel, own = signed(given["channel"])
        combined = {channel: own * sign}
    if not combined:
        raise FbsError(f"{key} names no channel")
    return Combination(combined, None if radius is None else float(radius))


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and np.isfinite(value)


def signed(channel: str) -> tuple[str, float]:
    """Return a channel in our spelling and its sign: "-12.z", "12:-Z", "12-Z" are −1 × "12.z"."""
    text = channel.strip()
    sign = -1.0 if text.startswith("-") else 1.0
    text = text.lstrip("+-")
    match = re.fullmatch(r"(.*?\d+)(?:[:.]?([+-])|:)(r?[xyz])", text, re.IGNORECASE)
    if match:
        return f"{match[1]}.{match[3].lower()}", sign * (-1.0 if match[2] == "-" else 1.0)
    return text, sign


def _matrix(
    combinations: Mapping[str, Combination],
    known: Sequence[str],
    turning: frozenset[str],
    radius: Radius,
) -> FloatArray:
    """Return R, shape (DoFs, channels)."""
    index = {label: number for number, label in enumerate(known)}
    matrix = np.zeros((len(combinations), len(known)))
    for row, (dof, one) in enumerate(combinations.items()):
        angles = [channel in turning for channel in one.weights]
        if any(angles) and not all(angles):
            raise FbsError(f"{dof} combines rotations and translations: {few(list(one.weights))}")
        r = one.radius if one.radius is not None else radius(dof) if any(angles) else 1.0
        if r is None:
            raise FbsError(
                f"{next(iter(one.weights))} is a rotation (rad or N m), and {dof} is carried in m: "
                "it needs the radius of its body; give it in a map (radius = …)"
            )
        for channel, weight in one.weights.items():
            matrix[row, index[channel]] = weight * r
    return matrix


def _combined(
    left: FloatArray, right: FloatArray, labels: Sequence[tuple[str, ...]]
) -> Callable[[Frf], Frf]:
    def combine(frf: Frf) -> Frf:
        values = np.einsum("ai,fij,bj->abf", left, frf.values, right, optimize=True)
        return replace(
            frf, values=values.transpose(2, 0, 1), responses=labels[0], excitations=labels[1]
        )

    return combine


def _mapped_coherence(
    coherence: FloatArray | None, sides: Sequence[FloatArray]
) -> FloatArray | None:
    """Return the least coherence among the FRFs that a combination takes."""
    if coherence is None:
        return None
    uses = [side != 0 for side in sides]
    found = np.empty((len(coherence), len(uses[0]), len(uses[1])))
    for i, rows in enumerate(uses[0]):
        for j, columns in enumerate(uses[1]):
            found[:, i, j] = coherence[:, rows][:, :, columns].min(axis=(1, 2))
    return found
