"""Drives as they are, drawn at random: gear friction, backlash, firmware on a battery, heat."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from hexapod_pin.control.firmware_control import FirmwareControl
from hexapod_pin.control.sampled_trajectory import HoldPosture
from hexapod_pin.drive.battery import Battery
from hexapod_pin.drive.catalog.identified import identified_drive
from hexapod_pin.drive.firmware import Firmware
from hexapod_pin.drive.joint_stops import JointStops
from hexapod_pin.drive.servo import Servo
from hexapod_pin.robot.loading.load_options import LoadOptions
from hexapod_pin.robot.robot import load_robot
from random_scenes.bodies import SAMPLE
from random_scenes.draws import Draws
from random_scenes.drives import DURATION, jumping
from random_scenes.generator import Kind
from random_scenes.robots import WALKERS, draw_gait, draw_scene_parts, robot_named
from random_scenes.scene import PromiseScene, SceneLabels

if TYPE_CHECKING:
    from hexapod_pin.drive.motor import Motor
    from hexapod_pin.robot.robot import Robot

SERVOS = ("MX-64", "MX-106")
"""Identified, and strong enough for both robots."""

FINE = 2**24
"""Counts of the encoders: those of a coarse one fall on other passes in every run, which the error
estimated does not contain (docs/drive.md)."""


def _motor(rng: Draws) -> tuple[str, Motor]:
    name = rng.pick(SERVOS)
    return name, identified_drive(name).motor(rng.between(10.0, 14.0))


def geared(rng: Draws) -> PromiseScene:
    """Continuous servos whose gears have friction under load: a walk, or set-points that jump."""
    name = rng.pick(WALKERS)
    servo, motor = _motor(rng)
    kp = rng.log_between(10.0, 100.0)
    drive = Servo(kp=kp, kd=kp * rng.log_between(0.01, 0.05), motor=motor)
    scene, labels = draw_scene_parts(rng, name, servo=drive)
    walks = rng.chance(0.6)
    control = draw_gait(rng, name) if walks else jumping(rng, scene.robot, 0.1, DURATION)
    about = SceneLabels(kind="gear friction", drive=f"{servo}, M6", **labels)
    return PromiseScene(about, scene, control, None, DURATION, SAMPLE)


def supplied(rng: Draws) -> PromiseScene:
    """Firmware with gear friction on a weak battery, its motors warming, its commands late."""
    name = rng.pick(WALKERS)
    servo, motor = _motor(rng)
    period = rng.pick((2e-3, 4e-3))
    firmware = Firmware(
        proportional=rng.between(3.0, 8.0), integral=rng.pick((0.0, 2.0)),
        derivative=rng.pick((0.0, 0.05)), counts=FINE, period=period,
        delay=rng.pick((0.0, 0.3 * period)),
    )  # fmt: skip
    warm = motor.warming(rng.between(0.05, 0.2))
    volts = motor.no_load_speed * (motor.torque_constant or 1.0)
    pack = Battery(
        voltage=volts, resistance=rng.between(0.05, 0.5), standby_current=1.0, capacity=1.0,
        curve=((0.0, 0.8), (1.0, 1.0)), regeneration=rng.chance(0.5),
    )  # fmt: skip
    scene, labels = draw_scene_parts(rng, name, servo=firmware.driven(warm))
    walk = draw_gait(rng, name) if rng.chance(0.7) else HoldPosture()
    control = FirmwareControl(walk, firmware, battery=pack, heat=True)
    about = SceneLabels(kind="firmware", drive=f"{servo}, battery, heat", **labels)
    return PromiseScene(about, scene, control, None, 0.2, SAMPLE)


@lru_cache(maxsize=8)
def _loose(name: str, joints: tuple[str, ...], play: float) -> Robot:
    return load_robot(name, options=LoadOptions(backlash=dict.fromkeys(joints, play)))


def loose(rng: Draws) -> PromiseScene:
    """A leg's joints with backlash, identified drives: set-points that jump, or a walk."""
    name = rng.pick(WALKERS)
    leg = rng.pick(robot_named(name).legs)
    robot = _loose(name, tuple(leg.joints), rng.between(0.005, 0.02))
    servo, motor = _motor(rng)
    kp = rng.log_between(20.0, 80.0)
    stops = JointStops(
        stiffness=600.0, dissipation=rng.between(0.1, 0.5), gap_stiffness=rng.between(300.0, 1e3)
    )
    parts: dict[str, Any] = {"servo": Servo(kp=kp, kd=0.02 * kp, motor=motor), "stops": stops}
    scene, labels = draw_scene_parts(rng, name, **parts)
    scene = replace(scene, robot=robot)
    about = SceneLabels(kind="backlash", drive=f"{servo}, play", **labels)
    return PromiseScene(about, scene, draw_gait(rng, name), None, 0.2, SAMPLE)


REAL_DRIVES: Mapping[str, Kind] = {
    "gear friction": Kind(4.0, geared),
    "firmware": Kind(4.0, supplied),
    "backlash": Kind(2.0, loose),
}
"""Kinds beside those of `KINDS`."""
