"""What the report says in words: the verdict, the routes, the DoFs."""

from __future__ import annotations

from mbs_models.model.parameters import Drivetrain

from ..report.verdicts import in_numbers, telling
from .result import CrossCheck

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

    What a substitution changes is a finding with a headline of its own: no route's agreement
    covers it.
    """
    if result.agrees:
        return "All routes agree" + (" on the model before the swap" if result.substitution else "")
    worst = max((check for check in result.checks if not check.agrees), key=telling)
    finding = worst.findings[0] if worst.findings else in_numbers(worst)
    return f"Routes disagree: {worst.routes[0]} and {worst.routes[1]}, {finding}"


def disagreements(result: CrossCheck) -> dict[tuple[str, str], tuple[str, ...]]:
    """What is found of every pair of routes that disagrees, each finding once."""
    found: dict[tuple[str, str], dict[str, None]] = {}
    for check in sorted((c for c in result.checks if not c.agrees), key=telling, reverse=True):
        findings = found.setdefault(check.routes, {})
        findings.update(dict.fromkeys(check.findings or (in_numbers(check),)))
    return {routes: tuple(findings) for routes, findings in found.items()}


def describe_dof(drivetrain: Drivetrain, label: str) -> str:
    """``reducer.pinion.w`` as "rotation r·θ of the pinion (reducer)"."""
    *place, dof = label.split(".")
    if place[0] in {coupling.name for coupling in drivetrain.couplings}:
        return f"rotation r·θ of the hub ({place[0]})"
    body = place[-1].replace("planet", "planet ")
    motions = PLANET_MOTIONS if body.startswith("planet") else MOTIONS
    return f"{motions.get(dof, dof + ' of')} the {body} ({place[0]})"


def describe_pair(drivetrain: Drivetrain, response: str, excitation: str) -> str:
    """What an FRF between two DoFs is."""
    if response == excitation:
        return f"Drive point: {describe_dof(drivetrain, response)}"
    return (
        f"Response: {describe_dof(drivetrain, response)}; "
        f"excitation: {describe_dof(drivetrain, excitation)}"
    )


def describe_route(route: str) -> tuple[str, str, str]:
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


def short_frequency(frequency: float) -> str:
    """A natural frequency in few characters."""
    return f"{frequency:.5g}" if frequency < 1e5 else f"{frequency:.1e}".replace("e+0", "e")
