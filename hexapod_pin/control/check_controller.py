"""Is this a controller at all? Told before anything runs, with what is missing."""

from __future__ import annotations

from typing import Any

from hexapod_pin.control.feedback import Command
from hexapod_pin.control.sensors import Sensors
from hexapod_pin.errors import ParameterError

FEEDBACK = ("period", "start", "update")
"""What a controller that takes part in a run must have."""


def check_controller(controller: Any) -> None:
    """Refuse what can neither plan a run nor take part in it.

    Raises:
        ParameterError: names what is missing; or `sensors` are none.
    """
    if isinstance(controller, type):
        raise ParameterError(
            "controller", controller.__name__, "a controller, not its class", "Make one: add ()."
        )
    if hasattr(controller, "plan"):
        return
    missing = [name for name in FEEDBACK if not hasattr(controller, name)]
    if missing:
        raise ParameterError(
            "controller", type(controller).__name__,
            f"one with plan(robot, duration), or with {', '.join(FEEDBACK)}",
            f"It has no {', '.join(missing)}: see docs/closed_loop.md.",
        )  # fmt: skip
    sensors = getattr(controller, "sensors", None)
    if sensors is not None and not isinstance(sensors, Sensors):
        raise ParameterError("controller.sensors", type(sensors).__name__, "Sensors or None")


def checked_answer(controller: Any, time: float, answer: Any) -> tuple[Command, Any]:
    """Return what `update` has answered at a tick [s], if it is a command and a state.

    Raises:
        ParameterError: it is something else.
    """
    pair = isinstance(answer, tuple) and len(answer) == 2
    if pair and isinstance(answer[0], Command):
        return answer[0], answer[1]
    raise ParameterError(
        f"{type(controller).__name__}.update at t = {time:g} s",
        type(answer[0] if pair else answer).__name__,
        "a pair: a Command, and the state after it",
        "Return hp.Command(q), state.",
    )  # fmt: skip
