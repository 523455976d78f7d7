"""Frequency response functions with named degrees of freedom."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from ._kernels.checks import (
    ComplexArray,
    FloatArray,
    ascending_frequency,
    frozen,
    numbers,
    positions,
    require_type,
    sealed,
    unique_labels,
)
from ._kernels.door import door
from ._kernels.elimination import EPS, Enclosure
from ._kernels.finite import surely_finite
from ._representation import html_table, listing, spanned
from .axes import require_same_frequency
from .errors import (
    AxisMismatchError,
    FbsError,
    NonFiniteError,
    QuantityMismatchError,
    unknown_dof,
)

if TYPE_CHECKING:
    from .plotting import Axes, Panels


class Quantity(StrEnum):
    """What is divided by force: displacement, velocity or acceleration."""

    RECEPTANCE = "receptance"
    MOBILITY = "mobility"
    ACCELERANCE = "accelerance"

    @property
    def derivative(self) -> int:
        """Number of time derivatives of displacement: 0, 1 or 2."""
        return tuple(Quantity).index(self)

    @property
    def unit(self) -> str:
        """m/N, m/(N s) or m/(N s²)."""
        return ("m/N", "m/(N s)", "m/(N s²)")[self.derivative]

    @property
    def motion(self) -> str:
        """What is measured, and its unit: displacement, m, and so on."""
        return ("displacement, m", "velocity, m/s", "acceleration, m/s²")[self.derivative]


def as_quantity(quantity: Quantity | str) -> Quantity:
    """Return the `Quantity` of that name.

    Raises
    ------
    QuantityMismatchError
        There is none.
    """
    try:
        return Quantity(quantity)
    except (ValueError, TypeError):
        allowed = ", ".join(Quantity)
        raise QuantityMismatchError(f"quantity {quantity!r} is none of {allowed}") from None


class Origin(Protocol):
    """How an FRF came about: what can compute it again, and bound its error."""

    def enclose(self, frf: Frf) -> Enclosure:
        """Return an FRF's values again, (nf, n_response, n_excitation), by arithmetic with a bound.

        Of its lines and labels, which may be some of those it was made with.
        """

    @door
    def renamed(self, names: Mapping[str, str]) -> Origin:
        """Return the origin of the FRF with labels replaced: {old: new}."""


@dataclass(frozen=True, eq=False)
class Frf:
    """H[k, i, j] = response i / force at excitation j, at frequency[k], for e^{+jwt}.

    Parameters
    ----------
    frequency : array, shape (nf,), Hz
        Strictly ascending, >= 0.
    values : complex array, shape (nf, n_response, n_excitation)
        m/N, m/(N s) or m/(N s^2), as `quantity` says. Any memory order is kept;
        frequency-contiguous is the fast one. Copied, unless nobody can write to it any more
        (an array made read-only with `setflags`).
    responses, excitations : tuple of str
        Labels of the degrees of freedom.
    quantity : Quantity

    Raises
    ------
    FbsError, NonFiniteError, AmbiguousDofError, QuantityMismatchError
    """

    frequency: FloatArray
    values: ComplexArray
    responses: tuple[str, ...]
    excitations: tuple[str, ...]
    quantity: Quantity = Quantity.RECEPTANCE
    _origin: Origin | None = field(default=None, init=False)

    if TYPE_CHECKING:  # what `__post_init__` converts, said to type checkers

        def __init__(
            self,
            frequency: ArrayLike,
            values: ArrayLike,
            responses: Iterable[str],
            excitations: Iterable[str],
            quantity: Quantity | str = Quantity.RECEPTANCE,
        ) -> None: ...

    __array_ufunc__ = None  # so that numpy_scalar * frf comes to __rmul__

    def __post_init__(self) -> None:
        self._settle()
        _refuse_non_finite(self.frequency, self.values, self.responses, self.excitations)

    def __reduce__(self) -> tuple[Any, ...]:  # what comes out of a pickle is checked like the rest
        return _traced_frf, (self._origin, *self._given)

    @property
    def _given(self) -> tuple[Any, ...]:
        return self.frequency, self.values, self.responses, self.excitations, self.quantity

    def _settle(self) -> None:
        """Check and freeze everything, but do not read the values."""
        axis = ascending_frequency(self.frequency)
        values = frozen(numbers(self.values, "the FRF's values", complex))
        responses = unique_labels(self.responses, "the responses")
        excitations = unique_labels(self.excitations, "the excitations")
        expected = (axis.size, len(responses), len(excitations))
        if values.shape != expected:
            raise FbsError(
                f"FRF values have shape {values.shape}; {expected[0]} lines, {expected[1]} "
                f"responses and {expected[2]} excitations need {expected}"
            )
        settled = (axis, values, responses, excitations, as_quantity(self.quantity))
        for name, value in zip(self.__match_args__, settled, strict=True):
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        size = f"{len(self.responses)} × {len(self.excitations)}"
        return f"<Frf: {self.quantity}, {size}, {spanned(self.frequency)}>"

    def _repr_html_(self) -> str:
        rows = (
            ("lines", spanned(self.frequency)),
            ("responses", listing(self.responses)),
            ("excitations", listing(self.excitations)),
        )
        return html_table(f"Frf: {self.quantity}, {self.quantity.unit}", rows)

    @property
    def omega(self) -> FloatArray:
        """Angular frequency, rad/s."""
        return 2 * np.pi * self.frequency

    @cached_property
    def round_off(self) -> FloatArray:
        """Bound of |H - H_exact|, shape (nf, n_response, n_excitation); computed when asked for.

        H_exact is what exact arithmetic makes of the matrices, or FRFs, that the FRF was computed
        from, each entry of which may be off by its last digit. The FRF is computed again in a way
        that bounds its own error (see `eliminate`), from the parts' bounds if it is coupled:

            round_off = |H - H_again| + bound of |H_again - H_exact|.

        It is infinite where there is no bound: the line cannot be told from one where no finite
        FRF exists. An FRF given as an array is taken at its word, to its last digit: eps |H|.
        Truncation and measurement are not round-off and have no part in it.
        """
        if self._origin is None:
            return sealed(np.asarray(EPS * np.abs(self.values)))
        values, bound = self._origin.enclose(self)
        with np.errstate(invalid="ignore"):
            total = (np.abs(self.values - values) + bound) * (1 + 4 * EPS)
        total[np.isnan(total)] = np.inf
        return sealed(total)

    @door
    def select(
        self, responses: Iterable[str] | None = None, excitations: Iterable[str] | None = None
    ) -> Frf:
        """Return the part between the given labels, in the given order (None: all)."""
        rows = self.responses if responses is None else tuple(responses)
        columns = self.excitations if excitations is None else tuple(excitations)
        i = positions(rows, self.responses, "the FRF's responses")
        j = positions(columns, self.excitations, "the FRF's excitations")
        # gathered with frequency last, so that the copy is frequency-contiguous
        part = self.values.transpose(1, 2, 0)[np.ix_(i, j)].transpose(2, 0, 1)
        return self._made(True, self._origin, values=part, responses=rows, excitations=columns)

    def _made(self, finite: bool, origin: Origin | None, **changes: Any) -> Frf:
        """Return the FRF with some things in other ones' place, the values handed over."""
        given = {name: changes.get(name, getattr(self, name)) for name in _GIVEN}
        return computed_frf(**given, finite=finite, origin=origin)

    def at_lines(self, frequency: FloatArray) -> Frf:
        """Return some of the lines; all of `frequency` must be lines of this FRF."""
        if frequency is self.frequency or np.array_equal(frequency, self.frequency):
            return self
        values = self.values[np.searchsorted(self.frequency, frequency)]
        return self._made(True, self._origin, frequency=frequency, values=values)

    @door
    def between(self, response: str, excitation: str) -> ComplexArray:
        """Return H[:, response, excitation], shape (nf,)."""
        i = positions([response], self.responses, "the FRF's responses")[0]
        j = positions([excitation], self.excitations, "the FRF's excitations")[0]
        return self.values[:, i, j]

    @door
    def to(self, quantity: Quantity | str) -> Frf:
        """Return the same FRF as another quantity: H (jw)^n, n derivatives further.

        Raises
        ------
        QuantityMismatchError
            Integrating (n < 0) is not possible at 0 Hz.
        """
        target = as_quantity(quantity)
        order = target.derivative - self.quantity.derivative
        if order == 0:
            return self
        if order < 0 and self.frequency[0] == 0:
            raise QuantityMismatchError(
                f"{self.quantity} cannot become {target} at 0 Hz (a division by zero); "
                "leave that line out, e.g. with band"
            )
        factor = (1j * self.omega) ** order
        values = self.values * factor[:, None, None]
        return self._made(False, self._origin, values=values, quantity=target)

    def magnitude_db(self) -> FloatArray:
        """Return 20 log10 |H|, dB re 1 unit; -inf where H is zero."""
        with np.errstate(divide="ignore"):
            decibel: FloatArray = 20 * np.log10(np.abs(self.values))
        return decibel

    def curves(self) -> Iterator[tuple[str, str, ComplexArray]]:
        """Response, excitation and H (nf,) of every FRF, all excitations of a response first."""
        for i, response in enumerate(self.responses):
            for j, excitation in enumerate(self.excitations):
                yield response, excitation, self.values[:, i, j]

    def plot(self, axes: Sequence[Axes] | None = None) -> Panels:
        """Draw |H| and the phase over frequency; matplotlib is imported for it.

        Parameters
        ----------
        axes : two matplotlib Axes, optional
            For magnitude and phase, as another FRF's `plot` returned them; default: a new figure.

        Returns
        -------
        tuple of two matplotlib Axes

        Raises
        ------
        FbsError
            Other than two axes are given.
        """
        from .plotting import magnitude_and_phase

        ordinate = f"{self.quantity}, {self.quantity.unit}"
        named = ((f"{response} ← {excitation}", h) for response, excitation, h in self.curves())
        return magnitude_and_phase(self.frequency, named, ordinate, axes)

    def renamed(self, names: Mapping[str, str]) -> Frf:
        """Return the same FRF with labels replaced: {old: new}."""
        require_type(names, Mapping, "the names")
        known = tuple(dict.fromkeys(self.responses + self.excitations))
        for label in names:
            if label not in known:
                raise unknown_dof(label, known, "the FRF")
        return self._made(
            True,
            self._origin.renamed(names) if self._origin else None,
            responses=tuple(names.get(label, label) for label in self.responses),
            excitations=tuple(names.get(label, label) for label in self.excitations),
        )

    @door
    def band(self, fmin: float = 0.0, fmax: float = np.inf) -> Frf:
        """Return the lines fmin <= f <= fmax (Hz)."""
        first = int(np.searchsorted(self.frequency, fmin, side="left"))
        last = int(np.searchsorted(self.frequency, fmax, side="right"))
        if first >= last:
            raise FbsError(
                f"no line between {fmin:.10g} and {fmax:.10g} Hz; the axis runs from "
                f"{self.frequency[0]:.10g} to {self.frequency[-1]:.10g} Hz"
            )
        return self._made(
            True,
            self._origin,
            frequency=self.frequency[first:last],
            values=self.values[first:last],
        )

    def __add__(self, other: Frf) -> Frf:
        if not isinstance(other, Frf):
            return NotImplemented
        return _combined((1.0, self), (1.0, other))

    def __sub__(self, other: Frf) -> Frf:
        if not isinstance(other, Frf):
            return NotImplemented
        return _combined((1.0, self), (-1.0, other))

    def __neg__(self) -> Frf:
        return _combined((-1.0, self))

    def __mul__(self, factor: complex) -> Frf:
        if not np.isscalar(factor) or isinstance(factor, (str, bytes)):
            return NotImplemented
        return _combined((complex(factor), self))

    __rmul__ = __mul__


_GIVEN = ("frequency", "values", "responses", "excitations", "quantity")


@dataclass(frozen=True, eq=False)
class _Combination:
    """The origin of a sum of FRFs with factors."""

    terms: tuple[tuple[complex, Frf], ...]

    def enclose(self, frf: Frf) -> Enclosure:
        values = np.zeros(frf.values.shape, dtype=complex)
        bound = np.zeros(frf.values.shape)
        for factor, term in self.terms:
            part = term.select(frf.responses, frf.excitations).at_lines(frf.frequency)
            part = part.to(frf.quantity)
            values += factor * part.values
            bound += abs(factor) * (part.round_off + 8 * EPS * np.abs(part.values))
        return Enclosure(values, bound)

    def renamed(self, names: Mapping[str, str]) -> _Combination:
        def own(term: Frf) -> dict[str, str]:
            known = term.responses + term.excitations
            return {old: new for old, new in names.items() if old in known}

        return _Combination(tuple((factor, term.renamed(own(term))) for factor, term in self.terms))


def _combined(*terms: tuple[complex, Frf]) -> Frf:
    (factor, first), *others = terms
    for _, other in others:
        require_same_layout(first, other)
    values = first.values if factor == 1 else -first.values if factor == -1 else None
    values = first.values * factor if values is None else values
    for factor, other in others:
        values = values + other.values if factor == 1 else values - other.values
    return first._made(False, _Combination(terms), values=values)


def require_same_layout(first: Frf, second: Frf) -> None:
    """Refuse two FRFs of different quantity, axis or labels, naming the first difference.

    Raises
    ------
    QuantityMismatchError, AxisMismatchError
    """
    if first.quantity != second.quantity:
        raise QuantityMismatchError(f"{first.quantity} against {second.quantity}; convert with to")
    require_same_frequency(first.frequency, second.frequency, "the frequency axes differ")
    for what in ("responses", "excitations"):
        one, other = getattr(first, what), getattr(second, what)
        if len(one) != len(other):
            raise AxisMismatchError(f"{len(one)} {what} against {len(other)}")
        for position, (a, b) in enumerate(zip(one, other, strict=True)):
            if a != b:
                raise AxisMismatchError(f"the {what} differ at {position}: {a!r} against {b!r}")


def computed_frf(
    frequency: FloatArray,
    values: ComplexArray,
    responses: tuple[str, ...],
    excitations: tuple[str, ...],
    quantity: Quantity = Quantity.RECEPTANCE,
    finite: bool = False,
    origin: Origin | None = None,
) -> Frf:
    """Return an Frf of values just made, which are handed over: they are not copied.

    Nor are they read again if their maker has found them `finite`: to read the result once more
    from memory takes half as long as to write it, and whoever computes it sums up the squares of
    each block while that is in the cache.
    """
    frf: Frf = object.__new__(Frf)
    given = (frequency, sealed(values), responses, excitations, quantity)
    for name, value in zip((*_GIVEN, "_origin"), (*given, origin), strict=True):
        object.__setattr__(frf, name, value)
    frf._settle()
    if not finite:
        _refuse_non_finite(frf.frequency, frf.values, frf.responses, frf.excitations)
    return frf


def _traced_frf(origin: Origin | None, *given: Any) -> Frf:
    frf = Frf(*given)
    object.__setattr__(frf, "_origin", origin)
    return frf


def _surely_finite(values: ComplexArray) -> bool:
    """One pass without a mask, in the order of the memory where that has no gaps."""
    for memory in (values, values.transpose(1, 2, 0)):
        if memory.flags.c_contiguous:
            return surely_finite(memory)
    return bool(np.isfinite(values.sum()))


def _refuse_non_finite(
    axis: FloatArray, values: ComplexArray, responses: tuple[str, ...], excitations: tuple[str, ...]
) -> None:
    if _surely_finite(values):
        return
    wrong = np.argwhere(~np.isfinite(values))
    if wrong.size:
        k, i, j = wrong[0]
        raise NonFiniteError(
            f"the FRF from {excitations[j]!r} to {responses[i]!r} is {values[k, i, j]} "
            f"at {axis[k]:.10g} Hz ({len(wrong)} values in all)"
        )
