"""Comparison of the routes, verdicts and reports.

Cross-check
    `cross_check` compares all routes of a drivetrain on a `Band` of lines; its `CrossCheck` holds
    a `Check` for every comparison, and `write_report` makes a page of it.
Routes
    A `Source` gives M, C, K: `EQUATIONS`, `exudyn_source()`, or under load `loaded_source`.
    `build_model` builds a `Model` of it, whole and by stage; `whole_route` and `fbs_route` make the
    `Route` to an FRF. `coupling_joints` says what joins two parts.
Stage types of one's own
    `register_stage` takes the type and its equations: the `Lumped` inertias and `Spring`s of it.
exudyn's systems for fbs
    `drivetrain_system`, `stage_system`, and `as_second_order` of any linearised one.
The paper
    `paper_study` checks its tables, figures and claims.
Errors
    `CommandError`.

Each is loaded when it is first asked for.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .checks.check import Check
    from .crosscheck.comparison import cross_check
    from .crosscheck.output import write_report
    from .crosscheck.results import CrossCheck
    from .errors import CommandError
    from .paper.study import paper_study
    from .routes.bands import Band
    from .routes.equations import Lumped, Spring, register_stage
    from .routes.multibody import as_second_order, drivetrain_system, stage_system
    from .routes.routes import (
        EQUATIONS,
        Model,
        Route,
        Source,
        build_model,
        coupling_joints,
        exudyn_source,
        fbs_route,
        loaded_source,
        whole_route,
    )

    __version__: str

__all__ = [
    "EQUATIONS",
    "Band",
    "Check",
    "CommandError",
    "CrossCheck",
    "Lumped",
    "Model",
    "Route",
    "Source",
    "Spring",
    "__version__",
    "as_second_order",
    "build_model",
    "coupling_joints",
    "cross_check",
    "drivetrain_system",
    "exudyn_source",
    "fbs_route",
    "loaded_source",
    "paper_study",
    "register_stage",
    "stage_system",
    "whole_route",
    "write_report",
]

_MODULES = {
    "crosscheck.comparison": ("cross_check",),
    "errors": ("CommandError",),
    "routes.multibody": ("as_second_order", "drivetrain_system", "stage_system"),
    "paper.study": ("paper_study",),
    "crosscheck.output": ("write_report",),
    "checks.check": ("Check",),
    "crosscheck.results": ("CrossCheck",),
    "routes.bands": ("Band",),
    "routes.equations": ("Lumped", "Spring", "register_stage"),
    "routes.routes": (
        "EQUATIONS", "Model", "Route", "Source", "build_model", "coupling_joints",
        "exudyn_source", "fbs_route", "loaded_source", "whole_route",
    ),
}  # fmt: skip
_MODULE_OF = {name: module for module, names in _MODULES.items() for name in names}

if not TYPE_CHECKING:  # hidden, so that a name that is not there is an error of types

    def __getattr__(name: str) -> Any:
        """Load a public name when it is first asked for (PEP 562)."""
        if name == "__version__":
            from importlib.metadata import version  # takes longer to load than all of this

            return version("drivetrain-crosscheck")
        if name not in _MODULE_OF:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        value = getattr(import_module(f".{_MODULE_OF[name]}", __name__), name)
        globals()[name] = value
        return value

    def __dir__() -> list[str]:
        return sorted({*globals(), *__all__})
