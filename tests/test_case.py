"""Cases as data: to the bit, digested by meaning, refused with a path; checks before they run."""

from __future__ import annotations

import math
import shutil
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from refusals import refused
from test_run_ends_early import SCENE, TICK, Sway

import hexapod_pin as hp
from hexapod_pin.control import BodyMotion, Sine, VelocityCommand
from hexapod_pin.control.joint_trajectory import JointTrajectory
from hexapod_pin.errors import HexapodError, ParameterError, UserCodeError
from hexapod_pin.robot.robot_source import urdf_path

ROBOT = hp.load_robot("kharagpur")
GAIT = hp.Gait.tripod(stroke=0.05 + 1e-17, cycle_time=0.8, turn_rate=math.pi / 7)


def walk(**settings: Any) -> hp.Case:
    scene = hp.Scene(
        ROBOT, servo=hp.Servo(kp=20.0 / 3.0, kd=0.1 + 0.2), gravity=(1e-300, -0.0, -9.80665),
        contact=hp.Contact.s2(),
    )  # fmt: skip
    return hp.Case(scene, hp.KinematicControl(GAIT, stop_at=8.0 / 3.0), **settings)


@dataclass(frozen=True)
class Crouch:
    """A controller of one's own: the standing posture with bent femurs."""

    angle: float

    def plan(self, robot: hp.Robot, duration: float) -> JointTrajectory:
        femurs = {name: self.angle for name in robot.joint_names if "femur" in name}
        return hp.HoldPosture(femurs).plan(robot, duration)

    def to_dict(self) -> dict[str, Any]:
        return {"kind": "crouch", "angle": self.angle}

    @staticmethod
    def read(data: Any) -> Crouch:
        return Crouch(data["angle"])


CASES = {
    "walk": walk(duration=0.3, accuracy=1e-5 / 3.0),
    "hold all": hp.Case(hp.Scene(ROBOT), hp.HoldPosture(ROBOT.posture + 1e-3), method="robust"),
    "held": hp.Case(hp.Scene(ROBOT), hp.motion.SampledTrajectory([0.0, 0.1], [ROBOT.posture] * 2)),
    "state": walk(initial=replace(ROBOT.stand(), v=np.full(24, 1e-3 / 7)), duration=0.1),
    "trunk": hp.Case(
        hp.Scene(
            hp.load_robot("athena", foot_radius=0.03 / 7, posture=[0.0, 0.5, 1.0 / 3] * 6),
            loads=[
                hp.Payload("base_link", mass=0.1 / 3, position=(0.0, 0.0, 0.05)),
                hp.Push("base_link", force=(1.0 / 3, 0.0, 0.0), start=0.1, duration=0.2),
                hp.LostLeg("lf", 0.7),
            ],
            terrain=hp.Slope(angle=0.1 / 3),
        ),
        hp.KinematicControl(
            GAIT.model_copy(update={"turn_rate": 0.0}),
            body=BodyMotion(height=0.01 / 3, pitch=Sine(amplitude=0.01 / 3, period=0.7)),
            velocity=VelocityCommand(time=(0.0, 1.0 / 3), forward=(0.02, 0.01 / 3)),
        ),
        duration=0.5,
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_a_case_comes_back_as_it_was(name: str) -> None:
    case = CASES[name]
    back = hp.Case.from_toml(case.to_toml())
    assert back == case and hash(back) == hash(case) and back.digest == case.digest
    assert back.to_toml() == case.to_toml()
    assert back.scene.gravity == case.scene.gravity and back.scene.servos == case.scene.servos
    assert [f.radius for f in back.scene.robot.feet] == [f.radius for f in case.scene.robot.feet]
    assert np.array_equal(back.scene.robot.posture, case.scene.robot.posture)
    if case.initial is not None:
        assert np.array_equal(back.initial.q, case.initial.q)
        assert np.array_equal(back.initial.v, case.initial.v)


def test_a_case_repeats_and_goes_on(tmp_path: Path) -> None:
    """Its trace carries it, which repeats to the bit; it may go on from a checkpoint."""
    case = CASES["walk"]
    trace = case.run()
    assert trace.case_toml == case.to_toml()
    again = hp.load_case(hp.load_trace(trace.save(tmp_path / "walk.nc")))
    assert again == case and again.run() == trace
    then = replace(case, initial=trace.checkpoint, duration=0.2)
    back = hp.load_case(then.save(tmp_path / "case.toml"))
    one, two = hp.simulate_batch([then, back], errors="raise")
    assert np.array_equal(one.q, two.q) and one.time[0] == 0.3
    assert hp.load_case(one) == then == back


def test_a_digest_is_of_the_meaning() -> None:
    plain = walk(duration=2)
    same = [
        walk(duration=2.0, method="ndf", accuracy=1e-4, torque_accuracy="1 %", sample=0.002),
        replace(plain, scene=replace(plain.scene, robot=hp.load_robot(urdf_path("kharagpur")))),
    ]
    others = [
        walk(duration=2.001, sample=1e-3), walk(duration=2, accuracy=math.nextafter(1e-4, 1.0)),
        walk(duration=2, method="robust"), walk(duration=2, initial=ROBOT.stand()),
        replace(plain, controller=hp.HoldPosture()),
        replace(plain, scene=replace(plain.scene, robot=hp.load_robot("athena"))),
    ]  # fmt: skip
    for case in same:
        assert case.digest == plain.digest
    assert len({case.digest for case in (plain, *others)}) == 1 + len(others)


def test_robots_of_files(tmp_path: Path) -> None:
    here, there = tmp_path / "here", tmp_path / "there"
    (here / "robots").mkdir(parents=True)
    shutil.copy(urdf_path("kharagpur"), here / "robots" / "mine.urdf")
    scene = hp.Scene(hp.load_robot(here / "robots" / "mine.urdf"))
    case = hp.Case(scene, hp.HoldPosture(), duration=0.1)
    case.save(here / "case.toml")
    assert 'source = "robots/mine.urdf"' in (here / "case.toml").read_text()
    here.rename(there)
    assert hp.load_case(there / "case.toml").digest == case.digest
    text = (there / "robots" / "mine.urdf").read_text()
    (there / "robots" / "mine.urdf").write_text(text.replace("<robot", "<!-- --><robot", 1))
    with refused(ParameterError, "scene: robot.digest", scene.robot.digest):
        hp.load_case(there / "case.toml")
    first, second = (hp.Case.from_toml(CASES["walk"].to_toml()) for _ in range(2))
    assert first.scene.robot is second.scene.robot


def test_what_is_wrong_is_named_with_its_path() -> None:
    with refused(ParameterError, "case file", "none.toml"):
        hp.load_case("none.toml")
    text = CASES["walk"].to_toml()
    for old, new, name in (
        ("schema = 1", "schema = 2", "case.schema"),
        ("duration = 0.3", 'duration = "0.3"', "Case.duration"),
        ("duration = 0.3", "duration = 0.3\nlength = 3", "run.length"),
        ('kind = "kinematic"', 'kind = "dance"', "controller.kind"),
        ("lift = 0.02", 'lift = "far"', "controller: Gait.lift"),
        ("[scene.servo]", "[scene.servo]\nki = 1.0", "scene: Servo.ki"),
        ("[scene.robot]", "[scene.robot]\nwheels = 4", "scene.robot.wheels"),
        ("[controller]", "[controllers]", "case.controller"),
    ):
        with pytest.raises(ParameterError) as caught:
            hp.Case.from_toml(text.replace(old, new, 1))
        assert name in caught.value.name


def test_a_controller_of_ones_own_is_saved_once_it_is_registered(tmp_path: Path) -> None:
    case = hp.Case(hp.Scene(ROBOT), Crouch(0.2 / 3), duration=0.1)
    about = ("register_controller('crouch'",)
    with refused(ParameterError, "Case.controller", "Crouch", about=about):
        case.save(tmp_path / "case.toml")
    assert not list(tmp_path.iterdir())
    for _ in range(2):  # the same again: no harm
        hp.register_controller("crouch", Crouch.read)
    assert hp.load_case(case.save(tmp_path / "case.toml")).controller == Crouch(0.2 / 3)
    with refused(ParameterError, "kind", "hold"):
        hp.register_controller("hold", Crouch.read)
    with refused(ParameterError, "Case.controller", "object", about=("to_dict",)):
        hp.Case(hp.Scene(ROBOT), object()).to_toml()


# What is asked of a controller before a run is checked, and costs no other run.


@dataclass(frozen=True)
class OddKey(Sway):
    """What a batch asks of a controller before it runs, broken in one way."""

    wrong: str = ""

    def broken(self, name: str, odd: Any, good: Any) -> Any:
        if self.wrong == name:
            raise RuntimeError(name)
        return odd if self.wrong == f"odd {name}" else good

    def to_dict(self) -> dict[str, Any]:
        return self.broken("to_dict", {}, {**super().to_dict(), "wrong": self.wrong})

    def start_key(self, scene: hp.Scene) -> Any:
        return self.broken("start_key", [], 0)

    def start(self, scene: hp.Scene, batch: int) -> Any:
        return self.broken("start", object(), super().start(scene, batch))

    def posture(self, scene: hp.Scene) -> Any:
        return self.broken("posture", [0.0], scene.robot.posture)


@pytest.mark.parametrize(
    "wrong",
    ["to_dict", "start_key", "odd start_key", "start", "odd start", "posture", "odd posture"],
)
def test_what_is_called_before_a_run_ends_no_other(wrong: str) -> None:
    cases = [hp.Case(SCENE, OddKey(wrong=word), duration=0.02) for word in ("", wrong, "")]
    one, error, other = hp.simulate_batch(cases)
    assert isinstance(one, hp.Trace) and isinstance(other, hp.Trace)
    assert isinstance(error, HexapodError) and error.trace is None
    if not wrong.startswith("odd"):
        assert isinstance(error, UserCodeError) and error.call == f"OddKey.{wrong}"


@dataclass(frozen=True)
class Planner:
    """Plans whatever it was given."""

    planned: Any
    settings: Any = None

    def plan(self, robot: hp.Robot, duration: float) -> Any:
        if isinstance(self.planned, Exception):
            raise self.planned
        return self.planned

    def to_dict(self) -> Any:
        return {"kind": "planner"} if self.settings is None else self.settings


def narrow() -> Any:
    plan = hp.HoldPosture().plan(ROBOT, 1.0)
    return replace(plan, q=plan.q[:, :2], v=plan.v[:, :2])


@pytest.mark.parametrize("planned", [None, narrow(), ValueError("no plan")])
def test_a_plan_that_is_none_is_refused(planned: Any) -> None:
    with pytest.raises(HexapodError) as caught:
        hp.simulate(SCENE, Planner(planned), duration=0.02)
    error = caught.value
    if isinstance(planned, Exception):
        assert isinstance(error, UserCodeError) and error.call == "Planner.plan"
    else:
        assert isinstance(error, ParameterError) and "Planner.plan" in error.name


@pytest.mark.parametrize("settings", [[], {"gain": None}, {1: 2.0}, {"gain": np.arange(3)}])
def test_settings_that_no_file_takes_are_refused_before_the_run(settings: Any) -> None:
    with pytest.raises(ParameterError) as caught:
        hp.simulate(SCENE, Planner(hp.HoldPosture().plan(ROBOT, 1.0), settings), duration=0.02)
    assert caught.value.name.startswith("Planner.to_dict")


@pytest.mark.parametrize(
    ("name", "value"),
    [("period", None), ("period", 1e-9), ("delay", -1.0), ("gait", "tripod"), ("sensors", 3)],
)
def test_attributes_of_a_controller_are_checked(name: str, value: Any) -> None:
    class Odd:
        period, delay, start, update = TICK, 0.0, Sway().start, Sway().update

    controller = Odd()
    setattr(controller, name, value)
    with refused(ParameterError, f"controller.{name}"):
        hp.simulate(SCENE, controller, duration=0.02)
