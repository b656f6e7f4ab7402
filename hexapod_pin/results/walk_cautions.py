"""What else to know of a robot that walks, in a few words each; mostly nothing."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from hexapod_pin.drive.motor import HIGHEST_SPEED, TORQUE_UNITS, Motor, most_torque
from hexapod_pin.results.ground_obstacle import find_obstacle, gravity_doubt, sinking
from hexapod_pin.results.trace import Trace
from hexapod_pin.results.walk_causes import (
    LEAST_FRICTION,
    Slip,
    dragged_feet,
    friction_coefficient,
)

MOST_FRICTION = 3.0
"""Friction coefficient above which it is no sole's [-] (*assumed*): soft rubber has 1 to 2."""


def cautions(trace: Trace, slip: Slip | None) -> tuple[str, ...]:
    """Return what else to know of a robot that walks, a few words each; mostly nothing.

    Args:
        trace: of the run.
        slip: of the feet.
    """
    found = []
    mu = friction_coefficient(trace.run.scene)
    if mu is not None and mu > MOST_FRICTION:
        found.append(f"friction of {mu:.3g} ({mu / 100.0:.2g} if percent is meant)")
    if mu is not None and mu < LEAST_FRICTION:
        found.append(f"friction of {mu:.2g}, less than on ice")
    if dragged := dragged_feet(slip and slip.per_metre):
        found.append(f"dragging {' and '.join(dragged)}")
    obstacle = find_obstacle(trace)
    if obstacle is not None and not obstacle.is_cleared:
        found.append(
            f"ground {1e3 * obstacle.height:.0f} mm high, lift {1e3 * obstacle.lift:.0f} mm"
        )
    if (sunk := sinking(trace)) is not None:
        found.append(f"feet sink {1e3 * sunk.depth:.2g} mm, lift {1e3 * sunk.lift:.0f} mm")
    found += [gravity_doubt(trace.run.gravity)] * bool(gravity_doubt(trace.run.gravity))
    return (*found, *_fixed_steps(trace), *_odd_gains(trace), *_reserve(trace), *_no_gear(trace))


SLOWEST_SERVO, LIVELIEST_SERVO = 1.0, 0.005
"""Damping over stiffness from which, and below which, a servo's gains are doubted [s] (*assumed*):
0.02 is usual, and with a quarter of it joints swing at every step."""


def _odd_gains(trace: Trace) -> tuple[str, ...]:
    """Return that a servo hardly damps, or that its gains may be exchanged; mostly nothing."""
    scene = trace.run.scene
    gains = (None, None) if scene is None else (scene.servo.kp, scene.servo.kd)
    kp, kd = (float(x) if isinstance(x, int | float) else math.nan for x in gains)
    if trace.run.prescribed or not kp > 0.0:
        return ()
    if kd < LIVELIEST_SERVO * kp:
        return (f"servos hardly damped (kd {kd:.3g} for kp {kp:.3g})",)
    return (f"kd {kd:.3g} above kp {kp:.3g} (exchanged?)",) if kd > SLOWEST_SERVO * kp else ()


def _fixed_steps(trace: Trace) -> tuple[str, ...]:
    """Return that a run's error is not known, as its steps are fixed; mostly nothing."""
    numerics = trace.run.numerics  # a formulation with steps of its own has neither
    if numerics.accuracy or not numerics.step:
        return ()
    return (f"error unknown (fixed steps of {1e3 * numerics.step:.3g} ms)",)


MUCH_ERROR = 0.1
"""Error of torques over the largest torque from which they are not to be trusted [-]."""


def large_error(trace: Trace) -> str:
    """Return that the run's own error makes its torques doubtful; mostly nothing."""
    error = None if trace.error is None else trace.error.torque
    if error is None or "torque" not in trace.recorded:
        return ""
    most = float(np.abs(trace.torque).max(initial=0.0))
    off = float(error[-1]) / most if most > 0.0 else 0.0
    return f"the run's own error is {off:.0%} of the largest torque" if off > MUCH_ERROR else ""


MUCH_RESERVE = (5.0, 40.0)
"""Stall torque over the largest torque of a run between which kgf cm explain it [-] (*assumed*)."""


def _reserve(trace: Trace) -> tuple[str, ...]:
    """Return that a motor without a mass gives many times what is needed: kgf cm are read as N m.

    Of a motor with a mass the unit of its torque is checked where it is made.
    """
    scene = trace.run.scene
    motor = None if scene is None else scene.servo.motor
    if not isinstance(motor, Motor) or motor.mass is not None or "torque" not in trace.recorded:
        return ()
    most = float(np.abs(trace.torque).max(initial=0.0))
    low, high = MUCH_RESERVE
    kgf_cm = TORQUE_UNITS["kgf cm"] * motor.stall_torque
    if not low * most < motor.stall_torque < high * most or kgf_cm < LEAST_KGF_CM * most:
        return ()
    return (f"motors of {motor.stall_torque:.3g} N m, {most:.2g} needed (kgf cm?)",)


LEAST_KGF_CM = 0.5
"""Of the largest torque of a run, what the motor would give at least if kgf cm were meant [-]."""


LIGHTEST_ROTOR = 1e-5
"""Moment of inertia of a rotor over the stall torque at its joint, below which it stands behind a
gear [s^2] (*assumed*): at gear ratio 1 direct drives have 1e-4 and more."""


def _no_gear(trace: Trace) -> tuple[str, ...]:
    """Return that a motor has the speed, or the rotor, of one before its gear; mostly nothing."""
    scene = trace.run.scene
    motor = None if scene is None else scene.servo.motor
    if not isinstance(motor, Motor):
        return ()
    if motor.no_load_speed > HIGHEST_SPEED:
        return (f"motors of {motor.no_load_speed:.4g} rad/s (before the gear? rpm?)",)
    if 0.0 < motor.armature < LIGHTEST_ROTOR * motor.stall_torque and motor.gear_ratio == 1.0:
        return (f"rotors of {motor.rotor_inertia:.2g} kg m^2 at gear ratio 1 (forgotten?)",)
    return ()


# Limits of the robot's own file that no motor has.


MOST_SPARE = 6.0
"""Limit over what a run needs within which a unit explains it [-] (*assumed*)."""

SPEED_UNITS = {"degrees/s": math.pi / 180.0, "rpm": math.pi / 30.0}
"""What data sheets give speeds in, in rad/s."""


def vain_limits(trace: Trace) -> str:
    """Return one of the robot's own limits beyond any motor's: to be below it says nothing.

    By the rule for the motors of a scene: half of the joints or more have a torque whose motors
    would weigh more than `MOTORS_SHARE` of the robot, or are faster than any motor. With the unit
    in which a motor has it; empty where motors have such limits.
    """
    scene, joints = trace.run.scene, len(trace.joint_names)
    if not joints or trace.run.prescribed or (scene is not None and scene.servo.motor is not None):
        return ""
    most = most_torque(trace.run.robot.mass, joints)
    torque = float(np.median(trace.run.robot.effort(joints)))
    speed = float(np.median(trace.run.robot.velocity(joints)))
    if most < torque < math.inf:
        units = {unit: TORQUE_UNITS[unit] for unit in ("kgf cm", "N cm", "N mm")}
        needed = np.abs(trace.torque).max(initial=0.0) if "torque" in trace.recorded else 0.0
        return f"{torque:.5g} N m{_meant(torque, units, float(needed))}"
    if HIGHEST_SPEED < speed < math.inf:
        needed = np.abs(trace.v[:, 6:]).max(initial=0.0)
        return f"{speed:.5g} rad/s{_meant(speed, SPEED_UNITS, float(needed))}"
    return ""


def _meant(limit: float, units: Mapping[str, float], needed: float) -> str:
    """Return a limit in the largest unit in which a run needs a fair part of it; mostly nothing."""
    for unit, factor in sorted(units.items(), key=lambda item: -item[1]):
        if 0.0 < needed <= factor * limit <= MOST_SPARE * needed:
            return f", {factor * limit:.3g} if {unit} are meant"
    return ""
