"""`hexapod-pin walk`: walk a robot, print its torque table, leave a trace and a playback."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hexapod_pin.commands.options import (
    Feet,
    FootRadius,
    NoHtml,
    OptionalFloat,
    OptionalPath,
    OptionalText,
    Quick,
    Record,
    RobotName,
    Threads,
    TraceOut,
    Verdict,
    comma_list,
    foot_names,
    given,
)

if TYPE_CHECKING:
    from hexapod_pin.control.gait import Gait
    from hexapod_pin.robot.robot import Robot


def walk(
    robot: RobotName,
    gait: Annotated[
        OptionalText,
        typer.Option(
            help="tripod, ripple, tetrapod (S2) or wave; default tetrapod; 4, 5 or 7 legs: wave."
        ),
    ] = None,
    stroke: Annotated[
        OptionalFloat,
        typer.Option(help="[m]; default 0.14, or 80 % of the largest that fits where that is less"),
    ] = None,
    cycle: Annotated[float, typer.Option(help="Cycle time [s].")] = 2.4,
    duty: Annotated[
        OptionalFloat,
        typer.Option(help="Share of the cycle on the ground; default: the gait's own."),
    ] = None,
    lift: Annotated[
        OptionalFloat,
        typer.Option(help="Height of the swing foot [m]; default: the gait's own."),
    ] = None,
    heading: Annotated[float, typer.Option(help="Direction of travel, left > 0 [degrees].")] = 0.0,
    turn: Annotated[float, typer.Option(help="Yaw rate, left > 0 [degrees/s].")] = 0.0,
    duration: Annotated[float, typer.Option(help="Simulated time [s].")] = 10.0,
    contact: Annotated[
        str,
        typer.Option(
            help="accurate: exact restitution, stick-slip; s1: Hertz + tanh friction; s1-printed: "
            "linear (all three assumed rubber); s2: ADAMS IMPACT; soil: feet sink into sand."
        ),
    ] = "accurate",
    mu: Annotated[
        OptionalFloat,
        typer.Option(help="Friction coefficient (s2: the static one, ratio kept)."),
    ] = None,
    kp: Annotated[
        OptionalFloat,
        typer.Option(help="Servo stiffness [N m/rad]; default assumed from the effort."),
    ] = None,
    kd: Annotated[
        OptionalFloat,
        typer.Option(help="Servo damping [N m s/rad]; default assumed from the effort."),
    ] = None,
    prescribed: Annotated[
        bool,
        typer.Option(
            "--prescribed",
            help="Joints follow the plan exactly; torques by inverse dynamics, no servo.",
        ),
    ] = False,
    accuracy: Annotated[
        OptionalFloat,
        typer.Option(help="Error in positions to keep [m and rad]; default 1e-4."),
    ] = None,
    method: Annotated[
        OptionalText,
        typer.Option(
            help="extrapolated-euler (the default), ndf, dop853; with fixed steps robust, "
            "implicit-euler, rk4."
        ),
    ] = None,
    step: Annotated[
        OptionalFloat,
        typer.Option(help="Step of a fixed-step method [s]; alone it means implicit-euler."),
    ] = None,
    sample: Annotated[
        OptionalFloat,
        typer.Option(help="Time between samples [s]; default 2 ms, with fixed steps 1 ms."),
    ] = None,
    out: TraceOut = Path("walk.nc"),
    html: Annotated[Path, typer.Option(help="Playback file to write.")] = Path("walk.html"),
    no_html: NoHtml = False,
    save_case: Annotated[
        OptionalPath, typer.Option(help="Write the case too, for `hexapod-pin run`.")
    ] = None,
    verdict: Verdict = False,
    quick: Quick = False,
    threads: Threads = 1,
    feet: Feet = None,
    foot_radius: FootRadius = None,
    record: Record = None,
) -> None:
    """Walk a robot; print its torque table; leave a trace and a playback."""
    from hexapod_pin.commands.case_report import run_and_report
    from hexapod_pin.commands.output_files import distinct, writable, writable_trace
    from hexapod_pin.control.feasible_gait import feasible_gait
    from hexapod_pin.control.kinematic import KinematicControl
    from hexapod_pin.control.named_gait import default_gait
    from hexapod_pin.drive.servo import Servo
    from hexapod_pin.errors import ParameterError
    from hexapod_pin.ground.contact import Contact
    from hexapod_pin.robot.robot import load_robot
    from hexapod_pin.simulation.case import Case
    from hexapod_pin.simulation.scene import Scene

    trace_path = writable_trace("--out", out)
    html_path = None if no_html else writable("--html", html)
    distinct(trace_path, html_path)
    case_path = None if save_case is None else writable("--save-case", save_case)
    loaded = load_robot(robot, feet=foot_names(feet), foot_radius=foot_radius)
    chosen, why = feasible_gait(
        loaded, gait or default_gait(loaded), stroke, cycle_time=cycle,
        heading=math.radians(heading), turn_rate=math.radians(turn), **given(duty=duty, lift=lift),
    )  # fmt: skip
    if prescribed and not (kp is None and kd is None):
        raise ParameterError("--kp, --kd", kp or kd, "left out with --prescribed: no servo acts")
    servo = Servo.for_robot(loaded, kp=kp, kd=kd)
    laws = Contact.preset(contact).with_mu(mu)
    scene = Scene(loaded, contact=laws, servo=servo, prescribed=prescribed)
    _print_plan(loaded, chosen, why)
    case = Case(
        scene, KinematicControl(chosen), duration=duration,
        accuracy=accuracy, method=method, step=step, sample=sample,
        record=comma_list(record),
    )  # fmt: skip
    if case_path is not None:
        typer.echo(f"wrote {case.save(case_path)}")
    title = f"walking {duration:g} s"
    run_and_report(
        case, title, trace_path, html_path, verdict=verdict, quick=quick, threads=threads
    )


def _print_plan(robot: Robot, gait: Gait, stroke_source: str) -> None:
    """Print what will walk and how, what the loader changed, and legs that nearly meet."""
    from hexapod_pin.control.leg_clearance import leg_clearance

    typer.echo(
        f"{robot.name}: {robot.total_mass:.5g} kg, {len(robot.legs)} legs. {robot.provenance}\n"
        f"gait {gait.name}: stroke {gait.stroke:.4g} m ({stroke_source}), "
        f"cycle {gait.cycle_time:g} s, duty {gait.duty:.4g}, lift {gait.lift:g} m: "
        f"{gait.speed:.4g} m/s"
    )
    for note in (*robot.notes, *leg_clearance(robot, gait).notes):
        typer.echo(f"note: {note}")
