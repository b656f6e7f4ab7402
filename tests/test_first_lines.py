"""First lines name the true cause: of files, options and runs that engineers meet."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from broken_urdfs import Break, put
from conftest import Run

import hexapod_pin as hp
from hexapod_pin.commands.scene_options import backlash_doubt, named_slowness, posture_doubt
from hexapod_pin.control.gait_refusal import overlaps
from hexapod_pin.errors import ParameterError, UrdfError
from hexapod_pin.results.ground_obstacle import gravity_doubt
from hexapod_pin.results.steady_window import Window
from hexapod_pin.results.walk_answer import walk_answer
from hexapod_pin.results.walk_causes import _payload_advice
from hexapod_pin.results.walk_cautions import cautions
from hexapod_pin.robot.description.solids import placements
from hexapod_pin.robot.description.urdf_file import parse_urdf
from hexapod_pin.robot.repair.find_all import check_urdf
from hexapod_pin.robot.robot_source import urdf_path
from hexapod_pin.text_table import WIDTH

TEXT = urdf_path("kharagpur").read_text(encoding="utf-8")


def changed(*breaks: Break) -> str:
    root = ET.fromstring(TEXT)
    for one in breaks:
        one(root)
    return ET.tostring(root, encoding="unicode")


def written(folder: Path, *breaks: Break) -> Path:
    path = folder / "robot.urdf"
    path.write_text(changed(*breaks), encoding="utf-8")
    return path


def every(tag: str, name: str, new: Callable[[float], float]) -> Break:

    def change(root: ET.Element) -> None:
        for element in root.iter(tag):
            if element.get(name) is not None:
                numbers = (new(float(x)) for x in element.get(name, "").split())
                element.set(name, " ".join(f"{x:.12g}" for x in numbers))

    return change


def only_joints(root: ET.Element) -> None:
    for origin in root.findall("joint/origin"):
        angles = (math.degrees(float(x)) for x in origin.get("rpy", "0 0 0").split())
        origin.set("rpy", " ".join(f"{x:.12g}" for x in angles))


def in_assembly(root: ET.Element) -> None:
    """Write every centre of mass, and the axes of its inertia, in the frame of the robot."""
    file = parse_urdf(TEXT.encode(), "test")
    places = placements(file, file.roots)
    for link in root.findall("link"):
        origin = link.find("inertial/origin")
        if origin is not None:
            turn, place = places[link.get("name", "")]
            at = place + turn @ [float(x) for x in origin.get("xyz", "").split()]
            origin.set("xyz", " ".join(f"{x:.12g}" for x in at))
            yaw = math.atan2(turn[1, 0], turn[0, 0])  # frames at zero angles are turned about z
            origin.set("rpy", f"0 0 {yaw:.12g}")


ONE = [every("inertia", name, lambda _: 1.0) for name in ("ixx", "iyy", "izz")]
MEND = {
    "angles in degrees": ([only_joints], "angles look like degrees, not SI units"),
    "coms in the assembly's frame": (
        [in_assembly], "centres of mass look like those in the robot's frame"
    ),
    "foot spheres in mm": (
        [every("sphere", "radius", lambda x: 1e3 * x)], "radii of spheres look like mm"
    ),
    "two tibiae of 110 t": (
        [put(f"link {x}_tibia/inertial/mass", value="110000") for x in ("lf", "rm")],
        "mass unlike the other legs: mass 1.1e+05 kg, 0.11 kg in other legs",
    ),
}  # fmt: skip
"""What the repair brings back: the changes, and the doubt or refusal."""


@pytest.mark.parametrize("name", MEND)
def test_a_slip_is_named_and_the_repair_brings_the_robot_back(name: str, tmp_path: Path) -> None:
    """All were walks with torques up to 80 % off, or "masses look like g" of two heavy links."""
    breaks, said = MEND[name]
    path, sound = written(tmp_path, *breaks), hp.load_robot("kharagpur")
    try:
        assert said in hp.load_robot(path).doubts[0]
    except UrdfError as error:
        assert any(said in text for text in error.findings)
    robot = hp.load_robot(path, repair=True)
    assert robot.doubts == ()
    for mine, true in zip(robot.model.inertias, sound.model.inertias, strict=True):
        assert mine.mass == pytest.approx(true.mass, rel=1e-9)
        np.testing.assert_allclose(mine.lever, true.lever, atol=1e-8)
        np.testing.assert_allclose(mine.inertia, true.inertia, rtol=1e-6, atol=1e-9)
    for mine, true in zip(robot.model.jointPlacements, sound.model.jointPlacements, strict=True):
        np.testing.assert_allclose(mine.homogeneous, true.homogeneous, atol=1e-8)
    assert [foot.radius for foot in robot.feet] == pytest.approx([x.radius for x in sound.feet])


def no_parts(*names: str) -> Break:
    return lambda root: [root.remove(x) for x in list(root) if x.get("name") in names] and None


def no_axis(root: ET.Element) -> None:
    joint = next(x for x in root.findall("joint") if x.get("name") == "lm_femur_joint")
    joint.remove(joint.find("axis"))  # type: ignore[arg-type]


def origin(joint: str, **attributes: str) -> list[Break]:
    return [put(f"joint {joint}_joint/origin", **attributes)]


DOUBTED: list[tuple[list[Break], str]] = [
    (ONE, r"inertias are a placeholder, 1 kg m\^2 of 19 links"),
    ([every("mass", "value", lambda _: 1.0)], "masses are a placeholder, 1 kg in each of 19"),
    ([every("limit", end, math.radians) for end in ("lower", "upper")],
     "limits look like radians read as degrees: no joint turns by more than 0.049 rad"),
    ([no_axis], "lm_femur_joint: turns about 1 0 0 as it has no <axis>"),
    ([put("joint rm_femur_joint/parent", link="rf_coxa")],  # a femur on another leg's coxa
     "rf_coxa: moves 5 joints, rm_coxa 1, 3 in other legs"),
    ([put("link base_link/inertial/origin", xyz="0.2 0 0")],
     r"the trunk's centre of mass lies 0\.2 m off the middle of the hips, which are 0\.225 m"),
    (origin("rf_foot", xyz="0.115 0 0"),
     r"rf_tibia: ends 0\.115 m from its joint, 0\.0988 m in other legs"),
    (origin("lr_tibia", xyz="0.1 0 0"),
     r"lr_tibia_joint: 0\.1 m from the joint before it, 0\.119 m in other legs"),
    ([no_parts("lm_foot_joint", "lm_foot")], "lm_tibia: ends at its joint, 0.0988 m in other legs"),
    ([put("joint lm_tibia_joint", type="prismatic")],
     "^lm_tibia_joint: type prismatic, revolute in other legs$"),
    (origin("rm_coxa", rpy="0 0 1.5707963267948966"),
     "rm_coxa_joint: its leg points into the trunk, the others away from it"),
    (origin("rr_coxa", rpy="0 0 3.141592653589793"),
     "rr_coxa_joint: its leg points elsewhere than its mirror image"),
    (origin("rf_coxa", xyz="0.02 -0.1025 0"), "rf_coxa_joint: starts where no leg mirrors it"),
    (origin("lm_tibia", rpy="0 -1.5707963267948966 0"),
     r"lm_coxa_joint: its leg ends 0\.099 m above or below the others at zero angles"),
    ([put("joint lm_tibia_joint/dynamics", damping="0.2")],
     "lm_tibia_joint: damping 0.2 N m s/rad, 0 in other legs"),
    ([put("link lm_foot/collision/geometry/sphere", radius="0.03")],
     r"lm_tibia: a foot of radius 0\.03 m, 0\.01 m in other legs"),
    ([every("mass", "value", lambda x: x if x > 1.0 else 1e-3)],  # all of it in the trunk
     r"legs weigh 0\.018 kg, 0\.06 kg is least with 12 motors in them"),
    ([put("link lm_femur/inertial/origin", xyz="0.9 0 0"),
      lambda root: [x.clear() for x in root.iter("visual")] and None],
     "centre of mass outside the body: link 'lm_femur'"),
]  # fmt: skip
"""What only the user can correct, or what the repair assumes: the changes, and the doubt."""


@pytest.mark.parametrize(("breaks", "said"), DOUBTED)
def test_a_placeholder_or_a_line_of_one_leg_is_named(breaks: list[Break], said: str) -> None:
    doubts = check_urdf(parse_urdf(changed(*breaks).encode(), "test")).doubts
    assert re.search(said, doubts[0]), doubts


def test_sound_robots_have_no_doubt() -> None:
    for name in ("kharagpur", "athena"):
        assert check_urdf(parse_urdf(urdf_path(name).read_bytes(), name)).doubts == ()


def test_what_was_downloaded_instead_is_named(tmp_path: Path) -> None:
    for text, said in (
        ("<!DOCTYPE html>\n<html><body><br></body></html>", "an HTML page: download the raw file"),
        ("version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "git lfs pull"),
    ):
        (tmp_path / "robot.urdf").write_text(text)
        with pytest.raises(UrdfError, match=said):
            hp.load_robot(tmp_path / "robot.urdf")


def test_causes_are_named_where_the_posture_is_refused(run: Run, tmp_path: Path) -> None:
    """The option --posture was named, which nobody had given, and no joint."""
    breaks = [every("limit", end, math.radians) for end in ("lower", "upper")]
    with pytest.raises(UrdfError) as caught:
        hp.load_robot(written(tmp_path, *breaks))
    assert "radians read as degrees" in caught.value.findings[0]
    written(tmp_path, put("joint rm_coxa_joint/limit", lower="0.5", upper="1.5"))
    done = run("walk", "robot.urdf")
    assert done.status == 2 and "posture[rm_coxa_joint] = 0.0: must be from 0.5" in done.err
    assert "--posture" not in done.err


def test_feet_whose_meshes_are_not_found_are_guessed(tmp_path: Path) -> None:
    """A file without its folder of meshes had only a doubt about its mass."""
    text = re.sub(r"<(collision|hexapod_pin)\b.*?</\1>", "", changed(), flags=re.DOTALL)
    text = re.sub(r'<(link|joint) name="\w\w_foot[^>]*>.*?</\1>', "", text, flags=re.DOTALL)
    text = re.sub(r"<box [^>]*>", '<mesh filename="package://none/a.stl"/>', text)
    (tmp_path / "robot.urdf").write_text(text)
    robot = hp.load_robot(tmp_path / "robot.urdf", posture=[0.0, 0.0, math.pi / 2] * 6)
    assert robot.doubts[0] == "feet are guessed: their meshes are not found (--package-path)"


def test_options_in_another_unit(run: Run, tmp_path: Path) -> None:
    """A cycle of 2400 s ran for minutes; a wrong key of a ground was "kind = None"."""
    with pytest.raises(ParameterError, match=r"foot_radius = 20.0: .* mm\? 20 mm are 0.02 m"):
        hp.load_robot("athena", foot_radius=20.0)
    doubt = "backlash 0.0175 degrees (1 if radians are meant)"
    assert backlash_doubt("0.0175") == backlash_doubt("lf_coxa_joint=0.0175,x=1") == doubt
    assert backlash_doubt("0.1") == backlash_doubt("1") == backlash_doubt(None) == ""
    assert posture_doubt("a=1.57,b=-0.785") == "posture of 1.57 degrees (90 if radians are meant)"
    assert [posture_doubt(x) for x in (None, "a=2,b=3", "a=1.5,b=40", "a=x")] == [""] * 4
    legs = ("lf", "lm", "lr", "rf", "rm", "rr")
    radians = ",".join(f"{leg}_tibia_joint=1.57" for leg in legs)
    (tmp_path / "ground.toml").write_text("slope_degrees = 8\n")
    for option, value, said in (
        ("--payload", "500", "hexapod-pin: --payload = 500.0: must be at"),
        ("--posture", radians, "degrees (90 if radians are meant)"),
        ("--step", "1", "--step = 1.0: must be at most 0.1 s. ms? 1 ms are 0.001 s"),
        ("--cycle-time", "2400", "at most 200 s. ms? 2400 ms are 2.4 s"),
        ("--height", "150", "mm? 150 mm are 0.15 m"),
        ("--terrain", "ground.toml", "Given without a kind: slope_degrees"),
    ):
        done = run("walk", "kharagpur", option, value)
        assert done.status == 2 and said in " ".join(done.err.split())


def test_legs_that_overlap_are_one_phrase(tmp_path: Path) -> None:
    robot = hp.load_robot(written(tmp_path, every("sphere", "radius", lambda _: 0.2)))
    (found,) = overlaps(robot, hp.Gait.tripod(stroke=0.05, cycle_time=0.8))
    assert re.fullmatch(r"legs lf and \w\w and \d+ more pairs stand in each other", found)


GAIT = hp.KinematicControl(hp.Gait.tripod(stroke=0.05, cycle_time=0.8))


def walked(duration: float = 0.1, step: float | None = 1e-3, **scene: Any) -> hp.Trace:
    how = {"step": step} if step else {"accuracy": 1e-3}
    return hp.simulate(
        hp.Scene(hp.load_robot("kharagpur"), **scene), GAIT, duration=duration, **how
    )


def test_a_walk_with_fixed_steps_has_an_unknown_error() -> None:
    """20 ms moved a coxa's peak by 12 % below "nothing at a limit"."""
    answer = walk_answer(walked(2.4, 5e-3))
    assert "error unknown (fixed steps of 5 ms)" in answer.headline
    many = (
        "heading 1.57 degrees (90 if radians are meant), turn rate 0.5 degrees/s (28.6 if radians "
        "are meant), friction of 70 (0.7 if percent is meant)"
    )
    full = replace(answer, caution=many, verdict=replace(answer.verdict, cautions=()))
    assert len(full.lines()) - len(full.budget.kinds) - 2 == 2  # type: ignore[union-attr]
    assert all(len(line) <= WIDTH for line in full.lines())
    assert "90 if radians), turn rate 0.5 degrees/s (28.6 if radians), friction" in full.headline


def test_what_of_a_scene_keeps_it_from_walking_is_named() -> None:
    """The advice was a larger friction coefficient, and a walk of 59 % slip had no cause.

    Peaks 57 % to 100 % too large for the gains of servos had no caution.
    """
    contact = hp.Contact.accurate()
    soft = contact.normal.model_copy(update={"stiffness": 1e-3 * contact.normal.stiffness})
    soft = contact.model_copy(update={"normal": soft})
    verdict = walk_answer(walked(2.4, None, contact=soft)).verdict
    assert re.search(r"feet sink 4\d(\.\d)? ?mm", f"{verdict.cause} {verdict.cautions}")
    verdict = walk_answer(walked(2.4, loads=[hp.Payload("lf_tibia", 6.0)])).verdict
    assert verdict.cause == "a payload of 6 kg on lf_tibia, 1.9 times its mass"
    assert "it carries 6 kg on lf_tibia" in verdict.advice
    assert _payload_advice(walked(loads=[hp.Payload("lf_tibia", 1.0)])) is None
    falling = walk_answer(walked(gravity=(0.0, 0.0, 9.81)))
    assert "gravity points up, 9.81 m/s^2" in falling.headline
    assert gravity_doubt((0.0, 0.0, -1.62)) == gravity_doubt((0.5, 0.0, -9.8)) == ""
    assert gravity_doubt((0.0, 0.0, -981.0)) == "gravity is 981 m/s^2"
    for scene, said in (
        ({"contact": contact.with_mu(0.01)}, "friction of 0.01, less than on ice"),
        ({"servo": hp.Servo(kp=240.0, kd=0.0)}, "servos hardly damped (kd 0 for kp 240)"),
        ({"servo": hp.Servo(kp=4.8, kd=240.0)}, "kd 240 above kp 4.8 (exchanged?)"),
    ):
        assert said in cautions(walked(**scene), None)
        assert said not in cautions(walked(), None)


@pytest.mark.parametrize(
    ("names", "said"),
    [
        ({"lf": "rf", "rf": "lf"}, "legs rf, lf stand on the other side"),
        ({side + row: other + row for side, other in ("lr", "rl") for row in "fmr"},
         "left and right legs are exchanged: it lies on its back (turn its root link over), or the "
         "legs' names are wrong (--forward=x takes it as it is)"),
        ({}, ""),
    ],
)  # fmt: skip
def test_legs_on_the_other_side_than_their_names_say_are_named(
    names: dict[str, str], said: str, tmp_path: Path
) -> None:
    def exchange(root: ET.Element) -> None:
        root.remove(root.find("hexapod_pin"))  # type: ignore[arg-type]
        for element in root.iter():
            for key in ("name", "link"):
                leg, _, part = element.get(key, "").partition("_")
                if leg in names:
                    element.set(key, f"{names[leg]}_{part}")

    robot = hp.load_robot(written(tmp_path, exchange))
    assert "".join((robot.caution, *robot.doubts)) == said


def test_the_one_joint_that_stretches_a_cycle_and_a_missing_leg_are_named(tmp_path: Path) -> None:
    path = written(tmp_path, put("joint lr_femur_joint/limit", velocity="0.5"))
    said = "cycle 9 s: its joints are slow"
    slow = "cycle 9 s: lr_femur_joint is slow (0.5 rad/s, 6 in others)"
    assert named_slowness(hp.load_robot(path), said) == slow
    assert named_slowness(hp.load_robot("kharagpur"), said) == said
    assert named_slowness(hp.load_robot(path), "") == ""

    leg = [
        f"rm_{part}{end}" for part in ("coxa", "femur", "tibia", "foot") for end in ("", "_joint")
    ]
    root = ET.fromstring(TEXT)
    no_parts(*leg)(root)
    root.remove(root.find("hexapod_pin"))  # type: ignore[arg-type]
    path.write_bytes(ET.tostring(root))
    assert hp.load_robot(path).caution == "it has 5 legs"


def test_a_study_of_which_no_case_runs_says_why_first(run: Run, tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text(
        'schema = 1\n[base]\nrobot = "kharagpur"\nduration = 2.4\n'
        'gait = { name = "tripod", cycle_time = 0.8 }\n'
        '[[vary]]\ninput = "stroke"\nvalues = [60, 100]  # mm\n'
    )
    done = run("sweep", "study.toml", "--store", "study.db")
    assert " ".join(done.out.split()).startswith(
        "study: none of 2 cases done: ParameterError: Gait.stroke = 60.0: must be at most 10 m; mm?"
    )
    assert done.out.count("60.0") == 1 and "--plot" not in done.out  # no second time, no next
    assert done.status == 2 and done.err.endswith("study: none of 2 cases done\n")


def test_a_walk_that_goes_on_is_not_exported_but_its_plan_is(run: Run) -> None:
    """The way out was in words of Python; one cycle was "1 whole gait cycle(s)"."""
    walked().save("walk.nc")
    done = run("export", "walk.nc", "w.yaml")
    said = " ".join(done.err.split())
    assert done.status == 2 and "hexapod-pin export ROBOT OUT --duration 10" in said
    assert "hp." not in said and "write_joint_trajectory" not in said
    counts = [Window(None, None, 0.0, 1.0, count).counted for count in (None, 1, 2)]
    assert counts == ["", ", 1 whole gait cycle", ", 2 whole gait cycles"]
