"""A recorded pendulum on a bus servo: what the drive with gear friction predicts of it.

Recordings: Rhoban/bam, revision af22604, data.bak/raw (Apache-2.0); a Dynamixel XL330 swings
0.49 kg at 0.1 m. `--data` is a JSON list of runs (mass, length, kp, vin, trajectory, columns,
rows).
"""

from __future__ import annotations

import json
import math
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.text_table import Table
from studies.study import StudyReport, verdict

GRAVITY = 9.80665  # m/s^2, as in BAM

OFFSET = 0.0271133
"""Of the recorded angle from the hanging one, identified with the friction (m6.json) [rad]."""

DUTY = 4096 / (2.0 * np.pi) / (256 * 885)
"""Part of the supply per rad of error and unit of the firmware's kp (BAM, XL330Actuator)."""

PERIOD = 0.005
"""Of the set-points, as BAM resamples its recordings [s]."""

FINE = 1e-4
"""Step of the independent integration of BAM's formulas [s]."""

TARGET = 0.02
"""Largest relative difference of the two errors."""

LINK = """<link name="{0}"><inertial><origin xyz="0 0 {1}"/><mass value="{2}"/><inertia ixx="{3}"
 iyy="{3}" izz="{3}" ixy="0" ixz="0" iyz="0"/></inertial></link>"""

JOINT = """<joint name="{1}_joint" type="revolute"><parent link="{0}"/><child link="{1}"/>
<origin xyz="0 0 -1"/><axis xyz="0 -1 0"/><limit lower="-6" upper="6" effort="1000"
 velocity="1000"/></joint>"""

TIP = """<link name="tip"/><joint name="tip_fix" type="fixed"><parent link="arm"/>
<child link="tip"/><origin xyz="0 0 {0}"/></joint>"""


def pendulum(mass: float, length: float) -> hp.Robot:
    """Return a leg whose last joint turns an arm on bodies of 1e9 kg; it hangs at the angle 0."""
    text = "".join(LINK.format(name, 0, 1e9, 1e9) for name in ("base", "a", "b"))
    text += LINK.format("arm", -length, mass, 1e-9) + TIP.format(-length)
    text += JOINT.format("base", "a") + JOINT.format("a", "b") + JOINT.format("b", "arm")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "pendulum.urdf"
        path.write_text(f'<robot name="pendulum">{text}</robot>')
        return hp.load_robot(path, feet=["tip"], posture=[0.0, 0.0, 0.0])


@dataclass(frozen=True)
class Recording:
    """A run of the pendulum at the times of the set-points.

    Attributes:
        name: trajectory and gain of the firmware.
        mass: at the end of the arm [kg].
        length: of the arm [m].
        gain: torque constant of the firmware's error, part of the supply [1/rad].
        supply: [V].
        position: recorded (K,) [rad].
        rate: recorded at the start [rad/s].
        goal: (K,) [rad].
        enabled: whether the motor is on (K,).
    """

    name: str
    mass: float
    length: float
    gain: float
    supply: float
    position: Array
    rate: float
    goal: Array
    enabled: NDArray[np.bool_]


def recording(run: dict[str, Any]) -> Recording:
    """Return a run of the file at multiples of `PERIOD`, linear between its rows."""
    rows = dict(zip(run["columns"], zip(*run["rows"], strict=True), strict=True))
    stamps = np.array(rows["timestamp"])
    time = np.arange(0.0, stamps[-1], PERIOD)

    def at(column: str) -> Array:
        return np.asarray(np.interp(time, stamps, np.array(rows[column], dtype=float)))

    return Recording(
        name=f"{run['trajectory']}, kp {run['kp']}", mass=run["mass"], length=run["length"],
        gain=run["kp"] * DUTY, supply=run["vin"], position=at("position"),
        rate=float(rows["speed"][0]), goal=at("goal_position"), enabled=at("torque_enable") > 0.5,
    )  # fmt: skip


def simulated(run: Recording, drive: hp.drive.IdentifiedDrive, accuracy: float) -> Array:
    """Return the angle at the set-points' times by this package's drive (K,) [rad]."""
    on = len(run.goal) if run.enabled.all() else int(np.argmin(run.enabled))
    found, rate = swing(run, drive, run.goal[: on + 1], run.position[0], run.rate, accuracy)
    if on == len(run.goal):
        return found
    off, _ = swing(run, drive, run.goal[on:], float(found[-1]), rate, accuracy, gain=0.0)
    return np.concatenate([found[:-1], off])


def swing(
    run: Recording, drive: hp.drive.IdentifiedDrive, goal: Array, angle: float, rate: float,
    accuracy: float, *, gain: float = 1.0,
) -> tuple[Array, float]:  # fmt: skip
    """Return the angles at the times of set-points, and the last rate; gain 0: motor off."""
    robot = pendulum(run.mass, run.length)
    motor = drive.motor(run.supply)
    # The firmware sets a voltage: the rate acts by the back-EMF alone, which is the line's slope.
    gains = run.gain * motor.stall_torque, motor.stall_torque / motor.no_load_speed
    kp, kd = ({"a_joint": 0.0, "b_joint": 0.0, "arm_joint": gain * value} for value in gains)
    servo = hp.Servo(kp=kp, kd=kd, motor={"arm_joint": motor})
    weight = hp.Push(
        "arm", (0.0, 0.0, -run.length), force=(0.0, 0.0, -run.mass * GRAVITY), start=0.0,
        duration=100.0,
    )  # fmt: skip
    scene = hp.Scene(robot, servo=servo, gravity=(0.0, 0.0, 0.0), loads=[weight])
    count = len(goal)
    goals = np.column_stack([np.zeros((count, 2)), goal + OFFSET])
    control = hp.motion.SampledTrajectory(PERIOD * np.arange(count), goals, limited=False)
    state = robot.stand({"arm_joint": angle + OFFSET})
    q, v = state.q.copy(), state.v.copy()
    q[2], v[-1] = 10.0, rate
    trace = hp.simulate(
        scene, control, duration=PERIOD * (count - 1), sample=PERIOD, accuracy=accuracy,
        initial=robot.check_state(q, v),
    )  # fmt: skip
    return np.asarray(trace.q[:, -1] - OFFSET), float(trace.v[-1, -1])


def by_formula(run: Recording, drive: hp.drive.IdentifiedDrive, step: float) -> Array:
    """Return the same by BAM's own loop, Euler's method with a stop within the step [s]."""
    gear, k, resistance = drive.gear, drive.torque_constant, drive.resistance
    inertia = run.mass * run.length**2 + drive.armature
    angle, rate = float(run.position[0]), run.rate
    found, inner = [], round(PERIOD / step)
    for goal, enabled in zip(run.goal, run.enabled, strict=True):
        found.append(angle)
        for _ in range(inner):
            load = -run.mass * GRAVITY * run.length * math.sin(angle + OFFSET)
            duty = min(max((goal - angle) * run.gain, -1.0), 1.0)
            motor = enabled * (k * duty * run.supply - k**2 * rate) / resistance
            rest = inertia / step * rate + motor + load
            level = friction_level(gear, motor, load, rate)
            taken = min(abs(rest), level + drive.viscous * abs(rate))
            rate += (motor + load - math.copysign(taken, rest)) / inertia * step
            angle += rate * step
    return np.array(found)


def friction_level(gear: hp.drive.GearFriction, motor: float, load: float, rate: float) -> float:
    """Return BAM's M6 for torques of motor and load [N m] and a rate [rad/s]."""
    s = math.exp(-(abs(rate / gear.stribeck_speed) ** gear.stribeck_exponent))
    level = gear.coulomb + abs(gear.load * load - gear.motor * motor) + s * gear.stribeck
    level += s * abs(gear.load_stribeck * load - gear.motor_stribeck * motor)
    if load * motor < 0.0 and abs(load) < abs(motor):
        level += s * gear.load_quadratic * load**2
    if load * motor < 0.0 and abs(load) > abs(motor):
        level += s * gear.motor_quadratic * motor**2
    return level


def servo_pendulum(
    *, data: Path = Path("xl330_pendulum.json"), accuracy: float = 1e-5
) -> StudyReport:
    """Compare recordings with the drive and with BAM's formulas; MAE of the position [rad]."""
    drive = hp.drive.identified_drive("XL330-M288")
    gear = drive.gear.model_copy(update={"external_load": False})
    passing = replace(drive, gear=gear)
    rows, errors = [], []
    for entry in json.loads(data.read_text(encoding="utf-8")):
        run = recording(entry)
        columns = (
            simulated(run, drive, accuracy), by_formula(run, drive, FINE),
            by_formula(run, drive, PERIOD), simulated(run, passing, accuracy),
        )  # fmt: skip
        errors.append([1e3 * np.abs(found - run.position).mean() for found in columns])
        rows.append([run.name, *(f"{value:.2f}" for value in errors[-1])])
    mean = np.mean(errors, axis=0)
    rows.append(["all", *(f"{value:.2f}" for value in mean)])
    difference = mean[0] / mean[1] - 1.0
    table = Table("Mean absolute error of the position [mrad]", COLUMNS, rows, align="<>")
    summary = (
        f"The drive's error over that of BAM's formulas: {difference:+.2%} in the mean of all "
        f"runs, at most {TARGET:.0%} asked: {verdict(abs(difference) <= TARGET)}."
    )
    return StudyReport(
        "A recorded pendulum on an XL330", [summary, INTRODUCTION, table],
        met=abs(difference) <= TARGET,
    )  # fmt: skip


COLUMNS = "recording", "drive", "BAM, 0.1 ms", "BAM, 5 ms", "drive, load passed on"

INTRODUCTION = (
    "A Dynamixel XL330 swings 0.49 kg at 0.1 m; twelve recordings of 6 s, three kinds of "
    "trajectory at four gains (Rhoban/bam, revision af22604, `data.bak/raw`, Apache-2.0). "
    "Parameters are those identified there (`m6.json`); nothing was fitted here. The drive takes "
    "the external torque for the load, as BAM does, which here is gravity's; its columns are BAM's "
    "loop at 0.1 ms and at its own step. The last is the drive with the same parameters where the "
    "load is what the gear passes on (`external_load=False`)."
)
