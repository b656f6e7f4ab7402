"""`hexapod-pin check`: say whether a URDF can be used."""

from __future__ import annotations

import typer

from hexapod_pin.commands.options import Feet, PackagePath, RobotName, foot_names
from hexapod_pin.commands.status import FAILED, fail


def check(urdf: RobotName, feet: Feet = None, package_path: PackagePath = None) -> None:
    """Say whether a URDF can be used, everything that is wrong with it, and what mends it."""
    from hexapod_pin.robot.urdf_report import inspect

    report = inspect(urdf, feet=foot_names(feet), package_path=package_path or ())
    if not report.ok:
        fail(str(report), FAILED)
    typer.echo(str(report))
    if not report.legs:
        typer.echo("note: it can stand, but not walk: it has no six legs of three joints")
