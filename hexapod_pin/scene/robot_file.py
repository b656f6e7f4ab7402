"""A robot as plain data: where its file is, what it contained, and how it was loaded."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from pydantic import ConfigDict

from hexapod_pin.errors import ParameterError
from hexapod_pin.file_schema import FileData, Number, check_data
from hexapod_pin.robot.loading.load_options import KeyedOptions, LoadOptions
from hexapod_pin.robot.robot import Robot, load_robot
from hexapod_pin.robot.robot_source import PACKAGED, urdf_path
from hexapod_pin.user_file import user_path

OPTIONS = ("feet", "foot_radius", "posture")
"""What a robot was loaded with."""

KEPT_ROBOTS = 16
"""How many loaded robots are remembered."""


class RobotText(FileData):
    """What `robot_to_dict` returns, and what is written like it."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, defer_build=True)

    source: str
    feet: list[str] | None = None
    foot_radius: list[Number] | Number | None = None
    posture: list[Number] | None = None
    digest: str | None = None
    options: dict[str, Any] | None = None


def robot_to_dict(robot: Robot) -> dict[str, Any]:
    """Return what `read_robot` takes; a path is absolute."""
    packaged = robot.source in PACKAGED
    explicit = robot.inferred or robot.repaired or set(robot.options) - set(OPTIONS)
    options = {"options": dict(robot.options)} if explicit else {}
    return {
        "source": robot.source if packaged else str(user_path(robot.source).absolute()),
        "feet": [foot.name for foot in robot.feet],
        "foot_radius": [float(foot.radius) for foot in robot.feet],
        "posture": robot.posture.tolist(),
        "digest": robot.digest,
        **options,
    }


def read_robot(data: Mapping[str, Any]) -> Robot:
    """Load a robot again, with the foot radius and the posture that it was loaded with.

    The same file, unchanged, and the same options give the same object: cases share it.

    Raises:
        ParameterError: the file has changed, or does not give such feet.
        UrdfError: the file is not usable.
        UnknownNameError: there is no such robot.
    """
    check_data(RobotText, "robot", data)
    source = data["source"]
    options = LoadOptions(**data["options"]).keyed() if "options" in data else None
    parts = (tuple(x) if isinstance(x := data.get(name), list) else x for name in OPTIONS)
    robot = _loaded(source, _stamp(source), *parts, options)
    if data.get("digest", robot.digest) != robot.digest:
        raise ParameterError(
            "robot.digest", data["digest"], "that of the file", "The URDF has changed."
        )
    return robot


def _stamp(source: str) -> tuple[int, int]:
    """Return time and size of a file, by which a change is noticed."""
    try:
        found = (urdf_path(source) if source in PACKAGED else user_path(source)).stat()
    except (OSError, ValueError):
        return (0, 0)  # loading it reports what is wrong
    return (found.st_mtime_ns, found.st_size)


@lru_cache(maxsize=KEPT_ROBOTS)
def _loaded(
    source: str,
    stamp: tuple[int, int],
    feet: Any,
    radii: Any,
    posture: Any,
    keyed: KeyedOptions | None,
) -> Robot:
    """Load a robot; `stamp` only distinguishes one content of a file from another."""
    options = None if keyed is None else keyed.options
    given = feet if options is None else options.feet
    robot = load_robot(source, feet=given, options=options)
    changes: dict[str, Any] = {}
    if radii is not None and radii != _radii(robot):
        changes["foot_radius"] = radii[0] if isinstance(radii, tuple) and radii else radii
    if posture is not None and posture != tuple(robot.posture.tolist()):
        changes["posture"] = posture
    if changes:
        robot = load_robot(source, feet=given, options=options, **changes)
    if radii is not None and radii != _radii(robot):
        allowed = "the file's own, or one radius for all [m]"
        raise ParameterError("robot.foot_radius", radii, allowed)
    return robot


def _radii(robot: Robot) -> tuple[float, ...]:
    return tuple(float(foot.radius) for foot in robot.feet)
