"""`hexapod-pin export` writes a robot, a case or a trace as a file of another program."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hexapod_pin.commands.loading_options import RepairedLoading
from hexapod_pin.commands.options import (
    ImportCode,
    OptionalFloat,
    OptionalText,
    given,
    import_code,
    option_names,
    spelt_in_options,
    with_groups,
)
from hexapod_pin.commands.terminal import announce, echo
from hexapod_pin.commands.urdf_commands import write_repaired
from hexapod_pin.errors import ParameterError

if TYPE_CHECKING:
    from hexapod_pin.control.feedback import FeedbackController
    from hexapod_pin.control.joint_trajectory import Controller
    from hexapod_pin.results.trace import Trace
    from hexapod_pin.robot.loading.load_options import LoadOptions
    from hexapod_pin.scene.scene import Scene
    from hexapod_pin.simulation.case import Case

DURATION = 10.0
"""Planned time of a robot's walk where none is given [s]."""

RATE = 50.0
"""Keyframes per second where nothing is given [Hz]."""

NO_GAIT = "none"
"""Value of --gait for the standing posture alone."""


@with_groups
def export(
    context: typer.Context,
    what: Annotated[
        str,
        typer.Argument(
            help="A robot (kharagpur, athena, or the path of a URDF, xacro or MJCF file), a case "
            "(.toml) or a trace (.nc)."
        ),
    ],
    out: Annotated[
        Path,
        typer.Argument(
            help="The file to write; its ending is the format: .xml MJCF for MuJoCo, .urdf the "
            "repaired robot, .yaml the planned gait or the run as a joint trajectory of ROS 2, "
            ".mcap a trace for viewers of robot data, .csv or .csv.gz its samples."
        ),
    ],
    *,
    gait: Annotated[
        OptionalText,
        typer.Option(
            help="Of a robot: tripod, ripple, tetrapod, wave, or none for the standing posture "
            "alone; default: as of `walk`."
        ),
    ] = None,
    duration: Annotated[
        OptionalFloat,
        typer.Option(help="Planned time [s]; default: that of the case, of a robot 10 s."),
    ] = None,
    rate: Annotated[
        OptionalFloat, typer.Option(help="Keyframes or points per second [Hz]; default 50.")
    ] = None,
    loading: RepairedLoading,
    code: ImportCode = None,
) -> None:
    """Write a robot, a case or a trace for another program; the ending of OUT is the format."""
    announce(f"reading {what}")
    from hexapod_pin.commands.output_files import writable

    path = writable("OUT", out, tuple(WRITERS))
    import_code(code)
    options = replace(loading, repair=loading.repair or path.suffix == ".urdf").options()
    source = Source(context, what, options, gait, duration, rate)
    ending = next(one for one in WRITERS if path.name.endswith(one))
    for line in WRITERS[ending](source, path):
        echo(line)


@dataclass(frozen=True)
class Source:
    """What is to be exported, read when a writer asks for it.

    Attributes:
        context: of the command.
        what: name or path of a robot, or path of a case or trace.
        options: how a robot is loaded.
        gait: name of a robot's gait; None: the default one.
        duration: planned time [s]; None: that of the case.
        rate: keyframes or points per second [Hz]; None: 50.
    """

    context: typer.Context
    what: str
    options: LoadOptions
    gait: str | None
    duration: float | None
    rate: float | None

    @property
    def kind(self) -> str:
        """The word "robot", "case" or "trace", by the ending of the name."""
        from hexapod_pin.results.result_files import NETCDF

        ending = Path(self.what).suffix.lower()
        return {".toml": "case", **dict.fromkeys(NETCDF, "trace")}.get(ending, "robot")

    @cached_property
    def trace(self) -> Trace:
        """The trace.

        Raises:
            ParameterError: it is none.
            TraceFileError: it cannot be read.
        """
        if self.kind != "trace":
            allowed = "a trace, a file that `hexapod-pin walk` writes (walk.nc), for this format"
            raise ParameterError("WHAT", self.what, allowed)
        self._require_unused()
        from hexapod_pin.results.trace_file import load_trace

        return load_trace(self.what)

    @cached_property
    def case(self) -> Case:
        """The case of a file or of a trace."""
        from hexapod_pin.simulation.case import load_case

        if self.kind == "trace":
            return load_case(self.trace)
        self._require_unused()
        return load_case(self.what)

    @cached_property
    def walk(self) -> tuple[Scene, Controller | FeedbackController | None, float]:
        """The scene, its controller if any, and the planned time [s]."""
        if self.kind != "robot":
            case = self.case
            length = case.duration if self.duration is None else self.duration
            return case.scene, case.controller, DURATION if length is None else length
        from hexapod_pin.control.feasible_gait import default_gait, fit_gait
        from hexapod_pin.control.kinematic import KinematicControl
        from hexapod_pin.robot.robot import load_robot
        from hexapod_pin.scene.scene import Scene

        robot = load_robot(self.what, options=self.options)
        length = DURATION if self.duration is None else self.duration
        if self.gait == NO_GAIT or (self.gait is None and not robot.legs):
            return Scene(robot), None, length
        announce("planning the gait")
        fitted = fit_gait(robot, self.gait or default_gait(robot))
        return Scene(robot), KinematicControl(fitted.gait), length

    def _require_unused(self) -> None:
        """Refuse options of a robot where a case or a trace has everything."""
        fields: Mapping[str, object] = {**self.options.given(), "gait": self.gait}
        for name, value in fields.items():
            if value is not None and name != "package_path":
                allowed = f"left out with a {self.kind}, which states it"
                raise ParameterError(name, value, allowed)


def _mjcf(source: Source, path: Path) -> list[str]:
    """Write MJCF, and report what it does not have."""
    from hexapod_pin.interchange.mjcf import write_mjcf_with_notes

    scene, controller, duration = source.walk
    rate = RATE if source.rate is None else source.rate
    _, notes = write_mjcf_with_notes(
        scene, path, controller=controller, duration=duration, rate=rate,
        package_path=source.options.package_path,
    )  # fmt: skip
    options = option_names(source.context.command)
    planned = "" if controller is None else f" and the plan of {duration:g} s at {rate:g} Hz"
    robot = scene.robot
    return [
        *(f"repaired: {text}" for text in robot.repaired),
        *(f"note: {spelt_in_options(text, options)}" for text in notes),
        f"wrote {path}: {robot.name}, keyframe 0 the standing posture{planned}",
    ]


def _urdf(source: Source, path: Path) -> list[str]:
    """Write the repaired URDF of a robot, as `hexapod-pin repair`."""
    from hexapod_pin.robot.robot_source import robot_path

    if source.kind != "robot":
        raise ParameterError("WHAT", source.what, "a robot for .urdf, not a case or a trace")
    names = ("mass", "density", "effort", "velocity")
    numbers = given(**{name: getattr(source.options, name) for name in names})
    file = robot_path(source.what)
    write_repaired(source.context, file, path, source.options, numbers)
    return []


def _csv(source: Source, path: Path) -> list[str]:
    """Write the samples of a trace as a table."""
    source.trace.save(path)
    return [f"wrote {path}"]


def _mcap(source: Source, path: Path) -> list[str]:
    """Write a trace for viewers of robot data."""
    from hexapod_pin.interchange.mcap import write_mcap

    write_mcap(source.trace, path)
    return [f"wrote {path}: joints, foot forces, transforms and verdict as messages of ROS 2"]


def _trajectory(source: Source, path: Path) -> list[str]:
    """Write the set-points of a trace, or the planned gait of a robot or case."""
    from hexapod_pin.control.kinematic import KinematicControl
    from hexapod_pin.control.walk_plan import WalkPlan
    from hexapod_pin.interchange.trajectory import write_joint_trajectory

    rate = RATE if source.rate is None else source.rate
    if source.kind == "trace":
        try:
            write_joint_trajectory(source.trace, path, rate=rate, duration=source.duration)
        except ParameterError as error:
            if "at rest" not in error.allowed:
                raise
            hint = (
                "A walk goes on where its run ends. Export its plan from rest to rest: "
                "hexapod-pin export ROBOT OUT --duration 10, or the case of walk --save-case."
            )
            raise ParameterError("WHAT", source.what, error.allowed, hint) from None
        return [f"wrote {path}: the set-points of the run at {rate:g} Hz"]
    scene, controller, duration = source.walk
    if not isinstance(controller, KinematicControl):
        allowed = "a robot with a gait, a case with KinematicControl, or a trace for .yaml"
        raise ParameterError("WHAT", source.what, allowed)
    plan = WalkPlan(scene.robot, controller.gait)
    write_joint_trajectory(plan, path, rate=rate, duration=duration)
    return [f"wrote {path}: the planned gait, {duration:g} s from rest to rest at {rate:g} Hz"]


WRITERS: Mapping[str, Callable[[Source, Path], list[str]]] = {
    ".xml": _mjcf, ".urdf": _urdf, ".csv": _csv, ".csv.gz": _csv, ".mcap": _mcap,
    ".yaml": _trajectory,
}  # fmt: skip
"""Ending of the file to write -> what writes it and returns what is printed."""
