"""The parts of a hexapod as validated numbers: trunk, leg segments with their joints, hips."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field, model_validator

from hexapod_pin.errors import ParameterError
from hexapod_pin.robot.description.solids import Vector, box_inertia, rod_inertia
from hexapod_pin.robot.description.urdf_writer import Shape
from hexapod_pin.spec import Spec

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Size = tuple[Positive, Positive, Positive]


class Trunk(Spec):
    """The trunk: a box, its frame at the centre of mass of the bare trunk."""

    mass: Positive
    """Mass without additional parts [kg]."""
    inertia: Size
    """(ixx, iyy, izz) about the centre of mass [kg m^2]."""
    size: Size
    """Edges of the box along x, y, z [m]: drawn only."""

    @classmethod
    def solid(cls, mass: float, size: Vector) -> Trunk:
        """Return the trunk as a solid box of this mass [kg] and these edges [m]."""
        return cls(mass=mass, inertia=box_inertia(mass, size), size=size)


class Segment(Spec):
    """One link of every leg and the joint that moves it; x runs along the link."""

    mass: Positive
    """Mass [kg]."""
    length: Positive
    """Distance from its joint to the next joint, or to the centre of the foot [m]."""
    inertia: Size
    """(ixx, iyy, izz) about the centre of mass, axes parallel to the link's frame [kg m^2]."""
    com: float
    """Distance of the centre of mass from the joint, along x [m]."""
    width: Positive
    """Width along y [m] (a rod's diameter): drawn only."""
    height: Positive | None
    """Height along z [m]: drawn only; None for a rod."""
    lower: float
    """Lower joint limit [rad]."""
    upper: float
    """Upper joint limit [rad]."""
    effort: NotNegative
    """Largest joint torque [N m]."""
    velocity: Positive
    """Largest joint rate [rad/s]."""
    damping: NotNegative = 0.0
    """Viscous damping of the joint [N m s/rad]."""

    @model_validator(mode="after")
    def _limits_in_order(self) -> Segment:
        if self.lower > self.upper:
            raise ParameterError("Segment.lower", self.lower, f"at most upper = {self.upper} rad")
        return self

    @classmethod
    def box(
        cls, mass: float, size: Vector, limits: tuple[float, float], effort: float, velocity: float
    ) -> Segment:
        """Return a solid box of edges `size` [m], its length along x; limits in rad, N m, rad/s."""
        return cls(
            mass=mass, length=size[0], inertia=box_inertia(mass, size), com=size[0] / 2,
            width=size[1], height=size[2], lower=limits[0], upper=limits[1],
            effort=effort, velocity=velocity,
        )  # fmt: skip

    @classmethod
    def rod(
        cls, mass: float, length: float, radius: float, limits: tuple[float, float],
        effort: float, velocity: float,
    ) -> Segment:  # fmt: skip
        """Return a solid cylinder [m] with its axis along x; limits in rad, N m, rad/s."""
        return cls(
            mass=mass, length=length, inertia=rod_inertia(mass, length, radius), com=length / 2,
            width=2 * radius, height=None, lower=limits[0], upper=limits[1],
            effort=effort, velocity=velocity,
        )  # fmt: skip

    def shape(self) -> Shape:
        """Return the primitive that is drawn, in the link's frame."""
        centre = (self.length / 2, 0.0, 0.0)
        if self.height is None:
            return Shape("rod", (self.length, self.width / 2), centre)
        return Shape("box", (self.length, self.width, self.height), centre)


class Hip(Spec):
    """Where a leg is fixed to the trunk."""

    position: Vector
    """Origin of the coxa joint in base_link [m]."""
    yaw: float
    """Angle from forward to the leg's outward direction, about z [rad]."""


def six_hips(x: float, y: float) -> dict[str, Hip]:
    """Return hips at x, 0 and -x [m], y [m] to the left and right, each pointing sideways."""
    sides, rows = {"l": 1.0, "r": -1.0}, {"f": x, "m": 0.0, "r": -x}
    return {
        side + row: Hip(position=(forward, sign * y, 0.0), yaw=sign * math.pi / 2)
        for side, sign in sides.items()
        for row, forward in rows.items()
    }
