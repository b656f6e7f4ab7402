"""Options for how a robot's file is read: the same for every command that loads one.

typer reads these annotations at run time, on Python 3.10 too: Optional[...], not `| None`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hexapod_pin.commands.options import (
    OptionalFloat,
    OptionalPaths,
    OptionalText,
    OptionalTexts,
    comma_list,
    speed_limit,
    torque_limit,
)
from hexapod_pin.errors import ParameterError
from hexapod_pin.user_file import user_path

if TYPE_CHECKING:
    from hexapod_pin.robot.loading.load_options import LoadOptions

Feet = Annotated[
    OptionalText,
    typer.Option(help="Names of the foot links, separated by commas, where not found by name."),
]
FootRadius = Annotated[
    OptionalFloat,
    typer.Option(help="Radius of all foot spheres [m]; default: the URDF's own."),
]

Forward = Annotated[
    OptionalText,
    typer.Option(help="Direction of travel in the root link: x, -x, y, -y, z, -z or degrees."),
]
Legs = Annotated[
    OptionalText,
    typer.Option(help="Legs: 'lf=JOINT,JOINT,JOINT;lm=...', or one joint or link of each."),
]
PostureText = Annotated[
    OptionalText,
    typer.Option("--posture", help="Standing angles: 'JOINT=DEGREES,JOINT=DEGREES,...'."),
]
WalkPosture = Annotated[
    OptionalText,
    typer.Option(
        "--posture",
        help="Standing angles: 'JOINT=DEGREES,JOINT=DEGREES,...'; least-torque: those that need "
        "the least holding torque in this gait; longest-stroke: those that leave most of a stroke.",
    ),
]
Hold = Annotated[
    OptionalText,
    typer.Option(help="Joints that do not walk: 'JOINT=DEGREES,...' (m for sliding joints)."),
]
PackagePath = Annotated[
    OptionalPaths,
    typer.Option("--package-path", help="A folder with packages or meshes; repeatable."),
]
XacroArgs = Annotated[
    OptionalTexts, typer.Option("--xacro-arg", help="NAME=VALUE for a xacro file; repeatable.")
]


@dataclass(frozen=True)
class Loading:
    """How a robot's file is read; the attributes are options of a command."""

    feet: Feet = None
    foot_radius: FootRadius = None
    forward: Forward = None
    legs: Legs = None
    posture: PostureText = None
    held: Hold = None
    package_path: PackagePath = None
    xacro_arg: XacroArgs = None

    def options(self) -> LoadOptions:
        """Return what was given, as options of `load_robot`; raises as `load_options`."""
        return load_options(**{field.name: getattr(self, field.name) for field in fields(self)})


RepairFirst = Annotated[
    bool, typer.Option("--repair", help="Repair the file's faults first; see `hexapod-pin repair`.")
]
Mass = Annotated[OptionalFloat, typer.Option(help="With --repair: mass of the robot [kg].")]
Density = Annotated[OptionalFloat, typer.Option(help="With --repair: of its parts [kg/m^3].")]
Effort = Annotated[
    OptionalText, typer.Option(help="With --repair: of all joints [N m], or a motor's name.")
]
Velocity = Annotated[
    OptionalText, typer.Option(help="With --repair: of all joints [rad/s], or a motor's name.")
]


@dataclass(frozen=True)
class RepairedLoading(Loading):
    """How a robot's file is read, and repaired first on request."""

    repair: RepairFirst = False
    mass: Mass = None
    density: Density = None
    effort: Effort = None
    velocity: Velocity = None


Backlash = Annotated[
    OptionalText,
    typer.Option(
        help="Free play of the gears from edge to edge: 'DEGREES' for all joints that walk, or "
        "'JOINT=DEGREES,...'; needs a motor whose rotor is known (--motor)."
    ),
]


@dataclass(frozen=True)
class WalkLoading(RepairedLoading):
    """The same where a posture may be searched, too, and gears may have play."""

    posture: WalkPosture = None
    backlash: Backlash = None


def load_options(
    *,
    feet: str | None = None,
    legs: str | None = None,
    posture: str | None = None,
    held: str | None = None,
    package_path: Sequence[Path] | None = None,
    xacro_arg: Sequence[str] | None = None,
    effort: str | None = None,
    velocity: str | None = None,
    backlash: str | None = None,
    repair: bool = False,
    **numbers: Any,
) -> LoadOptions:
    """Return what was given as options of `load_robot`.

    Raises:
        ParameterError: a str that does not have the form its option needs, or a number or motor
            that only --repair takes.
    """
    from hexapod_pin.robot.loading.load_options import LoadOptions

    numbers |= {"effort": torque_limit(effort), "velocity": speed_limit(velocity)}
    numbers["repair"] = repair or None
    repairs = ("mass", "density", "effort", "velocity")
    given = [name for name in repairs if numbers.get(name) is not None]
    if given and not numbers.get("repair"):
        allowed = "left out without --repair"
        raise ParameterError(f"--{given[0]}", numbers[given[0]], allowed)
    found: dict[str, Any] = {
        "feet": foot_names(feet),
        "legs": None if legs is None else leg_joints(legs),
        "posture": None if posture is None else angles("--posture", posture),
        "held": None if held is None else angles("--held", held),
        "backlash": None if backlash is None else free_play(backlash),
        "package_path": [str(user_path(folder).absolute()) for folder in package_path or ()],
        "xacro_args": dict(pair("--xacro-arg", text) for text in xacro_arg or ()),
        **numbers,
    }
    return LoadOptions(**{name: value for name, value in found.items() if value is not None})


def pair(option: str, text: str) -> tuple[str, str]:
    """Return name and value of NAME=VALUE.

    Raises:
        ParameterError: no name or no equals sign.
    """
    name, sign, value = text.partition("=")
    if not (sign and name.strip()):
        raise ParameterError(option, text, "NAME=VALUE")
    return name.strip(), value.strip()


def angles(option: str, text: str) -> dict[str, float]:
    """Return joint name -> angle [rad] of JOINT=DEGREES,JOINT=DEGREES.

    Raises:
        ParameterError: another form, or an angle that is no finite number.
    """
    found = {}
    for part in text.split(","):
        name, value = pair(option, part)
        try:
            found[name] = math.radians(float(value))
        except ValueError:
            found[name] = math.nan
        if not math.isfinite(found[name]):
            raise ParameterError(option, part.strip(), "JOINT=DEGREES, separated by commas")
    return found


def free_play(text: str) -> float | dict[str, float]:
    """Return the backlash [rad] of DEGREES or of JOINT=DEGREES,JOINT=DEGREES.

    Raises:
        ParameterError: another form, or an angle that is no finite number.
    """
    if "=" in text:
        return angles("--backlash", text)
    try:
        found = math.radians(float(text))
    except ValueError:
        found = math.nan
    if not math.isfinite(found):
        raise ParameterError("--backlash", text, "DEGREES, or JOINT=DEGREES,...")
    return found


def leg_joints(text: str) -> dict[str, list[str]]:
    """Return leg name -> joints (or one joint or link) of LEG=JOINT,JOINT;LEG=JOINT,JOINT.

    Raises:
        ParameterError: another form.
    """
    found = {}
    for part in text.split(";"):
        leg, joints = pair("--legs", part)
        found[leg] = [name.strip() for name in joints.split(",") if name.strip()]
    return found


def foot_names(text: str | None) -> list[str] | None:
    """Return the names in a comma-separated list.

    Raises:
        ParameterError: a name is empty or given twice.
    """
    names = comma_list(text)
    if names is None:
        return None
    if not all(names) or len(set(names)) < len(names):
        raise ParameterError("--feet", text, "different link names, separated by commas")
    return names
