"""S2 appendix eqs. 1-4: rows, drift, redundant contacts, the sticking check, one phase's motion."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
import vehicles
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError
from hexapod_pin.formulations.rigid import (
    ContactSet,
    RigidGround,
    RigidModel,
    derivative,
    energy,
    initial_state,
    integrate,
    prescribed_derivative,
)
from hexapod_pin.formulations.rigid.derivative import constrained_derivative, solve_kkt
from hexapod_pin.validation.cases.bodies import SIX_FEET_MASS as MASS
from hexapod_pin.validation.checks import rigid_checks
from hexapod_pin.validation.checks.samples import feet_named, six_feet

LEVEL = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
AT_REST = hp.State(LEVEL, np.zeros(6))
G = 9.81


@pytest.mark.parametrize("check", rigid_checks.CHECKS, ids=lambda check: check.name)
def test_equations_against_independent_answers(check) -> None:
    assert check.run() <= check.tolerance


def test_a_slope_and_another_gravity_turn_the_same_problem() -> None:
    """A level robot under tilted gravity is the tilted robot on a slope, seen from it."""
    robot = hp.load_robot("kharagpur")
    tilt = pin.rpy.rpyToMatrix(0.2, -0.3, 0.4)
    level = RigidModel(robot, gravity=tilt.T @ [0.0, 0.0, -G])
    slope = RigidModel(robot, ground=RigidGround(normal=tuple(tilt[:, 2])))
    stand, torque = robot.stand().q, np.linspace(-1.0, 1.0, 18)
    turned = stand.copy()
    turned[:3], turned[3:7] = tilt @ stand[:3], pin.Quaternion(tilt).coeffs()
    v = np.random.default_rng(2).normal(size=24)
    one = derivative(level, hp.State(stand, v), torque, range(6))
    two = derivative(slope, hp.State(turned, v), torque, range(6))
    assert two.acceleration == pytest.approx(one.acceleration, abs=1e-9)
    assert two.force == pytest.approx(one.force @ tilt.T, abs=1e-9)
    assert slope.terms(turned, v).gap == pytest.approx(level.terms(stand, v).gap, abs=1e-15)


def test_redundant_feet_move_alike_and_say_what_is_not_unique() -> None:
    """Six feet of one body: rank 6 of 18, no component unique; the loads of smallest norm."""
    model = six_feet((0.013, -0.007, 0.0), 0.0, (0.05, 0.07, 0.1))
    found = derivative(model, AT_REST, [], range(6))
    assert found.rank == 6
    assert not found.unique.any()
    assert found.split == "minimum norm"
    assert found.acceleration == pytest.approx(np.zeros(6), abs=1e-14)
    assert found.force.sum(axis=0) == pytest.approx([0.0, 0.0, MASS * G], abs=1e-12)
    three = derivative(model, AT_REST, [], feet_named("L1,L3,R2"))
    held = feet_named("L1,L3,R2")
    assert three.unique[held].tolist() == [[False, False, True]] * 3  # normals, and they alone
    assert three.force[held, 2] == pytest.approx(
        [8.713585989844156, 7.122702055298701, 14.45169455485714], rel=1e-12
    )


def test_a_straight_leg_is_a_singular_contact_and_is_served() -> None:
    """HC38's stretched leg: its rows lose a rank together with the others' none."""
    robot = vehicles.hexa_ref()
    model = RigidModel(robot)
    state = robot.stand(np.tile([0.0, -0.3, 0.0], 6))
    found = derivative(model, state, np.zeros(18), range(6))
    assert found.rank == 18  # the base moves freely: every foot still has three rows
    anchored = prescribed_derivative(model, state, np.zeros(18), range(6))
    assert anchored.rank == 6
    assert anchored.acceleration == pytest.approx(np.zeros(24), abs=1e-12)


def test_rows_said_twice_change_nothing() -> None:
    rng = np.random.default_rng(3)
    rows, root = rng.normal(size=(4, 7)), rng.normal(size=(7, 7))
    mass, right, target = root @ root.T + np.eye(7), rng.normal(size=7), rng.normal(size=4)
    once = solve_kkt(mass, right, rows, target)
    twice = solve_kkt(mass, right, np.vstack([rows, rows]), np.tile(target, 2))
    assert twice.rank == once.rank == 4
    assert once.unique.all() and not twice.unique.any()
    assert twice.x == pytest.approx(once.x, abs=1e-12)
    assert twice.f == pytest.approx(np.tile(once.f, 2) / 2.0, abs=1e-12)
    against = solve_kkt(mass, right, np.vstack([rows, rows]), np.r_[target, target + 1.0])
    assert against.residual == pytest.approx(np.r_[[0.5] * 4, [-0.5] * 4], abs=1e-12)


def test_feet_that_are_pulled_or_slide_are_reported() -> None:
    """Gravity upwards pulls; gravity at 45 degrees needs mu = 1; a foot of a locked body."""
    robot = six_feet((0.0, 0.0, 0.0), 0.0, (0.05, 0.07, 0.1)).robot
    for gravity, mu, verdict, ratio in (
        ((0.0, 0.0, -G), 0.7, "sticks", 0.0),
        ((0.0, 0.0, G), 0.7, "pulls", 0.0),
        ((G, 0.0, -G), 0.99, "slides", 1.0),
        ((G, 0.0, -G), 1.01, "sticks", 1.0),
    ):
        model = RigidModel(robot, ground=RigidGround(mu=mu), gravity=gravity)
        found = derivative(model, AT_REST, [], range(6))
        assert {check.verdict for check in found.checks} == {verdict}
        assert found.sticks == (verdict == "sticks")
        if verdict != "pulls":
            assert [check.ratio for check in found.checks] == pytest.approx([ratio] * 6, abs=1e-12)


def test_a_foot_without_friction_slides_and_bears() -> None:
    """A body on three smooth feet under tilted gravity accelerates along the plane with g_x."""
    body = six_feet((0.0, 0.0, 0.0), 0.0, (0.05, 0.07, 0.1)).robot
    model = RigidModel(body, gravity=(1.5, 0.0, -G))
    terms = model.terms(LEVEL, np.zeros(6))
    found = constrained_derivative(model, terms, np.zeros(0), ContactSet((), (0, 2, 4)))
    assert found.acceleration == pytest.approx([1.5, 0.0, 0.0, 0.0, 0.0, 0.0], abs=1e-12)
    assert found.force.sum(axis=0) == pytest.approx([0.0, 0.0, MASS * G], abs=1e-12)


def test_energy_and_momentum_of_one_body() -> None:
    """One mass 0.5 m up, moving and turning: the textbook's sums."""
    model = six_feet((0.0, 0.0, 0.0), 0.0, (0.05, 0.07, 0.1))
    q, v = LEVEL + [0, 0, 0.5, 0, 0, 0, 0], np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    found = energy(model, initial_state(model, q, v))
    spin = np.array([0.05, 0.07, 0.1]) * v[3:]
    assert found.potential == pytest.approx(MASS * G * 0.5, rel=1e-14)
    kinetic = 0.5 * (MASS * 14.0 + spin @ v[3:])
    assert found.total == pytest.approx(found.potential + kinetic, rel=1e-14)
    assert found.momentum == pytest.approx(MASS * v[:3], rel=1e-14)
    assert found.angular_momentum == pytest.approx(spin, rel=1e-12)


@pytest.mark.slow
def test_hc20_a_heavy_top_is_one_stuck_foot() -> None:
    """HC20: 150 rad/s for 2 s about a foot that sticks; also the pivot stays where it is."""
    model, start, known = vehicles_top()
    end = integrate(model, start, 2.0, feet=[0], accuracy=1e-8)
    assert end.q[:3] == pytest.approx([float(x) for x in known["com_position(2s)"]], abs=1e-7)
    assert np.abs(model.gaps(end.q)).max() < 1e-9


def vehicles_top() -> tuple[RigidModel, hp.State, dict]:
    """HC20's top: 1 m from its tip to its centre of mass."""
    from hexapod_pin.validation.cases.bodies import body, state

    top = body({"tip": (0.0, -1.0, 0.0)}, mass=15.0, inertia=(0.234375, 0.46875, 0.234375))
    start = state(top, (0.0, 1.0, 0.0), spin=(0.0, 150.0, -4.61538))
    v = start.v.copy()
    v[:3] = np.cross(v[3:], (0.0, 1.0, 0.0))
    known = vehicles.HARD_CASES["HC20_heavy_top"]["ref"]
    return RigidModel(top), top.check_state(start.q, v), known


def test_what_cannot_be_asked_is_refused() -> None:
    model = RigidModel(vehicles.hexa_ref())
    state = model.robot.stand()
    with refused(ParameterError, "joint values", (17,)):
        derivative(model, state, np.zeros(17), [0])
    with refused(ParameterError, "feet", (0, 0)):
        derivative(model, state, np.zeros(18), [0, 0])
    with refused(ParameterError, "RigidGround.mu", -0.1):
        RigidGround(mu=-0.1)
    with refused(ParameterError, "RigidGround.normal", (0.0, 0.0, 2.0)):
        RigidGround(normal=(0.0, 0.0, 2.0))
    with refused(ParameterError, "gravity", (0.0, 0.0)):
        RigidModel(model.robot, gravity=(0.0, 0.0))
