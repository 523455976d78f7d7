"""The paper's drivetrain: its two stages and hub, their variants, and the paper's numbering."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from mbs_models.model.model_file import load
from mbs_models.model.parameters import Coupling, Drivetrain, ParallelStage, PlanetaryStage

from ..errors import CommandError
from ..routes.source import Source, equations_source, exudyn_source
from .item import DofName

PAPER, TABLE_2 = "Lin & Parker (1999)", "Table 2 as printed"
PARAMETER_SETS = {PAPER: "paper", TABLE_2: "paper-table2"}

BODY_WORDS = {"s": "sun", "c": "carrier", "r": "ring"}
DIRECTION_WORDS = {
    "u": "radial (u)",
    "v": "radial (v)",
    "w": "rotation (w)",
    "y": "along the line of action (y)",
    "z": "axial (z)",
    "rho": "rocking (ρ)",
}


@dataclass(frozen=True)
class PaperCase:
    """A drivetrain of the paper's form: subsystem A on the sun of subsystem B, through a hub.

    Raises
    ------
    CommandError
        It is of another form.
    """

    drivetrain: Drivetrain

    def __post_init__(self) -> None:
        couplings = self.drivetrain.couplings
        pairs = self.drivetrain.stages_of(ParallelStage)
        sets = self.drivetrain.stages_of(PlanetaryStage)
        one_each = (*pairs, *sets) == self.drivetrain.parts and len(pairs) == len(sets) == 1
        of_the_form = one_each and len(couplings) == 1
        if not of_the_form or (couplings[0].first, couplings[0].second) != (
            f"{self.drivetrain.stages[0].name}.wheel",
            f"{self.drivetrain.stages[1].name}.sun",
        ):
            raise CommandError(
                f"model '{self.drivetrain.name}': the paper's study needs one parallel and one "
                "planetary stage, and one coupling from the wheel to the sun"
            )
        if "rigid" in (couplings[0].first_stiffness, couplings[0].second_stiffness):
            raise CommandError(
                f"coupling '{couplings[0].name}': the paper's study needs a spring at both ends "
                'of the hub, not "rigid"'
            )
        if couplings[0].dofs:
            raise CommandError(
                f"coupling '{couplings[0].name}': the paper's hub turns, and carries no "
                f"translation: take dofs ({', '.join(couplings[0].dofs)}) away"
            )

    @property
    def parallel(self) -> ParallelStage:
        """Subsystem A."""
        return self.drivetrain.stages_of(ParallelStage)[0]

    @property
    def planetary(self) -> PlanetaryStage:
        """Subsystem B."""
        return self.drivetrain.stages_of(PlanetaryStage)[0]

    @property
    def coupling(self) -> Coupling:
        """The hub and its two springs."""
        return self.drivetrain.couplings[0]

    @property
    def shaft_stiffness(self) -> float:
        """k_sw (N/m)."""
        return float(self.coupling.second_stiffness)

    @cached_property
    def exudyn(self) -> Source:
        """exudyn's systems."""
        return exudyn_source(self.drivetrain)

    @cached_property
    def equations(self) -> Source:
        """The equations' systems."""
        return equations_source(self.drivetrain)

    @cached_property
    def uncoupled(self) -> Source:
        """exudyn's systems of the subsystems without the hub."""
        return exudyn_source(self.drivetrain.model_copy(update={"couplings": ()}))

    def with_shaft(self, stiffness: float) -> PaperCase:
        """The same with another k_sw (N/m); itself where that is its own."""
        if stiffness == self.shaft_stiffness:
            return self
        return self._with_coupling(second_stiffness=stiffness)

    def with_wheel_spring(self, stiffness: float) -> PaperCase:
        """The same with another stiffness between wheel and hub (N/m)."""
        return self._with_coupling(first_stiffness=stiffness)

    def with_hub(self, mass: float) -> PaperCase:
        """The same with another hub, I/r² in kg."""
        return self._with_coupling(inertia=None, inertia_over_r2=mass)

    def with_parallel(self, **values: object) -> PaperCase:
        """The same with other parameters of stage A: a key of the stage, or ``gear_<key>``.

        ``gear_<key>`` is given to pinion and wheel alike.
        """
        gears = {k.removeprefix("gear_"): v for k, v in values.items() if k.startswith("gear_")}
        own = {k: v for k, v in values.items() if not k.startswith("gear_")}
        a = self.parallel
        stage = a.model_copy(
            update={
                **own,
                "pinion": a.pinion.model_copy(update=gears),
                "wheel": a.wheel.model_copy(update=gears),
            }
        )
        return self._replaced(stages=(stage, self.planetary))

    def _with_coupling(self, **values: object) -> PaperCase:
        return self._replaced(couplings=(self.coupling.model_copy(update=values),))

    def _replaced(self, **values: object) -> PaperCase:
        return PaperCase(self.drivetrain.model_copy(update=values))

    @property
    def a(self) -> str:
        """Name of subsystem A."""
        return self.parallel.name

    @property
    def b(self) -> str:
        """Name of subsystem B."""
        return self.planetary.name

    @property
    def hub(self) -> str:
        """Label of the coupling DoF, the paper's θ(2,2)."""
        return f"{self.coupling.name}.w"

    def label(self, name: str) -> str:
        """The label of ``A.pinion.w``, ``B.sun.u`` or ``hub`` in this drivetrain."""
        subsystem, _, dof = name.partition(".")
        return {"A": f"{self.a}.{dof}", "B": f"{self.b}.{dof}", "hub": self.hub}[subsystem]

    @cached_property
    def dofs(self) -> tuple[DofName, ...]:
        """Every DoF in the paper's order (Eq. 11); number n is entry n − 1."""
        a, b = self.parallel.name, self.planetary.name
        gears = (("pinion", 1), ("wheel", 2))
        names = [
            (f"{symbol}{i}{end}", f"{a}.{gear}.{dof}", f"{gear}, {DIRECTION_WORDS[dof]}")
            for dof, symbol, end in (
                ("w", "rθ(", ")"), ("y", "y", ""), ("z", "z", ""), ("rho", "rρ(y", ")"),
            )
            for gear, i in gears
        ]  # fmt: skip
        names.append(("θ(2,2)", self.hub, "hub, rotation (w)"))
        bodies = [(k, word, word) for k, word in BODY_WORDS.items()] + [
            (f"p{p}", f"planet{p}", f"planet {p}")
            for p in range(1, self.planetary.planet_count + 1)
        ]
        names += [
            (f"{d}_{symbol}", f"{b}.{body}.{d}", f"{word}, {_direction(body, d)}")
            for symbol, body, word in bodies
            for d in "uvw"
        ]
        return tuple(
            DofName(f"{number}, {symbol}", label, words)
            for number, (symbol, label, words) in enumerate(names, start=1)
        )

    def dof(self, label: str) -> DofName:
        """A DoF by its label."""
        return next(dof for dof in self.dofs if dof.label == label)

    @property
    def internal_a(self) -> tuple[str, ...]:
        """Labels of subsystem A without the hub (index a of Eq. 14)."""
        return tuple(d.label for d in self.dofs if d.label.startswith(f"{self.parallel.name}."))

    @property
    def internal_b(self) -> tuple[str, ...]:
        """Labels of subsystem B without the hub (index b of Eq. 14)."""
        return tuple(d.label for d in self.dofs if d.label.startswith(f"{self.planetary.name}."))


def _direction(body: str, dof: str) -> str:
    """The direction in words: a planet's v is tangential, a central member's the other radial."""
    return "tangential (v)" if dof == "v" and body.startswith("planet") else DIRECTION_WORDS[dof]


def parameter_sets(preset: Drivetrain | None) -> dict[str, PaperCase]:
    """The two sets the tables are held against; ``preset`` takes the first one's place."""
    cases = {name: PaperCase(load(model)) for name, model in PARAMETER_SETS.items()}
    if preset is not None:
        cases[PAPER] = PaperCase(preset)
    return cases
