"""A URDF in other conventions is loaded, with hints, and stored in cases and traces."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused
from rewriting import ConventionSet, rewrite
from scipy.spatial.transform import Rotation

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError, UnknownNameError, UrdfError
from hexapod_pin.robot.description.urdf_file import UrdfFile, read_urdf
from hexapod_pin.robot.loading.load_options import LoadOptions
from hexapod_pin.robot.loading.load_urdf import loaded_text
from hexapod_pin.robot.recognition.layout import LegLayout, RobotLayout, annotate_urdf
from hexapod_pin.robot.robot import Robot, robot_of
from hexapod_pin.robot.robot_source import urdf_path
from hexapod_pin.robot.rotations import roll_pitch_yaw

YAW = 0.6
FOREIGN = ConventionSet(
    yaw=YAW, names="nonsense", signs=True, zeros=True, feet="none", shapes="stl"
)


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("foreign")
    rewritten = rewrite(urdf_path("athena").read_text(), FOREIGN, np.random.default_rng(7))
    for name, content in rewritten.files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    path = folder / "foreign.urdf"
    path.write_text(rewritten.text)
    return path


@pytest.fixture(scope="module")
def robot(file: Path) -> Robot:
    return hp.load_robot(file)


def same(first: Robot, second: Robot) -> None:
    assert first.joint_names == second.joint_names
    assert [leg.joints for leg in first.legs] == [leg.joints for leg in second.legs]
    np.testing.assert_array_equal(first.posture, second.posture)
    for one, other in zip(first.feet, second.feet, strict=True):
        assert (one.leg, one.joint, one.radius) == (other.leg, other.joint, other.radius)
        np.testing.assert_array_equal(one.offset, other.offset)


def read_again(robot: Robot) -> Robot:
    return robot_of(loaded_text(robot.urdf, "text", LoadOptions()), "text")


def test_inferences_are_reported_and_stated(robot: Robot) -> None:
    """The text of the robot states all: read again without hints it infers nothing new."""
    assert any("forward" in text for text in robot.inferred)
    assert any("feet" in text for text in robot.inferred)
    again = read_again(robot)
    same(robot, again)
    assert again.inferred == robot.inferred and again.digest == robot.digest


def test_written_hints_give_the_same_robot(file: Path, robot: Robot, run, tmp_path: Path) -> None:
    shutil.copytree(file.parent, tmp_path, dirs_exist_ok=True)
    done = run("check", file.name, "--write")
    assert done.status == 0 and "foreign.hints.toml" in done.out
    hinted = hp.load_robot(tmp_path / file.name)
    assert hinted.options["legs"] == {leg.name: list(leg.joints) for leg in robot.legs}
    np.testing.assert_allclose(hinted.posture, robot.posture, atol=1e-12)
    assert [leg.joints for leg in hinted.legs] == [leg.joints for leg in robot.legs]
    np.testing.assert_allclose(hinted.stand().q, robot.stand().q, atol=1e-9)
    done = run("check", file.name, "--write")
    assert done.status == 2 and "foreign.hints.toml" in done.err and "remove it" in done.err


def test_a_case_repeats_with_the_options_of_its_robot(file: Path, tmp_path: Path) -> None:
    """Hints and radius are in the case; the run is the same to the bit; a changed hint is seen."""
    given = hp.load_robot(file, forward=-np.degrees(YAW), foot_radius=0.01)
    case = hp.Case(hp.Scene(given), hp.HoldPosture(), duration=0.02)
    path = case.save(tmp_path / "case.toml")
    again = hp.load_case(path)
    same(again.scene.robot, given)
    assert again == case
    np.testing.assert_array_equal(again.run().q, case.run().q)
    text = path.read_text()
    changed = text.replace("foot_radius = 0.01\n", "foot_radius = 0.012\n")
    assert changed != text
    with pytest.raises(ParameterError):
        hp.Case.from_toml(changed)


def test_hints_go_before_inference(file: Path, robot: Robot) -> None:
    """On a file that states all they are obeyed too, and stored in the text."""
    turned = hp.load_robot(file, forward=180.0 - np.degrees(YAW))
    assert turned.legs[0].joints == robot.leg("rr").joints
    named = {leg.name: list(leg.joints) for leg in robot.legs}
    swapped = {**named, "lf": named["lm"], "lm": named["lf"]}
    assert hp.load_robot(file, legs=swapped).leg("lf").joints == robot.leg("lm").joints
    femur = robot.legs[0].joints[1]
    angle = float(robot.posture[robot.joint_index(femur)]) + 0.05
    posed = hp.load_robot(file, posture={femur: angle})
    changed = np.flatnonzero(posed.posture != robot.posture)
    assert [robot.joint_names[k] for k in changed] == [femur]
    own = hp.load_robot("kharagpur")
    turned = hp.load_robot("kharagpur", forward="-x")
    assert turned.leg("lf").joints == own.leg("rr").joints
    renamed = hp.load_robot("kharagpur", legs={f"leg {leg.name}": leg.joints for leg in own.legs})
    assert renamed.leg("leg lf").joints == own.leg("lf").joints
    for one in (turned, renamed):
        assert one.inferred == ()
        same(one, read_again(one))


def test_a_hint_that_names_nothing_is_refused(file: Path) -> None:
    for options, error, fields in (
        ({"legs": {"lf": ("no_such_joint",)}}, UrdfError, {"about": ("leg lf", "no_such_joint")}),
        ({"forward": "up"}, UrdfError, {"about": ("forward 'up'",)}),
        ({"held": {"nobody": 0.0}}, UnknownNameError, {"kind": "moved joint", "name": "nobody"}),
        ({"feet": ("nobody",)}, UnknownNameError, {"kind": "foot link", "name": "nobody"}),
    ):
        with refused(error, **fields):
            hp.load_robot(file, options=LoadOptions(**options))


def test_a_refused_file_is_repaired_and_walks_from_the_command_line(file, run, tmp_path):
    text = file.read_text()
    assert 'velocity="3.14"' in text
    (tmp_path / "broken.urdf").write_text(text.replace('velocity="3.14"', 'velocity="0"'))
    meshes = ("broken.urdf", "--package-path", str(file.parent))
    done = run("check", *meshes)
    assert done.status == 2 and "refused" in done.err
    assert "zero velocity" in done.out and "inferred: " in done.out and "leg lf: " in done.out
    done = run("walk", *meshes, "--repair", "--velocity", "3.14", "--quick", "--full",
               "--duration", "7.2", "--out", "w.nc", "--html", "w.html")  # fmt: skip
    assert done.status == 0 and "repaired: 18 joints" in done.out
    assert " walks " in done.out.splitlines()[0]
    trace = hp.load_trace("w.nc")
    assert hp.walk_verdict(trace).walks and hp.torque_budget(trace).table()
    assert (tmp_path / "w.html").stat().st_size < 10e6


TURN = Rotation.from_euler("z", 37.0, degrees=True).as_matrix()


def model_of(file: UrdfFile) -> pin.Model:
    return pin.buildModelFromXML(file.text, pin.JointModelFreeFlyer())


def test_the_trunk_is_turned_by_a_new_root() -> None:
    """Mass matrix of the joints as before; the trunk's own inertia turned with its axes."""
    athena = read_urdf(urdf_path("athena"))
    joints = ("lf_coxa_joint", "lf_femur_joint", "lf_tibia_joint")
    leg = LegLayout(name="lf", joints=joints, held=(), tip_link="lf_tibia", foot="new",
                    centre=np.array([0.1, 0.02, -0.03]), radius=0.004)  # fmt: skip
    written = annotate_urdf(athena, RobotLayout(turn=TURN, legs=(leg,)))
    before, model = model_of(athena), model_of(written)
    old = model.frames[model.getFrameId("base_link")]
    assert written.base == "trunk_axes"
    q = np.concatenate([pin.neutral(model)[:7], np.linspace(-0.5, 0.5, 18)])
    first, second = (pin.crba(m, m.createData(), q) for m in (before, model))
    np.testing.assert_allclose(first[6:, 6:], second[6:, 6:], rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(first[3:6, 6:], TURN @ second[3:6, 6:], rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(old.placement.rotation @ TURN[:, 0], [1, 0, 0], atol=1e-15)
    np.testing.assert_allclose(old.placement.translation, 0.0, atol=0)
    assert annotate_urdf(athena, RobotLayout(turn=np.eye(3), legs=())) is athena


@pytest.mark.parametrize("angles", [(0.3, -1.1, 2.0), (0, np.pi / 2, 0.4), (-1, -np.pi / 2, 3)])
def test_roll_pitch_yaw_is_the_urdf_convention(angles: tuple[float, float, float]) -> None:
    """Against SciPy's fixed axes x, y, z; at a pitch of 90 degrees only the product is defined."""
    turn = Rotation.from_euler("xyz", angles).as_matrix()
    again = Rotation.from_euler("xyz", roll_pitch_yaw(turn)).as_matrix()
    np.testing.assert_allclose(again, turn, atol=1e-15 + 1e-9 * (abs(angles[1]) > 1.5))
