"""The native plant is built from a scene; the motion of joints may be prescribed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.drive.drive_law import armature, check_gaps, drive_law
from hexapod_pin.drive.joint_stops import JointStops
from hexapod_pin.errors import ParameterError, StateError
from hexapod_pin.results.checkpoint import Checkpoint
from hexapod_pin.robot.robot import once_per_robot
from hexapod_pin.scene.loaded_model import (
    KEPT_MODELS,
    MassLoads,
    models_by_mass,
    native_loads,
)
from hexapod_pin.scene.scene import loaded_model, standing_on

if TYPE_CHECKING:
    import pinocchio as pin

    from hexapod_pin.control.joint_trajectory import JointTrajectory
    from hexapod_pin.native import TreeModel
    from hexapod_pin.robot.robot import Robot
    from hexapod_pin.robot.state import State
    from hexapod_pin.scene.scene import Scene


def starting_point(
    scene: Scene,
    posture: Array,
    initial: State | Checkpoint | None,
    trunk: Array | None = None,
) -> Checkpoint:
    """Return where a run begins: as given, or standing in a posture (n,) [rad].

    `trunk` (7,) is its pose relative to a level one in the same place; None: level.
    """
    robot = scene.robot
    if isinstance(initial, Checkpoint):
        robot.check_state(initial.q, initial.v)
        return initial
    if initial is None:
        state = standing_on(scene, posture, trunk)
    else:
        state = robot.check_state(initial.q, initial.v)
    return Checkpoint(0.0, state.q, state.v, np.zeros((0, 6)))


def native_model(model: pin.Model) -> TreeModel:
    """Return the bodies of a model as the native core takes them.

    Args:
        model: a free-flyer, then revolute and prismatic joints alone.

    Raises:
        ParameterError: another joint.
    """
    from hexapod_pin import native as _native

    for joint in range(1, model.njoints):
        freedoms, wanted = (model.nqs[joint], model.nvs[joint]), (7, 6) if joint == 1 else (1, 1)
        if freedoms != wanted or model.idx_vs[joint] != (0 if joint == 1 else joint + 4):
            raise ParameterError(
                "model", model.names[joint], "a free-flyer, then one-coordinate joints"
            )
    placements = list(model.jointPlacements)[1:]
    inertias = list(model.inertias)[1:]
    motion = np.zeros((model.njoints - 1, 6))
    for row, joint in enumerate(list(model.joints)[2:], start=1):
        motion[row] = np.asarray(joint.createData().S).ravel()
    return _native.tree_model(
        parent=model.parents.tolist()[1:],
        motion=motion,
        placement=np.array([[*p.rotation.ravel(), *p.translation] for p in placements]),
        inertia=np.array([[y.mass, *y.lever, *y.inertia.ravel()] for y in inertias]),
        armature=model.armature,
    )


@once_per_robot
def _trees_by_mass(robot: Robot) -> Callable[[MassLoads], TreeModel]:
    """Return the function that gives the core's model of a robot for loads of mass, each once."""
    model_with = models_by_mass(robot)

    @lru_cache(maxsize=KEPT_MODELS)
    def tree_with(loads: MassLoads) -> TreeModel:
        return native_model(model_with(loads))

    return tree_with


def _driven_model(scene: Scene) -> TreeModel:
    """Return the robot's bodies, its joints heavier by the rotors of their motors."""
    rotors = armature(scene.robot, scene.servos)
    if not rotors.any():
        return _trees_by_mass(scene.robot)(scene.mass_loads)
    model = loaded_model(scene).copy()
    model.armature = model.armature + np.concatenate([np.zeros(6), rotors])
    return native_model(model)


def native_plant(scene: Scene, *, dense: bool = False) -> Any:
    """Return the native settings of a scene's plant; `dense` avoids the block-arrow solver."""
    from hexapod_pin import native as _native

    robot = scene.robot
    if not scene.prescribed:
        check_gaps(robot, scene.servos, scene.joint_stops)
    feet = [
        (_native_joint(robot, foot.joint), np.asarray(foot.offset, dtype=float), float(foot.radius))
        for foot in robot.feet
    ]
    loads = native_loads(scene.robot, scene.settings)
    feet += [point[:3] for point in loads.body_points]
    return _native.plant_settings(
        model=_driven_model(scene),
        gravity=np.asarray(scene.gravity, dtype=float),
        feet=feet,
        normal=scene.contact.normal.native(),
        friction=scene.contact.friction.native(),
        terrain=scene.terrain.native(),
        drive=drive_law(robot, scene.servos, acting_stops(scene)),
        pushes=loads.pushes,
        lost=[(joint, time) for joints, time in loads.lost for joint in joints],
        dense=dense,
        prescribed=scene.prescribed,
    )


def acting_stops(scene: Scene) -> JointStops:
    """Return the joint stops that act: none on joints that follow a motion."""
    return JointStops(stiffness=0.0) if scene.prescribed else scene.joint_stops


def _native_joint(robot: Any, joint: str) -> int:
    if not robot.model.existJointName(joint):
        raise ParameterError("foot joint", joint, f"a joint of {robot.name}")
    return int(robot.model.getJointId(joint))


# Prescribed motion: which references joints can follow exactly, and where such a run starts.

START_TOLERANCE = 1e-9
"""How far the joints may be from their motion at the start [rad, rad/s]."""


def prescribed_start(
    robot: Robot, plan: JointTrajectory, start: Checkpoint, *, given: bool
) -> Checkpoint:
    """Return a start whose joints have the rates of their motion; one that is given must have them.

    Raises:
        ParameterError: set-points jump, or move at rates that jump: no torque does that.
        StateError: a joint of a given state does not start where its motion does.
    """
    if plan.kind in ("held", "linear") and len(plan.time) > 1:
        raise ParameterError(
            "Scene.prescribed", True, f"False with {plan.kind} set-points",
            "Joints follow a motion exactly where its rates are continuous: KinematicControl, "
            "ArcWalk, JointMotion, HoldPosture.",
        )  # fmt: skip
    angle, rate = motion_at(plan, start.time)
    if not given:
        return replace(start, v=np.concatenate([start.v[:6], rate]))
    _check_joints(robot, "angle", "rad", start.q[7:], angle, start.time)
    _check_joints(robot, "rate", "rad/s", start.v[6:], rate, start.time)
    return start


def _check_joints(
    robot: Robot, name: str, unit: str, here: Array, there: Array, time: float
) -> None:
    """Refuse joints that are not where their motion is at a time [s]."""
    off = np.abs(here - there)
    if off.size and off.max() > START_TOLERANCE:
        joint = int(off.argmax())
        raise StateError(
            f"initial {name} of {robot.joint_names[joint]} = {here[joint]:.9g} {unit}: its motion "
            f"has {there[joint]:.9g} {unit} at t = {time:g} s. With Scene.prescribed, start "
            "there, or leave `initial` out."
        )


def refuse_commands(prescribed: bool, what: str) -> None:
    """Refuse prescribed motion where set-points are not known before the run.

    Raises:
        ParameterError: joints are to follow commands exactly.
    """
    if prescribed:
        raise ParameterError(
            "Scene.prescribed", True, f"False {what}",
            "Commands jump at ticks; stiff servos follow them, nothing follows them exactly.",
        )  # fmt: skip


def motion_at(plan: JointTrajectory, time: float) -> tuple[Array, Array]:
    """Return angles [rad] and rates [rad/s] of a motion (n,), as the native core follows it."""
    from hexapod_pin import native

    last = int(np.clip(np.searchsorted(plan.time, time, side="right"), 1, len(plan.time) - 1))
    near = slice(max(0, last - 2), last + 2)
    curves = native_acceleration(plan)
    rows = native.set_points_at(
        time=plan.time[near].tolist(), position=plan.q[near], rate=plan.v[near], kind=plan.kind,
        acceleration=curves[near.start : near.stop - 1], at=float(time),
    )  # fmt: skip
    return rows[0], rows[1]


def native_acceleration(plan: JointTrajectory) -> Array:
    """Return the accelerations of quintic intervals as the core takes them (K - 1, 2 n)."""
    if plan.kind != "quintic" or plan.acceleration is None:
        return np.zeros((0, 0))
    flat: Array = np.ascontiguousarray(plan.acceleration.reshape(len(plan.time) - 1, -1))
    return flat
