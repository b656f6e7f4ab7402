"""The commands `check` and `repair` check whether a URDF can be used, and repair it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.commands.loading_options import Loading
from hexapod_pin.commands.options import (
    OptionalFloat,
    OptionalText,
    RobotName,
    given,
    option_names,
    speed_limit,
    spelt_in_options,
    torque_limit,
    with_groups,
)
from hexapod_pin.commands.terminal import FAILED, announce, echo, fail
from hexapod_pin.errors import ParameterError
from hexapod_pin.user_file import user_path

if TYPE_CHECKING:
    from collections.abc import Mapping

    from hexapod_pin.robot.loading.load_options import LoadOptions
    from hexapod_pin.robot.repair import Repaired


@with_groups
def check(
    context: typer.Context,
    urdf: RobotName,
    *,
    loading: Loading,
    write: Annotated[
        bool,
        typer.Option("--write", help="Write what was inferred to NAME.hints.toml, to be edited."),
    ] = False,
) -> None:
    """Say whether a URDF can be used, everything that is wrong with it, and what repairs it."""
    announce(f"reading {urdf}")
    from hexapod_pin.robot.loading.load_options import write_hints
    from hexapod_pin.robot.urdf_report import inspect

    options = loading.options()
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


# `hexapod-pin repair`: write a URDF that can be used, and report what was changed and assumed.

Mass = Annotated[OptionalFloat, typer.Option(help="Total mass of the robot [kg].")]
Density = Annotated[
    OptionalFloat,
    typer.Option(help="Mass over hull volume of links without a mass [kg/m^3]; default: 430."),
]
Effort = Annotated[
    OptionalText,
    typer.Option(help="Torque limit of every joint [N m], or a motor: AX-12A, 'MX-64 at 12 V'."),
]
Velocity = Annotated[
    OptionalText,
    typer.Option(help="Speed limit of every joint [rad/s], or a motor: AX-12A, 'MX-64 at 12 V'."),
]


@with_groups
def repair(
    context: typer.Context,
    file: Annotated[
        str,
        typer.Argument(help="The URDF to repair, or kharagpur or athena; it is not touched."),
    ],
    out: Annotated[Path, typer.Option("-o", "--out", help="The repaired URDF to write.")],
    *,
    mass: Mass = None,
    density: Density = None,
    effort: Effort = None,
    velocity: Velocity = None,
    loading: Loading,
) -> None:
    """Write a URDF that `check` accepts: what is missing, impossible or absurd is replaced.

    Every change is printed. Where `check`, with the same options, would still refuse the file,
    nothing is written.
    """
    announce(f"reading {file}")
    from hexapod_pin.commands.output_files import writable
    from hexapod_pin.robot.robot_source import robot_path

    path = writable("--out", out)
    hints = loading.options()
    options = given(
        mass=mass, density=density, effort=torque_limit(effort), velocity=speed_limit(velocity)
    )
    write_repaired(context, robot_path(file), path, hints, options)


def write_repaired(
    context: typer.Context, file: Path, path: Path, hints: LoadOptions,
    numbers: Mapping[str, float],
) -> None:  # fmt: skip
    """Write a repaired URDF, and print what was changed and assumed.

    Args:
        context: of the command, whose options a refusal names.
        file: URDF, xacro or MJCF file; it is not touched.
        path: absolute path of the file to write.
        hints: how the file is read; its hints file adds to them.
        numbers: fields of `RepairOptions` that are given.

    Raises:
        HexapodError: the file cannot be read or repaired; nothing is written.
    """
    from hexapod_pin.robot.loading.load_options import read_hints
    from hexapod_pin.robot.loading.load_urdf import read_file
    from hexapod_pin.robot.reading.resources import ResourceFinder
    from hexapod_pin.robot.repair import RepairOptions, repair_urdf
    from hexapod_pin.robot.repair.appearance import rebased
    from hexapod_pin.robot.repair.finding import finding_lines
    from hexapod_pin.robot.urdf_report import judged

    hints = hints.over(read_hints(user_path(file)))
    folders = [Path(folder) for folder in hints.package_path]
    read = read_file(file, hints)
    urdf, finder = read.file, read.finder
    if path.exists() and path.samefile(user_path(file)):
        raise ParameterError("--out", str(path), "another file than the one to repair")
    repaired = repair_urdf(urdf, finder, RepairOptions(**numbers))
    written, moved = rebased(repaired.file, finder, path, folders)
    report = judged(read._replace(file=written, finder=ResourceFinder(path, folders)), hints)
    if not report.ok:
        text = "\n".join([f"{file}: no repair for this; nothing is written", *report.refused_lines])
        fail(spelt_in_options(text, option_names(context.command)), FAILED)
    if written is urdf and not read.expanded:
        write_atomically(path, user_path(file).read_bytes())
    else:
        write_atomically(path, written.text)
    done = "" if repaired.changes or moved else ": a copy, nothing to repair"
    echo(f"wrote {path}{done}")
    for line in [
        *(f"note: {text}" for text in read.notes),
        *_report(repaired),
        *(f"changed: {text}" for text in moved),
        *finding_lines(report.found),
    ]:
        echo(line)


def _report(repaired: Repaired) -> list[str]:
    """Return changes, assumptions, options not used, and the masses before and after."""
    from hexapod_pin.robot.repair.repair_urdf import mass_lines

    return [
        *(f"changed: {text}" for text in repaired.changes),
        *(f"assumed: {text}" for text in repaired.assumed),
        *(f"note: {text}" for text in repaired.notes),
        *mass_lines(repaired.masses),
    ]
