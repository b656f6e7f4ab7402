"""Where a robot's file is: in this package, in one that is installed, or at a path."""

from __future__ import annotations

import os
from pathlib import Path

from hexapod_pin.arguments import checked
from hexapod_pin.errors import UnknownNameError, UrdfError
from hexapod_pin.plugins import ROBOTS, plugin_names, plugin_result
from hexapod_pin.user_file import user_path

PACKAGED = ("kharagpur", "athena")
"""Robots that come with the package."""


@checked
def urdf_path(name: str) -> Path:
    """Return the path of a packaged robot's URDF: "kharagpur" or "athena".

    Raises:
        UnknownNameError: no packaged robot of that name.
        UrdfError: the file is in neither place it may be in: the package or the checkout.
    """
    if name not in PACKAGED:
        raise UnknownNameError("packaged robot", name, list(PACKAGED))
    package = Path(__file__).resolve().parents[1]
    places = [folder / "urdf" / f"{name}.urdf" for folder in (package, package.parent)]
    for place in places:
        if place.is_file():
            return place
    raise UrdfError(name, [f"neither {places[0]} nor {places[1]} exists; reinstall the package"])


def absolute(path: str | Path) -> str:
    """Return what means the same file in a process that works in another folder."""
    return str(user_path(path).absolute())


def robot_path(source: str | Path) -> Path:
    """Return the file meant by a path, or by the name of a robot: packaged, or of a plugin.

    Raises:
        UnknownNameError: a bare name that is no file, and that no robot has.
        UserCodeError: the package that has the robot cannot be loaded.
    """
    if source in PACKAGED:
        return urdf_path(str(source))
    path = user_path(source)
    name_only = isinstance(source, str) and path.name == source and not path.suffix
    if name_only and not os.path.exists(path):
        found = plugin_result(ROBOTS, str(source), (str, Path))
        if found is not None:
            return Path(found)
        known = [*PACKAGED, *plugin_names(ROBOTS), "or the path of a URDF"]
        raise UnknownNameError("robot", str(source), known)
    return path
