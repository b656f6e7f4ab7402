"""`hexapod-pin check`: say whether a URDF can be used."""

from __future__ import annotations

from typing import Annotated

import typer

from hexapod_pin.commands.option_names import option_names, spelt_in_options
from hexapod_pin.commands.options import Feet, FootRadius, PackagePath, RobotName, XacroArgs
from hexapod_pin.commands.robot_options import Forward, Hold, Legs, PostureText, load_options
from hexapod_pin.commands.status import FAILED, fail
from hexapod_pin.commands.terminal import echo


def check(
    context: typer.Context,
    urdf: RobotName,
    feet: Feet = None,
    foot_radius: FootRadius = None,
    forward: Forward = None,
    legs: Legs = None,
    posture: PostureText = None,
    hold: Hold = None,
    package_path: PackagePath = None,
    xacro_arg: XacroArgs = None,
    write: Annotated[
        bool,
        typer.Option("--write", help="Write what was inferred to NAME.hints.toml, to be edited."),
    ] = False,
) -> None:
    """Say whether a URDF can be used, everything that is wrong with it, and what mends it."""
    from hexapod_pin.robot.loading.hints_text import write_hints
    from hexapod_pin.robot.urdf_report import inspect

    options = load_options(
        feet=feet, legs=legs, posture=posture, hold=hold, package_path=package_path,
        xacro_arg=xacro_arg, foot_radius=foot_radius, forward=forward,
    )  # fmt: skip
    report = inspect(urdf, options=options)
    text = spelt_in_options(str(report), option_names(context.command))
    if report.ok or report.layout is not None:
        echo(text)
    if write and report.layout is not None:
        echo(f"wrote {write_hints(urdf, report.layout, options)}")
    if not report.ok:
        fail(f"{report.source}: refused" if report.layout is not None else text, FAILED)
    if not report.legs:
        echo("note: it can stand, but not walk: it has no legs to walk with")
