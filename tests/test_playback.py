"""Playback: what a page holds, checked without a browser."""

from __future__ import annotations

import os
import re
import threading
import urllib.error
import urllib.request
from dataclasses import replace
from pathlib import Path

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
    still = synthetic_trace(duration=1.0)
    q, time, force = np.array(still.q), still.time, np.array(still.foot_force)
    q[:, 1] = -0.3 * time
    tilt = np.stack([0.1 * time, 0.0 * time, 0.2 * time, 1.0 + 0.0 * time], axis=1)
    q[:, 3:7] = tilt / np.linalg.norm(tilt, axis=1, keepdims=True)
    q[:, 7:] = np.sin(time[:, None] + np.arange(len(JOINTS)))
    force[:, :3] = (3.0, -4.0, 12.0), (0.0, 0.0, 0.0), (0.0, 0.0, -2.0)
    return replace(still, q=q, foot_force=force)


@pytest.fixture(scope="module")
def page(trace: Trace, tmp_path_factory: pytest.TempPathFactory) -> str:
    path = write_html(trace, tmp_path_factory.mktemp("html") / "walk.html", force_scale=0.01)
    return path.read_text(encoding="utf-8")


def test_a_block_gives_back_every_number_within_half_its_resolution() -> None:
    """Smooth, jumping, constant, huge and missing numbers, of one, two and four bytes."""
    random, time = np.random.default_rng(3), np.linspace(0.0, 2.0, 400)
    holes = np.where(random.random((60, 1)) < 0.3, -np.inf, random.normal(size=(60, 1)))
    given = [
        (np.stack([np.sin(3.0 * time), 1e3 * time**2], axis=1), 1e-4, 2),
        (random.normal(size=(50, 6)) * 1e4, 1e-2, 2), (np.zeros((7, 1)), 1e-5, 2),
        (holes, 1e-3, 1), (np.arange(5000.0)[:, None] % 700, 1.0, 1),
        (np.array([[1e15], [-1e15], [3.0]]), 1e-9, 2),
    ]  # fmt: skip
    block = SampleBlock()
    for values, resolution, order in given:
        block.add(values, resolution, order=order)
    found = unpacked(block.content, block.table)
    assert [entry["wide"] for entry in block.table[:3]] == [2, 4, 1]
    assert 1e5 < block.table[5]["resolution"] < 1e9  # what whole numbers of four bytes can hold
    for (values, _, _), entry, back in zip(given, block.table, found, strict=True):
        expected = np.where(np.isfinite(values), values, np.nan)
        bound = 0.5 * entry["resolution"] * (1.0 + 1e-9) + 1e-12 * np.nanmax(np.abs(expected))
        np.testing.assert_allclose(back, expected, atol=bound, rtol=0.0)


def test_the_page_is_whole_and_loads_nothing(page: str) -> None:
    loads = Loads(page)
    assert loads.addresses == []
    assert "default-src 'none'" in loads.policy and "http" not in loads.policy
    folder = Path(html.__file__).parent / "page"
    assert {path.name for path in folder.iterdir()} == {*SCRIPTS, "page.html", "page.css"}
    assert all(page_file(name) in page for name in (*SCRIPTS, "page.css"))
    assert "@@" not in page and "Permission is hereby granted" in page
    assert len(page) < 450_000  # 290 kB of it are the viewer


def test_every_sample_is_in_the_page(page: str, trace: Trace) -> None:
    data = PageData(page)
    for name, values in {
        "time": trace.time[:, None], "place": trace.q[:, :3], "turn": trace.q[:, 3:7],
        "angle": trace.q[:, 7:], "speed": trace.v[:, 6:], "torque": trace.torque,
        "force": trace.foot_force.reshape(101, -1), "foot": trace.foot_position.reshape(101, -1),
        "down": trace.contact, "com": trace.com,
    }.items():  # fmt: skip
        bound = 0.501 * data.resolution(name)
        np.testing.assert_allclose(data.channel(name), values, atol=bound, rtol=0.0)
    assert data.resolution("angle") == 1e-4 and data.resolution("torque") == 1e-3


def test_limits_are_those_that_acted_and_currents_have_the_gears_losses() -> None:
    robot = hp.load_robot("kharagpur")
    weak = hp.Motor(stall_torque=4.0, no_load_speed=5.0, voltage_ratio=0.5, peak_torque=1.5)
    strong = hp.Motor(stall_torque=8.0, no_load_speed=6.0, torque_constant=0.01, gear_ratio=200.0)
    servo = hp.Servo(kp=40.0, kd=0.8, motor={"femur": strong, "lf_femur_joint": weak})
    scene = hp.Scene(robot, servo=servo)
    still = hp.simulate(scene, hp.HoldPosture(), duration=0.2, step=1e-3, estimate=False)
    [run] = PageData(page_text({"": still})).runs
    limits, effort = run["limits"], still.run.robot.effort(18)
    names = still.joint_names
    for j, (name, kind) in enumerate(zip(names, run["kinds"], strict=True)):
        expected = [None, 0.0, effort[j], None]
        if name == "lf_femur_joint":
            expected = [2.0, 0.8, 1.5, None]
        elif kind == "femur":
            expected = [8.0, 8.0 / 6.0, effort[j], pytest.approx(0.5)]
        assert [limits[key][j] for key in ("stall", "slope", "cap", "per_torque")] == expected
    record = hp.load_catalog().get("MX-64", 12.0)
    judged = PageData(page_text({"": still}, motor=record))
    kinds = tuple(run["kinds"])
    samples = (still.time, still.torque, still.v[:, 6:])
    demand = JointDemand.of_samples(*samples, joint_names=names, joint_kinds=kinds)
    expected = motor_current(demand, Motors.of(kinds, record, Derating()))
    np.testing.assert_allclose(judged.channel("motor_current"), expected, atol=5.1e-4)


def test_sliding_joints_have_forces(tmp_path: Path) -> None:
    scene = hp.Scene(load(legged(spring=True), tmp_path))
    trace = hp.simulate(scene, hp.HoldPosture(), duration=0.1, estimate=False)
    rows = {row["key"]: row for row in PageData(page_text({"": trace})).runs[0]["worst"]}
    assert (rows["slide torque"]["unit"], rows["slide speed"]["unit"]) == ("N", "m/s")
    assert (rows["coxa torque"]["unit"], rows["coxa speed"]["unit"]) == ("N m", "rad/s")


def test_the_least_margin_is_of_a_robot_that_stands(trace: Trace) -> None:
    """Of one that is set down, from the first sample on that its feet carry it stably."""
    margin, feet = np.full(len(trace.time), 0.04), [{} for _ in trace.foot_names]
    margin[:5], margin[40] = (-np.inf, -0.2, -0.1, 0.01, 0.03), 0.005

    def least(margin: np.ndarray) -> tuple[float, float]:
        rows = worst_instants(trace, limits_of(trace, None), feet, None, margin)
        return next((row["value"], row["time"]) for row in rows if row["key"] == "margin")

    assert least(margin) == (0.005, trace.time[40])
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
    # texts become nodes, never markup
    assert not any(re.search("innerHTML|insertAdjacent", page_file(name)) for name in SCRIPTS)


def test_the_tree_is_pinocchios_forward_kinematics(page: str, trace: Trace) -> None:
    data = PageData(page)
    model = pin.buildModelFromUrdf(str(URDF), pin.JointModelFreeFlyer())
    state, order = model.createData(), [JOINTS.index(name) for name in model.names[2:]]
    for sample in (23, 100):
        q = trace.q[sample]
        pin.forwardKinematics(model, state, np.concatenate([q[:7], q[7:][order]]))
        place, turn, angle = (data.channel(n)[sample] for n in ("place", "turn", "angle"))
        poses = [pin.SE3(pin.Quaternion(turn / np.linalg.norm(turn)).matrix(), place)]
        for body in data.runs[0]["tree"][1:]:
            base = pin.SE3(pin.Quaternion(np.array(body["turn"])).matrix(), np.array(body["place"]))
            bend = pin.AngleAxis(angle[body["joint"]], np.array(body["axis"])).matrix()
            poses.append(poses[body["parent"]] * base * pin.SE3(bend, np.zeros(3)))
            expected = state.oMi[model.getJointId(body["name"])]
            # angles are rounded to 5e-5 rad, and the legs reach 0.3 m
            np.testing.assert_allclose(poses[-1].translation, expected.translation, atol=6e-5)
            np.testing.assert_allclose(poses[-1].rotation, expected.rotation, atol=2.1e-4)


def test_a_body_carries_its_visuals(page: str) -> None:
    data = PageData(page)
    [trunk] = data.shapes("root_joint")
    size = [trunk[key] for key in ("width", "height", "depth")]
    np.testing.assert_allclose(size, [0.495, 0.205, 0.089])
    assert trunk["color"] == 0x526173  # rgba 0.32 0.38 0.45
    assert len(data.shapes("lf_tibia_joint")) == 2  # shin, foot
    urdf = """<robot name="r"><link name="b"><visual><origin xyz="0 0 1"/><geometry>
        <cylinder radius="0.1" length="0.5"/></geometry></visual></link></robot>"""
    [shape] = RobotShapes(urdf, {}).bodies["root_joint"]
    np.testing.assert_allclose(shape.rotation @ [0, 1, 0], [0, 0, 1], atol=1e-9)
    np.testing.assert_allclose(shape.position, [0, 0, 1])


def test_bodies_without_primitives_become_sticks() -> None:
    text = re.sub(r"<visual>.*?</visual>", "", URDF.read_text(), flags=re.S)
    mesh = '<visual><geometry><mesh filename="package://x/y.stl"/></geometry></visual>'
    text = text.replace('<link name="lf_coxa">', f'<link name="lf_coxa">{mesh}')
    found = PageData(page_text({"": synthetic_trace(duration=0.1, urdf=text)}))
    counts = [len(found.shapes(n)) for n in ("root_joint", "lf_coxa_joint", "lf_tibia_joint")]
    assert counts == [7, 1, 2]
    assert any("mesh not drawn: package://x/y.stl" in note for note in found.plain["notes"])


def test_bad_requests_are_refused(trace: Trace, tmp_path: Path) -> None:
    values = np.array(trace.foot_force)
    values[50, 0] = np.nan
    other = replace(trace, joint_names=("knee", *JOINTS[1:]))
    for bad, *about in (
        (replace(trace, foot_force=values), "foot_force", "50", "0.5"),
        (synthetic_trace(urdf="no robot"), "URDF"), (other, "'knee'"),
    ):  # fmt: skip
        with refused(ViewerError, about=tuple(about)):
            write_html(bad, tmp_path / "x.html")
    with refused(ParameterError, "force_scale", 0.0):
        write_html(trace, tmp_path / "x.html", force_scale=0.0)
    assert os.listdir(tmp_path) == []


def test_a_browser_gets_the_page(trace: Trace, capsys: pytest.CaptureFixture[str]) -> None:
    with live_viewer(trace, port=0, speed=0.5, loop=False) as viewer:
        assert viewer.url.startswith("http://127.0.0.1:")
        with urllib.request.urlopen(viewer.url, timeout=10) as answer:
            found = PageData(answer.read().decode())
        with pytest.raises(urllib.error.HTTPError):
            urllib.request.urlopen(viewer.url + "other", timeout=10)
        port = int(viewer.url.split(":")[2].split("/")[0])
        with refused(ViewerError, about=(str(port),)), live_viewer(trace, port=port):
            pass
    assert (found.plain["speed"], found.plain["loop"]) == (0.5, False)
    with pytest.raises(urllib.error.URLError):
        urllib.request.urlopen(viewer.url, timeout=10)
    assert "viewer" not in [thread.name for thread in threading.enumerate()]
    view(trace, duration=0.05, open_browser=False)
    assert re.search(r"Playing at http://127\.0\.0\.1:\d+/ ", capsys.readouterr().out)
