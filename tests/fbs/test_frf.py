"""The FRF object: validation, selection, arithmetic."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fbs import (
    AmbiguousDofError,
    AxisMismatchError,
    FbsError,
    Frf,
    NonFiniteError,
    Quantity,
    QuantityMismatchError,
    UnknownDofError,
    frequency_axis,
)

AXIS = np.array([1.0, 2.0, 4.0])


def example(
    axis: Any = AXIS,
    responses: tuple[str, ...] = ("sun.u", "sun.v"),
    excitations: tuple[str, ...] = ("sun.u", "hub.w", "x"),
    seed: int = 0,
) -> Any:
    rng = np.random.default_rng(seed)
    shape = (len(axis), len(responses), len(excitations))
    values = rng.standard_normal(shape) + 1j * rng.standard_normal(shape)
    return Frf(axis, values, responses, excitations)


def test_values_are_frequency_response_excitation() -> None:
    frf = example()
    assert np.array_equal(frf.between("sun.v", "hub.w"), frf.values[:, 1, 1])


def test_arrays_are_read_only_and_the_callers_stay_writable() -> None:
    values = np.ones((3, 1, 1), dtype=complex)
    frf = Frf(AXIS, values, ("a",), ("a",))
    with pytest.raises(ValueError, match="read-only"):
        frf.values[0] = 2
    with pytest.raises(ValueError, match="read-only"):
        frf.frequency[0] = 2
    assert values.flags.writeable
    values[:] = 3  # what was checked is not what the caller changes later
    assert (frf.values == 1).all()
    values.setflags(write=False)
    assert np.shares_memory(Frf(AXIS, values, ("a",), ("a",)).values, values)  # no copy


def test_a_frequency_contiguous_array_stays_so() -> None:
    values = np.zeros((2, 2, 3), dtype=complex).transpose(2, 0, 1)
    frf = Frf(AXIS, values, ("a", "b"), ("a", "b"))
    for other in (frf, frf + frf, 2 * frf, -frf, frf.to("mobility"), frf.select(["b"])):
        assert other.values.strides[0] == 16


def test_select_reorders_and_keeps_what_is_not_named() -> None:
    frf = example()
    part = frf.select(excitations=["x", "sun.u"])
    assert part.responses == frf.responses
    assert part.excitations == ("x", "sun.u")
    assert np.array_equal(part.values, frf.values[:, :, [2, 0]])


def test_an_unknown_label_names_the_nearest() -> None:
    with pytest.raises(UnknownDofError, match=r"'sun\.w'.*did you mean 'sun\.[uv]'"):
        example().between("sun.w", "x")
    with pytest.raises(UnknownDofError, match=r"it has sun\.u, sun\.v"):
        example().select(responses=["QQQ"])


@pytest.mark.parametrize("target", list(Quantity))
@pytest.mark.parametrize("source", list(Quantity))
def test_quantities_convert_by_powers_of_jw(source: Any, target: Any) -> None:
    frf = Frf(AXIS, np.ones((3, 1, 1)), ("a",), ("a",), source)
    power = list(Quantity).index(target) - list(Quantity).index(source)
    # one rounding in the power, one in the product
    expected = (2j * np.pi * AXIS) ** power
    assert np.allclose(frf.to(target).values[:, 0, 0], expected, rtol=4e-16, atol=0)
    assert frf.to(target).quantity == target


def test_integrating_at_zero_hertz_is_refused() -> None:
    frf = Frf([0.0, 1.0], np.ones((2, 1, 1)), ("a",), ("a",), "mobility")
    with pytest.raises(QuantityMismatchError, match="0 Hz"):
        frf.to(Quantity.RECEPTANCE)
    assert frf.to("accelerance").values[0, 0, 0] == 0


def test_magnitude_in_decibel() -> None:
    frf = Frf([1.0, 2.0], [[[10.0]], [[0.0]]], ("a",), ("a",))
    assert frf.magnitude_db()[0, 0, 0] == pytest.approx(20)
    assert frf.magnitude_db()[1, 0, 0] == -np.inf


def test_renamed_and_band() -> None:
    frf = example()
    renamed = frf.renamed({"sun.u": "planetary.sun.u"})
    assert renamed.responses == ("planetary.sun.u", "sun.v")
    assert renamed.excitations == ("planetary.sun.u", "hub.w", "x")
    with pytest.raises(UnknownDofError):
        frf.renamed({"sun.q": "a"})
    with pytest.raises(AmbiguousDofError):
        frf.renamed({"sun.u": "sun.v"})
    assert np.array_equal(frf.band(2, 4).frequency, [2, 4])
    assert np.shares_memory(frf.band(2, 4).values, frf.values)
    with pytest.raises(FbsError, match="no line between"):
        frf.band(2.5, 3)


def test_arithmetic() -> None:
    a, b = example(seed=1), example(seed=2)
    assert np.array_equal((a + b).values, a.values + b.values)
    assert np.array_equal((a - b).values, a.values - b.values)
    assert np.array_equal((-a).values, -a.values)
    assert np.array_equal((2j * a).values, (a * 2j).values)
    assert np.array_equal((np.float64(3) * a).values, 3 * a.values)
    with pytest.raises(TypeError):
        a + 1
    with pytest.raises(TypeError):
        a * "2"
    with pytest.raises(TypeError):
        a - [1]


def test_mismatches_name_the_first_difference() -> None:
    a = example()
    with pytest.raises(AxisMismatchError, match=r"line 1 is 2 Hz .* 3 Hz"):
        a + example(axis=np.array([1.0, 3.0, 4.0]))
    with pytest.raises(AxisMismatchError, match="3 lines against 2"):
        a - example(axis=AXIS[:2])
    with pytest.raises(AxisMismatchError, match=r"responses differ at 1: 'sun\.v' against 'y'"):
        a + example(responses=("sun.u", "y"))
    with pytest.raises(AxisMismatchError, match="3 excitations against 1"):
        a + example(excitations=("x",))
    with pytest.raises(QuantityMismatchError, match="receptance against mobility"):
        a + a.to("mobility")


def test_bad_input_is_refused_by_name() -> None:
    one = np.ones((3, 1, 1))
    with pytest.raises(FbsError, match=r"shape \(3, 1, 1\)"):
        Frf(AXIS, one, ("a", "b"), ("a",))
    with pytest.raises(FbsError, match="ascend"):
        Frf([1.0, 3.0, 3.0], one, ("a",), ("a",))
    with pytest.raises(FbsError, match="negative"):
        Frf([-1.0, 3.0, 4.0], one, ("a",), ("a",))
    with pytest.raises(FbsError, match="one-dimensional"):
        Frf([[1.0]], one, ("a",), ("a",))
    with pytest.raises(NonFiniteError, match="line 1"):
        Frf([1.0, np.nan, 4.0], one, ("a",), ("a",))
    with pytest.raises(AmbiguousDofError, match="'a' more than once"):
        Frf(AXIS, np.ones((3, 2, 1)), ("a", "a"), ("a",))
    with pytest.raises(FbsError, match="single string"):
        Frf(AXIS, one, "a", ("a",))
    with pytest.raises(FbsError, match="non-empty"):
        Frf(AXIS, one, ("",), ("a",))
    with pytest.raises(QuantityMismatchError, match="'inertance' is none of receptance"):
        Frf(AXIS, one, ("a",), ("a",), "inertance")


def test_a_non_finite_value_is_named() -> None:
    values = np.ones((3, 2, 1), dtype=complex)
    values[1, 1, 0] = np.nan
    with pytest.raises(NonFiniteError, match=r"from 'c' to 'b' is .*nan.* at 2 Hz \(1 values"):
        Frf(AXIS, values, ("a", "b"), ("c",))
    # values whose sum overflows are finite all the same
    Frf(AXIS, np.full((3, 2, 1), 1e308), ("a", "b"), ("c",))


def test_frfs_travel_between_processes() -> None:
    frf = example()
    copy = pickle.loads(pickle.dumps(frf))
    assert np.array_equal(copy.values, frf.values)
    assert copy.responses == frf.responses


def test_frequency_axis_includes_both_ends() -> None:
    axis = frequency_axis(1, 15000, 1)
    assert axis[0] == 1
    assert axis[-1] == 15000
    assert axis.size == 15000


@given(
    st.sampled_from([0.1, 0.25, 0.5, 1.0, 2.0, 0.01, 5.0]),
    st.integers(0, 500),
    st.integers(0, 500),
)
def test_frequency_axis_is_exact_multiples(df: float, first: Any, count: int) -> None:
    axis = frequency_axis(first * df, (first + count) * df, df)
    per_hertz = 1 / df
    # the correctly rounded decimal: what float("0.3") gives, not 3 * 0.1
    expected = [float(f"{(first + k) * df:.6f}") for k in range(count + 1)]
    assert per_hertz > 0
    assert axis.tolist() == expected


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ((1, 10, 0), "df must be positive"),
        ((-1, 10, 1), "0 <= fmin"),
        ((10, 1, 1), "fmin <= fmax"),
        ((0.5, 10, 1), "fmin = 0.5 Hz is no multiple"),
        ((0, 10.5, 1), "fmax = 10.5 Hz is no multiple"),
        ((0, np.inf, 1), "finite"),
    ],
)
def test_frequency_axis_refuses_nonsense(
    limits: tuple[float, int, int] | tuple[int, float, int] | tuple[int, int, int], message: str
) -> None:
    with pytest.raises(FbsError, match=message):
        frequency_axis(*limits)
