"""A body that a robot carries."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, PositiveFloat, field_validator, model_validator

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.robot.description.urdf_inertia import INERTIA_RELATIVE_TOLERANCE
from hexapod_pin.robot.loading.mass_changes import symmetric_matrix
from hexapod_pin.spec import Spec

Triple = tuple[float, float, float]
Moments = tuple[float, float, float, float, float, float]
Name = Annotated[str, Field(min_length=1)]
GivenInertia = Sequence[float] | Sequence[Sequence[float]] | Array


class Payload(Spec):
    """A rigid body fixed to a link from the start to the end of a run.

    Attributes:
        link: name of a link, also one that is fixed to another.
        mass: mass [kg].
        position: its centre of mass in the link's frame [m].
        inertia: (ixx, iyy, izz, ixy, ixz, iyz) about its centre of mass, along the link's axes
            [kg m^2]; given as these six numbers or as a 3x3 matrix; None is a point mass.
    """

    kind: Literal["payload"] = "payload"
    link: Name
    mass: PositiveFloat
    position: Triple = (0.0, 0.0, 0.0)
    inertia: Moments | None = None

    def __init__(
        self,
        link: str,
        mass: float,
        position: Sequence[float] = (0.0, 0.0, 0.0),
        inertia: GivenInertia | None = None,
        **others: Any,
    ) -> None:
        """Check the numbers.

        Raises:
            ParameterError: naming the field, the value and what is allowed.
        """
        values = {"mass": mass, "position": position, "inertia": inertia}
        super().__init__(link=link, **values, **others)

    @field_validator("position", "inertia", mode="before")
    @classmethod
    def _plain(cls, value: Any) -> Any:
        return value.tolist() if isinstance(value, np.ndarray) else value

    @field_validator("inertia", mode="before")
    @classmethod
    def _six_numbers(cls, value: Any) -> Any:
        if value is None or np.shape(value) == (6,):
            return value
        if np.shape(value) != (3, 3) or not np.array_equal(value, np.transpose(value)):
            raise ParameterError(
                "Payload.inertia", value, "six numbers or a symmetric 3x3 matrix [kg m^2]"
            )
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = np.asarray(value).tolist()
        return xx, yy, zz, xy, xz, yz

    @model_validator(mode="after")
    def _is_a_rigid_body(self) -> Payload:
        small, middle, large = np.linalg.eigvalsh(self.inertia_matrix)
        slack = INERTIA_RELATIVE_TOLERANCE * abs(large)
        if small < -slack or small + middle < large - slack:
            raise ParameterError(
                "Payload.inertia",
                self.inertia,
                "that of a rigid body: principal moments not negative, and the two smaller ones "
                f"add up to the largest at least ({small:.6g}, {middle:.6g}, {large:.6g} kg m^2)",
            )
        return self

    @property
    def inertia_matrix(self) -> Array:
        """(3, 3) inertia about the centre of mass, along the link's axes [kg m^2]."""
        return symmetric_matrix(self.inertia)
