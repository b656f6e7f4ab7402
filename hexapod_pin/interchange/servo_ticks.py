"""A gait or a run as ticks of bus servos, a row for each instant at which they are sent."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array
from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.control.walk_plan import WalkPlan
from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.foreign_text import csv_cell, encoded, visible
from hexapod_pin.immutable import Immutable
from hexapod_pin.interchange.joint_samples import JointSamples, joint_samples
from hexapod_pin.results.result_files import check_ending
from hexapod_pin.results.trace import Trace
from hexapod_pin.type_checks import Unbounded

ENDING = (".csv",)

RPM = 2.0 * math.pi / 60.0
"""A revolution in a minute [rad/s]."""

LARGEST_ID = 253
"""Of a servo on a bus: 254 addresses all of them [-]."""


@checked
@dataclass(frozen=True)
class BusServo(Immutable):
    """How the goal position of a servo on a bus counts; all but `source` is in its control table.

    Attributes:
        name: of the series.
        ticks: that `angle` is divided into [-].
        angle: over which it counts [rad].
        center: goal position with the horn in its middle [tick].
        least: smallest goal position [tick].
        most: largest goal position [tick].
        speed_unit: of the register that limits its speed [rad/s]; of one without, infinite.
        speed_most: largest value of that register [-].
        source: of these numbers.
        models: of the series, by the names that their makers give them.

    Raises:
        ParameterError: a number out of range.
    """

    name: str
    ticks: int
    angle: float
    center: int
    least: int
    most: int
    speed_unit: Unbounded
    speed_most: int
    source: str
    models: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuse numbers that make no servo."""
        if not 1 <= self.ticks <= 1 << 24:
            raise ParameterError("BusServo.ticks", self.ticks, "1 to 16777216")
        if not 1e-3 <= self.angle <= 1e3:
            raise ParameterError("BusServo.angle", self.angle, "0.001 to 1000 rad")
        if not self.least <= self.center <= self.most:
            allowed = f"from least = {self.least} to most = {self.most} ticks"
            raise ParameterError("BusServo.center", self.center, allowed)
        if not (self.speed_unit > 0.0 and self.speed_most >= 1):
            given = self.speed_unit, self.speed_most
            raise ParameterError("BusServo.speed_unit, speed_most", given, "above 0, and 1 or more")

    @property
    def tick(self) -> float:
        """Angle of a tick [rad]."""
        return self.angle / self.ticks

    @property
    def speed_limit(self) -> float:
        """Largest speed that its register can ask for [rad/s]; the motor may be slower."""
        return self.speed_unit * self.speed_most


TURN = 2.0 * math.pi

SERVOS: Mapping[str, BusServo] = {
    one.name: one
    for one in (
        BusServo(
            "dynamixel-x", 4096, TURN, 2048, 0, 4095, 0.229 * RPM, 1023,
            "emanual.robotis.com/docs/en/dxl/x/xl430-w250: Goal Position(116), Velocity Limit(44); "
            "XL430, XC430, XM430, XH430, XM540, XH540 alike",
            ("XL430", "XC430", "XM430", "XH430", "XM540", "XH540"),
        ),
        BusServo(
            "dynamixel-mx", 4096, TURN, 2048, 0, 4095, 0.114 * RPM, 1023,
            "emanual.robotis.com/docs/en/dxl/mx/mx-64: Goal Position(30), Moving Speed(32); MX-28, "
            "MX-64 and MX-106 with protocol 1.0",
            ("MX-28", "MX-64", "MX-106"),
        ),
        BusServo(
            "dynamixel-ax", 1023, math.radians(300.0), 512, 0, 1023, 0.111 * RPM, 1023,
            "emanual.robotis.com/docs/en/dxl/ax/ax-12a: Goal Position(30), Moving Speed(32); "
            "AX-12A, AX-18A",
            ("AX-12A", "AX-18A"),
        ),
        BusServo(
            "dynamixel-xl320", 1023, math.radians(300.0), 512, 0, 1023, 0.111 * RPM, 1023,
            "emanual.robotis.com/docs/en/dxl/x/xl320: Goal Position(30), Moving Speed(32)",
            ("XL-320",),
        ),
        BusServo(
            "feetech-sts", 4096, TURN, 2048, 0, 4095, TURN / 4096, 3400,
            "Feetech, memory table of SMS/STS servos: goal position (42), running speed (46) in "
            "steps in a second; STS3215",
            ("STS3215",),
        ),
        BusServo(
            "lewansoul-lx16a", 1000, math.radians(240.0), 500, 0, 1000, math.inf, 1,
            "LewanSoul/Hiwonder, LX-16A bus servo communication protocol: SERVO_MOVE_TIME_WRITE, "
            "0 to 1000 for 0 to 240 degrees, a time in the place of a speed",
            ("LX-16A",),
        ),
    )
}  # fmt: skip
"""Series of servos by name."""


@checked
@dataclass(frozen=True)
class ServoMount(Immutable):
    """How a servo drives a joint.

    Attributes:
        id: on the bus.
        sign: 1 where the joint's angle grows with the ticks, else -1.
        offset: angle of the joint with the servo at its center [rad].

    Raises:
        ParameterError: an id or a sign that there is not.
    """

    id: int
    sign: int = 1
    offset: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what no servo can have."""
        if not 0 <= self.id <= LARGEST_ID:
            raise ParameterError("ServoMount.id", self.id, f"0 to {LARGEST_ID}")
        if self.sign not in (1, -1):
            raise ParameterError("ServoMount.sign", self.sign, "1 or -1")


@checked
def write_servo_ticks(
    source: WalkPlan | Trace,
    path: str | Path,
    servo: str | BusServo,
    *,
    mounts: Mapping[str, ServoMount] | None = None,
    rate: float = 50.0,
    duration: float | None = None,
) -> Path:
    """Write the set-points of a gait or of a run as goal positions of bus servos.

    A CSV file: lines that begin with # state servo, units and the mounting of each joint, then
    a head, then a row for each instant: its time [s] and a goal position [tick] for each joint,

        tick = center + sign (q - offset) ticks / angle, rounded.

    Args:
        source: plan of a gait, which is walked from standing to standing, or a run, whose
            set-points are written.
        path: ends in .csv.
        servo: "dynamixel-x", "dynamixel-mx", "dynamixel-ax", "dynamixel-xl320", "feetech-sts",
            "lewansoul-lx16a", a model of one of them such as "STS3215" or "XM430-W350", or one of
            your own.
        mounts: of joints by name; joints without one get the ids that are left from 1 on, sign 1
            and offset 0, *assumed*.
        rate: rows in a second [1/s].
        duration: of the motion [s]; None: ten cycles of a plan, the whole of a run.

    Raises:
        ParameterError: an argument out of range, two joints with one id, or a joint that slides.
        UnknownNameError: there is no such servo, or no such joint.
        JointRangeError: a goal position that the servo does not have, a faster move than its
            register can ask for, or the limits of the robot's URDF; it names joint, time, value
            and range.
        GaitError: the robot cannot walk the gait.
        NotRecordedError: the run recorded no set-points.
        TraceFileError: another ending, or the file cannot be written; the old one is intact.

    Example:
        >>> mounts = {"lf_coxa_joint": hp.interchange.ServoMount(11, sign=-1, offset=0.1)}
        >>> hp.interchange.write_servo_ticks(plan, "gait.csv", "dynamixel-x", mounts=mounts)
    """
    check_ending(path, ENDING)
    kind = _named(servo)
    samples = joint_samples(source, rate, duration, "write_servo_ticks")
    names = samples.robot.joint_names
    if not samples.robot.turning.all():
        joint = names[int(np.argmin(samples.robot.turning))]
        raise ParameterError(f"write_servo_ticks.source[{joint}]", "sliding", "a joint that turns")
    placed = _mounts(names, mounts or {})
    samples.require_limits()
    _require_servo(samples, kind, placed)
    return write_atomically(path, _table(samples, kind, placed, _ticks(samples.q, kind, placed)))


def _named(servo: str | BusServo) -> BusServo:
    if isinstance(servo, BusServo):
        return servo
    if servo in SERVOS:
        return SERVOS[servo]
    for one in SERVOS.values():
        if any(_is_model(servo, model) for model in one.models):
            return one
    models = [model for one in SERVOS.values() for model in one.models]
    raise UnknownNameError("servo", servo, [*SERVOS, *models])


def _is_model(name: str, model: str) -> bool:
    """Return whether a name is a model's: in any case, with or without "-", and its winding."""
    given, known = name.strip().upper(), model.replace("-", "")
    variant = given.startswith((f"{model}-", f"{known}-"))  # as the W350-T of XM430-W350-T
    return variant or given.replace("-", "").replace(" ", "") == known


def _mounts(
    names: tuple[str, ...], given: Mapping[str, ServoMount]
) -> dict[str, tuple[ServoMount, bool]]:
    """Return the mount of each joint, and whether it was stated."""
    for name in given:
        if name not in names:
            raise UnknownNameError("joint", name, list(names))
    owners: dict[int, str] = {}
    for name, mount in given.items():
        if mount.id in owners:
            where, other = f"write_servo_ticks.mounts[{name}].id", owners[mount.id]
            raise ParameterError(where, mount.id, f"another than that of {other}")
        owners[mount.id] = name
    free = (number for number in range(1, LARGEST_ID + 1) if number not in owners)
    found: dict[str, tuple[ServoMount, bool]] = {}
    for name in names:
        found[name] = (given[name], True) if name in given else (ServoMount(next(free)), False)
    return found


def _signs_offsets(placed: Mapping[str, tuple[ServoMount, bool]]) -> tuple[Array, Array]:
    mounts = [mount for mount, _ in placed.values()]
    signs = np.array([mount.sign for mount in mounts], dtype=float)
    return signs, np.array([mount.offset for mount in mounts], dtype=float)


def _ticks(q: Array, servo: BusServo, placed: Mapping[str, tuple[ServoMount, bool]]) -> Array:
    """Return goal positions, whole numbers. Shape (K, n)."""
    signs, offsets = _signs_offsets(placed)
    found: Array = np.rint(servo.center + signs * (q - offsets) / servo.tick)
    return found


def _require_servo(
    samples: JointSamples, servo: BusServo, placed: Mapping[str, tuple[ServoMount, bool]]
) -> None:
    """Refuse goal positions and speeds that the servo does not have."""
    signs, offsets = _signs_offsets(placed)
    ends = [
        offsets + signs * servo.tick * (end - servo.center)
        for end in (servo.least - 0.5, servo.most + 0.5)
    ]
    low, high = np.minimum(*ends), np.maximum(*ends)
    time = np.broadcast_to(samples.time[:, None], samples.q.shape)
    by = (
        f"for goal positions {servo.least} to {servo.most} of {servo.name}; change the joint's "
        "offset in `mounts`, or the gait."
    )
    samples.refuse_first(time, samples.q, (low, high), "angle", by)
    rate = np.diff(samples.q, axis=0) / np.diff(samples.time)[:, None]
    most = np.full(rate.shape[1], servo.speed_limit)
    by = f"by the speed register of {servo.name}; walk with a longer cycle time."
    samples.refuse_first(time[:-1], rate, (-most, most), "rate", by)


def _table(
    samples: JointSamples,
    servo: BusServo,
    placed: Mapping[str, tuple[ServoMount, bool]],
    ticks: Array,
) -> bytes:
    """Return the file: comments, a head, and a row for each instant."""
    degrees = math.degrees
    limit = "no register of speed"
    if math.isfinite(servo.speed_limit):
        limit = f"speed register up to {servo.speed_most} = {servo.speed_limit:.4g} rad/s"
    lines = [
        samples.what,
        f"servo: {servo.name}; {degrees(servo.tick):.6g} degrees a tick, {limit}",
        f"source: {servo.source}",
        "tick = center + sign (q - offset) / tick angle, rounded: off by half a tick at most",
        f"center = {servo.center}; goal positions from {servo.least} to {servo.most}",
        "columns: time from the start [s], then a goal position [tick] for each joint",
    ]
    for name, (mount, stated) in placed.items():
        text = f"{name}: id {mount.id}, sign {mount.sign}, offset {mount.offset!r} rad"
        lines.append(text if stated else f"{text}, assumed")
    stream = io.StringIO()
    for line in lines:
        stream.write(f"# {visible(line)}".replace("\n", " ") + "\n")
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(["time [s]", *(csv_cell(f"{name} [tick]") for name in placed)])
    for at, row in zip(samples.time.tolist(), ticks.astype(np.int64).tolist(), strict=True):
        writer.writerow([repr(at), *row])
    return encoded(stream.getvalue())
