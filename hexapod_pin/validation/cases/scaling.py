"""HC36: a hexapod a thousand times smaller or larger moves the same, in its own time."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from hexapod_pin.drive.servo import Servo
from hexapod_pin.ground.contact import Contact, HuntCrossley, TanhCoulomb
from hexapod_pin.robot.robot import Robot, load_robot
from hexapod_pin.scene.scene import Scene
from hexapod_pin.validation.case_result import ExpectedValue
from hexapod_pin.validation.cases.bodies import NO_JOINT_STOPS
from hexapod_pin.validation.cases.drop import drop
from hexapod_pin.validation.cases.robots import robot_file
from hexapod_pin.validation.hard_case import HardCase, Trial
from hexapod_pin.validation.position_error import PositionError
from hexapod_pin.validation.solver_setting import CaseRun, SolverSetting

Values = Iterator[ExpectedValue]


def scaled(setting: SolverSetting, size: float) -> Values:
    """CaseRun both for the same number of steps, each in its own time.

    Lengths x s, masses x s^3, times x sqrt(s), K x s^1.5, slopes and dissipations x 1/sqrt(s),
    kp x s^4, kd x s^4.5.
    """
    run = drop("soft", duration=0.05, sample=1e-3)
    small = _scaled_run(run, size)
    pace = small.duration / run.duration
    known = run.by(setting).q
    found = small.by(SolverSetting(setting.method, setting.value * pace)).q.copy()
    found[:, :3] /= size
    yield ExpectedValue(
        f"motion at {size:g} of the size", PositionError.between(found, known).q, 1e-9
    )


def _scaled_run(run: CaseRun, size: float) -> CaseRun:
    pace = float(np.sqrt(size))
    scene, robot = run.scene, scaled_robot(size)
    normal, friction = scene.contact.normal, scene.contact.friction
    assert isinstance(normal, HuntCrossley) and isinstance(friction, TanhCoulomb)
    contact = Contact(
        normal=HuntCrossley(
            stiffness=normal.stiffness * size**1.5, dissipation=normal.dissipation / pace
        ),
        friction=TanhCoulomb(mu=friction.mu, slope=friction.slope / pace),
    )
    kp, kd = scene.servos.gains(scene.robot)
    stiffness, damping = tuple(kp * size**4), tuple(kd * size**4 * pace)
    servo = Servo(kp=stiffness, kd=damping, limited=False)
    q, v = run.start.q.copy(), run.start.v.copy()
    q[:3] *= size
    v[:3] *= size / pace
    v[3:] /= pace
    start = robot.check_state(q, v)
    sample = None if run.sample is None else run.sample * pace
    scaled = Scene(robot, contact=contact, servo=servo, stops=NO_JOINT_STOPS)
    return CaseRun(scaled, start, run.duration * pace, sample, run.controller)


def scaled_robot(size: float) -> Robot:
    """Return the reference hexapod with lengths x size, masses x size^3, inertias x size^5."""
    tree = ET.parse(robot_file("hexa_ref"))
    for tag, name, power in (("origin", "xyz", 1), ("mass", "value", 3)):
        for element in tree.iter(tag):
            if name in element.attrib:
                numbers = [float(x) * size**power for x in element.attrib[name].split()]
                element.set(name, " ".join(map(repr, numbers)))
    for element in tree.iter("inertia"):
        for name, value in element.attrib.items():
            element.set(name, repr(float(value) * size**5))
    with TemporaryDirectory() as folder:
        path = Path(folder) / "scaled.urdf"
        tree.write(path)
        return load_robot(path)


CASES = (
    HardCase("HC36", "a size of 1 mm and of 1 km: hidden absolute thresholds", (
        Trial(scaled, (SolverSetting("implicit-euler", 1e-4), SolverSetting("rk4", 1e-4),
                       SolverSetting("robust", 1e-3)),
              variants=((1e-3,), (1e3,)), quick_settings=2),
    )),
)  # fmt: skip
