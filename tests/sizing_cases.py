"""Motions, motors and a walk that the tests of motor sizing share."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.drive.catalog import MotorRecord
from hexapod_pin.drive.catalog.motor_record import Derating

OMEGA = 2.0 * np.pi


def record(**changes: Any) -> MotorRecord:
    """Return a motor of round numbers: T0 2 N m, w0 8 rad/s, I0 3 A at 12 V, 100:1."""
    numbers: dict[str, Any] = dict(
        model="M", voltage=12.0, stall_torque=2.0, no_load_speed=8.0, stall_current=3.0,
        standby_current=0.0, gear_ratio=100.0, armature=0.01, armature_source="test", mass=0.05,
        source="test",
    )  # fmt: skip
    return MotorRecord(**numbers | changes)


def full(**changes: float) -> Derating:
    """Return a derating that allows everything in the data sheet."""
    return Derating(**dict(peak=1.0, continuous=1.0, voltage=1.0) | changes)


def cycle(count: int = 2000, cycles: int = 1) -> Array:
    return np.linspace(0.0, float(cycles), count * cycles + 1)


def of_motion(torque: Array, speed: Array, time: Array, **more: Any) -> hp.sizing.JointDemand:
    columns = [np.reshape(x, (len(time), -1)) for x in (torque, speed)]
    return hp.sizing.JointDemand.of_samples(time, *columns, cycles=round(time[-1]), **more)


def pure_inertia(inertia: float, amplitude: float = 0.5, **more: Any) -> hp.sizing.JointDemand:
    """Return the demand of an inertia that swings with an amplitude [rad] once a second."""
    time = cycle()
    speed = amplitude * OMEGA * np.cos(OMEGA * time)
    torque = -inertia * amplitude * OMEGA**2 * np.sin(OMEGA * time)
    return of_motion(torque, speed, time, load_inertia=inertia, **more)


@cache
def walk() -> hp.Trace:
    """Return a tetrapod walk with a payload, a rotor's inertia and samples each 2 ms."""
    robot = hp.load_robot("kharagpur")
    motor = hp.Motor(stall_torque=20.0, no_load_speed=20.0, rotor_inertia=1e-7, gear_ratio=100.0)
    servo = hp.Servo(**hp.Servo.for_robot(robot).model_dump() | {"motor": motor})
    scene = hp.Scene(robot, servo=servo, loads=[hp.Payload("base_link", mass=0.5)])
    gait = hp.KinematicControl(hp.Gait.tetrapod(stroke=0.05, cycle_time=0.6))
    return hp.simulate(scene, gait, duration=2.6, accuracy=1e-4, sample=2e-3)


@cache
def demand() -> hp.sizing.JointDemand:
    return hp.sizing.joint_demand(walk())
