"""Show a trace in a browser: as one file that works anywhere, or live.

`write_html` needs no server, network or display. `view` serves meshcat's viewer on the loopback
interface, from a thread of this process, so that no server outlives it.
"""

from __future__ import annotations

import contextlib
import html
import threading
import webbrowser
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hexapod_pin.arguments import checked
from hexapod_pin.errors import ViewerError
from hexapod_pin.foreign_text import visible
from hexapod_pin.results.trace import Trace
from hexapod_pin.view.mesh_store import MeshStore
from hexapod_pin.view.page import folded_list, write_page
from hexapod_pin.view.page_budget import fitted_motion
from hexapod_pin.view.scene_graph import animation_command, meshed_robot, scene_commands
from hexapod_pin.view.view_sizes import Sizes, require_in

if TYPE_CHECKING:
    from hexapod_pin.view.live import LiveViewer

LAST_PORT = 65535


@checked
def write_html(
    trace: Trace,
    path: str | Path,
    *,
    fps: float = 30.0,
    force_scale: float | None = None,
    package_path: Sequence[str | Path] = (),
) -> Path:
    """Write one HTML file that plays the trace in any browser, offline.

    The robot is drawn with its own meshes where they are found, decimated to `MESH_BUDGET`
    triangles in all; without them, with its limbs. The file holds the viewer, the robot, the
    ground, the foot forces as arrows, and their motion; it opens from disk, plays at once and
    repeats, and forbids itself any network access.

    Args:
        trace: what to show.
        path: the file; an old one is replaced, or left alone where anything fails.
        fps: pictures per simulated second; fewer, as the caption then says, where the file would
            pass `PAGE_BYTES` (10 MB). From 1e-3 to 1e6; never more than there are samples.
        force_scale: length of a force arrow, 1e-9 to 1e3 [m/N]; None fits it to the robot's weight.
        package_path: folders that hold ROS packages: where to look for meshes first.

    Returns:
        The path written to.

    Raises:
        ViewerError: the trace cannot be drawn (no readable URDF, a sample that is not finite), or
            meshcat's files are missing.
        ParameterError: `fps` or `force_scale` is out of range.
        TraceFileError: the file cannot be written.
    """
    store = MeshStore()
    shapes = meshed_robot(trace, store, package_path)
    scene = scene_commands(trace, force_scale=force_scale, shapes=shapes)
    notes = mesh_notes(shapes.notes, store)
    animation, rate = fitted_motion(
        lambda rate: animation_command(trace, fps=rate, force_scale=force_scale), fps, scene, notes
    )
    return write_page(
        path,
        title=f"{trace.meta.get('robot_name', 'robot')} walking",
        caption=_caption(trace, force_scale, rate) + notes,
        animation=animation,
        scene=scene,
    )


def mesh_notes(missing: Sequence[str], store: MeshStore) -> str:
    """Return, as HTML, which meshes are not drawn and how far the others are reduced."""
    way_out = ["give --package-path FOLDER (package_path= in Python)"] if missing else []
    reduced = [store.note] if store.note else []
    return folded_list(
        f"{len(missing)} mesh{'es' * (len(missing) != 1)} not drawn",
        [*missing, *way_out] if missing else [],
    ) + folded_list("meshes reduced", reduced)


@checked
def view(
    trace: Trace,
    *,
    speed: float = 1.0,
    loop: bool = True,
    fps: float = 60.0,
    force_scale: float | None = None,
    seconds: float | None = None,
    port: int = 0,
    open_browser: bool = True,
    package_path: Sequence[str | Path] = (),
) -> None:
    """Play the trace in a browser through meshcat, until Ctrl-C.

    The browser's panel pauses and scrubs; at `speed` 0.5 its clock runs to twice the trace's time.

    Args:
        trace: what to show.
        speed: simulated time over wall-clock time, 1e-6 to 1e6.
        loop: whether to start again at the end.
        fps: pictures per simulated second, 1e-3 to 1e6; never more than there are samples.
        force_scale: length of a force arrow, 1e-9 to 1e3 [m/N]; None fits it to the robot's weight.
        seconds: how long to serve [s]; None until Ctrl-C.
        port: of the loopback interface; 0 takes any free one.
        open_browser: whether to open the page; its address is printed in any case.
        package_path: folders that hold ROS packages: where to look for meshes first.

    Raises:
        ViewerError: the viewer cannot start, or the trace cannot be drawn.
        ParameterError: `fps`, `speed`, `force_scale`, `seconds` or `port` is out of range.
    """
    if seconds is not None:
        require_in("seconds", seconds, (0.0, threading.TIMEOUT_MAX, "s"))
    with live_viewer(
        trace,
        speed=speed,
        loop=loop,
        fps=fps,
        force_scale=force_scale,
        port=port,
        package_path=package_path,
    ) as viewer:
        for note in viewer.notes:
            print(visible(f"mesh not drawn: {note}"), flush=True)
        print(f"Playing at {viewer.url} (Ctrl-C ends it)", flush=True)
        if open_browser:
            webbrowser.open(viewer.url)
        with contextlib.suppress(KeyboardInterrupt):
            threading.Event().wait(seconds)


@checked
@contextlib.contextmanager
def live_viewer(
    trace: Trace,
    *,
    speed: float = 1.0,
    loop: bool = True,
    fps: float = 60.0,
    force_scale: float | None = None,
    port: int = 0,
    package_path: Sequence[str | Path] = (),
) -> Iterator[LiveViewer]:
    """Serve the trace to browsers within a `with` block; arguments and errors as for `view`."""
    require_in("port", port, (0, LAST_PORT, "(0 takes any free one)"))
    animation = animation_command(trace, fps=fps, force_scale=force_scale, speed=speed, loop=loop)
    shapes = meshed_robot(trace, MeshStore(), package_path)
    scene = scene_commands(trace, force_scale=force_scale, shapes=shapes)
    try:
        from hexapod_pin.view.live import LiveViewer
    except ImportError as error:
        raise ViewerError(f"the live viewer needs meshcat ({error}).") from error
    with LiveViewer(port=port) as viewer:
        viewer.notes = tuple(shapes.notes)
        for command in [*scene, animation]:
            viewer.send(command)
        yield viewer


def _caption(trace: Trace, force_scale: float | None, rate: str) -> str:
    """Return, as HTML, what the picture shows, and folded up what of it is assumed.

    `rate` says, as HTML, where there are fewer pictures than asked for.
    """
    scale = Sizes.of(trace, force_scale).force_scale
    span = trace.time[-1] - trace.time[0]
    first = html.escape(f"{trace.meta.get('robot_name', 'robot')}, {span:.4g} s")
    arrows = f"red: foot forces, 0.1 m is {0.1 / scale:.3g} N"
    return f"{first}<br>{arrows}{rate}{folded_list('assumed', trace.meta.get('assumed', ()))}"
