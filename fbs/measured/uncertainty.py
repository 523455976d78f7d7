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

from .._assembly import COLUMNS, add_up, runs
from .._kernels.blocks import each
from .._kernels.checks import ComplexArray, FloatArray
from ..coupling import Interface, couple, coupled
from ..errors import FbsError, UnknownDofError
from ..frf import Frf, require_same_layout
from ..joints import AnyJoint


@dataclass(frozen=True, eq=False)
class Scatter:
    """Errors of FRFs, independent of each other.

    Parameters
    ----------
    variance : array, shape (nf, n_response, n_excitation)
        E |dH|².
    pseudo : complex array of that shape, or None
        E dH²; None is 0: the error is alike in all directions of the complex plane.
    degrees : float
        Degrees of freedom the variance was estimated with: what it divides has Student's t
        distribution. Infinite where it is known.
    """

    variance: FloatArray
    pseudo: ComplexArray | None = None
    degrees: float = np.inf

    def select(self, responses: Sequence[int], excitations: Sequence[int]) -> Scatter:
        """Return the errors of some FRFs, by their numbers."""
        lines = range(len(self.variance))
        at = np.ix_(lines, responses, excitations)
        pseudo = None if self.pseudo is None else self.pseudo[at]
        return Scatter(self.variance[at], pseudo, self.degrees)

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
        variance = np.abs(frf.values) ** 2 * (1 - known) / (known * degrees)
        return cls(variance, degrees=2 * degrees)  # real and imaginary parts alike

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
        return cls(np.asarray(variance), np.asarray(pseudo), n - 1)


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

        That of errors alike in all directions, √(−ln(1 − level) E |dY|²), or by the quantile of
        F(2, ν) where the variance was estimated with ν degrees of freedom.
        """
        if not 0 < level < 1:
            raise FbsError(f"the level is {level}; must be between 0 and 1")
        quantile, degrees = -np.log1p(-level), self.errors.degrees
        if np.isfinite(degrees):
            quantile = degrees / 2 * np.expm1(2 / degrees * quantile)
        return np.asarray(np.sqrt(quantile * self.variance))

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
    _require_fitting(substructures, part, errors)
    frf = substructures[part]
    result, known = coupled(substructures, joints, responses, excitations)
    places = _Places.of(known, part)
    motion = _at_joints(known, places, "responses")
    force = _at_joints(known, places, "excitations")
    variance = _carried(errors.variance, places, _squared(motion), _squared(force))
    return UncertainFrf(
        result.frf,
        variance,
        force.transpose(2, 0, 1),
        motion.transpose(2, 1, 0),
        places.labels(frf),
        frf,
        errors,
    )


def sampled(
    substructures: Mapping[str, Frf],
    joints: Sequence[AnyJoint],
    errors: Mapping[str, Scatter],
    count: int,
    seed: int = 0,
    responses: Iterable[str] | None = None,
    excitations: Iterable[str] | None = None,
) -> Iterator[Frf]:
    """Couple again and again with errors drawn from normal distributions, or Student's t.

    Parameters
    ----------
    substructures, joints, responses, excitations
        As for `couple`.
    errors : mapping of str to Scatter
        Of the substructures that were measured; Student's t where their degrees are finite.
    count : int
        How often.
    seed : int
        Of the random numbers.

    Raises
    ------
    UnknownDofError, FbsError
        As for `coupled_uncertainty`.
    """
    generator = np.random.default_rng(seed)
    wanted = None if responses is None else tuple(responses)
    driven = None if excitations is None else tuple(excitations)
    for part, scatter in errors.items():
        _require_fitting(substructures, part, scatter)
    roots = {part: _roots(scatter) for part, scatter in errors.items()}
    for _ in range(count):
        changed = dict(substructures)
        for part, scatter in errors.items():
            error = _draw(roots[part], generator)
            if np.isfinite(scatter.degrees):
                size = generator.chisquare(scatter.degrees, error.shape)
                error = error * np.sqrt(scatter.degrees / size)
            changed[part] = replace(changed[part], values=changed[part].values + error)
        yield couple(changed, joints, wanted, driven).frf


# --- parts -------------------------------------------------------------------------------------


def _require_fitting(substructures: Mapping[str, Frf], part: str, errors: Scatter) -> None:
    if part not in substructures:
        raise UnknownDofError(f"there is no substructure {part!r}, only {', '.join(substructures)}")
    values = substructures[part].values
    if errors.variance.shape != values.shape:
        raise FbsError(
            f"the errors have shape {errors.variance.shape}, the FRFs of {part!r} {values.shape}"
        )


@dataclass(frozen=True, eq=False)
class _Places:
    """Where the part's DoFs stand.

    at_rows, at_columns : those of the joints, in the part
    rows[i], columns[j] : (substructure, its number) of response i and excitation j
    """

    part: str
    at_rows: tuple[int, ...]
    at_columns: tuple[int, ...]
    rows: tuple[tuple[str, int], ...]
    columns: tuple[tuple[str, int], ...]

    @classmethod
    def of(cls, known: Interface, part: str) -> _Places:
        ends = {end.response: end.excitation for end in known.ends[part]}
        columns = [("", 0)] * len(known.layout.excitations)
        for name, run in ((n, r) for n, found in known.layout.columns.items() for r in found):
            if run.own is not None:
                for number in range(run.own.stop - run.own.start):
                    columns[run.place.start + number] = (name, run.own.start + number)
        rows = known.layout.rows
        return cls(part, tuple(ends), tuple(ends.values()), rows, tuple(columns))

    def labels(self, frf: Frf) -> tuple[str, ...]:
        return tuple(frf.responses[row] for row in self.at_rows)

    def own(self, side: str) -> list[tuple[str, int]]:
        """Return the places of a side, those of the joints' DoFs of the part as nobody's."""
        places, at = self.side(side)
        joined = {(self.part, number) for number in at}
        return [("", 0) if place in joined else place for place in places]

    def side(self, side: str) -> tuple[tuple[tuple[str, int], ...], tuple[int, ...]]:
        return (self.rows, self.at_rows) if side == "responses" else (self.columns, self.at_columns)


def _at_joints(known: Interface, places: _Places, side: str) -> ComplexArray:
    """Return R at the joints' DoFs of the part (side "excitations"), or L ("responses").

    R_cj = δ_cj − Σ_ab s_a s_b G_ab Y_bj, a the ends of the joints at c, b those in j's own part.

    Returns
    -------
    array, shape (n_joint, n_excitation, nf) or (n_joint, n_response, nf)
        Known to eps |Y| / |Y_c|, as Y_c is: what the joints hold fast loses digits in the
        difference.
    """
    driven = side == "excitations"
    inverse = known.inverse if driven else known.inverse.transpose(1, 0, 2)
    frfs = {n: y if driven else y.transpose(1, 0, 2) for n, y in known.frfs.items()}
    numbers, at = places.side(side)
    gains = np.zeros((len(at), len(numbers), known.inverse.shape[2]), dtype=complex)
    for c, (row, joint) in enumerate(zip(places.at_rows, at, strict=True)):
        here = [end for end in known.ends[places.part] if end.response == row]
        for name, ends in known.ends.items():
            for b in ends:
                factor = -b.sign * sum(a.sign * inverse[a.joint, b.joint] for a in here)
                own = frfs[name][b.response if driven else b.excitation]
                for place, (owner, number) in enumerate(numbers):
                    if owner == name:
                        gains[c, place] += factor * own[number]
        for place in (p for p, n in enumerate(numbers) if n == (places.part, joint)):
            gains[c, place] += 1.0
    return gains


def _squared(gain: ComplexArray) -> FloatArray:
    return np.asarray(gain.real**2 + gain.imag**2)


def _carried(e: FloatArray, places: _Places, left: FloatArray, right: FloatArray) -> FloatArray:
    """Return Σ_kl L²_ik e_kl R²_lj: L² = `left` and R² = `right` at joints, else the identity.

    V_kj = [j in A] e_kj + Σ_c e_kc R²_cj,   result_ij = [i in A] V_ij + Σ_c L²_ic V_cj
    """
    e = e.transpose(1, 2, 0)
    nf = e.shape[2]
    result = np.empty((left.shape[1], right.shape[1], nf))
    at_joints = np.empty((len(left), *result.shape[1:]))
    columns = runs(places.part, places.own("excitations"))
    step = max(1, COLUMNS // (8 * nf))

    def write(out: FloatArray, row: int | None, terms: list[tuple[FloatArray, FloatArray]]) -> None:
        """Write V of a row of the part, and terms on top."""
        if row is not None:
            terms = [*terms, *((right[c], e[row, k]) for c, k in enumerate(places.at_columns))]
        scratch = np.empty((min(step, len(out)), nf))
        for run in (piece for whole in columns for piece in whole.pieces(step)):
            here, own = run
            base = None if row is None or own is None else e[row, own]
            add_up(
                out[here], base, [(v[here], gain) for v, gain in terms], scratch[: len(out[here])]
            )

    def fill(i: int) -> None:
        owner, number = rows[i]
        terms = [(v, left[c, i]) for c, v in enumerate(at_joints)]
        write(result[i], number if owner == places.part else None, terms)

    rows = places.own("responses")
    for c, row in enumerate(places.at_rows):
        write(at_joints[c], row, [])
    each(fill, range(len(result)), result.nbytes)
    return result.transpose(2, 0, 1)


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
