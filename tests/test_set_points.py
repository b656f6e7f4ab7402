"""Set-points between the ticks of a controller: cubics with continuous angles and rates."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from foot_control_runs import robot
from scipy.interpolate import CubicHermiteSpline

import hexapod_pin as hp
from hexapod_pin.results.walk_metrics import WalkMetrics

PERIOD = 0.01
TICKS = 30


@cache
def wanted() -> tuple[np.ndarray, np.ndarray]:
    time = PERIOD * np.arange(1, TICKS + 1)[:, None]
    phase = np.random.default_rng(2).uniform(0.0, 6.0, 18)
    angle, rate = 0.05 * np.sin(9.0 * time + phase), 0.45 * np.cos(9.0 * time + phase)
    fade = np.minimum(time / 0.1, 1.0)
    return robot("kharagpur").posture + fade * angle, rate


@dataclass(frozen=True)
class Scripted:
    """Sends angles, with their rates or without."""

    rated: bool
    period: float = PERIOD
    delay: float = 0.0

    def start(self, scene: hp.Scene, batch: int) -> None:
        return None

    def update(self, time, measurement, state):
        q, v = (part[round(time / PERIOD)][None] for part in wanted())
        return hp.feedback.Command(q, v if self.rated else None, ramp=True), state


@pytest.mark.parametrize(("rated", "delay"), [(True, 0.0033), (False, 0.0)])
def test_commands_are_joined_by_cubics(rated, delay):
    trace = hp.simulate(
        hp.Scene(robot("kharagpur")), Scripted(rated, delay=delay), duration=0.28, sample=5e-4
    )
    q, v = wanted()
    angles = np.vstack([robot("kharagpur").posture, q])
    if not rated:
        v = np.diff(angles, axis=0) / PERIOD
    rates = np.vstack([np.zeros(18), v])
    knots = PERIOD * np.arange(TICKS + 1) + delay
    spline = CubicHermiteSpline(knots, angles, rates)
    late = trace.time >= delay
    assert trace.q_ref[late] == pytest.approx(spline(trace.time[late]), abs=1e-12)
    assert trace.v_ref[late] == pytest.approx(spline(trace.time[late], 1), abs=1e-9)
    assert np.ptp(trace.v_ref, axis=0).min() > 0.5
    assert not (trace.q_ref[~late] - robot("kharagpur").posture).any()


@pytest.mark.parametrize(("way", "end"), [(0.4, None), (-0.4, 2.5), (0.4, -1.0)])
def test_cubics_keep_to_the_limits_of_rates(way, end):
    one = robot("kharagpur")
    limit = one.velocity_limit.min()
    session = hp.Session(hp.Scene(one), accuracy=1e-3, sample=2e-4)
    q = one.posture.copy()
    q[0] += way
    rate = None if end is None else np.eye(18)[0] * end * np.sign(way)
    session.command(q=q, v=rate, ramp=0.02)
    session.advance(0.3)
    trace = session.trace()
    moves = np.abs(trace.q_ref[:, 0] - q[0]) > 1e-12
    fastest = np.abs(trace.v_ref[moves, 0]).max()
    assert fastest <= limit * (1.0 + 1e-12)
    assert fastest == pytest.approx(limit, rel=2e-4)  # samples are 0.2 ms apart
    assert trace.q_ref[-1] == pytest.approx(q, abs=1e-12) and not trace.v_ref[-1].any()


def test_a_command_on_the_way_goes_on_with_the_rates_that_it_finds():
    one = robot("kharagpur")
    session = hp.Session(hp.Scene(one), accuracy=1e-3, sample=1e-3)
    session.command(q=one.posture + 0.1, ramp=0.1)
    session.advance(0.05)
    session.command(q=one.posture, v=np.zeros(18), ramp=0.1)
    session.advance(0.3)
    trace = session.trace()
    first = CubicHermiteSpline([0.0, 0.1], [0.0, 0.1], [0.0, 1.0])
    half = first(0.05), first(0.05, 1)
    second = CubicHermiteSpline([0.05, 0.15], [half[0], 0.0], [half[1], 0.0])
    t = trace.time[:, None]
    expected = np.where(t <= 0.05, first(t), np.where(t <= 0.15, second(t), 0.0))
    assert trace.q_ref - one.posture == pytest.approx(np.tile(expected, 18), abs=1e-12)


def test_without_parts_foot_control_is_kinematic_control():
    """Ticks of 5 ms: 1 % in every metric; dry friction is 3 % of the peak torque, 4.6 N m."""
    gait, one = hp.Gait.tripod(lift=0.03), robot("athena")
    motor = hp.Motor(stall_torque=1e6, no_load_speed=1e9, dry_friction=0.03 * 4.6)
    servo = hp.Servo.for_robot(one).model_copy(update={"motor": motor})
    scene = hp.Scene(one, contact=hp.Contact.s1(), servo=servo)
    how = {"duration": 3.05 * gait.cycle_time, "sample": 0.02, "accuracy": 1e-5}
    planned, closed = (
        WalkMetrics.of(hp.simulate(scene, control, **how).summary).to_dict()
        for control in (hp.KinematicControl(gait), hp.FootControl(gait))
    )
    assert [k for k, x in planned.items() if x is None] == [
        k for k, x in closed.items() if x is None
    ]
    for metric, value in ((k, x) for k, x in planned.items() if x is not None):
        # a walk that goes straight has neither [m, rad]
        least = {"path_deviation": 1e-5, "heading_error": 1e-4}.get(metric, 0.0)
        assert abs(closed[metric] - value) <= 0.01 * max(abs(value), least), metric
