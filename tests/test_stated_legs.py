"""Legs and held joints that a URDF states; gaits for four to eight legs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from leg_robots import NAMES, legged, load
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.control.feasible_gait import default_gait, named_gait
from hexapod_pin.control.gait import gaits_for
from hexapod_pin.control.kinematic import KinematicControl
from hexapod_pin.control.leg_group import leg_order
from hexapod_pin.errors import GaitError, ParameterError, UnknownNameError, UrdfError


def test_legs_are_those_that_the_file_states(tmp_path: Path) -> None:
    robot = load(legged(4, tarsus=0.4, pan=True), tmp_path)
    assert [leg.name for leg in robot.legs] == list(NAMES[4])
    leg = robot.leg("rr")
    assert leg.joints == ("rr_coxa_joint", "rr_femur_joint", "rr_tibia_joint")
    assert leg.foot == "rr_foot" and robot.foot("rr_foot").leg == "rr"
    assert robot.held == {**{f"{name}_tarsus_joint": 0.4 for name in NAMES[4]}, "pan_joint": 0.4}
    assert robot.posture[robot.joint_index("pan_joint")] == 0.4
    text = legged(pan=True).replace('<held joint="pan_joint" position="0.4"/>', "")
    assert load(text, tmp_path).held == {"pan_joint": 0.0}


CHAIN = "lf_coxa_joint lf_femur_joint lf_tibia_joint"


@pytest.mark.parametrize(
    ("old", "new", "about"),
    [
        ('foot="lf_foot"', 'foot="sole"', ("<leg name='lf'>", "'sole'")),
        (CHAIN, "lf_femur_joint lf_coxa_joint lf_tibia_joint", ("<leg name='lf'>", CHAIN)),
        (CHAIN, "lf_coxa_joint", ("<leg name='lf'>", "1", "2", "3")),
        ('name="lm" joints', 'name="lf" joints', ("<leg>: leg 'lf'",)),
        ('position="0.4"', 'position="far"', ("<held>", "'pan_joint'", "'far'")),
        ('<held joint="pan_joint"', '<held joint="tail"', ("<held>", "'tail'")),
        (CHAIN, "lf_coxa_joint lf_spring_joint", ("'lf_spring_joint'", "<held>")),
        ('<leg name="r', '<limb name="r', ("<leg>", "3", "4", "8")),
    ],
)
def test_what_is_stated_wrongly_is_named(
    old: str, new: str, about: tuple[str, ...], tmp_path: Path
) -> None:
    text = legged(pan=True, spring="spring" in new)
    assert old in text
    with refused(UrdfError, about=about):
        load(text.replace(old, new), tmp_path)


def test_legs_of_two_and_three_joints_do_not_walk_together(tmp_path: Path) -> None:
    text = legged().replace(
        "lm_coxa_joint lm_femur_joint lm_tibia_joint", "lm_coxa_joint lm_femur_joint"
    )
    with refused(GaitError, quantity="legs", limit=None, about=("lf 3", "lm 2")):
        KinematicControl(hp.Gait.tripod()).plan(load(text, tmp_path), 2.0)


@pytest.mark.parametrize("count", [4, 7])
def test_gait_order_goes_by_where_legs_stand_not_by_the_file(count: int, tmp_path: Path) -> None:
    shuffled = tuple(np.random.default_rng(count).permutation(NAMES[count]).tolist())
    robot = load(legged(count, order=shuffled), tmp_path)
    assert [leg.name for leg in robot.legs] == list(shuffled)
    assert leg_order(robot) == NAMES[count]
    six = load(legged(order=("rr", "lf", "rm", "lm", "lr", "rf")), tmp_path)
    assert [leg.name for leg in six.legs] == list(NAMES[6])  # with the usual names


@pytest.mark.parametrize(("count", "name"), [(n, g) for n in (4, 5, 7, 8) for g in gaits_for(n)])
def test_a_robot_on_these_gaits_stands_at_every_instant(
    count: int, name: str, tmp_path: Path
) -> None:
    """The base's origin, over which the symmetric robot's mass is, lies inside its support."""
    robot = load(legged(count), tmp_path)
    gait = named_gait(robot, name, stroke=0.03, cycle_time=1.0)
    path = KinematicControl(gait).path(robot)
    time = 3.0 + (np.arange(200) + 0.5) / 200.0
    for feet, down in zip(path.positions(time)[..., :2], path.stance(time), strict=True):
        assert down.sum() >= 3
        assert _inside(feet[down])


def _inside(points: np.ndarray) -> bool:
    """Tell whether the origin is inside the convex hull of points: no half-plane is empty."""
    angle = np.sort(np.arctan2(points[:, 1], points[:, 0]))
    return bool(np.diff(np.append(angle, angle[0] + 2.0 * np.pi)).max() < np.pi)


def test_alternating_tetrapod_and_creep() -> None:
    gait = hp.Gait.tetrapod(legs=8)
    sets = np.array(gait.phases).reshape(2, 4)
    assert (sets[0] != sets[1]).all() and (np.abs(np.diff(sets, axis=1)) == 0.5).all()
    assert gait.minimum_feet_down == 4 and gait.duty == 0.5
    creep = hp.Gait.wave(0.75, legs=4)  # left hind, left fore, right hind, right fore
    assert creep.phases == (0.0, 0.75, 0.5, 0.25)
    with refused(GaitError, quantity="duty", limit=0.75, about=("0.6", "0.75")):
        hp.Gait.wave(0.6, legs=4)


def test_default_gaits_and_those_that_do_not_fit(tmp_path: Path) -> None:
    four = load(legged(4), tmp_path)
    assert default_gait(four) == "wave"
    assert default_gait(load(legged(8), tmp_path)) == "tetrapod"
    assert default_gait(hp.load_robot("kharagpur")) == "tetrapod"
    with refused(UnknownNameError, kind="gait of 4 legs", name="tripod", known=["wave"]):
        named_gait(four, "tripod")
    about = ("tripod", "6", "4", "(lf, lr, rf, rr)", "wave")
    with refused(GaitError, quantity="phases", limit=None, about=about):
        KinematicControl(hp.Gait.tripod()).plan(four, 2.0)
    with refused(GaitError, quantity="legs", limit=None, about=("tetrapod", "4", "wave")):
        hp.Gait.tetrapod(legs=4)
    with refused(ParameterError, "Gait.phases", (0.0, 0.5, 0.0), allowed=(4,)):
        hp.Gait(phases=(0.0, 0.5, 0.0), duty=0.9)


def test_phases_by_name(tmp_path: Path) -> None:
    plain = hp.Gait.custom((0.0, 0.5, 0.0, 0.5, 0.0, 0.5), 0.5)
    named = {"rm": 0.0, "lf": 0.0, "lr": 0.0, "rf": 0.5, "lm": 0.5, "rr": 0.5}
    assert hp.Gait(phases=named, duty=0.5) == plain and "leg_names" not in plain.model_dump()
    robot = load(legged(8), tmp_path)
    wave = hp.Gait.wave(legs=8, stroke=0.03)
    table = dict(zip(leg_order(robot), wave.phases, strict=True))
    shuffled = hp.Gait.custom(
        {k: table[k] for k in sorted(table, reverse=True)}, wave.duty, stroke=0.03
    )
    mine, theirs = (KinematicControl(gait).plan(robot, 1.0) for gait in (shuffled, wave))
    np.testing.assert_array_equal(mine.q, theirs.q)
    about = ("8", "(l1, l2, l3, l4, r1, r2, r3, r4)", "6", "(lf, lm, lr, rf, rm, rr)")
    with refused(GaitError, quantity="phases", limit=None, about=about):
        KinematicControl(hp.Gait.custom(table, wave.duty)).plan(hp.load_robot("kharagpur"), 1.0)
    case = hp.Case(hp.Scene(robot), KinematicControl(shuffled), duration=1.0)
    again = hp.load_case(case.save(tmp_path / "case.toml"))
    assert again.controller.gait == shuffled
