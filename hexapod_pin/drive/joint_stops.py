"""Joint stops: what holds a joint within the range its URDF gives."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from pydantic import NonNegativeFloat

from hexapod_pin.drive.assumed_gains import assumed_gains
from hexapod_pin.spec import Spec

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot


class JointStops(Spec):
    """A spring with dissipation beyond each end of a joint's range: K d max(0, 1 + 1.5 a d').

    Hunt and Crossley's law with exponent 1, d how far the joint is beyond its limit. Never pulls.

    Attributes:
        stiffness: K [N m/rad]; 0 leaves the joints free beyond their limits.
        dissipation: a [s/rad].
        assumed: whether the numbers are this package's guess rather than the user's.
    """

    kind: Literal["hunt-crossley"] = "hunt-crossley"
    stiffness: NonNegativeFloat
    dissipation: NonNegativeFloat = 0.0
    assumed: bool = False

    @classmethod
    def for_robot(cls, robot: Robot, *, give: float = 0.01) -> JointStops:
        """Return *assumed* stops as `from_effort`, of the effort that the default servos assume.

        That is the largest effort where it is plausible, else what follows from weight and leg
        length; see `assumed_gains`.
        """
        return cls(stiffness=assumed_gains(robot).effort / give, dissipation=0.3, assumed=True)

    @classmethod
    def from_effort(cls, robot: Robot, *, give: float = 0.01) -> JointStops:
        """Return *assumed* stops: the largest effort gives way by `give` [rad], a = 0.3 s/rad."""
        effort = float(robot.effort.max()) if robot.effort.size else 0.0
        return cls(stiffness=effort / give, dissipation=0.3, assumed=True)
