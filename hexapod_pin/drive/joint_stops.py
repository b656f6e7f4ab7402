"""Joint stops: what holds a joint within the range its URDF gives."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np
from pydantic import NonNegativeFloat, PositiveFloat, model_serializer

from hexapod_pin.drive.servo import assumed_gains
from hexapod_pin.spec import Spec

if TYPE_CHECKING:
    from pydantic import SerializerFunctionWrapHandler

    from hexapod_pin.arrays import Array
    from hexapod_pin.robot.robot import Robot


class JointStops(Spec):
    """A spring with dissipation beyond each end of a joint's range: K d max(0, 1 + 1.5 a d').

    Hunt and Crossley's law with exponent 1, d how far the joint is beyond its limit. Never pulls.

    Attributes:
        stiffness: K [N m/rad]; 0 leaves the joints free beyond their limits.
        sliding_stiffness: K of joints that slide [N/m]; None: 0.
        dissipation: a [s/rad, or s/m of joints that slide].
        gap_stiffness: K of the edges of gears with backlash [N m/rad]; None: `stiffness`.
        assumed: whether the numbers are this package's guess rather than the user's.
    """

    kind: Literal["hunt-crossley"] = "hunt-crossley"
    stiffness: NonNegativeFloat
    sliding_stiffness: NonNegativeFloat | None = None
    dissipation: NonNegativeFloat = 0.0
    gap_stiffness: PositiveFloat | None = None
    assumed: bool = False

    @model_serializer(mode="wrap")
    def _without_none(self, dump: SerializerFunctionWrapHandler) -> dict[str, object]:
        return {name: value for name, value in dump(self).items() if value is not None}

    def stiffnesses(self, robot: Robot) -> Array:
        """Return K of each joint [N m/rad, or N/m of joints that slide]. Shape (n,)."""
        values: Array = np.where(robot.turning, self.stiffness, self.sliding_stiffness or 0.0)
        if self.gap_stiffness is not None:
            gaps = np.array([name in robot.gaps for name in robot.joint_names], dtype=bool)
            values = np.where(gaps, self.gap_stiffness, values)
        return values

    def describe(self) -> str:
        """Return a text of the numbers with their units."""
        text = f"{self.stiffness:g} N m/rad, "
        if self.sliding_stiffness is not None:
            text += f"{self.sliding_stiffness:g} N/m where joints slide, "
        if self.gap_stiffness is not None:
            text += f"{self.gap_stiffness:g} N m/rad at the edges of gaps, "
        return text + f"{self.dissipation:g} s/rad"

    @classmethod
    def for_robot(cls, robot: Robot, *, give: float = 0.01) -> JointStops:
        """Return *assumed* stops as `from_effort`, of the effort that the default servos assume.

        That is the largest effort where it is plausible, else what follows from weight and leg
        length; see `assumed_gains`.
        """
        effort = assumed_gains(robot).effort
        return cls.from_effort(robot, give=give).model_copy(update={"stiffness": effort / give})

    @classmethod
    def from_effort(
        cls, robot: Robot, *, give: float = 0.01, sliding_give: float = 1e-3
    ) -> JointStops:
        """Return *assumed* stops, a = 0.3 s/rad.

        Args:
            robot: whose joints they hold.
            give: by how much the largest torque gives way [rad].
            sliding_give: by how much the largest force of joints that slide does [m].
        """
        turning, sliding = robot.effort_limit[robot.turning], robot.effort_limit[~robot.turning]
        return cls(
            stiffness=(float(turning.max()) if turning.size else 0.0) / give,
            sliding_stiffness=float(sliding.max()) / sliding_give if sliding.size else None,
            dissipation=0.3,
            assumed=True,
        )
