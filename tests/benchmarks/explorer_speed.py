"""``python -m tests.benchmarks.explorer_speed [MODEL]``: the page's start, and a slider's step.

A step is what happens between the slider's event and the curve handed to the plot: the parts put
together, their natural frequencies, and one FRF on 4000 lines and more beside the resonances.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

from mbs_models import load
from tests.browser import Browser, browser
from validation.explorer.page import explorer_page
from validation.routes.source import equations_source, exudyn_source

STEPS = 200
DRAG = """(async () => {
  const slider = document.querySelector("#sliders-of input"), found = [];
  for (let k = 0; k < %d; k++) {
    slider.value = String(Math.sin(k / 20));
    slider.dispatchEvent(new Event("input"));
    await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
    const { step, lines } = document.documentElement.dataset;
    found.push([Number(step), Number(lines)]);
  }
  return found;
})()"""


def main(model: str) -> None:
    """Print both."""
    drivetrain = load(model)
    page = explorer_page(exudyn_source(drivetrain), equations_source(drivetrain))
    with tempfile.TemporaryDirectory() as folder, browser() as tab:
        path = Path(folder) / "explore.html"
        path.write_text(page, encoding="utf-8")
        starts = []
        for _ in range(5):
            tab.open(path, ready="document.documentElement.dataset.ready")
            own_start = processor_ms(tab)
            starts.append(float(tab.run("document.documentElement.dataset.ready")))
        tab.run(DRAG % 20)  # which compiles it
        before = processor_ms(tab)
        found = np.array(tab.run(DRAG % STEPS))
        own = (processor_ms(tab) - before) / STEPS
    steps, lines = found.T
    print(
        f"{model}: {len(page) / 1e6:.2f} MB, start {min(starts):.0f} to {max(starts):.0f} ms, "
        f"{own_start:.0f} ms of the processor in scripts"
    )
    low, middle, high = np.percentile(steps, [5, 50, 95])
    print(f"a step: {middle:.1f} ms ({low:.1f} to {high:.1f}) for {np.median(lines):.0f} lines")
    print(f"all of the page's script: {own:.1f} ms of the processor a step, with Bokeh's drawing")


def processor_ms(tab: Browser) -> float:
    """Of the page's scripts since it was opened: other programs do not count."""
    tab.send("Performance.enable", timeDomain="threadTicks")
    found = tab.send("Performance.getMetrics")["metrics"]
    return 1e3 * float(next(one["value"] for one in found if one["name"] == "ScriptDuration"))


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "paper")
