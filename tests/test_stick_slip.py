"""A robot on bristles: it holds under a side load or slides, and its energy account closes."""

from __future__ import annotations

import numpy as np
import pytest

import hexapod_pin as hp

ROBOT = hp.load_robot("kharagpur")
STICK = hp.contact.StickSlip(mu=0.7, stiffness=2e4, damping=60.0)
CONTACT = hp.Contact(normal=hp.Contact.s1().normal, friction=STICK)


def push(ratio: float, duration: float) -> hp.Trace:
    """Kharagpur on ground tilted sideways; `ratio` is the side load over the normal load."""
    cosine = 9.81 / np.hypot(1.0, ratio)
    servo = hp.Servo(kp=1000.0, kd=20.0, limited=False)
    scene = hp.Scene(ROBOT, contact=CONTACT, servo=servo, gravity=(0.0, ratio * cosine, -cosine))
    return hp.simulate(scene, hp.HoldPosture(), duration=duration, sample=0.01)


def side_speed(trace: hp.Trace, seconds: float) -> float:
    samples = round(seconds / 0.01)
    return float(trace.q[-1, 1] - trace.q[-1 - samples, 1]) / seconds


def test_bristles_hold_just_below_and_slide_just_above_the_friction_angle() -> None:
    held = push(0.98 * 0.7, 6.0)
    assert abs(side_speed(held, 2.0)) < 1e-12  # round-off
    slid = push(1.02 * 0.7, 3.0)
    # Coulomb: a = g (sin - mu cos), gained over the last second on top of what it had
    angle = np.arctan(1.02 * 0.7)
    expected = 9.81 * (np.sin(angle) - 0.7 * np.cos(angle))
    late, early = side_speed(slid, 0.1), slid.q[-101, 1] - slid.q[-111, 1]
    assert late - early / 0.1 == pytest.approx(expected, rel=1e-3)


def test_explicit_walk_on_bristles_keeps_its_energy_account() -> None:
    """RK4 at 1e-5 s: the residual stays below 1e-6 of the work of the servos."""
    scene, control = hp.Scene(ROBOT, contact=CONTACT), hp.KinematicControl(hp.Gait.tetrapod())
    trace = hp.simulate(scene, control, duration=0.5, method="rk4", step=1e-5, sample=0.01)
    rate = trace.torque * trace.v[:, 6:]
    throughput = np.trapezoid(np.abs(rate).sum(axis=1), trace.time)
    assert np.abs(trace.energy_residual).max() < 1e-6 * throughput
    for loss in ("normal_loss", "friction_loss"):
        assert np.diff(trace.energy[loss]).min() > -1e-9
