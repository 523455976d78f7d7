"""Settings of all tests."""

import math
import os
import signal
from collections.abc import Iterator

import pytest
from hypothesis import HealthCheck, Phase, settings

# The same examples in every run, so that a fault found is a fault that can be found again. Random
# drivetrains of dozens of numbers are not worth shrinking: the failing one is printed whole.
settings.register_profile(
    "reproducible",
    deadline=None,
    derandomize=True,
    phases=(Phase.explicit, Phase.generate),
    suppress_health_check=(HealthCheck.too_slow,),
)
settings.load_profile("reproducible")


# Workers of pytest-xdist are given 80 columns; a pipe without a word of them is wide.
os.environ.pop("COLUMNS", None)


@pytest.fixture(autouse=True, scope="session")
def _interrupts_are_heard() -> None:
    """A shell that starts the suite in the background has all that it starts ignore Ctrl-C."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(autouse=True, scope="session")
def _no_progress_lines() -> Iterator[None]:
    """What a slow machine would print of its progress is no part of what commands say."""
    from validation.runtime import streams as screen

    before = screen.BETWEEN_LINES
    screen.BETWEEN_LINES = math.inf
    yield
    screen.BETWEEN_LINES = before
