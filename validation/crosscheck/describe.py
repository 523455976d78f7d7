"""What the report says in words: the verdict, the routes, the DoFs."""

from __future__ import annotations

import math

from mbs_models.model.parameters import Drivetrain

from ..checks.check import Check
from .results import CrossCheck

MOTIONS = {
    "w": "rotation r·θ of",
    "y": "translation along the line of action of",
    "z": "axial translation of",
    "rho": "rocking r·ρ of",
    "u": "translation along u of",
    "v": "translation along v of",
}
PLANET_MOTIONS = MOTIONS | {"u": "radial translation of", "v": "tangential translation of"}

SOLUTIONS = {
    False: "solved line by line, (K − ω²M + jωC)⁻¹",
    True: "summed over all its modes",
}


def verdict(result: CrossCheck) -> str:
    """The outcome in one sentence; where routes disagree, which, where and by what.

    What a swap changes is a finding with a headline of its own: no route's agreement covers it.
    """
    if result.agrees:
        return "All routes agree" + (" on the model before the swap" if result.swap else "")
    telling = max((c for c in result.checks if not c.agrees), key=_weight)
    finding = telling.findings[0] if telling.findings else _in_numbers(telling)
    return f"Routes disagree: {telling.routes[0]} and {telling.routes[1]}, {finding}"


def disagreements(result: CrossCheck) -> dict[tuple[str, str], tuple[str, ...]]:
    """What is found of every pair of routes that disagrees, each finding once."""
    found: dict[tuple[str, str], dict[str, None]] = {}
    for check in sorted((c for c in result.checks if not c.agrees), key=_weight, reverse=True):
        findings = found.setdefault(check.routes, {})
        findings.update(dict.fromkeys(check.findings or (_in_numbers(check),)))
    return {routes: tuple(findings) for routes, findings in found.items()}


def _weight(check: Check) -> tuple[bool, float]:
    """How telling a disagreement is: one that says where, then the one furthest out."""
    ratio = check.value / check.tolerance if check.tolerance else math.inf
    return bool(check.findings), math.inf if math.isnan(ratio) else ratio


def _in_numbers(check: Check) -> str:
    return (
        f"{check.name.lower()} ({check.subject}): {check.measure} {check.value:.3g}, "
        f"{check.tolerance:.3g} allowed"
    )


def dof_in_words(drivetrain: Drivetrain, label: str) -> str:
    """``reducer.pinion.w`` as "rotation r·θ of the pinion (reducer)"."""
    *place, dof = label.split(".")
    if place[0] in {coupling.name for coupling in drivetrain.couplings}:
        return f"rotation r·θ of the hub ({place[0]})"
    body = place[-1].replace("planet", "planet ")
    motions = PLANET_MOTIONS if body.startswith("planet") else MOTIONS
    return f"{motions.get(dof, dof + ' of')} the {body} ({place[0]})"


def pair_in_words(drivetrain: Drivetrain, response: str, excitation: str) -> str:
    """What an FRF between two DoFs is."""
    if response == excitation:
        return f"Drive point: {dof_in_words(drivetrain, response)}"
    return (
        f"Response: {dof_in_words(drivetrain, response)}; "
        f"excitation: {dof_in_words(drivetrain, excitation)}"
    )


def route_in_words(route: str) -> tuple[str, str, str]:
    """Where a route's matrices come from, what is solved, and how an FRF is made of them."""
    name, _, modal = route.partition(", ")
    stages = name.startswith("FBS of ") and name.endswith(" stages")
    source = name.removeprefix("FBS of ").removesuffix(" stages") if stages else name
    matrices = {
        "exudyn": "exudyn: bodies and springs placed by geometry, linearised by exudyn itself",
        "equations": "the lumped equations: K = Σ k v vᵀ from mesh vectors",
    }.get(source, source)
    scope = (
        "every stage alone, its FRFs coupled at the hubs by Lagrange multipliers"
        if stages
        else "the whole drivetrain at once"
    )
    return matrices, scope, SOLUTIONS[modal.startswith("modal")]
