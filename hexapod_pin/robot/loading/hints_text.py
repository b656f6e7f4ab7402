"""Writing what was inferred about a robot as a hints file: it is then said, and can be edited."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.errors import ParameterError, TraceFileError
from hexapod_pin.robot.loading.load_options import LoadOptions, hints_path
from hexapod_pin.robot.recognition.directions import across_up
from hexapod_pin.robot.recognition.layout import RobotLayout
from hexapod_pin.user_file import user_path

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
