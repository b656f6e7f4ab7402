"""What gaits cost at equal speed and step height."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import tomli_w
from numpy.typing import ArrayLike

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array
from hexapod_pin.control.feasible_gait import DEFAULT_STROKE
from hexapod_pin.control.gait import Gait, gaits_for
from hexapod_pin.control.kinematic import KinematicControl
from hexapod_pin.control.leg_group import leg_group
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.gait_energy import GRID, GaitEnergy
from hexapod_pin.results.grid_columns import GridRecord
from hexapod_pin.results.summary import Summary
from hexapod_pin.results.torque_budget import torque_budget
from hexapod_pin.scene.scene import Scene
from hexapod_pin.simulation.case import Case
from hexapod_pin.simulation.methods import DEFAULT_ACCURACY
from hexapod_pin.simulation.run_outcome import package_versions
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
from hexapod_pin.study.torque_map import CHECKED_POINTS

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from hexapod_pin.control.feedback import FeedbackController
    from hexapod_pin.control.joint_trajectory import Controller

    AnyController = Controller | FeedbackController

STEP_HEIGHT = 0.02
"""Lift of the swing feet [m], *assumed*: that of `Gait`."""


SPEEDS = tuple(0.03 * k for k in range(1, 11))
"""Speeds up to 0.3 m/s [m/s], *assumed*: kharagpur's wave 5/6 ends below 0.12."""


@checked
def study_gaits(legs: int = 6) -> dict[str, Gait]:
    """Return the gaits that are compared where none are given, by name, for a number of legs."""
    if legs != 6:
        return {name: Gait.by_name(name, legs=legs) for name in gaits_for(legs)}
    return {
        "tripod": Gait.tripod(),
        "ripple": Gait.ripple(),
        "tetrapod": Gait.tetrapod(),
        "wave 3/4": Gait.wave(3 / 4),
        "wave 5/6": Gait.wave(5 / 6),
    }


@checked
def gait_energy(
    scenes: Scene | Mapping[str, Scene],
    gaits: Mapping[str, Gait] | None = None,
    speeds: ArrayLike = SPEEDS,
    *,
    lift: float = STEP_HEIGHT,
    stroke: float | None = None,
    cycle_time: float | None = None,
    copper_loss: float | None = None,
    make_controller: Callable[[Gait], AnyController] = KinematicControl,
    cycles: int | None = None,
    accuracy: float = DEFAULT_ACCURACY,
    check: int = CHECKED_POINTS,
    **how: Unpack[RunOptions],
) -> GaitEnergy:
    """Run every gait at every speed on every scene, and return what it costs.

    Gaits of different duty walk one speed v with different strokes or cycle times. By default the
    stroke is the same for all, [S2]'s 0.14 m, and cycle_time = stroke / (duty v); with `cycle_time`
    that is the same, and stroke = v duty cycle_time.

    Args:
        scenes: one, or several by name, such as {"servo": ..., "prescribed": ...}.
        gaits: order and duty of the steps by name; None: `study_gaits`, tripod, ripple,
            tetrapod, wave 3/4 and wave 5/6 with six legs.
        speeds: ascending [m/s].
        lift: lift of the swing feet [m].
        stroke: of all gaits [m]; None: 0.14 m, unless a cycle time is given.
        cycle_time: of all gaits [s].
        copper_loss: electrical loss of a joint over torque^2 [W/(N m)^2]; None: no-load speed over
            stall torque of its motor, which is R / (k N)^2 of a DC motor without other losses, or,
            without a motor, velocity limit over effort limit of the URDF (*assumed*).
        make_controller: makes the controller of a gait.
        cycles: whole cycles after a start-up from standing; None: the first that repeats.
        accuracy: as in `simulate` [m and rad].
        check: points of each scene that are run again at a tenth of the accuracy: the stated error,
            and by it which gaits tie.
        **how: store, threads, workers, progress: see `RunOptions`.

    Raises:
        ParameterError: an argument is out of range, or both a stroke and a cycle time are given. A
            point that cannot be walked is NaN.
        GaitError: a robot without legs that a gait can move, or a gait for another number of legs.
        StudyInterrupted: Ctrl-C; `.result` holds what was done.
        HexapodError: as of `run_study`.

    Example:
        >>> found = gait_energy(Scene(load_robot("kharagpur")), speeds=[0.05, 0.1])
        >>> print(found.table())
    """
    check_counts(1 if cycles is None else cycles, check)
    named = _named(scenes)
    legs = [leg_group(scene.robot) for scene in named.values()]
    tables = study_gaits(len(legs[0].legs)) if gaits is None else dict(gaits)
    if not tables:
        raise ParameterError("gaits", gaits, "at least one gait by its name")
    for own, table in itertools.product(legs, tables.values()):
        own.fitted(table)
    axis = grid_axis("speeds", speeds)
    loss = {name: _copper_losses(scene, copper_loss) for name, scene in named.items()}
    cases: dict[tuple[int, ...], Case | Exception] = {}
    for g, table in enumerate(tables.values()):
        for k, speed in enumerate(axis):
            gait = _at_speed(table, float(speed), lift, stroke, cycle_time)
            control = make_controller(gait)
            duration, sample = walk_times(gait.cycle_time, cycles or 1)
            for s, scene in enumerate(named.values()):  # innermost: the plan is remembered
                case = Case(scene, control, accuracy=accuracy, duration=duration, sample=sample)
                cases[s, g, k] = walk_case(case, cycles)
    by_scene = [COSTS.with_settings(copper_loss=loss[name].tolist()) for name in named]
    found = {
        "scenes": tuple(named),
        "gaits": tuple(tables),
        "duty": np.array([gait.duty for gait in tables.values()]),
        "speed": axis,
        "lift": float(lift),
        "copper_loss": next(iter(loss.values())),
        "run": _record(named, tables, copper_loss, accuracy, cycles, stroke, cycle_time),
    }
    return run_study(costed, cases, {place: by_scene[place[0]] for place in cases}, check, found,
                     **how)  # fmt: skip


def costed(
    run: Runner, cases: Cases, measures: Mapping[Place, Measure[Numbers]], check: int,
    about: dict[str, Any],
) -> GaitEnergy:  # fmt: skip
    """Run the points of a grid of gaits; the study behind `gait_energy`.

    Args:
        run: runs them.
        cases: by their places.
        measures: by their places.
        check: points of each scene that are run again.
        about: what of the result is known before.
    """
    sizes = [len(about["scenes"]), len(about["gaits"]), len(about["speed"])]

    def speed(place: Place) -> tuple[int, float]:
        return place[0], float(about["speed"][place[2]])

    found, changes = grid_results(run, cases, measures, speed, check, parts=sizes[0])
    empty = GaitEnergy.empty(dict(zip(GRID, sizes, strict=True)))
    return GaitEnergy(**about, check=changes, **grid_arrays(found, empty, sizes))


def _named(scenes: Scene | Mapping[str, Scene]) -> dict[str, Scene]:
    """Return the scenes by name."""
    named = {"scene": scenes} if isinstance(scenes, Scene) else dict(scenes)
    if not named:
        raise ParameterError("scenes", scenes, "at least one scene")
    for name, scene in named.items():
        if not isinstance(scene, Scene):
            raise ParameterError(f"scenes[{name!r}]", scene, "a Scene")
    return named


def _at_speed(
    gait: Gait, speed: float, lift: float, stroke: float | None, cycle_time: float | None
) -> Gait:
    """Return a gait at a speed [m/s] and step height [m]."""
    if cycle_time is None:
        length = DEFAULT_STROKE if stroke is None else float(stroke)
        return gait.with_changes(stroke=length, cycle_time=length / (gait.duty * speed), lift=lift)
    if stroke is not None:
        raise ParameterError("cycle_time", cycle_time, "left out with a stroke", "Give one.")
    length = speed * gait.duty * float(cycle_time)
    return gait.with_changes(stroke=length, cycle_time=float(cycle_time), lift=lift)


def _copper_losses(scene: Scene, given: float | None) -> Array:
    """Return the electrical loss of each joint over torque^2 (n,) [W/(N m)^2].

    Raises:
        ParameterError: it is negative, or neither motors nor the URDF's limits give it.
    """
    robot = scene.robot
    if given is not None:
        if not (np.isfinite(given) and given >= 0.0):
            raise ParameterError("copper_loss", given, "0 or more, finite [W/(N m)^2]")
        return np.full(len(robot.joint_names), float(given))
    found = np.empty(len(robot.joint_names))
    for k, motor in enumerate(scene.servos.motors(robot)):
        speed, torque = float(robot.velocity_limit[k]), float(robot.effort_limit[k])
        if motor is not None:
            speed, torque = motor.no_load_speed, motor.stall_torque
        if not (speed > 0.0 and torque > 0.0 and np.isfinite(speed) and np.isfinite(torque)):
            raise ParameterError(
                "copper_loss", None, "given [W/(N m)^2]",
                f"Joint {robot.joint_names[k]} has neither a motor nor limits in the URDF.",
            )  # fmt: skip
        found[k] = speed / torque
    return found


def _numbers(case: Case, run: Summary, copper_loss: list[float]) -> Numbers:
    """Return the numbers of a run."""
    budget = torque_budget(run)
    gait: Gait = case.controller.gait  # type: ignore[union-attr]  # made of one
    square = (
        run.torque_rms**2 * run.window_time / (run.cycles or 1)
    )  # integral of torque^2, per cycle
    way = budget.distance if budget.distance is not None and budget.distance > 0.0 else np.nan
    electrical = budget.net_energy + float(np.array(copper_loss) @ square)
    return {
        "cost_of_transport": budget.cost_of_transport,
        "cost_of_transport_positive": budget.cost_of_transport_positive,
        "cost_of_transport_electrical": electrical / (budget.weight * way),
        "torque_index": float(square.sum()) / way,
        "torque_index_largest": float(square.max()) / way,
        "torque_peak": float(np.abs(run.torque_peak).max()),
        "torque_rms": float(run.torque_rms.max()),
        "speed_peak": float(np.abs(run.speed_peak).max()),
        "measured_speed": budget.measured_speed,
        "stroke": gait.stroke,
        "cycle_time": gait.cycle_time,
    }


COSTS = Measure("hexapod_pin.study.gait_energy:COSTS", 1, "summary", dict, _numbers)
"""What a walk costs; its setting is the electrical loss of each joint."""


def _record(
    scenes: Mapping[str, Scene], gaits: Mapping[str, Gait], copper_loss: float | None,
    accuracy: float, cycles: int | None, stroke: float | None, cycle_time: float | None,
) -> GridRecord:  # fmt: skip
    """Return how the costs came about."""
    assumed = dict.fromkeys(text for scene in scenes.values() for text in scene.assumed)
    if copper_loss is None and any(
        motor is None for s in scenes.values() for motor in s.servos.motors(s.robot)
    ):
        assumed["electrical loss: velocity limit over effort limit of the URDF, times torque^2"] = (
            None
        )
    elif copper_loss is not None:
        assumed[f"electrical loss: {copper_loss:g} W/(N m)^2, times torque^2"] = None
    plain = {name: {**g.model_dump(), "phases": list(g.phases)} for name, g in gaits.items()}
    equal_stroke = cycle_time is None
    return GridRecord(
        robot=next(iter(scenes.values())).robot.name,
        scenes={name: scene.to_toml() for name, scene in scenes.items()},
        controller=tomli_w.dumps(plain),
        rule="equal stroke" if equal_stroke else "equal cycle time",
        rule_value=(stroke or DEFAULT_STROKE) if equal_stroke else cycle_time,
        accuracy=accuracy,
        cycles=cycles or 1,
        assumed=tuple(assumed),
        versions=package_versions(),
    )
