"""FRFs far below what their DoFs do are known to few digits: no cause is found in the rest."""

from __future__ import annotations

from pathlib import Path

from fbs import direct_frf, frequency_axis, write_frf
from mbs_models.model.model_file import loads
from mbs_models.model.new_train import new_train
from validation.explanation.plan import plan
from validation.explanation.search import explain
from validation.routes.source import exudyn_source

TEXT = new_train(("motor", "parallel", "planetary", "load"), "gearbox.toml")
RESPONSES = ("parallel.pinion.y", "planetary.sun.w", "load.w")
EXCITATIONS = ("motor.w", "parallel.pinion.w")


def test_one_bearing_is_one_cause_also_where_frfs_have_lost_digits(tmp_path: Path) -> None:
    """At 15 kHz load.w ← motor.w is 1e-10 of what its DoFs do, and known to 1e-6 of itself."""
    other = loads(TEXT.replace("bearing_y = 2.0e8 ", "bearing_y = 2.2e8 ", 1))
    lines = frequency_axis(10, 15000, 10)
    path = tmp_path / "theirs.npz"
    write_frf(direct_frf(exudyn_source(other).whole, lines, RESPONSES, EXCITATIONS), path)
    answer = explain(plan(loads(TEXT), path).case)
    assert answer.settled
    assert [change.parameter.name for change in answer.best.changes] == [
        "parallel.pinion.bearing_y"
    ]
    assert abs(answer.best.changes[0].value / 2.2e8 - 1.0) < 1e-6
