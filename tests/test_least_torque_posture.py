"""The posture of least holding torque: found, within its limits, and worth what it promises."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from conftest import Run
from leg_robots import legged
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.control import default_gait, feasible_gait, least_torque_posture, leg_clearance
from hexapod_pin.control.posture import (
    HEIGHT_CHANGE,
    JOINT_ROOM,
    LEAST_MARGIN,
    LeastTorquePosture,
    posture_cost,
)
from hexapod_pin.errors import GaitError, ParameterError

CYCLE = {"athena": 1.6, "kharagpur": 1.2}  # s


def tripod(robot: str) -> hp.Gait:
    return hp.Gait.tripod(stroke=0.06, cycle_time=CYCLE[robot], lift=0.04)


@pytest.fixture(scope="module")
def found() -> dict[str, LeastTorquePosture]:
    return {name: least_torque_posture(hp.load_robot(name), tripod(name)) for name in CYCLE}


# Radius and height [mm], RMS torque [N m], largest ratio of forces and margin [mm], as they were
# computed for the derivation of the criterion, by other code and at a stroke that is not recorded:
# to the digits that it gives, with 2 % for the torque and 0.02 for the ratio.
TABLE = {
    "athena": ((138, 176, 0.88, 0.09), (207, 176, 1.02, 0.43)),
    "kharagpur": ((152, 116, 0.32, 0.13), (203, 109, 0.35, 0.55)),
}


@pytest.mark.parametrize("name", TABLE)
def test_packaged_robots_stand_further_in(found, name: str) -> None:
    angles = {"athena": (-20.0, 120.0), "kharagpur": (10.0, 110.0)}[name]
    for leg in hp.load_robot(name).legs:
        own = [math.degrees(found[name].posture[joint]) for joint in leg.joints]
        assert own == pytest.approx([0.0, *angles], abs=1e-6)
    for cost, expected in zip((found[name].found, found[name].standing), TABLE[name], strict=True):
        radius, height, torque, ratio = expected
        assert 1e3 * cost.foot_radius == pytest.approx(radius, abs=0.5)
        assert 1e3 * cost.height == pytest.approx(height, abs=0.5)
        assert cost.torque_rms == pytest.approx(torque, rel=0.02)
        assert cost.force_ratio == pytest.approx(ratio, abs=0.04)


@pytest.mark.slow
def test_walks_there_need_the_torque_that_was_computed(found) -> None:
    """Servos of one stiffness share the loads as the least torque does: within 3 %.

    Simulated; the target has a load transfer of its own, and walks have accelerations.
    """
    search, gait = found["kharagpur"], tripod("kharagpur")
    for posture, cost in ((None, search.standing), (search.posture, search.found)):
        robot = hp.load_robot("kharagpur", posture=posture)
        again = posture_cost(robot, gait)
        assert again.torque_rms == pytest.approx(cost.torque_rms, rel=1e-9)
        assert again.static_margin == pytest.approx(cost.static_margin, rel=1e-9)
        walk = hp.KinematicControl(gait)
        summary = hp.simulate(hp.Scene(robot), walk, duration=4.2 * CYCLE["kharagpur"]).summary
        rms = float(np.sqrt(np.mean(summary.torque_rms**2)))
        assert rms == pytest.approx(cost.torque_rms, rel=0.03)


def test_other_numbers_of_legs(tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    path.write_text(legged(4))
    robot = hp.load_robot(path)
    gait, _ = feasible_gait(robot, default_gait(robot), None)
    search = least_torque_posture(robot, gait, spacing=0.2)
    new, old = search.found, search.standing
    assert search.changed and new.torque_rms < 0.8 * old.torque_rms
    assert new.static_margin >= LEAST_MARGIN * old.static_margin > 0.0
    assert abs(new.height / old.height - 1.0) <= HEIGHT_CHANGE
    there = hp.load_robot(path, posture=search.posture)
    assert leg_clearance(there, gait).distance > 0.0
    plan = hp.KinematicControl(gait).plan(there, 8.0 * gait.cycle_time).q
    # the search looks at 120 instants of a cycle, the plan is denser: 0.01 degrees
    assert np.minimum(plan - there.lower, there.upper - plan).min() >= JOINT_ROOM - 2e-4


def test_what_cannot_be_searched_is_refused(tmp_path: Path) -> None:
    robot = hp.load_robot("kharagpur")
    with refused(ParameterError, "spacing", 0.0, allowed=(0.005, 0.5)):
        least_torque_posture(robot, hp.Gait.tripod(), spacing=0.0)
    path = tmp_path / "two.urdf"
    path.write_text(legged(6, joints=2))
    two = hp.load_robot(path)
    with refused(GaitError, quantity="posture"):
        least_torque_posture(two, hp.Gait.tripod(stroke=0.02))


def test_walk_searches_it_and_prints_its_numbers(run: Run) -> None:
    words = "walk athena --gait tripod --stroke 0.06 --cycle-time 1.6 --lift 0.04 --duration 0.2"
    words += " --no-html --quick --full --save-case c.toml --posture least-torque"
    done = run(*words.split())
    assert done.status == 0, done.err
    said = " ".join(done.out.split())
    assert "lf_coxa_joint 0, lf_femur_joint -20, lf_tibia_joint 120 degrees" in said
    assert "feet 138 mm (207 mm)" in said
    assert "holding torque 0.876 N m (1.01 N m) RMS" in said
    robot = hp.load_case("c.toml").scene.robot
    angle = robot.posture[robot.joint_index("lf_tibia_joint")]
    assert math.degrees(angle) == pytest.approx(120.0, abs=1e-6)
    assert run(*words[:-1].split()).status == 2  # least-torqu
