"""Whatever comes in at a public door ends in a result or in an error of this package."""

from __future__ import annotations

import datetime
import fractions
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fbs
from fbs import (
    AxisMismatchError,
    FbsError,
    Frf,
    Joint,
    PeriodicSpring,
    Record,
    SecondOrderSystem,
    SparseSystem,
    couple_chain,
    direct_frf,
    modal_frf,
    real_modes,
    truncate,
)
from fbs.signal import spectra
from tests.fbs.fbs_systems import random_system

AXIS = np.array([10.0, 20.0, 30.0])
STIFFNESS, MASS = np.array([[3e6, -1e6], [-1e6, 1e6]]), np.diag([1.0, 2.0])
SYSTEM = SecondOrderSystem(MASS, 1e-5 * STIFFNESS, STIFFNESS, ("a", "b"), {"h": ("a", 2.0)})
OTHER = SecondOrderSystem(MASS, 1e-5 * STIFFNESS, STIFFNESS, ("c", "d"))
FRF, OTHER_FRF = direct_frf(SYSTEM, AXIS), direct_frf(OTHER, AXIS)
JOINT = Joint(("p", "a"), ("q", "c"), 1e5)
SQUARE = FRF.select(["a", "b"], ["a", "b"])
KNOWN = OTHER_FRF.renamed({"c": "a"})
AB = fbs.couple({"p": SQUARE, "q": KNOWN}, [Joint(("p", "a"), ("q", "a"))]).frf
LOOSE = fbs.couple({"p": FRF, "q": OTHER_FRF}, [JOINT]).frf
SPARSE = SparseSystem.of(SYSTEM)
MODES, PAIRS = real_modes(SYSTEM), fbs.complex_modes(SYSTEM)
SPRING: dict[str, Any] = {
    "name": "mesh", "vector": np.array([1.0, -1.0]), "stiffness": 1e5, "ratio": 20.0,
    "variation": np.array([0.1, 0.02j]), "error": np.zeros(2), "damping": 0.0, "static_force": 0.0,
}  # fmt: skip
SPRINGS = [PeriodicSpring(**SPRING)]
NOISE = np.random.default_rng(0).standard_normal((256, 1))
RECORD = Record(256.0, NOISE, NOISE, ("a",), ("b",), "receptance")
PERIODS = Record(256.0, np.tile(NOISE[:64], (4, 1)), np.tile(NOISE[:64], (4, 1)), ("a",), ("b",), "receptance")  # fmt: skip  # noqa: E501
IMPACT = Record(256.0, (np.arange(256) == 5.0)[:, None] * 1.0, np.exp(-np.arange(256) / 6)[:, None], ("a",), ("b",), "receptance")  # fmt: skip  # noqa: E501
BALANCE = fbs.steady_state(SYSTEM, SPRINGS, [1.0], harmonics=3)
LINES = fbs.outputs(BALANCE, np.eye(2))

ASKED: dict[str, Any] = {
    "frequency": AXIS, "responses": ("a",), "excitations": ("b",), "quantity": "receptance",
}  # fmt: skip
BAND: dict[str, Any] = {"fmin": 4.0, "fmax": 60.0, "threshold": 1e-4, "max_condition": 1e4}

CALLS: dict[str, tuple[Callable[..., Any], dict[str, Any]]] = {
    "Frf": (Frf, {**ASKED, "values": np.ones((3, 1, 1))}),
    "select": (FRF.select, {"responses": ("a",), "excitations": ("b",)}),
    "between": (FRF.between, {"response": "a", "excitation": "b"}),
    "to": (FRF.to, {"quantity": "mobility"}),
    "renamed": (FRF.renamed, {"names": {"a": "z"}}),
    "band": (FRF.band, {"fmin": 10.0, "fmax": 20.0}),
    "frequency_axis": (fbs.frequency_axis, {"fmin": 1.0, "fmax": 10.0, "df": 1.0}),
    "SecondOrderSystem": (
        SecondOrderSystem,
        {"mass": MASS, "damping": 0 * MASS, "stiffness": STIFFNESS, "dofs": ("a", "b"),
         "derived": {"h": ("a", 2.0)}, "loss_factor": 0.1},
    ),
    "SparseSystem": (
        SparseSystem,
        {"mass": MASS, "damping": 0 * MASS, "stiffness": STIFFNESS, "dofs": ("a", "b")},
    ),
    "SparseSystem.of": (SparseSystem.of, {"system": SYSTEM}),
    "locate": (SYSTEM.locate, {"labels": ("a",)}),
    "direct_frf": (direct_frf, {**ASKED, "system": SYSTEM, "block": 4}),
    "modal_frf": (modal_frf, {**ASKED, "system": SYSTEM, "modes": MODES}),
    "modal_frf of pairs": (modal_frf, {"system": SYSTEM, "frequency": AXIS, "modes": PAIRS}),
    "schur_frf": (fbs.schur_frf, {**ASKED, "system": SYSTEM, "modes": MODES}),
    "synthesize": (fbs.synthesize, {**ASKED, "system": SYSTEM, "method": "direct"}),
    "sparse_frf": (fbs.sparse_frf, {**ASKED, "system": SPARSE}),
    "reduced_frf": (
        fbs.reduced_frf, {**ASKED, "system": SPARSE, "tolerance": 1e-8, "largest": 2}
    ),
    "real_modes": (real_modes, {"system": SYSTEM, "rigid_tolerance": 1e-10}),
    "complex_modes": (fbs.complex_modes, {"system": SYSTEM, "modes": MODES}),
    "poles": (fbs.poles, {"system": SYSTEM}),
    "truncate": (
        truncate, {"system": SYSTEM, "keep": slice(0, 1), "residual_order": 1, "modes": MODES}
    ),
    "truncated": (MODES.truncated, {"kept": [0]}),
    "Joint": (
        Joint,
        {"first": ("p", "a"), "second": ("q", "c"), "stiffness": 1e5, "damping": 1.0, "ratio": 1.0},
    ),
    "couple": (
        fbs.couple,
        {"substructures": {"p": FRF, "q": OTHER_FRF}, "joints": [JOINT], "responses": ("a",),
         "excitations": ("d",)},
    ),
    "couple_chain": (
        couple_chain,
        {"parts": {"p": SYSTEM, "q": OTHER}, "joints": [JOINT], "frequency": AXIS,
         "responses": ("a",), "excitations": ("d",)},
    ),
    "MatrixJoint": (
        fbs.MatrixJoint,
        {"first": [("p", "a"), ("p", "b")], "second": [("q", "c"), ("q", "d")],
         "stiffness": 1e5 * np.eye(2), "damping": np.eye(2), "ratio": 1.0},
    ),
    "StiffnessTable": (
        fbs.StiffnessTable, {"frequency": AXIS, "values": np.array([1e5, 2e5, 3e5])}
    ),
    "decouple": (
        fbs.decouple,
        {"assembly": AB, "known": KNOWN, "interface": ("a",), "internal": (),
         "form": "standard", "responses": ("a",), "excitations": ("a",), "rank": 1,
         "tikhonov": 0.0},
    ),
    "decouple_primal": (
        fbs.decouple_primal, {"assembly": AB, "known": KNOWN, "interface": ("a",)}
    ),
    "decouple_systems": (
        fbs.decouple_systems, {"assembly": SYSTEM, "known": SYSTEM, "interface": ("a",)}
    ),
    "joint_in_situ": (
        fbs.joint_in_situ, {"assembly": LOOSE, "at": [("a", "c")], "relative": 0.01}
    ),
    "joint_between": (
        fbs.joint_between,
        {"assembly": LOOSE, "first": FRF, "second": OTHER_FRF, "at": [("a", "c")],
         "relative": 0.01},
    ),
    "fit_spring": (
        fbs.fit_spring, {"joint": fbs.joint_in_situ(LOOSE, [("a", "c")]), "pair": 0}
    ),
    "guyan": (fbs.guyan, {"system": SYSTEM, "masters": ("a",)}),
    "dynamic": (fbs.dynamic, {"system": SYSTEM, "masters": ("a",), "frequency": 10.0}),
    "irs": (fbs.irs, {"system": SYSTEM, "masters": ("a",), "iterations": 2}),
    "serep": (fbs.serep, {"system": SYSTEM, "masters": ("a", "b"), "modes": MODES}),
    "craig_bampton": (
        fbs.craig_bampton, {"system": SYSTEM, "interface": ("a",), "count": 1}
    ),
    "rubin": (fbs.rubin, {"system": SYSTEM, "interface": ("a",), "count": 1}),
    "macneal": (fbs.macneal, {"system": SYSTEM, "interface": ("a",), "count": 1}),
    "dual_craig_bampton": (
        fbs.dual_craig_bampton, {"system": SYSTEM, "interface": ("a",), "count": 1}
    ),
    "projected": (fbs.projected, {"system": SYSTEM, "vectors": np.eye(2)}),
    "serep_expansion": (fbs.serep_expansion, {"modes": MODES, "measured": ("a", "b")}),
    "semm": (
        fbs.semm, {"model": SQUARE, "measured": SQUARE, "form": "basic", "rank": 1}
    ),
    "singular_basis": (
        fbs.singular_basis,
        {"frf": SQUARE, "responses": ("a", "b"), "excitations": ("a", "b"), "rank": 1},
    ),
    "condense_free": (fbs.condense_free, {"frf": FRF, "masters": ("a",)}),
    "condense_blocked": (
        fbs.condense_blocked, {"frf": FRF.select(["a", "b"], ["a", "b"]), "masters": ("a",)}
    ),
    "condense_dynamic_stiffness": (
        fbs.condense_dynamic_stiffness,
        {"system": SYSTEM, "frequency": AXIS, "masters": ("a",)},
    ),
    "block_dofs": (fbs.block_dofs, {"system": SYSTEM, "dofs": ("a",)}),
    "PeriodicSpring": (PeriodicSpring, SPRING),
    "Record": (
        Record,
        {"sampling_frequency": 256.0, "inputs": NOISE, "outputs": NOISE, "excitations": ("a",),
         "responses": ("b",), "quantity": "receptance"},
    ),
    "span": (RECORD.span, {"start": 0.0, "stop": 0.5}),
    "averaged_frf": (
        fbs.averaged_frf,
        {**BAND, "records": RECORD, "segment": 64, "overlap": 0.5, "window": "hann",
         "estimator": "H1", "noise_ratio": None, "remove_mean": True},
    ),
    "periodic_frf": (
        fbs.periodic_frf,
        {**BAND, "records": PERIODS, "period_samples": 64, "transient_periods": 1},
    ),
    "impulse_frf": (
        fbs.impulse_frf, {**BAND, "records": IMPACT, "decay": 0.0, "max_remainder": 0.1}
    ),
    "steady_state": (
        fbs.steady_state,
        {"system": SYSTEM, "springs": SPRINGS, "shaft_frequency": [1.0], "harmonics": 3,
         "combinations": 2, "step": None},
    ),
    "stability": (
        fbs.stability,
        {"system": SYSTEM, "springs": SPRINGS, "shaft_frequency": [1.0], "highest_hz": 500.0,
         "harmonics": 3},
    ),
    "outputs": (fbs.outputs, {"response": BALANCE, "rows": np.eye(2), "quantity": "receptance"}),
    "waveform": (
        fbs.waveform, {"lines": LINES, "lattice": BALANCE.lattice, "turns": np.array([0.0, 0.5])}
    ),
    "extremes": (fbs.extremes, {"lines": LINES, "lattice": BALANCE.lattice}),
    "lattice": (fbs.lattice, {"springs": SPRINGS, "harmonics": 3, "combinations": 2}),
    "amplitude_spectrum": (
        spectra.amplitude_spectrum, {"samples": NOISE[:, 0], "sampling_frequency": 256.0}
    ),
    "rms": (spectra.rms, {"samples": NOISE[:, 0], "sampling_frequency": 256.0}),
}  # fmt: skip

FEW: list[Any] = [
    None, 3, -1, float("nan"), float("inf"), "x", b"x", [], {}, {"a", "b"}, object(), True,
    np.ma.masked_array([1.0, 2.0, 3.0], [False, True, False]),
    np.array(["2020"], dtype="datetime64[D]"),
    np.array([1 + 1j, 2, 3]), [[1], [2, 3]], [None], ("a",), {"a": 1}, FRF, SYSTEM,
]  # fmt: skip
MORE: list[Any] = [
    *FEW, 0, 1.5, -np.inf, "", set(), np.array(["a"]), np.full(3, np.nan), np.full((2, 2), np.nan),
    datetime.datetime(2020, 1, 1), object, ["a", 1], {"p": None}, {"p": FRF, "q": None},
    [JOINT, None], [3], [FRF], SPARSE, MODES, PAIRS, RECORD, JOINT, SPRINGS, np.array(5.0),
    np.zeros(0), np.zeros((3, 3, 3)), 1e308, -1e308, 10**400, 1 + 1j, fractions.Fraction(1, 3),
    range(3), {"h": ("a", None)}, {"h": 3}, {"h": ("a", np.nan)}, slice(0, 1), slice("a", None),
    np.array([[1, 2], [3, 4]], dtype=object), pickle, Path("/nowhere"),
]  # fmt: skip


def refused(name: str, values: list[Any]) -> int:
    """Put every value in every argument's place; anything but this package's errors comes out."""
    function, valid = CALLS[name]
    function(**valid)
    count = 0
    for key in valid:
        for value in values:
            try:
                function(**{**valid, key: value})
            except FbsError:
                count += 1
            except Exception as error:  # any other is the fault looked for: said with its call
                raise AssertionError(f"{name}({key}={value!r}): {error!r}") from error
    return count


@pytest.mark.parametrize("name", CALLS)
@pytest.mark.filterwarnings("ignore")
def test_wrong_types_end_in_the_packages_errors(name: str) -> None:
    with np.errstate(all="ignore"):
        # most of the kinds fit no argument at all
        assert refused(name, FEW) > len(FEW) / 3 * len(CALLS[name][1])


@pytest.mark.slow
@pytest.mark.parametrize("name", CALLS)
@pytest.mark.filterwarnings("ignore")
def test_any_value_ends_in_a_result_or_the_packages_errors(name: str) -> None:
    with np.errstate(all="ignore"):
        refused(name, MORE)


def test_modes_of_another_system_are_refused_though_their_labels_are_the_same() -> None:
    rng = np.random.default_rng(4)
    one, other = random_system(rng, 5), random_system(rng, 5)
    with pytest.raises(AxisMismatchError, match="belong to another system"):
        modal_frf(one, AXIS, modes=real_modes(other))
    with pytest.raises(AxisMismatchError, match="belong to another system"):
        modal_frf(one, AXIS, modes=fbs.complex_modes(other))
    with pytest.raises(AxisMismatchError, match="belong to another system"):
        truncate(one, slice(0, 2), 0, real_modes(other))
    with pytest.raises(AxisMismatchError, match="belong to another system"):
        fbs.schur_frf(one, AXIS, modes=real_modes(other))
    damped = SecondOrderSystem(one.mass, 1e-6 * one.stiffness, one.stiffness, one.dofs)
    modal_frf(damped, AXIS, modes=real_modes(one))  # damping leaves the undamped modes


def test_a_residual_series_is_not_summed_where_it_diverges() -> None:
    modes = truncate(SYSTEM, slice(0, 1), 1)
    assert modal_frf(SYSTEM, [0.5 * modes.series_limit], modes=modes)
    with pytest.raises(FbsError, match="the residuals' series diverges from the first left-out"):
        modal_frf(SYSTEM, [1.0, 1.5 * modes.series_limit], modes=modes)


@pytest.mark.parametrize(
    "synthesis",
    [
        lambda system, axis, r, e: direct_frf(system, axis + 1.0, r, e),
        lambda system, axis, r, e: direct_frf(system, axis[1:], r, e),
        lambda system, axis, r, e: direct_frf(system, axis, r, e, "mobility"),
        lambda system, axis, r, e: direct_frf(system, axis, r, e).values,
    ],
)
def test_a_chains_synthesis_must_return_what_it_was_asked_for(synthesis: Any) -> None:
    with pytest.raises(FbsError, match="the synthesis of part 'p'"):
        couple_chain({"p": SYSTEM, "q": OTHER}, [JOINT], AXIS, ["a"], ["d"], synthesis)


def test_what_comes_out_of_a_pickle_is_checked_and_keeps_its_bound() -> None:
    again = pickle.loads(pickle.dumps(FRF))
    np.testing.assert_array_equal(again.round_off, FRF.round_off)
    bad = pickle.dumps(FRF).replace(
        FRF.values.transpose(1, 2, 0)[0, 0, 0].tobytes(), np.complex128(np.nan).tobytes()
    )
    with pytest.raises(FbsError, match=r"is \(nan"):
        pickle.loads(bad)


def test_the_callers_arrays_cannot_change_what_was_checked() -> None:
    mass, axis = MASS.copy(), AXIS.copy()
    system = SecondOrderSystem(mass, 0 * mass, STIFFNESS, ("a", "b"))
    frf = direct_frf(system, axis)
    mass[:], axis[:] = np.nan, 0.0
    assert np.isfinite(system.mass).all()
    np.testing.assert_array_equal(frf.frequency, AXIS)
