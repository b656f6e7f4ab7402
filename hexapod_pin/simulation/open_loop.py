"""Runs whose controller knows its whole trajectory: planned at once, or a long walk in parts.

Of the parts at most one is in memory.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

from hexapod_pin.control.check_controller import (
    check_controller,
    checked_plan,
    method_name,
    settings_of,
)
from hexapod_pin.control.kinematic import KinematicControl
from hexapod_pin.control.knot_table import MAX_KNOT_SPACING
from hexapod_pin.control.sampled_trajectory import HoldPosture, SampledTrajectory
from hexapod_pin.errors import ParameterError
from hexapod_pin.simulation.case_data import run_to_dict
from hexapod_pin.simulation.methods import check_supported
from hexapod_pin.simulation.native_run import NativeRun, begin_of
from hexapod_pin.simulation.plant import prescribed_start, starting_point
from hexapod_pin.simulation.run_settings import LIFT, check_work
from hexapod_pin.user_code import UserCode

if TYPE_CHECKING:
    from hexapod_pin.control.joint_trajectory import Controller, JointTrajectory
    from hexapod_pin.robot.robot import Robot
    from hexapod_pin.simulation.case_data import CaseData
    from hexapod_pin.simulation.run_settings import RunSettings

PART = 15.0
"""Length of a part [s]: with its margin of 4.8 s 1.2 MB for 18 joints and a cycle of 2.4 s."""

KNOT_COPIES = 3.0
"""Of a plan in memory while a run begins [-]."""

MARGIN_CYCLES = 2.0
"""Cycles by which a part extends beyond its length."""

AHEAD_CYCLES = 1.0
"""Cycles by which the knots extend beyond the time to reach: multistep methods step over it."""


@dataclass(frozen=True)
class PlanParts:
    """A walk that repeats, planned from any time on.

    Attributes:
        controller: plans it.
        robot: walks it.
        end: of the whole walk [s].
    """

    controller: KinematicControl
    robot: Robot
    end: float

    def extend(self, rollout: Any, time: float) -> None:
        """Give a native run more knots where those it has do not reach well beyond a time [s]."""
        stop = self.controller.stop_at
        last = self.end if stop is None else min(self.end, stop)
        needed = time + AHEAD_CYCLES * self.controller.gait.cycle_time
        while (known := rollout.plan_end) < min(needed, last):
            part = self.part(known)
            new = part.time >= known
            rollout.extend_plan(part.time[new].tolist(), part.q[new], part.v[new])

    def part(self, since: float) -> JointTrajectory:
        """Return the part that begins at an event not after a time [s]."""
        margin = MARGIN_CYCLES * self.controller.gait.cycle_time
        until = min(self.end, since + PART) + margin
        return self.controller.plan_part(self.robot, self.end, since, until)


def plan_of(
    controller: Controller,
    robot: Robot,
    begin: float,
    end: float,
    memory: float,
    *,
    in_parts: bool,
    sample: float = 0.0,
) -> tuple[JointTrajectory, PlanParts | None]:
    """Return what the drives follow from `begin` to `end` [s], or its first part and the rest.

    Args:
        controller: plans it.
        robot: follows it.
        begin: where the run begins [s].
        end: where it ends [s].
        memory: largest memory of a plan [bytes].
        in_parts: whether the run can be given more later.
        sample: time between two samples, where it can be given more [s].

    Raises:
        GaitError, ReachError, ParameterError: of the controller; or its plan is no trajectory of
            this robot's joints.
        UserCodeError: the controller has raised.
    """
    per_second = KNOT_COPIES * 8.0 * (2 * len(robot.joint_names) + 1) / MAX_KNOT_SPACING
    if in_parts and end > PART and isinstance(controller, KinematicControl):
        if controller.repeats(robot):
            if (needed := per_second * min(sample, end - begin)) > memory:
                raise _too_long("sample", sample, needed, memory, "Sample more often. ")
            parts = PlanParts(controller, robot, end)
            return parts.part(begin), parts
    needed = per_second * end
    if needed > memory and not isinstance(controller, HoldPosture | SampledTrajectory):
        hint = "Only a KinematicControl whose cycles repeat is planned in parts, by `simulate`. "
        raise _too_long("duration", end, needed, memory, hint)
    with UserCode(method_name(controller, "plan")):
        plan = controller.plan(robot, end)
    return checked_plan(controller, plan, robot), None


def _too_long(name: str, value: float, needed: float, memory: float, hint: str) -> ParameterError:
    return ParameterError(
        name, value, f"short enough for a plan of {memory / 1e9:.3g} GB; it would take "
        f"{needed / 1e9:.3g} GB", hint + LIFT,
    )  # fmt: skip


def open_loop_run(
    case: CaseData, settings: RunSettings, *, record: bool = True, in_parts: bool = False
) -> NativeRun:
    """Plan a case whose controller knows its whole trajectory, and set its run up.

    Args:
        case: what is run.
        settings: method, duration and sampling.
        record: whether the samples that the case requests are recorded; otherwise only those that
            the control of the error needs.
        in_parts: whether the run plans a long walk part by part, as `NativeRun.advance` can.
    """
    check_controller(case.controller)
    scene, initial = case.scene, case.initial
    begin = begin_of(initial, settings)
    check_supported(settings.method_settings, scene)
    groups = case.record if record else settings.compared_groups
    if record or settings.estimate:
        check_work(settings, scene, groups)
    controller = cast("Controller", case.controller)
    plan, parts = plan_of(
        controller, scene.robot, begin, begin + max(settings.duration, settings.grid.sample),
        settings.limits.memory, in_parts=in_parts and not scene.prescribed,
        sample=settings.grid.sample,
    )  # fmt: skip
    start = starting_point(scene, plan.q[0], initial, plan.start_pose)
    if scene.prescribed:
        start = prescribed_start(scene.robot, plan, start, given=initial is not None)
    run = NativeRun(
        scene, settings, start, plan, controller=settings_of(controller),
        record=record or settings.estimate, groups=groups,
        extend_plan=None if parts is None else parts.extend,
    )  # fmt: skip
    run.case_settings = run_to_dict(case)
    return run
