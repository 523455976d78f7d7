"""What a run in time may be off by, and what shows beyond it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from mbs_models import load
from mbs_models.integration.periodic_orbit import PeriodicRecord
from validation.checks.time_domain import time_domain_checks
from validation.routes.source import exudyn_source
from validation.routes.time_domain import own_error, time_domain, with_damping


def test_the_own_error_is_that_of_a_line_and_of_the_closure() -> None:
    size = np.array([[1.0], [1e-2], [1e-4], [1e-6]])
    found = own_error(size)[:, 0]
    # 2e-3 and 1e-6 of what is 0, 40 and 80 dB above; never more than 1 %
    np.testing.assert_allclose(found, [2.001e-3, 2.1e-3, 1e-2, 1e-2], rtol=1e-12)


@pytest.mark.parametrize("factor", [1.0, 1.005, 1.0 + 0.005j], ids=["as is", "force", "phase"])
def test_half_a_percent_of_force_shows(factor: complex, monkeypatch: pytest.MonkeyPatch) -> None:
    own: Callable[[PeriodicRecord], Any] = PeriodicRecord.receptance
    monkeypatch.setattr(PeriodicRecord, "receptance", lambda self: factor * own(self))
    source = exudyn_source(with_damping(load("lin-parker-3")))
    magnitude, phase = time_domain_checks(time_domain(source, "planetary.sun.w", fmax=2000.0))
    assert magnitude.agrees == (abs(abs(factor) - 1.0) < 1e-3)
    assert phase.agrees == (np.imag(factor) == 0.0)
    for check in (magnitude, phase):
        assert bool(check.findings) != check.agrees
