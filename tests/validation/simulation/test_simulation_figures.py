"""Figures of runs: what they say, that nothing overlaps, and that no data breaks them."""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Annotation
from numpy.typing import NDArray

from fbs.signal.spectra import amplitude_spectrum, spectrogram
from mbs_models.gears.gear_lines import MeshTone, gear_lines, measured_lines
from mbs_models.gears.gear_response import mesh_loads
from validation.report.digits import engineering
from validation.report.frf_panel import frf_figure
from validation.report.style import spread
from validation.simulation import frf_figures, order_figures, record_figures
from validation.simulation.frf_figures import (
    LevelCurve,
    estimate_panel,
    level_figure,
    peak_hold_panel,
)
from validation.simulation.order_figures import Theory, order_figure
from validation.simulation.record_figures import (
    history_figure,
    mesh_figure,
    rms_figure,
    spectrogram_figure,
    spectrum_figure,
)

RATE = 4000.0
TIME = np.arange(20000) / RATE
NOISE = np.random.default_rng(1).standard_normal(TIME.size)
FREQUENCY = np.arange(10.0, 2000.0, 0.5)
FRF: NDArray[np.complex128] = np.asarray(
    1 / (1 - (FREQUENCY / 300) ** 2 + 0.01j * FREQUENCY / 300), complex
)


def text_of(picture: Any) -> Any:
    root = ElementTree.fromstring(picture)
    return " ".join("".join(node.itertext()) for node in root.iter() if node.tag.endswith("text"))


def planetary_lines(sidebands: int = 8) -> Any:
    tones = [MeshTone("mesh planetary", 400.0, 3.2, 4), MeshTone("mesh reducer", 1111.0)]
    wave = sum(np.cos(2 * np.pi * f * TIME) for f in (396.8, 409.6, 806.4, 1111.0))
    spectrum = amplitude_spectrum(wave + 1e-4 * NOISE, RATE)
    lines = gear_lines(tones, harmonics=4, sidebands=sidebands, highest=1900.0)
    (read,) = measured_lines(lines, (wave + 1e-4 * NOISE)[:, None], RATE)
    return spectrum.frequency, spectrum.values, read


def pictures() -> Any:
    frequency, values, lines = planetary_lines()
    shown = spectrogram(NOISE, RATE, resolution=20.0)
    forces = np.column_stack([1e3 + 100 * NOISE, np.maximum(100 * NOISE, 0.0), -5.0 + NOISE])
    loads = mesh_loads(("first mesh", "open mesh", "reversed mesh"), forces, np.sign(forces))
    levels = [
        LevelCurve(force, None if force > 5e3 else FRF, 1e-4 * force, 1e-5 * force)
        for force in (1.0, 30.0, 9e3)
    ]
    levels[-1] = LevelCurve(9e3, None, np.inf, np.inf)
    rms = {"s.sun": {"u": 1.0, "w": 2.0}, "coupling": {"w": 0.0}}
    theory = Theory(np.array([396.8, 409.6]), np.array([1.0, 1.0]))
    return {
        "history": history_figure("h", TIME, {"s.sun.u": NOISE, "s.sun.w": 0 * NOISE}, "m"),
        "spectrum": spectrum_figure(
            "s", frequency, {"s.sun.u": values, "still": 0 * values}, "m", natural=(300.0, 9e9)
        ),
        "spectrogram": spectrogram_figure(
            "g", shown.time, shown.frequency, shown.values, "m", "s.sun.u"
        ),
        "silence": spectrogram_figure(
            "z", shown.time, shown.frequency, 0 * shown.values, "m", "still"
        ),
        "rms": rms_figure("r", rms, "m/s²"),
        "meshes": mesh_figure("m", TIME, forces, loads),
        "orders": order_figure("o", frequency, values, lines, "N", "ring sensor", theory=theory),
        "no lines": order_figure("n", frequency, values, (), "N", "nothing turns"),
        "frf": frf_figure(estimate(1.001 * FRF, FRF == FRF), "f", "estimate"),
        "equal": frf_figure(estimate(FRF, np.abs(FRF) > 0.1), "e", "estimate"),
        "hold": frf_figure(
            peak_hold_panel(
                "a ← b", FREQUENCY, FRF, FREQUENCY[9::9], np.abs(FRF)[9::9],
                (np.array([301.0]), np.array([99.0])),
            ),
            "p", "peak-hold",
        ),
        "levels": level_figure("l", FREQUENCY, FRF, levels, "a ← b", 0.1),
    }  # fmt: skip


def estimate(values: Any, compared: Any) -> Any:
    return estimate_panel("a ← b", FREQUENCY, values, FRF, compared, (0.1, 1.0))


def test_figures_are_wellformed_and_say_what_they_show() -> None:
    drawn = {name: text_of(picture) for name, picture in pictures().items()}
    for name, words in {
        "history": ("s.sun.u", "s.sun.w", "Time (s)"),
        "spectrum": ("natural frequencies", "Frequency (Hz)", "still"),
        "spectrogram": ("dB re 1 m", "Time (s)", "Frequency (Hz)"),
        "rms": ("s.sun", "2.24 m/s²", "RMS about the mean"),  # √5
        "meshes": ("max/mean", "open 50 %", "reversed mesh", "mean 999 N"),
        "orders": ("1·mesh reducer", "+ 3·carrier", "− 2·planet pass", "theory"),
        "frf": ("a ← b", "Error (dB)", "Error (°)", "allowed"),
        "hold": ("peak-hold of the sweep", "peaks at this sweep rate (theory)"),
        "levels": ("above 0.1 dB FBS no longer applies", "9 kN (diverged)", "30 N"),
    }.items():
        for word in words:
            assert word in drawn[name], name


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Figures instead of SVG: what was drawn can be measured."""
    kept: list[Figure] = []

    def keep(figure: Figure, name: str, words: str) -> str:
        kept.append(figure)
        return ""

    for module in (record_figures, order_figures, frf_figures):
        monkeypatch.setattr(module, "svg", keep)
    return kept


@pytest.mark.parametrize("sidebands", [0, 4, 8])
def test_labels_of_lines_neither_overlap_nor_leave_their_axes(drawn: Any, sidebands: int) -> None:
    frequency, values, lines = planetary_lines(sidebands)
    order_figure("o", frequency, values, lines, "N", "ring sensor")
    renderer = FigureCanvasAgg(drawn[0]).get_renderer()  # type: ignore[no-untyped-call]
    drawn[0].draw(renderer)
    for axes in drawn[0].axes:
        boxes = [
            # the text alone, without its arrow
            super(Annotation, label).get_window_extent(renderer)
            for label in axes.texts
        ]
        area = axes.get_window_extent(renderer)
        for number, box in enumerate(boxes):
            assert area.x0 - 8 <= box.x0 and box.x1 <= area.x1 + 8  # noqa: PT018
            assert box.y1 <= area.y1 + 1
            assert not any(box.overlaps(other) for other in boxes[:number])
    # every line is named once, in the zoom of its harmonic or in the whole
    names = sum(len(axes.texts) for axes in drawn[0].axes)
    assert names == len(lines) + (4 if sidebands else 0)


def test_a_million_samples_are_drawn_as_the_band_they_fill(drawn: Any) -> None:
    wave = np.zeros(1_000_000)
    wave[123_456], wave[654_321] = 7.0, -5.0  # one sample each: neither may be lost
    history_figure("h", np.arange(wave.size) / 1e4, {"w": wave}, "m")
    (band,) = drawn[0].axes[0].collections
    height = np.concatenate([path.vertices[:, 1] for path in band.get_paths()])
    assert (height.max(), height.min()) == (7.0, -5.0)
    assert height.size < 5000


def test_a_spectrogram_is_thinned_without_losing_a_line(drawn: Any) -> None:
    values = np.full((5000, 3000), 1e-3)
    values[3333, 2222] = 1.0
    spectrogram_figure("g", np.arange(5000.0), np.arange(3000.0), values, "m", "s.sun.u")
    image = drawn[0].axes[0].images[0].get_array()
    assert image.shape == (400, 1000)
    assert image.max() == pytest.approx(0.0, abs=1e-12)
    row, column = np.unravel_index(image.argmax(), image.shape)
    assert (row, column) == (2222 * 400 // 3000, 3333 * 1000 // 5000)


@given(
    wanted=st.lists(st.floats(0, 1), min_size=1, max_size=60).map(sorted),
    width=st.floats(0.001, 0.2),
)
def test_spread_keeps_order_and_distance(wanted: list[float], width: float) -> None:
    places = spread(np.array(wanted), width)
    step = min(width, 1 / len(wanted))
    assert (np.diff(places) >= step * (1 - 1e-9)).all()
    assert places[0] >= 0
    assert places[-1] <= 1 + 1e-9


def test_spread_leaves_alone_what_is_apart() -> None:
    assert spread(np.array([0.1, 0.5, 0.9]), 0.1) == pytest.approx([0.1, 0.5, 0.9])
    assert spread(np.array([0.5, 0.5]), 0.1) == pytest.approx([0.45, 0.55])  # least squares


def test_engineering_has_three_digits() -> None:
    assert engineering(1234.5, "N") == "1.23 kN"
    assert engineering(-2.5e-7, "m") == "−250 nm"
