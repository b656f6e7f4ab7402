"""Runs next to each other in one page: in step, in lanes of their own, with their names."""

from __future__ import annotations

import base64
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from refusals import refused
from synthetic import URDF, synthetic_trace

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError, TraceFileError, ViewerError
from hexapod_pin.results.run_record import RunCase
from hexapod_pin.results.trace import Trace
from hexapod_pin.view import write_html, write_side_by_side

ROUNDED = 1e-6  # what a file's numbers are rounded to [m]


def embedded(path: Path) -> Any:
    """Return the data in a page."""
    page = path.read_text(encoding="utf-8")
    found = re.search(r'<script id="trace" type="application/json">(.*?)</script>', page, re.S)
    assert found
    return json.loads(found[1])


def track(data: Any, path: str) -> np.ndarray:
    """Return the positions of a path in the animation, (frames, 3)."""
    [clip] = [c["clip"] for c in data["animation"]["animations"] if c["path"] == path]
    [found] = [row for row in clip["tracks"] if row["name"] == ".position"]
    return np.array(found["values"]).reshape(-1, 3)


def in_picture(data: Any, run: int, part: str = "robot/root_joint") -> np.ndarray:
    """Return where a part of a run is in the picture, (frames, 3) [m]."""
    root = f"/meshcat/run{run}"
    return track(data, root) + track(data, f"{root}/{part}")


@pytest.fixture(scope="module")
def traces() -> dict[str, Trace]:
    """Three glides along x: one slower, one that ends early."""
    return {
        "plain": synthetic_trace(duration=1.0, speed=0.4),
        "slow": synthetic_trace(duration=1.0, speed=0.1),
        "short": synthetic_trace(duration=0.5, speed=0.4),
    }


@pytest.fixture(scope="module")
def data(traces: dict[str, Trace], tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The page's data."""
    return embedded(write_side_by_side(traces, tmp_path_factory.mktemp("page") / "runs.html"))


def test_runs_play_in_step_and_keep_what_lies_between_them(data: Any, traces: Any) -> None:
    """At each picture the trunks are as far apart in x as in their traces, in y a lane apart."""
    times = np.array(data["times"])
    assert len(times) == 31
    trunks = [in_picture(data, k) for k in range(3)]
    assert sum(trunks)[:, 0] == pytest.approx(0.0, abs=3 * ROUNDED)  # the camera follows the mean
    for k, (speed, end) in enumerate(((0.4, 1.0), (0.1, 1.0), (0.4, 0.5))):
        sample = np.minimum(np.round(times, 2), end)  # samples are 10 ms apart
        apart = (trunks[k] - trunks[0])[:, 0]
        assert apart == pytest.approx(speed * sample - 0.4 * np.round(times, 2), abs=2e-3)
    lanes = [trunk[0, 1] for trunk in trunks]
    assert lanes[0] > lanes[1] > lanes[2]  # the first on the left of those that walk along +x
    assert lanes[0] - lanes[1] == pytest.approx(lanes[1] - lanes[2], abs=ROUNDED)


def test_grounds_do_not_overlap(data: Any) -> None:
    """Slabs of neighbours leave a gap, and every foot's arrow stands on its own."""
    sides = []
    for k in range(3):
        path = f"/meshcat/run{k}/ground/slab"
        [slab] = [c["object"] for c in data["scene"] if c.get("path") == path]
        middle = slab["object"]["matrix"][13] + track(data, f"/meshcat/run{k}")[0, 1]
        half = 0.5 * slab["geometries"][0]["height"]
        sides.append((middle - half, middle + half))
        feet = [c["path"] for c in data["animation"]["animations"] if f"run{k}/forces" in c["path"]]
        assert len(feet) == 6
        for foot in feet:
            y = in_picture(data, k, foot.removeprefix(f"/meshcat/run{k}/"))[:, 1]
            assert (y > sides[k][0]).all() and (y < sides[k][1]).all()
    assert sides[0][0] > sides[1][1] and sides[1][0] > sides[2][1]


def test_labels_float_above_their_robots(data: Any) -> None:
    for k, name in enumerate(("plain", "slow", "short")):
        path = f"/meshcat/run{k}/label"
        [label] = [c["object"] for c in data["scene"] if c.get("path") == path]
        assert label["textures"][0]["text"] == name
        assert label["materials"][0]["map"] == label["textures"][0]["uuid"]
        up = in_picture(data, k, "label") - in_picture(data, k)
        assert up[:, :2] == pytest.approx(0.0, abs=2 * ROUNDED) and (up[:, 2] > 0.2).all()
        axes = np.array(label["object"]["matrix"]).reshape(4, 4).T[:3, :3]
        assert axes @ [0, 1, 0] == pytest.approx([0, 0, 1])  # upright
        assert axes @ [0, 0, 1] == pytest.approx([-1, 0, 0])  # read from behind the robots
        assert np.linalg.det(axes) == pytest.approx(1.0)  # not mirrored


def test_the_camera_is_behind_and_sees_the_first_on_the_left(data: Any) -> None:
    [camera] = [c["value"] for c in data["scene"] if "Cameras" in c.get("path", "")]
    place = np.array([camera[0], -camera[2], camera[1]])  # from three.js axes
    assert place[0] < 0.0 < place[2]
    right = np.cross(-place, (0.0, 0.0, 1.0))
    aside = [in_picture(data, k)[0] @ right for k in range(3)]
    assert aside[0] < aside[1] < aside[2]


def test_runs_along_y_lie_beside_each_other_in_x(tmp_path: Path) -> None:
    traces = {}
    for name in ("a", "b"):
        trace = synthetic_trace(duration=0.5, speed=0.0)
        q = np.array(trace.q)
        q[:, 1] = -1.0 * trace.time
        traces[name] = replace(trace, q=q)
    data = embedded(write_side_by_side(traces, tmp_path / "runs.html"))
    a, b = in_picture(data, 0), in_picture(data, 1)
    assert a[:, 1] == pytest.approx(b[:, 1], abs=2 * ROUNDED)
    assert (a[:, 0] > b[:, 0] + 0.6).all()  # left of -y is +x


def test_the_page_is_as_closed_as_that_of_one_run(traces: Any, tmp_path: Path) -> None:
    odd = "</script><img src=x>"
    path = write_side_by_side({odd: traces["plain"], "b": traces["short"]}, tmp_path / "r.html")
    page = path.read_text(encoding="utf-8")
    one = write_html(traces["plain"], tmp_path / "one.html").read_text(encoding="utf-8")
    policy = re.compile(r'http-equiv="Content-Security-Policy" content="([^"]*)"')
    assert policy.findall(page) == policy.findall(one) and "<img" not in page
    assert "from left to right" in page and "b (ends at 0.5 s)" in page
    assert list(tmp_path.glob("*.html")) and len(list(tmp_path.iterdir())) == 2  # nothing else left


def test_refusals(traces: Any, tmp_path: Path) -> None:
    path = tmp_path / "runs.html"
    with refused(ParameterError, "traces"):
        write_side_by_side({}, path)
    with refused(ParameterError, "fps", 0.0, allowed=(1e-3, 1e6)):
        write_side_by_side(traces, path, fps=0.0)
    with refused(ParameterError, "force_scale", -1.0, allowed=(1e-9, 1e3)):
        write_side_by_side(traces, path, force_scale=-1.0)
    q = np.array(traces["slow"].q)
    q[50] = np.nan
    with refused(ViewerError, about=("run 'slow': q", "finite", "50", "0.5")):
        write_side_by_side({**traces, "slow": replace(traces["slow"], q=q)}, path, fps=100.0)
    with pytest.raises(TraceFileError):
        write_side_by_side(traces, tmp_path / "none" / "runs.html")
    assert not path.exists()


def test_runs_share_the_meshes_of_their_robot(tmp_path: Path) -> None:
    """The box of each run is drawn in its own lane, and its arrays are in the file once."""
    trimesh.creation.box((0.1, 0.2, 0.3)).export(tmp_path / "box.stl")
    shape = '<visual><geometry><mesh filename="box.stl"/></geometry></visual>'
    text = re.sub(r'(<link name="[^"]*">)', rf"\1{shape}", URDF.read_text(), count=1)
    settings = hp.Scene(hp.load_robot("kharagpur")).settings
    case = RunCase(settings, robot={"source": (tmp_path / "r.urdf").as_posix()})
    runs = {name: synthetic_trace(duration=0.1, urdf=text, case=case) for name in ("a", "b")}
    data = embedded(write_side_by_side(runs, tmp_path / "runs.html"))
    drawn = {
        command["path"]: geometry["data"]
        for command in data["scene"]
        for geometry in command.get("object", {}).get("geometries", ())
        if "/robot/" in command["path"] and geometry["type"] == "BufferGeometry"
    }
    assert [path.split("/")[2] for path in drawn] == ["run0", "run1"]
    first, second = drawn.values()
    assert first == second
    assert len(data["arrays"]) == 2
    places = np.frombuffer(base64.b64decode(data["arrays"][0]), dtype="<f4").reshape(-1, 3)
    np.testing.assert_allclose(np.ptp(places, axis=0), (0.1, 0.2, 0.3), rtol=1e-6)
