"""Playback: what a browser would draw, checked without a browser."""

from __future__ import annotations

import asyncio
import json
import os
import re
import signal
import subprocess
import sys
import threading
import urllib.error
import urllib.request
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused
from synthetic import FEET, JOINTS, URDF, WEIGHT, synthetic_trace, with_run

from hexapod_pin.errors import ParameterError, ViewerError
from hexapod_pin.results.trace import Trace
from hexapod_pin.view import live_viewer, view, write_html
from hexapod_pin.view.scene_graph import animation_command, frame_samples, scene_commands

ROUNDED = 1e-6  # what a file's numbers are rounded to [m], [rad]


@pytest.fixture(scope="module")
def trace() -> Trace:
    """A walk with a tilted, moving trunk and joints that all differ."""
    still = synthetic_trace(duration=1.0)
    q, time = np.array(still.q), still.time
    q[:, 1] = -0.3 * time
    q[:, 3:7] = np.stack([0.1 * time, 0.0 * time, 0.2 * time, 1.0 + 0.0 * time], axis=1)
    q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
    q[:, 7:] = np.sin(time[:, None] + np.arange(len(JOINTS)))
    force = np.array(still.foot_force)
    force[:, 0] = (3.0, -4.0, 12.0)
    force[:, 1] = 0.0
    force[:, 2] = (0.0, 0.0, -2.0)
    return replace(still, q=q, foot_force=force)


@pytest.fixture(scope="module")
def page(trace: Trace, tmp_path_factory: pytest.TempPathFactory) -> str:
    """The HTML file of that walk."""
    path = write_html(trace, tmp_path_factory.mktemp("html") / "walk.html", force_scale=0.01)
    return path.read_text(encoding="utf-8")


def embedded(page: str) -> Any:
    """Return the data in a page."""
    found = re.search(r'<script id="trace" type="application/json">(.*?)</script>', page, re.S)
    assert found
    return json.loads(found[1])


def track(animation: Any, path: str, name: str) -> np.ndarray:
    """Return one track of an animation, (frames, values)."""
    [clip] = [clip["clip"] for clip in animation["animations"] if clip["path"] == path]
    [found] = [row for row in clip["tracks"] if row["name"] == f".{name}"]
    return np.array(found["values"]).reshape(-1, 4 if name == "quaternion" else 3)


# --- the file -----------------------------------------------------------------------------------


class Loads(HTMLParser):
    """Collects every address that a page would load, and its elements."""

    def __init__(self, page: str) -> None:
        """Parse the page."""
        super().__init__()
        self.addresses: list[str] = []
        self.policy = ""
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note src, href and the like."""
        values = dict(attrs)
        self.addresses += [f"{tag} {values[key]}" for key in ("src", "href") if key in values]
        if values.get("http-equiv") == "Content-Security-Policy":
            self.policy = values["content"] or ""


def test_the_page_loads_nothing(page: str) -> None:
    """No element refers outside, and the page forbids itself every connection but data in it."""
    loads = Loads(page)
    assert loads.addresses == []
    assert "default-src 'none'" in loads.policy
    assert "http" not in loads.policy


def test_the_page_holds_viewer_scene_and_motion(page: str, trace: Trace) -> None:
    data = embedded(page)
    assert "MeshCat.Viewer" in page
    assert "Permission is hereby granted" in page  # the viewer's licence travels with it
    assert len(data["times"]) == 31  # 1 s at 30 pictures per second, both ends
    assert "pictures per second" not in page  # the note on a long walk
    assert data["animation"]["options"]["play"] is True
    assert data["animation"]["options"]["repetitions"] > 1000
    assert sum(c["type"] == "set_object" for c in data["scene"]) > 25


def test_names_cannot_break_out_of_the_page(tmp_path: Path) -> None:
    trace = synthetic_trace(duration=0.1, name="</script><img src=x>", assumed=["a < b"])
    urdf = str(trace.run.robot.urdf).replace("lf_foot", "lf&lt;script&gt;_foot")
    names = ("lf<script>_foot", *FEET[1:])
    trace = with_run(replace(trace, foot_names=names), urdf=urdf)
    page = write_html(trace, tmp_path / "odd.html").read_text()
    assert Loads(page).addresses == []
    assert any("lf<script>" in clip["path"] for clip in embedded(page)["animation"]["animations"])
    assert "a &lt; b" in page


def test_poses_are_pinocchios_forward_kinematics(page: str, trace: Trace) -> None:
    """Each body of each picture stands where Pinocchio puts it for the nearest sample."""
    data, animation = embedded(page), embedded(page)["animation"]
    model = pin.buildModelFromUrdf(str(URDF), pin.JointModelFreeFlyer())
    state = model.createData()
    order = [JOINTS.index(name) for name in model.names[2:]]
    for frame in (0, 7, 30):
        sample = int(np.argmin(np.abs(trace.time - data["times"][frame])))
        q = np.concatenate([trace.q[sample, :7], trace.q[sample, 7:][order]])
        pin.framesForwardKinematics(model, state, q)
        for name in ("root_joint", "lf_coxa_joint", "rm_femur_joint", "rr_tibia_joint"):
            expected = state.oMi[model.getJointId(name)]
            path = f"/meshcat/robot/{name}"
            position = track(animation, path, "position")[frame]
            np.testing.assert_allclose(position, expected.translation, atol=ROUNDED)
            drawn = pin.Quaternion(track(animation, path, "quaternion")[frame]).matrix()
            np.testing.assert_allclose(drawn, expected.rotation, atol=4 * ROUNDED)


def test_a_body_carries_its_visuals(trace: Trace) -> None:
    """The trunk is the URDF's box; the tibia's cylinder axis and colour are the URDF's."""
    objects = {c["path"]: c["object"] for c in scene_commands(trace) if c["type"] == "set_object"}
    trunk = objects["/meshcat/robot/root_joint/0"]
    geometry = trunk["geometries"][0]
    size = [geometry[key] for key in ("width", "height", "depth")]
    np.testing.assert_allclose(size, [0.495, 0.205, 0.089])
    assert geometry["type"] == "BoxGeometry"
    assert trunk["materials"][0]["color"] == 0x526173  # rgba 0.32 0.38 0.45
    assert len([path for path in objects if "/robot/lf_tibia_joint/" in path]) == 2  # shin, foot


def test_cylinders_lie_along_z() -> None:
    """URDF cylinders extend along z, three.js' along y."""
    urdf = """<robot name="r"><link name="b"><visual><origin xyz="0 0 1"/><geometry>
        <cylinder radius="0.1" length="0.5"/></geometry></visual></link></robot>"""
    trace = replace(
        synthetic_trace(duration=0.1, urdf=urdf),
        **{name: np.zeros((11, 0)) for name in ("torque", "q_ref", "v_ref")},
        q=synthetic_trace(duration=0.1).q[:, :7],
        v=np.zeros((11, 6)),
        joint_names=(),
    )
    objects = {c["path"]: c["object"] for c in scene_commands(trace) if c["type"] == "set_object"}
    shape = objects["/meshcat/robot/root_joint/0"]
    pose = np.array(shape["object"]["matrix"]).reshape(4, 4).T
    np.testing.assert_allclose(pose @ [0, 1, 0, 0], [0, 0, 1, 0], atol=1e-9)
    np.testing.assert_allclose(pose[:3, 3], [0, 0, 1])
    assert shape["geometries"][0]["height"] == 0.5


def test_bodies_without_primitives_become_sticks() -> None:
    """Without visuals each link is drawn from its joint to the next and to its foot.

    The trunk is a box around its hips, too.
    """
    text = re.sub(r"<visual>.*?</visual>", "", URDF.read_text(), flags=re.S)
    mesh = '<visual><geometry><mesh filename="package://x/y.stl"/></geometry></visual>'
    text = text.replace('<link name="lf_coxa">', f'<link name="lf_coxa">{mesh}')
    trace = synthetic_trace(duration=0.1, urdf=text)
    paths = [c["path"] for c in scene_commands(trace) if c["type"] == "set_object"]
    assert len([path for path in paths if "/robot/root_joint/" in path]) == 7
    assert len([path for path in paths if "/robot/lf_coxa_joint/" in path]) == 1
    assert len([path for path in paths if "/robot/lf_tibia_joint/" in path]) == 2


def test_the_ground_ends_where_the_feet_stand() -> None:
    """The slab's top is the height of the feet less radius and gap: 0, or a raised floor."""
    trace = synthetic_trace(duration=0.1)
    for height in (0.0, 0.7):
        lifted = replace(trace, foot_position=trace.foot_position + np.array([0, 0, height]))
        [slab] = [c["object"] for c in scene_commands(lifted) if c["path"].endswith("slab")]
        top = slab["object"]["matrix"][14] + 0.5 * slab["geometries"][0]["depth"]
        assert top == pytest.approx(height, abs=1e-9)


def test_arrows_show_force_size_and_direction(page: str, trace: Trace) -> None:
    """0.01 m/N: |(3, -4, 12)| = 13 N is 0.13 m long and points along the force."""
    animation, frame = embedded(page)["animation"], 10
    expected = {0: (3.0, -4.0, 12.0), 2: (0.0, 0.0, -2.0), 3: (0.0, 0.0, WEIGHT / 6)}
    for foot, force in expected.items():
        path = f"/meshcat/forces/{FEET[foot]}"
        length = track(animation, path, "scale")[frame, 2]
        turn = pin.Quaternion(track(animation, path, "quaternion")[frame]).matrix()
        np.testing.assert_allclose(turn[:, 2] * length * 100.0, force, atol=100 * ROUNDED)
        start = track(animation, path, "position")[frame]
        sample = int(np.argmin(np.abs(trace.time - embedded(page)["times"][frame])))
        contact = trace.foot_position[sample, foot] - (0.0, 0.0, 0.01)
        np.testing.assert_allclose(start, contact, atol=ROUNDED)
    assert np.all(track(animation, f"/meshcat/forces/{FEET[1]}", "scale") <= ROUNDED)


def test_the_camera_follows_the_trunk(page: str, trace: Trace) -> None:
    """The world moves so that the trunk stays over the point that the camera looks at."""
    animation = embedded(page)["animation"]
    world = track(animation, "/meshcat", "position")
    trunk = track(animation, "/meshcat/robot/root_joint", "position")
    np.testing.assert_allclose((world + trunk)[:, :2], 0.0, atol=2 * ROUNDED)
    np.testing.assert_allclose((world + trunk)[0], 0.0, atol=2 * ROUNDED)
    assert trunk[-1, 1] == pytest.approx(-0.3, abs=ROUNDED)


def test_frames_are_nearest_samples_each_once() -> None:
    trace = synthetic_trace(duration=1.0, sample=0.01)
    np.testing.assert_array_equal(frame_samples(trace, 50.0), np.arange(0, 101, 2))
    np.testing.assert_array_equal(frame_samples(trace, 1000.0), np.arange(101))
    one = frame_samples(synthetic_trace(duration=0.0), 30.0)
    assert one.tolist() == [0]


def test_speed_changes_times_only(trace: Trace) -> None:
    slow, usual = animation_command(trace, speed=0.5), animation_command(trace, loop=False)
    times = [c["animations"][1]["clip"]["tracks"][0]["times"] for c in (slow, usual)]
    np.testing.assert_allclose(times[0], 2.0 * np.array(times[1]))
    assert usual["options"]["repetitions"] == 1


def test_a_single_sample_can_be_shown() -> None:
    """A run stopped at once still has a picture: two equal frames."""
    animation = animation_command(synthetic_trace(duration=0.0))
    assert len(animation["animations"][0]["clip"]["tracks"][0]["times"]) == 2


@pytest.mark.parametrize("name", ["q", "foot_position", "foot_force"])
def test_what_is_not_finite_is_refused_with_its_sample(trace: Trace, name: str) -> None:
    values = np.array(getattr(trace, name))
    values[50, 0] = np.nan
    with refused(ViewerError, about=("50", "0.5")) as caught:
        animation_command(replace(trace, **{name: values}), fps=100.0)
    assert str(caught.value).split()[0] == name


def test_bad_requests_are_refused(trace: Trace, tmp_path: Path) -> None:
    for name in ("fps", "force_scale"):
        with refused(ParameterError, name, 0.0):
            write_html(trace, tmp_path / "x.html", **{name: 0.0})
    with refused(ParameterError, "speed", float("nan")):
        animation_command(trace, speed=float("nan"))
    with refused(ViewerError, about=("URDF",)) as caught:
        write_html(synthetic_trace(urdf="no robot"), tmp_path / "x.html")
    assert caught.value.__cause__ is not None  # what reads the URDF has the reason
    other = replace(trace, joint_names=("knee", *JOINTS[1:]))
    with refused(ViewerError, about=("'knee'",)):
        write_html(other, tmp_path / "x.html")
    assert os.listdir(tmp_path) == []


# --- live ---------------------------------------------------------------------------------------


async def first_messages(url: str, count: int) -> list[Any]:
    """Return what a browser receives when it connects."""
    import umsgpack
    from tornado.websocket import websocket_connect

    connection = await websocket_connect(url.replace("http", "ws").replace("static/", ""))
    messages = [await asyncio.wait_for(connection.read_message(), 10) for _ in range(count)]
    connection.close()
    await connection.read_message()
    return [umsgpack.unpackb(message) for message in messages]


def test_a_browser_that_comes_late_gets_scene_and_motion(trace: Trace) -> None:
    """On this machine only, and nothing listens afterwards."""
    expected = scene_commands(trace)
    with live_viewer(trace, port=0) as viewer:
        assert viewer.url.startswith("http://127.0.0.1:")
        with urllib.request.urlopen(viewer.url, timeout=10) as answer:
            assert b"MeshCat" in answer.read()
        received = asyncio.run(first_messages(viewer.url, len(expected) + 1))
    assert sorted(m["type"] for m in received) == sorted(
        c["type"] for c in [*expected, {"type": "set_animation"}]
    )
    [animation] = [m for m in received if m["type"] == "set_animation"]
    assert animation["animations"] == animation_command(trace, fps=60.0)["animations"]
    with pytest.raises(urllib.error.URLError):
        urllib.request.urlopen(viewer.url, timeout=10)
    assert "viewer" not in [thread.name for thread in threading.enumerate()]


def test_a_taken_port_is_a_viewer_error(trace: Trace) -> None:
    with live_viewer(trace) as viewer:
        port = int(viewer.url.split(":")[2].split("/")[0])
        with refused(ViewerError, about=(str(port),)), live_viewer(trace, port=port):
            pass


def test_view_says_where_and_ends(trace: Trace, capsys: pytest.CaptureFixture[str]) -> None:
    view(trace, duration=0.05, open_browser=False)
    assert re.search(r"Playing at http://127\.0\.0\.1:\d+/static/", capsys.readouterr().out)


def test_a_killed_process_leaves_no_server() -> None:
    """SIGKILL allows no clean-up; the server must end all the same."""
    code = """
from synthetic import synthetic_trace
from hexapod_pin.view import view
view(synthetic_trace(duration=0.1), open_browser=False)
"""
    search = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    run = subprocess.Popen(
        [sys.executable, "-W", "ignore", "-c", code], stdout=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONPATH": search},
    )  # fmt: skip
    with run:
        assert run.stdout is not None
        url = run.stdout.readline().split()[2]
        urllib.request.urlopen(url, timeout=10).close()
        run.send_signal(signal.SIGKILL)
    with pytest.raises(urllib.error.URLError):
        urllib.request.urlopen(url, timeout=10)
