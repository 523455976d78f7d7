"""How FRFs, modes, systems and records show themselves: a line, a table, a picture."""

from __future__ import annotations

import io
from collections.abc import Iterator

import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.figure import Figure

import fbs
from fbs import (
    FbsError,
    Frf,
    Quantity,
    Record,
    SecondOrderSystem,
    SparseSystem,
    complex_modes,
    direct_frf,
    real_modes,
)
from tests.showing import WORST_LABEL, line_of, text_of


@pytest.fixture(autouse=True)
def _close_figures() -> Iterator[None]:
    yield
    pyplot.close("all")


def chain(n: int, loss_factor: float = 0.0, damping: float = 0.0) -> SecondOrderSystem:
    """Masses of 1 kg in a row, free, with springs of 1e6 N/m."""
    stiffness = 1e6 * (2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    stiffness[0, 0] = stiffness[-1, -1] = 1e6
    labels = (WORST_LABEL, *(f"a.long.name.of.mass.number.{k}" for k in range(1, n)))
    return SecondOrderSystem(
        np.eye(n), damping * stiffness, stiffness, labels, {"hub.w": (labels[1], 0.5)}, loss_factor
    )


LINES = np.arange(1.0, 400.0, 2.0)  # 200 lines


def test_an_frf() -> None:
    frf = direct_frf(chain(200), LINES[:3], excitations=["hub.w"])
    assert line_of(frf) == "<Frf: receptance, 201 × 1, 3 lines, 1–5 Hz>"
    text = text_of(frf, WORST_LABEL)
    assert "receptance, m/N" in text
    assert "(201 in all)" in text
    assert len(text) < 1000


@pytest.mark.parametrize("quantity", Quantity)
def test_a_frf_says_its_unit(quantity: Quantity) -> None:
    frf = direct_frf(chain(2), [1.0], quantity=quantity)
    power = {"m/N": 0, "m/(N s)": 1, "m/(N s²)": 2}
    assert power[quantity.unit] == quantity.derivative
    assert quantity.unit in text_of(frf)
    assert "1 line, 1–1 Hz" in line_of(frf)


def test_modes() -> None:
    modes = real_modes(chain(200))
    # free chain: w_k = 2 sqrt(k / m) sin(k π / 2n), k = 1 … n − 1
    lowest, highest = 2e3 * np.sin(np.pi * np.array([1, 199]) / 400) / (2 * np.pi)
    summary = f"200 modes of 200 DoFs, 1 rigid-body, elastic {lowest:.6g}–{highest:.6g} Hz"
    assert line_of(modes) == f"<RealModes: {summary}>"
    text = text_of(modes)
    assert summary in text
    assert f"{lowest:.6g}" in text
    assert "and 188 more" in text
    assert line_of(modes.truncated([0])) == "<RealModes: 1 mode of 200 DoFs, 1 rigid-body>"


def test_damped_modes() -> None:
    modes = complex_modes(chain(20, damping=1e-5))
    assert f"{modes.poles.size} poles of 20 DoFs" in line_of(modes)
    text = text_of(modes)
    assert f"and {modes.poles.size - 12} more" in text
    slowest = modes.poles[np.abs(modes.poles) > 1.0]
    assert f"{np.abs(slowest).min() / (2 * np.pi):.6g}" in text


@pytest.mark.parametrize(
    ("arguments", "damping"),
    [
        ({}, "undamped"),
        ({"damping": 1e-6}, "viscously damped"),
        ({"loss_factor": 0.02}, "loss factor 0.02"),
    ],
)
def test_systems(arguments: dict[str, float], damping: str) -> None:
    dense = chain(30, **arguments)
    for system in (dense, SparseSystem.of(dense)):
        assert f"30 DoFs, 1 derived label, {damping}" in line_of(system)
        text = text_of(system, WORST_LABEL)
        assert damping in text
        assert "hub.w = 0.5 a.long.name.of.mass.number.1" in text


def record() -> Record:
    time = np.arange(2000) / 1000.0
    force = np.sin(2.0 * np.pi * 5.0 * time)[:, None]
    return Record(1000.0, force, np.hstack([force, -force]), ("f",), (WORST_LABEL, "b"), "mobility")


def test_a_record() -> None:
    made = record()
    assert line_of(made) == (
        "<Record: velocity, m/s, 1 + 2 channels, 2000 samples at 1000 Hz, 2 s>"
    )
    assert "forces, N, and velocity, m/s" in text_of(made, WORST_LABEL)


def test_an_frf_drawn() -> None:
    frf = direct_frf(chain(3, loss_factor=0.1), LINES, [WORST_LABEL, "hub.w"], ["hub.w"])
    magnitude, phase = frf.plot()
    assert magnitude.get_yscale() == "log"
    assert magnitude.get_ylabel() == "receptance, m/N"
    assert phase.get_xlabel() == "frequency, Hz"
    for k, (response, excitation, h) in enumerate(frf.curves()):
        np.testing.assert_array_equal(magnitude.lines[k].get_ydata(), np.abs(h))
        np.testing.assert_array_equal(phase.lines[k].get_ydata(), np.degrees(np.angle(h)))
        assert magnitude.lines[k].get_label() == f"{response} ← {excitation}"
    figure = magnitude.figure
    assert isinstance(figure, Figure)
    figure.savefig(io.BytesIO())  # what a label holds is no formula


def test_two_frfs_in_one_picture() -> None:
    frf = direct_frf(chain(2, loss_factor=0.1), LINES, ["hub.w"], ["hub.w"])
    axes = frf.plot()
    assert (2.0 * frf).plot(axes) == axes
    assert len(axes[0].lines) == 2
    with pytest.raises(FbsError, match="2 axes are needed, one a panel; got 1"):
        frf.plot(axes[:1])


def test_a_legend_names_what_can_be_read() -> None:
    many: Frf = direct_frf(chain(20, loss_factor=0.1), LINES)
    assert len(many.plot()[0].lines) == 21**2
    assert pyplot.gcf().axes[0].get_legend() is None
    few = many.select(many.responses[:20], many.excitations[:1])
    legend = few.plot()[0].get_legend()
    assert legend is not None
    assert len(legend.get_texts()) == 20


def test_a_record_drawn() -> None:
    made = record()
    forces, motion = made.plot()
    assert (forces.get_ylabel(), motion.get_ylabel()) == ("force, N", "velocity, m/s")
    np.testing.assert_array_equal(motion.lines[0].get_xdata(), made.time)
    np.testing.assert_array_equal(motion.lines[1].get_ydata(), made.outputs[:, 1])
    assert motion.get_xlabel() == "time, s"
    figure = motion.figure
    assert isinstance(figure, Figure)
    figure.savefig(io.BytesIO())
    with pytest.raises(FbsError, match="2 axes are needed"):
        made.plot([forces])


def test_public_names() -> None:
    assert sorted(set(fbs.__all__)) == sorted(fbs.__all__)
    assert all(hasattr(fbs, name) for name in fbs.__all__)
    assert not hasattr(fbs, "no_such_name")
