"""Whole periods of steady experiments: their spectra, their scatter and the inverse of inputs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .._kernels.checks import ComplexArray, FloatArray
from ..errors import FbsError
from ._averages import length, share, squared
from .records import Lines, Record


@dataclass(frozen=True, eq=False)
class Periods:
    """The steady periods of one experiment, (n_period, n_sample, n_channel)."""

    inputs: FloatArray
    outputs: FloatArray

    @classmethod
    def of(cls, record: Record, size: int, skipped: int, number: int) -> Periods:
        count = record.n_sample // size - skipped
        if count < 1:
            raise FbsError(
                f"record {number} has {record.n_sample} samples, less than one period of {size}"
                + (f" after {skipped} of transient" if skipped else "")
            )
        tail = slice(record.n_sample - count * size, None)
        inputs = record.inputs[tail].reshape(count, size, -1)
        for name, samples in zip(record.excitations, inputs.transpose(2, 0, 1), strict=True):
            differing = (samples - samples.mean(axis=0)).var() / max(1 - 1 / count, 0.5)
            if differing > 0.5 * samples.var():
                raise FbsError(
                    f"record {number}: input {name!r} does not repeat after {size} samples; "
                    f"{100 * differing / samples.var():.3g} % of its power differs from period "
                    "to period"
                )
        return cls(inputs, record.outputs[tail].reshape(count, size, -1))

    def mean_output(self, index: NDArray[np.int64]) -> ComplexArray:
        return np.asarray(np.fft.rfft(self.outputs.mean(axis=0), axis=0)[index])

    def spectra(self, index: NDArray[np.int64]) -> Iterator[tuple[ComplexArray, ComplexArray]]:
        for u, y in zip(self.inputs, self.outputs, strict=True):
            yield np.fft.rfft(u, axis=0)[index], np.fft.rfft(y, axis=0)[index]


def scatter(
    experiments: list[Periods],
    lines: Lines,
    values: ComplexArray,
    mean: ComplexArray,
    inverse: ComplexArray,
) -> tuple[FloatArray | None, FloatArray | None]:
    """Return coherence and variance, or None for both where an experiment has one period."""
    if min(len(e.inputs) for e in experiments) < 2:
        return None, None
    total = np.zeros(mean.shape[:2])
    variance = np.zeros(values.shape)
    for e, periods in enumerate(experiments):
        count = len(periods.inputs)
        of_mean = np.zeros(mean.shape[:2], dtype=complex)
        power = np.zeros(mean.shape[:2])
        for u, y in periods.spectra(lines.index):
            rest = y - (values @ u[:, :, None])[:, :, 0]
            of_mean += rest / count
            power += squared(rest)
            total += squared(y) / count
        # of_mean is round-off unless there are more experiments than inputs
        noise = np.maximum(power - count * squared(of_mean), 0) / (count * (count - 1))
        variance += noise[:, :, None] * squared(inverse[:, e])[:, None, :]
    return share(squared(mean).sum(axis=-1), total), variance


def inverted_inputs(u: ComplexArray) -> tuple[ComplexArray, FloatArray]:
    """Return the (pseudo-)inverse of U (nf, n_input, n_experiment) and U's condition."""
    scale = 1 / length(u)
    left, s, right = np.linalg.svd(u * scale[:, :, None], full_matrices=False)
    # a row of exact zeros in s is reported by the condition, not divided by
    positive = s > np.finfo(float).eps * s[:, :1]
    inverse = np.divide(1, s, out=np.zeros_like(s), where=positive)
    condition = np.where(positive[:, -1], s[:, 0] * inverse[:, -1], np.inf)
    turned = right.conj().transpose(0, 2, 1) * inverse[:, None]
    return np.asarray(turned @ left.conj().transpose(0, 2, 1) * scale[:, None]), condition
