"""Foot control made ready for one robot and scene: numbers for the native core."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.control.foot_control.leg_model import leg_chains, standing_centre
from hexapod_pin.control.foot_control.loop_gains import effective_delay, slip_gains, weight_of
from hexapod_pin.control.foot_control.planned_walk import PlannedWalk
from hexapod_pin.control.foot_control.refuse_unstable import refuse_unstable
from hexapod_pin.control.six_legs import SixLegs, six_legs
from hexapod_pin.errors import ParameterError, ReachError, SensorError

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.control.feedback import Measurement
    from hexapod_pin.control.foot_control.controller import FootControl
    from hexapod_pin.native import FootControlLaw, FootControlSettings, LegChain

TOUCH_SHARE = {"foot": 0.04, "torque": 0.12, "current": 0.2}
"""Force of a foot that touches, over the robot's weight, by its source (*assumed*): what swinging
legs and their drives leave in an estimate must not pass for ground."""

FIELDS = ("q", "v", "torque", "rotation", "angular_velocity", "acceleration", "foot_force")
"""Readings in the order in which the core checks them."""

SHARES = (0.75, 0.5, 0.25, 0.0)
"""Of what moves a foot from its plan, tried in turn where a leg cannot reach all of it."""


@dataclass(frozen=True, eq=False)
class ReadyLaw:
    """The law of one controller on one robot.

    Attributes:
        law: in the core.
        walk: the plan.
        six: the legs.
        lead: from a tick until its command has arrived [s].
        joint_names: for messages.
        foot_names: for messages.
    """

    law: FootControlLaw
    walk: PlannedWalk
    six: SixLegs
    lead: float
    joint_names: tuple[str, ...]
    foot_names: tuple[str, ...]

    def first_memory(self, batch: int) -> Array:
        """Return the memory before the first tick. Shape (B, N)."""
        return np.tile(self.law.first_memory(), (batch, 1))

    def tick(self, time: float, m: Measurement, memory: Array) -> tuple[Array, Array]:
        """Return targets of the feet (B, 6, 3) [m] and the memory after the tick at `time` [s].

        Raises:
            SensorError: a reading is not finite.
        """
        self.walk.reach(time + self.lead)
        feet, after = np.empty((len(memory), 6, 3)), np.empty_like(memory)
        q, v, torque, rotation, rate, acceleration, force = (
            np.ascontiguousarray(getattr(m, name)) for name in FIELDS
        )
        row, (field, place) = self.law.update(
            self.walk.table, time, q, v, torque, rotation, rate, acceleration, force,
            memory, after, feet,
        )  # fmt: skip
        if row >= 0:
            raise self._fault(m, int(row), FIELDS[field], int(place))
        return feet, after

    def joint_angles(self, time: float, feet: Array) -> Array:
        """Return joint angles (B, n) [rad]; a foot out of reach goes part of the way to its target.

        Raises:
            ReachError: of a leg that cannot even reach its planned place.
        """
        try:
            return self.six.joint_angles(feet)
        except ReachError:
            return np.concatenate([self._within_reach(time, row) for row in feet])

    def _within_reach(self, time: float, feet: Array) -> Array:
        """Return the angles (1, n) of one robot, legs out of reach nearer to their plan."""
        plan = self.walk.table.at(time + self.lead)[:, :3]
        wanted = feet.copy()
        for leg in range(6):
            for share in (1.0, *SHARES):
                wanted[leg] = plan[leg] + share * (feet[leg] - plan[leg])
                try:
                    self.six.legs[leg].inverse(wanted[leg])
                except ReachError:
                    continue
                break
        return self.six.joint_angles(wanted[None])

    def _fault(self, m: Measurement, row: int, field: str, place: int) -> SensorError:
        """Return the error that names a reading that is not finite."""
        names = {"q": self.joint_names, "v": self.joint_names, "torque": self.joint_names}
        if field == "foot_force":
            of = f" of {self.foot_names[place // 3]}"
        else:
            of = f" of {names[field][place]}" if field in names else ""
        value = np.asarray(getattr(m, field))[row].ravel()[place]
        return SensorError(f"{field}{of}", float(value), m.time, row)


def ready_law(control: FootControl, scene: Any, *, refuse: bool = True) -> ReadyLaw:
    """Return the law of a controller for a scene.

    Args:
        control: the controller.
        scene: what it controls.
        refuse: whether to refuse gains with which the loop would be unstable.

    Raises:
        ParameterError: a leg without servo stiffness, or gains that make the loop unstable.
        GaitError, ReachError: the robot cannot walk the plan.
    """
    robot, six = scene.robot, six_legs(scene.robot)
    stiffness = scene.servos.gains(robot)[0][six.joint_index]
    if not (stiffness > 0.0).all():
        raise ParameterError(
            "Servo.kp", float(stiffness.min()), "above 0 N m/rad at the joints of legs",
            "Foot control moves feet through their servos.",
        )  # fmt: skip
    if refuse:
        refuse_unstable(control, scene)
    lead = control.period + control.delay
    return ReadyLaw(
        law=native_law(scene, law_settings(control, scene), leg_chains(scene)),
        walk=PlannedWalk(robot, control.walk),
        six=six,
        lead=lead,
        joint_names=tuple(robot.joint_names),
        foot_names=tuple(foot.name for foot in robot.feet),
    )


def native_law(scene: Any, settings: FootControlSettings, chains: list[LegChain]) -> FootControlLaw:
    """Return the law of the core for the robot of a scene."""
    from hexapod_pin.native import FootControlLaw

    robot, six = scene.robot, six_legs(scene.robot)
    feet = [[foot.name for foot in robot.feet].index(robot.leg(leg.name).foot) for leg in six.legs]
    return FootControlLaw(settings, chains, six.joint_index.tolist(), feet)


def law_settings(control: FootControl, scene: Any) -> FootControlSettings:
    """Return the numbers of a controller for a scene."""
    from hexapod_pin import native

    robot, force = scene.robot, control.force
    weight = weight_of(scene)
    out = native.FootControlSettings()
    out.period, out.lead = control.period, control.period + control.delay
    out.source = getattr(native.ForceSource, force.source)
    out.filter_time = force.filter_time
    out.radius = six_legs(robot).radius.tolist()
    out.threshold = (
        TOUCH_SHARE[force.source] * weight if force.threshold is None else force.threshold
    )
    if control.slip is not None:
        out.signal = getattr(native.SlipSignal, control.slip.signal)
        kp, ki, kd = slip_gains(control, scene)
        gains = native.SlipGains()
        gains.kp, gains.ki, gains.kd = kp, ki, kd
        gains.derivative_time, gains.limit = control.slip.derivative_time, control.slip.limit
        out.slip = gains
    out.weight, out.centre = weight, standing_centre(robot)
    out.load_time = control.load_time
    kp = scene.servos.gains(robot)[0]
    out.give = list(1.0 / kp[six_legs(robot).joint_index])
    out.anticipates = control.slip is not None and control.slip.anticipates
    if control.suspension is not None:
        _suspend(out, control)
    if control.touch_down is not None:
        _react(out, control)
    if control.levelling is not None:
        out.level_rate, out.level_limit = control.levelling.rate, control.levelling.limit
    return out


def _suspend(out: Any, control: FootControl) -> None:
    """Fill in the virtual suspension."""
    from hexapod_pin import native

    suspension = control.suspension
    assert suspension is not None
    gains = native.SuspensionGains()
    gains.mass, gains.damping, gains.stiffness = suspension.gains(
        out.weight, effective_delay(control)
    )
    gains.limit = suspension.limit
    out.suspended, out.suspension = True, gains
    out.nominal_load = 0.0 if suspension.load == "split" else float(suspension.load)


def _react(out: Any, control: FootControl) -> None:
    """Fill in what legs do at touch-down."""
    from hexapod_pin import native

    given = control.touch_down
    assert given is not None
    settings = native.TouchDownSettings()
    settings.reacts = True
    settings.earliest = given.earliest
    settings.search_speed, settings.search_depth = given.search_speed, given.search_depth
    settings.rise_speed, settings.rise_limit = given.rise_speed, given.rise_limit
    settings.patience = given.patience
    settings.retreat, settings.lost_after = given.retreat_speed, given.lost_after
    out.touch_down = settings
    out.follow_height, out.follow_tilt = 1.0 / given.height_time, 1.0 / given.tilt_time
