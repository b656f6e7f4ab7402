"""The multipliers of S1 eq. 1 as bearing loads: force and moment of every joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.errors import UnknownNameError
from hexapod_pin.formulations.maximal.joint_vectors import AXIS

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.derivative import MaximalDerivative
    from hexapod_pin.formulations.maximal.model import MaximalModel

FRAMES = ("world", "parent", "child")


@dataclass(frozen=True, eq=False)
class JointReaction:
    """Load that the parent's side of a joint puts on the child's, about the joint's origin.

    Attributes:
        joint: its name.
        frame: "world"; "parent" or "child": axes of that link.
        axis: (3,) unit axis of the joint in that frame.
        force: (3,) [N].
        moment: (3,) of the bearing, across the axis [N m].
        drive: torque of servo, damping and stops along the axis [N m].
    """

    joint: str
    frame: str
    axis: Array
    force: Array
    moment: Array
    drive: float

    @property
    def axial(self) -> float:
        """Force along the axis [N]."""
        return float(self.axis @ self.force)

    @property
    def radial(self) -> float:
        """Size of the force across the axis [N]."""
        return float(np.linalg.norm(self.force - self.axial * self.axis))

    @property
    def tilting(self) -> float:
        """Size of the moment across the axis [N m]."""
        return float(np.linalg.norm(self.moment))


def joint_reactions(
    model: MaximalModel, found: MaximalDerivative, frame: str = "child"
) -> dict[str, JointReaction]:
    """Return the reaction of every joint by name.

    With Baumgarte's terms and open joints the multipliers also hold what closes the joints again:
    use a projected state where reactions matter.

    Args:
        model: the model.
        found: its derivative at a state.
        frame: axes of the vectors: "world", "parent" or "child" link.

    Raises:
        UnknownNameError: another frame.
    """
    if frame not in FRAMES:
        raise UnknownNameError("frame", frame, list(FRAMES))
    bodies, at = model.bodies, found.kinematics
    across = found.constraints.on_child[:, 3:, 3:].transpose(0, 2, 1)
    world = (
        at.on_parent.value[:, :, AXIS],
        found.multipliers[:, :3],
        np.matmul(across, found.multipliers[:, 3:, None])[:, :, 0],
    )
    turn = {
        "world": np.eye(3)[None],
        "parent": at.rotation[bodies.parent],
        "child": at.rotation[1:],
    }[frame]
    axis, force, moment = (np.matmul(x[:, None, :], turn)[:, 0] for x in world)
    drive = found.torque + found.passive
    return {
        name: JointReaction(name, frame, axis[j], force[j], moment[j], float(drive[j]))
        for j, name in enumerate(bodies.joint_names)
    }
