"""Torques of very slow walks against statics: the envelope of docs/references.md's S2 robot.

The reference is the least-squares share of the weight among vertical forces on stiff legs, which is
what equal linear springs under the feet do: contact is linear here. Figures computed elsewhere,
hips as in the URDF, arcs of 0.14 m, to their printed digits: peak and stance RMS of the femur's
torque, peak of the total moment at the coxa [N m].
"""

from __future__ import annotations

import numpy as np
import pytest

import hexapod_pin as hp
from hexapod_pin.arrays import Array

CYCLE = 24.0  # s, ten times S2's
FEMUR, SHANK_WEIGHT_TORQUE = 0.11934, 0.153  # m; N m by which the leg's own weight relieves joint 2
ENVELOPE = {
    "tripod": (hp.Gait.tripod, 1.66, 1.17, 2.73),
    "tetrapod": (hp.Gait.tetrapod, 1.31, 0.80, 2.16),
    "wave 2/3": (lambda **k: hp.Gait.wave(2 / 3, **k), 1.19, 0.79, 1.95),
    "wave 5/6": (lambda **k: hp.Gait.wave(5 / 6, **k), 0.93, 0.61, 1.50),
}
CONTACT = hp.Contact(
    normal=hp.contact.HuntCrossley(stiffness=1e6, exponent=1.0, dissipation=100.0),
    friction=hp.Contact.preset("s2").friction,
)


@pytest.fixture(scope="module", params=ENVELOPE)
def slow(request: pytest.FixtureRequest) -> tuple[str, hp.Trace, slice]:
    """Return the steady cycle of a gait at a tenth of S2's speed, joints prescribed."""
    gait = ENVELOPE[request.param][0](cycle_time=CYCLE)
    scene = hp.Scene(hp.load_robot("kharagpur"), contact=CONTACT, prescribed=True)
    trace = hp.simulate(
        scene,
        hp.motion.ArcWalk(gait),
        duration=3 * CYCLE,
        method="ndf",
        accuracy=1e-8,
        sample=CYCLE / 1200,
    )
    return request.param, trace, hp.torque_budget(trace).window.samples


def test_slow_walks_meet_the_static_envelope(slow: tuple[str, hp.Trace, slice]) -> None:
    name, trace, cycle = slow
    _, peak, rms, moment = ENVELOPE[name]
    femur, down = trace.torque[cycle, 1::3], trace.normal_force[cycle] > 0.0
    assert hp.torque_budget(trace).kind("femur").peak.torque_peak == pytest.approx(peak, rel=0.02)
    assert np.sqrt(np.mean(femur[down] ** 2)) == pytest.approx(rms, rel=0.02)
    assert hp.results.joint_moments(trace).moment[:, 0::3].max() == pytest.approx(moment, rel=0.02)
    assert np.median(np.abs(femur[~down])) == pytest.approx(SHANK_WEIGHT_TORQUE, rel=0.02)


def test_feet_share_the_weight_as_springs_do(slow: tuple[str, hp.Trace, slice]) -> None:
    """The share of least squares at each sample, away from touch-downs and lift-offs."""
    _, trace, cycle = slow
    force, down = trace.normal_force[cycle], trace.normal_force[cycle] > 0.0
    weight = 3.08746 * 9.81
    steady = np.array([(down[max(0, k - 15) : k + 16] == down[k]).all() for k in range(len(down))])
    share = np.array([
        least_squares_share(foot[feet], com, weight, feet)
        for foot, com, feet in zip(
            trace.foot_position[cycle], trace.com[cycle], down, strict=True
        )
    ])  # fmt: skip
    assert np.abs(force - share)[steady].max() < 0.02 * force.max()
    assert steady.mean() > 0.5


def least_squares_share(feet: Array, com: Array, weight: float, down: Array) -> Array:
    """Return vertical forces (6,) [N] of least squares that carry a weight at `com`."""
    rows = np.vstack([np.ones(len(feet)), feet[:, 0] - com[0], feet[:, 1] - com[1]])
    force = np.zeros(len(down))
    force[down] = np.linalg.lstsq(rows, np.array([weight, 0.0, 0.0]), rcond=None)[0]
    return force
