"""Universal files as others write them, by format strings of their own: no code of the reader."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

AXIS = 2.0 * np.arange(1, 501)
NUMBERS = {"brake.w": 12, "shaft.w": 7}


def accelerance(response: str, excitation: str) -> NDArray[np.complex128]:
    """Of two masses, 20 and 1 kg, at each other and at the ground, in m/s² per N."""
    mass, stiffness = np.diag([20.0, 1.0]), np.array([[5e7, -4e7], [-4e7, 4e7]])
    omega = 2 * np.pi * AXIS[:, None, None]
    h = np.linalg.inv(stiffness * (1 + 2e-6j * omega) - omega**2 * mass)
    labels = list(NUMBERS)
    between = h[:, labels.index(response), labels.index(excitation)]
    return np.asarray(-(omega[:, 0, 0] ** 2) * between, complex)


@dataclass(frozen=True)
class Foreign:
    """A function of dataset 58, single precision as most programs write it."""

    response: tuple[str, int, int] = ("NONE", 12, 0)
    reference: tuple[str, int, int] = ("NONE", 12, 0)
    ids: tuple[str, str] = ("NONE", "NONE")
    kind: int = 4
    codes: tuple[int, int] = (12, 13)
    units: tuple[str, str] = ("m/s^2", "N")
    values: NDArray[np.complex128] = field(default_factory=lambda: np.ones(500, complex))
    first: float = 2.0
    step: float = 2.0
    abscissa: tuple[int, str] = (18, "Hz")
    complex: bool = True

    def text(self) -> str:
        """Return the dataset."""
        numbers = np.column_stack([self.values.real, self.values.imag]).ravel()
        if not self.complex:
            numbers = self.values.real
        lines = [
            f"{-1:6d}",
            f"{58:6d}{'':74}",
            *(f"{line:<80}" for line in ("FRF", "NONE", "01-Jan-20 10:00:00", *self.ids)),
            f"{self.kind:5d}{1:10d}{0:5d}{0:10d}" + _end(self.response) + _end(self.reference),
            f"{5 if self.complex else 2:10d}{len(self.values):10d}{1:10d}"
            f"{self.first:13.5E}{self.step:13.5E}{0:13.5E}",
            _axis(self.abscissa[0], "Frequency", self.abscissa[1]),
            _axis(self.codes[0], "Acceleration", self.units[0]),
            _axis(self.codes[1], "Force", self.units[1]),
            _axis(0, "NONE", "NONE"),
        ]
        for start in range(0, len(numbers), 6):
            lines.append("".join(_number(x) for x in numbers[start : start + 6]))
        return "\n".join([*lines, f"{-1:6d}", ""])


def _end(end: tuple[str, int, int]) -> str:
    entity, node, direction = end
    return f" {entity:<10}{node:10d}{direction:4d}"


def _axis(kind: int, label: str, unit: str) -> str:
    return f"{kind:10d}{0:5d}{0:5d}{0:5d} {label:<20} {unit:<20}"


def _number(value: float) -> str:
    return f"{'NAN':>13}" if np.isnan(value) else f"{value:13.5E}"


def stored(values: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Return values as E13.5 keeps them."""
    keep = np.vectorize(lambda x: float(f"{x:13.5E}") if np.isfinite(x) else x)
    return np.asarray(keep(values.real) + 1j * keep(values.imag))


def units_text(length: float, force: float, code: int = 9, words: str = "user") -> str:
    """Return a dataset 164."""
    factors = "".join(f"{x:25.17E}".replace("E", "D") for x in (length, force, 1.0))
    return (
        f"{-1:6d}\n{164:6d}\n{code:10d}{words:<20}{2:10d}\n{factors}\n"
        f"{273.15:25.17E}\n{-1:6d}\n".replace("E+", "D+")
    )


def rig(*, named: bool = True, scale: float = 1.0, **changes: object) -> list[Foreign]:
    """Return the four FRFs between brake.w and shaft.w, their accelerances times `scale`."""
    functions = []
    for excitation in NUMBERS:
        for response in NUMBERS:
            functions.append(
                replace(
                    Foreign(
                        ("NONE", NUMBERS[response], 0),
                        ("NONE", NUMBERS[excitation], 0),
                        values=scale * accelerance(response, excitation),
                        ids=(f"response: {response}", f"excitation: {excitation}")
                        if named
                        else ("NONE", "NONE"),
                    ),
                    **changes,  # type: ignore[arg-type]
                )
            )
    return functions


def written(path: Path, *parts: Foreign | str, encoding: str = "latin-1") -> Path:
    """Write datasets to a file."""
    text = "".join(part if isinstance(part, str) else part.text() for part in parts)
    path.write_bytes(text.encode(encoding))
    return path
