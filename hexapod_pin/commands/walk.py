"""The command `walk` walks a robot, and `run` runs a case that was written before."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hexapod_pin.commands.loading_options import WalkLoading
from hexapod_pin.commands.options import (
    CatalogFile,
    Force,
    ImportCode,
    MotorName,
    NoHtml,
    OptionalFloat,
    OptionalPath,
    OptionalText,
    Record,
    RobotName,
    Shown,
    TraceOut,
    Voltage,
    chosen_motor,
    comma_list,
    given,
    import_code,
    with_groups,
)
from hexapod_pin.commands.scene_options import (
    TERRAIN_HELP,
    backlash_doubt,
    chosen_servo,
    heading_doubt,
    loads_as_options,
    named_slowness,
    posture_doubt,
    read_loads,
    read_terrain_option,
    require_early,
    require_seconds,
    slope_doubt,
    turn_doubt,
)
from hexapod_pin.commands.terminal import announce, echo

if TYPE_CHECKING:
    from hexapod_pin.control.body_motion import BodyMotion
    from hexapod_pin.control.feasible_gait import FittedGait
    from hexapod_pin.control.gait import Gait
    from hexapod_pin.robot.robot import Robot

LEAST_DURATION = 10.0
"""Simulated time where none is given and no cycle repeats, at least [s]."""

WALKED_CYCLES = 4
"""Cycles that it holds at least: two to start and two steady ones."""

LEAST_TORQUE, LONGEST_STROKE = "least-torque", "longest-stroke"
"""Values of --posture that ask for a search instead of giving angles."""

TALLEST = 100.0
"""Height over the standing one from which it is in millimetres [-]."""

SHORT_STROKE = 0.75
"""Stroke over the default one below which the first line has it, and a posture is tried [-]."""


@with_groups
def walk(
    robot: RobotName,
    *,
    gait: Annotated[
        OptionalText,
        typer.Option(
            help="tripod, ripple, tetrapod (S2) or wave; default tetrapod; 4, 5 or 7 legs: wave."
        ),
    ] = None,
    stroke: Annotated[
        OptionalFloat,
        typer.Option(
            help="[m]; default 0.14, scaled by the length of the legs, or 80 % of the longest that "
            "fits."
        ),
    ] = None,
    cycle_time: Annotated[
        OptionalFloat,
        typer.Option(
            help="Cycle time [s]; default 2.4, scaled by the root of the legs' length; longer "
            "where joints are slower than that."
        ),
    ] = None,
    speed: Annotated[
        OptionalFloat,
        typer.Option(help="Of the walk [m/s]: sets the cycle time; with --cycle-time the stroke."),
    ] = None,
    duty: Annotated[
        OptionalFloat,
        typer.Option(help="Share of the cycle on the ground; default: the gait's own."),
    ] = None,
    lift: Annotated[
        OptionalFloat,
        typer.Option(
            help="Height of the swing foot [m]; default 0.02, scaled by the length of the legs."
        ),
    ] = None,
    height: Annotated[
        OptionalFloat,
        typer.Option(help="Of the trunk's origin above level ground [m]; default: as it stands."),
    ] = None,
    heading: Annotated[float, typer.Option(help="Direction of travel, left > 0 [degrees].")] = 0.0,
    turn_rate: Annotated[float, typer.Option(help="Yaw rate, left > 0 [degrees/s].")] = 0.0,
    duration: Annotated[
        OptionalFloat,
        typer.Option(
            help="Simulated time from standing [s]; default: until a cycle repeats, starting in "
            "motion; where none does 10 s, or four cycles where that is more."
        ),
    ] = None,
    contact: Annotated[
        str,
        typer.Option(
            help="accurate: exact restitution, stick-slip; s1: Hertz + tanh friction; s1-printed: "
            "linear (all three assumed rubber); s2: ADAMS IMPACT; soil: feet sink into sand."
        ),
    ] = "accurate",
    terrain: Annotated[OptionalText, typer.Option(help=TERRAIN_HELP)] = None,
    payload: Annotated[
        OptionalText, typer.Option(help="MASS[@LINK], such as 1kg or 0.5kg@lf_tibia [kg].")
    ] = None,
    push: Annotated[
        OptionalText, typer.Option(help="FORCE@TIME: to the left on the trunk, such as 20N@1s.")
    ] = None,
    lost_leg: Annotated[
        OptionalText,
        typer.Option(help="LEG[,LEG][@TIME]: drives give no torque, such as rf,lm@2s."),
    ] = None,
    mu: Annotated[
        OptionalFloat,
        typer.Option(help="Friction coefficient (s2: the static one, at the same ratio)."),
    ] = None,
    kp: Annotated[
        OptionalFloat,
        typer.Option(help="Servo stiffness [N m/rad]; default assumed, from effort or weight."),
    ] = None,
    kd: Annotated[
        OptionalFloat,
        typer.Option(help="Servo damping [N m s/rad]; default assumed, from effort or weight."),
    ] = None,
    motor: MotorName = None,
    voltage: Voltage = None,
    catalog: CatalogFile = None,
    prescribed: Annotated[
        bool,
        typer.Option(
            "--prescribed",
            help="Joints follow the plan exactly; torques by inverse dynamics, no servo.",
        ),
    ] = False,
    accuracy: Annotated[
        OptionalFloat,
        typer.Option(
            help="Largest error in positions [m and rad]; default 1e-4, with 1 % in torques."
        ),
    ] = None,
    torque_accuracy: Annotated[
        OptionalText,
        typer.Option(help='Largest error in torques instead [N m], or a share such as "1 %".'),
    ] = None,
    no_estimate: Annotated[
        bool,
        typer.Option(
            "--no-estimate", help="Run once: the error of the whole run is not estimated."
        ),
    ] = False,
    method: Annotated[
        OptionalText,
        typer.Option(
            help="ndf (the default; extrapolated-euler where a run cannot know its error), "
            "extrapolated-euler, dop853; with fixed steps robust, implicit-euler, rk4."
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
    shown: Shown,
    force: Force = False,
    loading: WalkLoading,
    record: Record = None,
) -> None:
    """Walk a robot; print its torque table; leave a trace and a playback."""
    announce(f"reading {robot}")
    from hexapod_pin.commands.case_report import (
        CaseToReport,
        following_command,
        length_of,
        run_and_report,
    )
    from hexapod_pin.commands.output_files import PAGES, writable, writable_trace
    from hexapod_pin.commands.refusal import doubtful_file
    from hexapod_pin.control.feasible_gait import default_gait, fit_gait
    from hexapod_pin.control.gait_refusal import leg_clearance, overlaps
    from hexapod_pin.control.kinematic import KinematicControl
    from hexapod_pin.errors import ParameterError
    from hexapod_pin.ground.contact import Contact
    from hexapod_pin.ground.terrain import Flat
    from hexapod_pin.robot.robot import load_robot
    from hexapod_pin.scene.scene import Scene
    from hexapod_pin.simulation.case import Case
    from hexapod_pin.simulation.run_settings import chosen_limits
    from hexapod_pin.simulation.steady_walk import until_steady

    trace_path = writable_trace("--out", out)
    html_path = None if no_html else writable("--html", html, PAGES)
    case_path = None if save_case is None else writable("--save-case", save_case)
    motors = chosen_motor(motor, voltage, catalog)
    posture = loading.posture
    searched = posture in (LEAST_TORQUE, LONGEST_STROKE)
    if not (posture is None or searched or "=" in posture):
        allowed = f"JOINT=DEGREES,..., {LEAST_TORQUE} or {LONGEST_STROKE}"
        raise ParameterError("--posture", posture, allowed)
    options = (replace(loading, posture=None) if searched else loading).options()
    loaded = load_robot(robot, options=options)
    announce("planning the gait")
    name = gait or default_gait(loaded)
    require_seconds(cycle_time, step, duration, force)
    numbers = given(cycle_time=cycle_time, duty=duty, lift=lift, speed=speed)
    turning = {"heading": math.radians(heading), "turn_rate": math.radians(turn_rate)}
    radians = posture_doubt(posture)
    with doubtful_file(loaded, radians):
        fitted = fit_gait(loaded, name, stroke, **turning, **numbers)
    posture_lines: list[str] = []
    if searched:
        announce(f"searching the posture: {posture}")
        found, lines = _searched_posture(loaded, fitted, posture == LEAST_TORQUE)
        loaded = load_robot(robot, options=options, posture=found)
        posture_lines = [f"posture {posture}: {line}" for line in lines]
        if posture == LONGEST_STROKE:
            fitted = fit_gait(loaded, name, stroke, **turning, **numbers)
    chosen, body = fitted.gait, _raised(loaded, fitted.gait, height)
    cycles = max(WALKED_CYCLES, math.ceil(LEAST_DURATION / chosen.cycle_time))
    time = cycles * chosen.cycle_time if duration is None else duration
    if prescribed and not (kp is None and kd is None):
        raise ParameterError("--kp, --kd", kp or kd, "left out with --prescribed: no servo acts")
    servo = chosen_servo(loaded, kp, kd, force)
    if motors.motor is not None:
        servo = servo.model_copy(update={"motor": motors.motor})
    laws = Contact.preset(contact).with_mu(mu)
    with loads_as_options():
        scene = Scene(
            loaded, contact=laws, servo=servo, prescribed=prescribed,
            terrain=read_terrain_option(terrain) or Flat(),
            loads=read_loads(loaded, payload, push, lost_leg),
        )  # fmt: skip
    case = Case(
        scene, KinematicControl(chosen, body=body), duration=time,
        accuracy=accuracy, torque_accuracy=_number_or_share(torque_accuracy),
        estimate=not no_estimate, method=method, step=step, sample=sample,
        record=comma_list(record), limits=chosen_limits(None, force),
    )  # fmt: skip
    if duration is None:
        case = until_steady(case)
    require_early(scene.loads, time)
    if case_path is not None:
        echo(f"wrote {case.save(case_path)}", err=shown.json)

    def repaired() -> Case:
        mended = load_robot(robot, options=options.model_copy(update={"repair": True}))
        own = chosen_servo(mended, kp, kd, force).model_copy(update={"motor": servo.motor})
        return replace(case, scene=replace(scene, robot=mended, servo=own))

    def changed(name: str, value: float) -> Case:
        other = chosen.with_changes(**{name: value})
        return replace(case, controller=KinematicControl(other, body=body))

    near = leg_clearance(loaded, chosen).notes
    short = chosen.stroke < SHORT_STROKE * fitted.wanted
    posture_help = short and posture is None and not shown.quick
    if posture_help:
        announce("searching a posture that leaves a longer stroke")
    slow, shortage = named_slowness(loaded, fitted.slowness), fitted.shortage if short else ""
    cautions = [
        heading_doubt(heading), turn_doubt(turn_rate), slope_doubt(terrain), radians,
        backlash_doubt(loading.backlash), *overlaps(loaded, chosen), slow, shortage,
    ]  # fmt: skip
    job = CaseToReport(
        case=case,
        title=f"walking {length_of(case)}",
        about=[*_plan_lines(loaded, fitted, near), *posture_lines, *motors.lines],
        remarks=[
            *_remarks(loaded, fitted, near),
            *posture_lines[:1],
            *([_posture_help(loaded, fitted)] if posture_help else []),
        ],
        assumed=motors.assumed,
        caution=", ".join(filter(None, cautions)),
        motor=motors.record,
        repaired=repaired if loaded.doubts and not options.repair else None,
        changed=changed,
        following=following_command(robot, trace_path, repair=loading.repair),
    )
    run_and_report(job, trace_path, html_path, shown)


def _number_or_share(text: str | None) -> float | str | None:
    """Return a number where the text is one."""
    try:
        return text if text is None else float(text)
    except ValueError:
        return text


def _plan_lines(robot: Robot, fitted: FittedGait, near: Sequence[str]) -> list[str]:
    """Return what walks and how, what the loader changed, and legs that come near each other."""
    from hexapod_pin.control.feasible_gait import DEFAULT, GIVEN
    from hexapod_pin.robot.urdf_report import folded_texts

    gait = fitted.gait
    cycle, lift = (
        "" if reason in (DEFAULT, GIVEN) else f" ({reason})"
        for reason in (fitted.cycle_time, fitted.lift)
    )
    found = [
        f"{robot.name}: {robot.total_mass:.5g} kg, {len(robot.legs)} legs. {robot.provenance}",
        f"gait {gait.name}: stroke {gait.stroke:.4g} m ({fitted.stroke}), "
        f"cycle {gait.cycle_time:g} s{cycle}, duty {gait.duty:.4g}, lift {gait.lift:.4g} m{lift}: "
        f"{gait.speed:.4g} m/s, Froude number {fitted.froude:.2g} (v^2 / (g L))",
    ]
    lines = {
        "repaired": robot.repaired,
        "inferred": robot.inferred,
        "note": (*robot.notes, *near),
    }
    for kind, texts in lines.items():
        found += [f"{kind}: {text}" for text in folded_texts(texts)]
    return found


def _remarks(robot: Robot, fitted: FittedGait, near: Sequence[str]) -> list[str]:
    """Return where the gait is not the usual one, or the file was changed, a few words each."""
    found = [*fitted.remarks, *near[:1]]
    if robot.repaired:
        count = len(robot.repaired)
        found.append(f"{count} repair{'s' * (count != 1)} (--full)")
    return found


def _searched_posture(
    robot: Robot, fitted: FittedGait, torque: bool
) -> tuple[Mapping[str, float], list[str]]:
    """Return the posture of least torque or of the longest stroke, and what to print of it."""
    if torque:
        from hexapod_pin.control.posture import least_torque_posture

        least = least_torque_posture(robot, fitted.gait)
        return least.posture, least.lines()
    from hexapod_pin.control.stroke_posture import longest_stroke_posture

    longest = longest_stroke_posture(robot, fitted.gait.with_changes(stroke=fitted.wanted))
    return longest.posture, [longest.line]


def _posture_help(robot: Robot, fitted: FittedGait) -> str:
    """Return whether another posture leaves a longer stroke, tried."""
    from hexapod_pin.control.stroke_posture import longest_stroke_posture
    from hexapod_pin.errors import HexapodError

    try:
        found = longest_stroke_posture(robot, fitted.gait.with_changes(stroke=fitted.wanted))
    except HexapodError:  # legs of two joints
        return ""
    return f"tried --posture {LONGEST_STROKE}: it {found.line}" if found.helps else found.line


def _raised(robot: Robot, gait: Gait, height: float | None) -> BodyMotion | None:
    """Return the motion that keeps the trunk at a height [m]; None without one.

    Raises:
        ParameterError: the legs do not reach it; with the height that they do reach.
        GaitError: the robot cannot walk the gait as it stands either.
    """
    if height is None:
        return None
    from hexapod_pin.control.body_motion import BodyMotion
    from hexapod_pin.control.gait_refusal import refuse_impossible
    from hexapod_pin.errors import GaitError, ParameterError

    standing = float(robot.stand().q[2])
    motion = BodyMotion(height=height - standing)
    try:
        refuse_impossible(robot, gait, motion)
    except GaitError as error:
        if error.quantity != "height" or error.limit is None:
            raise
        side = "at most" if height > standing else "at least"
        allowed = (
            f"{side} {standing + error.limit:.4g} m in this gait ({standing:.4g} as it stands)"
        )
        hint = f"mm? {height:g} mm are {1e-3 * height:g} m." if height > TALLEST * standing else ""
        raise ParameterError("--height", height, allowed, hint) from None
    return motion


# `hexapod-pin run`: run a case that was written before, to the same bits.


@with_groups
def run(
    case: Annotated[Path, typer.Argument(help="A file that `walk --save-case` left (case.toml).")],
    *,
    out: TraceOut = Path("run.nc"),
    html: Annotated[Path, typer.Option(help="Playback file to write.")] = Path("run.html"),
    no_html: NoHtml = False,
    shown: Shown,
    force: Force = False,
    code: ImportCode = None,
) -> None:
    """Run a case from its file; print its torque table; leave a trace and a playback."""
    announce(f"reading {case}")
    from hexapod_pin.commands.case_report import CaseToReport, length_of, run_and_report
    from hexapod_pin.commands.output_files import PAGES, writable, writable_trace
    from hexapod_pin.simulation.case import load_case
    from hexapod_pin.simulation.run_settings import chosen_limits

    trace_path = writable_trace("--out", out)
    html_path = None if no_html else writable("--html", html, PAGES)
    import_code(code)
    found = load_case(case).with_defaults(limits=chosen_limits(None, force))
    robot = found.scene.robot
    about = [
        f"{robot.name}: {robot.total_mass:.5g} kg. {robot.provenance}",
        f"case {case}: {length_of(found)}, digest {found.digest}",
    ]
    job = CaseToReport(found, f"running {length_of(found)}", about)
    run_and_report(job, trace_path, html_path, shown)
