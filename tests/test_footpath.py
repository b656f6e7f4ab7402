"""Planned foot paths: continuity, no scrub, start and stop."""

from __future__ import annotations

import numpy as np
import pytest
from refusals import refused

from hexapod_pin.arrays import Array
from hexapod_pin.control.body_path import RAMP_CYCLES
from hexapod_pin.control.foot_path import FootPath
from hexapod_pin.control.gait import Gait
from hexapod_pin.errors import ParameterError

# The standing feet of S2's robot: hips at +-0.2, 0 by +-0.1025 m, feet 0.20284 m further out.
NEUTRAL = np.array([(x, y, -0.09879) for y in (0.30534, -0.30534) for x in (0.2, 0.0, -0.2)])

STRAIGHT = Gait.tetrapod()
GAITS = {
    "tripod": Gait.tripod(),
    "tetrapod": STRAIGHT,
    "wave 5/6": Gait.wave(5 / 6),
    "turning": Gait.ripple(stroke=0.1, turn_rate=0.15, heading=-0.4),
    "on the spot": Gait.wave(3 / 4, stroke=0.0, turn_rate=-0.2),
}
every_gait = pytest.mark.parametrize("gait", GAITS.values(), ids=GAITS.keys())


def to_world(path: FootPath, time: Array, p_BF: Array) -> Array:
    """Put base-frame points (K, 6, 3) into the world with explicit rotation matrices."""
    x, y, yaw = path.body_pose(time).T
    c, s, z = np.cos(yaw), np.sin(yaw), np.zeros_like(x)
    turn = np.moveaxis(np.array([[c, -s, z], [s, c, z], [z, z, z + 1.0]]), -1, 0)
    return p_BF @ turn.transpose(0, 2, 1) + np.stack([x, y, z], axis=-1)[:, None]


def walking(gait: Gait) -> tuple[FootPath, Array]:
    path = FootPath(gait, NEUTRAL, stop_at=7 * gait.cycle_time)
    return path, np.linspace(0.0, 8.0 * gait.cycle_time, 4001)


@every_gait
def test_footholds_do_not_move_in_the_world(gait: Gait) -> None:
    """No scrub, straight or turning, starting and stopping; no speed at landing and lift-off."""
    path, time = walking(gait)
    world = to_world(path, time, path.positions(time))
    down = path.stance(time)
    both = down[1:] & down[:-1]
    slid = np.linalg.norm(np.diff(world, axis=0), axis=-1)
    assert slid[both].max() < 1e-12  # rounding of metres
    np.testing.assert_allclose(world[..., 2][down], -0.09879, atol=1e-15)
    at = path.events(float(time[-1]))
    down = path.stance(at - 1e-9) != path.stance(at + 1e-9)
    h = 1e-4
    world = [to_world(path, at + k * h, path.positions(at + k * h)) for k in (-1, 1)]
    moved = np.linalg.norm(world[1] - world[0], axis=-1)[down]
    assert moved.max() < 1e-7  # cubic in h: 10 (h / 0.4 s)^3 0.2 m; 1e-5 m if it had 0.1 m/s
    assert down.sum() > 20


@every_gait
def test_paths_are_twice_continuously_differentiable(gait: Gait) -> None:
    """Velocity is the derivative; acceleration just before and just after every event agree."""
    path, time = walking(gait)
    h = 1e-6
    slope = (path.positions(time + h) - path.positions(time - h)) / (2 * h)
    # Central differences: rounding 1e-16 / h = 1e-10, truncation h^2 x''' / 6 < 1e-10.
    np.testing.assert_allclose(path.velocities(time), slope, atol=2e-9)
    h = 1e-5
    at = path.events(float(time[-1]))
    before = (path.velocities(at - h) - path.velocities(at - 2 * h)) / h
    after = (path.velocities(at + 2 * h) - path.velocities(at + h)) / h
    # Apart by about 3 h times a third derivative of up to 500 m/s^3.
    np.testing.assert_allclose(after, before, atol=0.02)
    swing = (1 - gait.duty) * gait.cycle_time
    biggest = 6 * (gait.stroke / gait.duty + gait.lift) / swing**2
    if gait.stroke > 0:
        assert biggest > 10 * 0.02  # a jump of the acceleration itself would be seen


@every_gait
def test_standing_then_the_same_every_cycle_then_standing(gait: Gait) -> None:
    path, _ = walking(gait)
    np.testing.assert_allclose(path.positions(np.zeros(1))[0], NEUTRAL, atol=1e-16)
    assert np.abs(path.body_pose(np.zeros(1))).max() == 0.0
    after = 7 * gait.cycle_time + np.array([0.0, 0.1, 1.0, 5.0])
    np.testing.assert_allclose(path.positions(after), np.tile(NEUTRAL, (4, 1, 1)), atol=1e-15)
    for at in (np.zeros(1), after):
        assert np.abs(path.velocities(at)).max() < 1e-16
    assert path.stance(after).all()
    assert np.abs(np.diff(path.body_pose(after), axis=0)).max() == 0.0
    assert path.steady_from == 2 * gait.cycle_time
    time = np.linspace(path.steady_from, path.steady_until - gait.cycle_time, 500)
    once, again = path.positions(time), path.positions(time + gait.cycle_time)
    np.testing.assert_allclose(again, once, atol=1e-14)
    scheduled = gait.feet_down(time / gait.cycle_time)
    assert (path.stance(time) != scheduled).sum() <= 6  # samples on an event, either is right


@pytest.mark.parametrize("name", ["tripod", "wave 5/6"])
def test_straight_stance_is_a_straight_line_of_one_stroke_at_constant_speed(name: str) -> None:
    gait = GAITS[name]
    path = FootPath(gait, NEUTRAL)
    time = np.linspace(2, 3, 2401) * gait.cycle_time
    down = path.stance(time)
    v = path.velocities(time)[down]
    np.testing.assert_allclose(v[:, 0], -gait.stroke / (gait.duty * gait.cycle_time), atol=1e-14)
    np.testing.assert_allclose(v[:, 1:], 0.0, atol=1e-14)
    offset = path.positions(time) - NEUTRAL
    for leg in range(6):
        reach = offset[down[:, leg], leg, 0]
        # The grid may miss either end of the stance by one sample, 1/2400 of a cycle.
        assert np.ptp(reach) == pytest.approx(gait.stroke, rel=2.01 / 2400 / gait.duty)
        assert reach.max() == pytest.approx(-reach.min(), abs=0.002 * gait.stroke)


def test_swing_rises_to_the_lift_and_only_then() -> None:
    """A swing that goes nowhere does not lift."""
    path = FootPath(STRAIGHT, NEUTRAL)
    time = np.linspace(4.8, 7.2, 4801)
    height = path.positions(time)[..., 2] + 0.09879
    np.testing.assert_allclose(height.max(axis=0), 0.02, atol=1e-8)  # flat top, 0.5 ms grid
    assert height.min() >= -1e-16
    assert height[path.stance(time)].max() < 1e-15
    path = FootPath(Gait.tripod(stroke=0.0), NEUTRAL)
    time = np.linspace(0.0, 10.0, 101)
    np.testing.assert_array_equal(path.positions(time), np.tile(NEUTRAL, (101, 1, 1)))
    assert path.stance(time).all()


def test_what_no_path_is_made_of_is_refused() -> None:
    earliest = FootPath.earliest_stop(STRAIGHT)
    assert earliest == pytest.approx((2 * RAMP_CYCLES + 2 / 3) * 2.4)
    path = FootPath(STRAIGHT, NEUTRAL, stop_at=earliest)
    np.testing.assert_allclose(path.positions(np.array([earliest]))[0], NEUTRAL, atol=1e-15)
    for bad in (earliest - 0.01, np.nan):
        with refused(ParameterError, "stop_at", bad, allowed=(float(f"{earliest:g}"),)):
            FootPath(STRAIGHT, NEUTRAL, stop_at=bad)
    with refused(ParameterError, "FootPath.neutral_feet", (4, 3), allowed=(6, 3)):
        FootPath(STRAIGHT, NEUTRAL[:4])
