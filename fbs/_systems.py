"""What second-order systems share, however their matrices are stored, and what is asked of them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._kernels.checks import (
    ComplexArray,
    FloatArray,
    ascending_frequency,
    named,
    positions,
    scalar,
    unique_labels,
)
from ._kernels.door import door
from ._representation import counted, html_table, listing
from .errors import FbsError, unknown_dof
from .frf import Frf, Origin, Quantity, as_quantity, computed_frf


@dataclass(frozen=True, eq=False, repr=False)
class LabelledSystem(ABC):
    """M x'' + C x' + K (1 + j eta) x = f with labelled coordinates; see `SecondOrderSystem`."""

    mass: Any
    damping: Any
    stiffness: Any
    dofs: tuple[str, ...]
    derived: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    loss_factor: float = 0.0

    def __post_init__(self) -> None:
        dofs = unique_labels(self.dofs, "the dofs")
        if not dofs:
            raise FbsError("a system needs at least one degree of freedom")
        for name in ("mass", "damping", "stiffness"):
            object.__setattr__(self, name, self._matrix(getattr(self, name), len(dofs), name))
        object.__setattr__(self, "dofs", dofs)
        object.__setattr__(self, "derived", MappingProxyType(_derived(self.derived, dofs)))
        object.__setattr__(self, "loss_factor", scalar(self.loss_factor, "the loss factor", 0.0))
        unique_labels(self.labels, "dofs and derived labels")

    def __reduce__(self) -> tuple[type[Self], tuple[Any, ...]]:
        # a mapping proxy cannot be pickled, and systems travel between processes
        return type(self), (
            self.mass,
            self.damping,
            self.stiffness,
            self.dofs,
            dict(self.derived),
            self.loss_factor,
        )

    def __repr__(self) -> str:
        also = f", {counted(len(self.derived), 'derived label')}" if self.derived else ""
        size = counted(len(self.dofs), "DoF")
        return f"<{type(self).__name__}: {size}{also}, {self._damping_kind}>"

    def _repr_html_(self) -> str:
        rows = [("DoFs", listing(self.dofs)), ("damping", self._damping_kind)]
        if self.derived:
            ties = [f"{label} = {f:g} {dof}" for label, (dof, f) in self.derived.items()]
            rows.insert(1, ("derived", listing(ties)))
        return html_table(f"{type(self).__name__}: {counted(len(self.dofs), 'DoF')}", rows)

    @property
    def _damping_kind(self) -> str:
        if self.undamped:
            return "undamped"
        return f"loss factor {self.loss_factor:g}" if self.loss_factor else "viscously damped"

    @property
    @abstractmethod
    def undamped(self) -> bool:
        """Whether C = 0 and eta = 0."""

    @staticmethod
    @abstractmethod
    def _matrix(matrix: Any, size: int, name: str) -> Any:
        """Return M, C or K as it is kept: real, finite, of shape (size, size), read-only."""

    @property
    def labels(self) -> tuple[str, ...]:
        """Everything that can be asked for: the dofs, then the derived labels."""
        return self.dofs + tuple(self.derived)

    @door
    def locate(self, labels: Iterable[str] | None = None) -> tuple[list[int], FloatArray]:
        """Return, for each label (None: all), its coordinate's index and its factor on it.

        Raises
        ------
        UnknownDofError
        """
        wanted = self.labels if labels is None else tuple(labels)
        positions(wanted, self.labels, "the system")
        pairs = [self.derived.get(label, (label, 1.0)) for label in wanted]
        index = {dof: i for i, dof in enumerate(self.dofs)}
        return [index[dof] for dof, _ in pairs], np.array([factor for _, factor in pairs])


def _derived(
    derived: Mapping[str, tuple[str, float]], dofs: tuple[str, ...]
) -> dict[str, tuple[str, float]]:
    result = {}
    for label, tie in named(derived, (tuple, list), "the derived labels").items():
        if len(tie) != 2:
            raise FbsError(f"derived label {label!r} needs (dof, factor), got {tie!r}")
        dof, factor = tie[0], scalar(tie[1], f"the factor of derived label {label!r}")
        if dof not in dofs:
            raise unknown_dof(str(dof), dofs, f"derived label {label!r}: the system")
        if factor == 0:
            raise FbsError(f"derived label {label!r} needs a finite factor, not 0; got {factor}")
        result[label] = (dof, factor)
    return result


@dataclass(frozen=True, eq=False)
class Target:
    """What is asked for: lines, labels, and the coordinates and factors behind the labels."""

    axis: FloatArray
    responses: tuple[str, ...]
    excitations: tuple[str, ...]
    rows: list[int]
    columns: list[int]
    row_factor: FloatArray
    column_factor: FloatArray
    quantity: Quantity

    @classmethod
    def of(
        cls,
        system: LabelledSystem,
        frequency: ArrayLike,
        responses: Iterable[str] | None,
        excitations: Iterable[str] | None,
        quantity: Quantity | str,
    ) -> Target:
        """Check what is asked of a system; labels None: all of them.

        Raises
        ------
        UnknownDofError, FbsError
        """
        axis = ascending_frequency(frequency)
        rows, columns = (
            system.labels if labels is None else unique_labels(labels, what)
            for labels, what in ((responses, "the responses"), (excitations, "the excitations"))
        )
        i, row_factor = system.locate(rows)
        j, column_factor = system.locate(columns)
        return cls(axis, rows, columns, i, j, row_factor, column_factor, as_quantity(quantity))

    @property
    def symmetric(self) -> bool:
        """Whether H_ij and H_ji stand mirrored."""
        return self.responses == self.excitations

    def responding(self, shapes: NDArray[np.inexact]) -> NDArray[np.inexact]:
        """Return the rows of shapes at the responses."""
        return shapes[self.rows] * self.row_factor[:, None]

    def exciting(self, shapes: NDArray[np.inexact]) -> NDArray[np.inexact]:
        """Return the rows of shapes at the excitations."""
        return shapes[self.columns] * self.column_factor[:, None]

    def frf(self, receptances: ComplexArray, origin: Origin | None = None) -> Frf:
        """Return the FRFs of the labels from those of their coordinates, which become them.

        Receptances, shape (n_response, n_excitation, nf), are multiplied by the factors of derived
        labels and by (jw)^n, in place.
        """
        factor = np.outer(self.row_factor, self.column_factor)
        if (factor != 1).any():
            receptances *= factor[:, :, None]
        if self.quantity.derivative:
            receptances *= (2j * np.pi * self.axis) ** self.quantity.derivative
        values = receptances.transpose(2, 0, 1)
        return computed_frf(
            self.axis, values, self.responses, self.excitations, self.quantity, origin=origin
        )
