"""The searched standing posture: level, inside its limits, the same in every convention."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from refusals import refused

from hexapod_pin.arrays import Array
from hexapod_pin.errors import ReachError
from hexapod_pin.robot.recognition.posture_frame import LegFrame, with_joint_at
from hexapod_pin.robot.recognition.posture_search import standing_posture
from hexapod_pin.robot.serial_chain import SerialChain

HIPS = {"lf": (0.18, 0.12), "lm": (0.0, 0.12), "lr": (-0.18, 0.12)}
LIMITS = ((-0.8, 0.8), (-1.4, 1.2), (0.2, 2.6))


def leg(name, hip, facing, limits=LIMITS, links=(0.06, 0.12, 0.2)):
    """Return a yaw-pitch-pitch leg, stretched at q = 0; q2, q3 > 0 lower the foot."""
    out = np.array([np.cos(facing), np.sin(facing), 0.0])
    pitch = np.cross([0.0, 0.0, 1.0], out)
    along = np.cumsum([0.0, *links])
    origins = np.array([*hip, 0.0]) + along[:-1, None] * out
    axes = np.array([[0.0, 0.0, 1.0], *[pitch] * (len(links) - 1)])
    lower, upper = np.array(limits, dtype=float).T
    tip = np.array([*hip, 0.0]) + along[-1] * out
    return LegFrame(name, axes, origins, tip, 0.02, lower, upper, tuple(range(len(links))))


def six(limits=LIMITS, links=(0.06, 0.12, 0.2)):
    left = [leg(name, hip, np.pi / 2, limits, links) for name, hip in HIPS.items()]
    right = [
        leg(name.replace("l", "r", 1), (x, -y), -np.pi / 2, limits, links)
        for name, (x, y) in HIPS.items()
    ]
    return left + right


def tips(legs, posture) -> Array:
    chains = [SerialChain.of(leg.axes, leg.origins, leg.tip) for leg in legs]
    return np.array([one.forward(q) for one, q in zip(chains, posture.angles, strict=True)])


def rewritten(leg: LegFrame, sign: Array, zero: Array, slide: Array) -> LegFrame:
    """Return the same leg with q' = sign (q - zero), origins moved along their axes."""
    moved, axes, origins = leg, leg.axes.copy(), leg.origins.copy()
    for k in range(len(axes)):
        axes[k], origins[k] = moved.axes[0], moved.origins[0]
        moved = with_joint_at(moved, 0, zero[k])
    ends = np.sort([sign * (leg.lower - zero), sign * (leg.upper - zero)], axis=0)
    return replace(leg, axes=sign[:, None] * axes, origins=origins + slide[:, None] * axes,
                   tip=moved.tip, lower=ends[0], upper=ends[1])  # fmt: skip


def check(legs, posture, trunk_low=None):
    feet = tips(legs, posture)
    soles = feet[:, 2] - [leg.radius for leg in legs]
    assert np.ptp(soles) < 1e-12  # m: rounding of a leg's length
    assert soles[0] == pytest.approx(-posture.height, abs=1e-12)
    for one, q in zip(legs, posture.angles, strict=True):
        assert (q >= one.lower - 1e-9).all() and (q <= one.upper + 1e-9).all()
    if trunk_low is not None:
        assert soles.max() < trunk_low
    return feet


def test_six_equal_legs_stand_alike_with_upright_tibiae():
    """The tibia is upright to 10 degrees, the knee up, the coxa in the middle, left as right."""
    legs = six()
    posture = standing_posture(legs, trunk_low=-0.05)
    feet = check(legs, posture, -0.05)
    q = np.array(posture.angles)
    assert np.abs(q - q[0]).max() < 1e-12
    assert q[0, 0] == 0.0
    assert abs(q[0, 1] + q[0, 2] - np.pi / 2) < np.radians(10.0)
    assert q[0, 2] > 0.5  # knee up and far from stretched
    assert feet[:3] * [1, -1, 1] == pytest.approx(feet[3:], abs=1e-12)
    assert f"{posture.height:.3g} m below the hips" in posture.reason


@pytest.mark.parametrize("seed", range(2))
def test_the_posture_does_not_depend_on_conventions(seed):
    rng = np.random.default_rng(seed)
    legs = six()
    sign = rng.choice([-1.0, 1.0], (6, 3))
    zero = rng.uniform([one.lower for one in legs], [one.upper for one in legs])
    slide = rng.uniform(-0.1, 0.1, (6, 3))
    others = [rewritten(*row) for row in zip(legs, sign, zero, slide, strict=True)]
    first, second = (standing_posture(both, trunk_low=-0.05) for both in (legs, others))
    mapped = np.array(sign) * (np.array(first.angles) - zero)
    assert np.array(second.angles) == pytest.approx(mapped, abs=1e-11)
    assert second.height == pytest.approx(first.height, abs=1e-13)
    assert second.reason == first.reason


@pytest.mark.parametrize(
    "limits",
    [
        ((-np.inf, np.inf),) * 3,
        ((-0.7, 0.7), (-2.1, 2.1), (-1.75, -0.2)),  # only knee down
        ((-0.5, 0.5), (-0.4, -0.4), (0.0, 2.5)),  # a femur that cannot move
        ((2.6, 3.4), (1.9, 4.0), (-2.6, -0.2)),  # folded over: coxa and femur turned about
    ],
)
def test_odd_limits_have_a_posture(limits):
    legs = six(limits)
    check(legs, standing_posture(legs))


def test_radial_robots_point_outwards():
    """Hips on a circle with free coxae: every foot lies on its hip's radius."""
    azimuth = np.radians([30, 90, 150, 210, 270, 330])
    limits = ((-np.inf, np.inf), *LIMITS[1:])
    hips = [0.15 * np.array([np.cos(a), np.sin(a)]) for a in azimuth]
    legs = [leg(f"leg{k}", hips[k], azimuth[k] + 0.9, limits) for k in range(6)]
    feet = check(legs, standing_posture(legs))
    assert np.arctan2(feet[:, 1], feet[:, 0]) % (2 * np.pi) == pytest.approx(azimuth, abs=1e-12)


def test_legs_of_two_joints_and_a_surplus_one_that_is_held_inside_its_limits():
    """Four joints, the last held: a limit that forbids zero is kept, the last link is upright."""
    two = six(LIMITS[:2], (0.06, 0.2))
    check(two, standing_posture(two))
    legs = six((*LIMITS[:2], (-1.0, 2.6), (0.5, 1.5)), (0.05, 0.1, 0.08, 0.12))
    legs = [replace(one, walking=(0, 1, 2)) for one in legs]
    posture = standing_posture(legs)
    check(legs, posture)
    q = np.array(posture.angles)
    assert np.abs(q[:, 1:].sum(axis=1) - np.pi / 2).max() < np.radians(10.0)


def test_hips_at_different_heights_stand_level():
    """A leg mounted 1.4 mm higher, with tilted axes, is settled by its joints."""
    legs = six()
    shift = np.array([0.0, 0.0, 1.4e-3])
    tilt = np.array([[0.0, 0.0, 1.0], [0.0, 1e-3, 0.0], [0.0, 0.0, 2e-3]])
    axes = legs[2].axes + tilt
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    legs[2] = replace(legs[2], origins=legs[2].origins + shift, tip=legs[2].tip + shift, axes=axes)
    check(legs, standing_posture(legs))


def test_no_posture_names_leg_joint_and_remedy():
    legs = six()
    upper = np.array([0.8, -1.35, 0.3])
    lower = np.array([-0.8, -1.4, 0.2])
    legs[4] = replace(legs[4], lower=lower, upper=upper, joints=("coxa", "femur", "tibia"))
    with refused(ReachError, leg="rm", about=("femur", "-1.4", "-1.35", "posture=[...]")):
        standing_posture(legs)

    with refused(ReachError, leg="lf", about=("posture=[...]",)):
        standing_posture(six(((0.0, 0.0),) * 3))  # nothing can move
