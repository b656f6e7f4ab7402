"""MJCF in: a robot from MuJoCo's format, with the drives that its file has."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array, read_only
from hexapod_pin.drive.servo import Servo
from hexapod_pin.errors import UrdfError
from hexapod_pin.immutable import Immutable
from hexapod_pin.robot.loading.load_options import LoadOptions
from hexapod_pin.robot.reading.mjcf_urdf import actuators_of, compiled_mjcf
from hexapod_pin.robot.robot import Robot, load_robot
from hexapod_pin.user_file import user_path


@dataclass(frozen=True, eq=False)
class MjcfRobot(Immutable):
    """A robot from an MJCF file, and what drives its joints there; n joints.

    Attributes:
        robot: the robot, as `load_robot` gives it.
        kp: stiffness of the position actuators, `Robot.joint_names` order [N m/rad]; NaN of a joint
            without one. Shape (n,).
        kd: their damping [N m s/rad]; NaN likewise. Shape (n,).
        armature: what the rotors add to the joints' inertias [kg m^2]. Shape (n,).
        gravity: acceleration, world axes [m/s^2]. Shape (3,).
    """

    robot: Robot
    kp: Array = field(repr=False)
    kd: Array = field(repr=False)
    armature: Array = field(repr=False)
    gravity: Array

    @property
    def servo(self) -> Servo:
        """The servos of the file; the *assumed* ones where a joint has no position actuator."""
        if np.isnan(self.kp).any():
            return Servo.for_robot(self.robot)
        return Servo(kp=tuple(self.kp.tolist()), kd=tuple(self.kd.tolist()))


@checked
def read_mjcf(path: str | Path, *, options: LoadOptions | None = None) -> MjcfRobot:
    """Read a robot and its drives from an MJCF file; `load_robot` reads the robot alone.

    The file is read by MuJoCo (`pip install 'hexapod-pin[mujoco]'`). The trunk is the body with a
    free joint; hinges and slides are joints; what touches others is a collision shape, a sphere
    with a name a link of its own, and so is a site that is called a foot. The joint angles of the
    first keyframe are the standing posture. MJCF has no velocity limits, and torque limits only
    where actuators have force limits: a file that `write_mjcf` did not write needs
    `LoadOptions(repair=True)`, as a URDF without them does.

    Args:
        path: of the file.
        options: as of `load_robot`.

    Raises:
        MissingPackageError: MuJoCo is not installed.
        UrdfError: no MJCF, MuJoCo refuses it, or no robot that can be used: all findings at once.
        ParameterError, UnknownNameError: as `load_robot`.
    """
    robot = load_robot(user_path(path), options=options)
    _, model = compiled_mjcf(user_path(path))
    kp, kd, armature = [], [], []
    for name in robot.joint_names:
        try:
            joint = model.joint(name)
        except KeyError as error:
            finding = f"joint {name!r} is not in it: is it a URDF, or without names?"
            raise UrdfError(str(path), [finding]) from error
        servo = [x for x in actuators_of(model, joint.id) if model.actuator_biasprm[x, 1] < 0.0]
        gains = model.actuator_gainprm[servo[0], 0] if servo else np.nan
        scale = model.actuator_gear[servo[0], 0] ** 2 if servo else 1.0
        kp.append(scale * gains)
        kd.append(-scale * model.actuator_biasprm[servo[0], 2] if servo else np.nan)
        armature.append(float(model.dof_armature[joint.dofadr[0]]))
    return MjcfRobot(
        robot, read_only(kp), read_only(kd), read_only(armature), read_only(model.opt.gravity)
    )
