"""One joint between heavy bodies: drives against closed forms, methods against each other."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import hexapod_pin as hp
from tests.vehicles import FREE, heavy_leg

INERTIA = 2e-3  # of the light link about its joint, kg m^2
JOINT = "c_joint"
WEIGHTLESS = (0.0, 0.0, 0.0)
SETTINGS: dict[str, dict[str, Any]] = {
    "extrapolated-euler": {"accuracy": 1e-6}, "ndf": {"accuracy": 1e-7},
    "dop853": {"accuracy": 1e-9}, "robust": {"step": 1e-3}, "implicit-euler": {"step": 1e-3},
    "rk4": {"step": 1e-3},
}  # fmt: skip


def run(
    method: str, *, kp: float = 0.0, kd: float = 0.0, target: float = 0.0, angle: float = 0.0,
    rate: float = 0.0, duration: float = 1.0, sample: float = 0.05, motor: hp.Motor | None = None,
    limited: bool = False, stops: hp.JointStops = FREE, loads: tuple[hp.Push, ...] = (),
    settings: dict[str, float] | None = None,
) -> hp.Trace:  # fmt: skip
    robot = heavy_leg(1.0)
    others = {"a_joint": 0.0, "b_joint": 0.0}
    servo = hp.Servo(
        kp={**others, JOINT: kp}, kd={**others, JOINT: kd}, limited=limited,
        motor={JOINT: motor} if motor else None,
    )  # fmt: skip
    scene = hp.Scene(robot, servo=servo, gravity=WEIGHTLESS, stops=stops, loads=loads)
    state = robot.stand({JOINT: angle})
    q, v = state.q.copy(), state.v.copy()
    q[2] += 10.0
    v[-1] = rate
    return hp.simulate(
        scene, hp.HoldPosture((0.0, 0.0, target)), duration=duration, sample=sample, method=method,
        initial=robot.check_state(q, v), **(settings or SETTINGS[method]),
    )  # fmt: skip


def friction(level: float) -> hp.Motor:
    """Return a motor too strong to matter, with dry friction [N m]."""
    return hp.Motor(stall_torque=1e6, no_load_speed=1e6, dry_friction=level)


@pytest.mark.parametrize(
    ("method", "accuracy"), [("extrapolated-euler", 1e-8), ("ndf", 1e-9), ("dop853", 1e-10)]
)
def test_torque_speed_line(method: str, accuracy: float) -> None:
    """At the line w(t) = w0 (1 - exp(-t T0 / (I w0))), to 1e-8 of w0."""
    motor = hp.Motor(stall_torque=0.025, no_load_speed=2.5, voltage_ratio=0.8)
    trace = run(
        method, kp=1e6, target=1.0, angle=-1.0, duration=0.8, motor=motor,
        settings={"accuracy": accuracy},
    )  # fmt: skip
    speed = 2.0 * (1.0 - np.exp(-trace.time * 0.02 / (INERTIA * 2.0)))
    assert np.abs(trace.v[:, -1] - speed).max() < 2e-8


@pytest.mark.parametrize("method", SETTINGS)
def test_dry_friction_holds_without_creep_and_breaks_loose_above_its_level(method: str) -> None:
    """At rest, rate exactly zero, for 100 s; 1 % above it starts with (demand - level) / I."""
    settings = {"step": 0.01} if method in ("robust", "implicit-euler", "rk4") else None
    trace = run(
        method, kp=1.0, kd=0.01, target=0.199, duration=100.0, sample=5.0, motor=friction(0.2),
        settings=settings,
    )  # fmt: skip
    assert not trace.v[:, -1].any()
    np.testing.assert_array_equal(trace.q[:, -1], trace.q[0, -1])
    np.testing.assert_allclose(trace.torque[:, -1], 0.199, rtol=1e-12)
    trace = run(method, kp=1.0, target=0.202, duration=0.01, sample=0.01, motor=friction(0.2))
    assert trace.v[-1, -1] == pytest.approx(0.01 * 0.002 / INERTIA, rel=2e-2)


@pytest.mark.parametrize("method", SETTINGS)
def test_sliding_stops_at_the_analytic_time(method: str) -> None:
    """From w: linear in time, at rest after I w / f, at the angle I w^2 / (2 f)."""
    level, rate = 0.01, 2.0
    trace = run(method, rate=rate, angle=-0.5, duration=0.6, motor=friction(level))
    stop = INERTIA * rate / level  # 0.4 s
    moving = np.minimum(trace.time, stop)
    angle = -0.5 + rate * moving - level / INERTIA * moving**2 / 2.0
    exact = method in ("extrapolated-euler", "ndf", "dop853")
    tolerance = 1e-6 if exact else 2.0 * 1e-3  # one step times the rate
    np.testing.assert_allclose(trace.q[:, -1], angle, atol=tolerance)
    assert not trace.v[trace.time > stop + 2e-3, -1].any()


def test_energy_account_closes() -> None:
    weak = {"stall_torque": 0.05, "no_load_speed": 4.0, "dry_friction": 0.005}
    motor = hp.Motor(**weak, viscous_friction=1e-4, rotor_inertia=1e-7, gear_ratio=50.0)
    stops = hp.JointStops(stiffness=5.0, dissipation=0.3)
    for method, bound in (("extrapolated-euler", 1e-4), ("ndf", 1e-4), ("dop853", 1e-6)):
        trace = run(
            method, kp=1.0, kd=0.02, target=1.0, angle=-0.9, rate=9.0, motor=motor, limited=True,
            stops=stops,
        )  # fmt: skip
        lost = trace.energy["joint_damping_loss"][-1]
        assert lost > 0.01
        assert np.abs(trace.energy_residual).max() < bound * lost


@pytest.mark.parametrize(
    ("method", "accuracy"), [("extrapolated-euler", 1e-6), ("ndf", 1e-8), ("dop853", 1e-9)]
)
def test_limit_touched_for_a_moment(method: str, accuracy: float) -> None:
    """An oscillator that meets its torque limit for 5 % of its period, within single steps."""
    kp, cap, amplitude = 1.0, 0.30, 0.301
    w, c = np.sqrt(kp / INERTIA), cap / kp
    rise = np.sqrt(2.0 * (amplitude - c) * INERTIA / cap)
    at_limit = cap / INERTIA * rise
    half = 2.0 * (rise + np.arctan2(w * c, at_limit) / w)
    rate = float(np.hypot(at_limit, w * c))
    motor = hp.Motor(stall_torque=1e6, no_load_speed=1e6, peak_torque=cap)
    trace = run(
        method, kp=kp, rate=rate, duration=2 * half, sample=2 * half, motor=motor,
        settings={"accuracy": accuracy},
    )  # fmt: skip
    assert abs(trace.q[-1, -1]) < 5.0 * accuracy  # nothing damps the errors of a period
    assert trace.v[-1, -1] == pytest.approx(rate, abs=10.0 * accuracy * w)
