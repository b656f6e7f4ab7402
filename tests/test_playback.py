"""Playback: what a page holds, checked without a browser."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
import urllib.error
import urllib.request
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest
from leg_robots import legged, load
from page_data import Loads, PageData
from refusals import refused
from synthetic import FEET, JOINTS, URDF, synthetic_trace, with_run

import hexapod_pin as hp
from hexapod_pin.drive.catalog.motor_record import Derating
from hexapod_pin.errors import ParameterError, ViewerError
from hexapod_pin.results.sizing.demand import JointDemand
from hexapod_pin.results.sizing.motor_current import motor_current
from hexapod_pin.results.sizing.motors import Motors
from hexapod_pin.results.trace import Trace
from hexapod_pin.view import html, live_viewer, view, write_html
from hexapod_pin.view.html import SCRIPTS, page_file, page_text
from hexapod_pin.view.robot_shapes import RobotShapes
from hexapod_pin.view.sample_block import SampleBlock, unpacked
from hexapod_pin.view.torque_limits import limits_of
from hexapod_pin.view.worst_instants import worst_instants


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


@pytest.fixture(scope="module")
def data(page: str) -> PageData:
    return PageData(page)


# --- the block ----------------------------------------------------------------------------------


def test_a_block_gives_back_every_number_within_half_its_resolution() -> None:
    """Smooth, jumping, constant, huge and missing numbers, of one, two and four bytes."""
    random = np.random.default_rng(3)
    time = np.linspace(0.0, 2.0, 400)
    smooth = np.stack([np.sin(3.0 * time), 1e3 * time**2], axis=1)
    jumping = random.normal(size=(50, 2, 3)) * 1e4
    holes = np.where(random.random(60) < 0.3, -np.inf, random.normal(size=60))
    block = SampleBlock()
    for values, resolution, order in (
        (smooth, 1e-4, 2), (jumping, 1e-2, 2), (np.zeros(7), 1e-5, 2), (holes, 1e-3, 1),
        (np.arange(5000) % 700, 1.0, 1), ([1e15, -1e15, 3.0], 1e-9, 2),
    ):  # fmt: skip
        block.add(values, resolution, order=order)
    found = unpacked(block.content, block.table)
    assert [entry["wide"] for entry in block.table[:3]] == [2, 4, 1]
    for values, entry, back in zip(
        (smooth, jumping.reshape(50, 6), np.zeros((7, 1)), holes[:, None]),
        block.table, found, strict=False,
    ):  # fmt: skip
        expected = np.where(np.isfinite(values), values, np.nan)
        bound = 0.5 * entry["resolution"] * (1.0 + 1e-9) + 1e-12 * np.nanmax(np.abs(expected))
        np.testing.assert_allclose(back, expected, atol=bound, rtol=0.0)
    np.testing.assert_array_equal(found[4][:, 0], np.arange(5000) % 700)
    coarse = block.table[5]["resolution"]  # what whole numbers of four bytes can hold
    assert 1e5 < coarse < 1e9
    np.testing.assert_allclose(found[5][:, 0], [1e15, -1e15, 3.0], atol=0.5 * coarse)


# --- the file -----------------------------------------------------------------------------------


def test_the_page_loads_nothing(page: str) -> None:
    """No element refers outside, and the page forbids itself every connection but data in it."""
    loads = Loads(page)
    assert loads.addresses == []
    assert "default-src 'none'" in loads.policy
    assert "http" not in loads.policy


def test_the_page_is_whole(page: str) -> None:
    """Every file of the package's folder stands in it; the viewer's licence in clear."""
    folder = Path(html.__file__).parent / "page"
    assert {path.name for path in folder.iterdir()} == {*SCRIPTS, "page.html", "page.css"}
    for name in (*SCRIPTS, "page.css"):
        assert page_file(name) in page
    assert "@@" not in page
    assert "Permission is hereby granted" in page
    assert len(page) < 450_000  # 290 kB of it are the viewer


def test_the_viewer_is_parsed_once() -> None:
    """The function that holds three.js is in brackets, the rest is as installed."""
    plain = html.viewer_file("dist/main.min.js")
    bracketed = html.parsed_at_once(plain)
    [found] = re.finditer(r':(\()\(\w,\w,\w\)=>\{"use strict"', bracketed)
    opening = found.start(1)
    half = bracketed[:opening] + bracketed[opening + 1 :]
    closing = next(k for k, (a, b) in enumerate(zip(half, plain, strict=False)) if a != b)
    assert half[closing - 1 : closing + 1] == "})" and closing - opening > 0.7 * len(plain)
    assert half[:closing] + half[closing + 1 :] == plain
    assert html.parsed_at_once("another viewer") == "another viewer"


def test_every_sample_is_in_the_page(data: PageData, trace: Trace) -> None:
    """At the resolution stated, which without a known error is the coarsest."""
    expected = {
        "time": trace.time[:, None], "place": trace.q[:, :3], "turn": trace.q[:, 3:7],
        "angle": trace.q[:, 7:], "speed": trace.v[:, 6:], "torque": trace.torque,
        "force": trace.foot_force.reshape(101, -1), "foot": trace.foot_position.reshape(101, -1),
        "down": trace.contact, "com": trace.com,
    }  # fmt: skip
    for name, values in expected.items():
        bound = 0.501 * data.resolution(name)
        np.testing.assert_allclose(data.channel(name), values, atol=bound, rtol=0.0)
    assert data.resolution("angle") == 1e-4 and data.resolution("torque") == 1e-3


def test_samples_recorded_on_request_are_in_the_page(trace: Trace) -> None:
    """As they are, and NaN where a motor's data are not known."""
    time = trace.time[:, None]
    asked = {"slip_speed": 0.1 * time * np.ones(6), "temperature": 25.0 + time * np.ones(18)}
    asked["temperature"][:, 3] = np.nan
    asking = replace(trace)
    object.__setattr__(asking, "requested", SimpleNamespace(arrays=asked))
    found = PageData(page_text({"": asking}))
    np.testing.assert_allclose(found.channel("slip_speed"), asked["slip_speed"], atol=5.1e-5)
    np.testing.assert_allclose(found.channel("temperature"), asked["temperature"], atol=5.1e-3)


def test_limits_are_those_that_acted_and_currents_have_the_gears_losses() -> None:
    """Motors by kind and by joint, capped by `peak_torque` and the URDF; other joints' limits."""
    robot = hp.load_robot("kharagpur")
    weak = hp.Motor(stall_torque=4.0, no_load_speed=5.0, voltage_ratio=0.5, peak_torque=1.5)
    strong = hp.Motor(stall_torque=8.0, no_load_speed=6.0, torque_constant=0.01, gear_ratio=200.0)
    servo = hp.Servo(kp=40.0, kd=0.8, motor={"femur": strong, "lf_femur_joint": weak})
    still = hp.simulate(
        hp.Scene(robot, servo=servo), hp.HoldPosture(), duration=0.2, step=1e-3, estimate=False
    )
    [run] = PageData(page_text({"": still})).runs
    limits, effort = run["limits"], still.run.robot.effort(18)
    names = still.joint_names
    for j, (name, kind) in enumerate(zip(names, run["kinds"], strict=True)):
        motor = weak if name == "lf_femur_joint" else strong if kind == "femur" else None
        got = [limits[key][j] for key in ("stall", "slope", "cap", "per_torque")]
        if motor is None:
            assert got == [None, 0.0, effort[j], None]
        else:
            stall = motor.stall_torque * motor.voltage_ratio
            cap = min(effort[j], motor.peak_torque or np.inf)
            expected = [stall, motor.stall_torque / motor.no_load_speed, cap]
            assert got[:3] == pytest.approx(expected)
            assert got[3] == (None if motor is weak else pytest.approx(0.5))
    assert limits["name"] == "the motor's line, as simulated"
    assert "femur: stall 8 N m, no load 6 rad/s" in dict(run["facts"])["motor"]
    record = hp.load_catalog().get("MX-64", 12.0)
    judged = PageData(page_text({"": still}, motor=record))
    kinds = tuple(run["kinds"])
    demand = JointDemand.of_samples(
        still.time, still.torque, still.v[:, 6:], joint_names=names, joint_kinds=kinds
    )
    expected = motor_current(demand, Motors.of(kinds, record, Derating()))
    np.testing.assert_allclose(judged.channel("motor_current"), expected, atol=5.1e-4)
    assert "motor_current" not in PageData(page_text({"": still})).runs[0]["channels"]


def test_sliding_joints_have_forces(tmp_path: Path) -> None:
    """Rows of feet on springs are in N and m/s, those of joints that turn in N m and rad/s."""
    robot = load(legged(spring=True), tmp_path)
    trace = hp.simulate(hp.Scene(robot), hp.HoldPosture(), duration=0.1, estimate=False)
    rows = {row["key"]: row for row in PageData(page_text({"": trace})).runs[0]["worst"]}
    units = {"slide": ("slide force", "N", "m/s"), "coxa": ("coxa torque", "N m", "rad/s")}
    for kind, (what, unit, rate) in units.items():
        row = rows[f"{kind} torque"]
        assert (row["what"], row["unit"], rows[f"{kind} speed"]["unit"]) == (what, unit, rate)
        assert trace.joint_names[row["joint"]].endswith("spring_joint") == (kind == "slide")


def test_the_least_margin_is_of_a_robot_that_stands(trace: Trace) -> None:
    """Of one that is set down, from the first sample on that its feet carry it stably."""
    margin = np.full(len(trace.time), 0.04)
    margin[:5] = (-np.inf, -0.2, -0.1, 0.01, 0.03)
    margin[40] = 0.005
    feet = [{} for _ in trace.foot_names]

    def least(margin: np.ndarray) -> tuple[float, float]:
        rows = worst_instants(trace, limits_of(trace, None), feet, None, margin)
        return next((row["value"], row["time"]) for row in rows if row["key"] == "margin")

    assert least(margin) == (0.005, trace.time[40])
    margin[40] = -0.3
    assert least(margin) == (-0.3, trace.time[40])
    assert least(-np.abs(margin[::-1])) == (None, trace.time[-1])  # it never stands


def test_names_cannot_break_out_of_the_page(tmp_path: Path) -> None:
    trace = synthetic_trace(duration=0.1, name="</script><img src=x>", assumed=["a < b"])
    urdf = str(trace.run.robot.urdf).replace("lf_foot", "lf&lt;script&gt;_foot")
    names = ("lf<script>_foot", *FEET[1:])
    trace = with_run(replace(trace, foot_names=names), urdf=urdf)
    page = write_html(trace, tmp_path / "odd.html", command="</script>@@DATA@@").read_text()
    assert Loads(page).addresses == []
    assert "<img" not in page and page.count("</script>") == 4
    data = PageData(page)
    assert data.runs[0]["feet"][0]["name"] == "lf<script>_foot"
    assert data.runs[0]["assumed"] == ["a < b"] and data.plain["command"] == "</script>@@DATA@@"
    for name in SCRIPTS:  # texts become nodes, never markup
        assert "innerHTML" not in page_file(name) and "insertAdjacent" not in page_file(name)


def test_the_tree_is_pinocchios_forward_kinematics(data: PageData, trace: Trace) -> None:
    """Each body stands where Pinocchio puts it: its place on the parent, turned by its angle."""
    model = pin.buildModelFromUrdf(str(URDF), pin.JointModelFreeFlyer())
    state = model.createData()
    order = [JOINTS.index(name) for name in model.names[2:]]
    for sample in (0, 23, 100):
        pin.forwardKinematics(
            model, state, np.concatenate([trace.q[sample, :7], trace.q[sample, 7:][order]])
        )
        place, turn, angle = (data.channel(n)[sample] for n in ("place", "turn", "angle"))
        poses: list[pin.SE3] = []
        for body in data.runs[0]["tree"]:
            if body["joint"] == -1:
                poses.append(pin.SE3(pin.Quaternion(turn / np.linalg.norm(turn)).matrix(), place))
                continue
            base = pin.SE3(pin.Quaternion(np.array(body["turn"])).matrix(), np.array(body["place"]))
            bend = pin.AngleAxis(angle[body["joint"]], np.array(body["axis"])).matrix()
            poses.append(poses[body["parent"]] * base * pin.SE3(bend, np.zeros(3)))
            expected = state.oMi[model.getJointId(body["name"])]
            # angles are rounded to 5e-5 rad, and the legs reach 0.3 m
            np.testing.assert_allclose(poses[-1].translation, expected.translation, atol=6e-5)
            np.testing.assert_allclose(poses[-1].rotation, expected.rotation, atol=2.1e-4)


def test_a_body_carries_its_visuals(data: PageData) -> None:
    """The trunk is the URDF's box; the tibia's cylinder axis and colour are the URDF's."""
    [trunk] = data.shapes("root_joint")
    size = [trunk[key] for key in ("width", "height", "depth")]
    np.testing.assert_allclose(size, [0.495, 0.205, 0.089])
    assert trunk["type"] == "BoxGeometry"
    assert trunk["color"] == 0x526173  # rgba 0.32 0.38 0.45
    assert len(data.shapes("lf_tibia_joint")) == 2  # shin, foot


def test_cylinders_lie_along_z() -> None:
    """URDF cylinders extend along z, three.js' along y."""
    urdf = """<robot name="r"><link name="b"><visual><origin xyz="0 0 1"/><geometry>
        <cylinder radius="0.1" length="0.5"/></geometry></visual></link></robot>"""
    [shape] = RobotShapes(urdf, {}).bodies["root_joint"]
    np.testing.assert_allclose(shape.rotation @ [0, 1, 0], [0, 0, 1], atol=1e-9)
    np.testing.assert_allclose(shape.position, [0, 0, 1])
    assert shape.geometry["height"] == 0.5


def test_bodies_without_primitives_become_sticks() -> None:
    """Without visuals each link is drawn from its joint to the next and to its foot.

    The trunk is a box around its hips, too.
    """
    text = re.sub(r"<visual>.*?</visual>", "", URDF.read_text(), flags=re.S)
    mesh = '<visual><geometry><mesh filename="package://x/y.stl"/></geometry></visual>'
    text = text.replace('<link name="lf_coxa">', f'<link name="lf_coxa">{mesh}')
    found = PageData(page_text({"": synthetic_trace(duration=0.1, urdf=text)}))
    counts = [len(found.shapes(n)) for n in ("root_joint", "lf_coxa_joint", "lf_tibia_joint")]
    assert counts == [7, 1, 2]
    assert any("mesh not drawn: package://x/y.stl" in note for note in found.plain["notes"])


def test_feet_know_their_legs(data: PageData) -> None:
    """Joints from the trunk outwards, and a name without what all feet share."""
    feet = data.runs[0]["feet"]
    assert [foot["label"] for foot in feet] == ["lf", "lm", "lr", "rf", "rm", "rr"]
    for foot in feet:
        names = [JOINTS[k] for k in foot["joints"]]
        assert names == [f"{foot['label']}_{kind}_joint" for kind in ("coxa", "femur", "tibia")]
        body = data.runs[0]["tree"][foot["body"]]
        assert body["joint"] == foot["joints"][-1]


def test_a_single_sample_can_be_shown() -> None:
    """A run stopped at once still has a page, of one sample."""
    found = PageData(page_text({"": synthetic_trace(duration=0.0)}))
    assert found.channel("angle").shape == (1, len(JOINTS))


@pytest.mark.parametrize("name", ["q", "foot_position", "foot_force"])
def test_what_is_not_finite_is_refused_with_its_sample(trace: Trace, name: str) -> None:
    values = np.array(getattr(trace, name))
    values[50, 0] = np.nan
    with refused(ViewerError, about=("50", "0.5")) as caught:
        page_text({"": replace(trace, **{name: values})})
    assert str(caught.value).split()[0] == name


def test_bad_requests_are_refused(trace: Trace, tmp_path: Path) -> None:
    with refused(ParameterError, "force_scale", 0.0):
        write_html(trace, tmp_path / "x.html", force_scale=0.0)
    with refused(ViewerError, about=("URDF",)) as caught:
        write_html(synthetic_trace(urdf="no robot"), tmp_path / "x.html")
    assert caught.value.__cause__ is not None  # what reads the URDF has the reason
    other = replace(trace, joint_names=("knee", *JOINTS[1:]))
    with refused(ViewerError, about=("'knee'",)):
        write_html(other, tmp_path / "x.html")
    assert os.listdir(tmp_path) == []


# --- live ---------------------------------------------------------------------------------------


def test_a_browser_gets_the_page(trace: Trace) -> None:
    """On this machine only, whole, and nothing listens afterwards."""
    with live_viewer(trace, port=0, speed=0.5, loop=False) as viewer:
        assert viewer.url.startswith("http://127.0.0.1:")
        with urllib.request.urlopen(viewer.url, timeout=10) as answer:
            found = PageData(answer.read().decode())
        with pytest.raises(urllib.error.HTTPError):
            urllib.request.urlopen(viewer.url + "other", timeout=10)
    assert (found.plain["speed"], found.plain["loop"]) == (0.5, False)
    assert len(found.channel("time")) == len(trace.time)
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
    assert re.search(r"Playing at http://127\.0\.0\.1:\d+/ ", capsys.readouterr().out)


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
