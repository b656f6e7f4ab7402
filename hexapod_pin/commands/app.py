"""The commands: `hexapod-pin walk | view | budget | check | contact | bench | verify`.

Exit status: 0 done, 2 refused or failed with one message on stderr, 130 interrupted by Ctrl-C.
Only what a command needs is imported, when it runs, so that `--help` is quick.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn, Optional

import typer
from typer.core import TyperGroup

from hexapod_pin.errors import HexapodError, ParameterError, SimulationInterrupted

if TYPE_CHECKING:
    from hexapod_pin.results.trace import Trace
    from hexapod_pin.robot.robot import Robot

FAILED = 2
INTERRUPTED = 130


class _Commands(TyperGroup):
    """Tells Ctrl-C apart from typer's own silent exit."""

    def invoke(self, ctx: Any) -> Any:
        """Run the command that was asked for."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt as error:
            text = "interrupted; what was written before is whole"
            raise SimulationInterrupted(text, None) from error


app = typer.Typer(
    cls=_Commands,
    help="Walk a hexapod's URDF on compliant feet: the torque of every joint, a trace, a playback. "
    "SI units, but angles are in degrees on the command line.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # units stand in square brackets, which rich would take for markup
)

# typer reads these annotations at run time, on Python 3.10 too: Optional[...], not `| None`.
RobotName = Annotated[str, typer.Argument(help="kharagpur, athena, or the path of a URDF.")]
TracePath = Annotated[Path, typer.Argument(help="A file that `walk` left (walk.nc).")]
Feet = Annotated[
    Optional[str],  # noqa: UP045
    typer.Option(help="Names of the foot links, separated by commas, where not found by name."),
]
FootRadius = Annotated[
    Optional[float],  # noqa: UP045
    typer.Option(help="Radius of all foot spheres [m]; default: the URDF's own."),
]


def _version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"hexapod-pin {version('hexapod-pin')}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print and exit.")
    ] = False,
) -> None:
    pass


@app.command()
def walk(
    robot: RobotName,
    gait: Annotated[str, typer.Option(help="tripod, ripple, tetrapod (S2) or wave.")] = "tetrapod",
    stroke: Annotated[
        Optional[float],  # noqa: UP045
        typer.Option(help="[m]; default 0.14, or 80 % of the largest that fits where that is less"),
    ] = None,
    cycle: Annotated[float, typer.Option(help="Cycle time [s].")] = 2.4,
    duty: Annotated[
        Optional[float],  # noqa: UP045
        typer.Option(help="Share of the cycle on the ground; default: the gait's own."),
    ] = None,
    lift: Annotated[
        Optional[float],  # noqa: UP045
        typer.Option(help="Height of the swing foot [m]; default: the gait's own."),
    ] = None,
    heading: Annotated[float, typer.Option(help="Direction of travel, left > 0 [degrees].")] = 0.0,
    turn: Annotated[float, typer.Option(help="Yaw rate, left > 0 [degrees/s].")] = 0.0,
    duration: Annotated[float, typer.Option(help="Simulated time [s].")] = 10.0,
    contact: Annotated[
        str,
        typer.Option(
            help="accurate: exact restitution, stick-slip; s1: Hertz + tanh friction; s1-printed: "
            "linear (all three assumed rubber); s2: ADAMS IMPACT."
        ),
    ] = "accurate",
    mu: Annotated[
        Optional[float],  # noqa: UP045
        typer.Option(help="Friction coefficient (s2: the static one, ratio kept)."),
    ] = None,
    kp: Annotated[
        Optional[float],  # noqa: UP045
        typer.Option(help="Servo stiffness [N m/rad]; default assumed from the effort."),
    ] = None,
    kd: Annotated[
        Optional[float],  # noqa: UP045
        typer.Option(help="Servo damping [N m s/rad]; default assumed from the effort."),
    ] = None,
    accuracy: Annotated[
        Optional[float],  # noqa: UP045
        typer.Option(help="Error in positions to keep [m and rad]; default 1e-4."),
    ] = None,
    method: Annotated[
        Optional[str],  # noqa: UP045
        typer.Option(
            help="extrapolated-euler (the default), ndf, dop853; with fixed steps robust, "
            "implicit-euler, rk4."
        ),
    ] = None,
    step: Annotated[
        Optional[float],  # noqa: UP045
        typer.Option(help="Step of a fixed-step method [s]; alone it means implicit-euler."),
    ] = None,
    sample: Annotated[
        Optional[float],  # noqa: UP045
        typer.Option(help="Time between samples [s]; default 2 ms, with fixed steps 1 ms."),
    ] = None,
    out: Annotated[Path, typer.Option(help="Trace file to write.")] = Path("walk.nc"),
    html: Annotated[Path, typer.Option(help="Playback file to write.")] = Path("walk.html"),
    no_html: Annotated[bool, typer.Option("--no-html", help="Write no playback.")] = False,
    feet: Feet = None,
    foot_radius: FootRadius = None,
) -> None:
    """Walk a robot; print its torque table; leave a trace and a playback."""
    from hexapod_pin.commands.walk_options import (
        contact_for,
        distinct,
        feasible_gait,
        foot_names,
        given,
        progress_bar,
        run_saving,
        run_summary,
        servo_for,
        writable,
    )
    from hexapod_pin.control.kinematic import KinematicControl
    from hexapod_pin.robot.robot import load_robot
    from hexapod_pin.simulation.run import simulate
    from hexapod_pin.simulation.scene import Scene

    trace_path = writable("--out", out)
    html_path = None if no_html else writable("--html", html)
    distinct(trace_path, html_path)
    loaded = load_robot(robot, feet=foot_names(feet), foot_radius=foot_radius)
    chosen, why = feasible_gait(
        loaded, gait, stroke, cycle_time=cycle, heading=math.radians(heading),
        turn_rate=math.radians(turn), **given(duty=duty, lift=lift),
    )  # fmt: skip
    servo = servo_for(loaded, kp, kd)
    scene = Scene(loaded, contact=contact_for(contact, mu), servo=servo)
    typer.echo(
        f"{loaded.name}: {loaded.total_mass:.5g} kg, {len(loaded.legs)} legs. {loaded.provenance}\n"
        f"gait {chosen.name}: stroke {chosen.stroke:.4g} m ({why}), cycle {chosen.cycle_time:g} s, "
        f"duty {chosen.duty:.4g}, lift {chosen.lift:g} m: {chosen.speed:.4g} m/s"
    )
    _notes(loaded)
    with progress_bar(f"walking {duration:g} s") as progress:
        trace = run_saving(
            lambda: simulate(
                scene, KinematicControl(chosen), duration=duration,
                accuracy=accuracy, method=method, step=step, sample=sample,
                progress=progress,
            ),
            trace_path,
        )  # fmt: skip
    typer.echo(run_summary(trace))
    if html_path is not None:
        from hexapod_pin.view import write_html

        write_html(trace, html_path)
    _print_budget(trace)
    for path in (trace_path, html_path):
        if path is not None:
            typer.echo(f"wrote {path}")


def _print_budget(trace: Trace) -> None:
    """Print the torque table, or why a walk this short has none."""
    from hexapod_pin.results.torque_budget import torque_budget

    try:
        typer.echo("\n" + torque_budget(trace).table() + "\n")
    except ParameterError as error:
        typer.echo(f"no torque table: {error}", err=True)


def _notes(robot: Robot) -> None:
    """Print what the loader dropped or changed."""
    for note in robot.notes:
        typer.echo(f"note: {note}")


@app.command()
def view(
    trace: TracePath,
    speed: Annotated[float, typer.Option(help="Simulated time over wall-clock time.")] = 1.0,
    port: Annotated[int, typer.Option(help="Port on this machine; 0 takes a free one.")] = 0,
    no_browser: Annotated[
        bool, typer.Option("--no-browser", help="Print the address only.")
    ] = False,
) -> None:
    """Show a trace in the browser (meshcat) until Ctrl-C."""
    from hexapod_pin.results.trace import load_trace
    from hexapod_pin.view import view as show

    show(load_trace(trace), speed=speed, port=port, open_browser=not no_browser)


@app.command()
def budget(
    trace: TracePath,
    json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
) -> None:
    """Print the torque budget of a trace."""
    from hexapod_pin.results.torque_budget import torque_budget
    from hexapod_pin.results.trace import load_trace

    found = torque_budget(load_trace(trace))
    typer.echo(found.to_json() if json else found.table())


@app.command()
def check(urdf: RobotName, feet: Feet = None) -> None:
    """Say whether a URDF can be used, what was read from it, and what is assumed."""
    from hexapod_pin.commands.walk_options import foot_names
    from hexapod_pin.robot.urdf_report import inspect

    report = inspect(urdf, feet=foot_names(feet))
    if not report.ok:
        _fail(str(report), FAILED)
    typer.echo(str(report))
    if not report.legs:
        typer.echo("note: it can stand, but not walk: it has no six legs of three joints")


@app.command()
def contact(
    law: Annotated[
        Optional[str],  # noqa: UP045
        typer.Argument(help="accurate, s1, s1-printed, s2, or a kind such as kelvin-voigt."),
    ] = None,
    parameters: Annotated[
        Optional[list[str]],  # noqa: UP045
        typer.Argument(help="Of a kind: name=value, SI; assumed where not given."),
    ] = None,
    restitution: Annotated[
        bool, typer.Option("--restitution", help="Requested against delivered, all laws.")
    ] = False,
    mass: Annotated[float, typer.Option(help="Of the free impact [kg].")] = 0.5,
    speed: Annotated[float, typer.Option(help="Of the free impact [m/s].")] = 0.1,
    out: Annotated[
        Optional[Path],  # noqa: UP045
        typer.Option(help="Figure to write: .png, .svg or .pdf; default contact.png."),
    ] = None,
) -> None:
    """Look at a contact law: its bounce, its restitution, its friction; print and draw them."""
    from hexapod_pin.commands.contact_report import (
        NO_FIGURE,
        figure,
        named_law,
        report,
        restitution_table,
    )
    from hexapod_pin.commands.walk_options import writable
    from hexapod_pin.view.contact_figure import require_ending

    if restitution:
        typer.echo(restitution_table())
    if law is None:
        if not restitution:
            raise ParameterError("LAW", law, "named, or --restitution given", "See --help.")
        return
    found = named_law(law, parameters or ())
    path = writable("--out", out or Path("contact.png"))
    require_ending(path)
    typer.echo(report(found, mass=mass, speed=speed))
    if figure(found, path, mass=mass, speed=speed):
        typer.echo(f"wrote {path}")
    elif out is None:
        typer.echo(NO_FIGURE, err=True)
    else:
        _fail(NO_FIGURE, FAILED)


@app.command()
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
        Optional[str],  # noqa: UP045
        typer.Option(help="Names, separated by commas; default: all."),
    ] = None,
    advise: Annotated[
        Optional[float],  # noqa: UP045
        typer.Option(help="Only say how to reach this accuracy at least cost [m, rad]."),
    ] = None,
    peers: Annotated[
        bool, typer.Option("--peers", help="MuJoCo, Drake and PyBullet too, where installed.")
    ] = False,
    quick: Annotated[bool, typer.Option("--quick", help="Fewer settings.")] = False,
    rounds: Annotated[int, typer.Option(help="Timed rounds; the median counts.")] = 5,
    out: Annotated[
        Optional[Path],  # noqa: UP045
        typer.Option(help="Report to write: .md, .csv or .json."),
    ] = None,
    plot: Annotated[
        Optional[Path],  # noqa: UP045
        typer.Option(help="Figure to write: .png, .svg or .pdf."),
    ] = None,
    duration: Annotated[
        Optional[float],  # noqa: UP045
        typer.Option(help="Simulated time [s]; default: the scene's own, or one cycle."),
    ] = None,
    sample: Annotated[
        Optional[float],  # noqa: UP045
        typer.Option(help="Time between compared samples [s]."),
    ] = None,
    gait: Annotated[
        Optional[str],  # noqa: UP045
        typer.Option(help="tripod, ripple, tetrapod, wave or hold; default tetrapod."),
    ] = None,
    stroke: Annotated[
        Optional[float],  # noqa: UP045
        typer.Option(help="[m]; default as in `walk`."),
    ] = None,
    cycle: Annotated[
        Optional[float],  # noqa: UP045
        typer.Option(help="Cycle time [s]; default 2.4."),
    ] = None,
    contact: Annotated[
        Optional[str],  # noqa: UP045
        typer.Option(help="accurate, s1, s1-printed or s2; default accurate."),
    ] = None,
    mu: Annotated[Optional[float], typer.Option(help="Friction coefficient.")] = None,  # noqa: UP045
    kp: Annotated[
        Optional[float],  # noqa: UP045
        typer.Option(help="Servo stiffness [N m/rad]."),
    ] = None,
    kd: Annotated[
        Optional[float],  # noqa: UP045
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
        gait=gait, stroke=stroke, cycle=cycle, contact=contact, mu=mu, kp=kp, kd=kd, feet=feet,
        foot_radius=foot_radius, duration=duration, sample=sample,
    )  # fmt: skip
    names = None if methods is None else [name.strip() for name in methods.split(",")]
    plan = ComparisonSettings(names, rounds, quick, peers)
    command.bench(command.Request(scenes, wish, plan, advise, out, plot))


def _hard(quick: bool, out: Path | None) -> None:
    from hexapod_pin.validation.cases.command import hard

    if not hard(quick=quick, out=out):
        _fail("a hard case failed; see the table", FAILED)


@app.command()
def verify(
    everything: Annotated[
        bool, typer.Option("--all", help="MuJoCo, where installed, and the hard cases too.")
    ] = False,
    only: Annotated[
        Optional[str],  # noqa: UP045
        typer.Option(help="Names of checks, separated by commas; default: every check."),
    ] = None,
    out: Annotated[
        Optional[Path],  # noqa: UP045
        typer.Option(help="Markdown file to write the table to."),
    ] = None,
) -> None:
    """Compare the formulations with each other and with closed forms; fail where two disagree."""
    from hexapod_pin.validation.checks.command import verify as run

    run(everything=everything, only=only, out=out)


def main(argv: Sequence[str] | None = None) -> NoReturn:
    """Run a command and exit; every error of this package becomes one message.

    Args:
        argv: arguments without the program's name; None takes those of the process.
    """
    try:
        app(args=None if argv is None else list(argv), prog_name="hexapod-pin")
    except SimulationInterrupted as error:
        _fail(str(error), INTERRUPTED)
    except HexapodError as error:
        _fail(str(error), FAILED)
    sys.exit(0)


def _fail(message: str, status: int) -> NoReturn:
    typer.echo(f"hexapod-pin: {message}", err=True)
    sys.exit(status)
