"""A speed study in sentences."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mbs_models.gears.resonances import Margin

from ..report.digits import engineering
from .findings import Parting, Peak, describe_energy
from .instability import Unstable
from .result import SpeedResult


def verdict(result: SpeedResult) -> str:
    """The study in a sentence."""
    wrong = sum(not check.agrees for check in result.checks)
    if wrong:
        return f"{wrong} of {len(result.checks)} checks disagree"
    agreed = "; exudyn in time agrees" if result.compared_in_time else ""
    return summary(result) + agreed


def summary(result: SpeedResult) -> str:
    """What stands out most."""
    plan = result.turning.plan
    if result.states is None:
        return "Nothing excites: no mesh varies under load, and none has a transmission error"
    reach = f"{plan.speeds[0]:.5g} to {plan.speeds[-1]:.5g} rpm of {plan.input}"
    if not result.peaks:
        return f"No resonance stands out from {reach}"
    top = result.peaks[0]
    size = f"dynamic factor {top.height:.3g}" if plan.torque else engineering(top.swing, "N")
    return f"From {reach}: highest peak at {top.speed_rpm:.5g} rpm, {size} in {top.family}"


def conclusions(result: SpeedResult) -> tuple[str, ...]:
    """What else matters, in sentences."""
    return tuple(_conclusions(result))


def _conclusions(result: SpeedResult) -> Iterator[str]:
    if result.states is None:
        yield (
            "Mesh forces are the static ones at every speed. What excites are a mesh_variation "
            "under torque, or a mesh_transmission_error."
        )
        return
    if not result.agrees:
        yield f"{summary(result)}."
    if result.unstable:
        listed = "; ".join(describe_unstable(unstable) for unstable in result.unstable)
        yield f"Parametrically unstable: {listed}. The steady state is not reached there."
    elif np.isfinite(result.states.growth).any():
        yield "Floquet theory: stable at every speed."
    for parting in result.partings:
        yield describe_parting(parting)
    if result.margins:
        yield describe_margins(result)


def describe_unstable(unstable: Unstable) -> str:
    """As ``1200–1310 rpm (mesh reducer at 660 + 660 Hz), growing by 12 1/s``."""
    name = "no tongue of first order is near"
    if unstable.tongue is not None:
        name = unstable.tongue.description
    return f"{unstable.range.description} ({name}), growing by {unstable.growth:.3g} 1/s"


def describe_parting(parting: Parting) -> str:
    """From which speed on the linear steady state does not hold."""
    listed = ", ".join(reach.description for reach in parting.ranges)
    return (
        f"Teeth of {parting.family} part from {parting.ranges[0].first:.5g} rpm on ({listed}): "
        "there the linear steady state would have them pull, and its numbers do not hold. What "
        "happens with the teeth apart, crosscheck simulate --speed tells."
    )


def describe_margins(result: SpeedResult) -> str:
    """The closest resonance at the operating speed."""
    operation = result.turning.plan.drivetrain.operation
    assert operation is not None
    closest = result.margins[0]
    return f"At {operation.speed:g} rpm the nearest resonance is {describe_margin(closest)}."


def describe_margin(margin: Margin) -> str:
    """As ``mesh reducer ×2 (1200 Hz) and the global mode at 1240 Hz, 3.3 % above``."""
    where = "above" if margin.change > 0.0 else "below"
    return (
        f"{margin.order.label(margin.harmonic)} ({margin.order_hz:.4g} Hz) and the {margin.kind} "
        f"mode at {margin.mode_hz:.4g} Hz, {100.0 * abs(margin.change):.2g} % {where}"
    )


def peak_mode(result: SpeedResult, peak: Peak) -> str:
    """As ``rotational, 1234.5 Hz, ζ 0.8 %``."""
    mode = result.modes.modes[peak.mode]
    damping = f"{100.0 * mode.damping_ratio:.2g} %"
    return f"{mode.kind}, {mode.frequency_hz:.5g} Hz, damping {damping}"


def peak_energy(result: SpeedResult, peak: Peak) -> str:
    """Where the energy of its mode is."""
    return describe_energy(result.energies, peak.mode)
