"""Pages on a telephone, in a real browser, of a drivetrain with a name that would break them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.browser import Browser, browser, needs_chromium
from tests.contracts.pins import MODELS, call

pytestmark = [needs_chromium, pytest.mark.browser, pytest.mark.slow]

WIDTH = 420
NAME = (
    "</title></style></script><script>document.title=1</script><img src=x onerror=alert(1)> "
    "\"quoted\" 'single' & &amp; {{ 1 }} علبة تروس كوكبية " + 60 * "a"
)
COMMANDS = {
    "report.html": "run {model} --fmin 40 --fmax 4000 --df 40 --no-time",
    "simulation.html": "simulate {model} --speed 1500 --torque 10 --duration 0.05 --fmax 2000",
    "sweep.html": "sweep {model} --vary pair.mesh_stiffness=1e8:3e8:3 --vary pair.pinion.mass=1,2"
    " --df 50 --fmax 2000 --modes 3 --response pair.pinion.w --excitation pair.pinion.w"
    " --executor serial",
    "truncation.html": "truncate {model} --band 40:4000:40",
    "speed.html": "speed {model} --speed 1000:2000:500 --harmonics 2 --executor serial",
}
# What reaches beyond the window without a frame that scrolls
BEYOND = """[...document.querySelectorAll("body *")].filter((one) =>
  one.getBoundingClientRect().right > innerWidth + 1 && !one.closest(".scroll, svg")).length
"""
# Text that something hides
CUT = """[...document.querySelectorAll("body *:not(svg *)")].filter((one) =>
  getComputedStyle(one).overflowX === "hidden" && one.scrollWidth > one.clientWidth + 1).length"""


@pytest.fixture(scope="module")
def tab() -> Iterator[Browser]:
    with browser() as opened:
        opened.size(WIDTH, 900)
        yield opened


@pytest.mark.parametrize("page", COMMANDS)
def test_a_page_fits_and_its_names_do_no_harm(tab: Browser, tmp_path: Path, page: str) -> None:
    model = tmp_path / "odd.toml"
    lines = (MODELS / "pair.toml").read_text(encoding="utf-8").splitlines()
    first = next(k for k, line in enumerate(lines) if line.startswith("name ="))
    lines[first] = f"name = '''{NAME}'''\nsource = '''{NAME}'''"
    model.write_text("\n".join(lines), encoding="utf-8")
    called = call(*COMMANDS[page].format(model=model).split(), "--out", str(tmp_path))
    assert called.code == 0, called.err
    tab.open(tmp_path / page)
    assert NAME in tab.run("document.querySelector('h1').textContent")
    assert tab.run("document.querySelectorAll('script, img').length") == 0
    assert tab.run("document.documentElement.scrollWidth") <= WIDTH
    assert tab.run(BEYOND) == 0
    assert tab.run(CUT) == 0
    assert tab.errors == []
    assert len(tab.requests) == 1
