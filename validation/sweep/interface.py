"""Springs joined to FRFs that know their deflections: interface solves over lines and samples."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import FloatArray

BLOCK = 4096  # lines at a time: rows of ten samples stay in a core's cache


@dataclass(frozen=True, eq=False)
class Interface:
    """H between a response and springs' deflections, and an excitation and springs' forces.

    Attributes
    ----------
    h
        (1 + m, 1 + m, n_frequency) m/N, real where nothing damps.
    loss
        (n_frequency,) ωβ of springs k (1 + jωβ); None without damping.
    """

    h: NDArray[Any]
    loss: FloatArray | None
    last: _RealSpring | _ComplexSpring | None

    @classmethod
    def of(cls, h: NDArray[Any], loss: FloatArray | None) -> Interface:
        """Prepared for any number of samples: with one spring, what does not depend on its k."""
        if len(h) != 2:
            return cls(h, loss, None)
        damped = loss is not None or np.iscomplexobj(h)
        return cls(h, loss, _ComplexSpring.of(h, loss) if damped else _RealSpring.of(h))

    def magnitude(self, stiffness: FloatArray, out: FloatArray) -> None:
        """|H| of the FRF with the springs joined.

        Parameters
        ----------
        stiffness
            (n_sample, m) N/m, of either sign.
        out
            (n_sample, n_frequency) gets |H| (m/N); infinite or NaN on a pole.
        """
        if self.last is not None:
            with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
                for start in range(0, out.shape[1], BLOCK):
                    lines = slice(start, start + BLOCK)
                    self.last.magnitude(stiffness, lines, out[:, lines])
        elif stiffness.shape[1] == 0:
            out[:] = np.abs(self.h[0, 0])
        else:
            for row, own in zip(out, stiffness, strict=True):
                self._joined(float(own[-1])).magnitude(own[None, :-1], row[None])

    def _joined(self, k: float) -> Interface:
        """H − H b (bᵀHb + 1/z)⁻¹ bᵀH for the last spring, which is left out then."""
        z: Any = k if self.loss is None else k * (1.0 + 1j * self.loss)
        flexibility = z / (1.0 + z * self.h[-1, -1])
        rest = self.h[:-1, :-1] - self.h[:-1, -1:] * (flexibility * self.h[-1:, :-1])
        return Interface.of(rest, self.loss)


@dataclass(frozen=True, eq=False)
class _RealSpring:
    """|h₀₀ − h₀₁h₁₀ / (h₁₁ + 1/k)|."""

    direct: FloatArray
    through: FloatArray
    spring: FloatArray

    @classmethod
    def of(cls, h: FloatArray) -> _RealSpring:
        return cls(h[0, 0], h[0, 1] * h[1, 0], h[1, 1])

    def magnitude(self, k: FloatArray, lines: slice, out: FloatArray) -> None:
        np.add(self.spring[lines], 1.0 / k, out=out)
        np.divide(self.through[lines], out, out=out)
        np.subtract(self.direct[lines], out, out=out)
        np.abs(out, out=out)


@dataclass(frozen=True, eq=False)
class _ComplexSpring:
    """|h₀₀ + kγ(h₀₀h₁₁ − h₀₁h₁₀)| / |1 + kγh₁₁|, γ = 1 + jωβ, by real and imaginary parts.

    The difference cancels near a pole of h as the plain form does, and to the same digits.
    """

    above: tuple[FloatArray, FloatArray]
    above_by_k: tuple[FloatArray, FloatArray]
    below_by_k: tuple[FloatArray, FloatArray]

    @classmethod
    def of(cls, h: NDArray[Any], loss: FloatArray | None) -> _ComplexSpring:
        gamma = 1.0 if loss is None else 1.0 + 1j * loss
        cross = gamma * (h[0, 0] * h[1, 1] - h[0, 1] * h[1, 0])
        return cls(_parts(h[0, 0]), _parts(cross), _parts(gamma * h[1, 1]))

    def magnitude(self, k: FloatArray, lines: slice, out: FloatArray) -> None:
        below, part = np.empty_like(out), np.empty_like(out)
        for into, starts, slopes in (
            (out, (self.above[0][lines], self.above[1][lines]), self.above_by_k),
            (below, (1.0, 0.0), self.below_by_k),
        ):
            np.multiply(k, slopes[0][lines], out=into)
            into += starts[0]
            np.multiply(into, into, out=into)
            np.multiply(k, slopes[1][lines], out=part)
            part += starts[1]
            np.multiply(part, part, out=part)
            into += part
        np.divide(out, below, out=out)
        np.sqrt(out, out=out)


def _parts(values: NDArray[Any]) -> tuple[FloatArray, FloatArray]:
    return np.ascontiguousarray(values.real), np.ascontiguousarray(values.imag)
