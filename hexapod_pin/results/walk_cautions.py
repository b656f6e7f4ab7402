"""What else to know of a robot that walks, in a few words each; mostly nothing."""

from __future__ import annotations

import numpy as np

from hexapod_pin.drive.motor import TORQUE_UNITS, Motor
from hexapod_pin.results.ground_obstacle import find_obstacle, gravity_doubt, sinking
from hexapod_pin.results.trace import Trace
from hexapod_pin.results.walk_causes import Slip, dragged_feet, friction_coefficient

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
    return (*found, *_unknown_error(trace), *_exchanged_gains(trace), *_reserve(trace))


SLOWEST_SERVO = 1.0
"""Damping over stiffness from which a servo's gains are doubted [s] (*assumed*): 0.02 is usual."""


def _exchanged_gains(trace: Trace) -> tuple[str, ...]:
    """Return that a servo's damping exceeds its stiffness: the gains may be exchanged."""
    scene = trace.run.scene
    gains = (None, None) if scene is None else (scene.servo.kp, scene.servo.kd)
    kp, kd = (float(x) if isinstance(x, int | float) else 0.0 for x in gains)
    if trace.run.prescribed or not kd > SLOWEST_SERVO * kp > 0.0:
        return ()
    return (f"kd {kd:.3g} above kp {kp:.3g} (exchanged?)",)


MUCH_ERROR = 0.1
"""Error of torques over the largest torque from which the first line has it [-]."""


def _unknown_error(trace: Trace) -> tuple[str, ...]:
    """Return that a run's error is large, or not known as its steps are fixed; mostly nothing."""
    numerics = trace.run.numerics
    if not numerics.accuracy:  # a formulation with steps of its own has neither
        step = numerics.step
        return (f"error unknown (fixed steps of {1e3 * step:.3g} ms)",) if step else ()
    error = None if trace.error is None else trace.error.torque
    if error is None or "torque" not in trace.recorded:
        return ()
    most = float(np.abs(trace.torque).max(initial=0.0))
    off = float(error[-1]) / most if most > 0.0 else 0.0
    return (f"torques off by up to {off:.0%}",) if off > MUCH_ERROR else ()


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
