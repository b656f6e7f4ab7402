"""MJCF out and in: MuJoCo opens what is written, has the same robot, and walks its keyframes."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused
from studies.walks.mjcf_walks import SPEED_LIMIT, STATIC_LIMIT, follow_keyframes, static_errors
from typer.testing import CliRunner

import hexapod_pin as hp
from hexapod_pin.commands.app import app
from hexapod_pin.errors import MissingPackageError, ParameterError, TraceFileError, UrdfError
from hexapod_pin.interchange.mjcf_text import body_name
from hexapod_pin.robot.loading.load_options import LoadOptions
from hexapod_pin.robot.reading import mjcf_urdf
from hexapod_pin.robot.robot_source import urdf_path
from hexapod_pin.scene.scene import loaded_model
from tests.test_mesh_file import binary_stl

mujoco = pytest.importorskip("mujoco")

GAIT = hp.Gait.tetrapod(stroke=0.14, cycle_time=2.4)
CYCLES, RATE = 4, 50.0

MOTOR = hp.Motor(
    stall_torque=6.0, no_load_speed=6.0, rotor_inertia=1e-6, gear_ratio=100.0,
    viscous_friction=0.2, dry_friction=0.05,
)  # fmt: skip


@pytest.fixture(scope="module")
def robot() -> hp.Robot:
    return hp.load_robot("kharagpur")


def test_keyframes_are_the_plan_and_walk_in_mujoco_as_fast_as_here(
    robot: hp.Robot, tmp_path: Path
) -> None:
    """The bar is 5 %: contact laws differ; measured 0.4 % (docs/results/mjcf_walks.md).

    The set-point leads the plan by kd / kp times the rate.
    """
    path, duration = tmp_path / "walk.xml", CYCLES * GAIT.cycle_time
    hp.interchange.write_mjcf(robot, path, controller=GAIT, duration=duration, rate=RATE)
    model = mujoco.MjModel.from_xml_path(str(path))
    assert model.key(0).name == "stand" and model.nkey == 2 + CYCLES * GAIT.cycle_time * RATE
    column = [int(model.joint(name).qposadr[0]) for name in robot.joint_names]
    np.testing.assert_array_equal(model.key_qpos[0][column], robot.posture)
    np.testing.assert_allclose(model.key_qpos[0][:7], robot.stand().q[[0, 1, 2, 6, 3, 4, 5]])
    now = hp.motion.WalkPlan(robot, GAIT).at(model.key_time[1:])
    np.testing.assert_allclose(model.key_qpos[1:][:, column], now.q, atol=1e-4)
    kp, kd = hp.Servo.for_robot(robot).gains(robot)
    # between knots rates are those of cubics whose angles are within 1e-5 rad of the plan
    np.testing.assert_allclose(model.key_ctrl[1:], now.q + kd / kp * now.v, atol=2e-3)
    places = follow_keyframes(model, duration)
    since = round((CYCLES - 2) * GAIT.cycle_time / model.opt.timestep)
    speed = np.linalg.norm((places[-1] - places[since])[:2]) / (2 * GAIT.cycle_time)
    control = hp.KinematicControl(GAIT)
    trace = hp.simulate(
        hp.Scene(robot), control, duration=duration, estimate=False, record=["motion"]
    )
    first = int(np.searchsorted(trace.time, (CYCLES - 2) * GAIT.cycle_time - 1e-9))
    ours = np.linalg.norm((trace.q[-1] - trace.q[first])[:2]) / (2 * GAIT.cycle_time)
    assert speed == pytest.approx(ours, rel=SPEED_LIMIT)
    assert places[:, 2].min() > 0.9 * robot.stand().q[2], "it never sits down"


def test_loads_motors_and_limits_reach_mujoco(robot: hp.Robot, tmp_path: Path) -> None:
    trunk = body_name(robot, "root_joint")
    scene = hp.Scene(
        robot, servo=hp.Servo(kp=30.0, kd={"coxa": 1.0, "femur": 2.0, "tibia": 3.0}, motor=MOTOR),
        loads=[hp.Payload(trunk, 1.5, position=(0.1, 0.0, 0.05))], terrain=hp.Slope(angle=0.1),
        contact=hp.Contact.accurate().with_mu(0.4),
    )  # fmt: skip
    model = mujoco.MjModel.from_xml_path(str(hp.interchange.write_mjcf(scene, tmp_path / "m.xml")))
    assert model.body_mass.sum() == pytest.approx(robot.total_mass + 1.5, rel=1e-14)
    bare = mujoco.MjModel.from_xml_path(
        str(hp.interchange.write_mjcf(robot, tmp_path / "bare.xml", drawn=False))
    )
    assert max(static_errors(hp.Scene(robot), bare)) <= STATIC_LIMIT
    for k, name in enumerate(robot.joint_names):
        joint, dof = model.joint(name), int(model.joint(name).dofadr[0])
        np.testing.assert_array_equal(joint.range, (robot.lower[k], robot.upper[k]))
        assert model.dof_armature[dof] == MOTOR.armature
        assert model.dof_frictionloss[dof] == 0.05
        assert np.ravel(model.dof_damping[dof])[0] == robot.damping[k] + 0.2
        actuator = model.actuator(name)
        assert actuator.gainprm[0] == 30.0
        assert -actuator.biasprm[2] == {"coxa": 1.0, "femur": 2.0, "tibia": 3.0}[name.split("_")[1]]
        most = min(6.0, robot.effort_limit[k])
        np.testing.assert_array_equal(actuator.forcerange, (-most, most))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    data.qpos[2] -= 1e-6  # the feet just touch the slope, which is no contact yet
    mujoco.mj_forward(model, data)
    assert data.ncon == 6
    np.testing.assert_allclose(data.contact.friction[:, 0], 0.4)
    np.testing.assert_allclose(data.contact.dist, -1e-6 * np.cos(0.1), atol=1e-9)
    text = (tmp_path / "m.xml").read_text()
    assert "torque-speed line" in text and "contact law" in text


@pytest.mark.parametrize(
    "terrain",
    [
        hp.HeightField.random(3, amplitude=0.03, size=(2.0, 3.0), centre=(0.3, -0.2)),
        hp.Stairs(rise=0.05, run=0.3, count=3, start=0.4, heading=0.7),
    ],
    ids=["height-field", "stairs"],
)
def test_ground_is_as_high_in_mujoco(terrain: Any, robot: hp.Robot, tmp_path: Path) -> None:
    """Rays from above; of the field at its points, as MuJoCo has triangles between them."""
    scene = hp.Scene(robot, terrain=terrain)
    path = hp.interchange.write_mjcf(scene, tmp_path / "g.xml", drawn=False)
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    data.qpos[:3] = (0.0, 0.0, 50.0)  # the feet are out of the way
    mujoco.mj_forward(model, data)
    xy = np.random.default_rng(1).uniform((-0.6, -1.5), (1.2, 1.2), (200, 2))
    if isinstance(terrain, hp.HeightField):
        points = np.round((xy - terrain.origin) / terrain.spacing)
        xy = terrain.origin + points * terrain.spacing + (2e-6, 1e-6)  # on no edge of triangles
    groups, geom = np.array([1, 0, 0, 0, 0, 0], dtype=np.uint8), np.zeros(1, dtype=np.int32)
    down, trunk = np.array([0.0, 0.0, -1.0]), model.body(body_name(robot, "root_joint")).id
    found = [
        5.0 - mujoco.mj_ray(model, data, np.array([x, y, 5.0]), down, groups, 1, trunk, geom)
        for x, y in xy
    ]
    error = np.sort(np.abs(np.array(found) - terrain.height_at(*xy.T)))
    if terrain.kind == "stairs":  # but within the 5 mm in which a riser is a slope
        error = error[: int(0.95 * len(error))]
    assert error.max() < 1e-5  # single precision, and 1 um beside the point on a slope


def test_a_robot_comes_back(tmp_path: Path) -> None:
    """Mass matrix and gravity torques to 1e-9, limits, feet, legs and posture exactly."""
    robot = hp.load_robot("athena")
    scene = hp.Scene(robot, servo=hp.Servo(kp=30.0, kd=2.0, motor=MOTOR))
    path = hp.interchange.write_mjcf(scene, tmp_path / "r.xml")
    back = hp.interchange.read_mjcf(path)
    again = back.robot
    assert (again.name, again.legs) == (robot.name, robot.legs)
    assert again.joint_names == robot.joint_names
    for what in ("lower", "upper", "effort_limit", "velocity_limit", "posture"):
        np.testing.assert_array_equal(getattr(again, what), getattr(robot, what))
    assert [foot.radius for foot in again.feet] == [foot.radius for foot in robot.feet]
    for one, other in zip(again.feet, robot.feet, strict=True):
        np.testing.assert_allclose(one.offset, other.offset, atol=1e-15)
    assert (back.kp == 30.0).all() and (back.kd == 2.0).all()
    assert (back.armature == MOTOR.armature).all()
    assert back.servo == hp.Servo(kp=(30.0,) * 18, kd=(2.0,) * 18)
    assert any("armature" in note for note in again.notes)
    rng = np.random.default_rng(4)
    for _ in range(3):
        state = robot.stand(robot.posture + rng.normal(size=18) * 0.2)
        both = [(one.model, one.model.createData()) for one in (robot, again)]
        for algorithm in (pin.crba, pin.computeGeneralizedGravity):
            ours, theirs = (algorithm(model, data, state.q) for model, data in both)
            assert np.abs(ours - theirs).max() <= STATIC_LIMIT * np.abs(ours).max()


FOREIGN = """<mujoco model="spider">
  <default><geom rgba="0.3 0.3 0.3 1"/><joint range="-60 60" limited="true" damping="0.1"
    armature="0.002"/></default>
  <worldbody>
    <geom type="plane" size="1 1 0.1"/>
    <body name="torso" pos="0 0 0.3"><freejoint/>
      <geom type="box" size="0.15 0.08 0.02" mass="2"/>{legs}
    </body>
    <body name="ball" pos="3 0 1"><freejoint/><geom type="sphere" size="0.1"/></body>
  </worldbody>
  <actuator>{actuators}</actuator>
</mujoco>"""

LEG = """
      <body name="{n}_coxa" pos="{x} {y} 0" euler="0 0 {turn}">
        <joint name="{n}_1" axis="0 0 1"/>
        <geom type="capsule" fromto="0 0 0 0.05 0 0" size="0.012" mass="0.05"/>
        <body name="{n}_femur" pos="0.05 0 0">
          <joint name="{n}_2" axis="0 -1 0" pos="0 0 0" ref="10"/>
          <geom type="capsule" fromto="0 0 0 0.08 0 0.02" size="0.01" mass="0.06"/>
          <body name="{n}_tibia" pos="0.08 0 0.02">
            <joint name="{n}_3" axis="0 -1 0"/>
            <geom type="capsule" fromto="0 0 0 0.02 0 -0.14" size="0.008" mass="0.04"/>
          </body>
        </body>
      </body>"""


def foreign(folder: Path) -> Path:
    places = {
        "lf": (0.14, 0.08, 45), "lm": (0.0, 0.09, 90), "lr": (-0.14, 0.08, 135),
        "rf": (0.14, -0.08, -45), "rm": (0.0, -0.09, -90), "rr": (-0.14, -0.08, -135),
    }  # fmt: skip
    legs = "".join(LEG.format(n=n, x=x, y=y, turn=t) for n, (x, y, t) in places.items())
    motor = '<position joint="{}_{}" kp="20" kv="0.5" forcerange="-3 3"/>'
    actuators = "".join(motor.format(n, k) for n in places for k in (1, 2, 3))
    path = folder / "spider.xml"
    path.write_text(FOREIGN.format(legs=legs, actuators=actuators))
    return path


def test_a_foreign_file_becomes_a_robot_that_walks(tmp_path: Path) -> None:
    path = foreign(tmp_path)
    with refused(UrdfError, source=str(path), about=("velocity",)):
        hp.load_robot(path)
    back = hp.interchange.read_mjcf(path, options=LoadOptions(repair=True))
    robot = back.robot
    assert sorted(leg.name for leg in robot.legs) == ["lf", "lm", "lr", "rf", "rm", "rr"]
    assert (robot.effort_limit == 3.0).all() and (back.kp == 20.0).all()
    assert (back.armature == 0.002).all() and (robot.damping == 0.1).all()
    np.testing.assert_allclose([foot.radius for foot in robot.feet], 0.008)
    turned = robot.joint_index("lf_2")  # its zero is where the file has 10 degrees
    assert robot.upper[turned] == pytest.approx(np.radians(50.0), abs=1e-12)
    assert any("1 other bodies" in note for note in robot.notes)
    model = mujoco.MjModel.from_xml_path(str(path))
    data, ours = mujoco.MjData(model), loaded_model(hp.Scene(robot))
    state = robot.stand()
    for name, angle in zip(robot.joint_names, state.joints, strict=True):
        joint = model.joint(name)
        data.qpos[joint.qposadr[0]] = angle + model.qpos0[joint.qposadr[0]]
    mujoco.mj_forward(model, data)
    order = [int(model.joint(name).dofadr[0]) for name in robot.joint_names]
    matrix = np.triu(pin.crba(ours, ours.createData(), state.q))[6:, 6:]
    theirs = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, theirs)
    theirs = np.triu(theirs[np.ix_(order, order)]) - 0.002 * np.eye(18)
    assert np.abs(theirs - matrix).max() <= STATIC_LIMIT * np.abs(matrix).max()
    scene = hp.Scene(robot, servo=back.servo)
    gait = hp.Gait.tripod(stroke=0.04, cycle_time=1.0, lift=0.015)
    trace = hp.simulate(
        scene, hp.KinematicControl(gait), duration=2.0, method="implicit-euler", step=2e-3
    )
    assert trace.q[-1, 0] > 0.02


def test_what_cannot_be_written_or_read_is_refused(
    robot: hp.Robot, tmp_path: Path, monkeypatch: Any
) -> None:
    write = hp.interchange.write_mjcf
    with refused(ParameterError, "Scene.prescribed", True):
        write(hp.Scene(robot, prescribed=True), tmp_path / "x.xml")
    with refused(ParameterError, "rate", 0.0):
        write(robot, tmp_path / "x.xml", controller=GAIT, rate=0.0)
    with refused(ParameterError, "duration", 1e9):
        write(robot, tmp_path / "x.xml", controller=GAIT, duration=1e9)
    with refused(ParameterError, "controller", "FootControl"):
        write(robot, tmp_path / "x.xml", controller=hp.FootControl(GAIT))
    with pytest.raises(TraceFileError):
        write(robot, tmp_path / "missing" / "x.xml")
    assert list(tmp_path.iterdir()) == []
    path = tmp_path / "bad.xml"
    for text, about in {
        "<mujoco><worldbody/></mujoco>": "no body with a free joint",
        "<mujoco><worldbody><body><freejoint/></body></worldbody></mujoco>": "MuJoCo cannot read",
        "<mujoco><worldbody><body><freejoint/><geom size='1'/><body><joint type='ball'/>"
        "<geom size='1'/></body></body></worldbody></mujoco>": "neither hinge nor slide",
    }.items():
        path.write_text(text)
        with refused(UrdfError, source=str(path), about=(about,)):
            hp.load_robot(path)
    assert [x.name for x in tmp_path.iterdir()] == ["bad.xml"], "and no log of MuJoCo's"
    monkeypatch.setattr(mjcf_urdf, "find_spec", lambda name: None)
    with pytest.raises(MissingPackageError, match=re.escape("hexapod-pin[mujoco]")):
        hp.load_robot(path)


def test_meshes_in_given_folders_are_written_and_missing_ones_are_reported(
    tmp_path: Path, monkeypatch: Any
) -> None:
    monkeypatch.chdir(tmp_path)
    mesh = '<visual><geometry><mesh filename="package://parts/trunk.stl"/></geometry></visual>'
    text = urdf_path("kharagpur").read_text()
    Path("robot").mkdir()
    Path("robot/robot.urdf").write_text(
        text.replace('<link name="base_link">', f'<link name="base_link">{mesh}')
    )
    parts = tmp_path / "elsewhere" / "parts"
    parts.mkdir(parents=True)
    parts.joinpath("trunk.stl").write_bytes(binary_stl([0] * 4))
    bare = hp.load_robot("robot/robot.urdf")
    path = hp.interchange.write_mjcf(bare, "bare.xml")
    (remark,) = (line for line in path.read_text().splitlines() if "trunk.stl" in line)
    assert "1 mesh is not in this file" in remark and not list(tmp_path.glob("*.stl"))
    hp.interchange.write_mjcf(bare, "call.xml", package_path=["elsewhere"])
    loaded = hp.load_robot("robot/robot.urdf", package_path=["elsewhere"])
    hp.interchange.write_mjcf(loaded, "options.xml")
    words = ["export", "robot/robot.urdf", "command.xml", "--gait", "none"]
    done = CliRunner().invoke(app, [*words, "--package-path", "elsewhere"])
    assert done.exit_code == 0 and "trunk.stl" not in done.output
    for name in ("call", "options", "command"):
        assert Path(f"{name}_mesh_0.stl").exists(), name
        assert mujoco.MjModel.from_xml_path(f"{name}.xml").nmesh == 1
    done = CliRunner().invoke(app, words)
    (note,) = (line for line in done.output.splitlines() if "trunk.stl" in line)
    assert note.startswith("note: 1 mesh") and "--package-path FOLDER" in note


def test_export_command(tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.chdir(tmp_path)
    trace = hp.simulate(
        hp.Scene(hp.load_robot("athena")), hp.KinematicControl(GAIT), duration=0.1, estimate=False
    )
    trace.save("walk.nc")

    def run(*words: str) -> Any:
        return CliRunner().invoke(app, ["export", *words])

    done = run("walk.nc", "walk.xml")
    assert done.exit_code == 0 and "not in this file: the contact law" in done.output
    assert mujoco.MjModel.from_xml_path("walk.xml").nkey == 2 + 5
    assert run("walk.nc", "walk.csv").exit_code == 0
    trace.save("own.csv")
    assert Path("walk.csv").read_bytes() == Path("own.csv").read_bytes()
    assert run("walk.xml", "back.urdf").exit_code == 0
    assert hp.load_robot("back.urdf").joint_names == hp.load_robot("athena").joint_names
    assert run("kharagpur", "k.xml", "--gait", "none").exit_code == 0
    assert mujoco.MjModel.from_xml_path("k.xml").nkey == 1
    left = sorted(path.name for path in tmp_path.iterdir())
    for words, about in {
        ("kharagpur", "k.csv"): "WHAT", ("kharagpur", "k.bvh"): "must end in .xml, .urdf",
        ("walk.nc", "k.urdf"): "WHAT", ("walk.nc", "k.xml", "--gait", "wave"): "--gait",
        ("walk.nc", "walk.nc"): "must end in",
    }.items():  # fmt: skip
        done = run(*words)
        assert done.exit_code == 2 and about in done.output, (words, done.output)
    assert sorted(path.name for path in tmp_path.iterdir()) == left
