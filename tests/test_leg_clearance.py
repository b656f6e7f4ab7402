"""Legs against each other and the trunk: distances in closed form, refusals and warnings."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.control import FootPath, leg_clearance
from hexapod_pin.control.leg_group import leg_group
from hexapod_pin.errors import GaitError
from hexapod_pin.robot.description.blueprint import Segment, Trunk
from hexapod_pin.robot.description.paper_robots import KHARAGPUR
from hexapod_pin.robot.leg_bodies import LegBodies, leg_bodies

HIP_X = 0.1
TIBIA_RADIUS = 0.015
LIMITS = (-1.2, 1.2)


def narrow(tmp_path: Path, hip_x: float = HIP_X, coxa_width: float = 0.03) -> hp.Robot:
    """Hips close together, thin femurs, tibias of radius 15 mm that lean outwards, point feet."""
    blueprint = hp.Blueprint.from_dimensions(
        "narrow", trunk=Trunk.solid(2.0, (0.26, 0.1, 0.05)),
        coxa=Segment.box(0.1, (0.05, coxa_width, 0.03), LIMITS, 10.0, 20.0),
        femur=Segment.box(0.1, (0.1, 0.02, 0.02), LIMITS, 10.0, 20.0),
        tibia=Segment.rod(0.1, 0.15, TIBIA_RADIUS, (0.2, 2.6), 10.0, 20.0),
        hip_x=hip_x, hip_y=0.05, foot_radius=0.0, posture=(0.0, -0.3, 1.6),
    )  # fmt: skip
    path = tmp_path / "narrow.urdf"
    path.write_text(blueprint.urdf())
    return hp.load_robot(path)


def tripod(stroke: float) -> hp.Gait:
    return hp.Gait.tripod(stroke=stroke, cycle_time=2.0)


def posture(robot: hp.Robot, **angles: float) -> np.ndarray:
    """A configuration with the base at the origin, as `LegBodies.distances` takes it. (1, nq)."""
    q = robot.posture_from({f"{name}_joint": angle for name, angle in angles.items()})
    return np.concatenate([pin.neutral(robot.model)[:7], q])[None]


def nearest(bodies: LegBodies, q: np.ndarray) -> tuple[set[str], float]:
    distance, pair = bodies.distances(q)
    return set(bodies.pairs[pair[0]]), float(distance[0])


@pytest.mark.parametrize("yaw", [-0.75, -1.1])
def test_two_femurs_in_closed_form(yaw: float) -> None:
    """A front leg turned back: its knee comes near the middle femur, or into it.

    Capsules of radius 22.5 mm; the middle femur lies along y at x = 0, the front knee is
    0.2 - (coxa + femur) sin(yaw) in front of it.
    """
    robot = hp.load_robot("kharagpur")
    reach = KHARAGPUR.coxa.length + KHARAGPUR.femur.length
    wanted = 0.2 - reach * math.sin(-yaw) - 2 * 0.0225
    links, distance = nearest(leg_bodies(robot), posture(robot, lf_coxa=-yaw))
    assert links == {"lf_femur", "lm_femur"}
    assert distance == pytest.approx(wanted, abs=1e-9)


def test_a_tibia_under_the_trunk_in_closed_form() -> None:
    """Folded below the trunk: the cap around the foot's centre is nearest to the flat underside."""
    robot = hp.load_robot("kharagpur")
    femur, tibia = 1.8, 1.9
    depth = KHARAGPUR.femur.length * math.sin(femur) + KHARAGPUR.tibia.length * math.sin(
        femur + tibia
    )
    links, distance = nearest(leg_bodies(robot), posture(robot, lm_femur=femur, lm_tibia=tibia))
    assert links == {"lm_tibia", "base_link"}
    assert distance == pytest.approx(depth - 0.089 / 2 - 0.015, abs=1e-6)  # an iterated search


def test_shapes_that_are_looked_at(tmp_path: Path) -> None:
    """First links not against the trunk; a collision shape of the URDF as it is.

    A ball of 30 mm at the middle knee, 120 mm towards the front leg (x of the femur is y).
    """
    pairs = {frozenset(pair) for pair in leg_bodies(hp.load_robot("athena")).pairs}
    assert frozenset(("lm_femur", "base_link")) in pairs
    assert frozenset(("lm_coxa", "base_link")) not in pairs
    assert frozenset(("lm_coxa", "lm_tibia")) not in pairs
    assert frozenset(("lf_coxa", "lm_coxa")) in pairs
    ball = (
        '<link name="lm_femur"><collision><origin xyz="0.11934 -0.12 0" rpy="0 0 0"/><geometry>'
        '<sphere radius="0.03"/></geometry></collision>'
    )
    path = tmp_path / "ball.urdf"
    path.write_text(KHARAGPUR.urdf().replace('<link name="lm_femur">', ball))
    robot = hp.load_robot(path)
    links, distance = nearest(leg_bodies(robot), posture(robot))
    assert links == {"lm_femur", "lf_femur"}
    assert distance == pytest.approx(0.2 - 0.12 - 0.03 - 0.0225, abs=1e-9)


def test_without_shapes_a_radius_is_assumed_and_reported(tmp_path: Path) -> None:
    """A tenth of the length: two parallel femurs 0.2 m apart, no trunk to check against."""
    text = KHARAGPUR.urdf()
    while "<visual>" in text:
        text = text[: text.index("<visual>")] + text[text.index("</visual>") + len("</visual>") :]
    path = tmp_path / "bare.urdf"
    path.write_text(text)
    robot = hp.load_robot(path)
    bodies = leg_bodies(robot)
    links, distance = nearest(bodies, posture(robot))
    assert links <= {f"{leg}_femur" for leg in ("lf", "lm", "lr", "rf", "rm", "rr")}
    assert distance == pytest.approx(0.2 - 2 * 0.1 * KHARAGPUR.femur.length, abs=1e-9)
    assert "capsules of radius 0.1 times length (lf_coxa, lf_femur" in bodies.assumed
    assert "not checked: no primitive shape (base_link)" in bodies.assumed


@pytest.mark.parametrize("stroke", [0.05, 0.085])
def test_a_tripod_in_closed_form(tmp_path: Path, stroke: float) -> None:
    """Where the tripods change, two feet stand hip_x - stroke apart, their tibias apart above.

    The legs are then mirror images, so nothing else comes nearer; a foot in the air moves
    to that place or from it.
    """
    found = leg_clearance(narrow(tmp_path), tripod(stroke))
    assert {name.split("_")[1] for name in found.links} == {"tibia"}
    assert found.distance == pytest.approx(HIP_X - stroke - 2 * TIBIA_RADIUS, abs=1e-6)
    assert math.remainder(found.time, 1.0) == pytest.approx(0.0, abs=1e-9)


def test_overlapping_legs_are_refused_with_links_distance_time_and_limit(tmp_path: Path) -> None:
    robot = narrow(tmp_path)
    found = leg_clearance(robot, tripod(0.085))
    limit = HIP_X - 2 * TIBIA_RADIUS
    about = (*found.links, "0.015", f"{found.time:.4g}", "capsules as wide as drawn")
    for stroke, words in ((0.5, ()), (0.085, about)):
        with refused(GaitError, about=words) as e:
            hp.KinematicControl(tripod(stroke)).plan(robot, 1.0)
        assert e.value.limit == pytest.approx(limit, abs=1e-4 * stroke)  # width of the bisection
    assert e.value.quantity == "stroke"
    hp.KinematicControl(tripod(e.value.limit)).plan(robot, 1.0)


def test_what_overlaps_standing_is_left_out_and_reported(tmp_path: Path) -> None:
    robot = narrow(tmp_path, hip_x=0.06, coxa_width=0.07)
    hp.KinematicControl(tripod(0.02)).plan(robot, 1.0)
    found = leg_clearance(robot, tripod(0.02))
    assert ("lf_coxa", "lm_coxa") in found.excluded
    assert any("lf_coxa and lm_coxa" in note for note in found.notes)


def test_a_small_clearance_is_reported(tmp_path: Path) -> None:
    robot = narrow(tmp_path)
    (note,) = leg_clearance(robot, tripod(0.069)).notes
    assert "come within 1 mm" in note
    assert leg_clearance(robot, tripod(0.05)).notes == ()
    assert "touch each other" in leg_clearance(robot, tripod(0.07)).notes[0]
    assert "overlap by 0.015 m" in leg_clearance(robot, tripod(0.085)).notes[0]


def test_the_nearest_moment_is_found_between_samples(tmp_path: Path) -> None:
    """Against distances on a grid 20 times as fine; what is left is the finer one's own error."""
    robot = narrow(tmp_path)
    six, bodies = leg_group(robot), leg_bodies(robot)
    gait = hp.Gait.tripod(stroke=0.06, cycle_time=2.3, turn_rate=0.1, heading=0.3)
    path = FootPath(gait, six.neutral_feet, stop_at=7 * gait.cycle_time)
    p_BF, _ = six.foot_motion(path, np.linspace(0.0, 7 * gait.cycle_time, 8401))
    angles = six.joint_rows(six.kinematics.inverse(p_BF), six.posture)
    base = pin.neutral(robot.model)[:7]
    fine, _ = bodies.distances(np.hstack([np.tile(base, (len(angles), 1)), angles]))
    assert leg_clearance(robot, gait).distance == pytest.approx(fine.min(), abs=2e-5)
