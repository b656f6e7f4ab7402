"""Options that several commands take are declared here.

Errors name the options of a command instead of Python's arguments.

typer reads these annotations at run time, on Python 3.10 too: Optional[...], not `| None`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, Optional

import typer

from hexapod_pin.errors import GaitError, HexapodError, ParameterError
from hexapod_pin.user_file import user_path

if TYPE_CHECKING:
    from hexapod_pin.drive.catalog import MotorRecord
    from hexapod_pin.drive.motor import Motor
    from hexapod_pin.robot.loading.load_options import LoadOptions


OptionalFloat = Optional[float]  # noqa: UP045
OptionalText = Optional[str]  # noqa: UP045
OptionalPath = Optional[Path]  # noqa: UP045
OptionalPaths = Optional[list[Path]]  # noqa: UP045
OptionalTexts = Optional[list[str]]  # noqa: UP045

RobotName = Annotated[
    str, typer.Argument(help="kharagpur, athena, or the path of a URDF, xacro or MJCF file.")
]
PackagePath = Annotated[
    OptionalPaths,
    typer.Option("--package-path", help="A folder with packages or meshes; repeatable."),
]
XacroArgs = Annotated[
    OptionalTexts, typer.Option("--xacro-arg", help="NAME=VALUE for a xacro file; repeatable.")
]
TracePath = Annotated[Path, typer.Argument(help="A file that `walk` left (walk.nc).")]
TraceOut = Annotated[
    Path,
    typer.Option(help="Trace file to write: .nc, .h5, .hdf5; or .csv, .csv.gz as a plain table."),
]
Record = Annotated[
    OptionalText,
    typer.Option(
        help="Samples to keep, separated by commas: torque, set_points, contacts, com, energy; "
        "motion alone for none of them. Default: all. On request: sliding, current, temperature."
    ),
]
Feet = Annotated[
    OptionalText,
    typer.Option(help="Names of the foot links, separated by commas, where not found by name."),
]
NoHtml = Annotated[bool, typer.Option("--no-html", help="Write no playback.")]
Verdict = Annotated[
    bool,
    typer.Option(
        "--verdict",
        help="Compute the peaks again, finer and with stiffer contact and servos: which hold?",
    ),
]
Full = Annotated[
    bool,
    typer.Option("--full", help="Everything: settings, all joints, energies, notes, assumptions."),
]
EveryJoint = Annotated[bool, typer.Option("--joints", help="A line for every joint, too.")]
Assumed = Annotated[bool, typer.Option("--assumed", help="What is assumed, a line each, too.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON instead.")]
Threads = Annotated[int, typer.Option(help="Runs at a time, of those that are repeated.")]
Force = Annotated[
    bool,
    typer.Option("--force", help="Run it whatever it needs: no limits of steps, memory or work."),
]
Quick = Annotated[
    bool,
    typer.Option(
        "--quick",
        help="Leave out the two runs that show how far peaks depend on assumed servo gains.",
    ),
]
FootRadius = Annotated[
    OptionalFloat,
    typer.Option(help="Radius of all foot spheres [m]; default: the URDF's own."),
]

ImportCode = Annotated[
    OptionalPath,
    typer.Option(
        "--import",
        help="A Python file that registers controllers of your own (workers do not read it).",
    ),
]


def import_code(path: Path | None) -> None:
    """Import the file of `--import`, if any; raises as `import_file`."""
    if path is not None:
        from hexapod_pin.commands.import_file import import_file

        import_file("--import", path)


def given(**fields: float | None) -> dict[str, float]:
    """Return the fields that are not None."""
    return {name: value for name, value in fields.items() if value is not None}


def comma_list(text: str | None) -> list[str] | None:
    """Return the parts of a comma-separated list; None of nothing."""
    return None if text is None else [part.strip() for part in text.split(",")]


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


# Motors of a catalogue by name, where a command takes a motor, a torque or a speed.

MotorName = Annotated[
    OptionalText,
    typer.Option(
        "--motor",
        help="Motor of all joints, such as AX-12A or 'XM430-W350 at 12 V': its torque-speed line "
        "and its rotor act.",
    ),
]
Voltage = Annotated[
    OptionalFloat,
    typer.Option(help="With --motor: supply [V]; default: the voltage of its data."),
]
CatalogFile = Annotated[
    OptionalPath,
    typer.Option("--catalog", help="A file of motors of your own; default: the package's."),
]


class ChosenMotor(NamedTuple):
    """The motor of all joints, its row of the catalogue, and what to print of it."""

    motor: Motor | None = None
    record: MotorRecord | None = None
    lines: tuple[str, ...] = ()


def chosen_motor(name: str | None, voltage: float | None, catalog: Path | None) -> ChosenMotor:
    """Return the motor chosen for all joints; nothing without a name.

    Raises:
        ParameterError: a voltage or a file without a motor, or a voltage it is not made for.
        UnknownNameError: the catalogue has no such motor.
        CatalogError: the file cannot be used.
    """
    if name is None:
        for option, value in {"--voltage": voltage, "--catalog": catalog}.items():
            if value is not None:
                raise ParameterError(option, str(value), "left out without --motor")
        return ChosenMotor()
    from hexapod_pin.drive.catalog import load_catalog

    motors = load_catalog(catalog)
    record, ratio = (motors.get(name), 1.0) if voltage is None else motors.supplied(name, voltage)
    motor = record.motor(ratio)
    supply = "" if ratio == 1.0 else f", supplied with {voltage:g} V"
    line = (
        f"motor of all joints: {record.name}{supply}: stall torque "
        f"{ratio * motor.stall_torque:.4g} N m, no-load speed "
        f"{ratio * motor.no_load_speed:.4g} rad/s, rotor {motor.armature:.2g} kg m^2 at the joint"
    )
    assumed = [f"assumed: {text}" for text in record.assumed]
    flags = (f"note: {record.name}: {flag}" for flag in record.flags)
    return ChosenMotor(motor, record, (line, *assumed, *flags))


def torque_limit(text: str | None) -> float | None:
    """Return a torque limit [N m]: a number, or the stall torque of a motor of the catalogue.

    Raises:
        ParameterError: no number, and no motor of that name at one voltage.
    """
    return _number(text, "--effort", "stall_torque")


def speed_limit(text: str | None) -> float | None:
    """Return a speed limit [rad/s]: a number, or the no-load speed of a motor of the catalogue.

    Raises:
        ParameterError: no number, no motor of that name at one voltage, or none with a speed.
    """
    return _number(text, "--velocity", "no_load_speed")


def _number(text: str | None, option: str, field: str) -> float | None:
    from hexapod_pin.errors import UnknownNameError

    if text is None:
        return None
    try:
        return float(text)
    except ValueError:
        pass
    from hexapod_pin.drive.catalog import load_catalog

    try:
        record = load_catalog().get(text)
    except UnknownNameError as error:
        allowed = f"a number, or a motor: {', '.join(error.known)}"
        raise ParameterError(option, text, allowed) from error
    value: float | None = getattr(record, field)
    if value is None:
        raise ParameterError(option, text, f"a motor whose {field} is known: {record.unusable}")
    return value


# Options for how a robot's file is read: the same for every command that loads one.
#
# typer reads these annotations at run time.

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
    **numbers: Any,
) -> LoadOptions:
    """Return what was given as options of `load_robot`.

    Raises:
        ParameterError: a str that does not have the form its option needs, or a number or motor
            that only --repair takes.
    """
    from hexapod_pin.robot.loading.load_options import LoadOptions

    numbers |= {"effort": torque_limit(effort), "velocity": speed_limit(velocity)}
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


# Errors in terms of the command that met them: its options instead of Python's arguments.
#
# Errors of this package spell an argument as `name=value`, or name it in `ParameterError.name` and
# `GaitError.quantity`. Where the command has an option for it, its name takes the place.

SAME = {
    "xacro_args": "xacro_arg",
}  # fmt: skip
"""Options whose names differ from the argument that they set."""

DEGREES = ("heading", "turn_rate")
"""Options in degrees, or degrees per second, where the argument is in radians."""

EXAMPLES = {
    "feet": "a,b,c", "record": "a,b,c", "legs": "lf=a,b,c;lm=...", "posture": "JOINT=DEGREES,...",
    "forward": "x|-x|y|-y|DEGREES", "package_path": "FOLDER", "xacro_args": "NAME=VALUE",
    "held": "JOINT=DEGREES,...",
}  # fmt: skip
"""What stands for a list of unknown values."""

ARGUMENT = re.compile(r"\b([a-z_]+)=(\[[^\]]*\]|'[^']*'|\"[^\"]*\"|[\d.][\w.+-]*)")
RADIANS = re.compile(r"(-?[\d.]+(?:e[+-]?\d+)?) rad\b")


def in_options(error: HexapodError, options: Mapping[str, str]) -> str:
    """Return the message of an error with a command's options in the place of arguments.

    Args:
        error: what a command met.
        options: the command's own: name of the argument -> option, such as "feet" -> "--feet".
    """
    text = str(error)
    if isinstance(error, ParameterError):
        name = "/".join(_option(part, options) or part for part in error.name.split("/"))
        text = name + text.removeprefix(error.name)
    if isinstance(error, GaitError):
        text = _gait_text(text, error.quantity, options)
    return spelt_in_options(text, options)


def option_names(command: Any) -> dict[str, str]:
    """Return the options of a command by their arguments, such as "feet" -> "--feet"."""
    parameters = [] if command is None else command.params
    longest = {one.name: max(one.opts, key=len) for one in parameters if one.name}
    return {name: option for name, option in longest.items() if option.startswith("--")}


def spelt_in_options(text: str, options: Mapping[str, str]) -> str:
    """Return text with a command's options in the place of `name=value`."""
    return ARGUMENT.sub(lambda found: _spelt(found, options), text)


def _option(name: str, options: Mapping[str, str]) -> str | None:
    """Return the option of a dotted name, by its last part that one sets."""
    parts = [part for part in re.sub(r"\[.*?\]", "", name).split(".") if part.isidentifier()]
    last = parts[-1] if parts else name
    return options.get(SAME.get(last, last))


def _gait_text(text: str, quantity: str, options: Mapping[str, str]) -> str:
    """Name the option in the limit of a refused gait, in the option's unit."""
    option = _option(quantity, options)
    if option is None:
        return text
    before, found, after = text.rpartition(f"{quantity} ")
    if SAME.get(quantity, quantity) in DEGREES:
        after = RADIANS.sub(lambda x: f"{math.degrees(float(x[1])):.4g} degrees", after)
    return f"{before}{option} {after}" if found else text


def _spelt(found: re.Match[str], options: Mapping[str, str]) -> str:
    """Return `name=value` as it is typed in a shell."""
    name, value = found[1], found[2]
    option = _option(name, options)
    if option is None:
        return found[0]
    if value == "[...]":
        return f"{option} {EXAMPLES.get(name, '...')}"
    return f"{option} {value.strip('[]').replace(chr(39), '').replace(', ', ',')}"
