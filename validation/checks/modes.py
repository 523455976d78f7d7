"""Verdicts on modes by what is known without another route: topology, and what is printed."""

from __future__ import annotations

import numpy as np

from mbs_models.modal.mode_kinds import Kind, Modes
from mbs_models.model.parameters import Drivetrain

from ..routes import equations
from .check import Check
from .published import PublishedModes


def rigid_body_check(drivetrain: Drivetrain, modes: Modes) -> Check:
    """How many motions strain nothing, by the springs there are and by exudyn's eigensolution."""
    expected = equations.rigid_body_motions(drivetrain)
    found = sum(mode.kind == Kind.RIGID_BODY for mode in modes.modes)
    findings = () if found == expected else (f"{expected} expected, {found} found",)
    return Check(
        "Rigid-body modes", "whole drivetrain", ("topology", "exudyn"),
        "expected − found", float(abs(expected - found)), 0.0,
        "what springs there are says how many motions strain nothing, before any eigensolution",
        findings,
    )  # fmt: skip


def published_check(published: PublishedModes, modes: Modes) -> Check:
    """exudyn's natural frequencies against printed ones."""
    elastic = [mode.frequency_hz for mode in modes.modes if mode.kind != Kind.RIGID_BODY]
    groups = [("elastic", elastic[: len(published.lowest)], published.lowest)]
    for kind, expected in published.by_kind.items():
        found = [mode.frequency_hz for mode in modes.modes if mode.kind == kind]
        groups.append((str(kind), found, expected))
    errors, findings = [0.0], []
    for name, found, expected in groups:
        if len(found) != len(expected):
            errors.append(np.inf)
            findings.append(f"{len(found)} {name} modes found, {len(expected)} published")
            continue
        for f, target in zip(found, expected, strict=True):
            errors.append(abs(f - target) / target if target else abs(f))
            if not errors[-1] <= published.tolerance:
                findings.append(f"{name} mode: {f:.6g} Hz found, {target:.6g} Hz published")
    count = sum(len(expected) for _, _, expected in groups)
    return Check(
        "Published natural frequencies", f"{count} modes", (published.source, "exudyn"),
        "largest relative difference", max(errors), published.tolerance, published.reason,
        tuple(findings),
    )  # fmt: skip
