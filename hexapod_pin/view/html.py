"""A playback is one offline HTML page with every sample of one or several runs.

`write_html` needs no server, network or display. `view` serves the same page on the loopback
interface, from a thread of this process, so that no server outlives it.
"""

from __future__ import annotations

import contextlib
import html
import json
import re
import threading
import webbrowser
from collections.abc import Iterator, Mapping, Sequence
from datetime import date
from functools import cache
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.util import find_spec
from pathlib import Path
from types import MappingProxyType
from typing import Any

from hexapod_pin.arguments import checked
from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.drive.catalog import MotorRecord
from hexapod_pin.errors import ParameterError, ViewerError
from hexapod_pin.foreign_text import encoded, visible
from hexapod_pin.results.result_files import without_non_finite
from hexapod_pin.results.trace import Trace
from hexapod_pin.view.ground_shapes import require_in
from hexapod_pin.view.mesh_store import MeshStore
from hexapod_pin.view.run_data import run_data
from hexapod_pin.view.run_spread import require_alike, spread_data
from hexapod_pin.view.sample_block import SampleBlock, deflated
from hexapod_pin.view.scene_graph import DrawnMeshes, meshed_robot, require_finite

LAST_PORT = 65535
LOOPBACK = "127.0.0.1"
SPEEDS = (1e-6, 1e6, "[-]")

SCRIPTS = (
    "block.js", "runs.js", "player.js", "ground.js", "robot.js", "overlays.js", "camera.js",
    "plot.js", "panels.js", "gait_bar.js", "header.js", "main.js",
)  # fmt: skip
"""The page's own code, in this order: files of one script."""

_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval'; style-src 'unsafe-inline'; "
    "img-src data: blob:; connect-src data: blob:; worker-src blob:; font-src data:"
)


@checked
def write_html(
    trace: Trace,
    path: str | Path,
    *,
    spread: Sequence[Trace] = (),
    motor: MotorRecord | None = None,
    force_scale: float | None = None,
    command: str = "",
    package_path: Sequence[str | Path] = (),
) -> Path:
    """Write one HTML file that plays the trace in any browser, offline.

    The page holds the viewer, the robot with its own meshes where they are found (else its limbs),
    the ground, and every sample at a tenth of the run's error. It shows the scene, the gait
    diagram, plots and the worst instants; it opens from disk and forbids itself any network access.

    Args:
        trace: what to show.
        path: the file; an old one is replaced, or left alone where anything fails.
        spread: further runs of the case, such as of other seeds of its ground, friction or servo
            gains; plots have a band from the least to the largest value of all runs at each
            sample, and the page says what differs between them.
        motor: the motor to hold torques against, by its derated torque-speed line; None: that of
            the run, else the joints' torque limits.
        force_scale: length of a force arrow, 1e-9 to 1e3 [m/N]; None fits it to the robot's weight.
        command: what made the run, shown for copying.
        package_path: folders that hold ROS packages: where to look for meshes first.

    Returns:
        The path written to.

    Raises:
        ViewerError: the trace cannot be drawn (no readable URDF, a sample that is not finite), or
            meshcat's files are missing.
        ParameterError: `force_scale` is out of range; a run of `spread` has other joints, feet or
            times of samples than the trace.
        TraceFileError: the file cannot be written.
    """
    text = page_text(
        {"": trace}, spread={"": spread}, motor=motor, force_scale=force_scale, command=command,
        package_path=package_path,
    )  # fmt: skip
    return write_atomically(path, encoded(text))


def page_text(
    traces: Mapping[str, Trace],
    *,
    spread: Mapping[str, Sequence[Trace]] = MappingProxyType({}),
    motor: MotorRecord | None = None,
    force_scale: float | None = None,
    command: str = "",
    speed: float = 1.0,
    loop: bool = True,
    package_path: Sequence[str | Path] = (),
) -> str:
    """Return the page of one or several runs; arguments and errors as for `write_html`.

    The text is a whole document: a file, or the `srcdoc` of a frame (escape it as an attribute).

    Args:
        traces: what to show, by name; a name may be empty.
        spread: further runs of a trace's case, by its name.
        motor: the motor to hold torques against.
        force_scale: length of a force arrow [m/N], of all runs.
        command: what made the run.
        speed: simulated time over wall-clock time, at first.
        loop: whether it starts again at the end.
        package_path: folders that hold ROS packages.

    Raises:
        ParameterError: no trace, or `force_scale` is out of range; `spread` has a name that is no
            trace's, or a run of another robot or with other times of samples.
    """
    settings = {"command": command, "speed": speed, "loop": loop}
    return _built(traces, spread, motor, force_scale, package_path, settings)[0]


def _built(
    traces: Mapping[str, Trace], spread: Mapping[str, Sequence[Trace]], motor: MotorRecord | None,
    force_scale: float | None, package_path: Sequence[str | Path], settings: Mapping[str, Any],
) -> tuple[str, list[str]]:  # fmt: skip
    """Return the page, and why meshes are not drawn."""
    if not traces:
        raise ParameterError("traces", traces, "at least one, by name")
    for name in spread:
        if name not in traces:
            raise ParameterError("spread", name, f"of the names {list(traces)}, as of the traces")
    block, store = SampleBlock(), MeshStore()
    drawn, meshes, shapes = [], DrawnMeshes(block), {}
    for name, trace in traces.items():
        with _naming(name):
            require_finite(trace)
            require_alike(trace, spread.get(name, ()), f"spread[{name!r}]" if name else "spread")
            shapes[name] = meshed_robot(trace, store, package_path)
    for name, trace in traces.items():
        with _naming(name):
            run = run_data(trace, shapes[name], block, meshes, name=name, record=motor,
                           force_scale=force_scale)  # fmt: skip
        drawn.append(run)
    for (name, trace), run in zip(traces.items(), drawn, strict=True):  # behind what is played
        if others := spread.get(name):
            with _naming(name):
                run["spread"] = spread_data(trace, others, shapes[name], run["tree"], block, motor)
    missing = list(dict.fromkeys(note for robot in shapes.values() for note in robot.notes))
    notes = [f"mesh not drawn: {note}" for note in missing]
    if missing:
        notes.append("for meshes give --package-path FOLDER (package_path= in Python)")
    early = 1 + max(run["channels"]["angle"] for run in drawn)
    data = {
        "runs": drawn, "table": block.table, "early": block.size(early), **settings,
        "date": date.today().isoformat(),
        "notes": notes + ([store.note] if store.note else []),
    }  # fmt: skip
    plain = json.dumps(without_non_finite(data), separators=(",", ":"), allow_nan=False).encode()
    names = ", ".join(dict.fromkeys(run["name"] for run in drawn))
    return assembled(f"{names} - playback", deflated(plain), deflated(block.content)), missing


@contextlib.contextmanager
def _naming(run: str) -> Iterator[None]:
    """Put the run's name in front of a note on it, where it has one."""
    try:
        yield
    except ViewerError as error:
        raise ViewerError(f"run {run!r}: {error}" if run else str(error)) from error


def assembled(title: str, data: str, block: str) -> str:
    """Return the page around its data, both in base64."""
    parts = {
        "POLICY": _POLICY,
        "TITLE": html.escape(title),
        "LICENSE": viewer_file("LICENSE").replace("--", "- -"),
        "STYLE": page_file("page.css"),
        "VIEWER": _viewer(),
        "DATA": data,
        "BLOCK": block,
        "SCRIPT": "".join(page_file(name) for name in SCRIPTS),
    }
    return re.sub(r"@@([A-Z]+)@@", lambda found: parts[found[1]], page_file("page.html"))


@cache
def page_file(name: str) -> str:
    """Return the text of one of the page's own files, its lines without indentation."""
    text = (Path(__file__).parent / "page" / name).read_text(encoding="utf-8")
    return re.sub(r"(?m)^[ \t]+", "", text)


@cache
def _viewer() -> str:
    return deflated(parsed_at_once(viewer_file("dist/main.min.js")).encode())


def parsed_at_once(viewer: str) -> str:
    """Return the viewer's script with the function that holds three.js in brackets.

    A script engine first only skims a function, to parse it when it is called; one in brackets it
    parses at once. three.js is called right away, and its 0.6 MB would be read twice. A
    viewer that is built in another way is returned as it is.
    """
    return _THREE.sub(r"\1(\2)", viewer, count=1)


_THREE = re.compile(
    r'(?s)(\d+:)(\(\w,\w,\w\)=>\{"use strict";[^{]*\{ACESFilmicToneMapping:.*?\})'
    r'(?=,\d+:\(\w,\w,\w\)=>\{"use strict")'
)
"""The module of three.js in webpack's table of modules: its number and its function."""


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


# The same page, served on this machine.


@checked
def view(
    trace: Trace,
    *,
    spread: Sequence[Trace] = (),
    motor: MotorRecord | None = None,
    speed: float = 1.0,
    loop: bool = True,
    force_scale: float | None = None,
    duration: float | None = None,
    port: int = 0,
    open_browser: bool = True,
    package_path: Sequence[str | Path] = (),
) -> None:
    """Serve the page of `write_html` to a browser, until Ctrl-C.

    Args:
        trace: what to show.
        spread: further runs of the case, for bands of plots.
        motor: the motor to hold torques against.
        speed: simulated time over wall-clock time at first, 1e-6 to 1e6.
        loop: whether to start again at the end.
        force_scale: length of a force arrow, 1e-9 to 1e3 [m/N]; None fits it to the robot's weight.
        duration: how long to serve [s]; None until Ctrl-C.
        port: of the loopback interface; 0 takes any free one.
        open_browser: whether to open the page; its address is printed in any case.
        package_path: folders that hold ROS packages: where to look for meshes first.

    Raises:
        ViewerError: the server cannot start, or the trace cannot be drawn.
        ParameterError: `speed`, `force_scale`, `duration` or `port` is out of range, or a run of
            `spread` has other joints, feet or times of samples than the trace.
    """
    if duration is not None:
        require_in("duration", duration, (0.0, threading.TIMEOUT_MAX, "s"))
    with live_viewer(
        trace, spread=spread, motor=motor, speed=speed, loop=loop, force_scale=force_scale,
        port=port, package_path=package_path,
    ) as viewer:  # fmt: skip
        for note in viewer.notes:
            print(visible(f"mesh not drawn: {note}"), flush=True)
        print(visible(f"Playing at {viewer.url} (Ctrl-C ends it)"), flush=True)
        if open_browser:
            webbrowser.open(viewer.url)
        with contextlib.suppress(KeyboardInterrupt):
            threading.Event().wait(duration)


class PageServer:
    """A running server of one page; a context manager, after which nothing listens any more.

    Attributes:
        url: where a browser finds it.
        notes: sentences on meshes that are not drawn.
    """

    notes: tuple[str, ...] = ()

    def __init__(self, page: bytes, port: int) -> None:
        """Bind a port of the loopback interface; 0 takes any free one.

        Raises:
            ViewerError: the port is taken.
        """

        class Answer(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                found = self.path.partition("?")[0] == "/"
                self.send_response(200 if found else 404)
                self.send_header("Content-Type", "text/html; charset=utf-8")
                self.send_header("Content-Length", str(len(page) if found else 0))
                self.end_headers()
                if found:
                    self.wfile.write(page)

            def log_message(self, *_: Any) -> None:
                """Print nothing."""

        class Server(ThreadingHTTPServer):
            allow_reuse_address = False
            daemon_threads = True

            def handle_error(self, *_: Any) -> None:
                """Take no notice of a browser that goes away."""

        try:
            self._server = Server((LOOPBACK, port), Answer)
        except OSError as error:
            raise ViewerError(
                f"the viewer did not start: port {port} of {LOOPBACK}: {error}."
            ) from error
        self.url = f"http://{LOOPBACK}:{self._server.server_address[1]}/"
        self._thread = threading.Thread(
            target=self._server.serve_forever, kwargs={"poll_interval": 0.05}, name="viewer",
            daemon=True,
        )  # fmt: skip

    def __enter__(self) -> PageServer:
        """Start to serve.

        Raises:
            ViewerError: no thread can be started.
        """
        try:
            self._thread.start()
        except RuntimeError as error:
            self._server.server_close()
            raise ViewerError(f"the viewer did not start: {error}.") from error
        return self

    def __exit__(self, *_: object) -> None:
        """Stop, and close the socket."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()


@checked
@contextlib.contextmanager
def live_viewer(
    trace: Trace,
    *,
    spread: Sequence[Trace] = (),
    motor: MotorRecord | None = None,
    speed: float = 1.0,
    loop: bool = True,
    force_scale: float | None = None,
    port: int = 0,
    package_path: Sequence[str | Path] = (),
) -> Iterator[PageServer]:
    """Serve the trace to browsers within a `with` block; arguments and errors as for `view`."""
    require_in("port", port, (0, LAST_PORT, "(0 takes any free one)"))
    require_in("speed", speed, SPEEDS)
    settings = {"command": "", "speed": speed, "loop": loop}
    text, missing = _built({"": trace}, {"": spread}, motor, force_scale, package_path, settings)
    with PageServer(encoded(text), port) as server:
        server.notes = tuple(missing)
        yield server
