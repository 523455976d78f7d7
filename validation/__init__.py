"""Comparison of the routes, verdicts and reports.

Cross-check
    `cross_check` compares all routes of a drivetrain on a `Band` of lines; its `CrossCheck` holds
    a `Check` for every comparison, and `publish` makes files of it, as of every study's result.
Routes
    A `Source` gives a drivetrain's M, C, K, whole and by part, and its modes, each built once:
    `exudyn_source`, `equations_source`, or under load `loaded_source`. `whole_route` and
    `fbs_route` make the `Route` to an FRF, `TimeRoute` runs exudyn in time. `coupling_joints` says
    what joins two parts.
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
    from .crosscheck.result import CrossCheck
    from .crosscheck.study import cross_check
    from .errors import CommandError
    from .paper.study import paper_study
    from .report.publish import publish
    from .routes.bands import Band
    from .routes.equations import Lumped, Spring, register_stage
    from .routes.joints import coupling_joints
    from .routes.multibody import as_second_order, drivetrain_system, stage_system
    from .routes.routes import Route, fbs_route, whole_route
    from .routes.source import Source, equations_source, exudyn_source, loaded_source
    from .routes.time_domain import TimeRoute

    __version__: str

__all__ = [
    "Band",
    "Check",
    "CommandError",
    "CrossCheck",
    "Lumped",
    "Route",
    "Source",
    "Spring",
    "TimeRoute",
    "__version__",
    "as_second_order",
    "coupling_joints",
    "cross_check",
    "drivetrain_system",
    "equations_source",
    "exudyn_source",
    "fbs_route",
    "loaded_source",
    "paper_study",
    "publish",
    "register_stage",
    "stage_system",
    "whole_route",
]

_MODULES = {
    "crosscheck.study": ("cross_check",),
    "errors": ("CommandError",),
    "routes.multibody": ("as_second_order", "drivetrain_system", "stage_system"),
    "paper.study": ("paper_study",),
    "report.publish": ("publish",),
    "checks.check": ("Check",),
    "crosscheck.result": ("CrossCheck",),
    "routes.bands": ("Band",),
    "routes.equations": ("Lumped", "Spring", "register_stage"),
    "routes.joints": ("coupling_joints",),
    "routes.routes": ("Route", "fbs_route", "whole_route"),
    "routes.source": ("Source", "equations_source", "exudyn_source", "loaded_source"),
    "routes.time_domain": ("TimeRoute",),
}
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
