"""Stiffer feet and servos: what `stiffer` changes, and what must stay."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from contact_formulas import NORMAL
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.commands.app import main
from hexapod_pin.errors import ParameterError
from hexapod_pin.study.judge_peaks import servo_stiffness


@pytest.mark.parametrize("law", NORMAL.values(), ids=NORMAL)
def test_a_stiffer_foot_bounces_as_before_and_sinks_in_less(law) -> None:
    """Similarity of free impacts: s = factor^(-1/(n + 1)) of the depth, 1/s of the force."""
    factor, speed = 0.3, 0.2
    stiffer = law.stiffer(factor)
    assert stiffer.stiffness == factor * law.stiffness
    scale = factor ** (-1.0 / (law.exponent + 1.0))
    for depth in (1e-5, 2e-4, 3e-3):
        for rate in (-0.15, 0.0, 0.2):
            before = law.native()(depth, rate, speed)[0]
            after = stiffer.native()(scale * depth, rate, speed)[0]
            assert before == 0.0 or after * scale == pytest.approx(before, rel=1e-12)
    assert before > 0.0


def test_a_stiffer_spring_of_friction_keeps_its_damping_ratio() -> None:
    law = hp.contact.StickSlip(mu=0.7, mu_dynamic=0.5, stiffness=2e4, damping=60.0)
    stiffer = law.stiffer(2.0)
    assert (stiffer.mu, stiffer.mu_dynamic, stiffer.stiffness) == (0.7, 0.5, 4e4)
    ratios = [each.damping / (2.0 * math.sqrt(each.stiffness * 0.1)) for each in (law, stiffer)]
    assert ratios[0] == pytest.approx(ratios[1], rel=1e-12)
    without_spring = hp.contact.TanhCoulomb(mu=0.7, slope=1e3)
    assert without_spring.stiffer(2.0) == without_spring
    before = hp.Contact.accurate()
    after = before.stiffer(2.0)
    assert after.normal.stiffness == 2.0 * before.normal.stiffness
    assert after.friction.stiffness == 2.0 * before.friction.stiffness
    assert after.normal.restitution == before.normal.restitution
    assert after.assumed.startswith(before.assumed) and "2 times as stiff" in after.assumed


@pytest.mark.parametrize(
    "gain", [240.0, {"coxa": 1.0, "femur": 2.0, "tibia": 5.0}, tuple(10.0 + k for k in range(18))]
)
def test_stiffer_servos_keep_kd_over_kp_limits_and_motor(gain) -> None:
    robot = hp.load_robot("kharagpur")
    motor = hp.Motor(stall_torque=3.0, no_load_speed=6.0)
    before = hp.Servo(kp=gain, kd=4.8, motor=motor, assumed=True)
    after = before.stiffer(2.0)
    for old, new in zip(before.gains(robot), after.gains(robot), strict=True):
        assert (new == 2.0 * old).all()
    assert (after.limited, after.motor, after.assumed) == (True, motor, True)


@pytest.mark.parametrize("factor", [-2.0, math.nan])
def test_a_factor_is_positive_and_finite(factor: float) -> None:
    servo = hp.Servo(kp=1.0, kd=0.1)
    for part in (*NORMAL.values(), hp.Contact.s1(), hp.Contact.accurate().friction, servo):
        with refused(ParameterError, value=factor) as caught:
            part.stiffer(factor)
        assert caught.value.name.rpartition(".")[2] == "factor"


# How far peaks depend on assumed servo gains: two more runs, one line.

GAIT = hp.Gait.tripod(stroke=0.03, cycle_time=0.4)
LINE = "with servo stiffness x0.5/x2"


def case_of(**scene: object) -> hp.Case:
    robot = hp.load_robot("kharagpur")
    return hp.Case(hp.Scene(robot, **scene), hp.KinematicControl(GAIT), duration=1.6)  # type: ignore[arg-type]


def test_the_changes_are_those_of_runs_with_other_servos() -> None:
    case = case_of()
    trace = case.run()
    effect = servo_stiffness(case, trace, threads=2)
    peak = np.abs(trace.summary.torque_peak).max()
    for found, factor in zip(effect.torque_peak_change, (0.5, 2.0), strict=True):
        other = case_of(servo=case.scene.servos.stiffer(factor)).run().summary
        assert found == pytest.approx(np.abs(other.torque_peak).max() / peak - 1.0, rel=1e-12)
    assert effect.torque_peak_change[0] < 0.0 < effect.torque_peak_change[1]
    assert effect.failures == ("", "")
    assert effect.line.startswith(f"peaks move by {effect.torque_peak_change[0]:+.0%}/")
    assert effect.line.endswith(LINE)


def test_without_servos_there_is_nothing_to_change() -> None:
    case = case_of(prescribed=True)
    with refused(ParameterError, "case", "no servo stiffness"):
        servo_stiffness(case, case.run())


@pytest.mark.parametrize(
    ("more", "printed"), [((), True), (("--quick",), False), (("--kp", "240", "--kd", "4"), False)]
)
def test_walk_prints_it_of_assumed_gains_unless_quick(
    more: tuple[str, ...], printed: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = "walk kharagpur --gait tripod --cycle-time 0.4 --stroke 0.03 --duration 1.2 --no-html"
    with pytest.raises(SystemExit) as ended:
        main([*options.split(), "--accuracy", "1e-2", "--out", str(tmp_path / "w.nc"), *more])
    out = capsys.readouterr().out
    assert ended.value.code == 0
    assert (LINE in out) is printed
