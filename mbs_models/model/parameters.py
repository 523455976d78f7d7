"""The parameters of a drivetrain: frozen, validated, SI; and the registry of stage types.

`Drivetrain` is a model file: its tables are here, in `couplings`, `operation` and
`excitation_tables`, those of its parts in the room `stages`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from functools import cached_property
from typing import Annotated, Any, Self, TypeVar, Union, get_args

from pydantic import Field, GetCoreSchemaHandler, model_validator
from pydantic_core import CoreSchema

from ..errors import ModelError
from ..representation import listing
from ..stages.bodies import Table, Title, physical
from ..stages.geometry import DIRECTIONS
from ..stages.inertia import Inertia
from ..stages.parallel import ParallelStage
from ..stages.part import Member, MeshFamily, Part
from ..stages.planetary import PlanetaryStage
from .couplings import Coupling, Translation
from .excitation_tables import ExcitationTable, require_dof
from .graph import facings, groups, walk
from .operation import Operation

__all__ = [
    "Coupling",
    "Damping",
    "Drivetrain",
    "Inertia",
    "Operation",
    "ParallelStage",
    "Part",
    "PlanetaryStage",
    "Translation",
    "register_stage",
    "stage_types",
    "unregister_stage",
]

P = TypeVar("P", bound=Part)

_stage_types: dict[str, type[Part]] = {"parallel": ParallelStage, "planetary": PlanetaryStage}
BUILT_IN = tuple(_stage_types)


def stage_types() -> tuple[type[Part], ...]:
    """All types that a ``[[stage]]`` may have: those that come along, and those registered."""
    return tuple(_stage_types.values())


class _AnyStage:
    """A ``[[stage]]`` table: of the type that its key ``type`` names."""

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return handler.generate_schema(
            Annotated[Union[stage_types()], Field(discriminator="type")]  # noqa: UP007
        )


class Damping(Table):
    """Element-wise proportional damping: c = β k of every spring, α M on every inertia.

    ``stiffness_proportional`` is β (s), ``mass_proportional`` is α (1/s).
    """

    stiffness_proportional: Annotated[
        float, Field(ge=0.0, json_schema_extra={"unit": "s"}), physical(1e-15, 1.0, "s")
    ] = 0.0
    mass_proportional: Annotated[
        float, Field(ge=0.0, json_schema_extra={"unit": "1/s"}), physical(1e-12, 1e6, "1/s")
    ] = 0.0


class Drivetrain(Table):
    """A whole drivetrain: stages, plain inertias, and the couplings that join them."""

    name: Title
    source: Title = ""
    damping: Damping = Damping()
    operation: Operation | None = None
    stages: Annotated[
        tuple[Annotated[Part, _AnyStage], ...],
        Field(alias="stage", strict=False, description="[[stage]] tables"),
    ] = ()
    inertias: Annotated[
        tuple[Inertia, ...],
        Field(alias="inertia", strict=False, description="[[inertia]] tables"),
    ] = ()
    couplings: Annotated[
        tuple[Coupling, ...],
        Field(alias="coupling", strict=False, description="[[coupling]] tables"),
    ] = ()
    excitations: Annotated[
        tuple[ExcitationTable, ...],
        Field(alias="excitation", strict=False, description="[[excitation]] tables"),
    ] = ()

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if not self.parts:
            raise ValueError("there is nothing in it; give at least one [[stage]] or [[inertia]]")
        names = Counter(item.name for item in self.items)
        name, times = names.most_common(1)[0]
        if times > 1:
            raise ValueError(
                f"name = '{name}': used {times} times; every stage, inertia and coupling needs a "
                "name of its own"
            )
        known = set(self.bodies)
        for i, coupling in enumerate(self.couplings):
            for key in ("first", "second"):
                if getattr(coupling, key) not in known:
                    raise ValueError(
                        f"coupling[{i}] '{coupling.name}': {key} = {getattr(coupling, key)!r}: "
                        f"not a body of this drivetrain; allowed: {listing(self.bodies)}"
                    )
            self._check_translations(i, coupling)
        self._check_operation()
        for i, excitation in enumerate(self.excitations):
            require_dof(f"excitation[{i}]: ", excitation.dof, self.dof_radii())
        return self

    def _check_operation(self) -> None:
        for key in ("input", "output"):
            body = getattr(self.operation, key, None)
            if body is not None and body not in self.bodies:
                raise ValueError(
                    f"operation: {key} = {body!r}: not a body of this drivetrain; "
                    f"allowed: {listing(self.bodies)}"
                )

    def _check_translations(self, i: int, coupling: Coupling) -> None:
        for dof in coupling.dofs:
            for body in (coupling.first, coupling.second):
                own = self.member(body).translations
                if DIRECTIONS[dof] not in own:
                    has = f"only {', '.join(own.values())}" if own else "none"
                    raise ValueError(
                        f"coupling[{i}] '{coupling.name}': dofs.{dof}: {body} has no translation "
                        f"along it ({has}); both ends must have it"
                    )

    @property
    def parts(self) -> tuple[Part, ...]:
        """Stages and inertias: what couplings join, and what substructures are made of."""
        return (*self.stages, *self.inertias)

    @property
    def items(self) -> tuple[Part | Coupling, ...]:
        """Parts and couplings."""
        return (*self.parts, *self.couplings)

    @property
    def mesh_families(self) -> tuple[MeshFamily, ...]:
        """The meshes of all stages."""
        return tuple(family for stage in self.stages for family in stage.mesh_families())

    @cached_property
    def members(self) -> dict[str, Member]:
        """Every body of every part, by name."""
        return {member.body: member for part in self.parts for member in part.members()}

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of the bodies a coupling can join."""
        return tuple(
            f"{part.name}.{body}" if body else part.name
            for part in self.parts
            for body in part.bodies
        )

    def part(self, name: str) -> Part:
        """The stage or inertia of that name."""
        return self._by_name[name]

    def stages_of(self, stage_type: type[P]) -> tuple[P, ...]:
        """Its stages of one type."""
        return tuple(stage for stage in self.stages if isinstance(stage, stage_type))

    def stage(self, name: str) -> Part:
        """The stage of that name."""
        return next(stage for stage in self.stages if stage.name == name)

    def member(self, body: str) -> Member:
        """The body of that name."""
        return self.members[body]

    def radius(self, body: str) -> float:
        """The radius r of the rotation w = r·θ of a body (m)."""
        return self.member(body).radius

    def dof_radii(self) -> dict[str, float | None]:
        """Label → radius r of a rotation carried as r·θ (m); None for a translation.

        The labels are those of the whole drivetrain, the derived ones of rigid hubs included.
        """
        radii: dict[str, float | None] = {}
        for member in self.members.values():
            radii |= member.label_radii
        return radii | {f"{coupling.name}.w": coupling.radius for coupling in self.couplings}

    @cached_property
    def _by_name(self) -> Mapping[str, Part]:
        return {part.name: part for part in self.parts}

    @cached_property
    def facing(self) -> Mapping[str, float]:
        """Side each part is seen from (±1), so that coupled bodies turn the same way."""
        return facings(walk(self._by_name, self.couplings), self.members)

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """A copy with other values; what was derived from the old ones is left behind."""
        copy = super().model_copy(update=update, deep=deep)
        for name in ("members", "_by_name", "facing"):
            copy.__dict__.pop(name, None)
        return copy

    def groups(self) -> tuple[frozenset[str], ...]:
        """Parts that turn together, as sets of names (connected through couplings)."""
        transmitting = [coupling for coupling in self.couplings if coupling.transmits]
        return groups(self._by_name, transmitting)

    def warnings(self) -> tuple[str, ...]:
        """What is allowed but probably not meant."""
        main = max(self.groups(), key=len)
        others = listing(sorted(main))
        named = [("stage", part) for part in self.stages]
        named += [("inertia", part) for part in self.inertias]
        return tuple(
            f"{what} '{part.name}' is not connected to the rest: no torque passes, every FRF "
            f"between it and {others} is zero, and each unconnected part has "
            "rigid-body modes of its own"
            for what, part in named
            if part.name not in main
        )


def register_stage(stage_type: type[Part]) -> None:
    """Let ``[[stage]]`` tables be of another type, which its ``type`` names.

    It holds for this process; a type of the same name that was registered before is replaced.

    Raises
    ------
    ModelError
        The class is no part, has no name, or that of a type which comes along.
    """
    key = stage_type.model_fields.get("type") if issubclass(stage_type, Part) else None
    (name,) = get_args(key.annotation)[:1] if key is not None else (None,)
    if not isinstance(name, str):
        raise ModelError(
            f"register_stage({stage_type.__name__}): a stage type derives from mbs_models.Part and "
            'has a field for its name, type: Literal["…"]'
        )
    if name in BUILT_IN:
        raise ModelError(
            f"register_stage({stage_type.__name__}): type = {name!r} comes along already; give it "
            "another name"
        )
    _stage_types[name] = stage_type
    Drivetrain.model_rebuild(force=True)


def unregister_stage(name: str) -> None:
    """Forget a type that was registered."""
    del _stage_types[name]
    Drivetrain.model_rebuild(force=True)
