"""Torque against stroke and cycle time: the two sweeps of [S2] on one grid."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import tomli_w
from numpy.typing import ArrayLike, NDArray

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array
from hexapod_pin.control.arc_walk import ArcWalk
from hexapod_pin.control.feasible_gait import default_gait, named_gait
from hexapod_pin.control.gait import Gait
from hexapod_pin.control.kinematic import KinematicControl
from hexapod_pin.control.leg_group import leg_group
from hexapod_pin.errors import GaitError, ParameterError
from hexapod_pin.results.grid_columns import GridRecord
from hexapod_pin.results.joint_budget import joint_kinds
from hexapod_pin.results.phase_torque import PHASES, scheduled_phase_torque
from hexapod_pin.results.summary import Summary
from hexapod_pin.results.torque_budget import torque_budget
from hexapod_pin.results.torque_map import GRID, TorqueMap
from hexapod_pin.results.trace import Trace
from hexapod_pin.simulation.case import Case
from hexapod_pin.simulation.methods import DEFAULT_ACCURACY
from hexapod_pin.simulation.run_outcome import contact_names, named_joint_kinds, package_versions
from hexapod_pin.study.grid_runs import (
    Cases,
    Numbers,
    Place,
    check_counts,
    grid_arrays,
    grid_axis,
    grid_results,
)
from hexapod_pin.study.runs.measure import Measure
from hexapod_pin.study.runs.runner import Runner, RunOptions, run_study
from hexapod_pin.study.sweep.base_case import walk_case, walk_times

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from hexapod_pin.control.feedback import FeedbackController
    from hexapod_pin.control.joint_trajectory import Controller
    from hexapod_pin.robot.robot import Robot
    from hexapod_pin.scene.scene import Scene

    AnyController = Controller | FeedbackController

STROKES = tuple(0.01 * k for k in range(3, 15))
"""Strokes up to [S2]'s 0.14 m [m]; the range is *assumed*."""

CYCLE_TIMES = tuple(2.4 * 2.0 ** (k / 4.0) for k in range(-7, 5))
"""Cycle times around [S2]'s 2.4 s [s], from 0.71 to 4.8 s; the range is *assumed*."""

PHASE_SAMPLES = 960
"""Least samples of a cycle: enough for the RMS of a phase in which a foot comes down hard."""

CHECKED_POINTS = 5
"""Points that are repeated at a tenth of the accuracy."""


@checked
def torque_map(
    scene: Scene,
    walk: str | Callable[[float, float], AnyController] = "arc",
    *,
    gait: Gait | None = None,
    strokes: ArrayLike = STROKES,
    cycle_times: ArrayLike = CYCLE_TIMES,
    cycles: int | None = None,
    accuracy: float = DEFAULT_ACCURACY,
    check: int = CHECKED_POINTS,
    **how: Unpack[RunOptions],
) -> TorqueMap:
    """Run a walk at every stroke and cycle time, and return its joint torques.

    All is taken over the cycle that repeats, or over whole cycles after a start-up. Peaks are
    those of accepted steps; values by phase are computed from samples,
    960 of a cycle or more, at most 5 ms apart.

    Args:
        scene: what is walked on.
        walk: "arc" ([S2]'s motion, `ArcWalk`, amplitude arcsin(stroke / 2R)), "straight"
            (`KinematicControl`), or what returns the controller of a stroke [m] and cycle time [s].
        gait: order, duty and lift of the steps of the two kinds; None: `default_gait`, [S2]'s
            tetrapod with six legs.
        strokes: ascending [m].
        cycle_times: ascending [s].
        cycles: whole cycles after a start-up from standing; None: the first that repeats.
        accuracy: as in `simulate` [m and rad].
        check: points that are run again at a tenth of the accuracy: the map's stated error.
        **how: store, threads, workers, progress: see `RunOptions`.

    Raises:
        ParameterError: an argument is out of range. A point that cannot be walked is NaN.
        StudyInterrupted: Ctrl-C; `.result` holds what was done.
        HexapodError: as of `run_study`.

    Example:
        >>> scene = Scene(load_robot("kharagpur"), contact=Contact.preset("s2"))
        >>> found = torque_map(scene, "arc", strokes=[0.1, 0.14], cycle_times=[1.2, 2.4])
        >>> found.of_kind("torque_peak", "femur")
    """
    check_counts(1 if cycles is None else cycles, check)
    axes = (grid_axis("strokes", strokes), grid_axis("cycle_times", cycle_times))
    make = _maker(scene.robot, walk, gait)
    controllers = {
        (i, j): _made(make, float(stroke), float(period))
        for i, stroke in enumerate(axes[0])
        for j, period in enumerate(axes[1])
    }
    cases: dict[Place, Case | Exception] = {}
    for place, control in controllers.items():
        duration, sample = walk_times(float(axes[1][place[1]]), cycles or 1, PHASE_SAMPLES)
        cases[place] = (
            control
            if isinstance(control, Exception)
            else walk_case(
                Case(scene, control, accuracy=accuracy, duration=duration, sample=sample), cycles
            )
        )
    record = _record(scene, walk, controllers, accuracy, cycles)
    return run_study(mapped, scene, axes, cases, check, record, **how)


def mapped(
    run: Runner, scene: Scene, axes: tuple[Array, Array], cases: Cases, check: int,
    record: GridRecord,
) -> TorqueMap:  # fmt: skip
    """Run the points of a map; the study behind `torque_map`."""

    def speed(place: Place) -> tuple[int, float]:
        return 0, axes[0][place[0]] / axes[1][place[1]]

    found, changes = grid_results(run, cases, MAP_POINT, speed, check)
    return _map(scene, axes, found, changes, record)


def _maker(
    robot: Robot, walk: str | Callable[[float, float], AnyController], gait: Gait | None
) -> Callable[[float, float], AnyController]:
    """Return what makes the controller of a stroke [m] and a cycle time [s]."""
    if not isinstance(walk, str):
        if gait is not None:
            raise ParameterError("gait", gait.name, "left out with a walk of your own")
        return walk
    base = named_gait(robot, default_gait(robot)) if gait is None else gait
    leg_group(robot).fitted(base)
    if walk == "straight":
        return lambda stroke, period: KinematicControl(
            base.with_changes(stroke=stroke, cycle_time=period)
        )
    if walk != "arc":
        raise ParameterError("walk", walk, '"arc", "straight" or what makes a controller')
    longest = 2.0 * float(ArcWalk(base).path(robot).radius.mean())

    def arc(stroke: float, period: float) -> AnyController:
        if stroke >= longest:
            text = (
                f"arc walk: a stroke of {stroke:g} m; legs of this robot give below {longest:g} m."
            )
            raise GaitError(text, "stroke", longest)
        table = base.with_changes(cycle_time=period)
        return ArcWalk(table, amplitude=float(np.arcsin(stroke / longest)))

    return arc


def _made(
    make: Callable[[float, float], AnyController], stroke: float, period: float
) -> AnyController | Exception:
    """Return a controller, or the error of a gait that cannot be."""
    try:
        return make(stroke, period)
    except GaitError as error:
        return error


def _numbers(case: Case, run: Trace | Summary) -> Numbers:
    """Return the numbers of a run."""
    assert isinstance(run, Trace)
    summary = run.summary
    budget = torque_budget(summary)
    return {
        "torque_peak": np.abs(summary.torque_peak),
        "torque_p99": summary.torque_p99,
        "torque_rms": summary.torque_rms,
        "speed_peak": np.abs(summary.speed_peak),
        "positive_energy": summary.positive_energy,
        "negative_energy": summary.negative_energy,
        "normal_impulse": summary.normal_impulse,
        "distance": budget.distance,
        "measured_speed": budget.measured_speed,
        "nominal_speed": budget.nominal_speed,
        "cost_of_transport": budget.cost_of_transport,
        "cost_of_transport_positive": budget.cost_of_transport_positive,
        **_phases(case, run),
    }


MAP_POINT = Measure("hexapod_pin.study.torque_map:MAP_POINT", 1, "trace", dict, _numbers)
"""The numbers of a point of a map."""


def _phases(case: Case, trace: Trace) -> Numbers:
    """Return torques by phase; nothing of a controller without a gait."""
    gait = getattr(case.controller, "gait", None)
    if gait is None:
        return {}
    leg, legged = _legs(case.scene.robot)
    middle = 0.5 * (trace.time[:-1] + trace.time[1:])
    found = scheduled_phase_torque(trace, gait.feet_down(middle / gait.cycle_time)[:, leg])
    blank: Array = np.where(legged, 0.0, np.nan)
    return {
        "phase_torque_peak": found.peak + blank,
        "phase_torque_rms": found.rms + blank,
        "phase_time": found.time + blank,
        "phase_torque_rms_error": found.torque_rms_error + blank,
    }


def _legs(robot: Robot) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Return the leg of each joint, and whether it belongs to one. Shape (n,) each."""
    index = leg_group(robot).joint_index
    leg, legged = np.zeros(len(robot.joint_names), dtype=np.intp), np.zeros(len(robot.joint_names))
    leg[index.ravel()] = np.repeat(np.arange(len(index)), index.shape[1])
    legged[index.ravel()] = 1.0
    return leg, legged > 0.0


def _map(
    scene: Scene, axes: tuple[Array, Array], found: Mapping[Place, Numbers | str], check: Any,
    record: GridRecord,
) -> TorqueMap:  # fmt: skip
    joints, feet = scene.robot.joint_names, contact_names(scene)
    sizes = {
        "stroke": len(axes[0]), "cycle_time": len(axes[1]), "joint": len(joints),
        "foot": len(feet), "phase": len(PHASES),
    }  # fmt: skip
    filled = grid_arrays(found, TorqueMap.empty(sizes), [sizes[name] for name in GRID])
    return TorqueMap(
        stroke=axes[0], cycle_time=axes[1], joint_names=joints, foot_names=feet,
        joint_kinds=joint_kinds(joints, len(scene.robot.feet), named_joint_kinds(scene.robot)),
        check=check, run=record, **filled,
    )  # fmt: skip


def _record(
    scene: Scene, walk: Any, controllers: Any, accuracy: float, cycles: int | None
) -> GridRecord:
    """Return how a map came about."""
    first = next((c for c in controllers.values() if hasattr(c, "to_dict")), None)
    named = walk if isinstance(walk, str) else getattr(walk, "__name__", type(walk).__name__)
    return GridRecord(
        robot=scene.robot.name,
        walk=named,
        scene=scene.to_toml(),
        controller="" if first is None else tomli_w.dumps(first.to_dict()),
        accuracy=accuracy,
        cycles=cycles or 1,
        assumed=scene.assumed,
        versions=package_versions(),
    )
