"""Peaks computed again for both robots, planted causes, and runs that fail."""

from __future__ import annotations

import math
import signal
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import DivergenceError, ParameterError, StudyInterrupted
from hexapod_pin.study.runs.runner import Rows, Runner

GAITS = {
    "tripod": hp.Gait.tripod,
    "wave 3/4": lambda **fields: hp.Gait.wave(3 / 4, **fields),
    "wave 5/6": lambda **fields: hp.Gait.wave(5 / 6, **fields),
}
CYCLE = 1.0  # of all walks [s]; three cycles: two to start, a steady one
SLOWER = {"wave 5/6": 1.8}  # as athena's joints are [s]
QUICK = {"accuracy": 1e-2, "sample": 0.01}  # accuracy is not what these tests are about


@cache
def robot(name: str = "kharagpur") -> hp.Robot:
    return hp.load_robot(name)


def walk(scene: hp.Scene, **settings) -> hp.Case:
    control = hp.KinematicControl(hp.Gait.tripod(stroke=0.05, cycle_time=CYCLE))
    return hp.Case(scene, control, duration=3 * CYCLE, **(settings or QUICK))


def peaks(scene: hp.Scene, case: hp.Case, **settings) -> np.ndarray:
    trace = hp.simulate(scene, case.controller, duration=case.duration, **settings)
    return np.abs(trace.summary.torque_peak)


@pytest.mark.parametrize(
    ("name", "gait"),
    [("kharagpur", "tripod"), ("kharagpur", "wave 3/4"), ("athena", "wave 5/6")],
)
def test_every_verdict_is_that_of_peaks_computed_independently(name: str, gait: str) -> None:
    """The scenes with doubled stiffness are written out here, and the rule too."""
    scene = hp.Scene(robot(name))
    cycle = SLOWER.get(gait, CYCLE) if name == "athena" else CYCLE
    control = hp.KinematicControl(GAITS[gait](stroke=0.02, lift=0.01, cycle_time=cycle))
    case = hp.Case(scene, control, duration=3 * cycle, **QUICK)
    found = hp.study.judge_peaks(case)
    contact, servo = scene.contact, scene.servos
    normal = hp.contact.Restitution(stiffness=2 * contact.normal.stiffness, restitution=0.3)
    friction = hp.contact.StickSlip(mu=0.7, stiffness=4e4, damping=60.0 * math.sqrt(2.0))
    stiff_feet = replace(scene, contact=hp.Contact(normal=normal, friction=friction))
    stiff_servos = replace(scene, servo=hp.Servo(kp=2 * servo.kp, kd=2 * servo.kd))
    # a tenth of the loosest accuracy that makes a difference to a run of ndf: 1e-5 / 0.3
    fine = {"accuracy": 1e-6 / 0.3, "sample": 0.01 / 3}
    run, finer = peaks(scene, case, **QUICK), peaks(scene, case, **fine)
    harder, tighter = peaks(stiff_feet, case, **fine), peaks(stiff_servos, case, **fine)
    floor = 0.01 * finer.max()
    for k, row in enumerate(found.joints):
        values = [each[k] for each in (run, finer, harder, tighter)]
        assert list(row.computed.values()) == pytest.approx(values, rel=1e-9)
        assert (row.torque_peak.low, row.torque_peak.high) == pytest.approx(
            (min(values), max(values))
        )
        size = max(finer[k], floor)
        shares = {
            "accuracy": abs(finer[k] - run[k]) / max(run[k], 0.01 * run.max()),
            "contact stiffness": abs(harder[k] - finer[k]) / size,
            "servo stiffness": abs(tighter[k] - finer[k]) / size,
        }
        moved = {key for key, share in shares.items() if share > 0.05}
        assert set(row.moved_by) == moved
        assert row.verdict == ("range" if moved else "peak")
        assert row.torque_peak.value == pytest.approx(finer[k], rel=1e-9)
    assert len(found.kinds) == 3 and len(found.feet) == 6
    for row in found.kinds:  # the largest peak, and that of the joint which sets it
        of = np.array([row.name in joint for joint in robot(name).joint_names])
        first, second = run[of].argmax(), finer[of].argmax()
        pairs = {
            "accuracy": (run[of].max(), finer[of].max(), finer[of][first]),
            "contact stiffness": (finer[of].max(), harder[of].max(), harder[of][second]),
            "servo stiffness": (finer[of].max(), tighter[of].max(), tighter[of][second]),
        }
        moved = {
            key
            for key, (before, *after) in pairs.items()
            if max(abs(each - before) for each in after) > 0.05 * before
        }
        assert set(row.moved_by) == moved
        assert row.verdict == ("range" if moved else "peak")
        assert row.torque_peak.value == pytest.approx(finer[of].max(), rel=1e-9)


def soft_feet(factor: float = 1.0) -> hp.Contact:
    """Soft feet without a tangential spring: with them and stiff servos, peaks hold."""
    contact = hp.Contact.s1()
    return hp.Contact(normal=contact.normal.stiffer(0.02 * factor), friction=contact.friction)


def stiff_servos(factor: float = 1.0, time: float = 0.02) -> hp.Servo:
    return hp.Servo(kp=2400.0 * factor, kd=2400.0 * factor * time, limited=False)


def calm_scene() -> hp.Scene:
    return hp.Scene(robot(), contact=soft_feet(), servo=stiff_servos())


def test_peaks_that_nothing_moves_are_peaks() -> None:
    found = hp.study.judge_peaks(walk(calm_scene(), accuracy=1e-3))
    assert {row.name: row.verdict for row in found.kinds} == dict.fromkeys(
        ("coxa", "femur", "tibia"), "peak"
    )
    for row in found.kinds:
        assert row.text == f"peak {row.computed['accuracy']:.4g} N m"


def test_what_moves_a_peak_is_named() -> None:
    """Where peaks hold, with stiff feet (touch-downs dominate), coarse steps or soft servos.

    Stiffness is varied at the finer step, and is not blamed for coarse ones.
    """
    hard = replace(calm_scene(), contact=soft_feet(100 / 0.02))
    row = hp.study.judge_peaks(walk(hard, accuracy=1e-3)).kind("tibia")
    assert row.verdict == "range"
    assert "contact stiffness" in row.moved_by
    assert "doubled contact stiffness +" in row.text
    found = hp.study.judge_peaks(walk(calm_scene(), step=5e-3))
    assert "step 0.0005 instead of 0.005 s" in found.table()
    for row in found.kinds:
        assert (row.verdict, row.moved_by) == ("range", ("accuracy",))
        assert "ten times the accuracy -" in row.text
    soft = replace(calm_scene(), servo=stiff_servos(0.1))
    row = hp.study.judge_peaks(walk(soft, accuracy=1e-3)).kind("femur")
    assert (row.verdict, row.moved_by) == ("range", ("servo stiffness",))


def test_the_motor_of_a_quasi_static_walk_is_sized_by_a_peak() -> None:
    """The femur carries the weight: nothing moves its peak by 1 % in a walk ten times slower."""
    scene = hp.Scene(robot(), contact=hp.Contact.s1(), servo=stiff_servos(2.0))
    control = hp.KinematicControl(hp.Gait.tripod(stroke=0.05, cycle_time=10 * CYCLE))
    case = hp.Case(scene, control, duration=30 * CYCLE, accuracy=1e-2, sample=0.02)
    row = hp.study.judge_peaks(case).kind("femur")
    assert row.verdict == "peak"
    assert max(map(abs, row.changes.values())) < 0.01


def test_a_trace_gives_the_verdict_of_its_case() -> None:
    """Its own run is not repeated; a sampled trace that ends early is refused."""
    case = walk(calm_scene())
    trace = case.run()
    done: list[float] = []
    found = hp.study.judge_peaks(trace, progress=done.append)
    assert done == pytest.approx([1 / 3, 2 / 3, 1.0])
    assert found == hp.study.judge_peaks(case, threads=2)
    cut = int(0.9 * len(trace.time))
    arrays = ("time", "q", "v", "torque", "q_ref", "v_ref", "com")
    arrays += ("foot_position", "foot_force", "foot_impulse", "foot_normal", "foot_gap")
    early = replace(
        trace, **{name: getattr(trace, name)[:cut] for name in arrays},
        energy={name: each[:cut] for name, each in trace.energy.items()}, error=None,
    )  # fmt: skip
    done = float(early.time[-1] - early.time[0])
    with refused(ParameterError, "trace", done, allowed=(3 * CYCLE,)):
        hp.study.judge_peaks(early)


def test_a_run_without_a_whole_cycle_is_refused_and_says_how_long() -> None:
    case = replace(walk(calm_scene()), duration=2.5)
    for run in (case, case.run()):
        with refused(ParameterError, "duration", 2.5, allowed=(3 * CYCLE,)):
            hp.study.judge_peaks(run)
    with refused(ParameterError, "Case.duration", None):
        hp.study.judge_peaks(replace(case, duration=None))
    with refused(ParameterError, "judge_peaks.run", "walk.nc"):
        hp.study.judge_peaks("walk.nc")


def test_runs_without_a_walk_or_with_a_start() -> None:
    """A posture is judged over the second half, a start noted; prescribed joints have no servo."""
    case = hp.Case(calm_scene(), hp.HoldPosture(), duration=0.5, **QUICK)
    found = hp.study.judge_peaks(case)
    assert found.window.cycles is None
    assert found.kind("femur").verdict == "peak"
    assert "per window" in found.table()
    start = robot().stand()
    case = hp.Case(calm_scene(), hp.HoldPosture(), start, duration=0.1, **QUICK)
    assert any("given state" in note for note in hp.study.judge_peaks(case).notes)
    scene = replace(calm_scene(), prescribed=True)
    found = hp.study.judge_peaks(walk(scene))
    assert "doubled servo stiffness: no servo: prescribed motion" in found.table()
    assert "servo stiffness" not in found.kind("femur").computed


def test_a_torque_limit_is_no_peak() -> None:
    motor = hp.Motor(stall_torque=100.0, no_load_speed=100.0, peak_torque=1.0)
    servo = hp.Servo(kp=240.0, kd=4.8, motor={"femur": motor})
    found = hp.study.judge_peaks(walk(hp.Scene(robot(), servo=servo)))
    row = found.kind("femur")
    assert (row.verdict, row.torque_peak.high) == ("at the limit", pytest.approx(1.0, rel=1e-6))
    assert row.at_limit > 0.0
    assert found.kind("coxa").verdict != "at the limit"


class Standing:
    """A closed loop that refuses feet stiffer than those it was built for."""

    period = 0.01

    stiffness = math.inf

    def start_key(self, scene: hp.Scene) -> float:
        return scene.contact.normal.stiffness

    def start(self, scene: hp.Scene, batch: int):
        if scene.contact.normal.stiffness > self.stiffness:
            raise ParameterError("Contact.stiffness", scene.contact.normal.stiffness, "softer")
        return scene.robot.posture

    def update(self, time: float, m: hp.feedback.Measurement, posture):
        return hp.feedback.Command(np.tile(posture, (len(m.q), 1))), posture

    def to_dict(self) -> dict[str, object]:
        return {"kind": "standing", "stiffness": self.stiffness}


def test_a_closed_loop_that_refuses_stiffer_feet_is_told() -> None:
    scene = calm_scene()
    control = Standing()
    control.stiffness = 1.5 * scene.contact.normal.stiffness
    found = hp.study.judge_peaks(hp.Case(scene, control, duration=0.2, **QUICK))
    assert not found.hold
    for row in found.joints:
        assert row.verdict == "range unknown"
        assert row.text.startswith("range unknown: doubled contact stiffness was refused")
        assert set(row.computed) == {"run", "accuracy", "servo stiffness"}
    assert "; was refused: Contact.stiffness = " in found.table()


def test_foot_control_keeps_its_gains_and_refuses_stiffer_servos() -> None:
    """A suspension that is stable on the servos it was given would shake on stiffer ones."""
    gait = hp.Gait.tripod(stroke=0.05, cycle_time=CYCLE)
    suspension = hp.foot_control.VirtualSuspension(frequency=20.0 / 3.0)
    control = hp.FootControl(gait, suspension=suspension)
    case = hp.Case(hp.Scene(robot()), control, duration=3 * CYCLE, **QUICK)
    found = hp.study.judge_peaks(case)
    row = found.kind("femur")
    assert row.text.startswith("range unknown: doubled servo stiffness was refused")
    assert row.changes.keys() == {"accuracy", "contact stiffness"}
    assert "suspension.frequency" in found.table()


def test_divergence_is_a_verdict_but_not_of_the_run_itself(monkeypatch) -> None:
    real, lost = Runner.rows, {2}

    def losing(runner, cases, measure):
        rows = real(runner, cases, measure)
        return Rows([DivergenceError("far", None) if k in lost else r for k, r in enumerate(rows)])

    monkeypatch.setattr(Runner, "rows", losing)
    case = hp.Case(calm_scene(), hp.HoldPosture(), duration=0.2, **QUICK)
    row = hp.study.judge_peaks(case).kind("femur")
    assert row.text.startswith("range unknown: doubled contact stiffness diverged (")
    lost.add(0)
    with refused(DivergenceError, about=("far",)):
        hp.study.judge_peaks(case)


def test_an_accuracy_that_cannot_be_tightened_leaves_the_range_unknown() -> None:
    """`ndf` takes over from another method; below its own limit nothing does."""
    usual = {"method": "extrapolated-euler", "accuracy": 5e-8}
    case = hp.Case(calm_scene(), hp.HoldPosture(), duration=0.02, **usual)
    assert (
        "accuracy 5e-09 instead of 5e-08 m and rad, ndf instead"
        in hp.study.judge_peaks(case).table()
    )
    tight = replace(case, method="ndf", accuracy=5e-12)
    row = hp.study.judge_peaks(tight).kind("femur")
    assert row.text.startswith("range unknown: ten times the accuracy is out of reach")
    assert row.changes.keys() == {"contact stiffness", "servo stiffness"}


def test_ctrl_c_is_a_typed_error() -> None:
    with refused(StudyInterrupted, trace=None, about=("peaks",)) as caught:
        hp.study.judge_peaks(
            walk(calm_scene()), progress=lambda _: signal.raise_signal(signal.SIGINT)
        )
    assert len(caught.value.result) == 4 and not caught.value.result.complete
