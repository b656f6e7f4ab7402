"""Controllers by the "kind" of their settings, so that a case can be written and read back."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from hexapod_pin.arguments import checked
from hexapod_pin.errors import HexapodError, ParameterError
from hexapod_pin.plugins import CONTROLLERS, plugin, plugin_names

if TYPE_CHECKING:
    from hexapod_pin.control.arc_walk import ArcWalk
    from hexapod_pin.control.body_motion import BodyMotion
    from hexapod_pin.control.commanded_body import VelocityCommand
    from hexapod_pin.control.firmware_control import FirmwareControl
    from hexapod_pin.control.foot_control.controller import FootControl
    from hexapod_pin.control.gait import Gait
    from hexapod_pin.control.joint_motion import JointMotion
    from hexapod_pin.control.kinematic import KinematicControl
    from hexapod_pin.control.sampled_trajectory import HoldPosture, SampledTrajectory

Reader = Callable[[Mapping[str, Any]], Any]
"""Takes the result of `to_dict`, the key "kind" included, and returns the controller."""


def table(
    data: Any, where: str, *, required: tuple[str, ...] = (), optional: tuple[str, ...] = ()
) -> dict[str, Any]:
    """Return a table that has all required keys and no unknown ones.

    Raises:
        ParameterError: it has not; names the key with its path.
    """
    if not isinstance(data, Mapping):
        raise ParameterError(where, data, "a table")
    for key in required:
        if key not in data:
            raise ParameterError(f"{where}.{key}", None, "given: it has no default")
    known = (*required, *optional)
    for key in data:
        if key not in known:
            raise ParameterError(f"{where}.{key}", data[key], f"one of {', '.join(known)}")
    return dict(data)


def _kinematic(data: Mapping[str, Any]) -> KinematicControl:
    from hexapod_pin.control.body_motion import BodyMotion
    from hexapod_pin.control.commanded_body import VelocityCommand
    from hexapod_pin.control.gait import Gait
    from hexapod_pin.control.kinematic import KinematicControl

    given = table(
        data, "controller", required=("kind", "gait"), optional=("stop_at", "body", "velocity")
    )
    parts: dict[str, type[Gait | BodyMotion | VelocityCommand]] = {
        "gait": Gait, "body": BodyMotion, "velocity": VelocityCommand,
    }  # fmt: skip
    made: dict[str, Any] = {}
    for name, part in parts.items():
        if name in given:
            if not isinstance(given[name], Mapping):
                raise ParameterError(f"controller.{name}", given[name], "a table")
            made[name] = part(**given[name])
    return KinematicControl(**made, stop_at=given.get("stop_at"))


def _arc(data: Mapping[str, Any]) -> ArcWalk:
    from hexapod_pin.control.arc_walk import ArcWalk
    from hexapod_pin.control.gait import Gait

    angles = ("amplitude", "lift_angle", "profile", "stop_at", "ramp_share")
    given = table(data, "controller", required=("kind", "gait"), optional=angles)
    if not isinstance(given["gait"], Mapping):
        raise ParameterError("controller.gait", given["gait"], "a table")
    settings = {name: given[name] for name in angles if name in given}
    return ArcWalk(Gait(**given["gait"]), **settings)


def _hold(data: Mapping[str, Any]) -> HoldPosture:
    from hexapod_pin.control.sampled_trajectory import HoldPosture

    return HoldPosture(table(data, "controller", required=("kind",), optional=("q",)).get("q"))


def _held(data: Mapping[str, Any]) -> SampledTrajectory:
    from hexapod_pin.control.sampled_trajectory import SampledTrajectory

    given = table(data, "controller", required=("kind", "time", "q"), optional=("limited",))
    limited = given.get("limited", True)
    if not isinstance(limited, bool):
        raise ParameterError("controller.limited", limited, "true or false")
    return SampledTrajectory(given["time"], given["q"], limited=limited)


def _joint_motion(data: Mapping[str, Any]) -> JointMotion:
    from hexapod_pin.control.joint_motion import JointMotion

    optional = ("cycle_time", "steady_from", "speed")
    given = table(data, "controller", required=("kind", "motion"), optional=optional)
    settings = {name: given[name] for name in optional if name in given}
    return JointMotion(given["motion"], **settings)


def _foot_control(data: Mapping[str, Any]) -> FootControl:
    from hexapod_pin.control.foot_control.controller import FootControl
    from hexapod_pin.control.foot_control.parameters import NUMBERS, PARTS
    from hexapod_pin.control.gait import Gait

    given = table(
        data, "controller", required=("kind", "walk"), optional=("gait", *NUMBERS, *PARTS)
    )
    parts: dict[str, Any] = {"walk": read_controller(given["walk"])}
    for name, part in PARTS.items():
        if name in given:
            if not isinstance(given[name], Mapping):
                raise ParameterError(f"controller.{name}", given[name], "a table")
            parts[name] = part(**given[name])
    control = FootControl(**parts, **{name: given[name] for name in NUMBERS if name in given})
    if "gait" in given and Gait(**given["gait"]) != control.gait:
        raise ParameterError(
            "controller.gait", given["gait"], "that of controller.walk, or left out"
        )
    return control


def _firmware(data: Mapping[str, Any]) -> FirmwareControl:
    from hexapod_pin.control.firmware_control import FirmwareControl
    from hexapod_pin.drive.battery import Battery
    from hexapod_pin.drive.firmware import Firmware

    optional = ("command_period", "encoder", "battery", "heat")
    given = table(data, "controller", required=("kind", "walk", "firmware"), optional=optional)
    for name in ("firmware", "battery"):
        if name in given and not isinstance(given[name], Mapping):
            raise ParameterError(f"controller.{name}", given[name], "a table")
    settings = {name: given[name] for name in optional if name in given}
    if "battery" in settings:
        settings["battery"] = Battery(**settings["battery"])
    walk, firmware = read_controller(given["walk"]), Firmware(**given["firmware"])
    return FirmwareControl(walk, firmware, **settings)


# A reader imports its class when it is called: a case uses one of them.

_READERS: dict[str, Reader] = {
    "foot-control": _foot_control,
    "kinematic": _kinematic,
    "arc": _arc,
    "hold": _hold,
    "held": _held,
    "joint-motion": _joint_motion,
    "firmware": _firmware,
}


FOLLOWERS = ("firmware", "foot-control")
"""Kinds that follow another controller, their `walk`."""


@checked
def register_controller(kind: str, reader: Reader) -> None:
    """Make controllers of a class of your own readable, so that cases with them can be saved.

    Args:
        kind: `to_dict()["kind"]` of the class.
        reader: makes a controller from the result of `to_dict`, a mapping with "kind" in it.

    Raises:
        ParameterError: another reader is registered for that kind.

    Example:
        >>> register_controller("bounce", lambda data: Bounce(data["height"]))
    """
    if not isinstance(kind, str) or not kind:
        raise ParameterError("kind", kind, "a name")
    known = _READERS.setdefault(kind, reader)
    if known is not reader:
        raise ParameterError("kind", kind, "another name: this one has a reader")


def read_controller(data: Any) -> Any:
    """Return the controller that `to_dict` turned into plain data.

    Raises:
        ParameterError: `kind` is missing or unknown, or a value is out of range.
    """
    if not isinstance(data, Mapping) or "kind" not in data:
        raise ParameterError("controller.kind", None, f"one of {', '.join(_READERS)}")
    kind = data["kind"]
    reader = _reader(kind)
    if reader is None:
        known = ", ".join([*_READERS, *plugin_names(CONTROLLERS)])
        raise ParameterError(
            "controller.kind", kind, f"one of {known}",
            "Import the module that defines it; register_controller adds a class of your own.",
        )  # fmt: skip
    try:
        return reader(data)
    except HexapodError:
        raise
    except (TypeError, ValueError, KeyError) as error:
        raise ParameterError("controller", dict(data), f"readable as {kind!r} ({error})") from error


def _reader(kind: Any) -> Reader | None:
    """Return the reader of a kind: registered, or of an installed package; None: there is none.

    Raises:
        UserCodeError: the package that has it cannot be loaded.
    """
    if not isinstance(kind, str):
        return None
    found: Reader | None = _READERS.get(kind) or plugin(CONTROLLERS, kind)
    return found


def controller_to_dict(controller: Any) -> dict[str, Any]:
    """Return a controller's settings; refuse those that cannot be read back.

    Raises:
        ParameterError: the class has no `to_dict`, or no reader for its "kind".
    """
    name = type(controller).__name__
    write = getattr(controller, "to_dict", None)
    if write is None:
        raise ParameterError(
            "Case.controller", name, "a controller with to_dict()",
            'Give it one that returns its settings with the key "kind", and register_controller.',
        )  # fmt: skip
    data = dict(write())
    if data.get("kind") in FOLLOWERS:
        controller_to_dict(controller.walk)
    if _reader(data.get("kind")) is None:
        raise ParameterError(
            "Case.controller", name, "a controller that can be read back",
            f"Call register_controller({data.get('kind')!r}, reader).",
        )  # fmt: skip
    return data
