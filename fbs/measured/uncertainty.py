"""What errors of measured FRFs do to those of an assembly: to first order, and by sampling.

With Y_c = Y − Y Bᵀ G B Y and G = (B Y Bᵀ + Z⁻¹)⁻¹ an error dY_A of one substructure's FRFs gives

    dY_c = L dY_A R,  L = I − Y Bᵀ G B,  R = I − Bᵀ G B Y

exactly in closed form: R_lj is the force on A's DoF l in the assembly under a unit force at j, and
L its transpose where FRFs are reciprocal. Independent errors of the FRFs A_kl add up as

    E |dY_ij|² = Σ_kl |L_ik|² E |dA_kl|² |R_lj|²,   E dY_ij² = Σ_kl L_ik² E dA_kl² R_lj²

the second of which tells errors along H (its magnitude) from those across (its phase).
L and R are the identity but for the joints' DoFs, and there they are FRFs of the assembly: of
a response that is the force, and an excitation that is the motion, of that DoF.

Meggitt & Moorhouse (2020), Uncertainty propagation in experimental dynamic substructuring,
Mech. Syst. Signal Process.; de Klerk (2011), How bias errors affect experimental dynamic
substructuring, IMAC XXIX.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .._kernels.blocks import each, stretches
from .._kernels.checks import ComplexArray, FloatArray
from ..coupling import couple
from ..errors import FbsError, UnknownDofError
from ..frf import Frf, require_same_layout
from ..joints import AnyJoint, rows_of

LINES = 512
"""Lines at once: what is added up stays in the cache."""

GAIN = "force or motion at "


@dataclass(frozen=True, eq=False)
class Scatter:
    """Errors of FRFs, independent of each other.

    Parameters
    ----------
    variance : array, shape (nf, n_response, n_excitation)
        E |dH|².
    pseudo : complex array of that shape, or None
        E dH²; None is 0: the error is alike in all directions of the complex plane.
    """

    variance: FloatArray
    pseudo: ComplexArray | None = None

    @classmethod
    def relative(cls, frf: Frf, amplitude: float, phase: float = 0.0) -> Scatter:
        """Return H (1 + ε) exp(jφ), ε and φ (rad) with these standard deviations."""
        if not (0 <= amplitude < 1 and 0 <= phase < 1):
            raise FbsError(
                f"the noise is {amplitude:g} of H and {phase:g} rad; both must be from 0 to below 1"
            )
        square = frf.values**2
        variance = np.abs(square) * (amplitude**2 + phase**2)
        return cls(variance, square * (amplitude**2 - phase**2))

    @classmethod
    def of_coherence(cls, frf: Frf, coherence: FloatArray, degrees: int) -> Scatter:
        """Return |H|² (1 − γ²) / (γ² n), n averages less the excitations at once.

        Bendat & Piersol (2010), Random Data, 4th ed., sec. 9.2. Where γ² is not known (NaN) it is
        taken as 1.
        """
        if degrees < 1:
            raise FbsError(f"the coherence of {degrees} averages too few says nothing")
        known = np.where(np.isnan(coherence), 1.0, coherence)
        if not ((known > 0) & (known <= 1)).all():
            raise FbsError("the coherence must be above 0 and at most 1")
        return cls(np.abs(frf.values) ** 2 * (1 - known) / (known * degrees))

    @classmethod
    def of_repeats(cls, repeats: Sequence[Frf]) -> Scatter:
        """Return the scatter of the mean of repeated measurements."""
        if len(repeats) < 2:
            raise FbsError(f"scatter needs two repeats at least, there is {len(repeats)}")
        for other in repeats[1:]:
            require_same_layout(repeats[0], other)
        n = len(repeats)
        mean = sum(frf.values for frf in repeats) / n
        rests = [frf.values - mean for frf in repeats]
        variance = sum(np.abs(rest) ** 2 for rest in rests) / (n * (n - 1))
        pseudo = sum(rest**2 for rest in rests) / (n * (n - 1))
        return cls(np.asarray(variance), np.asarray(pseudo))


@dataclass(frozen=True, eq=False)
class UncertainFrf:
    """FRFs of an assembly and their scatter.

    Parameters
    ----------
    frf : Frf
    variance : array, shape of the FRF's values
        E |dY|².
    force, motion : complex arrays, shapes (nf, n_joint, n_excitation), (nf, n_response, n_joint)
        R and L at the joints' DoFs.
    interface : tuple of str
        Labels of these DoFs.
    part : Frf
        The substructure whose errors they are, and
    errors : Scatter
        these errors.
    """

    frf: Frf
    variance: FloatArray
    force: ComplexArray
    motion: ComplexArray
    interface: tuple[str, ...]
    part: Frf
    errors: Scatter

    def radius(self, level: float = 0.95) -> FloatArray:
        """Return the radius around H that holds the FRF with this probability.

        That of the errors alike in all directions, √(−ln(1 − level) E |dY|²).
        """
        if not 0 < level < 1:
            raise FbsError(f"the level is {level}; must be between 0 and 1")
        return np.asarray(np.sqrt(-np.log1p(-level) * self.variance))

    def deviations(self, response: str, excitation: str) -> tuple[FloatArray, FloatArray]:
        """Return the standard deviations of ln |H| and of the phase (rad) of one FRF.

        √((E |dY|² ± Re(E dY² / H²) |H|²) / 2) / |H|, to first order.

        Returns
        -------
        two arrays, shape (nf,)
            Infinite where H is 0.
        """
        i, j = self.frf.responses.index(response), self.frf.excitations.index(excitation)
        values, variance = self.frf.values[:, i, j], self.variance[:, i, j]
        turned: FloatArray | float = 0.0
        with np.errstate(divide="ignore", invalid="ignore"):
            if self.errors.pseudo is not None:
                left, right = self._gains(response, excitation)
                pseudo = np.einsum("fk,fkl,fl->f", left**2, self.errors.pseudo, right**2)
                turned = (pseudo / values**2).real
            half = variance / np.abs(values) ** 2
            return (
                np.sqrt(np.maximum(half + turned, 0) / 2),
                np.sqrt(np.maximum(half - turned, 0) / 2),
            )

    def shares(self, response: str, excitation: str) -> FloatArray:
        """Return how much of E |dY_ij|² comes from each FRF of the part.

        Returns
        -------
        array, shape (nf, n_response, n_excitation) of the part
            Sums to 1 on every line where there is an error at all.
        """
        left, right = (np.abs(gain) ** 2 for gain in self._gains(response, excitation))
        parts = left[:, :, None] * self.errors.variance * right[:, None, :]
        total = parts.sum(axis=(1, 2), keepdims=True)
        found: FloatArray = np.divide(parts, total, out=np.zeros_like(parts), where=total > 0)
        return found

    def _gains(self, response: str, excitation: str) -> tuple[ComplexArray, ComplexArray]:
        """Return L_ik and R_lj of one FRF for every DoF of the part, shapes (nf, n)."""
        i, j = self.frf.responses.index(response), self.frf.excitations.index(excitation)
        return (
            _gains(self.part.responses, response, self.interface, self.motion[:, i, :]),
            _gains(self.part.excitations, excitation, self.interface, self.force[:, :, j]),
        )


def coupled_uncertainty(
    substructures: Mapping[str, Frf],
    joints: Sequence[AnyJoint],
    part: str,
    errors: Scatter,
    responses: Iterable[str] | None = None,
    excitations: Iterable[str] | None = None,
) -> UncertainFrf:
    """Couple, and carry one substructure's errors through to first order.

    Parameters
    ----------
    substructures, joints, responses, excitations
        As for `couple`.
    part : str
        The substructure that was measured.
    errors : Scatter
        Of its FRFs.

    Raises
    ------
    UnknownDofError
        There is no such substructure.
    FbsError
        As for `couple`, or errors of another shape.
    """
    if part not in substructures:
        raise UnknownDofError(f"there is no substructure {part!r}, only {', '.join(substructures)}")
    frf = substructures[part]
    if errors.variance.shape != frf.values.shape:
        raise FbsError(
            f"the errors have shape {errors.variance.shape}, the FRFs of {part!r} "
            f"{frf.values.shape}"
        )
    interface = _interface(joints, part)
    wanted = _all(substructures, "responses") if responses is None else tuple(responses)
    driven = _all(substructures, "excitations") if excitations is None else tuple(excitations)
    result = couple(substructures, joints, wanted, driven).frf
    force = _at_joints(substructures, joints, part, interface, driven, "responses")
    motion = _at_joints(substructures, joints, part, interface, wanted, "excitations")
    index = _Index(frf, interface, wanted, driven)
    variance = _carried(errors.variance, _squared(motion), _squared(force), index)
    gains = (force.transpose(2, 0, 1), motion.transpose(2, 0, 1))
    return UncertainFrf(result, variance, *gains, interface, frf, errors)


def sampled(
    substructures: Mapping[str, Frf],
    joints: Sequence[AnyJoint],
    part: str,
    errors: Scatter,
    count: int,
    seed: int = 0,
    responses: Iterable[str] | None = None,
    excitations: Iterable[str] | None = None,
) -> Iterator[Frf]:
    """Couple again and again with errors drawn from normal distributions.

    Parameters
    ----------
    count : int
        How often.
    seed : int
        Of the random numbers.

    The others are those of `coupled_uncertainty`, and so is what is raised.
    """
    generator = np.random.default_rng(seed)
    wanted = None if responses is None else tuple(responses)
    driven = None if excitations is None else tuple(excitations)
    frf = substructures[part]
    roots = _roots(errors)
    for _ in range(count):
        values = frf.values + _draw(roots, generator)
        changed = dict(substructures) | {part: replace(frf, values=values)}
        yield couple(changed, joints, wanted, driven).frf


# --- parts -------------------------------------------------------------------------------------


def _interface(joints: Sequence[AnyJoint], part: str) -> tuple[str, ...]:
    ends = [end for joint in rows_of(joints) for end in (joint.first, joint.second)]
    return tuple(dict.fromkeys(label for owner, label in ends if owner == part))


def _all(substructures: Mapping[str, Frf], side: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(x for frf in substructures.values() for x in getattr(frf, side)))


def _at_joints(
    substructures: Mapping[str, Frf],
    joints: Sequence[AnyJoint],
    part: str,
    interface: Sequence[str],
    wanted: Sequence[str],
    side: str,
) -> ComplexArray:
    """Return R at the joints' DoFs of the part (side "responses"), or L ("excitations").

    The part gets a response that is the force at a joint's DoF: H = 1 for a force there, else 0;
    in the assembly it is δ − Bᵀ G B Y. All other responses but the joints' are left out.

    Returns
    -------
    array, shape (n_joint, n_excitation, nf) or (n_response, n_joint, nf)
    """
    few = {name: _only(frf, _interface(joints, name), side) for name, frf in substructures.items()}
    few[part] = _with_unit_gains(few[part], interface, side)
    names = [GAIN + label for label in interface]
    at = {"responses": names, "excitations": wanted}
    if side == "excitations":
        at = {"responses": wanted, "excitations": names}
    return couple(few, joints, at["responses"], at["excitations"]).frf.values.transpose(1, 2, 0)


def _only(frf: Frf, labels: Sequence[str], side: str) -> Frf:
    return frf.select(responses=labels) if side == "responses" else frf.select(excitations=labels)


def _with_unit_gains(frf: Frf, interface: Sequence[str], side: str) -> Frf:
    rows = side == "responses"
    across = frf.excitations if rows else frf.responses
    gains = np.zeros((len(interface), len(across), frf.frequency.size), dtype=complex)
    for k, label in enumerate(interface):
        gains[k, across.index(label)] = 1.0
    own = frf.values.transpose(1, 2, 0)
    values = np.concatenate(
        [own, gains if rows else gains.transpose(1, 0, 2)], axis=0 if rows else 1
    )
    labels = (*getattr(frf, side), *(GAIN + label for label in interface))
    changes = {"values": values.transpose(2, 0, 1), side: labels}
    return replace(frf, **changes)  # type: ignore[arg-type]


@dataclass(frozen=True, eq=False)
class _Index:
    """Where the part's DoFs stand: own[i] is the part's number of response i, or None."""

    part: Frf
    interface: tuple[str, ...]
    wanted: tuple[str, ...]
    driven: tuple[str, ...]

    def free(self, side: str) -> list[tuple[slice, slice]]:
        """Return runs of DoFs of the part that are no joint's: in the assembly, and in the part."""
        labels, known = (
            (self.wanted, self.part.responses)
            if side == "responses"
            else (self.driven, self.part.excitations)
        )
        runs: list[tuple[slice, slice]] = []
        for place, label in enumerate(labels):
            if label not in known or label in self.interface:
                continue
            own = known.index(label)
            if runs and (runs[-1][0].stop, runs[-1][1].stop) == (place, own):
                (first, _), (first_own, _) = ((r.start, r.stop) for r in runs.pop())
                runs.append((slice(first, place + 1), slice(first_own, own + 1)))
            else:
                runs.append((slice(place, place + 1), slice(own, own + 1)))
        return runs

    def joints(self, side: str) -> list[int]:
        """Return the joints' DoFs in the part."""
        known = self.part.responses if side == "responses" else self.part.excitations
        return [known.index(label) for label in self.interface]


def _squared(gain: ComplexArray) -> FloatArray:
    return np.asarray(gain.real**2 + gain.imag**2)


def _carried(
    errors: FloatArray, motion: FloatArray, force: FloatArray, index: _Index
) -> FloatArray:
    """Return Σ_kl L²_ik e_kl R²_lj: L² = `motion` and R² = `force` at joints, else the identity.

    W_il = [i in A] e_il + Σ_c L²_ic e_cl,   result_ij = [j in A] W_ij + Σ_c W_ic R²_cj
    """
    e = errors.transpose(1, 2, 0)
    n, m, nf = len(index.wanted), len(index.driven), e.shape[2]
    result = np.empty((n, m, nf))
    own = {
        place: row
        for places, rows in index.free("responses")
        for place, row in zip(range(n)[places], range(len(e))[rows], strict=True)
    }
    columns = index.free("excitations")
    at_rows, at_columns = index.joints("responses"), index.joints("excitations")
    places = (columns, at_rows, at_columns)

    def fill(i: int) -> None:
        scratch = np.empty((m, min(nf, LINES)), dtype=float)
        for lines in stretches(nf, LINES):
            part, right = e[:, :, lines], force[:, :, lines]
            out = result[i, :, lines]
            _row(out, part, motion[i, :, lines], right, own.get(i), places, scratch)

    each(fill, range(n), result.nbytes)
    return result.transpose(2, 0, 1)


def _row(
    out: FloatArray,
    part: FloatArray,
    left: FloatArray,
    right: FloatArray,
    own: int | None,
    places: tuple[list[tuple[slice, slice]], list[int], list[int]],
    scratch: FloatArray,
) -> None:
    """Write one response of `_carried` over some lines."""
    columns, at_rows, at_columns = places
    scratch = scratch[:, : out.shape[1]]
    for number, column in enumerate(at_columns):
        gain = sum((left[c] * part[row, column] for c, row in enumerate(at_rows)), start=0.0)
        if own is not None:
            gain = gain + part[own, column]
        target = scratch if number else out
        np.multiply(right[number], gain, out=target)
        if number:
            out += scratch
    if not at_columns:
        out[:] = 0.0
    for place, run in columns:
        if own is not None:
            out[place] += part[own, run]
        for c, row in enumerate(at_rows):
            out[place] += np.multiply(part[row, run], left[c], out=scratch[place])


def _gains(
    known: Sequence[str], label: str, interface: Sequence[str], at_joints: ComplexArray
) -> ComplexArray:
    gains = np.zeros((len(at_joints), len(known)), dtype=complex)
    if label in known and label not in interface:
        gains[:, known.index(label)] = 1.0
    for c, joint in enumerate(interface):
        gains[:, known.index(joint)] = at_joints[:, c]
    return gains


Roots = tuple[FloatArray, FloatArray, ComplexArray]


def _roots(errors: Scatter) -> Roots:
    """Return the standard deviations along and across the errors' main direction, and that."""
    pseudo = np.zeros(errors.variance.shape, complex) if errors.pseudo is None else errors.pseudo
    size = np.minimum(np.abs(pseudo), errors.variance)
    direction = np.exp(0.5j * np.angle(pseudo))
    along = np.sqrt((errors.variance + size) / 2)
    across = np.sqrt((errors.variance - size) / 2)
    return along, across, direction


def _draw(roots: Roots, generator: np.random.Generator) -> ComplexArray:
    along, across, direction = roots
    first, second = (generator.standard_normal(along.shape) for _ in range(2))
    return np.asarray((along * first + 1j * across * second) * direction)
