"""Files of runs and gaits for other programs, read back by libraries that did not write them."""

from __future__ import annotations

import csv
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
import yaml
from refusals import refused
from rosbags.highlevel import AnyReader
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation
from synthetic import synthetic_trace
from typer.testing import CliRunner

import hexapod_pin as hp
from hexapod_pin.arrays import same_bits
from hexapod_pin.commands.app import app
from hexapod_pin.errors import JointRangeError, NotRecordedError, ParameterError, TraceFileError
from hexapod_pin.interchange.joint_samples import joint_samples
from hexapod_pin.interchange.ros_messages import header, write_messages
from hexapod_pin.interchange.servo_ticks import SERVOS, _mounts, _named
from hexapod_pin.results.recorded_robot import RecordedRobot

GAIT = hp.Gait.tripod(stroke=0.06, cycle_time=0.8)


@pytest.fixture(scope="module")
def trace() -> hp.Trace:
    scene, control = hp.Scene(hp.load_robot("kharagpur")), hp.KinematicControl(GAIT, stop_at=2.64)
    return hp.simulate(scene, control, duration=2.7, sample=0.01, accuracy=1e-3)


@pytest.fixture(scope="module")
def plan() -> hp.motion.WalkPlan:
    return hp.motion.WalkPlan(hp.load_robot("kharagpur"), GAIT)


@pytest.fixture(scope="module")
def walk_file(trace: hp.Trace, tmp_path_factory) -> Path:
    return hp.interchange.write_mcap(trace, tmp_path_factory.mktemp("mcap") / "walk.mcap")


def messages(path: Path) -> dict[str, list[Any]]:
    found: dict[str, list[Any]] = {}
    with AnyReader([path]) as reader:
        for connection, time, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            found.setdefault(connection.topic, []).append((time, message))
    return found


def test_what_is_read_back_is_what_was_written_to_the_bit(trace: hp.Trace, walk_file: Path) -> None:
    read = hp.interchange.read_mcap(walk_file)
    for name in ("time", "q", "v", "torque", "q_ref", "v_ref", "com", "foot_force"):
        assert same_bits(getattr(read, name), getattr(trace, name)), name
    assert (read.joint_names, read.foot_names) == (trace.joint_names, trace.foot_names)
    assert read.urdf == trace.run.robot.urdf
    assert read.metadata["verdict"] == hp.walk_verdict(trace).line
    again = hp.interchange.write_mcap(trace, walk_file.with_name("again.mcap"))
    assert again.read_bytes() == walk_file.read_bytes()
    found = messages(walk_file)
    states = found["/joint_states"]
    assert [t for t, _ in states] == [round(t * 1e9) for t in trace.time]
    for field, values in (
        ("position", trace.q[:, 7:]), ("velocity", trace.v[:, 6:]), ("effort", trace.torque),
    ):  # fmt: skip
        assert same_bits(np.array([getattr(m, field) for _, m in states]), np.array(values))
    wrenches = [m.wrench.force for _, m in found[f"/foot_force/{trace.foot_names[2]}"]]
    force = np.array([(f.x, f.y, f.z) for f in wrenches])
    assert same_bits(force, np.array(trace.foot_force[:, 2]))
    twists = [m.twist.twist for _, m in found["/odom"]]
    moved = [(t.linear.x, t.linear.y, t.linear.z, t.angular.x) for t in twists]
    assert same_bits(np.array(moved), np.array(trace.v[:, :4]))
    assert found["/verdict"][0][1].status[0].message.startswith("kharagpur walks")


def test_the_transforms_place_links_where_pinocchio_has_them(trace, walk_file: Path) -> None:
    found = messages(walk_file)
    model = RecordedRobot.of(trace).model
    still = {t.child_frame_id: t for _, m in found["/tf_static"] for t in m.transforms}
    at, message = found["/tf"][40]
    k = int(np.argmin(np.abs(trace.time * 1e9 - at)))
    tree = {**still, **{t.child_frame_id: t for t in message.transforms}}
    data = model.createData()
    pin.framesForwardKinematics(model, data, np.array(trace.q[k]))

    def place(frame: str) -> np.ndarray[Any, Any]:
        if frame == "world":
            return np.eye(4)
        one = tree[frame]
        turn, move = one.transform.rotation, one.transform.translation
        own = np.eye(4)
        own[:3, :3] = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]).as_matrix()
        own[:3, 3] = move.x, move.y, move.z
        return place(one.header.frame_id) @ own

    links = [(k, f.name) for k, f in enumerate(model.frames) if f.type == pin.FrameType.BODY]
    for number, name in links:  # 1e-12: rounding of a few products of matrices
        assert np.allclose(place(name), data.oMf[number].homogeneous, atol=1e-12), name
    feet = [place(f"{foot}_contact")[:3, 3] for foot in trace.foot_names]
    assert np.array_equal(feet, trace.foot_position[k])


@pytest.fixture(scope="module")
def bare() -> hp.Trace:
    scene = hp.Scene(hp.load_robot("kharagpur"))
    return hp.simulate(scene, hp.HoldPosture(), duration=0.02, record=["motion"])


def test_groups_that_were_not_recorded_and_other_recordings(bare: hp.Trace, tmp_path: Path) -> None:
    found = hp.interchange.read_mcap(hp.interchange.write_mcap(bare, tmp_path / "bare.mcap"))
    assert found.torque is None and found.foot_force is None and found.q_ref is None
    assert same_bits(found.q, bare.q) and found.foot_names == ()
    state = {"name": ["a"], "position": [0.5], "velocity": [], "effort": []}
    name, at = ("/joint_states", "sensor_msgs/JointState"), (1_500_000_000, 2_000_000_000)
    sent = [(*name, t, {"header": header(t), **state}) for t in at]
    own = hp.interchange.read_mcap(write_messages(tmp_path / "own.mcap", sent))
    assert own.time.tolist() == [1.5, 2.0] and own.joint_position.tolist() == [[0.5], [0.5]]
    assert own.joint_velocity is None
    with refused(ParameterError, "McapRecording.base", None):
        _ = own.q


def test_damaged_files_and_odd_endings_are_refused(walk_file: Path, tmp_path: Path) -> None:
    data = walk_file.read_bytes()
    broken = tmp_path / "broken.mcap"
    for content in (b"", data[: len(data) // 2], data[:600] + b"\xff" * 64 + data[664:]):
        broken.write_bytes(content)
        with refused(TraceFileError, about=(str(broken),)):
            hp.interchange.read_mcap(broken)
    with refused(TraceFileError):
        hp.interchange.write_mcap(synthetic_trace(duration=1.0, sample=0.1), tmp_path / "a.bag")


def test_a_gait_and_a_run_as_trajectories(plan, trace: hp.Trace, tmp_path: Path) -> None:
    write, timing = hp.interchange.write_joint_trajectory, {"rate": 50.0, "duration": 4.0}
    data = yaml.safe_load(write(plan, tmp_path / "gait.yaml", **timing).read_text())
    assert data["joint_names"] == list(plan.robot.joint_names)
    points = data["points"]
    q, v = (np.array([p[key] for p in points]) for key in ("positions", "velocities"))
    since = [p["time_from_start"] for p in points]
    time = np.array([t["sec"] + t["nanosec"] / 1e9 for t in since])
    assert np.allclose(time, 2.0 + np.arange(201) / 50.0, atol=1e-9)
    [[(_, message)]] = messages(write(plan, tmp_path / "gait.mcap", **timing)).values()
    assert list(message.joint_names) == data["joint_names"]
    assert same_bits(np.array([p.positions for p in message.points]), q)
    assert same_bits(np.array([p.velocities for p in message.points]), v)
    stamps = [p.time_from_start for p in message.points]
    assert [{"sec": t.sec, "nanosec": t.nanosec} for t in stamps] == since
    steady = hp.KinematicControl(GAIT, stop_at=4.0).plan(plan.robot, 4.0).steady_until
    fine = np.linspace(0.0, steady, 700)  # after that the walk prepares to stop
    followed = CubicHermiteSpline(time - 2.0, q, v)(fine)
    assert np.abs(followed - plan.at(fine).q).max() < 2.0 * math.pi / 4096
    assert np.abs(q[-1] - plan.robot.posture).max() < 1e-9 and not v[-1].any()
    path = write(trace, tmp_path / "run.yml", rate=50, lead_in=0.0)
    points = yaml.safe_load(path.read_text())["points"]
    q = np.array([p["positions"] for p in points])
    assert np.abs(q - trace.q_ref[::2]).max() < 1e-12
    with refused(ParameterError, "write_joint_trajectory.rate", 5.0):
        write(trace, tmp_path / "run.yml", rate=5.0)
    with pytest.raises(ParameterError, match="at rest.*stop_at"):
        write(trace, tmp_path / "b.yml", duration=1.0)
    assert not (tmp_path / "b.yml").exists()


def test_limits_hold_between_the_points_too(plan: hp.motion.WalkPlan) -> None:
    samples = joint_samples(plan, 10.0, 4.0, "test")
    robot, names = samples.robot, samples.robot.joint_names
    at = np.linspace(0.0, samples.time[-1], 400 * (len(samples.time) - 1) + 1)
    followed = CubicHermiteSpline(samples.time, samples.q, samples.v)(at)
    over = followed.max(axis=0) - samples.q.max(axis=0)
    joint = int(np.argmax(over))  # overshoots its own points
    upper = np.array(robot.upper)
    upper[joint] = followed[:, joint].max() - 0.5 * over[joint]
    with refused(JointRangeError, joint=names[joint], quantity="angle") as caught:
        replace(samples, robot=replace(robot, upper=upper)).require_limits()
    near = np.abs(at - caught.value.time) < 0.05
    assert caught.value.value == pytest.approx(followed[near, joint].max(), abs=1e-6)  # of the grid
    rates = np.abs(np.diff(followed, axis=0) / np.diff(at)[:, None]).max(axis=0)
    fastest, slow = int(np.argmax(rates)), np.array(robot.velocity_limit)
    slow[fastest] = 0.98 * rates[fastest]
    with refused(
        JointRangeError, joint=names[fastest], quantity="rate", high=1.001 * slow[fastest]
    ):
        replace(samples, robot=replace(robot, velocity_limit=slow)).require_limits()


MAKERS = {  # of goal positions [deg], of speed registers [turns a minute], as the makers state it
    "dynamixel-x": (0.088, 234.27), "dynamixel-mx": (0.088, 116.62), "dynamixel-ax": (0.29, 114.0),
    "dynamixel-xl320": (0.29, 114.0), "feetech-sts": (0.088, 49.8), "lewansoul-lx16a": (0.24, None),
}  # fmt: skip


def test_servos_count_as_their_makers_say() -> None:
    assert SERVOS.keys() == MAKERS.keys()
    for name, (resolution, fastest) in MAKERS.items():
        servo = SERVOS[name]
        assert math.degrees(servo.tick) == pytest.approx(resolution, rel=0.02)
        if fastest is not None:
            assert servo.speed_limit * 60 / (2 * math.pi) == pytest.approx(fastest, rel=0.005)
        assert abs(servo.center - 0.5 * (servo.least + servo.most)) <= 0.5


def test_ticks_give_the_planned_angles_back(plan: hp.motion.WalkPlan, tmp_path: Path) -> None:
    mounts = {
        "lf_coxa_joint": hp.interchange.ServoMount(11, sign=-1, offset=0.1),
        "rr_tibia_joint": hp.interchange.ServoMount(2, offset=1.2),
    }
    path = hp.interchange.write_servo_ticks(
        plan, tmp_path / "gait.csv", "feetech-sts", mounts=mounts, rate=100, duration=3.0
    )
    text = path.read_text()
    head, *rows = csv.reader(line for line in text.splitlines() if not line.startswith("#"))
    assert head == ["time [s]", *(f"{name} [tick]" for name in plan.robot.joint_names)]
    rows = np.array(rows, dtype=float)
    assert rows[:, 0].tolist() == (np.arange(301) / 100).tolist()
    planned = joint_samples(plan, 100.0, 3.0, "test").q
    for k, name in enumerate(plan.robot.joint_names):
        mount = mounts.get(name, hp.interchange.ServoMount(0))
        angle = mount.offset + mount.sign * (rows[:, 1 + k] - 2048) * 2 * math.pi / 4096
        assert np.abs(angle - planned[:, k]).max() <= math.pi / 4096 * (1 + 1e-9), name
    assert "lf_coxa_joint: id 11, sign -1, offset 0.1 rad\n" in text
    assert "lf_tibia_joint: id 3, sign 1, offset 0.0 rad, assumed" in text  # 2 is taken
    assert len(set(re.findall(": id ([0-9]+),", text))) == 18


def test_a_tick_that_there_is_not_is_refused(plan, bare: hp.Trace, tmp_path: Path) -> None:
    path = tmp_path / "gait.csv"

    def write(servo: Any, **more: Any) -> None:
        hp.interchange.write_servo_ticks(plan, path, servo, duration=3.0, **more)

    joint, mount = "lf_tibia_joint", hp.interchange.ServoMount
    high = math.radians(120.12) - 0.7  # 500.5 ticks of 0.24 degrees around the offset
    with refused(JointRangeError, joint=joint, quantity="angle", high=pytest.approx(high)):
        write("lewansoul-lx16a", mounts={joint: mount(1, offset=-0.7)})
    numbers = (4096, 2 * math.pi, 2048, 0, 4095)
    with refused(JointRangeError, quantity="rate", high=0.2):
        write(hp.interchange.BusServo("s", *numbers, speed_unit=1e-3, speed_most=200, source="t"))
    with refused(
        hp.errors.UnknownNameError, kind="servo", name="MX-28(2.0)"
    ):  # its register counts else
        _named("MX-28(2.0)")
    with refused(ParameterError, "write_servo_ticks.mounts[b].id", 4):
        _mounts(("a", "b"), {"a": mount(4), "b": mount(4)})
    with refused(hp.errors.UnknownNameError, kind="joint", name="knee"):
        write("dynamixel-x", mounts={"knee": mount(1)})
    with refused(ParameterError, "write_servo_ticks.duration", 0.5, about=("at least",)):
        hp.interchange.write_servo_ticks(plan, path, "dynamixel-x", duration=0.5)
    with refused(ParameterError, "ServoMount.sign", 2):
        mount(1, sign=2)
    with refused(NotRecordedError):
        hp.interchange.write_servo_ticks(bare, path, "dynamixel-x")
    unknown = synthetic_trace(duration=1.0, sample=0.1, urdf=None)
    with refused(ParameterError, "Trace.run.robot.urdf", None):
        hp.interchange.write_servo_ticks(unknown, path, "dynamixel-x")
    found = hp.interchange.read_mcap(hp.interchange.write_mcap(unknown, tmp_path / "a.mcap"))
    assert found.urdf is None and same_bits(found.q, unknown.q) and not path.exists()


def test_the_command_exports_a_gait_and_a_run(trace: hp.Trace, tmp_path: Path) -> None:
    target = tmp_path / "gait.yaml"

    def export(*words: str) -> Any:
        return CliRunner().invoke(app, ["export", *words])

    asked = ("kharagpur", str(target), "--gait", "tripod", "--duration")
    assert export(*asked, "9").exit_code == 0
    last = yaml.safe_load(target.read_text())["points"][-1]["time_from_start"]
    assert last["sec"] + 1e-9 * last["nanosec"] == pytest.approx(2.0 + 9.0)  # after the lead-in
    short = export(*asked, "1")
    assert short.exit_code == 2 and "--duration = 1.0: must be at least 7.8 s" in short.output
    run = trace.save(tmp_path / "walk.nc")
    assert export(str(run), str(tmp_path / "walk.mcap")).exit_code == 0
    read = hp.interchange.read_mcap(tmp_path / "walk.mcap")
    assert np.array_equal(read.joint_position, trace.q[:, 7:])
