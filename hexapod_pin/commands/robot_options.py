"""Options that say how a robot's file is read: the same for every command that loads one.

typer reads these annotations at run time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hexapod_pin.commands.motor_options import speed_limit, torque_limit
from hexapod_pin.commands.options import OptionalFloat, OptionalText, foot_names
from hexapod_pin.errors import ParameterError
from hexapod_pin.user_file import user_path

if TYPE_CHECKING:
    from hexapod_pin.robot.loading.load_options import LoadOptions

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
Hold = Annotated[
    OptionalText,
    typer.Option(help="Joints that do not walk: 'JOINT=DEGREES,...' (m for sliding joints)."),
]
MendFirst = Annotated[
    bool, typer.Option("--mend", help="Mend the file's faults first; see `hexapod-pin mend`.")
]
Mass = Annotated[OptionalFloat, typer.Option(help="With --mend: mass of the robot [kg].")]
Density = Annotated[OptionalFloat, typer.Option(help="With --mend: of its parts [kg/m^3].")]
Effort = Annotated[
    OptionalText, typer.Option(help="With --mend: of all joints [N m], or a motor's name.")
]
Velocity = Annotated[
    OptionalText, typer.Option(help="With --mend: of all joints [rad/s], or a motor's name.")
]


def load_options(
    *,
    feet: str | None = None,
    legs: str | None = None,
    posture: str | None = None,
    hold: str | None = None,
    package_path: Sequence[Path] | None = None,
    xacro_arg: Sequence[str] | None = None,
    effort: str | None = None,
    velocity: str | None = None,
    **numbers: Any,
) -> LoadOptions:
    """Return what was given as options of `load_robot`.

    Raises:
        ParameterError: a text that does not have the form its option wants, or a number or motor
            that only --mend takes.
    """
    from hexapod_pin.robot.loading.load_options import LoadOptions

    numbers |= {"effort": torque_limit(effort), "velocity": speed_limit(velocity)}
    mends = ("mass", "density", "effort", "velocity")
    wanted = [name for name in mends if numbers.get(name) is not None]
    if wanted and not numbers.get("mend"):
        allowed = "left out without --mend"
        raise ParameterError(f"--{wanted[0]}", numbers[wanted[0]], allowed)
    found: dict[str, Any] = {
        "feet": foot_names(feet),
        "legs": None if legs is None else leg_joints(legs),
        "posture": None if posture is None else angles("--posture", posture),
        "held": None if hold is None else angles("--hold", hold),
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
