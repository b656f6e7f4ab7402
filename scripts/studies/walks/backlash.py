"""What free play in the gears does to a walk: tracking, torque peaks, motors' verdicts."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.control import default_gait, fit_gait
from hexapod_pin.control.joint_trajectory import planned_motion
from hexapod_pin.robot.loading.load_options import LoadOptions
from hexapod_pin.text_table import Table
from hexapod_pin.view.figure_file import write_svg
from studies.study import RESULTS, StudyReport

SHOWN = "lf_tibia_joint"
"""Joint of the figure."""

TEXT = """`walk kharagpur --motor {motor}` at {voltage:g} V: default gait ({gait}), default servos \
and contact, {cycles:g} cycles, numbers of the last whole one. Play is from edge to edge, in every \
joint; edges are as stiff as the default stops ({stops}), the motor's rotor is on the servo's side \
of the gap, and so is its encoder (docs/drive.md). Method extrapolated-euler at accuracy \
{accuracy:g}; the last rows, at a third of it, show by how much the numbers are uncertain: impacts \
make the finer numbers of a walk with play sensitive."""


def backlash(
    *, motor: str = "MX-64", voltage: float = 12.0, cycles: int = 3, accuracy: float = 1e-3,
    plays: str = "0,0.25,0.5,1", checked: str = "0,0.5", figure: Path = RESULTS / "backlash.svg",
) -> StudyReport:  # fmt: skip
    """Walk kharagpur with the play of every gear, in degrees, and compare with none."""
    record, ratio = hp.load_catalog().supplied(motor, voltage)
    plain = hp.load_robot("kharagpur")
    gait = fit_gait(plain, default_gait(plain), None).gait
    servo = hp.Servo.for_robot(plain).model_copy(update={"motor": record.motor(ratio)})
    rows = []
    curves: dict[float, tuple[Array, Array, Array]] = {}
    runs = [(float(play), accuracy) for play in plays.split(",")]
    runs += [(float(play), accuracy / 3.0) for play in checked.split(",") if play]
    for play, bound in runs:
        options = LoadOptions(backlash=math.radians(play) or None)
        scene = hp.Scene(hp.load_robot("kharagpur", options=options), servo=servo)
        control = hp.KinematicControl(gait)
        trace = hp.simulate(
            scene, control, duration=cycles * gait.cycle_time, accuracy=bound, estimate=False,
            method="extrapolated-euler", sample=0.005,
        )  # fmt: skip
        found = numbers(trace, scene.robot, control, record)
        rows.append([f"{play:g}", f"{bound:.1g}", *found["texts"]])
        curves.setdefault(play, found["curve"])
    draw(curves, figure)
    head = [
        "play, deg", "accuracy", "RMS error of links, deg", "largest, deg",
        "RMS error of encoders, deg", "travel, mm/cycle", "largest torque RMS, N m",
        "largest torque, N m", "foot force peak, N", "impacts, whole run", "walk", motor,
        "peak over its line", "current RMS, A", "winding heat, W",
    ]  # fmt: skip
    named = f"{gait.name}, stroke {gait.stroke:.3g} m, cycle {gait.cycle_time:.3g} s"
    text = TEXT.format(
        motor=motor, voltage=voltage, gait=named, cycles=cycles, accuracy=accuracy,
        stops=hp.JointStops.for_robot(plain).describe(),
    )  # fmt: skip
    few, many = rows[0], rows[len(plays.split(",")) - 1]
    finding = (
        f"From {few[0]} to {many[0]} degrees of play the links' RMS error goes from {few[2]} to "
        f"{many[2]} degrees and that of the encoders from {few[4]} to {many[4]}; the largest "
        f"torque RMS from {few[6]} to {many[6]} N m, the largest torque from {few[7]} to {many[7]} "
        f"N m. The robot: {few[10]}, then {many[10]}; {motor}: {few[11]}, then {many[11]}."
    )
    picture = f"![Error and torque of {SHOWN} over the last cycle]({figure.name})"
    return StudyReport("Walking with backlash", [text, Table("", head, rows), finding, picture])


def numbers(
    trace: hp.Trace, robot: hp.Robot, control: hp.KinematicControl, record: Any
) -> dict[str, Any]:
    """Return the texts of a row, and the curves of the shown joint over the last cycle."""
    cycle = control.gait.cycle_time
    last = trace.time >= trace.time[-1] - cycle - 1e-9
    index = [robot.joint_index(x) for x in robot.joint_names if x not in robot.gaps]
    link: Array = trace.q[:, 7:][:, index].copy()
    names = [robot.joint_names[k] for k in index]
    for gap, joint in robot.gaps.items():
        link[:, names.index(joint)] += trace.q[:, 7 + robot.joint_index(gap)]
    plan = planned_motion(control.plan(robot, float(trace.time[-1])), trace.time)[0][:, index]
    error, encoder = (np.degrees(x - plan)[last] for x in (link, trace.q[:, 7:][:, index]))
    found = trace.summary
    hits = sum(one.stop_count for one in trace.limits if one.joint in robot.gaps)
    walk = hp.walk_verdict(trace)
    use = hp.motor_budget(trace, record, kinds=("coxa", "femur", "tibia"))
    shown, torque = names.index(SHOWN), trace.torque[last][:, robot.joint_index(SHOWN)]
    return {
        "texts": [
            f"{np.sqrt(np.mean(error**2)):.3f}", f"{np.abs(error).max():.2f}",
            f"{np.sqrt(np.mean(encoder**2)):.3f}",
            f"{1e3 * (trace.q[-1, 0] - trace.q[np.argmax(last), 0]):.1f}",
            f"{found.torque_rms[index].max():.3f}",
            f"{np.abs(found.torque_peak[index]).max():.2f}", f"{found.force_peak.max():.1f}",
            str(hits), walk.reason or "walks",
            "passes" if use.passes else "; ".join(use.reasons), f"{use.robot.peak_use:.2f}",
            f"{use.robot.current_rms:.2f}", f"{use.robot.winding_heat:.2f}",
        ],
        "curve": (trace.time[last] - trace.time[-1] + cycle, error[:, shown], torque),
    }  # fmt: skip


def draw(curves: dict[float, tuple[Array, Array, Array]], path: Path) -> None:
    """Draw error and torque of the shown joint, a line for each play [deg]."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 5.0), layout="constrained")
    error_axes, torque_axes = figure.subplots(2, 1, sharex=True)
    for play, (time, error, torque) in curves.items():
        error_axes.plot(time, error, label=f"{play:g} deg of play", linewidth=1.0)
        torque_axes.plot(time, torque, linewidth=1.0)
    error_axes.set_ylabel("link less set-point [deg]")
    torque_axes.set_ylabel("motor torque [N m]")
    torque_axes.set_xlabel(f"time in the last cycle [s], {SHOWN}")
    error_axes.legend(loc="best", fontsize="small")
    write_svg(figure, path)
