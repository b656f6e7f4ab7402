"""Why a run has ended before its end, in words: what led, where, and the way out."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.errors import DivergenceError, WorkLimitError
from hexapod_pin.simulation.loaded_model import native_loads

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.results.trace import Trace
    from hexapod_pin.simulation.methods import MethodSettings
    from hexapod_pin.simulation.native_run import NativeRun
    from hexapod_pin.simulation.scene import Scene

TRUNK = ("the trunk's place", "the trunk's attitude")
"""What the first six coordinates of a velocity belong to, three each."""


def contact_names(scene: Scene) -> tuple[str, ...]:
    """Return the names of all contact points: the feet, then those of the trunk, if it has any."""
    body = native_loads(scene).body_points
    return (*(foot.name for foot in scene.robot.feet), *(name for _, _, _, name in body))


def failure(run: NativeRun, trace: Trace | None) -> DivergenceError:
    """Return the error of a run that left the finite world or was ended by its limits.

    Args:
        run: the run.
        trace: its samples so far; None where none are kept.
    """
    limit = run.rollout.ended_by
    if limit:
        return WorkLimitError(_ended(run, limit), trace, limit)
    time, rate = run.time, run.rollout.checkpoint().v[6:]
    if trace is not None:
        time, rate = float(trace.time[-1]), trace.v[-1, 6:]
    causes = [*_fastest_joint(rate, run.scene.robot.joint_names), *_loaded_foot(trace)]
    told = f"the run diverged after t = {time:g} s ({'; '.join(causes)}). "
    return DivergenceError(told + _advice(run.how.choice), trace)


def _ended(run: NativeRun, limit: str) -> str:
    """Return what a run that its limits have ended was stuck at."""
    how, scene = run.how, run.scene
    reached = {
        "evaluations": f"{how.evaluations:.3g} evaluations are used up",
        "smallest_step": f"its steps are shorter than {how.limits.smallest_step:g} s",
        "wall_time": f"{how.limits.wall_time:g} s of wall time are used up",
        "stopped": "it was told to stop",
    }[limit]
    step, coordinate, foot = run.rollout.trouble()
    causes = [f"last step {step:.2g} s"]
    if coordinate >= 0:
        causes.append(f"kept small by the error of {_coordinate(coordinate, scene)}")
    if foot >= 0:
        laws = " + ".join(
            type(law).__name__ for law in (scene.contact.normal, scene.contact.friction)
        )
        causes.append(f"most loaded foot {contact_names(scene)[foot]}, {laws}")
    return (
        f"the run was ended at t = {run.time:g} s: {reached} ({'; '.join(causes)}). Try another "
        f"method than {how.choice.method.name!r}, a looser accuracy or softer contact, or raise "
        f"limits=hp.WorkLimits({limit}=...); allow=True (--force) lifts all limits."
    )


def _coordinate(index: int, scene: Scene) -> str:
    return TRUNK[index // 3] if index < 6 else scene.robot.joint_names[index - 6]


def _fastest_joint(rate: Array, names: tuple[str, ...]) -> list[str]:
    if not rate.size:
        return []
    joint = int(np.abs(rate).argmax())
    return [f"fastest joint {names[joint]} at {abs(rate[joint]):.3g} rad/s"]


def _loaded_foot(trace: Trace | None) -> list[str]:
    if trace is None or "contacts" not in trace.recorded or not trace.foot_names:
        return []
    force = np.linalg.norm(trace.foot_force[-1], axis=1)
    foot = int(force.argmax())
    return [f"most loaded foot {trace.foot_names[foot]} with {force[foot]:.3g} N"]


def _advice(choice: MethodSettings) -> str:
    if choice.method.adaptive:
        return (
            f"No step of {choice.method.name!r} kept {choice.accuracy:g}: try method='robust', "
            "softer contact, or lower servo gains."
        )
    return (
        f"Try a smaller step than {choice.step:g} s, method='robust', softer contact, or lower "
        "servo gains."
    )
