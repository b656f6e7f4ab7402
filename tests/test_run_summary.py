"""The native summary of a run, fed by hand: against NumPy on the same states, and closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

from hexapod_pin import native

Array = npt.NDArray[np.float64]
JOINTS, FEET, CYCLE = 3, 2, 1.25
RNG = np.random.default_rng(20)


def uneven_times(end: float) -> Array:
    """Times of accepted steps: 0.2 to 2.2 ms apart, none of them at the edge of a cycle."""
    steps = RNG.uniform(2e-4, 2.2e-3, int(end / 1.2e-3) + 100)
    time = np.concatenate([[0.0], np.cumsum(steps)])
    return time[time <= end]


class Motion:
    """Smooth states at given times: a trunk that walks, turns, rolls and heaves."""

    def __init__(self, time: Array) -> None:
        """Evaluate everything."""
        t, self.time = time[:, None], time
        omega = 2.0 * np.pi / CYCLE * np.array([1.0, 2.0, 3.0])
        self.torque = np.array([0.3, -4.0, 20.0]) * np.sin(omega * t) + np.array([0.1, 1.0, -6.0])
        self.rate = np.array([1.0, 2.0, 0.5]) * np.cos(omega * t + 0.4)
        self.angle = np.array([0.2, 0.3, 0.1]) * np.sin(omega * t)
        self.yaw, self.roll = 0.3 * time, 0.05 * np.sin(omega[0] * time)
        self.pitch = 0.02 + 0.03 * np.cos(omega[1] * time)
        self.height = 0.1 + 0.01 * np.sin(omega[1] * time)
        self.rise = 0.01 * omega[1] * np.cos(omega[1] * time)
        self.path = np.stack([0.2 * time, 0.05 * time**2], axis=1)
        wave = np.sin(omega[:2] * t)
        self.normal = np.where(wave > 0.0, 30.0 * wave, 0.0)
        self.slip = np.where(wave > 0.0, 0.01 * wave**2, 0.0)
        self.omega = omega
        self.spin = np.stack([0.3 * np.sin(omega[0] * time), 0.5 * np.cos(omega[1] * time)], axis=1)
        self.rubbing = 0.5 * self.normal * self.slip

    def feed(self, summary: Any) -> dict[str, Any]:
        for k, t in enumerate(self.time):
            force = np.zeros((FEET, 3))
            force[:, 2], force[:, 0] = self.normal[k], -0.5 * self.normal[k]
            summary.record(
                t, self.q(k), self.v(k), self.torque[k], force, self.normal[k], self.slip[k],
                np.array([*self.path[k], self.height[k]]), self.rubbing[k],
            )  # fmt: skip
        data: dict[str, Any] = summary.data()
        return data

    def q(self, k: int) -> Array:
        """Return Pinocchio's configuration: yaw, then pitch, then roll."""
        turn = pin.rpy.rpyToMatrix(self.roll[k], self.pitch[k], self.yaw[k])
        base = [self.path[k, 0], self.path[k, 1], self.height[k]]
        return np.array([*base, *pin.Quaternion(turn).coeffs(), *self.angle[k]])

    def v(self, k: int) -> Array:
        """Return the velocity; the trunk moves straight up with `rise`, and spins (own axes)."""
        turn = pin.rpy.rpyToMatrix(self.roll[k], self.pitch[k], self.yaw[k])
        return np.array([*(turn.T @ [0.0, 0.0, self.rise[k]]), *self.spin[k], 7.0, *self.rate[k]])


@pytest.fixture(scope="module")
def gathered() -> tuple[Motion, dict[str, Any], npt.NDArray[np.bool_]]:
    """Three whole cycles from 0.5 s of a run that ends in the fourth."""
    motion = Motion(uneven_times(0.5 + 3.6 * CYCLE))
    summary = native.RunSummary(JOINTS, FEET)
    summary.set_window(0.5, 1e9, CYCLE)
    summary.set_limit(np.array([np.inf, 4.5, np.inf]))
    inside = (motion.time >= 0.5) & (motion.time <= 0.5 + 3 * CYCLE)
    return motion, motion.feed(summary), inside


def test_peaks_are_those_of_the_states_in_whole_cycles(gathered: Any) -> None:
    motion, data, inside = gathered
    assert data["cycles"] == 3 and data["states"] == len(motion.time)
    columns = {
        "torque_peak": motion.torque,
        "speed_peak": motion.rate,
        "power_peak": motion.torque * motion.rate,
        "force_peak": motion.normal,
    }
    for name, values in columns.items():
        at = np.abs(values[inside]).argmax(axis=0)
        picked = np.arange(values.shape[1])
        assert np.array_equal(data[name], values[inside][at, picked]), name  # with their signs
        assert np.array_equal(data[f"{name}_time"], motion.time[inside][at]), name
    power = (motion.torque * motion.rate)[inside]
    assert np.array_equal(data["driving_power_peak"], np.maximum(power, 0.0).max(axis=0))
    assert np.array_equal(data["braking_power_peak"], np.maximum(-power, 0.0).max(axis=0))
    assert data["roll_peak"] == pytest.approx(0.05, rel=1e-4)
    out = np.abs(motion.torque[~inside]).max(axis=0)
    assert np.abs(data["outside_torque"]) == pytest.approx(out, rel=0.0)


def test_integrals_follow_closed_forms(gathered: Any) -> None:
    """Steps of 1.2 ms: the trapezoidal rule on a period is exact but for the uneven steps, 1e-5."""
    motion, data, _ = gathered
    amplitude, mean = np.array([0.3, -4.0, 20.0]), np.array([0.1, 1.0, -6.0])
    assert data["window_time"] == pytest.approx(3 * CYCLE, rel=1e-12)
    assert data["torque_rms"] == pytest.approx(np.sqrt(amplitude**2 / 2 + mean**2), rel=1e-4)
    assert data["speed_rms"] == pytest.approx(np.array([1.0, 2.0, 0.5]) / np.sqrt(2), rel=1e-4)
    work = -CYCLE * amplitude * np.array([1.0, 2.0, 0.5]) * np.sin(0.4) / 2
    assert data["positive_energy"] + data["negative_energy"] == pytest.approx(work, abs=1e-3 / 3)
    assert (data["positive_energy"] > 0).all() and (data["negative_energy"] < 0).all()
    impulse = 30.0 * CYCLE / np.pi
    assert data["normal_impulse"] == pytest.approx(np.full(2, impulse), rel=1e-4)
    assert data["impulse"][:, 2] == pytest.approx(np.full(2, impulse), rel=1e-4)
    assert data["impulse"][:, 0] == pytest.approx(np.full(2, -0.5 * impulse), rel=1e-4)
    assert data["slip_distance"] == pytest.approx(np.full(2, CYCLE * 0.01 / 4), rel=1e-3)
    work = 0.5 * 30.0 * 0.01 * CYCLE * 2 / (3 * np.pi)  # mean of sin^3 over half a wave
    assert data["friction_work"] == pytest.approx(np.full(2, work), rel=1e-3)
    assert data["loaded_time"] == pytest.approx(np.full(2, 0.5 * CYCLE), rel=2e-3)
    assert data["at_limit"][1] == pytest.approx(np.arccos(3.5 / 4.0) / np.pi, abs=2e-3)


def test_the_trunk(gathered: Any) -> None:
    motion, data, _ = gathered
    assert data["height_min"] == pytest.approx(0.09, abs=1e-6)
    assert data["height_max"] == pytest.approx(0.11, abs=1e-6)
    assert data["height_mean"] == pytest.approx(0.1, abs=1e-6)
    assert data["roll_rms"] == pytest.approx(0.05 / np.sqrt(2), rel=1e-4)
    assert data["pitch_mean"] == pytest.approx(0.02, rel=1e-4)
    assert data["pitch_rms"] == pytest.approx(np.hypot(0.02, 0.03 / np.sqrt(2)), rel=1e-4)
    acceleration = 0.01 * motion.omega[1] ** 2 / np.sqrt(2)
    assert data["vertical_acceleration_rms"] == pytest.approx(acceleration, rel=1e-4)
    edges = 0.5 + 0.5 * CYCLE * np.arange(7)
    assert data["height_rms"] == pytest.approx(0.01 / np.sqrt(2), rel=1e-4)
    # the line through n = 6 whole waves sin(.. + p) takes 6 cos^2(p) / (pi n)^2 of their variance
    share = 6.0 * np.cos(0.5 * motion.omega[1]) ** 2 / (6.0 * np.pi) ** 2
    assert data["heave_rms"] == pytest.approx(0.01 * np.sqrt(0.5 * (1.0 - share)), rel=1e-4)
    assert data["roll_rate_rms"] == pytest.approx(0.3 / np.sqrt(2), rel=1e-4)
    assert data["pitch_rate_rms"] == pytest.approx(0.5 / np.sqrt(2), rel=1e-4)
    assert data["path"][:, 0] == pytest.approx(edges, abs=1e-12)
    assert data["path"][:, 1] == pytest.approx(0.2 * edges, abs=1e-9)
    assert data["path"][:, 2] == pytest.approx(0.05 * edges**2, abs=1e-6)
    assert data["path"][:, 3] == pytest.approx(0.3 * edges, abs=1e-6)


def test_the_99th_percentile_is_within_half_a_percent(gathered: Any) -> None:
    """Of the time; bins are 1.6 % wide at most, and filled evenly enough to interpolate in them."""
    motion, data, inside = gathered
    weight = np.gradient(motion.time[inside])
    for values, found in zip(np.abs(motion.torque[inside]).T, data["torque_p99"], strict=True):
        order = np.argsort(values)
        share = np.cumsum(weight[order]) / weight.sum()
        assert found == pytest.approx(values[order][np.searchsorted(share, 0.99)], rel=5e-3)


class OneJoint:
    """The summary of a robot with one joint and no feet."""

    def __init__(self, start: float, end: float, cycle: float) -> None:
        """Set the window."""
        self.summary = native.RunSummary(1, 0)
        self.summary.set_window(start, end, cycle)

    def fed(self, time: Array, torque: Array) -> dict[str, Any]:
        q, v, none = np.array([0, 0, 0, 0, 0, 0, 1, 0.0]), np.zeros(7), np.zeros(0)
        for t, value in zip(time, torque, strict=True):
            force = np.zeros((0, 3))
            self.summary.record(t, q, v, np.array([value]), force, none, none, np.zeros(3))
        return dict(self.summary.data())


def test_cycles_begin_and_end_with_states_but_for_rounding() -> None:
    """2.4 + 2 x 2.4 is 7.199999999999999 and 3600 x 0.002 is 7.2; 1000 x 0.0072 falls short."""
    for step, count in ((0.002, 3600), (0.0072, 1000)):
        data = OneJoint(2.4, 7.2, 2.4).fed(step * np.arange(count + 1), np.ones(count + 1))
        assert data["cycles"] == 2 and data["window_time"] == pytest.approx(4.8, abs=1e-8)
    late = OneJoint(1.0, 10.0, 1.0).fed(np.linspace(2.5, 6.2, 371), np.ones(371))  # goes on
    assert late["cycles"] == 3 and late["path"][0, 0] == 3.0 and late["path"][-1, 0] == 6.0
    short = OneJoint(1.0, 10.0, 1.0).fed(np.linspace(0.0, 1.5, 151), -np.ones(151))
    assert short["cycles"] == 0 and "torque_peak" not in short and len(short["path"]) == 0
    assert short["outside_torque"][0] == -1.0
