"""Load options: folders of meshes, repair of a URDF, and hints about the robot.

Hints can be written to a file and edited.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field, NonNegativeFloat

from hexapod_pin.arrays import Array
from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.errors import ParameterError, TraceFileError
from hexapod_pin.robot.recognition.directions import across_up
from hexapod_pin.robot.recognition.layout import RobotHints, RobotLayout
from hexapod_pin.spec import read_toml
from hexapod_pin.user_file import read_text, user_path

# How a robot's file is read: hints about the robot, where its meshes are, whether it is repaired.

HINTS_SUFFIX = ".hints.toml"
"""robot.urdf (or robot.urdf.xacro) takes hints from robot.hints.toml beside it."""


class LoadOptions(RobotHints):
    """How a robot is loaded; what is left out is inferred.

    Attributes:
        package_path: folders in which packages and meshes are looked for, before anywhere else.
        xacro_args: arguments of a xacro file.
        repair: whether the file's faults are repaired before anything else.
        mass: of the whole robot, for a repair [kg], 1e-6 to 1e6.
        density: of its parts, for a repair [kg/m^3], 1e-3 to 1e5.
        effort: of all joints, for a repair [N m], 1e-9 to 1e6.
        velocity: of all joints, for a repair [rad/s], 1e-9 to 1e4.
        backlash: free play of the gears from edge to edge [rad], of all joints that walk or by
            joint name, at most 0.5: each such joint gets a gap, a joint of its own in series.
    """

    package_path: tuple[str, ...] = ()
    xacro_args: dict[str, str] = Field(default_factory=dict)
    repair: bool = False
    mass: float | None = Field(default=None, ge=1e-6, le=1e6)
    density: float | None = Field(default=None, ge=1e-3, le=1e5)
    effort: float | None = Field(default=None, ge=1e-9, le=1e6)
    velocity: float | None = Field(default=None, ge=1e-9, le=1e4)
    backlash: NonNegativeFloat | dict[str, NonNegativeFloat] | None = None

    def given(self) -> dict[str, Any]:
        """Return what differs from the defaults, as TOML-able data."""
        return self.model_dump(mode="json", exclude_defaults=True)

    def over(self, hints: LoadOptions) -> LoadOptions:
        """Return these options, those of `hints` where nothing is given."""
        return LoadOptions(**{**hints.model_dump(exclude_defaults=True), **self.given()})

    def keyed(self) -> KeyedOptions:
        """Return the options as a part of a cache's key."""
        return KeyedOptions(json.dumps(self.given()), self)


@dataclass(frozen=True)
class KeyedOptions:
    """Load options as a part of a cache's key: equal where their texts are."""

    text: str
    options: LoadOptions = field(compare=False)


def hints_path(urdf: Path) -> Path:
    """Return the hints file of a URDF: its name up to the first dot, and HINTS_SUFFIX."""
    return urdf.with_name(urdf.name.split(".")[0] + HINTS_SUFFIX)


def read_hints(urdf: Path) -> LoadOptions:
    """Return the hints beside a URDF; none where there is no such file.

    Raises:
        ParameterError: the file is not TOML, or has a key or a value that is not allowed.
    """
    try:
        path = hints_path(urdf)
        if not path.exists():
            return LoadOptions()
    except (OSError, ValueError):  # no name for a file: the robot's own is refused for it
        return LoadOptions()
    text = read_text(path, "hints file")
    try:
        return LoadOptions(**read_toml(text))
    except ParameterError as error:
        allowed, hint = error.allowed, f"{error.hint} It stands in {path}.".strip()
        raise ParameterError(error.name, error.value, allowed, hint) from error


# A hints file from what was inferred about a robot: it is then stated, and can be edited.

HEAD = """\
# Read with the URDF of the same name: what stands here goes before what would be inferred.
# Angles of joints in rad, places of sliding joints in m; forward: x, -x, y, -y, z, -z or degrees.
"""


def write_hints(urdf: str | Path, layout: RobotLayout, options: LoadOptions) -> Path:
    """Write a layout beside a URDF, unless there is a file already, and return where.

    Raises:
        ParameterError: there is such a file, or it cannot be written.
    """
    import tomli_w

    path = hints_path(user_path(urdf))
    remarks = "".join(f"# inferred: {text}\n" for text in layout.inferred)
    text = HEAD + remarks + "\n" + tomli_w.dumps({**options.given(), **layout_hints(layout)})
    try:
        write_atomically(path, text, replace=False)
    except FileExistsError as error:
        raise ParameterError(
            "hints file", str(path), "absent: remove it to write it anew"
        ) from error
    except TraceFileError as error:
        raise ParameterError("hints file", str(path), f"writable ({error})") from error
    return path


def layout_hints(layout: RobotLayout) -> dict[str, Any]:
    """Return a layout as hints: direction, legs with all their joints, posture, held joints.

    Feet are left to be found: most of them are no links of the file.
    """
    return {
        "forward": forward_hint(layout.turn),
        "legs": {leg.name: [*leg.joints, *leg.held] for leg in layout.legs},
        "posture": dict(layout.posture),
        "held": dict(layout.held),
    }


def forward_hint(turn: Array) -> str | float:
    """Return the name of the axis that is forward, else its angle about up [degrees]."""
    for axis, name in enumerate("xyz"):
        for sign, mark in ((1.0, ""), (-1.0, "-")):
            if np.array_equal(turn[:, 0], sign * np.eye(3)[axis]):
                return mark + name
    first, second = across_up(turn[:, 2])
    return math.degrees(math.atan2(turn[:, 0] @ second, turn[:, 0] @ first))
