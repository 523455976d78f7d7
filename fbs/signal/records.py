"""Sampled inputs and outputs, and the lines of their discrete Fourier transform."""

from __future__ import annotations

import operator
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._kernels.checks import (
    FloatArray,
    ascending_frequency,
    frozen,
    numbers,
    scalar,
    unique_labels,
)
from .._kernels.door import door
from .._kernels.finite import non_finite
from .._representation import counted, html_table, listing
from ..errors import AxisMismatchError, FbsError, NonFiniteError, SingularLineError
from ..frf import Quantity, as_quantity

if TYPE_CHECKING:
    from ..plotting import Axes, Panels


@dataclass(frozen=True, eq=False)
class Record:
    """u(n / fs) and y(n / fs): forces and the motion they cause, sampled together.

    Parameters
    ----------
    sampling_frequency : float
        fs, Hz. The reciprocal of a time step that misses a whole number of hertz by rounding
        alone (1 / 1e-5 = 99999.99999999999) is that number.
    inputs : array, shape (n_sample, n_input)
        Forces, N. Never copied, and may be a memory map.
    outputs : array, shape (n_sample, n_output)
        m, m/s or m/s^2, as `quantity` says.
    excitations, responses : tuple of str
        Labels of the inputs and of the outputs.
    quantity : Quantity
        What the outputs per force are: receptance for displacements, mobility for velocities,
        accelerance for accelerations.

    Raises
    ------
    FbsError, NonFiniteError, AmbiguousDofError, QuantityMismatchError
    """

    sampling_frequency: float
    inputs: FloatArray
    outputs: FloatArray
    excitations: tuple[str, ...]
    responses: tuple[str, ...]
    quantity: Quantity

    if TYPE_CHECKING:  # what `__post_init__` converts, said to type checkers

        def __init__(
            self,
            sampling_frequency: float,
            inputs: ArrayLike,
            outputs: ArrayLike,
            excitations: Iterable[str],
            responses: Iterable[str],
            quantity: Quantity | str,
        ) -> None: ...

    def __post_init__(self) -> None:
        excitations = unique_labels(self.excitations, "the excitations")
        responses = unique_labels(self.responses, "the responses")
        rate = _sampling_frequency(self.sampling_frequency)
        inputs = _channels(self.inputs, excitations, "input", rate)
        outputs = _channels(self.outputs, responses, "output", rate)
        if len(inputs) != len(outputs):
            raise FbsError(
                f"the inputs have {len(inputs)} samples and the outputs {len(outputs)}; "
                "they must be sampled together"
            )
        for name, value in (
            ("sampling_frequency", rate),
            ("inputs", inputs),
            ("outputs", outputs),
            ("excitations", excitations),
            ("responses", responses),
            ("quantity", as_quantity(self.quantity)),
        ):
            object.__setattr__(self, name, value)

    @classmethod
    @door
    def from_time(
        cls,
        time: ArrayLike,
        inputs: FloatArray,
        outputs: FloatArray,
        excitations: tuple[str, ...],
        responses: tuple[str, ...],
        quantity: Quantity | str,
        tolerance: float = 1e-3,
    ) -> Record:
        """Return the record sampled at `time` (s), which must be uniform.

        fs is the whole number of hertz that agrees with every time given, if there is one, else
        (n - 1) / (t_last - t_first).

        Parameters
        ----------
        tolerance : float
            How far a sample may be from the uniform grid, in steps: room for a time column
            written with few digits. It turns the phase by at most pi times this, at Nyquist.

        Raises
        ------
        FbsError
            Non-uniform time (the worst sample is named), or as for `Record`.
        """
        instants = np.asarray(time, dtype=float)
        rate = _uniform_rate(instants, tolerance)
        if len(instants) != len(inputs):
            raise FbsError(f"{len(instants)} times are given for {len(inputs)} samples")
        return cls(rate, inputs, outputs, excitations, responses, as_quantity(quantity))

    def __repr__(self) -> str:
        channels = f"{len(self.excitations)} + {counted(len(self.responses), 'channel')}"
        return f"<Record: {self.quantity.motion}, {channels}, {self._sampling}>"

    def _repr_html_(self) -> str:
        rows = (
            ("samples", self._sampling),
            ("excitations", listing(self.excitations)),
            ("responses", listing(self.responses)),
        )
        return html_table(f"Record: forces, N, and {self.quantity.motion}", rows)

    @property
    def _sampling(self) -> str:
        duration = self.n_sample * self.time_step
        rate = f"{self.sampling_frequency:g} Hz"
        return f"{counted(self.n_sample, 'sample')} at {rate}, {duration:g} s"

    @property
    def n_sample(self) -> int:
        """Number of samples."""
        return len(self.inputs)

    @property
    def time_step(self) -> float:
        """1 / fs, s."""
        return 1 / self.sampling_frequency

    @property
    def time(self) -> FloatArray:
        """n / fs from 0 on, s."""
        return np.asarray(np.arange(self.n_sample) / self.sampling_frequency)

    @door
    def span(self, start: float = 0.0, stop: float = np.inf) -> Record:
        """Return the samples at start <= t < stop (s), e.g. without a first transient."""
        # a time that is a sample's but for rounding is that sample's
        edges = np.clip(np.array([start, stop]) * self.sampling_frequency, 0, self.n_sample)
        first, last = (int(edge) for edge in np.ceil(edges - 1e-6))
        if first >= last:
            raise FbsError(
                f"no sample between {start:.10g} and {stop:.10g} s; the record lasts "
                f"{self.n_sample / self.sampling_frequency:.10g} s"
            )
        return replace(self, inputs=self.inputs[first:last], outputs=self.outputs[first:last])

    def plot(self, axes: Sequence[Axes] | None = None) -> Panels:
        """Draw forces and motion over time, every sample; matplotlib is imported for it.

        Of a long record draw a `span`.

        Parameters
        ----------
        axes : two matplotlib Axes, optional
            For forces and motion; default: a new figure.

        Returns
        -------
        tuple of two matplotlib Axes

        Raises
        ------
        FbsError
            Other than two axes are given.
        """
        from ..plotting import traces

        forces = ("force, N", self.excitations, self.inputs)
        motion = (self.quantity.motion, self.responses, self.outputs)
        return traces(self.time, (forces, motion), axes)


@dataclass(frozen=True, eq=False)
class Lines:
    """The wanted lines f_k = k fs / n of a transform of n samples.

    Parameters
    ----------
    index : int array, shape (nf,)
        k.
    frequency : array, shape (nf,), Hz
    demanded : bool
        Whether the caller asked for exactly these, so that none may be left out.
    unexcited : array, Hz
        Lines left out because an input hardly excites them.
    """

    index: NDArray[np.int64]
    frequency: FloatArray
    demanded: bool
    unexcited: FloatArray

    @classmethod
    def of(
        cls,
        sampling_frequency: float,
        n: int,
        fmin: float | None,
        fmax: float | None,
        frequency: ArrayLike | None,
    ) -> Lines:
        """Choose the lines fmin <= f <= fmax, or exactly those of `frequency`, below Nyquist."""
        if frequency is not None:
            if fmin is not None or fmax is not None:
                raise FbsError("give either frequency or fmin and fmax, not both")
            axis = ascending_frequency(frequency)
            _require_below_nyquist(axis[-1], "the last frequency", sampling_frequency)
            return cls(_bins(axis, sampling_frequency, n), axis, True, np.empty(0))
        if fmax is not None:
            _require_below_nyquist(fmax, "fmax", sampling_frequency)
        index = np.arange((n + 1) // 2)
        axis = index * sampling_frequency / n
        wanted = axis > 0 if fmin is None else axis >= fmin
        wanted &= axis <= (np.inf if fmax is None else fmax)
        if not wanted.any():
            raise FbsError(
                f"no line between fmin = {fmin} and fmax = {fmax} Hz; {n} samples at "
                f"{sampling_frequency:.10g} Hz have one every {sampling_frequency / n:.10g} Hz"
            )
        return cls(index[wanted], axis[wanted], False, np.empty(0))

    def excited(
        self, level: FloatArray, names: tuple[str, ...], threshold: float
    ) -> tuple[Lines, NDArray[np.bool_]]:
        """Keep the lines where every input reaches `threshold` times its peak.

        Parameters
        ----------
        level : array, shape (n // 2 + 1, n_input)
            Amplitude of each input at every line of the transform. The peak is looked for
            above 0 Hz, so that a preload does not hide the rest.

        Returns
        -------
        Lines
        keep : bool array
            Which of this object's lines they are.

        Raises
        ------
        FbsError
            An input is zero or constant, or no line is left.
        SingularLineError
            A demanded line is not excited.
        """
        if not 0 <= threshold < 1:
            raise FbsError(f"threshold must be at least 0 and below 1, got {threshold}")
        peak = level[1:].max(axis=0)
        for name, amplitude, constant in zip(names, peak, level[0], strict=True):
            if amplitude <= 1e-14 * constant:
                raise FbsError(f"input {name!r} is zero, or constant, and excites nothing")
        here = level[self.index]
        keep = ((here > 0) & (here >= threshold * peak)).all(axis=1)
        if self.demanded and not keep.all():
            raise SingularLineError(
                self.frequency[~keep],
                f"an input is below {threshold:.3g} of its peak",
                "leave these lines out, or excite them",
            )
        if not keep.any():
            raise FbsError(
                f"at none of the {keep.size} lines from {self.frequency[0]:.10g} to "
                f"{self.frequency[-1]:.10g} Hz do all inputs ({', '.join(names)}) reach "
                f"{threshold:.3g} of their peak"
            )
        kept = Lines(self.index[keep], self.frequency[keep], self.demanded, self.frequency[~keep])
        return kept, keep


def alike(records: Record | Iterable[Record]) -> tuple[Record, Iterator[Record]]:
    """Return the first record, and all of them one by one, checked against the first.

    They are taken from the iterable as they are needed, so that long runs may come in pieces.

    Raises
    ------
    FbsError
        There is none.
    AxisMismatchError
        Sampling frequency, labels or quantity differ from the first record's.
    """
    source = iter([records] if isinstance(records, Record) else records)
    first = next(source, None)
    if first is None:
        raise FbsError("no records given")

    def checked() -> Iterator[Record]:
        for number, record in enumerate(chain([first], source)):
            for what in ("sampling_frequency", "excitations", "responses", "quantity"):
                one, other = getattr(first, what), getattr(record, what)
                if one != other:
                    name = what.replace("_", " ")
                    raise AxisMismatchError(
                        f"record {number} differs from record 0 in {name}: {other} against {one}"
                    )
            yield record

    return first, checked()


def whole_number(value: int, name: str, least: int) -> int:
    """Return value as int; refuse what is none, or below `least`."""
    try:
        count = operator.index(value)
    except TypeError:
        raise FbsError(f"{name} must be a whole number, got {value!r}") from None
    if count < least:
        raise FbsError(f"{name} must be at least {least}, got {count}")
    return count


def _sampling_frequency(value: float) -> float:
    rate = scalar(value, "the sampling frequency")
    if rate <= 0:
        raise FbsError(f"the sampling frequency must be positive and finite, got {rate} Hz")
    whole = float(round(rate))
    return whole if abs(rate - whole) <= 1e-12 * rate else rate


def _channels(data: ArrayLike, labels: tuple[str, ...], what: str, rate: float) -> FloatArray:
    raw = numbers(data, f"the {what}s")
    if raw.ndim != 2 or raw.shape[1] != len(labels) or not labels:
        raise FbsError(
            f"the {what}s have shape {raw.shape}; (n_sample, {len(labels)}) is needed for the "
            f"{len(labels)} labels {', '.join(labels)}"
        )
    result = frozen(raw)
    wrong = non_finite(result)
    if wrong.size:
        sample, channel = wrong[0]
        raise NonFiniteError(
            f"{what} {labels[channel]!r} is {result[sample, channel]} at sample {sample} "
            f"({sample / rate:.10g} s; {len(wrong)} values in all)"
        )
    return result


def _uniform_rate(time: FloatArray, tolerance: float) -> float:
    if time.ndim != 1 or time.size < 2:
        raise FbsError(f"time must be one-dimensional with 2 samples or more, got {time.shape}")
    if not np.isfinite(time).all():
        sample = int(np.flatnonzero(~np.isfinite(time))[0])
        raise NonFiniteError(f"the time is {time[sample]} at sample {sample}")
    if time[-1] <= time[0]:
        raise FbsError(f"the time must ascend, but runs from {time[0]:.10g} to {time[-1]:.10g} s")
    mean = (time.size - 1) / (time[-1] - time[0])
    steps = np.arange(time.size)
    for rate in (float(round(mean)), float(mean)):
        off = np.abs((time - time[0]) * rate - steps)
        if off.max() <= tolerance:
            return rate
    step = np.diff(time)
    usual = float(np.median(step))
    sample = 1 + int(np.argmax(np.abs(step - usual)))
    raise FbsError(
        f"the time is not uniform: sample {sample} is at {time[sample]:.10g} s, "
        f"{step[sample - 1]:.10g} s after the one before, where {usual:.10g} s is usual; "
        "resample the record first"
    )


def _bins(axis: FloatArray, sampling_frequency: float, n: int) -> NDArray[np.int64]:
    exact = axis * n / sampling_frequency
    index = np.rint(exact)
    off = np.flatnonzero(np.abs(exact - index) > 1e-6 * np.maximum(1.0, exact))
    if off.size:
        raise FbsError(
            f"{axis[off[0]]:.10g} Hz is no line: {n} samples at {sampling_frequency:.10g} Hz have "
            f"one every {sampling_frequency / n:.10g} Hz"
        )
    return index.astype(np.int64)


def _require_below_nyquist(limit: float, what: str, sampling_frequency: float) -> None:
    nyquist = sampling_frequency / 2
    if not limit < nyquist:
        raise FbsError(
            f"{what} = {limit:.10g} Hz is not below the Nyquist frequency {nyquist:.10g} Hz "
            f"(sampling at {sampling_frequency:.10g} Hz)"
        )
