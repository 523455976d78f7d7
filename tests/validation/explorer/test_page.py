"""The page in a real browser: what it shows, what it lets in, and what it asks of nobody."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import parse_qs, urlencode

import numpy as np
import pytest

from fbs import Frf, direct_frf
from fbs.files.frf_files import read_frf, write_frf
from mbs_models import load
from mbs_models.model.parameters import Drivetrain
from tests.browser import Browser, browser, needs_chromium
from tests.gearboxes import pair
from tests.strategies import changed, damped
from validation.explorer.page import explorer_page
from validation.routes.source import equations_source, exudyn_source

pytest.importorskip("bokeh")
pytestmark = [needs_chromium, pytest.mark.browser, pytest.mark.slow]

READY = "document.documentElement.dataset.ready"
LARGEST = 6e6  # bytes of the paper's page
NAMES = (
    '</script><script>document.title="broken"</script><img src=x onerror="document.title=1">',
    "\"quoted\" 'single' & &amp; `tick` ${1} {{ 2 }}",
    "علبة تروس كوكبية من مرحلتين",
    "a" * 200,
)


def write(drivetrain: Drivetrain, path: Path) -> Path:
    page = explorer_page(exudyn_source(drivetrain), equations_source(drivetrain))
    path.write_text(page, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def paper(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(damped(load("paper")), tmp_path_factory.mktemp("explore") / "explore.html")


@pytest.fixture(scope="module")
def opened() -> Iterator[Browser]:
    with browser() as one:
        yield one


@pytest.fixture
def tab(opened: Browser, paper: Path) -> Iterator[Browser]:
    """The paper's page, which asks for nothing else and complains of nothing."""
    opened.size(1400, 1000)
    opened.open(paper, ready=READY)
    yield opened
    assert opened.errors == []
    assert {address.partition("#")[0] for address in opened.requests} == {paper.as_uri()}


def text(tab: Browser, element: str) -> str:
    return str(tab.run(f"document.getElementById({element!r}).textContent"))


def choose(tab: Browser, element: str, value: str) -> None:
    tab.run(
        f"(() => {{ const one = document.getElementById({element!r}); one.value = {value!r}; "
        "one.dispatchEvent(new Event('input')); one.dispatchEvent(new Event('change')); })()"
    )


def state(tab: Browser) -> dict[str, str]:
    parsed = parse_qs(str(tab.run("location.hash"))[1:])
    return {name: values[0] for name, values in parsed.items()}


def press(tab: Browser, key: str) -> None:
    tab.run(
        "document.getElementById('frf').dispatchEvent(new KeyboardEvent('keydown', "
        f"{{key: {key!r}, cancelable: true}}))"
    )


SAVED = """new Promise((done) => {
  const make = URL.createObjectURL;
  URL.createObjectURL = (blob) => {
    const reader = new FileReader();
    reader.onload = () => done(reader.result);
    reader.readAsDataURL(blob);
    URL.createObjectURL = make;
    return make.call(URL, blob);
  };
  document.getElementById(%r).click();
})"""
CROSSINGS = """[...document.querySelectorAll("#crossings tr")].map((row) =>
  [...row.children].map((cell) => cell.textContent))"""


def saved(tab: Browser, button: str) -> bytes:
    """What a button saves."""
    return base64.b64decode(str(tab.run(SAVED % button)).partition(",")[2])


def test_its_size(paper: Path) -> None:
    assert paper.stat().st_size < LARGEST


def test_the_cursor_reads_what_python_computes(tab: Browser) -> None:
    choose(tab, "quantity", "mobility")
    press(tab, "PageUp")
    where, _, rest = text(tab, "reading").partition(" Hz: ")
    level = float(rest.split()[0].replace("−", "-"))
    system = exudyn_source(damped(load("paper"))).whole
    found = direct_frf(
        system, [float(where)], ["planetary.sun.w"], ["reducer.pinion.w"], "mobility"
    )
    assert level == pytest.approx(abs(found.values[0, 0, 0]), rel=1e-3)  # 7 digits of a peak's Hz


def test_the_address_is_the_view(opened: Browser, paper: Path, tab: Browser) -> None:
    wanted = {
        "response": "reducer.wheel.y",
        "excitation": "planetary.sun.w",
        "quantity": "accelerance",
        "route": "FBS of equations stages",
        "against": "whole: exudyn",
        "below": "difference",
        "from": "100.000",
        "to": "2000.00",
        "set.k:coupling.second_stiffness": "2.5e6",
    }
    opened.open(paper, f"#{urlencode(wanted)}", READY)
    found = state(opened)
    assert found["set.k:coupling.second_stiffness"] == "2.50000e+6"
    assert {name: found[name] for name in list(wanted)[:-1]} == dict(list(wanted.items())[:-1])
    assert text(opened, "sliders-of").count("2.50e6 N/m") == 1


@pytest.mark.parametrize("bad", ["#response=nobody&from=-1&to=x&set.k:none=3&at=NaN", "#%%%&==&&"])
def test_an_address_that_says_nothing(tab: Browser, paper: Path, bad: str) -> None:
    tab.open(paper, bad, READY)
    assert state(tab)["response"] == "planetary.sun.w"


def test_a_slider_moves_the_resonance(tab: Browser) -> None:
    """The shaft's spring alone holds the first mode: f grows with the root of it."""
    before = float(str(tab.run("document.querySelectorAll('#resonances button')[1].textContent")))
    choose(tab, "slider-k:coupling.second_stiffness", "0.3")
    after = float(str(tab.run("document.querySelectorAll('#resonances button')[1].textContent")))
    assert after == pytest.approx(before * 10**0.15, rel=0.01)
    assert "set.k:coupling.second_stiffness" in state(tab)
    tab.run("document.getElementById('reset').click()")
    assert "set.k:coupling.second_stiffness" not in state(tab)


def test_a_resonance_shows_its_shape(tab: Browser) -> None:
    tab.run("document.querySelectorAll('#resonances button')[8].click()")
    assert text(tab, "shape").startswith("Mode 9: 1536.6")
    assert "rotational, planetary" in text(tab, "shape")
    transforms = "[...document.querySelectorAll('.mv')].map((one) => one.style.transform)"
    first = tab.run(transforms)
    tab.wait(
        f"JSON.stringify({transforms}) !== {json.dumps(json.dumps(first, separators=(',', ':')))}"
    )
    assert all(first)


def test_csv_is_crosschecks_own(tab: Browser, tmp_path: Path) -> None:
    path = tmp_path / "saved.csv"
    path.write_bytes(saved(tab, "csv"))
    frf = read_frf(path).frf
    system = exudyn_source(damped(load("paper"))).whole
    expected = direct_frf(system, frf.frequency, frf.responses, frf.excitations)
    error = np.abs(frf.values - expected.values) / np.abs(expected.values)
    assert np.median(error) < 1e-9


@pytest.mark.parametrize(("kind", "start"), [("png", b"\x89PNG"), ("svg", b"<svg")])
def test_pictures(tab: Browser, kind: str, start: bytes) -> None:
    found = saved(tab, kind)
    assert found.startswith(start)
    assert len(found) > 5000


def test_files_are_read_and_held_against_the_page(tab: Browser, tmp_path: Path) -> None:
    """An npz and a CSV of the same FRF, twice as large: 6.02 dB at every line."""
    system = exudyn_source(damped(load("paper"))).whole
    lines = np.linspace(50, 900, 300)
    own = direct_frf(system, lines, ["reducer.pinion.w", "planetary.sun.w"], ["reducer.pinion.w"])
    double = Frf(own.frequency, 2 * own.values, own.responses, own.excitations)
    paths = [tmp_path / "double.npz", tmp_path / "double.csv"]
    for path in paths:
        write_frf(double, path)
    choose(tab, "below", "difference")
    tab.choose_files("#files", *paths)
    tab.wait("document.querySelectorAll('#loaded select').length === 2")
    for number in (1, 2):
        below = drawn_below(tab, number)
        assert len(below) == 300
        assert below == pytest.approx(300 * [20 * np.log10(2)], abs=1e-6)
    choose(tab, "response", "reducer.pinion.w")  # which the files have as well
    assert "double.npz: reducer.pinion.w ← reducer.pinion.w" in text(tab, "legend")
    assert drawn_below(tab, 1) == pytest.approx(300 * [20 * np.log10(2)], abs=1e-6)


def drawn_below(tab: Browser, number: int) -> list[float]:
    """What the lower axes show of a file."""
    source = f"map((one) => one.get_model_by_name('file{number}')).find(Boolean)"
    return list(tab.run(f"Array.from(Bokeh.documents.{source}.data.below)"))


def test_a_file_of_other_dofs_has_no_difference(tab: Browser, tmp_path: Path) -> None:
    lines = np.linspace(50, 900, 20)
    write_frf(Frf(lines, np.ones((20, 1, 1)) + 0j, ["a.x"], ["b.y"]), tmp_path / "other.csv")
    choose(tab, "below", "difference")
    tab.choose_files("#files", tmp_path / "other.csv")
    tab.wait("document.querySelectorAll('#loaded select').length === 1")
    assert "a.x ← b.y, not of this model: no difference" in text(tab, "legend")
    assert not any(value is not None and np.isfinite(value) for value in drawn_below(tab, 1))


@pytest.mark.parametrize(
    ("name", "inside", "said"),
    [
        ("x.npz", b"no zip", "is no npz file"),
        ("x.csv", b"a,b\n1,2\n", "its first column is 'a'; it must be frequency_hz"),
        ("x.csv", b"frequency_hz,b\n1,2\n", "has no column"),
        ("x.txt", b"", "is no .npz and no .csv file"),
        ("<img src=x onerror=alert(1)>.csv", b"f,b\n", "has no column"),
    ],
)
def test_files_that_are_none(
    tab: Browser, tmp_path: Path, name: str, inside: bytes, said: str
) -> None:
    (tmp_path / name).write_bytes(inside)
    tab.choose_files("#files", tmp_path / name)
    tab.wait("document.querySelector('#loaded .problem')")
    assert text(tab, "loaded").startswith(f"{name}: {said}")


@pytest.mark.parametrize("width", [420, 1400, 3840])
def test_it_fits_its_window(tab: Browser, width: int) -> None:
    tab.size(width, 1000)
    tab.wait(f"innerWidth === {width}")
    tab.run("new Promise((done) => setTimeout(done, 300))")
    assert tab.run("document.documentElement.scrollWidth") <= width


def test_every_control_has_a_name(tab: Browser) -> None:
    nameless = tab.run(
        "[...document.querySelectorAll('main select, main input, main button')].filter((one) => "
        "!(one.labels?.length || one.ariaLabel || one.textContent.trim())).length"
    )
    assert nameless == 0


@pytest.mark.parametrize("name", NAMES)
def test_names_do_no_harm(opened: Browser, tmp_path: Path, name: str) -> None:
    path = write(changed(pair(), name=name, source=name), tmp_path / "page.html")
    opened.size(420, 900)
    opened.open(path, ready=READY)
    assert opened.run("document.querySelector('h1').textContent") == name
    assert opened.run("document.title") == f"{name}: explore"
    assert opened.run("document.documentElement.scrollWidth") <= 420
    assert opened.run("document.querySelectorAll('script').length") == 3
    assert opened.errors == []
    assert len(opened.requests) == 1


def test_a_gearbox_has_its_orders(opened: Browser, tmp_path: Path) -> None:
    """20 teeth and one elastic mode at √(2k/m): their mesh meets it at 60/20 of it, in rpm."""
    opened.open(write(pair(), tmp_path / "pair.html"), ready=READY)
    rows = opened.run(CROSSINGS)
    hertz = np.sqrt(2 * 2e8) / (2 * np.pi)
    speeds = [float(row[1]) for row in rows]
    assert min(abs(np.array(speeds) / (60 * hertz / 20) - 1)) < 1e-4


def test_a_mouse_zooms_and_all_comes_back(tab: Browser) -> None:
    """Drag a box, and the range is its; `Whole range` shows the band again, with every height."""
    x, y, wide = tab.run(
        "(() => { const { x, y, width } = document.getElementById('frf').getBoundingClientRect();"
        " return [x, y, width]; })()"
    )
    for kind, share, down in (
        ("mousePressed", 0.6, 100), ("mouseMoved", 0.7, 150), ("mouseMoved", 0.8, 200),
        ("mouseReleased", 0.8, 200),
    ):  # fmt: skip
        tab.send(
            "Input.dispatchMouseEvent", type=kind, x=x + share * wide, y=y + down, button="left",
            buttons=1, clickCount=1,
        )  # fmt: skip
    tab.wait("!location.hash.includes('to=15000.0')")
    zoomed = state(tab)
    assert 100.0 < float(zoomed["from"]) < float(zoomed["to"]) < 10000.0
    tab.run("document.getElementById('all').click()")
    tab.wait("location.hash.includes('to=15000.0')")
    heights = "Bokeh.documents.map((one) => one.get_model_by_name('level'))[0].y_range"
    assert tab.run(f"{heights}.end / {heights}.start") > 1e12
