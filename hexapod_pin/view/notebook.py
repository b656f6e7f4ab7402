"""What notebooks show of a trace, a robot, a scene and results: facts, tables, and the playback."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.errors import HexapodError
from hexapod_pin.results.motor_selection import MotorSelection
from hexapod_pin.results.run_record import RobotFacts, RunCase, RunRecord
from hexapod_pin.results.torque_budget import TorqueBudget
from hexapod_pin.results.trace import Trace
from hexapod_pin.results.walk_answer import rounded, walk_answer
from hexapod_pin.robot.robot import Robot
from hexapod_pin.scene.robot_file import robot_to_dict
from hexapod_pin.scene.scene import Scene, standing_on
from hexapod_pin.view.html import write_html
from hexapod_pin.view.report import Block, Cell, Column, Facts, Paragraph, Table
from hexapod_pin.view.selection_tables import choice_table, ranking_tables, verdict_texts

if TYPE_CHECKING:
    from hexapod_pin.results.joint_budget import JointBudget

HEIGHT = 480
"""Of an embedded playback [pixels]."""

STYLE = (
    ".hexapod-pin dl { display: grid; grid-template-columns: max-content 1fr; gap: 2px 12px; } "
    ".hexapod-pin dd { margin: 0; } .hexapod-pin th, .hexapod-pin td { padding: 2px 8px; "
    "text-align: right; } .hexapod-pin .wide { text-align: left; } "
    ".hexapod-pin .scroll { overflow-x: auto; } "
    ".hexapod-pin .bad { color: #9c1f17; font-weight: bold; }"
)
"""Of these elements alone: the rest of the notebook keeps its own."""

RANKED = 10
"""Motors of a ranking that are shown."""

Shown = Trace | Robot | Scene | TorqueBudget | MotorSelection


@checked
def notebook_html(thing: Shown) -> str:
    """Return what a notebook shows, as HTML that needs no other file; all texts are escaped.

    A trace with its playback, a robot and a scene with a picture of the robot standing; where that
    cannot be drawn, the reason. Results are tables.

    Args:
        thing: what is shown.
    """
    page = ""
    if isinstance(thing, Trace):
        blocks, page = _of_trace(thing), _framed(thing)
    elif isinstance(thing, Robot):
        blocks, page = _of_robot(thing), _standing(Scene(thing))
    elif isinstance(thing, Scene):
        blocks, page = _of_scene(thing), _standing(thing)
    elif isinstance(thing, TorqueBudget):
        blocks = _of_budget(thing)
    else:
        blocks = _of_selection(thing)
    body = "".join(block.html() for block in blocks)
    return f'<div class="hexapod-pin"><style>{STYLE}</style>{body}{page}</div>'


def _framed(trace: Trace) -> str:
    """Return the playback of a trace in a frame, or why there is none."""
    try:
        with tempfile.TemporaryDirectory() as folder:
            path = write_html(trace, Path(folder) / "walk.html")
            text = path.read_text(encoding="utf-8")
    except HexapodError as error:
        return Paragraph(f"No playback: {error}").html()
    look = f"width: 100%; height: {HEIGHT}px; border: 1px solid #ccc"
    return f'<iframe style="{look}" title="playback" srcdoc="{escape(text)}"></iframe>'


def _standing(scene: Scene) -> str:
    """Return a picture of the robot in its standing posture on the ground, or why there is none."""
    robot = scene.robot
    try:
        state = standing_on(scene, robot.posture)
    except HexapodError as error:
        return Paragraph(f"No picture: {error}").html()
    record = RunRecord(
        robot=RobotFacts(
            name=robot.name, provenance=robot.provenance, digest=robot.digest, urdf=robot.urdf,
            total_mass=scene.total_mass, foot_radius=tuple(foot.radius for foot in robot.feet),
        ),
        gravity=scene.gravity,
        assumed=scene.assumed,
        case=RunCase(scene.settings, robot_to_dict(robot), {"kind": "standing"}, {}),
    )  # fmt: skip
    nothing = dict.fromkeys(
        ("torque", "q_ref", "v_ref", "foot_position", "foot_force", "foot_gap", "com", "energy")
    )
    return _framed(Trace(
        time=np.zeros(1), q=state.q[None], v=state.v[None], counters={},
        joint_names=robot.joint_names, foot_names=tuple(foot.name for foot in robot.feet),
        run=record, **nothing,  # type: ignore[arg-type]
    ))  # fmt: skip


def _of_trace(trace: Trace) -> Iterator[Block]:
    try:
        headline = walk_answer(trace).headline
    except HexapodError as failed:
        headline = str(failed)
    error = trace.error_estimate
    numerics = trace.run.numerics
    yield Paragraph(headline)
    yield Facts((
        ("Trace", f"{len(trace.time)} samples from {trace.time[0]:g} to {trace.time[-1]:g} s; "
                  f"recorded {', '.join(trace.recorded)}"),
        ("Robot", f"{trace.run.robot.name}, {trace.run.robot.mass:.4g} kg, "
                  f"{len(trace.joint_names)} joints, {len(trace.foot_names)} feet"),
        ("Method", f"{numerics.method or 'not known'}, largest error in positions "
                   + (f"{error:.2g} m or rad" if error == error else "not known")),  # noqa: PLR0124
        ("Assumed", "; ".join(trace.run.assumed) or "nothing"),
    ))  # fmt: skip


def _of_robot(robot: Robot) -> Iterator[Block]:
    yield Facts((
        ("Robot", f"{robot.name}, {robot.total_mass:.4g} kg"),
        ("Legs", ", ".join(leg.name for leg in robot.legs) or "none"),
        ("Feet", f"{len(robot.feet)}, of radius "
                 + ", ".join(f"{1e3 * r:.3g}" for r in sorted({f.radius for f in robot.feet}))
                 + " mm"),
        ("From", robot.provenance or robot.source),
        ("Doubts", "; ".join(robot.doubts) or "none"),
    ))  # fmt: skip
    columns = (
        Column("Joint", wide=True), Column("Lower [°]"), Column("Upper [°]"),
        Column("Standing [°]"), Column("Effort [N m]"), Column("Rate [rad/s]"),
    )  # fmt: skip
    rows = []
    for j, name in enumerate(robot.joint_names):
        scale = 180.0 / np.pi if robot.turning[j] else 1.0
        angles = (robot.lower[j], robot.upper[j], robot.posture[j])
        rows.append((
            Cell(name), *(Cell(f"{scale * value:.4g}") for value in angles),
            Cell(f"{robot.effort_limit[j]:.4g}"), Cell(f"{robot.velocity_limit[j]:.4g}"),
        ))  # fmt: skip
    slides = "" if robot.turning.all() else "Of joints that slide: m, N and m/s."
    yield Table(columns, tuple(rows), note=slides)


def _of_scene(scene: Scene) -> Iterator[Block]:
    contact = scene.contact
    yield Facts((
        ("Robot", f"{scene.robot.name}, {scene.total_mass:.4g} kg with its loads"),
        ("Ground", repr(scene.terrain)),
        ("Contact", f"{contact.normal!r}; {contact.friction!r}"),
        ("Servos", scene.servos.describe()),
        ("Loads", "; ".join(map(repr, scene.loads)) or "none"),
        ("Assumed", "; ".join(scene.assumed) or "nothing"),
    ))  # fmt: skip


def _of_budget(budget: TorqueBudget) -> Iterator[Block]:
    window = budget.window
    cycles = "" if window.cycles is None else f", {window.cycles} whole cycles"
    yield Paragraph(
        f"Torque budget of {budget.robot_name}, {window.start:.4g} to {window.end:.4g} s{cycles}"
    )
    per = "window" if window.cycles is None else "cycle"
    columns = (
        Column("Joints", wide=True), Column("Peak [N m]"), Column("of joint", wide=True),
        Column("at [s]"), Column("99 % [N m]"), Column("RMS [N m]"), Column("Limit [N m]"),
        Column("Speed [rad/s]"), Column("Power [W]"), Column(f"Energy per {per} [J]"),
    )  # fmt: skip
    rows = []
    for kind in budget.kinds:
        peak = kind.peak
        limit = f"{peak.effort_limit:.4g}" if np.isfinite(peak.effort_limit) else "none"
        rows.append((
            Cell(kind.kind), _torque(peak), Cell(peak.joint), Cell(f"{peak.torque_peak_time:.4g}"),
            Cell(rounded(kind.p99.torque_p99, kind.p99.torque_p99_error)),
            Cell(rounded(kind.rms.torque_rms, kind.rms.torque_rms_error)), Cell(limit),
            Cell(f"{kind.speed.speed_peak:.3g}"), Cell(f"{kind.power.power_peak:.3g}"),
            Cell(f"{kind.absolute_energy:.3g}"),
        ))  # fmt: skip
    assumed = "; ".join(budget.assumed)
    yield Table(columns, tuple(rows), note=f"Assumed: {assumed}." if assumed else "")


def _torque(row: JointBudget) -> Cell:
    """Return a peak with its error; marked where the joint reaches its limit."""
    text = rounded(row.torque_peak, row.torque_peak_error)
    return Cell(f"{text} *", "bad") if row.at_limit else Cell(text)


def _of_selection(selection: MotorSelection) -> Iterator[Block]:
    for text in verdict_texts(selection):
        yield Paragraph(text)
    if selection.choice is None and not selection.candidates:
        return
    yield choice_table(selection.best)
    if selection.candidates:
        yield from ranking_tables(selection, selection.candidates[:RANKED])
