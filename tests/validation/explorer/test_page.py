"""The page in a real browser: what it shows, what it lets in, and what it asks of nobody."""

from __future__ import annotations

import base64
import io
import json
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any
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
        "from": "100",
        "to": "2000",
        "set.k:coupling.second_stiffness": "2.5e6",
    }
    opened.open(paper, f"#{urlencode(wanted)}", READY)
    found = state(opened)
    assert found["set.k:coupling.second_stiffness"] == "2.50000e+6"
    assert {name: found[name] for name in list(wanted)[:-1]} == dict(list(wanted.items())[:-1])
    assert text(opened, "sliders-of").count("2.50e6 N/m") == 1


@pytest.mark.parametrize(
    "bad",
    [
        "response=nobody&from=-1&to=x&set.k:none=3&at=NaN",
        "%%%&==&&",
        "from=1e-300",
        "to=1e300",
        "from=100&to=100",
        "from=200&to=100",
        "at=-5",
        "at=1e400",
        *(f"set.{key}={value}"
          for key in ("k:coupling.second_stiffness", "mass:planetary", "stiffness:planetary")
          for value in ("0", "-1", "1e-300", "1e300", "Infinity", "", "x")),
        *(f"set.{key}={value}" for key in ("alpha", "beta") for value in ("", "1e300", "-1")),
        "set.mass:constructor=2",
    ],
)  # fmt: skip
def test_an_address_that_says_nothing(tab: Browser, paper: Path, bad: str) -> None:
    """What no control can be set to is left as it is: no page that is dead or of another model."""
    standard = state(tab)
    tab.open(paper, f"#{bad}", READY)
    assert state(tab) == standard
    assert "NaN" not in text(tab, "reading") + text(tab, "shape")


def test_one_end_of_a_range_is_enough(tab: Browser, paper: Path) -> None:
    tab.open(paper, "#to=50", READY)
    assert (state(tab)["from"], state(tab)["to"]) == ("1", "50")
    choose(tab, "from", "60")  # beyond the other end: the range stays, and is said again
    assert tab.run("document.getElementById('from').value") == "1"


def test_a_narrow_range_has_all_its_lines(tab: Browser, paper: Path) -> None:
    tab.open(paper, "#from=100&to=100.001", READY)
    assert (state(tab)["from"], state(tab)["to"]) == ("100", "100.001")
    assert int(tab.run("document.documentElement.dataset.lines")) >= 4000


def test_a_route_without_joints_does_not_claim_to_be_changed(tab: Browser) -> None:
    """A spring is changed by FBS; the whole stays as modelled, and both legends say so."""
    choose(tab, "slider-k:coupling.second_stiffness", "0.3")
    choose(tab, "against", "whole: exudyn")
    assert "FBS of exudyn stages, changed" in text(tab, "legend")
    unmoved = "whole: exudyn, its couplings and parts as modelled"
    assert text(tab, "legend").endswith(unmoved)
    choose(tab, "route", "whole: exudyn")
    choose(tab, "against", "FBS of equations stages")
    assert unmoved in text(tab, "legend")
    assert text(tab, "legend").endswith("FBS of equations stages, changed")


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


HEAD = b"frequency_hz,re mobility b <- a (m/s/N),im mobility b <- a (m/s/N)\n"
ARRAYS = {
    "frequency": np.array([10.0, 20.0]),
    "values": np.ones((2, 1, 1), complex),
    "responses": np.array(["b"]),
    "excitations": np.array(["a"]),
}


def npz(**arrays: Any) -> bytes:
    """What `np.savez` writes of an FRF with some arrays in place of others."""
    file = io.BytesIO()
    np.savez(file, **ARRAYS | arrays)
    return file.getvalue()


def npz_with(name: str, member: bytes) -> bytes:
    """The same with a member that is no array."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive, np.load(io.BytesIO(npz())) as sound:
        for key in sound.files:
            own = io.BytesIO()
            np.save(own, sound[key])
            archive.writestr(f"{key}.npy", member if key == name else own.getvalue())
    return file.getvalue()


def header(descr: str, shape: str) -> bytes:
    """Of an array of NumPy's format."""
    text = f"{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text


def test_a_file_may_have_more_than_is_asked(tab: Browser, tmp_path: Path) -> None:
    more = {"good": np.array([True, False]), "runs": np.array([1, 2], np.uint8)}
    (tmp_path / "x.npz").write_bytes(npz(**more))
    tab.choose_files("#files", tmp_path / "x.npz")
    tab.wait("document.querySelectorAll('#loaded select').length === 1")


@pytest.mark.parametrize("order", ["C", "F"])
def test_each_frf_of_a_matrix_is_its_own(tab: Browser, tmp_path: Path, order: Any) -> None:
    """Phases 0, 10, 20, … degrees in the order of line, response, excitation."""
    degrees = 10.0 * np.arange(12).reshape(2, 2, 3)
    values = np.array(np.exp(1j * np.radians(degrees)), order=order)
    labels = {"responses": np.array(["b", "c"]), "excitations": np.array(["d", "e", "f"])}
    (tmp_path / "x.npz").write_bytes(npz(values=values, **labels))
    tab.choose_files("#files", tmp_path / "x.npz")
    tab.wait("document.querySelectorAll('#loaded option').length === 6")
    for number in range(6):
        tab.run(
            "(() => { const one = document.querySelector('#loaded select'); "
            f"one.value = '{number}'; one.dispatchEvent(new Event('change')); }})()"
        )
        expected = degrees[:, number // 3, number % 3]
        assert drawn_below(tab, 1) == pytest.approx(expected, abs=1e-9)


def test_a_wide_table_is_read_at_once(tab: Browser, tmp_path: Path) -> None:
    """900 FRFs: time that grows with the square of the columns would be minutes."""
    columns = (f"{part} mobility r{k} <- a (m/s/N)" for k in range(900) for part in ("re", "im"))
    rows = (",".join([str(line), *1800 * ["1"]]) for line in range(1, 501))
    (tmp_path / "wide.csv").write_text("\n".join([",".join(["frequency_hz", *columns]), *rows]))
    tab.choose_files("#files", tmp_path / "wide.csv")
    tab.wait("document.querySelectorAll('#loaded option').length === 900")


@pytest.mark.parametrize(
    ("name", "inside", "said"),
    [
        ("x.npz", b"no zip", "is no npz file"),
        ("x.npz", npz().replace(np.float64(20.0).tobytes(), np.float64(30.0).tobytes()),
         "is damaged: its array frequency does not have its check sum"),
        ("x.npz", npz_with("frequency", b"hello"), "is damaged"),
        ("x.npz", npz_with("frequency", header("<f8", "(1000000000000000,)")), "is damaged"),
        ("x.npz", npz_with("frequency", header("<f8", "(50,)")), "is damaged"),
        ("x.npz", npz_with("responses", header("<U0", "(4000000000,)")), "is damaged"),
        ("x.npz", npz_with("responses", header("<U1", "(1,)") + b"\xff" * 4), "is damaged"),
        ("x.npz", npz(frequency=np.array([[10.0, 20.0]])), "must be real numbers (Hz), one a line"),
        ("x.npz", npz(frequency=np.array([20.0, 10.0])), "its line 2 is 10 Hz; lines must rise"),
        ("x.npz", npz(frequency=np.array([10.0, 10.0])), "its line 2 is 10 Hz; lines must rise"),
        ("x.npz", npz(frequency=np.array([-1.0, 10.0])), "its line 1 is -1 Hz; lines must rise"),
        ("x.npz", npz(values=np.full((2, 1, 1), np.nan + 0j)), "b ← a is no number at 10 Hz"),
        ("x.npz", npz(frequency=np.zeros(0), values=np.zeros((0, 1, 1), complex)), "has no FRF"),
        ("x.csv", HEAD, "has no FRF"),
        ("x.csv", HEAD + b"2,1,0\n1,1,0\n", "its line 2 is 1 Hz; lines must rise"),
        ("x.csv", HEAD.replace(b"m/s/N", b"m/N") + b"1,1,0\n",
         "its mobility is in m/N; must be m/s/N"),
        ("x.csv", HEAD.strip() + HEAD[12:] + b"1,1,0,1,0\n", "more than once"),
        ("x.csv", b"a,b\n1,2\n", "its first column is 'a'; it must be frequency_hz"),
        ("x.csv", b"frequency_hz,b\n1,2\n", "has no column"),
        ("x.txt", b"", "is no .npz and no .csv file"),
        ("<img src=x onerror=alert(1)>.csv", b"f,b\n", "has no column"),
    ],
)  # fmt: skip
def test_files_that_are_none(
    tab: Browser, tmp_path: Path, name: str, inside: bytes, said: str
) -> None:
    (tmp_path / name).write_bytes(inside)
    tab.choose_files("#files", tmp_path / name)
    tab.wait("document.querySelector('#loaded .problem')")
    assert text(tab, "loaded").startswith(f"{name}: ")
    assert said in text(tab, "loaded")


@pytest.mark.parametrize("width", [420, 1400, 3840])
def test_it_fits_its_window(tab: Browser, width: int) -> None:
    tab.size(width, 1000)
    tab.wait(f"innerWidth === {width}")
    tab.run("new Promise((done) => setTimeout(done, 300))")
    assert tab.run("document.documentElement.scrollWidth") <= width


CUT = """[...document.querySelectorAll("#choice select")].filter((one) => {
  const free = one.cloneNode(true);
  free.style.cssText = "display: inline-block; width: auto; position: absolute";
  one.parentElement.append(free);
  const { offsetWidth } = free; // as wide as its widest option
  free.remove();
  return offsetWidth > one.offsetWidth;
}).map((one) => one.id)"""


@pytest.mark.parametrize("width", [420, 1400, 3840])
def test_no_choice_is_cut(tab: Browser, width: int) -> None:
    tab.size(width, 1000)
    tab.wait(f"innerWidth === {width}")
    assert tab.run(CUT) == []


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
    tab.wait("!location.hash.includes('to=15000')")
    zoomed = state(tab)
    assert 100.0 < float(zoomed["from"]) < float(zoomed["to"]) < 10000.0
    tab.run("document.getElementById('all').click()")
    tab.wait("location.hash.includes('to=15000')")
    heights = "Bokeh.documents.map((one) => one.get_model_by_name('level'))[0].y_range"
    assert tab.run(f"{heights}.end / {heights}.start") > 1e12
