"""Spectra averaged over segments, and the FRF estimators made of them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .._kernels.checks import ComplexArray, FloatArray
from ..errors import FbsError, SingularLineError
from .records import Lines, Record


@dataclass(frozen=True, eq=False)
class Segments:
    """How records are cut: `size` samples every `hop`, times `window` (size, 1)."""

    size: int
    hop: int
    window: FloatArray
    remove_mean: bool

    def spectra(self, records: Iterable[Record]) -> Iterator[tuple[ComplexArray, ComplexArray]]:
        for number, record in enumerate(records):
            if record.n_sample < self.size:
                raise FbsError(
                    f"record {number} has {record.n_sample} samples, less than one segment of "
                    f"{self.size}"
                )
            for start in range(0, record.n_sample - self.size + 1, self.hop):
                part = slice(start, start + self.size)
                yield self._transform(record.inputs[part]), self._transform(record.outputs[part])

    def _transform(self, samples: FloatArray) -> ComplexArray:
        if self.remove_mean:
            mean = samples.mean(axis=0)
            samples = samples - mean
            rounding = self.size * np.finfo(float).eps * np.abs(mean)
            samples[:, np.abs(samples).max(axis=0) <= rounding] = 0.0  # it was a constant
        return np.asarray(np.fft.rfft(self.window * samples, axis=0))


@dataclass(frozen=True, eq=False)
class Spectra:
    """Sums over segments: ff = F F^H, yf = Y F^H, yy = |Y|^2, full_yy = Y Y^H where asked for.

    level : (n // 2 + 1, n_input), the inputs' amplitudes at all lines of the transform.
    """

    level: FloatArray
    ff: ComplexArray
    yf: ComplexArray
    yy: FloatArray
    full_yy: ComplexArray | None
    count: int

    @classmethod
    def of(
        cls,
        first: Record,
        records: Iterable[Record],
        segments: Segments,
        lines: Lines,
        square: bool = False,
    ) -> Spectra:
        ni, no, nf = len(first.excitations), len(first.responses), lines.index.size
        level = np.zeros((segments.size // 2 + 1, ni))
        ff = np.zeros((nf, ni, ni), dtype=complex)
        yf = np.zeros((nf, no, ni), dtype=complex)
        yy = np.zeros((nf, no))
        full_yy = np.zeros((nf, no, no), dtype=complex) if square else None
        count = 0
        for all_f, all_y in segments.spectra(records):
            level += squared(all_f)
            f, y = all_f[lines.index], all_y[lines.index]
            ff += f[:, :, None] * f.conj()[:, None]
            yf += y[:, :, None] * f.conj()[:, None]
            yy += squared(y)
            if full_yy is not None:
                full_yy += y[:, :, None] * y.conj()[:, None]
            count += 1
        return cls(np.sqrt(level), ff, yf, yy, full_yy, count)

    def excited(self, lines: Lines, record: Record, threshold: float) -> tuple[Lines, Spectra]:
        lines, keep = lines.excited(self.level, record.excitations, threshold)
        full_yy = None if self.full_yy is None else self.full_yy[keep]
        kept = Spectra(self.level, self.ff[keep], self.yf[keep], self.yy[keep], full_yy, self.count)
        return lines, kept

    @property
    def input_power(self) -> FloatArray:
        return np.asarray(np.einsum("kjj->kj", self.ff).real)


@dataclass(frozen=True, eq=False)
class Regression:
    """D G_ff D = V diag(w) V^H with D = G_ff,jj^-1/2, and cross = G_yf D V.

    G_yf (G_ff - lambda D^-2)^-1 = cross diag(w - lambda)^-1 V^H D for any lambda.
    """

    scale: FloatArray
    w: FloatArray
    v: ComplexArray
    cross: ComplexArray

    @classmethod
    def of(cls, spectra: Spectra, noise: FloatArray | None = None) -> Regression:
        """Take D = noise^-1/2 (n_frequency, n_input) instead, if given."""
        scale = 1 / np.sqrt(spectra.input_power if noise is None else noise)
        w, v = np.linalg.eigh(spectra.ff * scale[:, :, None] * scale[:, None])
        return cls(scale, w, v, (spectra.yf * scale[:, None]) @ v)

    @property
    def condition(self) -> FloatArray:
        """sqrt(w_max / w_min), infinite where w_min is round-off."""
        least, largest = self.w[:, 0], self.w[:, -1]
        positive = least > 10 * self.w.shape[1] * np.finfo(float).eps * largest
        ratio = np.divide(largest, least, out=np.full_like(least, np.inf), where=positive)
        return np.asarray(np.sqrt(ratio))

    def h1(self) -> ComplexArray:
        return self.solution(self.cross, np.zeros((len(self.w), 1)))

    def solution(self, cross: ComplexArray, noise: FloatArray) -> ComplexArray:
        """Return cross diag(w - noise)^-1 V^H D, noise (n_frequency, 1)."""
        turned = self.v.conj().transpose(0, 2, 1) * self.scale[:, None]
        return np.asarray((cross / (self.w - noise)[:, None]) @ turned)


def multiple_coherence(spectra: Spectra, regression: Regression) -> FloatArray | None:
    """Return (G_yf G_ff^-1 G_fy)_ii / G_yy_ii, shape (n_frequency, n_output)."""
    if spectra.count <= spectra.ff.shape[1]:
        return None  # as many unknowns as equations: it would be 1 whatever the data
    explained = (squared(regression.cross) / regression.w[:, None]).sum(axis=-1)
    return share(explained, spectra.yy)


def h2(spectra: Spectra, lines: Lines) -> ComplexArray:
    """Return G_yy G_fy^-1; for one input G_yy,ii / G_fy,i, output by output."""
    reason = "the cross-spectra of inputs and outputs, which H2 divides by, are singular"
    fy = spectra.yf.conj().transpose(0, 2, 1)
    power_in, power_out = spectra.input_power[:, :, None], spectra.yy[:, None]
    scaled = np.zeros_like(fy)  # stays zero where an output is silent
    np.divide(fy, np.sqrt(power_in * power_out), out=scaled, where=power_out > 0)
    limit = 10 * fy.shape[1] * np.finfo(float).eps
    if spectra.full_yy is None:  # one input: scaled is the coherence's root, output by output
        _refuse(lines, (np.abs(scaled) <= limit).any(axis=(1, 2)), reason)
        return np.asarray((spectra.yy[:, None] / fy).transpose(0, 2, 1))
    singular_values = np.linalg.svd(scaled, compute_uv=False)
    _refuse(lines, singular_values[:, -1] <= limit * singular_values[:, 0], reason)
    left = spectra.full_yy / np.sqrt(power_out)
    return np.asarray(left @ np.linalg.inv(scaled) / np.sqrt(power_in.transpose(0, 2, 1)))


def hv(
    spectra: Spectra, regression: Regression, lines: Lines, noise_ratio: float | None
) -> ComplexArray:
    """Return G_yf (G_ff - lambda N)^-1, row by row: the total least squares solution.

    lambda is the least eigenvalue of [[G_ff, G_fy], [G_yf, G_yy]] relative to diag(N, N_y). In
    the eigenvectors of the scaled G_ff that matrix is an arrow (whose phases do not matter), and
    H takes none of its eigenvectors, whose small components would be lost where input and output
    have unlike units.
    """
    if noise_ratio is not None:
        if not (np.isfinite(noise_ratio) and noise_ratio > 0):
            raise FbsError(f"noise_ratio must be positive and finite, got {noise_ratio}")
        regression = Regression.of(spectra, np.ones_like(spectra.input_power))
    nf, ni = regression.w.shape
    values = np.empty((nf, spectra.yf.shape[1], ni), dtype=complex)
    singular = np.zeros(nf, dtype=bool)
    for i, power in enumerate(spectra.yy.T):
        noise = np.where(power > 0, power, 1.0) if noise_ratio is None else np.array([noise_ratio])
        matrix = np.zeros((nf, ni + 1, ni + 1))
        matrix[:, range(ni), range(ni)] = regression.w
        matrix[:, ni, :ni] = np.abs(regression.cross[:, i]) / np.sqrt(noise)[:, None]
        matrix[:, ni, ni] = power / noise
        least = np.linalg.eigvalsh(matrix)[:, :1]  # of its lower triangle
        at_fault = regression.w[:, 0] - least[:, 0] <= 1e-14 * regression.w[:, -1]
        singular |= at_fault
        least[at_fault] = -1  # refused below
        values[:, i] = regression.solution(regression.cross[:, i, None], least)[:, 0]
    _refuse(lines, singular, "an output has nothing in common with the inputs, and Hv no limit,")
    return values


def _refuse(lines: Lines, wrong: NDArray[np.bool_], reason: str) -> None:
    if wrong.any():
        raise SingularLineError(lines.frequency[wrong], reason, "leave them out, or take H1")


def squared(z: ComplexArray) -> FloatArray:
    return np.asarray(z.real**2 + z.imag**2)


def length(z: ComplexArray) -> FloatArray:
    """Return the length of the vectors along the last axis."""
    return np.asarray(np.sqrt(squared(z).sum(axis=-1)))


def share(part: FloatArray, whole: FloatArray) -> FloatArray:
    """Return part / whole, at most 1; 0 where the whole is 0."""
    ratio = np.divide(part, whole, out=np.zeros_like(whole), where=whole > 0)
    return np.minimum(ratio, 1.0)
