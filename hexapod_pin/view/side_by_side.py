"""Several runs played next to each other in one offline HTML file."""

from __future__ import annotations

import contextlib
import html
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError, ViewerError
from hexapod_pin.results.trace import Trace
from hexapod_pin.view.ground_shapes import MARGIN, Sizes, ground_commands, ground_rectangle
from hexapod_pin.view.html import fitted_motion, folded_list, mesh_budget, mesh_notes, write_page
from hexapod_pin.view.mesh_store import MeshStore
from hexapod_pin.view.meshcat_commands import DIGITS, ROOT, Command, text_object
from hexapod_pin.view.robot_shapes import RobotShapes
from hexapod_pin.view.scene_graph import (
    animation_of,
    backdrop,
    meshed_robot,
    motion_clips,
    nearest_samples,
    require_finite,
    require_rates,
    robot_commands,
    trunk_focus,
)
from hexapod_pin.view.scene_graph import clip as motion_clip

ASIDE = 1.6  # ground beside a run's path, reaches of the robot
GAP = 0.1  # between two grounds, reaches of the robot
LABEL_HEIGHT = 1.4  # of a label above the trunk, reaches of the robot
CAMERA = (-2.2, -0.5, 1.4)  # behind the runs and above, in reaches of the picture
LABEL_SIDE = 2.4  # of the square a label is written on, reaches of the robot


@checked
def write_side_by_side(
    traces: Mapping[str, Trace],
    path: str | Path,
    *,
    fps: float = 30.0,
    force_scale: float | None = None,
    package_path: Sequence[str | Path] = (),
) -> Path:
    """Write one HTML file that plays several runs next to each other, in step, offline.

    Each run has a lane of its own, with its ground and its name; the first is on the left. Lanes
    lie beside each other in y, or in x where the runs go further along y. The camera looks from
    behind and follows the mean of all trunks horizontally, so that the robot ahead is seen ahead. A
    run that ends before the others stands still from then on. Guarantees are those of `write_html`.

    Args:
        traces: what to show, by name.
        path: the file; an old one is replaced, or left alone where anything fails.
        fps: pictures per simulated second; fewer, with a note in the caption, where the file would
            pass `PAGE_BYTES` (10 MB). From 1e-3 to 1e6; never more than there are samples.
        force_scale: length of a force arrow, 1e-9 to 1e3 [m/N], the same in all runs; None fits it
            to the first robot's weight.
        package_path: folders that hold ROS packages: where to look for meshes first.

    Returns:
        The path written to.

    Raises:
        ViewerError: a trace cannot be drawn (the message names the run), or meshcat's files are
            missing.
        ParameterError: no trace, or `fps` or `force_scale` is out of range.
        TraceFileError: the file cannot be written.
    """
    require_rates(fps)
    for name, trace in traces.items():
        with _naming(name):
            require_finite(trace, np.arange(len(trace.time)))
    travel = _travel(traces)
    store = MeshStore()
    shapes = {}
    for name, trace in traces.items():
        with _naming(name):
            shapes[name] = meshed_robot(trace, store, package_path)
    lanes = _lanes(traces, travel, force_scale, shapes)
    grounds = [command for lane in lanes for command in lane.ground()]
    store.budget = mesh_budget(grounds)
    scene = [*backdrop(_camera(lanes, travel)), *grounds]
    for lane in lanes:
        with _naming(lane.name):
            scene += lane.still()
    missing = dict.fromkeys(note for robot in shapes.values() for note in robot.notes)
    notes = mesh_notes(list(missing), store)
    animation, rate = fitted_motion(lambda rate: _motion(lanes, rate), fps, scene, notes)
    title = f"{', '.join(traces)} side by side"
    caption = _caption(lanes, rate) + notes
    return write_page(path, title=title, caption=caption, scene=scene, animation=animation)


@contextlib.contextmanager
def _naming(run: str) -> Iterator[None]:
    """Put the run's name in front of a note on it."""
    try:
        yield
    except ViewerError as error:
        raise ViewerError(f"run {run!r}: {error}") from error


@dataclass(frozen=True)
class _Lane:
    """A run and its place in the picture."""

    name: str
    trace: Trace
    root: str
    sizes: Sizes
    shapes: RobotShapes
    ahead: Array  # axis of travel. Shape (3,).
    offset: Array  # of the run's world [m]. Shape (3,).
    margin: tuple[float, float]

    def ground(self) -> list[Command]:
        """Return the run's ground."""
        return ground_commands(self.trace, self.sizes, root=self.root, margin=self.margin)

    def still(self) -> list[Command]:
        """Return the run's robot and label."""
        size = LABEL_SIDE * self.sizes.reach
        return [
            *robot_commands(self.trace, self.sizes, root=self.root, shapes=self.shapes),
            text_object(f"{self.root}/label", self.name, size, _upright(-self.ahead)),
        ]

    def moving(self, index: npt.NDArray[np.intp], times: Array, focus: Array) -> list[Command]:
        """Return the run's motion; `focus` (K, 3) is what the camera looks at [m]."""
        place = self.offset - focus
        clips = motion_clips(self.trace, index, times, self.sizes, root=self.root, place=place)
        above = trunk_focus(self.trace, index) + (0.0, 0.0, LABEL_HEIGHT * self.sizes.reach)
        return [*clips, motion_clip(f"{self.root}/label", times, {"position": above})]


def _motion(lanes: Sequence[_Lane], fps: float) -> Command:
    """Return the motion of all runs in step, the camera at the mean of their trunks."""
    length = max(_length(lane.trace) for lane in lanes)
    fps = min(fps, max(_sample_rate(lane.trace) for lane in lanes) or fps)
    times = np.arange(0.0, length + 0.5 / fps, 1.0 / fps)
    if len(times) == 1:
        times = np.array([0.0, 1.0 / fps])
    samples = [nearest_samples(lane.trace.time - lane.trace.time[0], times) for lane in lanes]
    focus = np.mean(
        [trunk_focus(lane.trace, index) for lane, index in zip(lanes, samples, strict=True)],
        axis=0,
    )
    clips: list[Command] = []
    for lane, index in zip(lanes, samples, strict=True):
        with _naming(lane.name):
            clips += lane.moving(index, np.round(times, DIGITS), focus)
    return animation_of(clips)


def _travel(traces: Mapping[str, Trace]) -> Array:
    """Return the axis along which the runs go furthest: x or y, forth or back. Shape (3,)."""
    if not traces:
        raise ParameterError("traces", traces, "at least one, by name")
    path = np.concatenate([trace.q[:, :2] for trace in traces.values()])
    axis = int(np.ptp(path[:, 1]) > np.ptp(path[:, 0]))
    distance = sum(float(trace.q[-1, axis] - trace.q[0, axis]) for trace in traces.values())
    return np.asarray(np.eye(3)[axis] * (-1.0 if distance < 0.0 else 1.0))


def _lanes(
    traces: Mapping[str, Trace],
    ahead: Array,
    force_scale: float | None,
    shapes: Mapping[str, RobotShapes],
) -> list[_Lane]:
    """Return the runs in their places: grounds do not overlap, the first is on the left."""
    scale = Sizes.of(next(iter(traces.values())), force_scale).force_scale
    sizes = {name: Sizes.of(trace, scale) for name, trace in traces.items()}
    margin = (MARGIN, ASIDE) if ahead[0] else (ASIDE, MARGIN)
    left = np.cross((0.0, 0.0, 1.0), ahead)
    axis = int(np.argmax(np.abs(left)))
    grounds = [ground_rectangle(trace, sizes[name], margin) for name, trace in traces.items()]
    width = max(high[axis] for _, high, _ in grounds) - min(low[axis] for low, _, _ in grounds)
    step = (width + GAP * max(size.reach for size in sizes.values())) * left
    middle = 0.5 * (len(traces) - 1)
    return [
        _Lane(
            name,
            trace,
            f"{ROOT}/run{k}",
            sizes[name],
            shapes[name],
            ahead,
            (middle - k) * step,
            margin,
        )  # fmt: skip
        for k, (name, trace) in enumerate(traces.items())
    ]


def _sample_rate(trace: Trace) -> float:
    """Return how many samples a second has, of a run with one: 0 [1/s]."""
    return (len(trace.time) - 1) / _length(trace) if len(trace.time) > 1 else 0.0


def _length(trace: Trace) -> float:
    return float(trace.time[-1] - trace.time[0])


def _camera(lanes: list[_Lane], ahead: Array) -> tuple[float, float, float]:
    """Return a place behind all runs and above them [m]."""
    size = max(lane.sizes.reach for lane in lanes) + float(np.linalg.norm(lanes[0].offset))
    left = np.cross((0.0, 0.0, 1.0), ahead)
    x, y, z = size * (CAMERA[0] * ahead + CAMERA[1] * left + CAMERA[2] * np.eye(3)[2])
    return float(x), float(y), float(z)


def _upright(normal: Array) -> Array:
    """Return the rotation (3, 3) of a square with a horizontal normal, its y axis upwards."""
    up = np.array([0.0, 0.0, 1.0])
    return np.column_stack([np.cross(up, normal), up, normal])


def _caption(lanes: list[_Lane], rate: str) -> str:
    """Return, as HTML, which robot is where, what the picture shows, and what of it is assumed.

    `rate` is a note, as HTML, where there are fewer pictures than requested.
    """
    longest = max(_length(lane.trace) for lane in lanes)
    names = []
    for lane in lanes:
        length = _length(lane.trace)
        short = f" (ends at {length:.4g} s)" if length < longest - 1e-9 else ""
        names.append(f"{html.escape(lane.name)}{short}")
    robots = dict.fromkeys(lane.trace.run.robot.name for lane in lanes)
    scale = lanes[0].sizes.force_scale
    assumed = dict.fromkeys(text for lane in lanes for text in lane.trace.run.assumed)
    return (
        f"{html.escape(', '.join(robots))}, {longest:.4g} s<br>"
        f"from left to right: {', '.join(names)}<br>"
        f"red: foot forces, 0.1 m is {0.1 / scale:.3g} N{rate}"
        f"{folded_list('assumed', tuple(assumed))}"
    )
