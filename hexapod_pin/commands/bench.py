"""`hexapod-pin bench`: speed against error, other engines, hard cases."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Optional

import typer

from hexapod_pin.commands.options import (
    Feet,
    FootRadius,
    OptionalFloat,
    OptionalPath,
    OptionalText,
    foot_names,
)
from hexapod_pin.commands.status import FAILED, fail
from hexapod_pin.errors import ParameterError


def bench(
    scenes: Annotated[
        Optional[list[str]],  # noqa: UP045
        typer.Argument(
            help="walk, stand, hc40-soft, hc40-mid, hc40-stiff; a scene file (.toml); a robot: its "
            "name or the path of its URDF."
        ),
    ] = None,
    hard: Annotated[
        bool,
        typer.Option(
            "--hard", help="The hard cases, random extremes and the honesty study instead."
        ),
    ] = False,
    methods: Annotated[
        OptionalText,
        typer.Option(help="Names, separated by commas; default: all."),
    ] = None,
    advise: Annotated[
        OptionalFloat,
        typer.Option(help="Only say how to reach this accuracy at least cost [m, rad]."),
    ] = None,
    peers: Annotated[
        bool, typer.Option("--peers", help="MuJoCo, Drake and PyBullet too, where installed.")
    ] = False,
    quick: Annotated[bool, typer.Option("--quick", help="Fewer settings.")] = False,
    rounds: Annotated[int, typer.Option(help="Timed rounds; the median counts.")] = 5,
    out: Annotated[
        OptionalPath,
        typer.Option(help="Report to write: .md, .csv or .json."),
    ] = None,
    plot: Annotated[
        OptionalPath,
        typer.Option(help="Figure to write: .png, .svg or .pdf."),
    ] = None,
    duration: Annotated[
        OptionalFloat,
        typer.Option(help="Simulated time [s]; default: the scene's own, or one cycle."),
    ] = None,
    sample: Annotated[
        OptionalFloat,
        typer.Option(help="Time between compared samples [s]."),
    ] = None,
    gait: Annotated[
        OptionalText,
        typer.Option(help="tripod, ripple, tetrapod, wave or hold; default tetrapod."),
    ] = None,
    stroke: Annotated[
        OptionalFloat,
        typer.Option(help="[m]; default as in `walk`."),
    ] = None,
    cycle: Annotated[
        OptionalFloat,
        typer.Option(help="Cycle time [s]; default 2.4."),
    ] = None,
    contact: Annotated[
        OptionalText,
        typer.Option(help="accurate, s1, s1-printed or s2; default accurate."),
    ] = None,
    mu: Annotated[OptionalFloat, typer.Option(help="Friction coefficient.")] = None,
    kp: Annotated[
        OptionalFloat,
        typer.Option(help="Servo stiffness [N m/rad]."),
    ] = None,
    kd: Annotated[
        OptionalFloat,
        typer.Option(help="Servo damping [N m s/rad]."),
    ] = None,
    feet: Feet = None,
    foot_radius: FootRadius = None,
) -> None:
    """Measure speed against error on a scene, every method and other engines."""
    if hard:
        return _hard(quick, out)
    if not scenes:
        raise ParameterError("SCENE", None, "named, or --hard given", "See --help.")
    from hexapod_pin.benchmark import command
    from hexapod_pin.benchmark.comparison import ComparisonSettings
    from hexapod_pin.benchmark.scene_options import Wish

    wish = Wish(
        gait=gait, stroke=stroke, cycle=cycle, contact=contact, mu=mu, kp=kp, kd=kd,
        feet=None if feet is None else tuple(foot_names(feet) or ()),
        foot_radius=foot_radius, duration=duration, sample=sample,
    )  # fmt: skip
    names = None if methods is None else [name.strip() for name in methods.split(",")]
    plan = ComparisonSettings(names, rounds, quick, peers)
    command.bench(command.Request(scenes, wish, plan, advise, out, plot))


def _hard(quick: bool, out: Path | None) -> None:
    from hexapod_pin.validation.cases.command import hard

    if not hard(quick=quick, out=out):
        fail("a hard case failed; see the table", FAILED)
