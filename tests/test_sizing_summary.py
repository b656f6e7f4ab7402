"""Limits and accelerations in summaries: closed forms, samples of a run, older files."""

from __future__ import annotations

import numpy as np
import pytest

import hexapod_pin as hp
from hexapod_pin import native

SHARE = 0.999  # of a limit from which a joint counts as being at it


def fed(time: np.ndarray, rate: np.ndarray, torque: np.ndarray, limit: np.ndarray) -> dict:
    """Return what is gathered of n joints without feet; limits may change with time (T, n)."""
    n, none = rate.shape[1], np.zeros(0)
    summary = native.RunSummary(n, 0)
    summary.set_window(1.0, 1e9, 1.0)
    for t, w, tau, most in zip(time, rate, torque, limit, strict=True):
        q = np.concatenate([[0, 0, 0, 0, 0, 0, 1.0], np.zeros(n)])
        summary.set_limit(SHARE * most)
        v = np.concatenate([np.zeros(6), w])
        summary.record(t, q, v, tau, np.zeros((0, 3)), none, none, np.zeros(3))
    return summary.data()


def test_sinusoids_have_their_closed_forms() -> None:
    """V = a sin, tau = b cos + c sin; differences over a step h lose (w h)^2 / 24, 6e-6."""
    time = np.cumsum(np.random.default_rng(1).uniform(0.6e-3, 1.4e-3, 4400))
    a, b, c, w = np.array([0.8, 2.0]), np.array([0.5, -3.0]), np.array([0.7, 0.2]), 2.0 * np.pi
    phase = w * time[:, None]
    rate, torque = a * np.sin(phase), b * np.cos(phase) + c * np.sin(phase)
    data = fed(time, rate, torque, np.full(rate.shape, np.inf))
    assert data["cycles"] == 3
    assert data["acceleration_rms"] == pytest.approx(a * w / np.sqrt(2.0), rel=2e-4)
    assert data["torque_acceleration"] == pytest.approx(a * b * w / 2.0, rel=1e-3)
    assert np.array_equal(data["limit_use"], np.zeros(2))  # no limit


def test_the_use_of_a_limit_is_taken_in_the_same_state() -> None:
    """The limit falls with speed: the largest torque and the least limit are not together."""
    time = np.linspace(0.0, 3.2, 6401)
    phase = 2.0 * np.pi * time[:, None]
    torque, limit = -2.0 * np.cos(phase), 5.0 - 4.0 * np.abs(np.sin(phase))
    data = fed(time, np.sin(phase), torque, limit)
    inside = time >= 1.0
    assert data["limit_use"] == pytest.approx(np.max(np.abs(torque / limit)[inside]), rel=1e-9)
    # |cos| / (5 - 4 |sin|) is largest at |sin| = 4/5: 2 (3/5) / (9/5)
    assert data["limit_use"] == pytest.approx(2.0 / 3.0, rel=1e-5)


def test_they_agree_with_samples_at_every_accepted_step() -> None:
    """As for `at_limit`, a braking motor is compared with its stall torque."""
    robot = hp.load_robot("kharagpur")
    motor = hp.Motor(stall_torque=3.0, no_load_speed=8.0, voltage_ratio=0.9)
    servo = hp.Servo(**hp.Servo.for_robot(robot).model_dump() | {"motor": motor})
    walk = hp.KinematicControl(hp.Gait.tripod(stroke=0.05, cycle_time=0.6))
    settings = dict(method="implicit-euler", step=1e-3, sample=1e-3)
    trace = hp.simulate(hp.Scene(robot, servo=servo), walk, duration=2.6, **settings)
    summary = trace.summary
    inside = (trace.time > summary.start - 1e-9) & (trace.time < summary.end + 1e-9)
    time, tau, w = trace.time[inside], trace.torque[inside], trace.v[inside, 6:]
    forward = np.minimum(0.9 * 3.0 - 3.0 * w / 8.0, 0.9 * 3.0)  # limit of tau > 0, at most at rest
    backward = np.minimum(0.9 * 3.0 + 3.0 * w / 8.0, 0.9 * 3.0)
    use = (np.abs(tau) / np.where(tau > 0.0, forward, backward)).max(axis=0)
    effort = np.abs(tau).max(axis=0) / hp.load_robot("kharagpur").effort_limit
    assert summary.limit_use == pytest.approx(np.maximum(use, effort), rel=1e-9)
    step = np.diff(time)[:, None]
    slope = np.diff(w, axis=0) / step
    length = time[-1] - time[0]
    mean = np.sqrt((slope**2 * step).sum(axis=0) / length)
    assert summary.acceleration_rms == pytest.approx(mean, rel=1e-9)
    product = ((tau[1:] + tau[:-1]) / 2.0 * slope * step).sum(axis=0) / length
    assert summary.torque_acceleration == pytest.approx(product, rel=1e-7, abs=1e-9)
