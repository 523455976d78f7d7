"""Blocks, threads and memory: the same numbers whatever the cut, and little beside the result."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from fbs import Frf, Joint, couple, direct_frf, frequency_axis, modal_frf, real_modes, schur_frf
from fbs._kernels.blas_threads import blas_for, one_blas_thread
from fbs._kernels.blocks import cores, each, stretches
from fbs._kernels.finite import RUN, square_sum, surely_finite
from fbs._kernels.weighted_sum import LINES, TERMS, WeightedSum
from fbs.errors import NonFiniteError
from tests.fbs.fbs_systems import hub_system, random_system, scaled_error

DAMPING = {
    "undamped": lambda rng: 0.0,
    "proportional": lambda rng: 1e-6,
    "general": lambda rng: rng.uniform(0, 1e-5),
}


def test_stretches_cover_everything_once() -> None:
    assert [(s.start, s.stop) for s in stretches(10, 4)] == [(0, 4), (4, 8), (8, 10)]
    assert list(stretches(0, 4)) == []


def test_the_number_of_threads_follows_blas(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    assert cores() == 3
    for nonsense in ("0", "-1", "many", ""):
        monkeypatch.setenv("OMP_NUM_THREADS", nonsense)
        assert cores() >= 1


@pytest.mark.parametrize("threads", ["1", "3"])
def test_what_a_task_raises_is_raised(threads: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", threads)

    def job(task: Any) -> None:
        if task == 5:
            raise KeyError(task)

    with pytest.raises(KeyError):
        each(job, range(8), 2**30)


@pytest.mark.parametrize("symmetric", [False, True])
@pytest.mark.parametrize("n_terms", [0, 1, 7, 2 * TERMS + 5])
@pytest.mark.parametrize("n_lines", [1, LINES, 5 * LINES + 3])
def test_a_weighted_sum_is_the_plain_product(symmetric: bool, n_terms: Any, n_lines: Any) -> None:
    rng = np.random.default_rng(n_terms)
    rows, columns = (9, 9) if symmetric else (5, 40)
    weights = rng.standard_normal((rows, columns, n_terms))
    if symmetric:
        weights = weights + weights.transpose(1, 0, 2)
    omega = np.arange(1.0, n_lines + 1)
    power = np.arange(n_terms)[:, None] % 5

    def gains(w: Any, out: Any) -> Any:
        out[:] = (1j / w) ** power
        return (w == 7.0)[:, 0]

    weighted = WeightedSum(weights.shape, lambda i: weights[i], gains, symmetric)
    values, singular, finite = weighted(omega)
    expected = weights @ (1j / omega) ** power
    # n_terms sums of terms up to 4
    assert np.abs(values - expected).max() <= 4 * n_terms * 4 * np.finfo(float).eps
    assert (singular == (omega == 7.0)).all()
    assert finite


def test_a_wide_row_is_cut_into_several_products() -> None:
    rng = np.random.default_rng(0)
    weights = rng.standard_normal((2, 5000, 1))

    def gains(w: Any, out: Any) -> Any:
        out[:] = 1 / w
        return np.zeros((len(w), w.shape[2]), dtype=bool)

    values, _, _ = WeightedSum(weights.shape, lambda i: weights[i], gains)(np.array([1.0, 2.0]))
    np.testing.assert_array_equal(values, weights * [1.0, 0.5])


def stages() -> Any:
    return {
        "a": random_system(np.random.default_rng(1), 9, "a", beta=DAMPING["proportional"]),
        "b": hub_system(2, grounded=True, beta=DAMPING["general"]),
    }


def jobs() -> Any:
    """Everything that runs in blocks, on one axis, with enough lines for several threads."""
    axis = frequency_axis(1, 4000, 1)
    systems = {kind: hub_system(3, grounded=True, beta=beta) for kind, beta in DAMPING.items()}
    frfs = {name: modal_frf(system, axis) for name, system in stages().items()}
    joints = [Joint(("a", "a3"), ("b", "hub")), Joint(("a", "a5"), ("b", "x7"), 1e7, 10.0)]
    made = {kind: lambda s=s: modal_frf(s, axis) for kind, s in systems.items()}
    return made | {
        "coupling": lambda: couple(frfs, joints).frf,
        "direct": lambda: direct_frf(systems["general"], axis),
        "schur": lambda: schur_frf(systems["general"], axis, None, ["x1", "x2"]),
    }


@pytest.mark.parametrize("name", ["undamped", "proportional", "general", "coupling", "schur"])
def test_results_do_not_depend_on_the_threads(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    job = jobs()[name]
    results = []
    for threads in ("1", "2", "5"):
        monkeypatch.setenv("OMP_NUM_THREADS", threads)
        results.append(job().values)
    for other in results[1:]:
        np.testing.assert_array_equal(other, results[0])


@pytest.mark.parametrize("name", ["undamped", "proportional", "general", "coupling", "direct"])
def test_little_memory_beside_the_result(name: str) -> None:
    job = jobs()[name]
    job()  # imports and LAPACK's workspaces
    tracemalloc.start()
    try:
        frf = job()
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak <= 1.3 * frf.values.nbytes


def test_many_joints_and_another_memory_order_take_little_memory_too() -> None:
    axis = frequency_axis(1, 8000, 1)
    frfs = {name: modal_frf(system, axis) for name, system in stages().items()}
    c_order = {
        name: Frf(axis, np.ascontiguousarray(frf.values), frf.responses, frf.excitations)
        for name, frf in frfs.items()
    }
    joints = [Joint(("a", f"a{k}"), ("b", f"x{k + 1}"), 1e7) for k in range(5)]
    for parts in (frfs, c_order):
        tracemalloc.start()
        try:
            frf = couple(parts, joints).frf
            peak = tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()
        assert peak <= 1.3 * frf.values.nbytes


def test_symmetric_halves_are_mirrored_exactly() -> None:
    for beta in DAMPING.values():
        values = modal_frf(hub_system(4, beta=beta), frequency_axis(10, 2000, 10)).values
        np.testing.assert_array_equal(values, values.transpose(0, 2, 1))


def test_a_skew_damping_is_not_mirrored() -> None:
    """Rows are responses: H^T is the FRF of the system with C^T, and H is not its own."""
    system = random_system(np.random.default_rng(8), 6)
    spin = np.random.default_rng(9).standard_normal((6, 6)) * 1e3
    turning = type(system)(
        system.mass, spin - spin.T + 50 * np.eye(6), system.stiffness, system.dofs
    )
    backwards = type(system)(system.mass, turning.damping.T, system.stiffness, system.dofs)
    axis = frequency_axis(20, 4000, 20)
    expected = direct_frf(turning, axis)
    for made in (modal_frf, schur_frf):
        frf = made(turning, axis)
        assert scaled_error(frf, expected).max() < 1e-11  # no line nearer than 1e-4 to a pole
        assert scaled_error(frf.values.transpose(0, 2, 1), made(backwards, axis)).max() < 1e-11
        assert scaled_error(frf.values.transpose(0, 2, 1), expected).max() > 0.1


def test_given_modes_and_a_part_of_the_labels_are_the_same_sum() -> None:
    system = hub_system(5, beta=DAMPING["general"])
    axis = frequency_axis(10, 3000, 10)
    whole = modal_frf(system, axis, modes=real_modes(system))
    part = modal_frf(system, axis, ["x3", "hub"], ["x9", "x3", "x1"])
    expected = whole.select(["x3", "hub"], ["x9", "x3", "x1"]).values
    # another cut of the products may round otherwise: eps times terms of up to 1e2 times the sum
    assert np.abs(part.values / expected - 1).max() < 1e-9


def blas_threads() -> Any:
    return [pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"]


def test_blas_gets_its_threads_back_when_the_last_lets_go() -> None:
    with threadpool_limits(2):
        before = blas_threads()
        with one_blas_thread():
            with one_blas_thread():
                assert set(blas_threads()) == {1}
            assert set(blas_threads()) == {1}
        assert blas_threads() == before
        with pytest.raises(KeyError), one_blas_thread():
            raise KeyError
        assert blas_threads() == before
        with blas_for(30):
            assert set(blas_threads()) == {1}
        with blas_for(10_000):
            assert blas_threads() == before


@pytest.mark.parametrize("bad", [np.nan, np.inf, complex(0, -np.inf), complex(1, np.nan)])
@pytest.mark.parametrize("place", [0, RUN - 1, RUN, 3 * RUN + 6])
@pytest.mark.parametrize("order", ["contiguous", "gaps between rows", "gaps between lines"])
def test_nothing_infinite_is_overlooked(bad: Any, place: Any, order: str) -> None:
    values = np.ones((2, 3 * RUN + 7), dtype=complex)
    if order == "gaps between rows":
        values = np.ones((2, 4 * RUN), dtype=complex)[:, : values.shape[1]]
    if order == "gaps between lines":
        values = np.ones((2, 2 * values.shape[1]), dtype=complex)[:, ::2]
    assert square_sum(values) == values.size  # whole numbers: exact
    values[1, place] = bad
    assert not surely_finite(values)


def test_what_overflows_on_the_way_is_refused() -> None:
    """An FRF between two parts is a product of FRFs: here of 1e200 and 1e200."""
    axis = frequency_axis(1, 3, 1)
    values = np.full((3, 2, 2), 1e200 + 0j)
    values[:, 1, 1] = 1.0
    parts = {name: Frf(axis, values, (name, name * 2), (name, name * 2)) for name in "ab"}
    joint = Joint(("a", "aa"), ("b", "bb"))
    with (
        np.errstate(over="ignore", invalid="ignore"),
        pytest.raises(NonFiniteError, match="from 'a' to 'a'"),
    ):
        couple(parts, [joint])
    across = couple(
        {"a": parts["a"], "b": Frf(axis, np.ones((3, 1, 1)), ("bb",), ("bb",))},
        [joint],
        ["a"],
        ["bb"],
    )
    assert np.isfinite(across.frf.values).all()  # 1e200 squared overflows, the FRF does not
    with np.errstate(over="ignore", invalid="ignore"), pytest.raises(NonFiniteError):
        couple(parts, [joint], ["a"], ["b"])


def test_a_sum_that_overflows_is_refused_and_a_large_one_is_not() -> None:
    axis = frequency_axis(1, 200, 1)
    frfs = []
    for size in (1.0, 1e80, 1e160):
        system = random_system(np.random.default_rng(1), 4)
        system = replace(system, derived={f"y{k}": (f"x{k}", size) for k in range(4)})
        labels = tuple(system.derived)
        with np.errstate(over="ignore", invalid="ignore"):
            if size == 1e160:
                with pytest.raises(NonFiniteError):
                    modal_frf(system, axis, labels, labels)
            else:
                frfs.append(modal_frf(system, axis, labels, labels).values)
    np.testing.assert_allclose(frfs[1] / 1e160, frfs[0], rtol=1e-12)
