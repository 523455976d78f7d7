"""The tables of a model file that join parts: couplings, and the translations they carry."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Literal, Self

from pydantic import Field, model_validator

from ..stages.bodies import Damper, HubInertia, HubMass, Name, Radius, Stiffness, Table
from ..stages.geometry import DIRECTIONS
from ..stages.given_springs import GivenSpring, shaft_spring


class Translation(Table):
    """A translation that a coupling carries between the two bodies' centres.

    ``stiffness`` in N/m, or ``"rigid"``; ``damping`` (N s/m) takes the place of β k.
    """

    stiffness: Stiffness | Literal["rigid"]
    damping: Damper | None = None

    @model_validator(mode="after")
    def _a_rigid_one_has_no_damping(self) -> Self:
        if self.stiffness == "rigid" and self.damping is not None:
            raise ValueError(f"damping = {self.damping}: a rigid translation has none")
        return self


class Coupling(Table):
    """A hub between two bodies: first body – spring – hub – spring – second body.

    Both springs act between r·θ of body and hub at ``radius``; ``"rigid"`` makes hub and body one,
    0 leaves them apart. When the stages are split, each takes half of the hub. ``dofs`` adds
    translations, each a spring between the two bodies.
    """

    name: Name
    first: str
    second: str
    radius: Radius
    inertia: HubInertia | None = None
    inertia_over_r2: HubMass | None = None
    first_stiffness: Stiffness | Literal["rigid"]
    second_stiffness: Stiffness | Literal["rigid"]
    dofs: Mapping[Literal["u", "v", "x", "y", "z"], Translation] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        self._require_one_of(("inertia",), ("inertia_over_r2",))
        if self.first.partition(".")[0] == self.second.partition(".")[0]:
            raise ValueError(
                f"second = {self.second!r}: lies in the same stage as first = {self.first!r}; "
                "a coupling joins bodies of two stages"
            )
        if self.massless and "rigid" not in (self.first_stiffness, self.second_stiffness):
            key = "inertia" if self.inertia is not None else "inertia_over_r2"
            raise ValueError(
                f"{key} = 0.0: a hub between two springs needs an inertia greater than 0; "
                'it may be 0 only where one end is "rigid"'
            )
        directions = [DIRECTIONS[dof] for dof in self.dofs]
        for dof, direction in zip(self.dofs, directions, strict=True):
            if directions.count(direction) > 1:
                raise ValueError(f"dofs.{dof}: the {direction} direction is given twice")
        return self

    @property
    def hub_mass(self) -> float:
        """I/r² of the hub at the coupling's radius (kg)."""
        return self._over_r2("inertia", self.radius)

    @property
    def massless(self) -> bool:
        """Whether the hub has no inertia: the coupling is then a mere shaft."""
        return 0.0 in (self.inertia, self.inertia_over_r2)

    @property
    def bodies(self) -> tuple[str, str]:
        """The two bodies."""
        return self.first, self.second

    @property
    def ends(self) -> tuple[tuple[str, float | Literal["rigid"]], ...]:
        """The two ends as (body, stiffness)."""
        return ((self.first, self.first_stiffness), (self.second, self.second_stiffness))

    @property
    def transmits(self) -> bool:
        """Whether both ends hold the hub, so that torque passes."""
        return self.first_stiffness != 0.0 and self.second_stiffness != 0.0

    def given_springs(self) -> Iterator[GivenSpring]:
        """Its two springs with their keys, where they are no rigid ends."""
        for key in ("first_stiffness", "second_stiffness"):
            value = getattr(self, key)
            if not isinstance(value, str):
                yield shaft_spring(key, value)
