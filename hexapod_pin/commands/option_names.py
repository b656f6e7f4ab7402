"""Errors in the words of the command that met them: its options instead of Python's arguments.

Errors of this package spell an argument as `name=value`, or name it in `ParameterError.name` and
`GaitError.quantity`. Where the command has an option for it, its name takes the place.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

from hexapod_pin.errors import GaitError, HexapodError, ParameterError

SAME = {
    "cycle_time": "cycle", "turn_rate": "turn", "held": "hold", "xacro_args": "xacro_arg",
}  # fmt: skip
"""Options whose names differ from the argument that they set."""

DEGREES = ("heading", "turn")
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
    """Return a text with a command's options in the place of `name=value`."""
    return ARGUMENT.sub(lambda found: _spelt(found, options), text)


def _option(name: str, options: Mapping[str, str]) -> str | None:
    """Return the option of a dotted name, by its last part that one sets."""
    parts = [part for part in name.split(".") if part.isidentifier()]
    last = parts[-1] if parts else name
    return options.get(SAME.get(last, last))


def _gait_text(text: str, quantity: str, options: Mapping[str, str]) -> str:
    """Name the option in what a refused gait says of its limit, in the option's unit."""
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
