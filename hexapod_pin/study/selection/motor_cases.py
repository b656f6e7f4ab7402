"""A case gets motors: masses at the joints, rotor inertias and torque-speed lines."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.drive.motor import Motor
from hexapod_pin.drive.servo import SLIDE, joint_kinds
from hexapod_pin.errors import ParameterError
from hexapod_pin.robot.loading.pin_model import (
    MassChange,
    mass_change,
    placement,
    with_mass_changes,
)
from hexapod_pin.scene.loads import MassFactor, MassLoad, Payload, RemovedMass

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.drive.catalog import MotorRecord
    from hexapod_pin.robot.robot import Robot
    from hexapod_pin.simulation.case import Case


Motors = Mapping[str, "MotorRecord"]
"""A motor for each kind of joint."""

RECORD = ("torque", "contacts")
"""What a budget of motors needs of a trace."""

NO_LINE = 1e6
"""Stall torque [N m] and no-load speed [rad/s] of a motor whose line is not to act."""


def with_motors(
    case: Case, motors: Motors, loads: tuple[MassLoad, ...], voltage: float, *, line: bool
) -> Case:
    """Return a case whose joints are driven by motors.

    The URDF's effort limits do not act: the motors take their place. Servo gains stay.

    Args:
        case: a walk.
        motors: of each kind of joint.
        loads: what the motors change of the robot's masses; see `motor_loads`.
        voltage: of the supply under load over that of the motors' data [-].
        line: whether torques are limited by the motors' lines; their rotors turn in any case.
    """
    scene = case.scene
    chosen = {kind: _motor(record, voltage, line) for kind, record in motors.items()}
    servo = scene.servos.model_copy(update={"motor": chosen, "limited": False})
    return replace(
        case, scene=replace(scene, servo=servo, loads=(*scene.loads, *loads)), record=RECORD
    )


def without_motors(case: Case) -> Case:
    """Return a case whose joints give any torque at any speed: what the walk requires."""
    servo = case.scene.servos.model_copy(update={"motor": None, "limited": False})
    return replace(case, scene=replace(case.scene, servo=servo), record=RECORD)


def motor_loads(
    robot: Robot, motors: Motors, contained: float
) -> tuple[tuple[MassLoad, ...], tuple[str, ...]]:
    """Return what motors change of a robot's masses, and notes; see `mass_loads`.

    Raises:
        ParameterError: the mass of a motor is not known, or the file's links are lighter than the
            motors that they should contain.
    """
    for record in motors.values():
        if record.mass is None:
            allowed = f"known of {record.name} [kg]"
            raise ParameterError("MotorRecord.mass", None, allowed, "Give it in the file.")
    mass = {kind: float(record.mass or 0.0) for kind, record in motors.items()}
    return mass_loads(robot, mass, contained)


def _motor(record: MotorRecord, voltage: float, line: bool) -> Motor:
    motor = record.motor(voltage)
    if line:
        return motor
    free = {"stall_torque": NO_LINE, "no_load_speed": NO_LINE, "peak_torque": None}
    return motor.model_copy(update=free)


# Where the motors of a robot sit, and what its file's masses contain of them.

MOTOR_SHARE = 0.35
"""Share of a robot's mass that its motors make up where none is given (*assumed*). PhantomX: 18
AX-12A of 54.6 g are 38 % of 2.6 kg."""


CARRIER_LEAST = 1.5
"""Mass of a link over that of a motor from which it is taken to carry it (*assumed*)."""


@dataclass(frozen=True, eq=False)
class MotorPlace:
    """A motor at the axis of a joint, on either side of it.

    A point on the axis moves with both bodies alike, so that the side makes no difference to what
    is put there. It does to what is taken away: a body cannot lose more than it has.

    Attributes:
        joint: name of the joint.
        kind: of the joint: coxa, femur, tibia, held.
        moved: link that the joint moves; its frame's origin lies on the axis.
        carrier: link on the other side.
        position: the axis' point in the carrier's frame [m]. Shape (3,).
    """

    joint: str
    kind: str
    moved: str
    carrier: str
    position: Array


def motor_places(robot: Robot) -> tuple[MotorPlace, ...]:
    """Return where a motor sits of each joint that turns, in the order of the robot's joints."""
    import pinocchio as pin

    model, kinds = robot.model, joint_kinds(robot)
    bodies = [frame for frame in model.frames if frame.type == pin.FrameType.BODY]
    found = []
    for name in robot.joint_names:
        if kinds.get(name, SLIDE) == SLIDE:
            continue
        joint = model.getJointId(name)
        moved = next(frame for frame in bodies if frame.parentJoint == joint)
        carrier = next(frame for frame in bodies if frame.parentJoint == model.parents[joint])
        axis = model.jointPlacements[joint].translation
        place = np.asarray(carrier.placement.inverse().act(axis))
        found.append(MotorPlace(name, kinds[name], moved.name, carrier.name, place))
    return tuple(found)


def motor_counts(robot: Robot) -> dict[str, int]:
    """Return how many motors there are of each kind of joint."""
    return dict(Counter(place.kind for place in motor_places(robot)))


def assumed_motor_mass(robot: Robot) -> float:
    """Return the mass of each motor that a robot's file is *assumed* to contain [kg]."""
    return MOTOR_SHARE * robot.total_mass / len(motor_places(robot))


def mass_loads(
    robot: Robot, mass: Mapping[str, float], contained: float
) -> tuple[tuple[MassLoad, ...], tuple[str, ...]]:
    """Return what changes a robot's masses when other motors are put into it.

    A heavier motor adds a point mass at the joint's axis; a lighter one takes it away there. Where
    a file's links do not have it there (they are too light, or too slender, for the motors they
    should contain), the link that carries it, or the heavier one beside the joint, is scaled down.

    Args:
        robot: whose file contains motors.
        mass: of the new motors by kind of joint [kg].
        contained: of each motor that the file contains [kg].

    Returns:
        Loads of a scene, and notes on what was scaled.

    Raises:
        ParameterError: the file's links are lighter than what is to be taken away.
    """
    places = motor_places(robot)
    change = {place: mass[place.kind] - contained for place in places}
    added = [Payload(p.moved, change[p], inertia=(0.0,) * 6) for p in places if change[p] > 0.0]
    lighter = {place: -change[place] for place in places if change[place] < 0.0}
    removed = [_removed(robot, place, less) for place, less in lighter.items()]
    try:
        with_mass_changes(robot.model, [x for load in removed if (x := _plain(load)) is not None])
    except ParameterError:
        scaled = _scaled(robot, lighter)
        note = (
            f"links such as {scaled[0].links[0]} have no room at their joints for motors of "
            f"{1e3 * contained:.3g} g: they were scaled down instead, as a whole"
        )
        return (*scaled, *added), (note,)
    return (*added, *removed), ()


def _plain(load: MassLoad) -> MassChange | None:
    return mass_change(load.model_dump())


def _removed(robot: Robot, place: MotorPlace, mass: float) -> RemovedMass:
    """Return a mass taken from the moved link where that has it, else from the carrier."""
    load = RemovedMass(place.moved, mass)
    try:
        with_mass_changes(robot.model, [x for x in (_plain(load),) if x is not None])
    except ParameterError:
        return RemovedMass(place.carrier, mass, tuple(place.position.tolist()))
    return load


def _scaled(robot: Robot, lighter: Mapping[MotorPlace, float]) -> list[MassFactor]:
    """Return factors that take masses from the carriers, or from heavier links beside them."""

    def body(link: str) -> float:
        return float(
            robot.model.inertias[robot.model.getJointId(placement(robot.model, link)[0])].mass
        )

    less: dict[str, float] = {}
    for place, mass in lighter.items():
        heavy = body(place.carrier) >= CARRIER_LEAST * mass
        link = place.carrier if heavy else max((place.moved, place.carrier), key=body)
        less[link] = less.get(link, 0.0) + mass
    for link, mass in less.items():
        if mass >= body(link):
            raise ParameterError(
                "motor_mass", mass, f"below {body(link):.4g} kg, all that {link} weighs [kg]",
                "Say what motors the robot's file contains: a smaller mass, or 0 for none.",
            )  # fmt: skip
    return [MassFactor(1.0 - mass / body(link), (link,)) for link, mass in less.items()]
