"""Stiffer feet and servos: what `stiffer` changes, and what must stay."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.commands.app import main
from hexapod_pin.errors import ParameterError
from hexapod_pin.study.judge_peaks import servo_stiffness

MASS, SPEED = 0.1, 0.2  # of the free impact [kg], [m/s]
STEPS_PER_DEPTH = 400  # RK4 steps while the mass would cross one impact depth: errors below 1e-6

NORMAL_LAWS = {
    "hunt-crossley": hp.contact.HuntCrossley(stiffness=1e6, dissipation=2.0),
    "restitution": hp.contact.Restitution(stiffness=1e6, restitution=0.4),
    "kelvin-voigt": hp.contact.KelvinVoigt(stiffness=3e4, damping=15.0),
    "hertzian kelvin-voigt": hp.contact.KelvinVoigt(stiffness=1e6, exponent=1.5, damping=15.0),
    "adams-impact": hp.contact.AdamsImpact(
        stiffness=1e7, exponent=2.2, damping=10.0, damping_depth=1e-3
    ),
}


def impact(law) -> tuple[float, float]:
    """Return restitution [-] and largest depth [m] of a free mass, by RK4 in this file."""
    native = law.native()
    scale = (MASS * SPEED**2 / law.stiffness) ** (1.0 / (law.exponent + 1.0))
    h, depth, rate, deepest = scale / SPEED / STEPS_PER_DEPTH, 0.0, SPEED, 0.0

    def pull(d: float, u: float) -> float:
        return -native(d, u, SPEED)[0] / MASS

    while True:
        k1 = pull(depth, rate)
        k2 = pull(depth + 0.5 * h * rate, rate + 0.5 * h * k1)
        k3 = pull(depth + 0.5 * h * (rate + 0.5 * h * k1), rate + 0.5 * h * k2)
        k4 = pull(depth + h * (rate + 0.5 * h * k2), rate + h * k3)
        depth += h * rate + h * h * (k1 + k2 + k3) / 6.0
        rate += h * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0
        deepest = max(deepest, depth)
        if depth <= 0.0:
            return -rate / SPEED, deepest


@pytest.mark.parametrize("law", NORMAL_LAWS.values(), ids=NORMAL_LAWS)
@pytest.mark.parametrize("factor", [2.0, 0.3])
def test_a_stiffer_foot_bounces_as_before_and_sinks_in_less(law, factor: float) -> None:
    """Similarity of free impacts: the same restitution, depths as factor^(-1/(n + 1))."""
    stiffer = law.stiffer(factor)
    assert stiffer.stiffness == factor * law.stiffness
    before, after = impact(law), impact(stiffer)
    assert 0.05 < before[0] < 0.95
    # both runs take the same steps but for scale: what is left is where the last one ends
    assert after[0] == pytest.approx(before[0], rel=2e-3)
    assert after[1] / before[1] == pytest.approx(factor ** (-1.0 / (law.exponent + 1.0)), rel=1e-6)


def test_a_stiffer_spring_of_friction_keeps_its_damping_ratio() -> None:
    law = hp.contact.StickSlip(mu=0.7, mu_dynamic=0.5, stiffness=2e4, damping=60.0)
    stiffer = law.stiffer(2.0)
    assert (stiffer.mu, stiffer.mu_dynamic, stiffer.stiffness) == (0.7, 0.5, 4e4)
    ratios = [each.damping / (2.0 * math.sqrt(each.stiffness * 0.1)) for each in (law, stiffer)]
    assert ratios[0] == pytest.approx(ratios[1], rel=1e-12)
    without_spring = hp.contact.TanhCoulomb(mu=0.7, slope=1e3)
    assert without_spring.stiffer(2.0) == without_spring


def test_a_stiffer_contact_is_stiffer_in_all_directions_and_says_so() -> None:
    before = hp.Contact.accurate()
    after = before.stiffer(2.0)
    assert after.normal.stiffness == 2.0 * before.normal.stiffness
    assert after.friction.stiffness == 2.0 * before.friction.stiffness
    assert after.normal.restitution == before.normal.restitution
    assert after.assumed.startswith(before.assumed) and "2 times as stiff" in after.assumed


@pytest.mark.parametrize("gain", [240.0, {"coxa": 100.0, "femur": 240.0, "tibia": 50.0}, None])
def test_stiffer_servos_keep_kd_over_kp_limits_and_motor(gain) -> None:
    robot = hp.load_robot("kharagpur")
    gain = tuple(10.0 + k for k in range(18)) if gain is None else gain
    motor = hp.Motor(stall_torque=3.0, no_load_speed=6.0)
    before = hp.Servo(kp=gain, kd=4.8, motor=motor, assumed=True)
    after = before.stiffer(2.0)
    for old, new in zip(before.gains(robot), after.gains(robot), strict=True):
        assert (new == 2.0 * old).all()
    assert (after.limited, after.motor, after.assumed) == (True, motor, True)
    assert hp.Servo(**after.model_dump()) == after


@pytest.mark.parametrize("factor", [0.0, -2.0, math.inf, math.nan])
def test_a_factor_is_positive_and_finite(factor: float) -> None:
    servo = hp.Servo(kp=1.0, kd=0.1)
    for part in (*NORMAL_LAWS.values(), hp.Contact.s1(), hp.Contact.accurate().friction, servo):
        with refused(ParameterError, value=factor) as caught:
            part.stiffer(factor)
        assert caught.value.name.rpartition(".")[2] == "factor"


# How far peaks depend on assumed servo gains: two more runs, one line.

GAIT = hp.Gait.tripod(stroke=0.03, cycle_time=0.4)
LINE = "with servo stiffness x0.5/x2"


def case_of(**scene: object) -> hp.Case:
    """Return a walk of two steady cycles."""
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
    assert (
        effect.torque_peak_change[0] < 0.0 < effect.torque_peak_change[1]
    )  # stiffer servos: harder touch-downs
    assert effect.failures == ("", "")
    assert effect.line.startswith(f"peaks move by {effect.torque_peak_change[0]:+.0%}/")
    assert effect.line.endswith(LINE)


def test_without_servos_there_is_nothing_to_change() -> None:
    case = case_of(prescribed=True)
    with refused(ParameterError, "case", "no servo stiffness"):
        servo_stiffness(case, case.run())


@pytest.mark.parametrize(("more", "printed"), [
    ((), True), (("--quick",), False), (("--kp", "240", "--kd", "4.8"), False),
    (("--prescribed",), False),
])  # fmt: skip
def test_walk_prints_it_of_assumed_gains_unless_quick(
    more: tuple[str, ...], printed: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = "walk kharagpur --gait tripod --cycle-time 0.4 --stroke 0.03 --duration 1.2 --no-html"
    with pytest.raises(SystemExit) as ended:
        main([*options.split(), "--accuracy", "1e-2", "--out", str(tmp_path / "w.nc"), *more])
    out = capsys.readouterr().out
    assert ended.value.code == 0
    assert (LINE in out) is printed
