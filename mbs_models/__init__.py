"""Gear drivetrains as exudyn multibody systems, placed by geometry.

Parameters
    `load`, `loads`, `dumps`, `preset_names`: model files and presets.
    `Drivetrain` of `ParallelStage`, `PlanetaryStage`, `Inertia`, `Coupling`, `Damping`.
    A stage type of one's own is a `Part` of `Member`s, each with its `Role`, known to model files
    by `register_stage` (and to the equations too by ``validation.register_stage``) until
    `unregister_stage`.
Systems
    `build_drivetrain`, `build_stage` make a `MultibodySystem`, `linearize` its M, C, K as a
    `LinearizedSystem`; `drivetrain_components` reads its springs and bodies back.
Modes
    `drivetrain_modes` makes `Modes`, each with its `Kind`.
Gears at work
    `operating_point` makes an `OperatingPoint`: what speed and torque do to meshes and loads.
Runs in time
    `simulate` integrates a system and returns a `TransientRecord`. It is excited by `Excitation`
    objects: those of the model file (`excitations_of`), or a `Harmonic`, a `Sweep` or a
    `schroeder_multisine` at a DoF. `choose_integrator` gives the `Integrator`.
Errors
    `ModelError`, and of runs `SimulationError`.

Each is loaded when it is first asked for: exudyn takes its time, and model files need none of it.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .errors import ModelError
    from .gears.operating_point import OperatingPoint, operating_point
    from .integration.integrators import Integrator, choose_integrator
    from .integration.time_integration import SimulationError, simulate
    from .integration.transient_record import TransientRecord
    from .modal.mode_kinds import Kind, Modes
    from .modal.modes import drivetrain_modes
    from .model.excitation import Excitation, excitations_of
    from .model.model_file import dumps, load, loads, preset_names
    from .model.parameters import (
        Coupling,
        Damping,
        Drivetrain,
        Inertia,
        ParallelStage,
        PlanetaryStage,
        register_stage,
        unregister_stage,
    )
    from .signals.lines import Harmonic, schroeder_multisine
    from .signals.sines import Sweep
    from .stages.part import Member, Part, Role
    from .system.drivetrain import MultibodySystem, build_drivetrain, build_stage
    from .system.linearization import LinearizedSystem, linearize
    from .system.read_back import drivetrain_components

    __version__: str

__all__ = [
    "Coupling",
    "Damping",
    "Drivetrain",
    "Excitation",
    "Harmonic",
    "Inertia",
    "Integrator",
    "Kind",
    "LinearizedSystem",
    "Member",
    "ModelError",
    "Modes",
    "MultibodySystem",
    "OperatingPoint",
    "ParallelStage",
    "Part",
    "PlanetaryStage",
    "Role",
    "SimulationError",
    "Sweep",
    "TransientRecord",
    "__version__",
    "build_drivetrain",
    "build_stage",
    "choose_integrator",
    "drivetrain_components",
    "drivetrain_modes",
    "dumps",
    "excitations_of",
    "linearize",
    "load",
    "loads",
    "operating_point",
    "preset_names",
    "register_stage",
    "schroeder_multisine",
    "simulate",
    "unregister_stage",
]

_MODULES = {
    "system.drivetrain": ("MultibodySystem", "build_drivetrain", "build_stage"),
    "errors": ("ModelError",),
    "model.excitation": ("Excitation", "excitations_of"),
    "integration.integrators": ("Integrator", "choose_integrator"),
    "integration.transient_record": ("TransientRecord",),
    "system.linearization": ("LinearizedSystem", "linearize"),
    "gears.operating_point": ("OperatingPoint", "operating_point"),
    "modal.mode_kinds": ("Kind", "Modes"),
    "model.model_file": ("dumps", "load", "loads", "preset_names"),
    "modal.modes": ("drivetrain_modes",),
    "model.parameters": (
        "Coupling", "Damping", "Drivetrain", "Inertia", "ParallelStage", "PlanetaryStage",
        "register_stage", "unregister_stage",
    ),
    "stages.part": ("Member", "Part", "Role"),
    "system.read_back": ("drivetrain_components",),
    "signals.lines": ("Harmonic", "schroeder_multisine"),
    "signals.sines": ("Sweep",),
    "integration.time_integration": ("SimulationError", "simulate"),
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
