"""Coupling, decoupling and identification of FRFs from files."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import cast, get_args

import numpy as np

from fbs import Frf, Joint, couple
from fbs.decoupling import EPS, Form, decouple
from fbs.files.measurement import few
from fbs.joint_identification import JointStiffness, fit_spring, joint_between, joint_in_situ
from fbs.measured.uncertainty import coupled_uncertainty

from ..arrays import FloatArray
from ..checks.part_uncertainty import Noise
from ..errors import CommandError
from .doubts import active, contradict, contradiction, odd_part, require_stable, scattered
from .inputs import JointOption, Pair, Part, labels
from .result import Curve, Identified, SubstructuringResult

DRAWN = 4  # FRFs
RADIUS_95 = float(np.sqrt(-np.log(0.05)))
"""Of E|δ|²'s root: holds 95 % of an error alike in all directions of the complex plane."""
BY_NOISE = "95 % of the noise, to first order, a radius around the complex value"
BY_ROUND_OFF = "a bound of round-off alone; --noise says what noise of the files does"
BY_SCATTER = "95 % of how the lines scatter about a spring and a damper"
UNSTATED = (
    "No noise is stated (--noise): intervals are as wide as the lines scatter about a spring and a "
    "damper."
)
Found = tuple[SubstructuringResult, Frf | JointStiffness]


def run_couple(
    parts: Mapping[str, Part], at: tuple[Pair, ...], joint: JointOption, noise: Noise | None
) -> Found:
    """Couple A and B.

    Raises
    ------
    CommandError, FbsError
    """
    start = time.perf_counter()
    _require(at, (parts["A"], parts["B"]))
    a, b, pairs, renamed = _told_apart(parts["A"], parts["B"], at, joint.stiffness is None)
    joints = [
        Joint(("A", one), ("B", other), joint.stiffness, joint.damping) for one, other in pairs
    ]
    frfs = {"A": a.frf, "B": b.frf}
    coupled = couple(frfs, joints)
    frf = coupled.frf
    rows, columns = _drawn(frf, pairs, (a.frf, b.frf))
    scatters = {part.name: s for part in (a, b) if (s := part.scatter(noise)) is not None}
    if scatters:
        radii = [  # of few runs wider than of a known variance
            coupled_uncertainty(frfs, joints, name, scatter, rows, columns).radius()
            for name, scatter in scatters.items()
        ]
        error = np.sqrt(np.sum(np.square(radii), axis=0))
    else:
        error = frf.select(rows, columns).round_off
    curves = _curves(frf, rows, columns, error, (a.frf, b.frf))
    return _result(
        "couple", tuple(parts.values()), at, f"joint: {joint.words}",
        f"Coupled at {len(at)} DoF{'s' if len(at) > 1 else ''}", (),
        (*renamed, *active(joint, frf.frequency)),
        frf.frequency, coupled.kernel_condition, BY_NOISE if scatters else BY_ROUND_OFF, curves,
        (), start,
    ), frf  # fmt: skip


@dataclass(frozen=True)
class DecouplingOptions:
    """How a part is taken off; see `fbs.decoupling.decouple`."""

    internal: tuple[Pair, ...] = ()
    form: str | None = None
    rank: int | None = None
    tikhonov: float = 0.0


def run_decouple(
    parts: Mapping[str, Part],
    at: tuple[Pair, ...],
    options: DecouplingOptions,
    noise: Noise | None,
) -> Found:
    """Take A off AB.

    Raises
    ------
    CommandError, FbsError
    """
    start = time.perf_counter()
    _require(at, (parts["AB"], parts["A"]))
    whole = parts["AB"]
    _require(options.internal, (whole, parts["A"]), "--internal", ("response",))
    known = _renamed(parts["A"], at, options.internal)
    interface = tuple(ours for ours, _ in at)
    relative = EPS if noise is None else _relative(noise)
    form = _form(options)
    internal = tuple(ours for ours, _ in options.internal)
    found = decouple(
        whole.frf, known.frf, interface, internal,
        form=form, rank=options.rank, tikhonov=options.tikhonov,
    )  # fmt: skip
    regularised = options.rank is not None or options.tikhonov > 0.0
    require_stable(found, (whole.frf, known.frf), interface, internal, form, relative, regularised)
    error = found.bound() if noise is None else RADIUS_95 * found.spread(relative)
    rows, columns = _drawn(found.frf, at, (found.frf,))
    i, j = ([side.index(x) for x in own] for side, own in _sides(found.frf, rows, columns))
    curves = _curves(found.frf, rows, columns, error[:, i][:, :, j], (whole.frf,))
    conclusions = []
    if found.dropped.any():
        conclusions.append(
            f"Left out are singular values up to {found.dropped.max():.2g} of the largest."
        )
    if options.tikhonov:
        conclusions.append(f"Regularised: Tikhonov, λ = {options.tikhonov:g} of the largest.")
    if regularised:
        conclusions.append("What regularising takes away is in no error shown: it is not known.")
    doubts = odd_part(found.frf, error)
    odd = contradiction(whole.frf, known.frf, interface, relative)
    if odd is not None:
        doubts = (odd, *doubts)
    return _result(
        "decouple", tuple(parts.values()), at, f"{form} interface",
        f"{'Decoupled, in doubt,' if doubts else 'Decoupled'} at {len(at)} "
        f"DoF{'s' if len(at) > 1 else ''}", tuple(conclusions),
        (*doubts, *(scattered(parts) if noise is None else ())),
        found.frf.frequency, found.kernel_condition,
        BY_ROUND_OFF if noise is None else BY_NOISE, curves, (), start,
    ), found.frf  # fmt: skip


def run_identify(parts: Mapping[str, Part], at: tuple[Pair, ...], noise: Noise | None) -> Found:
    """Find the joint of AB between A and B.

    Raises
    ------
    CommandError, FbsError
    """
    start = time.perf_counter()
    _require(at, (parts["A"], parts["B"]))
    _require(at, (parts["AB"], parts["AB"]))
    for one, other in at:
        if one == other:
            raise CommandError(
                f"--at = {one!r}: the assembly must be measured on both sides of the joint, under "
                "two names; of a rigid joint there is nothing to find"
            )
    relative = EPS if noise is None else _relative(noise)
    whole, a, b = (parts[name].frf for name in ("AB", "A", "B"))
    joints = {
        "direct": joint_between(whole, a, b, at, relative),
        "in situ": joint_in_situ(whole, at, relative),
    }
    identified = tuple(
        Identified(form, joint, tuple(fit_spring(joint, k) for k in range(len(at))))
        for form, joint in joints.items()
    )
    curves = [
        Curve(
            f"{' – '.join(pair)}, {found.form}",
            found.joint.values[:, k, k],
            RADIUS_95 * max(1.0, fitted.residual) * found.joint.spread[:, k, k],
            np.asarray(fitted.stiffness + 2j * np.pi * whole.frequency * fitted.damping),
        )
        for found in identified
        for k, (pair, fitted) in enumerate(zip(at, found.springs, strict=True))
    ]
    best = identified[0].springs
    conclusions = () if noise is not None else (UNSTATED,)
    warnings = [
        f"{' – '.join(pair)}: {one.stiffness:.4g} N/m directly, {other.stiffness:.4g} in situ, "
        "beyond both intervals: A or B is not what the assembly is made of, or noise is more than "
        "stated"
        for pair, one, other in zip(at, *(found.springs for found in identified), strict=True)
        if contradict(one, other)
    ]
    words = "; ".join(
        f"{' – '.join(pair)}: {one.describe()}" for pair, one in zip(at, best, strict=True)
    )
    told = best[0].describe()
    verdict = words if len(at) > 1 else told[0].upper() + told[1:]
    if warnings:
        verdict = f"Not told: the direct and the in-situ form contradict one another; {words}"
    warnings += [
        f"{found.form}: the misfit at {' – '.join(pair)} is {one.residual:.2g} of the spread: more "
        "than a spring and a damper, or more noise than stated"
        for found in identified
        for pair, one in zip(at, found.springs, strict=True)
        if noise is not None and one.residual > 2.0
    ]
    warnings += scattered(parts) if noise is None else ()
    return _result(
        "identify", tuple(parts.values()), at, "direct, and in situ of AB alone",
        verdict, conclusions, tuple(warnings), whole.frequency, None,
        BY_SCATTER if noise is None else BY_NOISE, tuple(curves), identified, start,
    ), joints["direct"]  # fmt: skip


def _result(
    command: str,
    parts: tuple[Part, ...],
    at: tuple[Pair, ...],
    how: str,
    verdict: str,
    conclusions: tuple[str, ...],
    warnings: tuple[str, ...],
    frequency: FloatArray,
    condition: FloatArray | None,
    error_is: str,
    curves: tuple[Curve, ...],
    identified: tuple[Identified, ...],
    start: float,
) -> SubstructuringResult:
    lost = int(np.any([curve.lost for curve in curves], axis=0).sum())
    digits = (
        f"{lost} of {frequency.size} lines have no digit left somewhere"
        if lost
        else "every line drawn has a digit"
    )
    told = verdict if identified else f"{verdict}: {digits}"
    odd = [part for part in parts if part.quality]
    if odd:
        told = f"{told}; {' and '.join(part.name for part in odd)} in doubt for quality"
    notes = tuple(f"{part.path}: {note}" for part in parts for note in part.notes)
    notes += tuple(f"{part.path}: {'; '.join(part.quality)}" for part in odd)
    return SubstructuringResult(
        command, parts, at, how, told, conclusions, (*notes, *warnings), frequency, condition,
        error_is, curves, identified, {command: time.perf_counter() - start},
    )  # fmt: skip


def _require(
    at: tuple[Pair, ...],
    parts: tuple[Part, Part],
    option: str = "--at",
    roles: tuple[str, ...] = ("response", "excitation"),
) -> None:
    """Refuse DoFs that a file does not have, as response or as excitation."""
    if not at:
        if option != "--at":
            return
        raise CommandError("--at is missing: give the DoFs that are joined, such as a.x=b.y")
    for part, side in zip(parts, zip(*at, strict=True), strict=True):
        for role in roles:
            known = part.frf.responses if role == "response" else part.frf.excitations
            for label in side:
                if label not in known:
                    raise CommandError(
                        f"{option}: {part.path} ({part.name}) has no {role} {label!r}; its {role}s "
                        f"are {few(known)}"
                    )


def _renamed(known: Part, at: tuple[Pair, ...], internal: tuple[Pair, ...]) -> Part:
    """The known part with the assembly's labels."""
    twice = {ours for ours, _ in at} & {ours for ours, _ in internal}
    if twice:
        raise CommandError(f"--internal: {few(sorted(twice))} is in --at too")
    names = {theirs: ours for ours, theirs in (*at, *internal) if theirs != ours}
    for theirs, ours in names.items():
        if ours in labels(known.frf) and ours not in names:
            raise CommandError(
                f"--at, --internal: {theirs!r} of {known.path} ({known.name}) is to be {ours!r}, "
                "but it has another DoF of that name; give one another name (--map)"
            )
    return known.renamed(names)


def _form(options: DecouplingOptions) -> Form:
    if options.form is None:
        return "mixed" if options.internal else "standard"
    if options.form not in get_args(Form):
        raise CommandError(f"--form = {options.form!r}: must be {', '.join(get_args(Form))}")
    return cast(Form, options.form)


def _relative(noise: Noise) -> float:
    return float(np.hypot(noise.amplitude, noise.phase))


def _told_apart(
    a: Part, b: Part, at: tuple[Pair, ...], rigid: bool
) -> tuple[Part, Part, tuple[Pair, ...], tuple[str, ...]]:
    """Give labels that both files have their part's name, but for those that are one motion."""
    one_motion = {first for first, second in at if rigid and first == second}
    both = [x for x in labels(a.frf) if x in labels(b.frf) and x not in one_motion]
    names = [{x: f"{part.name}.{x}" for x in both} for part in (a, b)]
    pairs = tuple((names[0].get(x, x), names[1].get(y, y)) for x, y in at)
    notes = (f"both files have {', '.join(both)}: called A.… and B.… in what is coupled",)
    return a.renamed(names[0]), b.renamed(names[1]), pairs, notes if both else ()


def _drawn(
    frf: Frf, at: Iterable[Pair], parts: Iterable[Frf]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Responses and excitations shown: an interface DoF, and another of every part."""
    interface = [label for pair in at for label in pair]
    others = [next((x for x in labels(p) if x not in interface), None) for p in parts]
    wanted = [*interface[:1], *(x for x in others if x is not None)]
    rows = [x for x in wanted if x in frf.responses] or list(frf.responses[:1])
    columns = [x for x in wanted if x in frf.excitations] or list(frf.excitations[:1])
    return tuple(dict.fromkeys(rows)), tuple(dict.fromkeys(columns))


def _sides(
    frf: Frf, rows: tuple[str, ...], columns: tuple[str, ...]
) -> tuple[tuple[tuple[str, ...], tuple[str, ...]], tuple[tuple[str, ...], tuple[str, ...]]]:
    return (frf.responses, rows), (frf.excitations, columns)


def _curves(
    frf: Frf,
    rows: tuple[str, ...],
    columns: tuple[str, ...],
    error: FloatArray,
    before: tuple[Frf, ...],
) -> tuple[Curve, ...]:
    """FRFs with their errors; beside them what a part had alone."""
    curves = []
    for i, response in enumerate(rows):
        for j, excitation in enumerate(columns):
            if j < i and excitation in rows and response in columns:
                continue  # reciprocal
            own = next(
                (f for f in before if response in f.responses and excitation in f.excitations), None
            )
            curves.append(
                Curve(
                    f"{response} ← {excitation}",
                    frf.between(response, excitation),
                    error[:, i, j],
                    None if own is None else own.between(response, excitation),
                )
            )
    return tuple(curves[:DRAWN])
