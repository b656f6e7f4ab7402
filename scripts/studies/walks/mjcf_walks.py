"""Do exported robots walk in MuJoCo by the exported keyframes as fast as here?"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.control.feasible_gait import default_gait, fit_gait
from hexapod_pin.control.gait import Gait
from hexapod_pin.errors import ParameterError
from hexapod_pin.interchange.mjcf import write_mjcf
from hexapod_pin.robot.robot import Robot, load_robot
from hexapod_pin.robot.robot_source import PACKAGED
from hexapod_pin.scene.scene import Scene, loaded_model
from hexapod_pin.text_table import Table
from studies.study import StudyReport, verdict

RATE = 50.0
"""Keyframes per second [Hz]."""

SPEED_LIMIT = 0.05
"""Largest difference of the speeds over ours [-]."""

STATIC_LIMIT = 1e-9
"""Largest difference of masses, mass matrices and gravity torques over their largest entry [-]."""

ROBOTS = "kharagpur,athena,elkapod.urdf,grasp.urdf,golem.urdf,akrobat.urdf,crab_pyrobolearn.urdf"

STEADY_CYCLES = 2
"""Cycles at the end over which speeds are measured."""


@dataclass(frozen=True)
class MjcfWalk:
    """One robot in MuJoCo and here.

    Attributes:
        name: of the robot or its file.
        mass: of all bodies [kg].
        mass_error: of MuJoCo's total mass, over ours [-].
        matrix_error: of its mass matrix in the standing posture, over the largest entry [-].
        torque_error: of its gravity torques there, over the largest [-].
        gait: that is walked.
        ours: steady speed here [m/s].
        theirs: steady speed in MuJoCo [m/s].
        sag: height of the trunk here less that in MuJoCo, at the end [m].
        drift: distance to the side at the end in MuJoCo less that here [m].
        seconds: wall time in MuJoCo [s].
    """

    name: str
    mass: float
    mass_error: float
    matrix_error: float
    torque_error: float
    gait: Gait
    ours: float
    theirs: float
    sag: float
    drift: float
    seconds: float

    @property
    def difference(self) -> float:
        """Speed in MuJoCo over ours, less 1 [-]."""
        return self.theirs / self.ours - 1.0


def mjcf_walks(folder: Path = Path("urdfs"), robots: str = ROBOTS, cycles: int = 8) -> StudyReport:
    """Export robots with their default gait as MJCF and walk them in MuJoCo.

    Files are looked for in the folder and repaired. MuJoCo begins in the first keyframe of the
    walk; its actuators follow the keyframes' `ctrl`, joined by straight lines.
    """
    rows = []
    for name in robots.split(","):
        source = name if name in PACKAGED else folder / name
        if name not in PACKAGED and not Path(source).is_file():
            raise ParameterError("folder", str(folder), f"a folder with {name}")
        rows.append(walked(name, load_robot(source, repair=name not in PACKAGED), cycles))
        print(f"{name}: {rows[-1].difference:+.2%}", file=sys.stderr)
    about = (
        f"MJCF written by `hp.interchange.write_mjcf` with the default gait, {cycles} cycles, "
        f"{RATE:g} keyframes per second, opened by MuJoCo and walked there with its own contact "
        "law, integrator implicitfast at 1 ms; here: `simulate` with default accuracy, one run. "
        f"Speed: distance over the last {STEADY_CYCLES} cycles. Files are repaired before. "
        f"Limits: {100 * SPEED_LIMIT:g} % in speed, {STATIC_LIMIT:g} in masses, mass matrix and "
        "gravity torques. Sources: [robots' sources](robot_sources.md)."
    )
    return StudyReport("Exported robots in MuJoCo", [about, _speeds(rows), _statics(rows)])


def walked(name: str, robot: Robot, cycles: int) -> MjcfWalk:
    """Export one robot, compare its masses, and walk it in both."""
    import mujoco

    scene, gait = Scene(robot), fit_gait(robot, default_gait(robot)).gait
    length = cycles * gait.cycle_time
    with tempfile.TemporaryDirectory() as folder:
        path = write_mjcf(
            scene, Path(folder) / "robot.xml", controller=gait, duration=length, rate=RATE
        )
        model = mujoco.MjModel.from_xml_path(str(path))
    mass, matrix, torque = static_errors(scene, model)
    begin = time.perf_counter()
    theirs = follow_keyframes(model, length)
    seconds = time.perf_counter() - begin
    trace = hp.simulate(scene, hp.KinematicControl(gait), duration=length, estimate=False)
    steady = STEADY_CYCLES * gait.cycle_time
    since = round((length - steady) / model.opt.timestep)
    first = int(np.searchsorted(trace.time, length - steady - 1e-9))
    return MjcfWalk(
        name, scene.total_mass, mass, matrix, torque, gait,
        ours=_speed(trace.q[[first, -1]], float(trace.time[-1] - trace.time[first])),
        theirs=_speed(theirs[[since, -1]], steady),
        sag=float(trace.q[-1, 2] - theirs[-1, 2]), drift=float(theirs[-1, 1] - trace.q[-1, 1]),
        seconds=seconds,
    )  # fmt: skip


def static_errors(scene: Scene, model: Any) -> tuple[float, float, float]:
    """Return the relative errors of total mass, mass matrix and gravity torques in keyframe 0.

    MuJoCo's velocity of the base is linear in world axes, as ours here: the base stands level.
    """
    import mujoco
    import pinocchio as pin

    data, ours = mujoco.MjData(model), loaded_model(scene)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    names = scene.robot.joint_names
    order = [*range(6), *(int(model.joint(name).dofadr[0]) for name in names)]
    state = scene.robot.stand()
    # in MuJoCo the armature is part of the mass matrix; these scenes have no motors
    theirs = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, theirs)
    theirs = theirs[np.ix_(order, order)]
    matrix = np.triu(pin.crba(ours, ours.createData(), state.q))
    gravity = pin.computeGeneralizedGravity(ours, ours.createData(), state.q)
    mass = sum(body.mass for body in ours.inertias)
    errors = (np.triu(theirs) - matrix, data.qfrc_bias[order] - gravity)
    return (
        abs(float(model.body_mass.sum()) / mass - 1.0),
        float(np.abs(errors[0]).max() / np.abs(matrix).max()),
        float(np.abs(errors[1]).max() / np.abs(gravity).max()),
    )


def follow_keyframes(model: Any, duration: float) -> Array:
    """Walk a model by the keyframes after the first; return the base's places (steps + 1, 3)."""
    import mujoco

    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 1)
    step, steps = model.opt.timestep, round(duration / model.opt.timestep)
    at = np.arange(1, steps + 1) * step
    keys, targets = model.key_time[1:], model.key_ctrl[1:]
    control = np.stack([np.interp(at, keys, joint) for joint in targets.T], axis=-1)
    places = np.empty((steps + 1, 3))
    places[0] = data.qpos[:3]
    for k, row in enumerate(control):
        data.ctrl[:] = row
        mujoco.mj_step(model, data)
        places[k + 1] = data.qpos[:3]
    return places


def _speed(ends: Array, duration: float) -> float:
    return float(np.linalg.norm(ends[1, :2] - ends[0, :2]) / duration)


def _speeds(rows: Sequence[MjcfWalk]) -> Table:
    cells = [
        (
            row.name, row.gait.name, f"{row.gait.speed:.4f}", f"{row.ours:.4f}",
            f"{row.theirs:.4f}", f"{100 * row.difference:+.2f}", f"{1e3 * row.sag:.1f}",
            f"{1e3 * row.drift:.0f}", f"{row.seconds:.1f}",
            verdict(abs(row.difference) <= SPEED_LIMIT),
        )
        for row in rows
    ]  # fmt: skip
    head = (
        "robot", "gait", "nominal [m/s]", "here [m/s]", "MuJoCo [m/s]", "difference [%]",
        "trunk lower by [mm]", "drift to the left [mm]", "wall [s]", "verdict",
    )  # fmt: skip
    return Table("Speed", head, cells)


def _statics(rows: Sequence[MjcfWalk]) -> Table:
    cells = [
        (
            row.name, f"{row.mass:.4g}", *(f"{x:.1e}" for x in errors),
            verdict(max(errors) <= STATIC_LIMIT),
        )
        for row in rows
        for errors in [(row.mass_error, row.matrix_error, row.torque_error)]
    ]  # fmt: skip
    head = ("robot", "mass [kg]", "error of mass", "mass matrix", "gravity torques", "verdict")
    return Table("Masses in the standing posture", head, cells)
