"""Gears with free play: rotor and link as two inertias with a gap; impacts, loops, energy."""

from __future__ import annotations

import math
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from refusals import refused
from scipy.integrate import solve_ivp

import hexapod_pin as hp
from hexapod_pin.commands.loading_options import load_options
from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.results.joint_budget import kind_rows, summary_rows
from hexapod_pin.robot.leg_bodies import leg_bodies
from hexapod_pin.robot.loading.load_options import LoadOptions
from tests.vehicles import heavy_leg

JOINT, GAP = "c_joint", "c_joint_backlash"
LINK, ROTOR = 2e-3, 5e-3  # inertias about the joint, kg m^2
EDGE = 0.01  # rad from the middle of the gap to either edge
MOTOR = hp.Motor(stall_torque=1e6, no_load_speed=1e6, rotor_inertia=ROTOR)
ROBOT = heavy_leg(1.0, backlash={JOINT: 2.0 * EDGE})
HOLD = hp.HoldPosture((0.0,) * 4)


def run(
    stiffness: float, dissipation: float = 0.0, *, kp: float = 0.0, kd: float = 0.0,
    push: float = 0.0, rate: float = 0.0, duration: float = 0.1, sample: float = 1e-3,
    control: Any = HOLD, motor: hp.Motor = MOTOR, **settings: Any,
) -> hp.Trace:  # fmt: skip
    rest = {"a_joint": 0.0, "b_joint": 0.0}
    servo = hp.Servo(
        kp={**rest, JOINT: kp, GAP: 9.0}, kd={**rest, JOINT: kd, GAP: 9.0},
        limited=False, motor={JOINT: motor},
    )  # fmt: skip
    stops = hp.JointStops(stiffness=0.0, gap_stiffness=stiffness, dissipation=dissipation)
    loads = [hp.Push("c", torque=(0.0, push, 0.0), start=0.0, duration=100.0)] if push else []
    scene = hp.Scene(ROBOT, servo=servo, gravity=(0.0, 0.0, 0.0), stops=stops, loads=loads)
    q, v = ROBOT.stand().q.copy(), np.zeros(ROBOT.model.nv)
    q[2] += 10.0
    v[6 + ROBOT.joint_index(GAP)] = rate
    return hp.simulate(
        scene, control, duration=duration, sample=sample, initial=ROBOT.check_state(q, v),
        **(settings or {"method": "dop853", "accuracy": 1e-9}),
    )  # fmt: skip


def angles(trace: hp.Trace) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    j, k = ROBOT.joint_index(JOINT), ROBOT.joint_index(GAP)
    return trace.q[:, 7 + j], trace.v[:, 6 + j], trace.q[:, 7 + k], trace.v[:, 6 + k]


@pytest.mark.parametrize("method", ["dop853", "ndf", "extrapolated-euler"])
def test_free_play_and_elastic_impact(method: str) -> None:
    """The link is free up to the edge; there both inertias exchange rates as elastic bodies do."""
    stiffness, rate = 400.0, 2.0
    accuracy = {"dop853": 1e-9, "ndf": 1e-7, "extrapolated-euler": 1e-6}[method]
    trace = run(stiffness, rate=rate, duration=0.02, sample=1e-3, method=method, accuracy=accuracy)
    rotor, rotor_rate, gap, gap_rate = angles(trace)
    free = trace.time < EDGE / rate  # 5 ms
    np.testing.assert_allclose(gap[free], rate * trace.time[free], atol=10 * accuracy)
    assert np.abs(rotor[free]).max() < 10 * accuracy
    reduced = ROTOR * LINK / (ROTOR + LINK)
    contact = math.pi * math.sqrt(reduced / stiffness)  # half a period
    behind = int(math.ceil((EDGE / rate + contact) / 1e-3))
    link_rate, share = rotor_rate + gap_rate, 2 * LINK / (LINK + ROTOR)
    assert rotor_rate[behind] == pytest.approx(rate * share, rel=100 * accuracy)
    assert link_rate[behind] == pytest.approx(rate * (share - 1), rel=1e3 * accuracy)
    momentum = ROTOR * rotor_rate + LINK * link_rate
    np.testing.assert_allclose(momentum, LINK * rate, rtol=1e-6)
    assert np.abs(trace.energy_residual).max() < 100 * accuracy * 0.5 * LINK * rate**2


def test_servo_and_load_against_scipy() -> None:
    kp, kd, push, target = 8.0, 0.1, -0.2, 0.05
    hold = hp.HoldPosture((0.0, 0.0, target, 0.0))
    trace = run(400.0, 0.2, kp=kp, kd=kd, push=push, duration=0.3, sample=0.01, control=hold)

    def rates(_: float, y: np.ndarray) -> tuple[float, ...]:
        gap, speed = y[2] - y[0], y[3] - y[1]
        depth = max(gap - EDGE, 0.0) + min(gap + EDGE, 0.0)
        edge = 400.0 * depth * max(0.0, 1.0 + 1.5 * 0.2 * math.copysign(speed, depth * speed))
        motor = kp * (target - y[0]) - kd * y[1]
        return y[1], (motor + edge) / ROTOR, y[3], (push - edge) / LINK

    fine = {"rtol": 1e-10, "atol": 1e-12, "max_step": 1e-4}
    exact = solve_ivp(rates, (0.0, 0.3), np.zeros(4), t_eval=trace.time, **fine)
    rotor, rotor_rate, gap, gap_rate = angles(trace)
    np.testing.assert_allclose(rotor, exact.y[0], atol=1e-6)
    np.testing.assert_allclose(rotor + gap, exact.y[2], atol=1e-6)
    np.testing.assert_allclose(rotor_rate + gap_rate, exact.y[3], atol=1e-3)
    assert np.abs(trace.energy_residual).max() < 1e-6
    limit = next(one for one in trace.limits if one.joint == GAP)
    assert limit.stop_count >= 3


@pytest.mark.parametrize("side", ["motor", "link"])
def test_side_of_the_encoder(side: str) -> None:
    """A servo's P leaves L / kp at its encoder: on the link's side the gap is inside the loop."""
    load, stall, stiffness = 0.2, 2.0, 400.0
    motor = hp.Motor(stall_torque=stall, no_load_speed=6.0, rotor_inertia=ROTOR)
    firmware = hp.drive.Firmware(proportional=4.0, counts=2**24)
    one, control = firmware.driven(motor), hp.FirmwareControl(HOLD, firmware, encoder=side)
    trace = run(
        stiffness, 0.3, kp=one.kp, kd=one.kd, push=load, duration=0.8, sample=0.1, control=control,
        motor=motor, method="ndf", accuracy=1e-5,
    )  # fmt: skip
    rotor, _, gap, _ = angles(trace)
    seen = rotor[-1] if side == "motor" else rotor[-1] + gap[-1]
    assert seen == pytest.approx(load / (4.0 * stall), abs=2e-5)
    assert gap[-1] == pytest.approx(EDGE + load / stiffness, abs=2e-5)


def test_robot_with_backlash() -> None:
    options = LoadOptions(backlash=0.01)
    robot, plain = hp.load_robot("kharagpur", options=options), hp.load_robot("kharagpur")
    assert robot.legs == plain.legs and len(robot.joint_names) == 36
    assert set(robot.gaps.values()) == set(plain.joint_names)
    assert pickle.loads(pickle.dumps(robot)).gaps == robot.gaps
    servo = hp.Servo(kp=60.0, kd=1.2, motor=hp.drive.identified_drive("MX-64").motor(12.0))
    kp, _ = servo.gains(robot)
    assert [x for x, k in zip(robot.joint_names, kp, strict=True) if k == 0.0] == [*robot.gaps]
    # a first link still sits on the trunk
    assert leg_bodies(robot).pairs == leg_bodies(plain).pairs and not leg_bodies(robot).excluded
    scene = hp.Scene(robot, servo=servo, stops=hp.JointStops(stiffness=600.0, dissipation=0.3))
    assert hp.Scene.from_toml(scene.to_toml()) == scene
    control = hp.KinematicControl(hp.Gait.tripod(stroke=0.06))
    trace = hp.simulate(scene, control, duration=0.05, method="implicit-euler", step=5e-4)
    gaps = [7 + robot.joint_index(name) for name in robot.gaps]
    assert 0.0049 < np.abs(trace.q[:, gaps]).max() < 0.015  # the weight lies on edges
    rows = kind_rows(summary_rows(trace.gathered))
    assert [row.kind for row in rows] == ["coxa", "femur", "tibia"]
    still = hp.Scene(robot, prescribed=True)
    exact = hp.simulate(still, control, duration=0.02, accuracy=1e-3, estimate=False)
    assert np.abs(exact.q[:, gaps]).max() < 1e-12
    with refused(ParameterError, "Motor.rotor_inertia[lf_coxa_joint]"):
        hp.simulate(hp.Scene(robot), control, duration=0.05)
    with refused(ParameterError, "JointStops.gap_stiffness"):
        free = hp.Scene(robot, servo=servo, stops=hp.JointStops(stiffness=0.0))
        hp.simulate(free, control, duration=0.05)
    assert load_options(backlash="0.5").backlash == pytest.approx(math.radians(0.5))
    assert load_options(backlash="lf_coxa_joint=1").backlash == {"lf_coxa_joint": math.radians(1.0)}
    with refused(ParameterError, "--backlash", "much"):
        load_options(backlash="much")
    with refused(UnknownNameError):
        hp.load_robot("kharagpur", options=LoadOptions(backlash={"nose": 0.01}))
    with refused(ParameterError, "LoadOptions.backlash[lf_coxa_joint]", 0.6):
        hp.load_robot("kharagpur", options=LoadOptions(backlash={"lf_coxa_joint": 0.6}))


def test_a_joint_that_only_has_the_name_of_a_gap_keeps_its_drive(tmp_path: Path) -> None:
    text = hp.load_robot("kharagpur").urdf.replace("lf_femur_joint", "lf_coxa_joint_backlash")
    (tmp_path / "named.urdf").write_text(text)
    robot = hp.load_robot(tmp_path / "named.urdf")
    assert "lf_coxa_joint_backlash" in robot.joint_names and not robot.gaps
    assert (hp.Scene(robot).servos.gains(robot)[0] > 0.0).all()
