"""Controllers are compared on the same scenes, such as random bumps from several seeds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from hexapod_pin.arguments import checked
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.comparison import Comparison
from hexapod_pin.results.summary import Summary
from hexapod_pin.results.walk_metrics import ComparedRun
from hexapod_pin.scene.scene import Scene
from hexapod_pin.simulation.case import Case
from hexapod_pin.study.runs.measure import SUMMARY
from hexapod_pin.study.runs.runner import Runner, RunOptions, run_study

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from hexapod_pin.control.feedback import FeedbackController
    from hexapod_pin.control.joint_trajectory import Controller

    AnyController = Controller | FeedbackController


@dataclass(frozen=True)
class PlannedRun:
    """A run of a comparison before it is run.

    Attributes:
        scene: name of the scene.
        number: which of its variants.
        controller: name of the controller.
        case: what is run.
    """

    scene: str
    number: int
    controller: str
    case: Case


@checked
def compare(
    scenes: Scene | Sequence[Scene] | Mapping[str, Scene | Sequence[Scene]],
    controllers: Mapping[str, AnyController],
    *,
    duration: float,
    accuracy: float | None = None,
    method: str | None = None,
    step: float | None = None,
    **how: Unpack[RunOptions],
) -> Comparison:
    """Run every controller on every scene and compare their walks; the first is the baseline.

    No samples are kept. Feedback controllers run in lock-step over the variants of the scenes.

    Args:
        scenes: by name; a sequence holds variants of one scene, such as terrain of several seeds,
            over which means and confidence intervals are taken.
        controllers: by name.
        duration: simulated time [s]; at least the start-up and one whole cycle.
        accuracy: as in `simulate` [m and rad].
        method: as in `simulate`.
        step: as in `simulate` [s].
        **how: store, threads, workers, progress: see `RunOptions`.

    Raises:
        ParameterError: no scene or controller, or a setting out of range. What goes wrong in one
            run is reported in its row.
        StudyInterrupted: Ctrl-C; `.result` is the comparison of what was done.
        HexapodError: as of `run_study`.

    Example:
        >>> scenes = {"flat": Scene(robot), "bumps": random_bumps(...)}
        >>> walks = {"slow": KinematicControl(slow), "fast": KinematicControl(fast)}
        >>> print(compare(scenes, walks, duration=6.0).table())
    """
    planned = plan_runs(
        scenes, controllers,
        duration=duration, accuracy=accuracy, method=method, step=step,
    )  # fmt: skip
    return run_study(compared, planned, **how)


def plan_runs(
    scenes: Scene | Sequence[Scene] | Mapping[str, Scene | Sequence[Scene]],
    controllers: Mapping[str, AnyController],
    **settings: Any,
) -> list[PlannedRun]:
    """Return a run of every controller on every scene; `settings` are those of `Case`.

    Raises:
        ParameterError: no scene or controller, or a setting out of range.
    """
    if not isinstance(controllers, Mapping) or not controllers:
        raise ParameterError("controllers", controllers, "a mapping of at least one name")
    return [
        PlannedRun(name, number, controller, Case(scene, control, **settings))
        for name, variants in _by_name(scenes).items()
        for number, scene in enumerate(variants)
        for controller, control in controllers.items()
    ]


def compared(run: Runner, planned: Sequence[PlannedRun]) -> Comparison:
    """Run and compare. Cases have settings of their own."""
    return _comparison(planned, run.rows([plan.case for plan in planned], SUMMARY))


def _by_name(
    scenes: Scene | Sequence[Scene] | Mapping[str, Scene | Sequence[Scene]],
) -> dict[str, list[Scene]]:
    """Return the variants of each scene by its name."""
    named = scenes if isinstance(scenes, Mapping) else {"scene": scenes}
    found = {
        str(name): [given] if isinstance(given, Scene) else list(given)
        for name, given in named.items()
    }
    if not found or not all(found.values()):
        raise ParameterError("scenes", scenes, "at least one scene, and one per name")
    for name, variants in found.items():
        for number, scene in enumerate(variants):
            if not isinstance(scene, Scene):
                raise ParameterError(f"scenes[{name!r}][{number}]", scene, "a Scene")
    return found


def _comparison(planned: Sequence[PlannedRun], results: Sequence[Any]) -> Comparison:
    runs = tuple(
        ComparedRun.of(
            plan.scene, plan.number, plan.controller, result, turn_rate=_turn_rate(plan.case)
        )
        for plan, result in zip(planned, results, strict=True)
    )
    summaries = [result for result in results if isinstance(result, Summary)]
    assumed = (text for summary in summaries for text in summary.run.assumed)
    scenes = [plan.case.scene for plan in planned]
    return Comparison(
        runs, settings=_settings(planned), assumed=tuple(dict.fromkeys(assumed)),
        motor="; ".join(dict.fromkeys(scene.servos.describe() for scene in scenes)),
        contact="; ".join(dict.fromkeys(scene.contact.describe() for scene in scenes)),
    )  # fmt: skip


def _turn_rate(case: Case) -> float | None:
    """Return the planned yaw rate of a controller with a gait [rad/s]."""
    gait = getattr(case.controller, "gait", None)
    return None if gait is None else float(gait.turn_rate)


def _settings(planned: Sequence[PlannedRun]) -> tuple[str, ...]:
    """Return what all runs share, or each kind once."""
    lines: dict[str, None] = {}
    for plan in planned:
        settings, robot = plan.case.settings, plan.case.scene.robot
        text = f"{robot.name}, {settings.duration:g} s, {settings.accuracy_text}"
        lines[text] = None
    return tuple(lines)
