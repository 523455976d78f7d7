"""What speaks against a result, though its digits are all there.

**The known part is in the assembly.** A part that nothing but its interface b ties to the rest
moves inside, at i, as its interface makes it: u_i = T u_b, T = Y_ib Y_bb⁻¹, for any force at b and
whatever the rest is. T is therefore that of the assembly and that of the part alone (Ribeiro, Silva
& Maia 2000, Mech. Syst. Signal Process. 14, 29: transmissibility of MDoF systems).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from fbs import Frf, Joint, SingularLineError, StiffnessTable
from fbs.decoupling import DecoupledFrf, Form, decouple
from fbs.joint_identification import Spring
from fbs.measured.quality import NOISE, quality

from ..arrays import FloatArray
from ..routes.substitution_checks import describe, where
from .inputs import JointOption, Part

SAME = 1e-6  # of a stiffness: two forms whose round-off is told as an interval


def active(joint: JointOption, frequency: FloatArray) -> tuple[str, ...]:
    """Say where a joint has negative damping: no structure's, or e^{-jωt} was meant."""
    if joint.stiffness is None:
        return ()
    z = Joint(("A", "a"), ("B", "b"), joint.stiffness, joint.damping).dynamic_stiffness(
        2.0 * np.pi * frequency
    )
    lines = z.imag < 0.0
    if not lines.any():
        return ()
    noise = " (or the noise of its table)" if isinstance(joint.stiffness, StiffnessTable) else ""
    return (
        f"--joint: its damping is negative {where(frequency, lines)}: it puts energy in{noise}; "
        "with e^{+jωt} losses have Im K > 0",
    )


def scattered(parts: Mapping[str, Part]) -> tuple[str, ...]:
    """Say that the scatter of a file's runs is not in the errors, and how much it is."""
    notes = []
    for part in parts.values():
        scatter = part.scatter(None)
        if scatter is not None:
            size = np.sqrt(scatter.variance.sum() / np.sum(np.abs(part.frf.values) ** 2))
            notes.append(
                f"{part.path}: the scatter of its runs ({size:.2g} of the FRFs, weighted by their "
                "squares) is not in the errors shown: state it by --noise"
            )
    return tuple(notes)


def contradict(one: Spring, other: Spring) -> bool:
    """Whether two intervals of a stiffness have nothing in common."""
    apart = abs(one.stiffness - other.stiffness)
    round_off = SAME * max(abs(one.stiffness), abs(other.stiffness))
    return apart > max(one.stiffness_interval + other.stiffness_interval, round_off)


def odd_part(frf: Frf, error: FloatArray) -> tuple[str, ...]:
    """What a passive, reciprocal structure does not have, at lines known to 5 % at least."""
    known = (error <= NOISE * np.abs(frf.values)).all(axis=(1, 2))
    defects = (replace(one, lines=one.lines & known) for one in quality(frf).defects)
    told = [describe(one, frf.frequency) for one in defects if one.lines.any()]
    if not told:
        return ()
    return (
        f"what is left is no passive, reciprocal structure: {'; '.join(told)}. Is the known part "
        "another, joined elsewhere too, or noise more than stated (--noise)?",
    )


def require_stable(
    found: DecoupledFrf,
    files: tuple[Frf, Frf],
    interface: tuple[str, ...],
    internal: tuple[str, ...],
    form: Form,
    relative: float,
    regularised: bool,
) -> None:
    """Refuse a known part that is stiffer than the assembly, whatever was regularised afterwards.

    What is regularised is no part's FRFs: the plain inverse is asked then, if it has a digit.

    Raises
    ------
    FbsError
    """
    if not set(interface) <= set(found.frf.responses) & set(found.frf.excitations):
        return
    if regularised:
        try:
            found = decouple(*files, interface, internal, form=form)
        except SingularLineError:
            return  # which is why it is regularised: nothing is known
    found.require_stable(interface, relative)


def contradiction(
    assembly: Frf, known: Frf, interface: Sequence[str], relative: float
) -> str | None:
    """Say where the part moves in the assembly as it does not alone; None: nowhere, or not known.

    Counted are lines whose difference is beyond 5 % and three standard deviations of what noise
    does to T, at most √2 (1 + κ) times as large, κ the condition of Y_bb; told is what more than
    half of the lines show, which spikes at poles are not.

    Parameters
    ----------
    assembly, known
        A DoF has the same label in both.
    interface
        Labels at which they are joined.
    relative
        Standard deviation of an FRF value over its modulus.
    """
    inside = tuple(
        label for label in known.responses if label not in interface and label in assembly.responses
    )
    if not inside:
        return None
    (one, spread_1), (two, spread_2) = (
        _transmissibility(frf, inside, interface, relative) for frf in (assembly, known)
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        off = np.linalg.norm(one - two, axis=(1, 2)) / np.linalg.norm(two, axis=(1, 2))
    lines = off > NOISE + 3.0 * np.hypot(spread_1, spread_2)
    if np.count_nonzero(lines) <= 0.5 * lines.size:
        return None
    return (
        f"the known part is not in the assembly as it is alone: at {', '.join(inside)} it moves "
        f"otherwise with {', '.join(interface)}, by {np.median(off[lines]):.2g} of it, "
        f"{where(known.frequency, lines)}; is it another part, or joined elsewhere too?"
    )


def _transmissibility(
    frf: Frf, inside: Sequence[str], interface: Sequence[str], relative: float
) -> tuple[FloatArray, FloatArray]:
    """T (nf, n_inside, n_interface), and what noise does to it relative to its size (nf,)."""
    held = frf.select(interface, interface).values
    with np.errstate(divide="ignore", invalid="ignore"):
        condition = np.linalg.cond(held)
    inverse = np.linalg.pinv(held)
    moved = frf.select(inside, interface).values @ inverse
    return np.asarray(moved), np.sqrt(2.0) * relative * (1.0 + condition)
