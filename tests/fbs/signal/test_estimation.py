"""FRFs from records against the FRFs of the systems that made them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import scipy.linalg
import scipy.signal
from hypothesis import given, settings
from hypothesis import strategies as st

from fbs import (
    AmbiguousDofError,
    AxisMismatchError,
    FbsError,
    Joint,
    NonFiniteError,
    QuantityMismatchError,
    Record,
    SecondOrderSystem,
    SingularLineError,
    averaged_frf,
    couple,
    direct_frf,
    frequency_axis,
    impulse_frf,
    periodic_frf,
)
from fbs.signal.estimation import Estimate, Estimator
from tests.fbs.fbs_systems import random_system, scaled_error

FS, N = 16384, 4096  # lines every 4 Hz
BAND = frequency_axis(20, 6000, 4)
SYSTEM = random_system(np.random.default_rng(3), 4, beta=lambda rng: rng.uniform(1e-6, 4e-6))


def multisine(
    rng: np.random.Generator, n: int = N, fs: Any = FS, band: Any = BAND, n_input: int = 1
) -> Any:
    """Random phases, unit amplitude at every line of the band, (n, n_input)."""
    spectrum = np.zeros((n // 2 + 1, n_input), dtype=complex)
    index = np.rint(band * n / fs).astype(int)
    spectrum[index] = n / 2 * np.exp(2j * np.pi * rng.random((index.size, n_input)))
    return np.fft.irfft(spectrum, n, axis=0)


def steady_output(
    system: SecondOrderSystem,
    force: Any,
    inputs: Any,
    outputs: Any,
    quantity: str = "receptance",
    fs: Any = FS,
) -> Any:
    """The steady periodic response, exact: H U at every line the period has."""
    spectrum = np.fft.rfft(force, axis=0)
    frequency = np.arange(len(spectrum)) * fs / len(force)
    response = np.zeros((len(spectrum), len(outputs)), dtype=complex)
    first = 0 if np.abs(spectrum[0]).max() > 1e-9 else 1  # a free system has no rest at 0 Hz
    frf = direct_frf(system, frequency[first:], outputs, inputs, quantity)
    response[first:] = (frf.values @ spectrum[first:, :, None])[:, :, 0]
    return np.fft.irfft(response, len(force), axis=0)


def steady_record(
    system: SecondOrderSystem,
    force: Any,
    inputs: Any,
    outputs: Any,
    quantity: str = "receptance",
    periods: int = 1,
    fs: Any = FS,
) -> Any:
    y = steady_output(system, force, inputs, outputs, quantity, fs)
    tiled = (np.tile(force, (periods, 1)), np.tile(y, (periods, 1)))
    return Record(fs, *tiled, tuple(inputs), tuple(outputs), quantity)


def noisy(
    record: Record, rng: np.random.Generator, of_inputs: float = 0.0, of_outputs: float = 0.0
) -> Any:
    """White noise of those rms values on top."""
    f, y = record.inputs, record.outputs
    return replace(
        record,
        inputs=f + of_inputs * rng.standard_normal(f.shape),
        outputs=y + of_outputs * rng.standard_normal(y.shape),
    )


def gain_record(gain: float = 2.0, periods: int = 400, n: int = 64, seed: int = 0) -> Any:
    """y = gain u with |U| the same at every line but 0 and Nyquist."""
    force = multisine(np.random.default_rng(seed), n, n, np.arange(1.0, n // 2))
    force = np.tile(force / force.std(), (periods, 1))
    return Record(n, force, gain * force, ("f",), ("y",), "receptance")


def noise_record(seed: int = 0, n: int = 1024, n_input: int = 2, n_output: int = 2) -> Any:
    """Uncorrelated inputs, outputs that follow them at once, and noise."""
    rng = np.random.default_rng(seed)
    f = rng.standard_normal((n, n_input))
    y = f @ rng.standard_normal((n_input, n_output)) + 0.3 * rng.standard_normal((n, n_output))
    names = tuple(f"f{j}" for j in range(n_input)), tuple(f"y{i}" for i in range(n_output))
    return Record(1000, f, y, *names, "accelerance")


# --- records ------------------------------------------------------------------------------------


def test_a_record_is_not_changed_by_what_the_caller_does_to_the_arrays() -> None:
    f, y = np.zeros((5, 1)), np.zeros((5, 2))
    record = Record(10, f, y, ("a",), ("a", "b"), "mobility")
    f[:] = np.nan
    assert not record.inputs.any()
    y.setflags(write=False)  # nobody can change it: no copy
    assert np.shares_memory(Record(10, record.inputs, y, ("a",), ("a", "b"), "mobility").outputs, y)
    assert f.flags.writeable
    assert not record.outputs.flags.writeable
    assert record.n_sample == 5
    assert record.time_step == 0.1
    assert np.array_equal(record.time, np.arange(5) / 10)


def test_the_reciprocal_of_a_time_step_is_a_whole_number_of_hertz() -> None:
    record = noise_record()
    assert replace(record, sampling_frequency=1 / 1e-5).sampling_frequency == 100000.0
    assert replace(record, sampling_frequency=12.5).sampling_frequency == 12.5


def test_span_takes_samples_by_time() -> None:
    record = noise_record()
    part = record.span(0.1, 0.3)
    assert np.array_equal(part.outputs, record.outputs[100:300])
    assert record.span(0.5).n_sample == record.n_sample - 500
    assert record.span(0.1 + 0.2).n_sample == record.n_sample - 300  # 300.00000000000006
    with pytest.raises(FbsError, match=r"no sample between 2 and inf s; the record lasts 1.024 s"):
        record.span(2.0)


@pytest.mark.parametrize("fs", [1000, 51200, 1 / 3e-5, 0.25])
def test_uniform_time_gives_the_sampling_frequency(fs: float) -> None:
    record = noise_record()
    time = 3.0 + np.arange(record.n_sample) / fs
    args = (record.inputs, record.outputs, record.excitations, record.responses, "mobility")
    again = Record.from_time(time, *args)
    assert again.sampling_frequency == pytest.approx(fs, rel=1e-12)
    if fs == int(fs):
        assert again.sampling_frequency == fs


def test_a_time_column_of_nine_digits_is_uniform() -> None:
    record = noise_record()
    time = np.array([float(f"{n / 51200:.9f}") for n in range(record.n_sample)])
    args = (record.inputs, record.outputs, record.excitations, record.responses, "mobility")
    assert Record.from_time(time, *args).sampling_frequency == 51200


def test_a_gap_in_time_is_named() -> None:
    record = noise_record(n=100)
    time = np.arange(100) / 1000
    time[40:] += 0.0005
    args = (record.inputs, record.outputs, record.excitations, record.responses, "mobility")
    with pytest.raises(FbsError, match=r"sample 40 is at 0.0405 s, 0.0015 s after .* 0.001 s is"):
        Record.from_time(time, *args)
    drifting = np.arange(100) ** 1.01
    with pytest.raises(FbsError, match="not uniform"):
        Record.from_time(drifting, *args)
    with pytest.raises(FbsError, match="99 times are given for 100 samples"):
        Record.from_time(np.arange(99.0), *args)
    with pytest.raises(FbsError, match="must ascend"):
        Record.from_time(-np.arange(100.0), *args)
    with pytest.raises(FbsError, match="2 samples or more"):
        Record.from_time([0.0], *args)
    with pytest.raises(NonFiniteError, match="time is nan at sample 7"):
        Record.from_time(np.where(np.arange(100) == 7, np.nan, np.arange(100)), *args)


def test_bad_records_are_refused() -> None:
    f, y = np.zeros((5, 1)), np.zeros((5, 2))
    good = Record(10, f, y, ("a",), ("a", "b"), "mobility")
    with pytest.raises(FbsError, match=r"inputs have shape \(5,\)"):
        replace(good, inputs=f[:, 0])
    with pytest.raises(FbsError, match=r"outputs have shape \(5, 2\); \(n_sample, 1\)"):
        replace(good, responses=("a",))
    with pytest.raises(FbsError, match="5 samples and the outputs 4"):
        replace(good, outputs=y[:4])
    with pytest.raises(FbsError, match="real"):
        replace(good, inputs=f * 1j)  # type: ignore[arg-type]
    with pytest.raises(FbsError, match="labels"):
        replace(good, excitations=(), inputs=np.zeros((5, 0)))
    with pytest.raises(AmbiguousDofError, match="'a' more than once"):
        replace(good, responses=("a", "a"))
    with pytest.raises(QuantityMismatchError, match="compliance"):
        replace(good, quantity="compliance")  # type: ignore[arg-type]
    for rate in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(FbsError, match="sampling frequency must be"):
            replace(good, sampling_frequency=rate)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_bad_sample_is_named(value: float) -> None:
    y = np.zeros((50, 2))
    y[30:32, 1] = value
    with pytest.raises(NonFiniteError, match=rf"'b' is {value} at sample 30 \(3 s; 2 values"):
        Record(10, np.zeros((50, 1)), y, ("a",), ("a", "b"), "mobility")


# --- periodic -----------------------------------------------------------------------------------


@pytest.mark.parametrize("quantity", ["receptance", "mobility", "accelerance"])
def test_a_multisine_gives_the_frf_itself(quantity: str) -> None:
    force = multisine(np.random.default_rng(1))
    record = steady_record(SYSTEM, force, ["x1"], ["x0", "x1", "x3"], quantity)
    estimate = periodic_frf(record, N)
    reference = direct_frf(SYSTEM, BAND, ["x0", "x1", "x3"], ["x1"], quantity)
    assert np.array_equal(estimate.frf.frequency, BAND)
    assert estimate.frf.quantity == quantity
    assert scaled_error(estimate.frf, reference).max() < 1e-10
    assert estimate.kind == "periodic"
    assert estimate.n_averages == 1
    assert estimate.coherence is None
    assert estimate.variance is None
    assert np.allclose(estimate.input_condition, 1)
    # 20 to 6000 Hz are excited; the rest of (0, 8192) is not
    assert estimate.unexcited.size == N // 2 - 1 - BAND.size
    assert estimate.frf.values.strides[0] == 16


def test_several_inputs_with_other_phases_or_one_at_a_time() -> None:
    rng = np.random.default_rng(2)
    inputs, outputs = ["x0", "x2", "x3"], ["x0", "x1", "x2"]
    reference = direct_frf(SYSTEM, BAND, outputs, inputs)
    phases = [multisine(rng, n_input=3) * [1, 0.5, 2] for _ in range(3)]
    single = [multisine(rng, n_input=3) * np.eye(3)[j] for j in range(3)]
    for forces in (phases, single, phases + single):
        records = [steady_record(SYSTEM, f, inputs, outputs) for f in forces]
        estimate = periodic_frf(iter(records), N)
        error = scaled_error(estimate.frf, reference)
        assert (error < 1e-11 * estimate.input_condition).all()
        if forces is single:
            assert np.allclose(estimate.input_condition, 1)
            assert scaled_error(estimate.frf, reference).max() < 1e-10


def test_a_transient_is_left_out_and_the_last_periods_are_taken() -> None:
    force = multisine(np.random.default_rng(1))
    record = steady_record(SYSTEM, force, ["x1"], ["x0"], periods=4)
    y = record.outputs.copy()
    y[: N + 100] = 7.0
    # 100 samples do not fill a period: they fall to the beginning, whichever they are
    whole = replace(record, outputs=y).span(0, (3 * N + 100) / FS)
    estimate = periodic_frf(whole, N, transient_periods=1)
    assert estimate.n_averages == 2
    reference = direct_frf(SYSTEM, BAND, ["x0"], ["x1"])
    assert scaled_error(estimate.frf, reference).max() < 1e-10
    assert estimate.coherence is not None
    assert estimate.coherence.min() > 1 - 1e-12
    assert estimate.variance is not None
    assert np.sqrt(estimate.variance.max()) < 1e-10 * np.abs(reference.values).max()


def test_the_lines_asked_for_are_the_lines_given() -> None:
    force = multisine(np.random.default_rng(1))
    record = steady_record(SYSTEM, force, ["x1"], ["x0"])
    wanted = np.array([100.0, 104.0, 3000.0])
    assert np.array_equal(periodic_frf(record, N, frequency=wanted).frf.frequency, wanted)
    part = periodic_frf(record, N, fmin=100, fmax=200).frf.frequency
    assert np.array_equal(part, frequency_axis(100, 200, 4))
    with pytest.raises(SingularLineError, match=r"below 0.0001 of its peak at 1 line \(7000 Hz\)"):
        periodic_frf(record, N, frequency=[100, 7000])
    with pytest.raises(FbsError, match=r"101 Hz is no line: 4096 samples .* every 4 Hz"):
        periodic_frf(record, N, frequency=[100, 101])
    with pytest.raises(FbsError, match=r"at none of the 126 lines .* do all inputs"):
        periodic_frf(record, N, fmin=6500, fmax=7000)


def test_the_variance_is_that_of_the_estimate() -> None:
    rng = np.random.default_rng(5)
    inputs, outputs, periods = ["x0", "x3"], ["x0", "x2"], 40
    reference = direct_frf(SYSTEM, BAND, outputs, inputs, "accelerance")
    records = []
    for _ in range(2):
        exact = steady_record(
            SYSTEM, multisine(rng, n_input=2) * [1, 4], inputs, outputs, "accelerance", periods
        )
        records.append(noisy(exact, rng, of_inputs=0.5, of_outputs=0.5))
    estimate = periodic_frf(records, N, frequency=BAND)
    error = np.abs(estimate.frf.values - reference.values) ** 2
    # |e|^2 / var is exponential with mean 1; 1496 lines in each mean, so 1 +- 0.026 (1 sigma)
    assert np.allclose((error / estimate.variance).mean(axis=0), 1, atol=0.12)


def test_experiments_that_disagree_are_not_noise() -> None:
    """More experiments than inputs, one of a stiffer system: it repeats all the same."""
    rng = np.random.default_rng(5)
    stiffer = replace(SYSTEM, stiffness=1.5 * SYSTEM.stiffness)
    records = [
        steady_record(system, multisine(rng), ["x0"], ["x1"], periods=3)
        for system in (SYSTEM, stiffer)
    ]
    estimate = periodic_frf(records, N)
    assert estimate.variance is not None
    assert np.sqrt(estimate.variance).max() < 1e-8 * np.abs(estimate.frf.values).max()


def test_a_preload_does_not_hide_the_excited_lines() -> None:
    record = steady_record(SYSTEM, multisine(np.random.default_rng(1)), ["x1"], ["x0"])
    loaded = replace(record, inputs=record.inputs + 1e5)
    assert np.array_equal(periodic_frf(loaded, N).frf.frequency, BAND)


def test_the_coherence_of_periods_is_the_share_that_repeats() -> None:
    record = noisy(gain_record(periods=2000), np.random.default_rng(7), of_outputs=1.0)
    estimate = periodic_frf(record, 64)
    # signal 4, noise 1 over 32 lines; the white noise has 2 / 64 of its power on each
    snr = 4 / 31 / (1 / 32)
    assert estimate.coherence is not None
    assert estimate.coherence.mean() == pytest.approx(snr / (snr + 1), abs=0.003)


def test_periodic_refuses() -> None:
    rng = np.random.default_rng(1)
    record = steady_record(SYSTEM, multisine(rng), ["x1"], ["x0"], periods=2)
    with pytest.raises(FbsError, match="8192 samples, less than one period of 8193"):
        periodic_frf(record, 8193)
    with pytest.raises(FbsError, match="less than one period of 4096 after 2 of transient"):
        periodic_frf(record, N, transient_periods=2)
    with pytest.raises(
        FbsError, match=r"'x1' does not repeat after 4000 samples; [0-9.]+ % of its"
    ):
        periodic_frf(record, 4000)
    with pytest.raises(FbsError, match="period_samples must be at least 2, got 0"):
        periodic_frf(record, 0)
    with pytest.raises(FbsError, match=r"period_samples must be a whole number, got 4096\.0"):
        periodic_frf(record, 4096.0)  # type: ignore[arg-type]
    with pytest.raises(FbsError, match="no records given"):
        periodic_frf([], N)
    with pytest.raises(FbsError, match="input 'x1' is zero, or constant, and excites nothing"):
        periodic_frf(replace(record, inputs=np.full((2 * N, 1), 3.0)), N)
    two = steady_record(SYSTEM, multisine(rng, n_input=2), ["x1", "x2"], ["x0"])
    with pytest.raises(FbsError, match="2 inputs need at least 2 experiments, got 1"):
        periodic_frf(two, N)
    with pytest.raises(SingularLineError, match="cannot be told apart") as caught:
        periodic_frf([two, two], N)
    assert np.array_equal(caught.value.frequencies, BAND)
    with pytest.raises(AxisMismatchError, match="record 1 differs from record 0 in excitations"):
        periodic_frf([two, replace(two, excitations=("x1", "x3"))], N)


def test_only_the_lines_where_inputs_are_alike_are_named() -> None:
    rng = np.random.default_rng(1)
    one, two = multisine(rng, n_input=2), multisine(rng, n_input=2)
    spectra = np.fft.rfft(one, axis=0), np.fft.rfft(two, axis=0)
    spectra[1][[30, 40]] = 1j * spectra[0][[30, 40]]
    two = np.fft.irfft(spectra[1], N, axis=0)
    records = [steady_record(SYSTEM, f, ["x1", "x2"], ["x0"]) for f in (one, two)]
    with pytest.raises(SingularLineError) as caught:
        periodic_frf(records, N)
    assert np.array_equal(caught.value.frequencies, [120, 160])


def test_estimates_couple_like_any_other_frf() -> None:
    rng = np.random.default_rng(9)
    damped: dict[str, Any] = {"beta": lambda rng: 3e-6}
    a, b = random_system(rng, 4, "a", **damped), random_system(rng, 3, "b", **damped)
    estimates, references = {}, {}
    for name, system in (("a", a), ("b", b)):
        dofs = list(system.dofs)[:2]
        force = multisine(
            rng, n_input=2
        )  # orthogonal: the same with the signs of a Hadamard matrix
        forces = [force * signs for signs in ([1, 1], [1, -1])]
        records = [steady_record(system, f, dofs, dofs, "accelerance") for f in forces]
        estimates[name] = periodic_frf(records, N, frequency=BAND).frf
        references[name] = direct_frf(system, BAND, dofs, dofs, "accelerance")
    joints = [Joint(("a", "a1"), ("b", "b0"), 1e8), Joint(("a", "a0"), ("b", "b1"))]
    coupled, reference = couple(estimates, joints), couple(references, joints)
    assert scaled_error(coupled.frf, reference.frf).max() < 1e-9


# --- discretisation -----------------------------------------------------------------------------


@pytest.mark.parametrize("held", [True, False])
def test_a_force_not_band_limited_shows_as_its_hold(held: bool) -> None:
    """Zero-order hold: sinc and half a step of delay; straight lines between samples: sinc^2."""
    n, fs = 2048, 2e5
    band = np.arange(1.0, 41) * fs / n
    force = multisine(np.random.default_rng(4), n, fs, band)[:, 0]
    mass, damping, stiffness = 1.0, 800.0, 4e7  # 1007 Hz, 6 %
    a = np.array([[0, 1], [-stiffness / mass, -damping / mass]])
    system = scipy.signal.StateSpace(a, [[0], [1 / mass]], [[1, 0]], [[0]])
    wrapped, time = np.append(force, force[0]), np.arange(n + 1) / fs
    _, _, x = scipy.signal.lsim(system, wrapped, time, interp=not held)
    orbit = np.linalg.solve(np.eye(2) - scipy.linalg.expm(a * n / fs), x[-1])
    _, y, x = scipy.signal.lsim(system, wrapped, time, orbit, interp=not held)
    assert np.allclose(x[-1], x[0], rtol=1e-9)
    record = Record(fs, force[:, None], y[:-1, None], ("x",), ("x",), "receptance")
    estimate = periodic_frf(record, n)
    one = SecondOrderSystem([[mass]], [[damping]], [[stiffness]], ("x",))
    hold = np.sinc(band / fs)
    factor = hold * np.exp(-1j * np.pi * band / fs) if held else hold**2
    expected = direct_frf(one, band).values[:, 0, 0] * factor
    error = np.abs(estimate.frf.values[:, 0, 0] / expected - 1)
    # images: (f / (fs - f))^m H(fs - f) / H(f), m = 1 and 2; H(fs) / H(4 kHz) = 4e-4
    assert error.max() < (2e-5 if held else 1e-6)
    assert np.abs(factor - 1).max() > 1e-4


@pytest.mark.parametrize("call", ["periodic", "averaged", "impulse"])
def test_nothing_is_estimated_at_or_above_nyquist(call: str) -> None:
    record = noise_record(n_input=1)
    estimate: Callable[..., Estimate] = {
        "periodic": lambda **k: periodic_frf(record, 1024, **k),
        "averaged": lambda **k: averaged_frf(record, 128, **k),
        "impulse": lambda **k: impulse_frf(record, max_remainder=2, **k),
    }[call]
    message = r"fmax = 500 Hz is not below the Nyquist frequency 500 Hz \(sampling at 1000 Hz\)"
    with pytest.raises(FbsError, match=message):
        estimate(fmax=500)
    with pytest.raises(FbsError, match="the last frequency = 750 Hz is not below"):
        estimate(frequency=[250, 750])
    with pytest.raises(FbsError, match="either frequency or fmin and fmax"):
        estimate(frequency=[250], fmax=300)
    with pytest.raises(FbsError, match="no line between fmin = 300"):
        estimate(fmin=300, fmax=200)
    with pytest.raises(FbsError, match="threshold must be at least 0 and below 1, got 1"):
        estimate(threshold=1)
    assert estimate().frf.frequency[-1] < 500


# --- averaged -----------------------------------------------------------------------------------

BOXCAR: dict[str, Any] = {"segment": 64, "overlap": 0.0, "window": "boxcar"}


@pytest.mark.parametrize("estimator", ["H1", "H2", "Hv"])
def test_without_noise_all_estimators_are_exact(estimator: Estimator) -> None:
    force = multisine(np.random.default_rng(1))
    record = steady_record(SYSTEM, force, ["x1"], ["x0", "x1", "x3"], periods=3)
    estimate = averaged_frf(record, N, overlap=0.5, window="boxcar", estimator=estimator)
    reference = direct_frf(SYSTEM, BAND, ["x0", "x1", "x3"], ["x1"])
    assert np.array_equal(estimate.frf.frequency, BAND)
    assert scaled_error(estimate.frf, reference).max() < 1e-10
    assert estimate.coherence is not None
    assert estimate.coherence.min() > 1 - 1e-10
    assert (estimate.kind, estimate.n_averages) == (estimator, 5)


def test_without_noise_hv_is_exact_for_any_ratio_and_unit() -> None:
    record = steady_record(SYSTEM, multisine(np.random.default_rng(1)), ["x1"], ["x0"], periods=3)
    estimate = averaged_frf(record, N, window="boxcar", estimator="Hv", noise_ratio=1.0)
    reference = direct_frf(SYSTEM, BAND, ["x0"], ["x1"])  # 1e-8 m/N
    assert scaled_error(estimate.frf, reference).max() < 1e-10


@pytest.mark.parametrize("estimator", ["H1", "H2", "Hv"])
def test_without_noise_two_inputs_are_told_apart(estimator: Estimator) -> None:
    rng = np.random.default_rng(6)
    dofs = ["x1", "x3"]
    records = [steady_record(SYSTEM, multisine(rng, n_input=2), dofs, dofs) for _ in range(6)]
    estimate = averaged_frf(records, N, window="boxcar", estimator=estimator)
    reference = direct_frf(SYSTEM, BAND, dofs, dofs)
    limit = 1e-14 * estimate.input_condition**2 * 100
    assert (scaled_error(estimate.frf, reference) < limit).all()
    assert estimate.n_averages == 6


def test_the_biases_of_noise_are_those_of_theory() -> None:
    """H1 = H / (1 + n_f / s_f), |H2| = H (1 + n_y / s_y), gamma^2 = the ratio of both."""
    in_noise, out_noise = 0.3, 0.8
    exact = gain_record(2.0, periods=4000)
    record = noisy(exact, np.random.default_rng(11), in_noise, out_noise)
    # signals: power 1 on 31 lines; white noise: as much on 32 (half of it at 0 and Nyquist)
    of_input = in_noise**2 / 32 * 31
    of_output = out_noise**2 / 32 * 31 / 4
    result = {e: averaged_frf(record, **BOXCAR, estimator=e) for e in ("H1", "H2", "Hv")}
    gain = {e: np.abs(r.frf.values).mean() for e, r in result.items()}
    # 4000 averages on 31 lines: 1 sigma of the mean is about 0.1 %
    assert gain["H1"] == pytest.approx(2 / (1 + of_input), rel=4e-3)
    assert gain["H2"] == pytest.approx(2 * (1 + of_output), rel=4e-3)
    assert gain["Hv"] == pytest.approx(np.sqrt(gain["H1"] * gain["H2"]), rel=1e-3)
    coherence = 1 / ((1 + of_input) * (1 + of_output))
    found = result["H1"].coherence
    assert found is not None
    assert found.mean() == pytest.approx(coherence, rel=4e-3)
    known = averaged_frf(record, **BOXCAR, estimator="Hv", noise_ratio=(out_noise / in_noise) ** 2)
    assert np.abs(known.frf.values).mean() == pytest.approx(2, rel=4e-3)


def test_hv_with_the_true_ratio_is_unbiased_for_two_inputs() -> None:
    rng = np.random.default_rng(12)
    gain = np.array([[2.0, -1.0], [0.5, 3.0], [1.0, 1.0]])
    f = rng.standard_normal((64 * 4000, 2))
    record = Record(64, f, f @ gain.T, ("a", "b"), ("a", "b", "c"), "mobility")
    noise = noisy(record, rng, 0.3, 0.6)
    low = averaged_frf(noise, **BOXCAR).frf.values.mean(axis=0)
    known = averaged_frf(noise, **BOXCAR, estimator="Hv", noise_ratio=4.0).frf.values.mean(axis=0)
    assert np.allclose(known, gain, atol=0.01)
    assert np.allclose(low, gain / 1.09, atol=0.01)


def test_the_multiple_coherence_counts_all_inputs() -> None:
    rng = np.random.default_rng(13)
    f = rng.standard_normal((64 * 3000, 2))
    y = f @ [[1.0], [2.0]] + rng.standard_normal((len(f), 1))
    record = Record(64, f, y, ("a", "b"), ("y",), "mobility")
    found = averaged_frf(record, **BOXCAR).coherence
    assert found is not None
    assert found.mean() == pytest.approx(5 / 6, abs=3e-3)
    alone = replace(record, inputs=f[:, 1:], excitations=("b",))
    found = averaged_frf(alone, **BOXCAR).coherence
    assert found is not None
    assert found.mean() == pytest.approx(4 / 6, abs=3e-3)


def test_the_ordinary_coherence_is_h1_over_h2_and_scipys() -> None:
    record = noise_record(n_input=1, n=4096)
    h1, h2 = (averaged_frf(record, 256, estimator=e) for e in ("H1", "H2"))
    ratio = (h1.frf.values / h2.frf.values)[:, :, 0]
    assert h1.coherence is not None
    assert np.allclose(ratio, h1.coherence, atol=1e-12)
    _, expected = scipy.signal.coherence(
        record.inputs[:, 0], record.outputs[:, 0], 1000, nperseg=256, noverlap=128
    )
    assert np.allclose(h1.coherence[:, 0], expected[1:-1], atol=1e-12)


def test_too_little_data_has_no_coherence() -> None:
    record = noise_record(n=128)
    estimate = averaged_frf(record, 64, overlap=0, max_condition=1e6)
    assert estimate.coherence is None
    with pytest.raises(FbsError, match="2 inputs need at least 2 segments, got 1"):
        averaged_frf(record, 128)


def test_a_silent_output_is_zero() -> None:
    record = noise_record()
    silent = replace(record, outputs=record.outputs * [0, 1])
    for estimator in ("H1", "Hv"):
        estimate = averaged_frf(silent, 128, estimator=estimator)
        assert not estimate.frf.values[:, 0].any()
        assert estimate.coherence is not None
        assert not estimate.coherence[:, 0].any()
    with pytest.raises(SingularLineError, match="H2 divides by, are singular"):
        averaged_frf(silent, 128, estimator="H2")
    one = replace(silent, inputs=silent.inputs[:, :1], excitations=("f0",))
    with pytest.raises(SingularLineError, match="H2 divides by, are singular"):
        averaged_frf(one, 128, estimator="H2")


def test_an_output_without_anything_in_common_has_no_hv() -> None:
    f = np.tile([1.0, 0.0, -1.0, 0.0], 64)[:, None]
    y = f.copy()
    y[128:] *= -1  # in phase half of the time, against it the other half
    record = Record(4, f, y, ("f",), ("y",), "mobility")
    with pytest.raises(SingularLineError, match="nothing in common with the inputs"):
        averaged_frf(record, 4, overlap=0, window="boxcar", estimator="Hv")


def test_a_preload_does_not_leak() -> None:
    record = noise_record(n=4096)
    shifted = replace(record, inputs=record.inputs + 1e3, outputs=record.outputs - 1e4)
    plain, preloaded = averaged_frf(record, 256), averaged_frf(shifted, 256)
    assert scaled_error(preloaded.frf, plain.frf).max() < 1e-9
    assert scaled_error(averaged_frf(shifted, 256, remove_mean=False).frf, plain.frf).max() > 1e-3


def test_pieces_of_a_run_come_one_by_one() -> None:
    record = noise_record(n=4096)
    whole = averaged_frf(record, 256, overlap=0)
    pieces = (record.span(k * 1.024, (k + 1) * 1.024) for k in range(4))
    joined = averaged_frf(pieces, 256, overlap=0)
    assert joined.n_averages == whole.n_averages == 16
    assert np.allclose(joined.frf.values, whole.frf.values, rtol=1e-12)


def test_a_window_is_a_name_or_its_values() -> None:
    record = noise_record()
    by_name = averaged_frf(record, 128, window=("kaiser", 8.0))
    by_values = averaged_frf(record, 128, window=7 * scipy.signal.get_window(("kaiser", 8.0), 128))
    assert np.allclose(by_name.frf.values, by_values.frf.values, rtol=1e-12)


def test_a_sweep_is_one_long_segment() -> None:
    """From rest to rest, so that the record holds all of the response: H1 of one segment."""
    n, fs = 16 * N, FS
    time = np.arange(n) / fs
    sweep = scipy.signal.chirp(time, 100, time[-1] / 2, 5000, "logarithmic")
    fade = np.clip(np.minimum(time / 0.2, (time[-1] / 2 - time) / 0.2), 0, 1)
    force = (sweep * np.sin(np.pi / 2 * fade) ** 2)[:, None]
    record = steady_record(SYSTEM, force, ["x1"], ["x0", "x1"], fs=fs)
    # a steady periodic response is that of a force from rest where it has died out by the end
    assert np.abs(record.outputs[-n // 4 :]).max() < 1e-9 * np.abs(record.outputs).max()
    estimate = averaged_frf(record, n, window="boxcar", fmin=120, fmax=4800, threshold=1e-3)
    reference = direct_frf(SYSTEM, estimate.frf.frequency, ["x0", "x1"], ["x1"])
    assert estimate.coherence is None
    assert estimate.unexcited.size == 0
    assert scaled_error(estimate.frf, reference).max() < 1e-9


def test_noise_with_h1_converges_to_the_frf() -> None:
    rng = np.random.default_rng(14)
    force = rng.standard_normal((256 * N, 1))
    record = steady_record(SYSTEM, force, ["x1"], ["x0", "x1"])
    estimate = averaged_frf(record, 4 * N, fmin=100, fmax=6000)
    reference = direct_frf(SYSTEM, estimate.frf.frequency, ["x0", "x1"], ["x1"])
    # leakage at the sharpest peak: 3 dB width 2 zeta f of some 20 Hz against lines every 1 Hz
    assert scaled_error(estimate.frf, reference).max() < 0.05
    assert estimate.coherence is not None
    assert np.median(estimate.coherence) > 0.9999


def test_averaged_refuses() -> None:
    record = noise_record()
    one = replace(record, inputs=record.inputs[:, :1], excitations=("f0",))
    with pytest.raises(FbsError, match="record 0 has 1024 samples, less than one segment of 2000"):
        averaged_frf(record, 2000)
    with pytest.raises(FbsError, match="estimator must be one of 'H1', 'H2', 'Hv', got 'H3'"):
        averaged_frf(record, 128, estimator="H3")  # type: ignore[arg-type]
    with pytest.raises(FbsError, match=r"overlap must be at least 0 and below 1, got 1\.0"):
        averaged_frf(record, 128, overlap=1.0)
    with pytest.raises(FbsError, match="window 'hat'"):
        averaged_frf(record, 128, window="hat")
    with pytest.raises(FbsError, match=r"must be 128 finite numbers, not all 0; got shape \(64,\)"):
        averaged_frf(record, 128, window=np.ones(64))
    with pytest.raises(FbsError, match="segment must be at least 2, got 1"):
        averaged_frf(record, 1)
    for ratio in (0.0, -1.0, np.nan):
        with pytest.raises(FbsError, match="noise_ratio must be"):
            averaged_frf(one, 128, estimator="Hv", noise_ratio=ratio)
    wide = noise_record(n_output=3)
    with pytest.raises(FbsError, match="H2 of 2 inputs needs as many outputs, got 3"):
        averaged_frf(wide, 128, estimator="H2")
    assert averaged_frf(replace(wide, inputs=one.inputs, excitations=("f0",)), 128, estimator="H2")
    for constant in (0.0, 0.1):
        silent = replace(record, inputs=record.inputs * [1, 0] + [0, constant])
        with pytest.raises(FbsError, match="input 'f1' is zero, or constant"):
            averaged_frf(silent, 128)
    twins = replace(record, inputs=record.inputs[:, [0, 0]] * [1, -3e5])
    with pytest.raises(SingularLineError, match="condition reaches inf, above 1e\\+04"):
        averaged_frf(twins, 128)


# --- impacts ------------------------------------------------------------------------------------


def pulse(n: int, fs: Any = FS, width: float = 4.0, start: int = 40) -> Any:
    """A Gaussian force: nothing above Nyquist (exp(-79)) and nothing after 50 samples."""
    return np.exp(-(((np.arange(n) - start) / width) ** 2) / 2)[:, None]


def struck(
    system: SecondOrderSystem,
    dof: Any,
    outputs: Any,
    n: int,
    quantity: str = "receptance",
    among: Any = None,
) -> Any:
    """The first n samples after an impact from rest, cut from a period long enough to forget."""
    force = pulse(64 * N)
    among = among or [dof]
    record = steady_record(system, force * [dof == other for other in among], among, outputs)
    record = replace(
        record,
        outputs=steady_output(system, force, [dof], outputs, quantity),
        quantity=quantity,
    )
    return record.span(0, n / FS)


def test_an_impact_that_dies_out_gives_the_frf() -> None:
    estimate = impulse_frf(struck(SYSTEM, "x1", ["x0", "x1"], 16 * N), fmin=20, fmax=6000)
    reference = direct_frf(SYSTEM, estimate.frf.frequency, ["x0", "x1"], ["x1"])
    assert scaled_error(estimate.frf, reference).max() < 1e-9
    assert (estimate.kind, estimate.n_averages, estimate.coherence) == ("impulse", 1, None)
    assert estimate.added_damping == 0


def test_the_exponential_window_adds_the_damping_it_says() -> None:
    decay = 400.0
    record = struck(SYSTEM, "x1", ["x0", "x1"], N // 2)
    assert np.abs(record.outputs[-100:]).max() > 1e-3 * np.abs(record.outputs).max()
    estimate = impulse_frf(record, decay=decay, fmin=20, fmax=6000)
    m, c, k = SYSTEM.mass, SYSTEM.damping, SYSTEM.stiffness
    shifted = replace(SYSTEM, damping=c + 2 * decay * m, stiffness=k + decay * c + decay**2 * m)
    reference = direct_frf(shifted, estimate.frf.frequency, ["x0", "x1"], ["x1"])
    assert scaled_error(estimate.frf, reference).max() < 1e-9
    assert estimate.added_damping == decay
    without = direct_frf(SYSTEM, estimate.frf.frequency, ["x0", "x1"], ["x1"])
    assert scaled_error(estimate.frf, without).max() > 0.1


def test_impacts_at_several_points_are_the_columns() -> None:
    dofs = ["x0", "x2"]
    records = [struck(SYSTEM, dof, ["x1", "x2"], 16 * N, among=dofs) for dof in dofs]
    estimate = impulse_frf(records, fmin=20, fmax=6000)
    reference = direct_frf(SYSTEM, estimate.frf.frequency, ["x1", "x2"], dofs)
    assert scaled_error(estimate.frf, reference).max() < 1e-9
    assert np.allclose(estimate.input_condition, 1)
    rng = np.random.default_rng(1)
    many = impulse_frf([noisy(r, rng, 0, 1e-12) for r in records * 5], fmin=20, fmax=6000)
    assert many.n_averages == 10
    assert many.coherence is not None
    assert 0.9 < np.median(many.coherence) < 1


def free_accelerations(n: int) -> Any:
    """Two masses on one spring, struck at the first: exact, rigid motion included."""
    m, k, c = 2.0, 4e6, 60.0
    frequency = np.arange(32 * N // 2 + 1) * FS / (32 * N)
    w = 2 * np.pi * frequency
    elastic = -(w**2) / (2 * k / m - w**2 + 2j * w * c / m) / (2 * m)
    force = pulse(32 * N)
    spectrum = np.fft.rfft(force[:, 0])
    y = np.stack([(1 / (2 * m) + s * elastic) * spectrum for s in (1, -1)], axis=-1)
    motion = np.fft.irfft(y, 32 * N, axis=0)
    record = Record(FS, force, motion, ("a",), ("a", "b"), "accelerance").span(0, n / FS)
    stiffness = k * np.array([[1.0, -1], [-1, 1]])
    return record, SecondOrderSystem(m * np.eye(2), c / k * stiffness, stiffness, ("a", "b"))


def test_a_free_body_gives_its_accelerance_down_to_zero_hertz() -> None:
    record, free = free_accelerations(8 * N)
    estimate = impulse_frf(record, fmin=0, fmax=3000)
    assert np.allclose(estimate.frf.values[0, :, 0], 1 / 4.0, rtol=1e-9)  # 1 / total mass
    above = estimate.frf.band(0.1)
    reference = direct_frf(free, above.frequency, ["a", "b"], ["a"], "accelerance")
    assert scaled_error(above, reference).max() < 1e-9
    receptance = direct_frf(free, above.frequency, ["a", "b"], ["a"])
    assert scaled_error(above.to("receptance"), receptance).max() < 1e-9


def test_a_drifting_displacement_is_refused() -> None:
    record, _ = free_accelerations(8 * N)
    drifting = np.cumsum(np.cumsum(record.outputs, axis=0), axis=0) / FS**2
    with pytest.raises(FbsError, match=r"'a' is still at 100 % .* record accelerations"):
        impulse_frf(replace(record, outputs=drifting, quantity="receptance"))


def test_a_free_body_under_a_multisine() -> None:
    system, force = free_accelerations(8 * N)[1], multisine(np.random.default_rng(1))
    record = steady_record(system, force, ["a"], ["a", "b"], "accelerance", periods=2)
    # a rigid velocity and place of any size are not in the accelerations
    estimate = periodic_frf(record, N)
    reference = direct_frf(system, BAND, ["a", "b"], ["a"], "accelerance")
    assert scaled_error(estimate.frf, reference).max() < 1e-10


def test_impulse_refuses() -> None:
    record = struck(SYSTEM, "x1", ["x0"], 4 * N)
    with pytest.raises(FbsError, match="record 1 has 100 samples and record 0 16384"):
        impulse_frf([record, record.span(0, 100 / FS)])
    with pytest.raises(FbsError, match="output 'x0' is still at"):
        impulse_frf(record.span(0, 300 / FS))
    with pytest.raises(FbsError, match="decay must be finite and not negative"):
        impulse_frf(record, decay=-1.0)
    with pytest.raises(FbsError, match="input 'x1' is zero"):
        impulse_frf(replace(record, inputs=0 * record.inputs))
    two = struck(SYSTEM, "x1", ["x0"], 4 * N, among=["x1", "x2"])
    with pytest.raises(FbsError, match="input 'x2' is zero"):
        impulse_frf(two)
    both = replace(two, inputs=two.inputs[:, [0, 0]])
    with pytest.raises(FbsError, match="2 inputs need at least 2 impacts, got 1"):
        impulse_frf(both)
    with pytest.raises(SingularLineError, match="cannot be told apart"):
        impulse_frf([both, both])
    with pytest.raises(FbsError, match="number of samples must be at least 2, got 1"):
        impulse_frf(record.span(0, 1 / FS))


# --- properties ---------------------------------------------------------------------------------

ESTIMATES: dict[str, Callable[[Record], Estimate]] = {
    "H1": lambda r: averaged_frf(r, 64),
    "H2": lambda r: averaged_frf(r, 64, estimator="H2"),
    "Hv": lambda r: averaged_frf(r, 64, estimator="Hv"),
    "periodic": lambda r: periodic_frf(
        [r, replace(r, inputs=r.inputs * [1, -1], outputs=r.outputs[::-1])], r.n_sample
    ),
}


@settings(max_examples=25, deadline=None)
@given(
    kind=st.sampled_from(sorted(ESTIMATES)),
    seed=st.integers(0, 1000),
    force=st.floats(1e-6, 1e6),
    motion=st.floats(1e-9, 1e3),
)
def test_estimates_scale_with_the_units(kind: Any, seed: int, force: float, motion: float) -> None:
    record = noise_record(seed, n=768)
    scaled = replace(record, inputs=record.inputs * force, outputs=record.outputs * motion)
    one, other = ESTIMATES[kind](record), ESTIMATES[kind](scaled)
    assert scaled_error(other.frf.values * force / motion, one.frf).max() < 1e-7
    assert np.allclose(one.input_condition, other.input_condition)


@settings(max_examples=25, deadline=None)
@given(kind=st.sampled_from(sorted(ESTIMATES)), seed=st.integers(0, 1000))
def test_estimates_do_not_depend_on_the_order_of_channels(kind: Any, seed: int) -> None:
    record = noise_record(seed, n=768)
    turned = Record(
        record.sampling_frequency,
        record.inputs[:, ::-1],
        record.outputs[:, ::-1],
        record.excitations[::-1],
        record.responses[::-1],
        record.quantity,
    )
    estimate = ESTIMATES[kind]
    if kind == "periodic":  # its second experiment turns the sign of the second input

        def estimate(r: Any) -> Any:
            sign = [1 if name == "f0" else -1 for name in r.excitations]
            other = replace(r, inputs=r.inputs * sign, outputs=r.outputs[::-1])
            return periodic_frf([r, other], r.n_sample)

    one, other = estimate(record), estimate(turned)
    again = other.frf.select(one.frf.responses, one.frf.excitations)
    assert scaled_error(again, one.frf).max() < 1e-7
    if one.coherence is not None:
        assert other.coherence is not None
        assert np.allclose(one.coherence, other.coherence[:, ::-1])


# --- a peer -------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def pyfrf() -> Any:
    from pyFRF import FRF  # takes its time to load

    return FRF


def peer_of(pyfrf: Any, record: Record, segment: Any, overlap: Any, window: Any) -> Any:
    # one measurement, (measurement, channel, sample); its sampling frequency must be an int
    return pyfrf(
        int(record.sampling_frequency),
        exc=record.inputs.T[None].copy(),
        resp=record.outputs.T[None].copy(),
        exc_type="f",
        resp_type="a",
        window=window,
        nperseg=segment,
        noverlap=round(overlap * segment),
        fft_len=segment,
    )


@pytest.mark.oracle
@pytest.mark.parametrize(("window", "overlap"), [("none", 0.0), ("hann", 0.5), ("hamming", 0.75)])
def test_pyfrf_has_the_same_estimates_of_one_input(pyfrf: Any, window: str, overlap: float) -> None:
    record = noise_record(n=8192, n_input=1, n_output=3)
    peer = peer_of(pyfrf, record, 512, overlap, window)
    windows: dict[str, Callable[[int], Any]]
    windows = {"none": np.ones, "hann": np.hanning, "hamming": np.hamming}
    values = windows[window](512)
    for estimator in ("H1", "H2", "Hv"):
        ours = averaged_frf(
            record, 512, overlap=overlap, window=values, estimator=estimator, noise_ratio=1.0
        )
        expected = peer.get_FRF(frf_estimator=estimator, frf_form="accelerance")
        expected = np.moveaxis(expected, -1, 0)[1:-1]
        assert np.array_equal(ours.frf.frequency, peer.get_f_axis()[1:-1])
        assert scaled_error(ours.frf, expected).max() < 1e-9
        assert ours.coherence is not None
        assert np.allclose(ours.coherence.T, peer.get_coherence()[:, 1:-1], atol=1e-9)


@pytest.mark.oracle
def test_pyfrf_has_the_same_estimates_of_two_inputs(pyfrf: Any) -> None:
    record = noise_record(n=8192)
    peer = peer_of(pyfrf, record, 512, 0.5, "hann")
    ours = averaged_frf(record, 512, window=np.hanning(512))
    expected = np.moveaxis(peer.get_FRF(frf_estimator="H1", frf_form="accelerance"), -1, 0)[1:-1]
    assert scaled_error(ours.frf, expected).max() < 1e-9
    assert ours.coherence is not None
    assert np.allclose(ours.coherence.T, peer.get_coherence()[:, 1:-1], atol=1e-9)
