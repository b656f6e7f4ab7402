"""Feedback controllers whose set-points pass through the firmware of bus servos."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from refusals import refused
from scipy.interpolate import CubicHermiteSpline
from scipy.linalg import expm

import hexapod_pin as hp
from hexapod_pin.control.feedback import Command
from hexapod_pin.control.sensors import Sensor, Sensors
from hexapod_pin.errors import ParameterError
from tests.test_firmware import EMF, INERTIA, JOINT, STALL, driven, loop, run
from tests.test_supply import MOTOR as PACKED
from tests.test_supply import PACK
from tests.test_supply import driven as supplied_by
from tests.vehicles import heavy_leg

GOAL, GAIN = 0.1, 0.7  # rad, -: a tick asks for GAIN of the way that is left, beyond what is read
LATE, AGE, TICK = 2.3e-3, 2e-3, 5e-3  # s


@dataclass(frozen=True)
class Chase:
    """Asks for a share of the way to a goal; its memory counts the ticks, which weaken it."""

    ramp: bool = True
    rate: bool = False  # whether it gives the rate at the end of a ramp
    period: float = TICK
    delay: float = LATE
    sensors: Sensors = Sensors(delay=AGE)
    far: float = 0.0  # rad, added to what it asks for
    torque: float | None = None
    odd: Any = None  # the rates that it commands

    def start(self, scene: Any, batch: int) -> dict[str, int]:
        assert max(scene.servos.gains(scene.robot)[0]) == pytest.approx(STALL * 4.0)
        return {"ticks": 0}

    def update(self, time: float, m: Any, state: dict[str, int]) -> tuple[Command, Any]:
        asked, rate = aim(m.q[:, -1], state["ticks"])
        q, v = np.zeros((2, *m.q.shape))
        q[:, -1], v[:, -1] = asked + self.far, rate
        torque = None if self.torque is None else np.full(q.shape, self.torque)
        rates = v if self.rate else None
        ramp = self.ramp or (self.rate and state["ticks"] % 2 == 1)
        command = Command(q, rates if self.odd is None else self.odd, torque, ramp=ramp)
        return command, {"ticks": state["ticks"] + 1}


def aim(angle: Any, ticks: int) -> tuple[Any, Any]:
    """Return the angle [rad] and rate [rad/s] that a tick asks for."""
    way = GAIN * (GOAL - angle) / (1.0 + 0.1 * ticks)
    return angle + way, way / 0.02


def exact_chase(firmware: hp.drive.Firmware, chase: Chase, until: float, goals: bool) -> np.ndarray:
    h, count = firmware.period, 2.0 * math.pi / firmware.counts
    system = np.zeros((3, 3))
    system[0, 1], system[1, 1], system[1, 2] = 1.0, -EMF / INERTIA, STALL / INERTIA
    pass_on = expm(system * h)
    x, total, before = np.zeros(3), 0.0, None
    read, coming, found = [], [], []
    way, ends = CubicHermiteSpline([-1.0, 0.0], [0.0, 0.0], [0.0, 0.0]), 0.0

    def asked(at: float) -> tuple[float, float]:
        inside = min(at, ends)
        return float(way(inside)), float(way(inside, 1))

    ticks, stepped = 0, None  # rad/s: that of a step, with which a ramp begins
    for k in range(round(until / h) + 1):
        if k % round(0.01 / h) == 0:
            found.append(x[0])
        read.append(x[0])
        if k % round(chase.period / h) == 0:
            to, rate = aim(read[max(0, k - round(AGE / h))], ticks)
            coming.append((k * h + chase.delay, to, rate, ticks))
            ticks += 1
        if coming and coming[0][0] <= k * h:
            begin, to, rate, number = coming.pop(0)
            start, leaves = asked(begin)
            ends = begin + chase.period
            moves = chase.ramp or (chase.rate and number % 2 == 1)
            if goals or not moves:
                way = CubicHermiteSpline([begin, ends], [to, to], [0.0, 0.0])
                stepped = rate if chase.rate else 0.0
            else:
                leaves, stepped = (leaves if stepped is None else stepped), None
                arrives = rate if chase.rate else (to - start) / chase.period
                way = CubicHermiteSpline([begin, ends], [start, to], [leaves, arrives])
        e = round(asked(k * h)[0] / count) - round(x[0] / count)
        total += h * e
        change = 0.0 if before is None else (e - before) / h
        before = e
        x[2] = firmware.proportional * e + firmware.integral * total + firmware.derivative * change
        x[2] *= count
        assert abs(x[2]) <= firmware.duty_limit
        x = pass_on @ x
    return np.array(found)


@pytest.mark.parametrize(
    ("chase", "goals"),
    [
        (Chase(), False),
        (Chase(rate=True), False),
        (Chase(), True),
        (Chase(ramp=False, rate=True), False),
    ],
    ids=["mean rates", "given rates", "ends of ramps", "steps and ramps in turn"],
)
def test_a_host_against_one_written_anew(chase: Chase, goals: bool) -> None:
    firmware = loop(derivative=1e-3, integral=2.0)
    control = hp.FirmwareControl(chase, firmware, command_period=TICK if goals else None)
    trace = run(control, driven(firmware))
    exact = exact_chase(firmware, chase, 0.2, goals)
    np.testing.assert_allclose(trace.q[:, -1], exact, atol=1e-6, rtol=0.0)
    assert np.ptp(exact) > 0.03  # it has moved


@pytest.mark.parametrize("delay", [0.0, 4e-4])
def test_course_of_a_host(delay: float) -> None:
    firmware = loop(derivative=1e-3, delay=delay)
    control = hp.FirmwareControl(Chase(), firmware, battery=PACK, heat=True)
    servo = supplied_by(firmware, PACKED)
    trace = run(control, servo, sample=firmware.period, duration=0.1)
    course = control.course(hp.Scene(heavy_leg(1.0), servo=servo), trace)
    voltage = PACK.open_voltage(course.drawn) - 2.0 * course.current  # V, of 2 ohm
    np.testing.assert_allclose(course.voltage, voltage, rtol=1e-12)
    rate, torque = trace.v[:, -1], trace.torque[:, -1]
    slope = PACKED.stall_torque / PACKED.no_load_speed
    expected = course.motor_current[:, -1] - slope * np.diff(rate)  # N m: k is 1 N m/A
    np.testing.assert_allclose(torque[1:], expected, rtol=0.01, atol=1e-3)  # warm magnets
    assert np.abs(torque).max() > 0.3


def test_foot_control_through_the_firmware() -> None:
    gait = hp.Gait.tripod(stroke=0.06, cycle_time=1.2)
    firmware = hp.drive.Firmware.dynamixel(850)
    motor = hp.drive.identified_drive("MX-64").motor(12.0)
    scene = hp.Scene(hp.load_robot("kharagpur"), servo=firmware.driven(motor))
    settings: dict[str, Any] = {"sample": 5e-3, "accuracy": 1e-3, "estimate": False}
    plain, parts, plan = (
        hp.FirmwareControl(walk, firmware)
        for walk in (hp.FootControl(gait), hp.FootControl(gait, slip=hp.foot_control.SlipPid()),
                     hp.KinematicControl(gait))
    )  # fmt: skip
    runs = [hp.simulate(scene, x, duration=0.2, **settings) for x in (plain, parts, plan)]
    # cubics between exact angles and rates, 5 ms long, are within a count of the motion
    np.testing.assert_allclose(runs[0].q, runs[2].q, atol=2.0 * math.pi / 4096, rtol=0.0)
    assert np.abs(runs[1].q - runs[2].q)[:, 7:].max() > 1e-3  # rad: the correction acts
    case = hp.Case(scene, parts, duration=0.2, **settings)
    assert hp.Case.from_toml(case.to_toml()) == case
    for one in hp.simulate_batch([case, case]):
        np.testing.assert_array_equal(one.q, runs[1].q)
    first = hp.simulate(scene, parts, duration=0.1, **settings)
    second = hp.simulate(scene, parts, duration=0.1, initial=first.checkpoint, **settings)
    np.testing.assert_array_equal(second.q[-1], runs[1].q[-1])


def test_refusals_of_a_host() -> None:
    firmware = loop()

    def go(chase: Any, **given: Any) -> hp.Trace:
        return run(hp.FirmwareControl(chase, firmware, **given), driven(firmware), duration=0.02)

    for chase, name in (
        (Chase(period=0.0023), "FirmwareControl.walk.period"),
        (Chase(torque=0.5), "Chase.update.torque"),
        (Chase(odd=np.full((1, 3), np.nan)), "Chase.update.v"),
        (Chase(far=1e3), f"Chase.update.q[{JOINT}]"),
    ):
        with refused(ParameterError, name):
            go(chase)
    with refused(ParameterError, "FirmwareControl.command_period", 0.01):
        go(Chase(), command_period=0.01)
    with refused(ParameterError, "FirmwareControl.walk"):
        hp.FirmwareControl(hp.FirmwareControl(Chase(), firmware), firmware)
    with refused(ParameterError, "FirmwareControl.command_period", 0.0):
        hp.FirmwareControl(Chase(), firmware, command_period=0.0)
    with refused(ParameterError, "FirmwareControl.encoder", "shaft"):
        hp.FirmwareControl(Chase(), firmware, encoder="shaft")
    own = firmware.servo(hp.drive.identified_drive("MX-64").motor(12.0))
    scene = hp.Scene(hp.load_robot("kharagpur"), servo=own)
    with refused(ParameterError, "Scene.servo.kp"):
        hp.simulate(scene, hp.FirmwareControl(hp.HoldPosture(), firmware), duration=0.1)
    case = hp.Case(scene, hp.FirmwareControl(Chase(), firmware))
    with refused(ParameterError, "Case.controller", "Chase"):
        case.to_toml()
    noisy = go(Chase(sensors=Sensors(q=Sensor(noise=0.01))))
    assert np.abs(noisy.q - go(Chase(sensors=Sensors())).q).max() > 1e-5  # the host reads them
