"""Motors of a catalogue by name, where a command takes a motor, a torque or a speed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hexapod_pin.commands.options import OptionalFloat, OptionalPath, OptionalText
from hexapod_pin.errors import ParameterError

if TYPE_CHECKING:
    from hexapod_pin.drive.motor import Motor

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


def chosen_motor(
    name: str | None, voltage: float | None, catalog: Path | None
) -> tuple[Motor | None, list[str]]:
    """Return the motor of all joints that was asked for, and what to print of it.

    Raises:
        ParameterError: a voltage or a file without a motor, or a voltage it is not made for.
        UnknownNameError: the catalogue has no such motor.
        CatalogError: the file cannot be used.
    """
    from hexapod_pin.drive.catalog import load_catalog

    if name is None:
        for option, value in {"--voltage": voltage, "--catalog": catalog}.items():
            if value is not None:
                raise ParameterError(option, str(value), "left out without --motor")
        return None, []
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
    return motor, [line, *assumed, *(f"note: {record.name}: {flag}" for flag in record.flags)]


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
    from hexapod_pin.drive.catalog import load_catalog
    from hexapod_pin.errors import UnknownNameError

    if text is None:
        return None
    try:
        return float(text)
    except ValueError:
        pass
    try:
        record = load_catalog().get(text)
    except UnknownNameError as error:
        allowed = f"a number, or a motor: {', '.join(error.known)}"
        raise ParameterError(option, text, allowed) from error
    value: float | None = getattr(record, field)
    if value is None:
        raise ParameterError(option, text, f"a motor whose {field} is known: {record.unusable}")
    return value
