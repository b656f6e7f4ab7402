"""The robot with the masses of a scene, and its loads as the native core takes them."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.robot.link_shapes import trunk_points
from hexapod_pin.robot.loading.pin_model import mass_change, placement, with_mass_changes
from hexapod_pin.robot.robot import once_per_robot
from hexapod_pin.scene.loads import LostLeg, MassLoad, Push

if TYPE_CHECKING:
    import pinocchio as pin

    from hexapod_pin.robot.robot import Robot
    from hexapod_pin.scene.settings import SceneSettings

KEPT_MODELS = 32
"""How many sets of changed masses are remembered of a robot."""

TRUNK_JOINT = 1
"""Index of the free-flyer, in Pinocchio's model and in the core's."""

MassLoads = tuple[MassLoad, ...]
NativePush = tuple[int, Array, Array, Array, float, float]
NativePoint = tuple[int, Array, float, str]


class NativeLoads(NamedTuple):
    """Loads in plain numbers; joints by their index in the model, the free-flyer is 1.

    Attributes:
        pushes: joint, point in the joint's frame (3,) [m], force (3,) [N] and torque (3,) [N m] in
            world axes, start and end [s].
        lost: indices of a leg's joints in `Robot.joint_names`, and when they are lost [s].
        body_points: joint, centre in its frame (3,) [m], radius [m] and name of the points that
            the ground pushes; empty without body contact.
        trunk_points: the same of the points whose contact is noticed.
    """

    pushes: list[NativePush]
    lost: list[tuple[list[int], float]]
    body_points: list[NativePoint]
    trunk_points: list[NativePoint]


@once_per_robot
def models_by_mass(robot: Robot) -> Callable[[MassLoads], pin.Model]:
    """Return the function that gives a robot's model for loads of mass, each built once."""
    bare = robot.model

    @lru_cache(maxsize=KEPT_MODELS)
    def model_with(loads: MassLoads) -> pin.Model:
        changes = [mass_change(load.model_dump()) for load in loads]
        return with_mass_changes(bare, [x for x in changes if x is not None]) if loads else bare

    return model_with


def native_loads(robot: Robot, scene: SceneSettings) -> NativeLoads:
    """Return what acts on the robot of a scene besides servos, gravity and its feet's contacts.

    Loads of mass are not among them: they are part of `loaded_model`.
    """
    trunk = trunk_points(robot)
    points: list[NativePoint] = [
        (TRUNK_JOINT, np.array(place), float(radius), name)
        for place, radius, name in zip(trunk.points, trunk.radius, trunk.names, strict=True)
    ]
    lost = [load for load in scene.loads if isinstance(load, LostLeg)]
    return NativeLoads(
        pushes=[native_push(robot, load) for load in scene.loads if isinstance(load, Push)],
        lost=[([robot.joint_index(j) for j in robot.leg(x.leg).joints], x.start) for x in lost],
        body_points=points if scene.body_contact else [],
        trunk_points=points,
    )


def native_push(robot: Robot, load: Push) -> NativePush:
    """Return a push as the native core takes it."""
    name, place = placement(robot.model, load.link)
    point = np.array(place.act(np.array(load.position)))
    force, torque = np.array(load.force), np.array(load.torque)
    return int(robot.model.getJointId(name)), point, force, torque, load.start, load.end
