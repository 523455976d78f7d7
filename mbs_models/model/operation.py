"""The table of a model file that says how the drivetrain turns, and under what torque."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from ..stages.bodies import Table, physical

SPEEDS, TORQUES = (1e-6, 1e6), (1e-9, 1e12)  # rpm, N m: what is physical but 0
OF_SPEED, OF_TORQUE = physical(*SPEEDS, "rpm"), physical(*TORQUES, "N m")


class Operation(Table):
    """How the drivetrain turns: the speed range (rpm) of one of its bodies, ``input``.

    ``speed`` (rpm) and ``torque`` (N m) of the input are one operating point; both are positive
    along the input's positive w. ``output`` is the body that takes the reaction to the torque.
    """

    input: str
    speed_range: Annotated[
        tuple[
            Annotated[float, Field(ge=0.0, json_schema_extra={"unit": "rpm"}), OF_SPEED],
            Annotated[float, Field(gt=0.0, json_schema_extra={"unit": "rpm"}), OF_SPEED],
        ],
        Field(strict=False, description="a list of two speeds (rpm)"),
    ]
    speed: Annotated[float, Field(json_schema_extra={"unit": "rpm"}), OF_SPEED] | None = None
    torque: Annotated[float, Field(json_schema_extra={"unit": "N m"}), OF_TORQUE] | None = None
    output: str | None = None

    @model_validator(mode="after")
    def _a_range(self) -> Self:
        first, last = self.speed_range
        if first >= last:
            raise ValueError(f"speed_range = [{first}, {last}]: the second must be larger")
        if self.speed == 0.0:
            raise ValueError("speed = 0.0: no mesh is passed; leave the key out for a standstill")
        if self.output == self.input:
            raise ValueError(f"output = {self.output!r}: is the input; give the other end")
        return self
