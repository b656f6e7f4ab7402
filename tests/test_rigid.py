"""S2 appendix eqs. 1-5: rigid contact, impacts and walks; beside maximal coordinates."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
import vehicles
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError
from hexapod_pin.formulations import maximal, rigid
from hexapod_pin.formulations.conserved import ConservedQuantities
from hexapod_pin.formulations.rigid import (
    ContactSet,
    RigidGround,
    RigidModel,
    derivative,
    integrate,
    plastic_impact,
    simulate,
    unilateral_impact,
)
from hexapod_pin.formulations.rigid.constrained_step import ConstrainedStepper
from hexapod_pin.formulations.rigid.derivative import constrained_derivative, solve_kkt
from hexapod_pin.formulations.set_points import SetPoints
from hexapod_pin.validation.cases.bodies import SIX_FEET_MASS as MASS
from hexapod_pin.validation.cases.bodies import body
from hexapod_pin.validation.checks import impact_checks, rigid_checks
from hexapod_pin.validation.checks.impact_checks import ARRIVING, hc18_model
from hexapod_pin.validation.checks.samples import rigid_robot, six_feet

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
    model = six_feet((0.013, -0.007, 0.0), 0.0, (0.05, 0.07, 0.1))
    found = derivative(model, AT_REST, [], range(6))
    assert found.rank == 6
    assert not found.unique.any()
    assert found.split == "minimum norm"
    against = solve_kkt(np.eye(1), np.zeros(1), np.ones((2, 1)), np.array([1.0, 2.0]))
    assert against.residual == pytest.approx([0.5, -0.5])
    assert found.acceleration == pytest.approx(np.zeros(6), abs=1e-14)
    assert found.force.sum(axis=0) == pytest.approx([0.0, 0.0, MASS * G], abs=1e-12)


def test_feet_that_are_pulled_or_slide_are_reported() -> None:
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


LEVEL = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
TETRAPOD = hp.KinematicControl(hp.Gait.tetrapod())


@pytest.fixture(scope="module")
def walk():
    return simulate(rigid_robot("kharagpur", 0.0), TETRAPOD, duration=1.0)


def test_a_constrained_step_is_of_second_order() -> None:
    model = rigid_robot("kharagpur", 0.0)
    start = model.robot.stand()
    bent = hp.HoldPosture(model.robot.posture + 0.05)
    set_points = SetPoints(bent.plan(model.robot, 1.0))
    stepper = ConstrainedStepper(model, hp.Servo(kp=20.0, kd=0.4), set_points)
    contacts = ContactSet(tuple(range(6)))
    exact = integrate(model, start, 0.02, feet=range(6), torque=stepper.torque, accuracy=1e-10)
    errors = []
    for count in (20, 40):
        now = stepper.snapshot(0.0, start.q, start.v, contacts)
        for _ in range(count):
            now = stepper.step(now, 0.02 / count, contacts)
        errors.append(np.abs(now.v - exact.v).max())
        assert np.abs(now.terms.gap).max() < 1e-12
        assert np.abs(now.terms.rows @ now.v).max() < 1e-12
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.3)


def test_a_servo_at_its_limit_gives_its_limit() -> None:
    robot = hp.load_robot("kharagpur", foot_radius=0.0)
    model = RigidModel(robot)
    far = hp.HoldPosture(np.clip(robot.posture + 0.4, robot.lower, robot.upper))
    start = robot.stand()
    walk = simulate(model, far, duration=0.01, step=1e-3, sample=1e-3, initial=start)
    trace = walk.trace
    assert np.abs(trace.torque).max() == pytest.approx(6.0, rel=1e-12)
    assert np.isfinite(trace.q).all()


def test_phases_and_touch_downs_follow_the_gait(walk) -> None:
    """Legs rf and lm swing first, and land just before 0.8 s, where the gait places them."""
    trace = walk.trace
    # a foot that the others have unloaded for a moment touches again with some 1e-6 J
    landed = [strike for strike in walk.impacts if strike.energy_loss > 1e-5]
    assert [strike.feet for strike in landed] == [("rf_foot",), ("lm_foot",)]
    placed = 2.4 / 3.0
    for strike in landed:
        assert placed - 0.1 < strike.time < placed
        assert strike.energy_loss > 0.0
    down = trace.contact[trace.time.searchsorted(0.4)]
    names = [name for name, on in zip(trace.foot_names, down, strict=True) if not on]
    assert names == ["lm_foot", "rf_foot"]


def test_grounded_feet_neither_sink_nor_slip_nor_pull(walk) -> None:
    """Energy, work and impacts balance to 1 % of the work: what is left is of second order."""
    trace = walk.trace
    held = trace.contact[1:] & trace.contact[:-1]
    moved = np.linalg.norm(np.diff(trace.foot_position, axis=0), axis=2)
    middle = held[:-2] & held[2:] & held[1:-1]
    assert trace.foot_gap.min() > -2e-9
    assert np.quantile(moved[1:-1][middle], 0.99) < 1e-9  # 0.5 um/s at most, of second order
    assert trace.normal_force.min() >= 0.0
    calm = trace.time > 0.1
    weight = trace.run.robot.total_mass * 9.81
    assert trace.normal_force[calm].sum(axis=1).mean() == pytest.approx(weight, rel=2e-3)
    given = np.abs(np.diff(trace.energy["servo_work"])).sum()
    assert np.abs(trace.energy_residual).max() < 0.01 * given
    lost = sum(strike.energy_loss for strike in walk.impacts)
    assert trace.energy["normal_loss"][-1] == pytest.approx(lost, rel=1e-12)


def test_the_friction_that_sticking_needs_is_reported(walk) -> None:
    assert [row.foot for row in walk.friction_demand] == list(walk.trace.foot_names)
    assert all(row.sliding < 0.05 for row in walk.friction_demand)
    icy = RigidModel(rigid_robot("kharagpur", 0.0).robot, ground=RigidGround(mu=0.01))
    slippery = simulate(icy, TETRAPOD, duration=0.1)
    assert min(row.sliding for row in slippery.friction_demand) > 0.5


def test_what_cannot_be_walked_is_refused() -> None:
    model = rigid_robot("kharagpur", 0.0)
    with refused(ParameterError, "step", 0.0):
        simulate(model, TETRAPOD, duration=1.0, step=0.0)
    with refused(ParameterError, "feet", (0, 0)):
        plastic_impact(hc18_model(), LEVEL, ARRIVING, [0], [0])
    slope = RigidModel(model.robot, ground=RigidGround(normal=(0.6, 0.0, 0.8)))
    with refused(ParameterError, "initial", None):
        simulate(slope, TETRAPOD, duration=1.0)


@pytest.mark.parametrize("check", impact_checks.CHECKS, ids=lambda check: check.name)
def test_equation_five_against_independent_answers(check) -> None:
    assert check.run() <= check.tolerance


def test_a_rocking_block_lets_its_far_foot_go() -> None:
    from hexapod_pin.validation.cases.bodies import body

    beam = body({"near": (-1.0, 0.0, 0.0), "far": (1.0, 0.0, 0.0)}, inertia=(0.01, 2.0, 2.0))
    model = RigidModel(beam)
    v = np.array([0.0, 0.0, -1.0, 0.0, 1.0, 0.0])  # turns about the near foot, which rests
    held = plastic_impact(model, LEVEL, v, [0], [1])
    assert [check.verdict for check in held.checks] == ["pulls", "sticks"]
    free = unilateral_impact(model, LEVEL, v, [0], [1])
    assert free.settled and free.feet == (1,)
    rising = (model.positions(LEVEL)[1] @ free.velocity)[:, 2]
    # about the far foot I w - m a^2 w = 2 - 1 is kept, and the moment there is I + m a^2 = 3
    assert free.velocity[4] == pytest.approx(1.0 / 3.0, rel=1e-12)
    assert rising == pytest.approx([2.0 / 3.0, 0.0], abs=1e-14)


def test_one_state_in_both_formulations() -> None:
    """A limp hexapod in the air: the same acceleration, energy and momentum, then 20 ms of flight.

    Maximal coordinates read the URDF by another parser and share no formula with Pinocchio.
    """
    robot, rng = hp.load_robot("kharagpur"), np.random.default_rng(8)
    bodies = maximal.read_bodies(robot.urdf)
    order = [robot.joint_index(name) for name in bodies.joint_names]
    q, v = robot.stand().q.copy(), rng.normal(size=24)
    q[7:] += 0.2 * rng.normal(size=18)
    one, two = rigid.RigidModel(robot), maximal.MaximalModel(bodies)
    state = rigid.initial_state(one, q, v)
    turned = maximal.initial_state(two, np.r_[q[:7], q[7:][order]], np.r_[v[:6], v[6:][order]])

    found = rigid.derivative(one, state, np.zeros(18), feet=())
    other = maximal.derivative(two, turned, np.zeros(18))
    rates = maximal.reduced_acceleration(bodies, turned, other.acceleration)
    expected = np.r_[found.acceleration[:6], found.acceleration[6:][order]]
    assert np.abs(rates - expected).max() < 1e-10 * np.abs(expected).max()

    known, kept = rigid.energy(one, state), maximal.energy(two, turned)
    assert isinstance(known, ConservedQuantities) and isinstance(kept, ConservedQuantities)
    assert kept.total == pytest.approx(known.total, rel=1e-12)
    assert kept.momentum == pytest.approx(known.momentum, rel=1e-10)
    assert kept.angular_momentum == pytest.approx(known.angular_momentum, rel=1e-10)
    assert kept.center_of_mass == pytest.approx(known.center_of_mass, abs=1e-14)

    end = rigid.integrate(one, state, 0.02, accuracy=1e-10)
    run = maximal.integrate(two, turned, 0.02)
    assert run.q[-1, :3] == pytest.approx(end.q[:3], abs=1e-10)
    assert run.q[-1, 7:] == pytest.approx(end.q[7:][order], abs=1e-9)


def test_a_heavy_top_in_both_formulations() -> None:
    """HC20's top for 0.1 s at 150 rad/s: one stuck foot, and a root that is held at a point."""
    moments, spin = (0.234375, 0.46875, 0.234375), np.array([0.0, 150.0, -4.61538])
    top = body({"tip": (0.0, -1.0, 0.0)}, mass=15.0, inertia=moments)
    one = rigid.RigidModel(top)
    q, v = np.r_[0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0], np.r_[np.cross(spin, [0, 1, 0]), spin]
    end = rigid.integrate(one, top.check_state(q, v), 0.1, feet=[0], accuracy=1e-8)
    assert np.abs(one.gaps(end.q)).max() < 1e-9
    held = maximal.RootConstraint.spherical((0.0, -1.0, 0.0), (0.0, 0.0, 0.0))
    two = maximal.MaximalModel(maximal.read_bodies(top.urdf), root=held)
    run = maximal.integrate(two, maximal.initial_state(two, q, v), 0.1, rtol=1e-10, atol=1e-12)
    assert run.q[-1, :3] == pytest.approx(end.q[:3], abs=1e-7)
    energy = [maximal.energy(two, state).total for state in run.states]
    assert energy[1] == pytest.approx(energy[0], rel=1e-10)
    at = two.kinematics(run.states[-1])
    assert np.abs(two.constraints(run.states[-1], at).root.violation).max() < 1e-12
