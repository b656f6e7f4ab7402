"""The numbers of a foot controller for one robot and scene, and its law in the native core."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.control.foot_control.leg_model import foot_stiffness, trunk_moment
from hexapod_pin.control.foot_control.parameters import Sole
from hexapod_pin.control.leg_group import leg_group
from hexapod_pin.ground.contact import StickSlip

if TYPE_CHECKING:
    from hexapod_pin.control.foot_control.parameters import ControlParts
    from hexapod_pin.drive.servo import Servo
    from hexapod_pin.native import FootControlLaw, FootControlSettings, LegChain

TARGET_SIZE = 12
"""Numbers of the target of a leg: where its foot is to be [m], its rate there [m/s], offsets of the
joints' angles that put it there [rad], and of their rates [rad/s]."""

BANDWIDTH, BANDWIDTH_OF_DEVIATIONS = 10.0, 7.0
"""Of a slip correction whose bandwidth is not given, alone and beside force targets [Hz]
(*assumed*)."""

TOUCH_SHARE = {"foot": 0.04, "torque": 0.12, "current": 0.2}
"""Force of a foot that touches, over the robot's weight, by its source (*assumed*): what swinging
legs and their drives leave in an estimate must not pass for ground."""


def effective_delay(control: ControlParts) -> float:
    """Return the delay of a loop, sampling, way to the next tick and force filter in it [s]."""
    return 1.5 * control.period + control.loop_delay + control.force.filter_time


def weight_of(scene: Any) -> float:
    """Return what a robot knows as its weight, payloads aside [N]."""
    return float(scene.robot.total_mass * np.linalg.norm(scene.gravity))


def assumed_servo(control: ControlParts, scene: Any) -> Servo:
    """Return the servos whose gains a controller counts on: its own, or those of the scene."""
    servo: Servo = scene.servos if control.servo is None else control.servo
    return servo


def slip_bandwidth(control: ControlParts) -> float:
    """Return the bandwidth that gains of the slip correction follow where none are given [Hz]."""
    slip = control.slip
    assert slip is not None
    if slip.bandwidth is not None:
        return slip.bandwidth
    deviates = control.force_targets is not None and slip.signal == "force"
    return BANDWIDTH_OF_DEVIATIONS if deviates else BANDWIDTH


def slip_gains(control: ControlParts, scene: Any) -> tuple[float, float, float]:
    """Return kp, ki and kd of a controller's slip correction; units as of `SlipPid`.

    Seen by the controller a standing foot is a gain s, a delay d and no lag of its own: the rule
    of internal model control then is ki = 1 / (s (1 / w + d)), kp = kd = 0 [Skogestad2003].
    """
    slip = control.slip
    assert slip is not None
    gain = 1.0
    if slip.signal == "force":
        stiffness = foot_stiffness(scene.robot, assumed_servo(control, scene))
        gain = float(np.linalg.eigvalsh(stiffness[:, :2, :2]).max())
    lag = 1.0 / (2.0 * math.pi * slip_bandwidth(control))
    integral = 1.0 / (gain * (lag + effective_delay(control)))
    return (
        0.0 if slip.kp is None else slip.kp,
        integral if slip.ki is None else slip.ki,
        0.0 if slip.kd is None else slip.kd,
    )


def native_law(scene: Any, settings: FootControlSettings, chains: list[LegChain]) -> FootControlLaw:
    """Return the law of the core for the robot of a scene."""
    from hexapod_pin.native import FootControlLaw

    robot, six = scene.robot, leg_group(scene.robot)
    feet = [[foot.name for foot in robot.feet].index(robot.leg(leg.name).foot) for leg in six.legs]
    return FootControlLaw(settings, chains, six.joint_index.tolist(), feet)


def law_settings(control: ControlParts, scene: Any) -> FootControlSettings:
    """Return the numbers of a controller for a scene."""
    from hexapod_pin import native

    robot, force = scene.robot, control.force
    weight = weight_of(scene)
    out = native.FootControlSettings()
    out.period, out.lead = control.period, control.period + control.delay
    out.source = getattr(native.ForceSource, force.source)
    out.filter_time = force.filter_time
    six = leg_group(robot)
    out.radius = six.radius.tolist()
    out.lower, out.upper = list(robot.lower[six.joint_index]), list(robot.upper[six.joint_index])
    out.max_rate = list(six.max_rate)
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
    out.weight, out.gravity = weight, float(np.linalg.norm(scene.gravity))
    out.trunk_moment = trunk_moment(robot)
    out.load_time = control.load_time
    stiffness, damping = (
        part[six.joint_index] for part in assumed_servo(control, scene).gains(robot)
    )
    out.give, out.lag = list(1.0 / stiffness), list(damping / stiffness)
    out.anticipates = control.slip is not None and control.slip.anticipates
    if control.force_targets is not None:
        _aim(out, control, scene)
    if control.suspension is not None:
        _suspend(out, control)
    if control.touch_down is not None:
        _react(out, control)
    if control.levelling is not None:
        out.level_rate, out.level_limit = control.levelling.rate, control.levelling.limit
    return out


def _aim(out: Any, control: ControlParts, scene: Any) -> None:
    """Fill in the force targets."""
    from hexapod_pin import native

    given, six = control.force_targets, leg_group(scene.robot)
    assert given is not None
    effort = np.array(scene.robot.effort_limit)[six.joint_index]
    known = np.isfinite(effort) & (effort > 0.0)
    least = native.LeastTorque()
    least.cost = list(np.where(known.all(), effort, 1.0) ** -2.0)
    least.damping, least.friction = given.damping, given.friction
    out.least_torque, out.targets, out.anticipates = least, True, True
    out.upright_time, out.one_sided = given.upright_time, given.deviation == "segment"
    sole = sole_of(scene.contact) if given.sole == "contact" else given.sole
    if sole is not None:
        out.sole_stiffness, out.sole_exponent = sole.stiffness, sole.exponent
        out.sole_give = 0.0 if sole.sliding_stiffness is None else 1.0 / sole.sliding_stiffness


def sole_of(contact: Any) -> Sole:
    """Return how a sole deflects by a contact law; along the ground only where it sticks."""
    sticks = isinstance(contact.friction, StickSlip)
    return Sole(
        stiffness=contact.normal.stiffness,
        exponent=contact.normal.exponent,
        sliding_stiffness=contact.friction.stiffness if sticks else None,
    )


def _suspend(out: Any, control: ControlParts) -> None:
    """Fill in the virtual suspension."""
    from hexapod_pin import native

    suspension = control.suspension
    assert suspension is not None
    gains = native.SuspensionGains()
    gains.mass, gains.damping, gains.stiffness = suspension.gains(
        out.weight, effective_delay(control)
    )
    gains.limit = suspension.limit
    out.heave, out.tilt, out.warp = suspension.heave, suspension.tilt, suspension.warp
    out.suspended, out.suspension = True, gains
    out.nominal_load = 0.0 if suspension.load == "split" else float(suspension.load)


def _react(out: Any, control: ControlParts) -> None:
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
