"""The library, called with what nobody means."""

from __future__ import annotations

import json
import random
from collections.abc import Callable
from pathlib import Path

from mbs_models.model.model_file import load, loads, preset_names, template
from validation.sweep.parameters import samples_of

from .mutations import changed_text, odd_number, odd_text
from .trial import DOFS, SMALL, refused_or


def library(rng: random.Random, folder: Path) -> str:
    """Texts to `loads`, values to what computes."""
    text = template(rng.choice(preset_names()))
    if rng.random() < 0.5:
        return refused_or(lambda: loads(changed_text(rng, text)))
    from fbs import direct_frf, frequency_axis
    from validation.routes.equations import drivetrain_system

    system = drivetrain_system(load(SMALL))
    number = float(odd_number(rng)[:400])
    calls: tuple[Callable[[], object], ...] = (
        lambda: frequency_axis(number, 100.0, 1.0),
        lambda: (
            frequency_axis(0.0, number, 1.0) if abs(number) < 1e6 else frequency_axis(number, 1, 1)
        ),
        lambda: frequency_axis(0.0, 100.0, number) if not abs(number) < 1e-3 else None,
        lambda: direct_frf(system, [number], [DOFS[0]], [DOFS[0]]),
        lambda: direct_frf(system, [1.0], [odd_text(rng)], [DOFS[0]]),
        lambda: load(odd_text(rng)),
        lambda: samples_of(load(SMALL), [odd_text(rng)]),
        lambda: json.dumps(loads(text).model_dump()),
    )
    return refused_or(rng.choice(calls))
