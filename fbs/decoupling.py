"""Decoupling: a part's FRFs from those of an assembly and of what else is in it.

The unknown part is the assembly with the known one taken away, a substructure of negative sign. In
the dual form (D'Ambrogio & Fregolent 2014, Mech. Syst. Signal Process. 45, 351; Voormeeren & Rixen
2012, ibid. 27, 56), with the rows c where motions are made equal and the columns e where the forces
that take the known part away act,

    Y_A = Y − Y_·e D⁺ Y_c·,    D = Y_ce − Y^B_ce

Y that of the assembly, Y^B of the known part. With the interface b, and DoFs i inside the known
part that were measured in the assembly too:

==========  =============  =============  ==================================================
form        c              e              D⁺
==========  =============  =============  ==================================================
standard    b              b              the inverse
mixed       b and i        b              least squares
extended    b and i        b and i        of the rank of b: no force acts inside the known part
==========  =============  =============  ==================================================

**What is left of the digits.** With L = [1, −Y_·e D⁺ at c] and R = [1; −D⁺ Y_c· at e],

    δY_A = L δY R − (Y_·e D⁺) δY^B (D⁺ Y_c·)

to first order, so that errors of the measured FRFs have their bounds and spreads line by line. At
the interface D = −Y^B (Y^A + Y^B)⁻¹ Y^B: digits are lost where it is nearly singular, at the poles
of the unknown part, and at those of the known part with the interface held, where Y^B vanishes.
Even trivial examples have such spikes.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ._kernels import batched
from ._kernels.checks import ComplexArray, FloatArray, positions, read_only, unique_labels
from ._kernels.door import door
from .axes import require_same_frequency
from .errors import FbsError, QuantityMismatchError, SingularLineError
from .frf import Frf
from .second_order_system import SecondOrderSystem

EPS = float(np.finfo(float).eps)
ROUNDED = 1e-12
"""Of √(a_ii a_jj): what sums of a few dozen elements leave of an entry that cancels."""
NO_INTERFACE = "decoupling needs at least one interface DoF"
Form = Literal["standard", "mixed", "extended"]


@dataclass(frozen=True, eq=False)
class DecoupledFrf:
    """What `decouple` returns.

    Attributes
    ----------
    frf
        Of the unknown part.
    kernel_condition
        (nf,) How many times larger a relative error of the FRFs is in the interface forces.
    dropped
        (nf,) Largest singular value of D left out, over the largest; 0 where none is. Of the
        extended form: how far the two sets of FRFs contradict one another.
    """

    frf: Frf
    kernel_condition: FloatArray
    dropped: FloatArray
    _assembly: ComplexArray  # |Y| and |Y^B| of what the result is made from, with L, R, F, G
    _known: ComplexArray
    _left: ComplexArray
    _right: ComplexArray
    _forces: tuple[ComplexArray, ComplexArray]

    def spread(self, assembly: float, known: float | None = None) -> FloatArray:
        """Standard deviation of every FRF (nf, n_response, n_excitation), to first order.

        Parameters
        ----------
        assembly, known
            Relative standard deviation of each measured complex FRF value, independent of the
            others; of the known part's the same if not given.
        """
        known = assembly if known is None else known
        return np.asarray(np.sqrt(self._moment(2, assembly, known)))

    def bound(self, relative: float = EPS) -> FloatArray:
        """What a relative error of every FRF value can do at most, to first order; default eps."""
        return self._moment(1, relative, relative)

    def digits_left(self, relative: float = EPS) -> FloatArray:
        """−log₁₀(error/|Y_A|) of every FRF for relative errors of the data; 0 and less: none."""
        with np.errstate(divide="ignore"):
            return np.asarray(-np.log10(self.bound(relative) / np.abs(self.frf.values)))

    def require_stable(self, interface: Iterable[str], relative: float = EPS) -> None:
        """Refuse a part whose static stiffness at the interface is negative: `known` is too stiff.

        A passive part has Z(s) = K - s M - Σ s c_r/(p_r - s) at its interface, s = ω², K and c_r
        positive semi-definite, so that of any two lines

            (s_2 Z_1 - s_1 Z_2)/(s_2 - s_1) = K + Σ c_r s_1 s_2/((p_r - s_1)(p_r - s_2))

        has no negative eigenvalue unless a pole lies between them. Refused is what has one for
        every pair 1.2 or 1.4 apart in frequency in the first octave, beyond three standard
        deviations; with fewer than three such pairs nothing is.

        Parameters
        ----------
        interface
            Labels of this part.
        relative
            Standard deviation of the data, as in `spread`.

        Raises
        ------
        FbsError
        """
        at = unique_labels(interface, "the interface")
        y = self.frf.band(np.nextafter(0.0, 1.0)).to("receptance").select(at, at)
        rows = positions(at, self.frf.responses, "the part")
        columns = positions(at, self.frf.excitations, "the part")
        size = np.abs(y.omega[:, None, None]) ** self.frf.quantity.derivative
        spread = self.spread(relative)[-y.frequency.size :, rows][:, :, columns] / size
        z, singular = batched.inverse(y.values)
        if singular.any():
            return
        sigma: FloatArray = np.linalg.norm(np.abs(z) @ spread @ np.abs(z), axis=(1, 2))
        least = np.concatenate([_static(y.frequency, z.real, sigma, step) for step in (1.2, 1.4)])
        if least.size < 3 or least.max() >= 0.0:
            return
        raise FbsError(
            f"the known part is stiffer than the assembly at {', '.join(at)}: what is left would "
            f"have a static stiffness of {np.median(least):.3g} N/m or less, by its lines between "
            f"{y.frequency[0]:g} and {2.8 * y.frequency[0]:.3g} Hz"
        )

    def _moment(self, power: int, assembly: float, known: float) -> FloatArray:
        of_assembly = (assembly * np.abs(self._assembly)) ** power
        of_known = (known * np.abs(self._known)) ** power
        left, right = np.abs(self._left) ** power, np.abs(self._right) ** power
        to, fro = (np.abs(part) ** power for part in self._forces)
        return np.asarray(left @ of_assembly @ right + to @ of_known @ fro)


@door
def decouple(
    assembly: Frf,
    known: Frf,
    interface: Iterable[str],
    internal: Iterable[str] = (),
    *,
    form: Form | None = None,
    responses: Iterable[str] | None = None,
    excitations: Iterable[str] | None = None,
    rank: int | None = None,
    tikhonov: float = 0.0,
) -> DecoupledFrf:
    """Take a known part off an assembly: Y_A = Y − Y_·e D⁺ Y_c·; the module has the derivation.

    Parameters
    ----------
    assembly, known
        On the same lines, of the same quantity; a DoF has the same label in both (`Frf.renamed`).
    interface
        Labels at which the parts were joined.
    internal
        Labels inside the known part that both have, for the mixed and the extended form.
    form
        Default: standard without internal labels, else mixed.
    responses, excitations
        Of the unknown part (default: the assembly's, those of the known part left out but for the
        interface).
    rank
        Keep so many singular values of D, fewer than there are interface DoFs (truncated SVD).
    tikhonov
        λ/σ_max of D⁺ = Σ σ/(σ² + λ²) v uᴴ; 0: none.

    Raises
    ------
    SingularLineError
        D has no inverse with a digit on a line.
    FbsError
        An axis, a quantity, a label, the form, the rank or λ does not fit.
    """
    require_same_frequency(
        assembly.frequency, known.frequency, "the axes of assembly and known part differ"
    )
    if assembly.quantity != known.quantity:
        raise QuantityMismatchError(
            f"assembly and known part: {assembly.quantity} against {known.quantity}; convert one "
            "with to"
        )
    interface = unique_labels(interface, "the interface")
    internal = unique_labels(internal, "the internal labels")
    compatible, acting = _rows(interface, internal, form)
    inside = [label for label in known.responses + known.excitations if label not in interface]
    rows = _asked(responses, assembly.responses, inside)
    columns = _asked(excitations, assembly.excitations, inside)
    count = _rank(rank, tikhonov, len(interface))

    difference = _block(assembly, compatible, acting, "assembly") - _block(
        known, compatible, acting, "known part"
    )
    inverse, condition, dropped = _inverse(
        difference, _moduli(assembly, known, compatible, acting), count, tikhonov
    )
    singular = ~(condition <= 1.0 / (10.0 * EPS))
    if singular.any():
        raise SingularLineError(
            assembly.frequency[singular],
            "the difference of assembly and known part at the interface is singular to working "
            "precision",
            "the interface names a motion twice, or the known part is not in the assembly: leave "
            "DoFs out, or ask for fewer by rank",
        )
    to = _block(assembly, rows, acting, "assembly") @ inverse
    fro = inverse @ _block(assembly, compatible, columns, "assembly")
    direct = _block(assembly, rows, columns, "assembly")
    values = direct - to @ _block(assembly, compatible, columns, "assembly")
    left, right = (
        _differences(rows, compatible, to),
        _differences(columns, acting, fro.transpose(0, 2, 1)),
    )
    data = _block(assembly, tuple(left), tuple(right), "assembly")
    return DecoupledFrf(
        Frf(assembly.frequency, values, rows, columns, assembly.quantity),
        read_only(condition),
        read_only(dropped),
        data,
        _block(known, compatible, acting, "known part"),
        np.stack(list(left.values()), axis=2),
        np.stack(list(right.values()), axis=1),
        (to, fro),
    )


def _differences(
    asked: Sequence[str], at: Sequence[str], forces: ComplexArray
) -> dict[str, ComplexArray]:
    """Columns (nf, n_asked) of L = [1, −forces] by label: a DoF at both is one datum, not two."""
    found = {label: np.zeros(forces.shape[:2], dtype=complex) for label in (*asked, *at)}
    for place, label in enumerate(asked):
        found[label][:, place] += 1.0
    for place, label in enumerate(at):
        found[label] -= forces[:, :, place]
    return found


@door
def decouple_primal(assembly: Frf, known: Frf, interface: Iterable[str]) -> Frf:
    """Take a known part off by impedances: Z_A = Z − Z^B, on the labels that stay.

    The inverse of the whole measured matrix is needed: every DoF of the known part must be in the
    assembly's FRFs too, as response and as excitation.

    Raises
    ------
    FbsError
        FRFs that are not square, lines or labels that do not fit.
    SingularLineError
        A matrix has no inverse with a digit on a line.
    """
    interface = unique_labels(interface, "the interface")
    require_same_frequency(
        assembly.frequency, known.frequency, "the axes of assembly and known part differ"
    )
    labels, theirs = _square(assembly, "assembly"), _square(known, "known part")
    place = positions(theirs, labels, "the assembly")
    impedance = _inverted(assembly, labels)
    impedance[np.ix_(range(len(impedance)), place, place)] -= _inverted(known, theirs)
    stay = [k for k, label in enumerate(labels) if label in interface or label not in theirs]
    kept = tuple(labels[k] for k in stay)
    left = Frf(assembly.frequency, impedance[np.ix_(range(len(impedance)), stay, stay)], kept, kept)
    return Frf(assembly.frequency, _inverted(left, kept), kept, kept, assembly.quantity)


@door
def decouple_systems(
    assembly: SecondOrderSystem, known: SecondOrderSystem, interface: Iterable[str]
) -> SecondOrderSystem:
    """Take a known part off by its matrices: M, C, K of the assembly less its own.

    Parameters
    ----------
    assembly, known
        A DoF has the same label in both; every DoF of the known part is one of the assembly.
    interface
        Labels at which the parts were joined: they stay.

    Raises
    ------
    FbsError
        The known part is not in the assembly: something is left at a DoF inside it, or what is
        left at the interface has a negative mass or stiffness.
    """
    interface = unique_labels(interface, "the interface")
    if not interface:
        raise FbsError(NO_INTERFACE)
    positions(interface, known.dofs, "the known part")
    place = positions(known.dofs, assembly.dofs, "the assembly")
    if assembly.loss_factor != known.loss_factor:
        raise FbsError(
            f"loss factors {assembly.loss_factor:g} and {known.loss_factor:g}: matrices with "
            "different ones cannot be subtracted"
        )
    stay = [k for k, d in enumerate(assembly.dofs) if d in interface or d not in known.dofs]
    inside = [k for k in range(len(assembly.dofs)) if k not in stay]
    left = {}
    for name in ("mass", "damping", "stiffness"):
        matrix = np.array(getattr(assembly, name))
        size = np.sqrt(np.abs(np.diag(matrix)))
        allowed = ROUNDED * np.outer(size, size)
        matrix[np.ix_(place, place)] -= getattr(known, name)
        wrong = np.abs(matrix) > allowed
        for k in inside:
            if wrong[k].any() or wrong[:, k].any():
                raise FbsError(
                    f"the known part is not in the assembly: {name} is left at "
                    f"{assembly.dofs[k]!r}, which is inside it"
                )
        left[name] = matrix[np.ix_(stay, stay)]
        _require_positive(left[name], allowed[np.ix_(stay, stay)], name, interface)
    dofs = tuple(assembly.dofs[k] for k in stay)
    derived = {label: tie for label, tie in assembly.derived.items() if tie[0] in dofs}
    return SecondOrderSystem(
        left["mass"], left["damping"], left["stiffness"], dofs, derived, assembly.loss_factor
    )


def _require_positive(
    matrix: FloatArray, allowed: FloatArray, name: str, interface: Sequence[str]
) -> None:
    least = float(np.linalg.eigvalsh((matrix + matrix.T) / 2.0)[0])
    if least < -float(np.linalg.norm(allowed)):
        more = {"mass": "heavier", "damping": "more damped", "stiffness": "stiffer"}[name]
        raise FbsError(
            f"the known part is {more} than the assembly at {', '.join(interface)}: what is left "
            f"has a {name} of {least:.3g}"
        )


def _static(axis: FloatArray, z: FloatArray, sigma: FloatArray, step: float) -> FloatArray:
    """Upper end of the least eigenvalue of (s_2 Z_1 - s_1 Z_2)/(s_2 - s_1), of every pair."""
    first = np.flatnonzero((axis <= 2.0 * axis[0]) & (step * axis <= axis[-1]))
    second = np.searchsorted(axis, step * axis[first])
    s_1, s_2 = axis[first] ** 2, axis[second] ** 2
    one, two = s_2 / (s_2 - s_1), s_1 / (s_2 - s_1)
    static = one[:, None, None] * z[first] - two[:, None, None] * z[second]
    error = np.hypot(one * sigma[first], two * sigma[second])
    least = np.linalg.eigvalsh((static + static.transpose(0, 2, 1)) / 2.0)[:, 0]
    return np.asarray(least + 3.0 * error)


def _rows(
    interface: tuple[str, ...], internal: tuple[str, ...], form: Form | None
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Labels of compatibility and of equilibrium."""
    if not interface:
        raise FbsError(NO_INTERFACE)
    if form is None:
        form = "mixed" if internal else "standard"
    if (form == "standard") == bool(internal):
        raise FbsError(
            f"form = {form!r} with {len(internal)} internal labels: the standard form takes none, "
            "the others need some"
        )
    both = (*interface, *internal)
    return (both if form != "standard" else interface, both if form == "extended" else interface)


def _asked(
    given: Iterable[str] | None, measured: Sequence[str], inside: Sequence[str]
) -> tuple[str, ...]:
    if given is not None:
        return unique_labels(given, "the labels asked for")
    return tuple(label for label in measured if label not in inside)


def _rank(rank: int | None, tikhonov: float, most: int) -> int:
    if not (np.isfinite(tikhonov) and tikhonov >= 0.0):
        raise FbsError(f"tikhonov = {tikhonov}: must be a finite number, 0 or more")
    if rank is not None and not 1 <= rank <= most:
        raise FbsError(f"rank = {rank}: must be between 1 and {most}, the interface's DoFs")
    return most if rank is None else rank


def _block(frf: Frf, rows: Sequence[str], columns: Sequence[str], whose: str) -> ComplexArray:
    i = positions(rows, frf.responses, f"the {whose}'s responses")
    j = positions(columns, frf.excitations, f"the {whose}'s excitations")
    return np.ascontiguousarray(frf.values[:, i][:, :, j])


def _moduli(assembly: Frf, known: Frf, rows: Sequence[str], columns: Sequence[str]) -> FloatArray:
    """|Y_ce| + |Y^B_ce|: what D is made of."""
    return np.asarray(
        np.abs(_block(assembly, rows, columns, "assembly"))
        + np.abs(_block(known, rows, columns, "known part"))
    )


def _inverse(
    difference: ComplexArray, moduli: FloatArray, count: int, tikhonov: float
) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """D⁺, ‖|Y| + |Y^B|‖ ‖D⁺‖ and the largest singular value left out over the largest."""
    u, sigma, v = np.linalg.svd(difference, full_matrices=False)
    kept = sigma[:, :count]
    with np.errstate(divide="ignore", invalid="ignore"):
        weights = kept / (kept**2 + (tikhonov * sigma[:, :1]) ** 2)
        inverse = np.einsum("kre,kr,kcr->kec", v[:, :count].conj(), weights, u[:, :, :count].conj())
        condition = np.linalg.norm(moduli, axis=(1, 2)) * weights.max(axis=1)
        dropped = sigma[:, count] / sigma[:, 0] if count < sigma.shape[1] else 0.0 * sigma[:, 0]
    return np.nan_to_num(inverse), condition, dropped


def _square(frf: Frf, whose: str) -> tuple[str, ...]:
    if set(frf.responses) != set(frf.excitations):
        raise FbsError(
            f"the {whose}'s responses and excitations differ: its impedance needs a square matrix"
        )
    return frf.responses


def _inverted(frf: Frf, labels: tuple[str, ...]) -> ComplexArray:
    square = frf.select(labels, labels).values
    inverse, singular = batched.inverse(square)
    size = np.sqrt(np.abs(np.einsum("kii->ki", square)))
    scaled = np.abs(inverse) * size[:, :, None] * size[:, None, :]
    singular |= ~(scaled.max(axis=(1, 2)) <= 1.0 / (10.0 * len(labels) * EPS))
    if singular.any():
        raise SingularLineError(
            frf.frequency[singular],
            "the FRF matrix has no inverse with a digit left",
            "leave DoFs out that move alike, or use decouple, which inverts at the interface alone",
        )
    return inverse
