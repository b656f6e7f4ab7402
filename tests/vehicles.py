"""Small scenes shared by the tests: point masses, the reference hexapod, its hard-case states."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

import hexapod_pin as hp
from hexapod_pin.robot.loading.load_options import LoadOptions
from hexapod_pin.validation.cases.robots import references, robot_file

HARD_CASES: dict[str, Any] = references()
FREE = hp.JointStops(stiffness=0.0)  # joints may pass their limits, as in the references
LIMP = hp.Servo(kp=0.0, kd=0.0, limited=False)


def block(tmp_path: Path, feet: dict[str, tuple[float, float, float]], **mass: Any) -> hp.Robot:
    """One rigid body with point feet at the given places (body axes, m).

    Args:
        tmp_path: where its URDF goes.
        feet: name -> place.
        mass: m [kg], com [m], inertia (diagonal) [kg m^2].
    """
    m, com = mass.get("m", 1.0), mass.get("com", (0.0, 0.0, 0.0))
    ixx, iyy, izz = mass.get("inertia", (0.01, 0.01, 0.01))
    links = "".join(
        f'<link name="{name}"/><joint name="{name}_fix" type="fixed"><parent link="body"/>'
        f'<child link="{name}"/><origin xyz="{x} {y} {z}"/></joint>'
        for name, (x, y, z) in feet.items()
    )
    text = (
        '<robot name="block"><link name="body"><inertial>'
        f'<origin xyz="{com[0]} {com[1]} {com[2]}"/><mass value="{m}"/>'
        f'<inertia ixx="{ixx}" iyy="{iyy}" izz="{izz}" ixy="0" ixz="0" iyz="0"/>'
        f"</inertial></link>{links}</robot>"
    )
    path = tmp_path / "block.urdf"
    path.write_text(text)
    return hp.load_robot(path, feet=list(feet))


def particle(tmp_path: Path, m: float = 1.0) -> hp.Robot:
    """A body whose single point foot is its centre of mass: a particle against the ground."""
    return block(tmp_path, {"foot": (0.0, 0.0, 0.0)}, m=m)


def hexa_ref(**kwargs: Any) -> hp.Robot:
    """The hard cases' hexapod."""
    return hp.load_robot(robot_file("hexa_ref"), **kwargs)


def state(robot: hp.Robot, z: float = 0.0, v: tuple[float, ...] = (0.0, 0.0, 0.0)) -> hp.State:
    """A level state at height z with linear base velocity v."""
    q = pin.neutral(robot.model)
    q[2] = z
    rates = np.zeros(robot.model.nv)
    rates[:3] = v
    return robot.check_state(q, rates)


def drop(robot: hp.Robot) -> tuple[hp.Scene, hp.State, np.ndarray]:
    """HC40 soft: scene, initial state and the posture held."""
    params = HARD_CASES["HC40_hexapod_drop_soft"]["params"]
    q = pin.neutral(robot.model)
    q[2] = 0.09879 - 0.11934 * np.sin(0.3) + params["clear"]
    rotation = pin.rpy.rpyToMatrix(params["roll"], params["pitch"], 0.0)
    q[3:7] = pin.Quaternion(rotation).coeffs()
    posture = np.tile([0.0, -0.3, 0.3], 6)
    q[7:] = posture
    v = np.zeros(robot.model.nv)
    v[:3] = rotation.T @ np.array(params["vel"])
    contact = hp.Contact(
        normal=hp.contact.HuntCrossley(stiffness=params["K"], dissipation=params["a"]),
        friction=hp.contact.TanhCoulomb(mu=params["mu"], slope=params["kt"]),
    )
    servo = hp.Servo(kp=params["kp"], kd=params["kd"], limited=False)
    scene = hp.Scene(robot, contact=contact, servo=servo, stops=FREE)
    return scene, robot.check_state(q, v), posture


def heavy_leg(upper: float, backlash: dict[str, float] | None = None) -> hp.Robot:
    """A light link on three bodies of 1e9 kg, axes along y; its joint ends at `upper` [rad].

    The heavy bodies stay where they are to 1e-11 of the light one's motion.
    """
    body = (
        '<link name="{0}"><inertial><origin xyz="0 0 -0.1"/><mass value="{1}"/>'
        '<inertia ixx="{2}" iyy="{2}" izz="{2}" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    )
    joint = (
        '<joint name="{1}_joint" type="revolute"><parent link="{0}"/><child link="{1}"/>'
        '<origin xyz="0 0 -0.1"/><axis xyz="0 1 0"/>'
        '<limit lower="-1" upper="{2}" effort="10" velocity="100"/></joint>'
    )
    text = "".join(body.format(name, 1e9, 1e9) for name in ("base", "a", "b"))
    text += body.format("c", 0.1, 1e-3) + '<link name="tip"/>'
    text += (
        joint.format("base", "a", 1.0) + joint.format("a", "b", 1.0) + joint.format("b", "c", upper)
    )
    text += (
        '<joint name="tip_fix" type="fixed"><parent link="c"/><child link="tip"/>'
        '<origin xyz="0 0 -0.2"/></joint>'
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "heavy_leg.urdf"
        path.write_text(f'<robot name="heavy_leg">{text}</robot>')
        options = LoadOptions(backlash=backlash)
        return hp.load_robot(path, feet=["tip"], posture={"c_joint": 0.0}, options=options)
