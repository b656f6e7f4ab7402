"""Small scenes shared by the tests: point masses, the reference hexapod, its hard-case states."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

import hexapod_pin as hp

DATA = Path(__file__).parent / "data"
HARD_CASES: dict[str, Any] = json.loads((DATA / "hardcases.json").read_text())
STIFF_LEGS = hp.Servo(kp=1e4, kd=1e2, limited=False)
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
    return hp.load_robot(DATA / "hexa_ref.urdf", **kwargs)


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
        normal=hp.HuntCrossley(stiffness=params["K"], dissipation=params["a"]),
        friction=hp.TanhCoulomb(mu=params["mu"], slope=params["kt"]),
    )
    servo = hp.Servo(kp=params["kp"], kd=params["kd"], limited=False)
    scene = hp.Scene(robot, contact=contact, servo=servo, stops=FREE)
    return scene, robot.check_state(q, v), posture
