"""The job of `hexapod-pin walk`: choose the stroke, run with a progress bar, keep what was done."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from hexapod_pin.errors import (
    DivergenceError,
    GaitError,
    ParameterError,
    SimulationInterrupted,
    TraceFileError,
)

if TYPE_CHECKING:
    from hexapod_pin.control.gait import Gait
    from hexapod_pin.drive.servo import Servo
    from hexapod_pin.ground.contact import Contact
    from hexapod_pin.results.trace import Trace
    from hexapod_pin.robot.robot import Robot

DEFAULT_STROKE = 0.14
"""Stroke of S2 [m], taken where none is given and the robot can walk it."""

STROKE_SHARE = 0.8
"""Share of the largest possible stroke taken where DEFAULT_STROKE is too long (*assumed*)."""


def writable(option: str, path: Path) -> Path:
    """Return the absolute path, refused now rather than after the simulation.

    Raises:
        TraceFileError: the folder is missing or read-only, or the path is a folder.
    """
    path = path.expanduser().absolute()
    if not path.parent.is_dir():
        raise TraceFileError(f"{option} {path}: there is no folder {path.parent}.")
    if path.is_dir():
        raise TraceFileError(f"{option} {path}: is a folder; name a file in it.")
    if not os.access(path.parent, os.W_OK):
        raise TraceFileError(f"{option} {path}: the folder {path.parent} is not writable.")
    return path


def distinct(first: Path, second: Path | None) -> None:
    """Refuse to write two results to one file.

    Raises:
        TraceFileError: the paths are the same.
    """
    if second is not None and first.resolve() == second.resolve():
        raise TraceFileError(f"--out and --html are the same file, {first}; name two.")


def feasible_gait(
    robot: Robot, name: str, stroke: float | None, **fields: float
) -> tuple[Gait, str]:
    """Return the gait, and how its stroke was chosen.

    Without a stroke it is 0.14 m (S2's), or 80 % of the largest that the robot can walk where
    0.14 m is too long.

    Args:
        robot: the robot that must be able to walk it.
        name: tripod, ripple, tetrapod or wave.
        stroke: [m], or None.
        fields: cycle_time, duty, lift, heading, turn_rate.

    Raises:
        UnknownNameError: there is no such gait.
        GaitError: the robot cannot walk it, whatever the stroke where none was given.
        ParameterError: a value is out of range.
    """
    from hexapod_pin.control.gait import Gait
    from hexapod_pin.control.kinematic import refuse_impossible

    gait = Gait.by_name(name, stroke=DEFAULT_STROKE if stroke is None else stroke, **fields)
    try:
        refuse_impossible(robot, gait)
    except GaitError as error:
        if stroke is not None or error.quantity != "stroke" or error.limit is None:
            raise
        shorter = Gait.by_name(name, stroke=STROKE_SHARE * error.limit, **fields)
        refuse_impossible(robot, shorter)
        return shorter, (
            f"chosen: {STROKE_SHARE:.0%} of the largest that fits, {error.limit:.4g} m, "
            f"because {DEFAULT_STROKE} m does not"
        )
    return gait, "default" if stroke is None else "as given"


def contact_for(preset: str, mu: float | None) -> Contact:
    """Return a contact preset, with another friction coefficient where `mu` is given.

    Args:
        preset: "accurate", "s1", "s1-printed" or "s2".
        mu: friction coefficient (the static one, where the dynamic one keeps its ratio to it).

    Raises:
        UnknownNameError: there is no such preset.
        ParameterError: mu is out of range.
    """
    from hexapod_pin.ground.contact import Contact

    contact = Contact.preset(preset)
    if mu is None:
        return contact
    note = f"{contact.assumed}; but mu {mu:g} as given" if contact.assumed else ""
    return Contact(normal=contact.normal, friction=contact.friction.with_mu(mu), assumed=note)


def servo_for(robot: Robot, kp: float | None, kd: float | None) -> Servo | None:
    """Return servos with the given gains; a missing one is that of `Servo.from_effort`, *assumed*.

    Args:
        robot: whose joints they drive.
        kp: stiffness [N m/rad], or None.
        kd: damping [N m s/rad], or None.

    Raises:
        ParameterError: a gain is negative or not finite.
    """
    if kp is None and kd is None:
        return None
    from hexapod_pin.drive.servo import Servo

    own = Servo.from_effort(robot)
    return Servo(
        kp=own.kp if kp is None else kp,
        kd=own.kd if kd is None else kd,
        assumed=kp is None or kd is None,
    )


@contextmanager
def progress_bar(title: str) -> Iterator[Callable[[float], None]]:
    """Give a callable that shows a finished fraction on stderr, where that is a terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn())
    with Progress(
        *columns, TimeElapsedColumn(), console=console, disable=not console.is_terminal
    ) as bar:
        task = bar.add_task(title, total=1.0)
        yield lambda fraction: bar.update(task, completed=fraction)


def run_saving(job: Callable[[], Trace], out: Path) -> Trace:
    """Run a simulation and save its trace; of one that ends early, what there is.

    Raises:
        DivergenceError, SimulationInterrupted: as the job does, the message telling the file.
    """
    try:
        trace = job()
    except (DivergenceError, SimulationInterrupted) as error:
        saved = error.trace.save(out)
        kept = f"the {error.trace.time[-1]:g} s done so far are in {saved}"
        raise type(error)(f"{error}\n{kept}", error.trace) from error
    trace.save(out)
    return trace


def run_summary(trace: Trace) -> str:
    """Return one line: how the run was integrated, what it cost, what it says of its own error."""
    meta, counters = trace.meta, trace.counters
    how = f"accuracy {meta['accuracy']:g}" if meta["accuracy"] else f"step {meta['step']:g} s"
    error = f"error estimate {trace.error_estimate:.1e} m or rad, " if meta["accuracy"] else ""
    worked = float(abs(trace.energy["servo_work"]).max())
    residual = float(abs(trace.energy_residual).max())
    return (
        f"method {meta['method']}, {how}: {counters['steps']} steps, "
        f"{counters['evaluations']} evaluations, {meta['wall_time']:.2g} s; {error}"
        f"energy residual {residual:.1e} J of {worked:.3g} J of servo work"
    )


def given(**fields: float | None) -> dict[str, float]:
    """Return the fields that are not None."""
    return {name: value for name, value in fields.items() if value is not None}


def foot_names(text: str | None) -> list[str] | None:
    """Return the names in a comma-separated list.

    Raises:
        ParameterError: a name is empty or given twice.
    """
    if text is None:
        return None
    names = [name.strip() for name in text.split(",")]
    if not all(names) or len(set(names)) < len(names):
        raise ParameterError("--feet", text, "different link names, separated by commas")
    return names
