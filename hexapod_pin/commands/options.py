"""Options that several commands take are declared here.

Errors name the options of a command instead of Python's arguments.

typer reads these annotations at run time, on Python 3.10 too: Optional[...], not `| None`.
"""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, is_dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, Optional, get_type_hints

import typer

from hexapod_pin.errors import GaitError, HexapodError, ParameterError

if TYPE_CHECKING:
    from hexapod_pin.drive.catalog import MotorRecord
    from hexapod_pin.drive.motor import Motor


OptionalFloat = Optional[float]  # noqa: UP045
OptionalText = Optional[str]  # noqa: UP045
OptionalPath = Optional[Path]  # noqa: UP045
OptionalPaths = Optional[list[Path]]  # noqa: UP045
OptionalTexts = Optional[list[str]]  # noqa: UP045

RobotName = Annotated[
    str, typer.Argument(help="kharagpur, athena, or the path of a URDF, xacro or MJCF file.")
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
ImportCode = Annotated[
    OptionalPath,
    typer.Option(
        "--import",
        help="A Python file that registers controllers of your own (workers do not read it).",
    ),
]


# Groups of options that several commands share, as data classes.

Command = Callable[..., None]


def with_groups(command: Command) -> Command:
    """Return a command that takes the options of its groups one by one.

    A parameter whose type is a data class stands for the fields of that class: each is an option,
    where the parameter stands, and the command receives an object of the class.
    """
    hints = get_type_hints(command, include_extras=True)
    groups: dict[str, Any] = {}
    options: list[inspect.Parameter] = []
    for parameter in inspect.signature(command).parameters.values():
        kind = hints[parameter.name]
        if not is_dataclass(kind):
            options.append(parameter.replace(annotation=kind, kind=parameter.KEYWORD_ONLY))
            continue
        groups[parameter.name] = kind
        own = get_type_hints(kind, include_extras=True)
        options += [
            inspect.Parameter(
                one.name, parameter.KEYWORD_ONLY, default=one.default, annotation=own[one.name]
            )
            for one in fields(kind)
        ]

    @wraps(command)
    def called(**values: Any) -> None:
        for name, kind in groups.items():
            values[name] = kind(**{one.name: values.pop(one.name) for one in fields(kind)})
        command(**values)

    called.__signature__ = inspect.Signature(options)  # type: ignore[attr-defined]
    called.__annotations__ = {one.name: one.annotation for one in options}
    return called


@dataclass(frozen=True)
class Shown:
    """What `walk` and `run` print beside the answer; the attributes are options.

    Attributes:
        full: everything.
        joints: a line for every joint.
        assumed: what is assumed, a line each.
        json: JSON instead of text.
        verdict: the peaks, computed again.
        quick: leave out the two runs with other servo gains, and the one with a repaired file.
        threads: runs at a time, of those that are repeated.
    """

    full: Full = False
    joints: EveryJoint = False
    assumed: Assumed = False
    json: AsJson = False
    verdict: Verdict = False
    quick: Quick = False
    threads: Threads = 1


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
    typer.Option(help="With --motor: supply [V]; default: the voltage of its data, of several 12."),
]
CatalogFile = Annotated[
    OptionalPath,
    typer.Option("--catalog", help="A file of motors of your own; default: the package's."),
]


class ChosenMotor(NamedTuple):
    """The motor of all joints, its row of the catalogue, what to print of it, what is assumed."""

    motor: Motor | None = None
    record: MotorRecord | None = None
    lines: tuple[str, ...] = ()
    assumed: tuple[str, ...] = ()


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
    record, ratio = (motors.usual(name), 1.0) if voltage is None else motors.supplied(name, voltage)
    motor = record.motor(ratio)
    supply = "" if ratio == 1.0 else f", supplied with {voltage:g} V"
    line = (
        f"motor of all joints: {record.name}{supply}: stall torque "
        f"{ratio * motor.stall_torque:.4g} N m, no-load speed "
        f"{ratio * motor.no_load_speed:.4g} rad/s, rotor {motor.armature:.2g} kg m^2 at the joint"
    )
    assumed = list(record.assumed)
    named = name.strip().casefold() == record.name.casefold()
    if voltage is None and not named and sum(row.model == record.model for row in motors) > 1:
        assumed.append(f"supply of {record.voltage:g} V (--voltage)")
    flags = (f"note: {record.name}: {flag}" for flag in record.flags)
    return ChosenMotor(motor, record, (line, *flags), tuple(assumed))


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
        record = load_catalog().usual(text)
    except UnknownNameError as error:
        allowed = f"a number, or a motor: {', '.join(error.known)}"
        raise ParameterError(option, text, allowed) from error
    value: float | None = getattr(record, field)
    if value is None:
        raise ParameterError(option, text, f"a motor whose {field} is known: {record.unusable}")
    return value


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
