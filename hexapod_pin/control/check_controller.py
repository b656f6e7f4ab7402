"""Checks of a controller's attributes and results; errors name the controller's class."""

from __future__ import annotations

import datetime
import math
import numbers
from collections.abc import Mapping
from decimal import Decimal
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.feedback import Command
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.joint_trajectory import JointTrajectory
from hexapod_pin.control.sensors import Sensors
from hexapod_pin.errors import ParameterError
from hexapod_pin.user_code import UserCode

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot

FEEDBACK = ("period", "start", "update")
"""Attributes that a closed-loop controller must have."""

TOML = (str, bool, int, float, Decimal, datetime.date, datetime.time)
"""Types of TOML besides tables and arrays."""


def check_controller(controller: Any) -> None:
    """Refuse an object that is neither an open-loop nor a closed-loop controller.

    Raises:
        ParameterError: names what is missing, or the attribute that cannot be used.
    """
    if isinstance(controller, type):
        raise ParameterError(
            "controller", controller.__name__, "a controller, not its class", "Make one: add ()."
        )
    if hasattr(controller, "plan"):
        return
    if isinstance(controller, Gait):
        raise ParameterError(
            "controller", controller.name, "a controller, not a gait",
            "KinematicControl(gait) walks it.",
        )  # fmt: skip
    missing = [name for name in FEEDBACK if not hasattr(controller, name)]
    if missing:
        raise ParameterError(
            "controller", type(controller).__name__,
            f"one with plan(robot, duration), or with {', '.join(FEEDBACK)}",
            f"It has no {', '.join(missing)}: see docs/closed_loop.md.",
        )  # fmt: skip
    _require_time("period", controller.period, smallest=math.ulp(0.0))
    _require_time("delay", getattr(controller, "delay", 0.0), smallest=0.0)
    for name, kind in (("sensors", Sensors), ("gait", Gait)):
        given = getattr(controller, name, None)
        if given is not None and not isinstance(given, kind):
            allowed = f"{kind.__name__} or None"
            raise ParameterError(f"controller.{name}", type(given).__name__, allowed)


def _require_time(name: str, value: Any, smallest: float) -> None:
    """Refuse what is no time of a controller [s].

    Raises:
        ParameterError: it is none, or shorter than the smallest.
    """
    number = isinstance(value, numbers.Real) and not isinstance(value, bool)
    if not (number and math.isfinite(value) and value >= smallest):
        allowed = "finite and above 0 s" if smallest > 0.0 else "finite and not negative [s]"
        raise ParameterError(f"controller.{name}", value, allowed)


def method_name(controller: Any, method: str) -> str:
    """Return a method as messages name it, such as "MyController.update"."""
    return f"{type(controller).__name__}.{method}"


def settings_of(controller: Any) -> dict[str, Any]:
    """Return a controller's settings, or at least what it is.

    Raises:
        ParameterError: `to_dict` returns what no TOML file can hold; a trace stores it as TOML.
        UserCodeError: it raises.
    """
    to_dict = getattr(controller, "to_dict", None)
    if to_dict is None:
        return {"kind": f"{type(controller).__module__}.{type(controller).__qualname__}"}
    call = method_name(controller, "to_dict")
    with UserCode(call):
        found = to_dict()
    if not isinstance(found, Mapping):
        raise ParameterError(call, type(found).__name__, "a mapping of names to settings")
    try:
        _require_toml(found, call)
    except RecursionError:
        allowed = "a mapping that does not hold itself"
        raise ParameterError(call, type(found).__name__, allowed) from None
    return dict(found)


def _require_toml(value: Any, where: str) -> None:
    """Refuse what no TOML file can hold.

    Raises:
        ParameterError: names the place.
    """
    if isinstance(value, Mapping):
        for key, item in value.items():
            if not isinstance(key, str):
                raise ParameterError(f"{where}[{key!r}]", key, "a str")
            _require_toml(item, f"{where}.{key}")
    elif isinstance(value, list | tuple):
        for index, item in enumerate(value):
            if not isinstance(item, float):  # most of what long lists hold
                _require_toml(item, f"{where}[{index}]")
    elif not isinstance(value, TOML):
        allowed = "what TOML can hold: str, int, float, bool, a date, a list or a dict of them"
        raise ParameterError(where, type(value).__name__, allowed)


def checked_plan(controller: Any, plan: Any, robot: Robot) -> JointTrajectory:
    """Return what `plan` has returned, if it is a trajectory of this robot's joints.

    Raises:
        ParameterError: it is something else.
    """
    call, joints = method_name(controller, "plan"), len(robot.joint_names)
    if not isinstance(plan, JointTrajectory):
        raise ParameterError(call, type(plan).__name__, "a JointTrajectory")
    if plan.q.ndim != 2 or plan.q.shape[1] != joints:
        raise ParameterError(f"{call}.q", plan.q.shape, f"of shape (K, {joints}): knots, joints")
    return plan


def checked_posture(controller: Any, posture: Any, robot: Robot) -> Array:
    """Return the joint angles (n,) that `posture` has returned [rad].

    Raises:
        ParameterError: they are none, or not finite.
    """
    call, joints = method_name(controller, "posture"), len(robot.joint_names)
    try:
        found = np.asarray(posture)
    except (TypeError, ValueError, OverflowError):
        found = np.asarray(None)
    if found.dtype.kind not in "biuf" or found.shape != (joints,):
        given = found.shape if found.dtype.kind in "biuf" else type(posture).__name__
        raise ParameterError(call, given, f"{joints} joint angles [rad]")
    wrong = np.flatnonzero(~np.isfinite(found))
    if len(wrong):
        name = robot.joint_names[wrong[0]]
        raise ParameterError(f"{call}[{name}]", float(found[wrong[0]]), "finite [rad]")
    angles: Array = found.astype(float)
    return angles


UNITS = {"q": "rad", "v": "rad/s", "torque": "N m"}
"""Units of the fields of a command."""


def checked_rows(
    call: str, name: str, given: Any, shape: tuple[int, int], time: float | None
) -> Array:
    """Return a field of a command as numbers, a row for each run.

    Args:
        call: what has given it, for messages.
        name: of the field.
        given: what it is.
        shape: what it must have: runs, joints of the robot.
        time: of the command [s], for messages.

    Raises:
        ParameterError: it holds no real numbers, or has another shape.
    """
    try:
        found = np.asarray(given)
    except (TypeError, ValueError, OverflowError):  # rows of several lengths
        found = np.asarray(None)
    if found.dtype.kind not in "biuf":
        allowed = f"real numbers [{UNITS[name]}], all rows of one length"
        value = f"an array of {found.dtype}" if isinstance(given, np.ndarray) else given
        raise ParameterError(f"{call}.{name}", value, allowed + at_time(time))
    rows = np.ascontiguousarray(found, dtype=float)
    if rows.shape != shape:
        allowed = f"of shape {shape}{at_time(time)}: runs, joints of the robot"
        raise ParameterError(f"{call}.{name}", rows.shape, allowed)
    return rows


def at_time(time: float | None) -> str:
    """Return the time [s] of a call for the end of a message; empty where it has none."""
    return "" if time is None else f" at t = {time:g} s"


def checked_answer(call: str, time: float, answer: Any) -> tuple[Command, Any]:
    """Return what `update` has returned, if it is a command and something beside it.

    Args:
        call: the method, for messages.
        time: of its tick [s].
        answer: what it has returned.

    Raises:
        ParameterError: it is something else.
    """
    pair = isinstance(answer, tuple) and len(answer) == 2
    if not (pair and isinstance(answer[0], Command)):
        raise ParameterError(
            call, type(answer[0] if pair else answer).__name__,
            f"a pair{at_time(time)}: a Command, and the state after it",
            "Return hp.feedback.Command(q), state.",
        )  # fmt: skip
    if not isinstance(answer[0].ramp, bool | np.bool_):
        raise ParameterError(f"{call}.ramp", answer[0].ramp, f"a bool{at_time(time)}")
    return answer[0], answer[1]
