"""A playback is an offline HTML page of bounded size, or is shown live in the browser.

`write_html` needs no server, network or display. `view` serves meshcat's viewer on the loopback
interface, from a thread of this process, so that no server outlives it.
"""

from __future__ import annotations

import base64
import contextlib
import html
import json
import threading
import webbrowser
from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.errors import ViewerError
from hexapod_pin.foreign_text import encoded, visible
from hexapod_pin.results.trace import Trace
from hexapod_pin.view.ground_shapes import Sizes, require_in
from hexapod_pin.view.mesh_store import MESH_BUDGET, TRIANGLE_BYTES, MeshStore
from hexapod_pin.view.meshcat_commands import Command
from hexapod_pin.view.scene_graph import animation_command, meshed_robot, scene_commands

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
        fps: pictures per simulated second; fewer, with a note in the caption, where the file would
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
        title=f"{trace.run.robot.name} walking",
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
    duration: float | None = None,
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
        duration: how long to serve [s]; None until Ctrl-C.
        port: of the loopback interface; 0 takes any free one.
        open_browser: whether to open the page; its address is printed in any case.
        package_path: folders that hold ROS packages: where to look for meshes first.

    Raises:
        ViewerError: the viewer cannot start, or the trace cannot be drawn.
        ParameterError: `fps`, `speed`, `force_scale`, `duration` or `port` is out of range.
    """
    if duration is not None:
        require_in("duration", duration, (0.0, threading.TIMEOUT_MAX, "s"))
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
            threading.Event().wait(duration)


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

    `rate` is a note, as HTML, where there are fewer pictures than requested.
    """
    scale = Sizes.of(trace, force_scale).force_scale
    span = trace.time[-1] - trace.time[0]
    first = html.escape(f"{trace.run.robot.name}, {span:.4g} s")
    arrows = f"red: foot forces, 0.1 m is {0.1 / scale:.3g} N"
    return f"{first}<br>{arrows}{rate}{folded_list('assumed', trace.run.assumed)}"


# One offline HTML page that plays commands of meshcat: the viewer, the scene and its motion.

_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval'; style-src 'unsafe-inline'; "
    "img-src data: blob:; connect-src data: blob:; worker-src blob:; font-src data:"
)

_PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<title>{title}</title>
<!-- The viewer below is MeshCat:
{license}
-->
<style>
body {{ margin: 0; font: 14px/1.4 sans-serif; }}
#view {{ width: 100vw; height: 100vh; overflow: hidden; }}
#caption {{ position: absolute; left: 12px; top: 8px; max-width: 60vw; color: #223; }}
</style>
</head>
<body>
<div id="view"></div>
<div id="caption">{caption}</div>
<script id="embedded-json"></script>
<script>
{viewer}
</script>
<script id="trace" type="application/json">{data}</script>
<script>
const data = JSON.parse(document.getElementById("trace").textContent);
{unpack}const viewer = new MeshCat.Viewer(document.getElementById("view"));
for (const clip of data.animation.animations)
  for (const track of clip.clip.tracks) track.times = data.times;
for (const command of [...data.scene, data.animation]) viewer.handle_command(command);
</script>
</body>
</html>
"""


_UNPACK = """const KINDS = {Float32Array, Uint16Array, Uint32Array};
function unpack(part) {
  const bytes = Uint8Array.from(atob(data.arrays[part.array]), (c) => c.charCodeAt(0));
  part.array = new KINDS[part.type](bytes.buffer);
}
for (const command of data.scene)
  for (const geometry of command.object?.geometries ?? [])
    if (Number.isInteger(geometry.data?.index?.array))
      [geometry.data.attributes.position, geometry.data.index].forEach(unpack);
"""  # arrays of meshes are bytes, least significant first, as in every browser


_TITLE_BYTES = 5000  # room for a title, the animation's options and the licence's marks


def write_page(
    path: str | Path, *, title: str, caption: str, scene: Sequence[Command], animation: Command
) -> Path:
    """Write a page, wholly or not at all, and return its path.

    Args:
        path: the file; an old one is replaced, or left alone where anything fails.
        title: plain text.
        caption: HTML, its texts escaped.
        scene: the still picture.
        animation: its motion; all tracks have the same times, which the page holds once.

    Raises:
        ViewerError: meshcat's files are missing.
        TraceFileError: the file cannot be written.
    """
    times = [clip["clip"]["tracks"][0]["times"] for clip in animation["animations"]][0]
    for clip in animation["animations"]:
        for track in clip["clip"]["tracks"]:
            del track["times"]
    data = {"scene": list(scene), "times": times, "animation": animation}
    text, arrays = _script_text(data)
    page = _PAGE.format(
        policy=_POLICY,
        title=html.escape(title),
        caption=caption,
        license=viewer_file("LICENSE").replace("--", "- -"),
        viewer=viewer_file("dist/main.min.js"),
        data=text,
        unpack=_UNPACK if arrays else "",
    )
    return write_atomically(path, encoded(page))


def still_bytes(scene: Sequence[Command], caption: str) -> int:
    """Return the size of a page without its motion [bytes].

    Raises:
        ViewerError: meshcat's files are missing.
    """
    viewer = sum(len(viewer_file(name).encode()) for name in ("LICENSE", "dist/main.min.js"))
    frame = len((_PAGE + _POLICY + _UNPACK + caption).encode()) + _TITLE_BYTES
    return viewer + frame + len(_script_text({"scene": list(scene)})[0].encode())


def folded_list(title: str, texts: Sequence[str]) -> str:
    """Return, as HTML, texts that unfold under a title; nothing of no texts."""
    items = "".join(f"<li>{html.escape(text)}</li>" for text in texts)
    return f"<details><summary>{title}</summary><ul>{items}</ul></details>" if items else ""


def _script_text(data: Mapping[str, Any]) -> tuple[str, bool]:
    """Return JSON that cannot end the script element it stands in, and whether it has arrays.

    An array is replaced by its number in a list "arrays" of texts in base64, each stored once.
    """
    numbers: dict[bytes, int] = {}

    def number(value: Any) -> int:
        if not isinstance(value, np.ndarray):
            raise TypeError(f"{type(value).__name__} in a page")
        plain = value.astype(value.dtype.newbyteorder("<"), copy=False).tobytes()
        return numbers.setdefault(plain, len(numbers))

    text = json.dumps(data, separators=(",", ":"), allow_nan=False, default=number)
    if numbers:
        arrays = [base64.b64encode(plain).decode("ascii") for plain in numbers]
        text = f'{text[:-1]},"arrays":{json.dumps(arrays, separators=(",", ":"))}}}'
    return text.replace("<", "\\u003c"), bool(numbers)


def viewer_file(name: str) -> str:
    """Return the text of a file of meshcat's viewer, without importing meshcat.

    Raises:
        ViewerError: meshcat is not installed, or is of another make.
    """
    spec = find_spec("meshcat")
    folders: Sequence[str] = (spec.submodule_search_locations or []) if spec else []
    for folder in folders:
        file = Path(folder) / "viewer" / name
        if file.is_file():
            return file.read_text(encoding="utf-8")
    raise ViewerError(f"meshcat's viewer/{name} is not installed: `pip install meshcat`.")


# A page's size: the rate of pictures, and the triangles of meshes, that keep it small.

PAGE_BYTES = 10_000_000
"""Largest HTML file [bytes]; long walks have fewer pictures per second to keep it."""
LEAST_MOTION_BYTES = 1_000_000
"""Left for the motion whatever the still picture takes [bytes]."""
LEAST_TRIANGLES = 10_000
"""Of all meshes of a page, whatever the ground takes."""
MARGIN = 0.98
"""Aimed at, over what there is room for: pictures differ in how many digits they take."""


def mesh_budget(ground: Sequence[Command]) -> int:
    """Return the triangles that meshes may have beside a ground, at most `MESH_BUDGET`."""
    room = PAGE_BYTES - still_bytes(ground, "") - 2 * LEAST_MOTION_BYTES
    return min(MESH_BUDGET, max(LEAST_TRIANGLES, room // TRIANGLE_BYTES))


def fitted_motion(
    motion: Callable[[float], Command], fps: float, scene: Sequence[Command], caption: str
) -> tuple[Command, str]:
    """Return a motion that leaves the page below `PAGE_BYTES`, and as HTML what that took.

    The motion takes the room that the still picture leaves, and `LEAST_MOTION_BYTES` if there is
    less.

    Args:
        motion: makes it at a rate of pictures [1/s].
        fps: the rate where there is room for it [1/s].
        scene: the still picture.
        caption: HTML.
    """
    still = still_bytes(scene, caption)
    room = max(PAGE_BYTES - still, LEAST_MOTION_BYTES)
    made, rate = motion(fps), fps
    while (size := _motion_bytes(made)) > room and _pictures(made) > 2:
        rate *= MARGIN * room / size
        made = motion(rate)
    if rate == fps:
        return made, ""
    limit = f"{1e-6 * max(PAGE_BYTES, still + room):.3g} MB"
    return made, f"<br>{rate:.3g} pictures per second instead of {fps:.4g}: a file below {limit}"


def _motion_bytes(motion: Command) -> int:
    """Return what a motion takes of a page, where all tracks share their times [bytes]."""
    clips = [clip["clip"] for clip in motion["animations"]]
    tracks = [{**track, "times": []} for clip in clips for track in clip["tracks"]]
    times = [clip["tracks"][0]["times"] for clip in clips[:1]]
    paths = sum(len(json.dumps(clip)) for clip in ({**c, "clip": 0} for c in motion["animations"]))
    return paths + len(json.dumps([tracks, times], separators=(",", ":"))) + 60 * len(clips)


def _pictures(motion: Command) -> int:
    return len(motion["animations"][0]["clip"]["tracks"][0]["times"])
