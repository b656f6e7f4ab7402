"""Walks on rigid ground: order, ground, balance of energy and force; its impacts."""

from __future__ import annotations

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError
from hexapod_pin.formulations.rigid import (
    ContactSet,
    RigidGround,
    RigidModel,
    integrate,
    plastic_impact,
    simulate,
    unilateral_impact,
)
from hexapod_pin.formulations.rigid.constrained_step import ConstrainedStepper
from hexapod_pin.formulations.set_points import SetPoints
from hexapod_pin.validation.checks import impact_checks
from hexapod_pin.validation.checks.impact_checks import ARRIVING, hc18_model
from hexapod_pin.validation.checks.limit_checks import damped_impact
from hexapod_pin.validation.checks.samples import rigid_robot

TETRAPOD = hp.KinematicControl(hp.Gait.tetrapod())


@pytest.fixture(scope="module")
def walk():
    """One second of S2's tetrapod from standing: two lift-offs, two touch-downs."""
    return simulate(rigid_robot("kharagpur", 0.0), TETRAPOD, duration=1.0)


def test_set_points_are_the_plans_cubics() -> None:
    """At the knots the plan itself; between them rates and accelerations match differences."""
    robot = hp.load_robot("kharagpur")
    plan = TETRAPOD.plan(robot, 3.0)
    points = SetPoints(plan)
    for k in (0, 17, 100, len(plan.time) - 2):
        q, v, _ = points(float(plan.time[k]))
        assert q == pytest.approx(plan.q[k], abs=1e-15)
        assert v == pytest.approx(plan.v[k], abs=1e-12)
    time, h = 1.2345, 1e-5
    ahead, back, (_, v, a) = points(time + h), points(time - h), points(time)
    assert v == pytest.approx((ahead[0] - back[0]) / (2 * h), abs=1e-6)
    assert a == pytest.approx((ahead[1] - back[1]) / (2 * h), abs=1e-5)
    end, rest, _ = points(99.0)
    assert end == pytest.approx(plan.q[-1]) and not rest.any()


def test_a_constrained_step_is_of_second_order() -> None:
    """Against DOP853 on the same phase: a quarter of the error for half the step."""
    model = rigid_robot("kharagpur", 0.0)
    start = model.robot.stand()
    bent = hp.HoldPosture(model.robot.posture + 0.05)
    set_points = SetPoints(bent.plan(model.robot, 1.0))
    stepper = ConstrainedStepper(model, hp.Servo(kp=20.0, kd=0.4), set_points)
    contacts = ContactSet(tuple(range(6)))
    exact = integrate(model, start, 0.02, feet=range(6), torque=stepper.torque, accuracy=1e-10)
    errors = []
    for count in (20, 40, 80):
        now = stepper.snapshot(0.0, start.q, start.v, contacts)
        for _ in range(count):
            now = stepper.step(now, 0.02 / count, contacts)
        errors.append(np.abs(now.v - exact.v).max())
        assert np.abs(now.terms.gap).max() < 1e-12
        assert np.abs(now.terms.rows @ now.v).max() < 1e-12
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.3)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.3)


def test_a_servo_at_its_limit_gives_its_limit() -> None:
    """A set-point far away: every joint whose demand is above its effort gives just that."""
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
    trace = walk.trace
    calm = trace.time > 0.1
    weight = trace.run.robot.total_mass * 9.81
    assert trace.normal_force[calm].sum(axis=1).mean() == pytest.approx(weight, rel=2e-3)
    given = np.abs(np.diff(trace.energy["servo_work"])).sum()
    assert np.abs(trace.energy_residual).max() < 0.01 * given
    lost = sum(strike.energy_loss for strike in walk.impacts)
    assert trace.energy["normal_loss"][-1] == pytest.approx(lost, rel=1e-12)


def test_the_friction_that_sticking_needs_is_reported(walk) -> None:
    """Every foot has a row; with next to no friction all would have slid."""
    assert [row.foot for row in walk.friction_demand] == list(walk.trace.foot_names)
    assert all(row.sliding < 0.05 for row in walk.friction_demand)
    icy = RigidModel(walk_model().robot, ground=RigidGround(mu=0.01))
    slippery = simulate(icy, TETRAPOD, duration=0.1)
    assert min(row.sliding for row in slippery.friction_demand) > 0.5


def walk_model() -> RigidModel:
    """Return kharagpur on point feet."""
    return rigid_robot("kharagpur", 0.0)


def test_what_cannot_be_walked_is_refused() -> None:
    model = walk_model()
    with refused(ParameterError, "step", 0.0):
        simulate(model, TETRAPOD, duration=1.0, step=0.0)
    slope = RigidModel(model.robot, ground=RigidGround(normal=(0.6, 0.0, 0.8)))
    with refused(ParameterError, "initial", None):
        simulate(slope, TETRAPOD, duration=1.0)


# impacts --------------------------------------------------------------------------------------


LEVEL = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])


@pytest.mark.parametrize("check", impact_checks.CHECKS, ids=lambda check: check.name)
def test_equation_five_against_independent_answers(check) -> None:
    assert check.run() <= check.tolerance


def test_hc18_by_hand() -> None:
    """HC18 with six feet that stick: all stop, and the impulses add up to the momentum."""
    found = plastic_impact(hc18_model(), LEVEL, ARRIVING, (), range(6))
    assert found.rank == 6
    assert not found.unique.any()
    assert np.abs(found.velocity).max() < 1e-14
    assert found.impulse.sum(axis=0) == pytest.approx([-0.926238, 0.308746, 2.161222], abs=1e-12)
    kinetic = 0.5 * (3.08746 * 0.59 + 0.03 * 0.04 + 0.05 * 0.16 + 0.06 * 0.25)
    assert found.energy_loss == pytest.approx(kinetic, rel=1e-12)
    assert kinetic == pytest.approx(0.9229007, abs=5e-8)
    with refused(ParameterError, "feet", (0, 0)):
        plastic_impact(hc18_model(), LEVEL, ARRIVING, [0], [0])


def test_grounded_feet_stay_and_are_told_from_colliding_ones_by_name_only() -> None:
    """A foot at rest and one that arrives are both at rest after it; the others are not."""
    model = rigid_robot("kharagpur", 0.0)
    q = model.robot.stand().q
    rows = model.positions(q)[1]
    v = np.random.default_rng(5).normal(size=24)
    v -= np.linalg.pinv(rows[0]) @ (rows[0] @ v)  # foot 0 rests
    found = plastic_impact(model, q, v, [0], [3])
    speed = rows @ found.velocity
    assert np.abs(speed[[0, 3]]).max() < 1e-12
    assert np.abs(speed[[1, 2, 4, 5]]).max() > 0.1
    assert found.impulse[[1, 2, 4, 5]].tolist() == [[0.0] * 3] * 4
    assert found.energy_loss > 0.0
    assert found.feet == (0, 3)


def test_the_damped_compliant_impact_tends_to_it() -> None:
    """The core's difference falls like 1/c: a tenth per decade of damping."""
    differences = [damped_impact(damping) for damping in (1e5, 1e6, 1e7)]
    assert differences[-1] < 1e-6
    ratios = np.array(differences[:-1]) / differences[1:]
    assert ratios == pytest.approx([10.0, 10.0], rel=0.1)


def test_a_rocking_block_lets_its_far_foot_go() -> None:
    """One end of a beam strikes: the other would be pulled; let go, it rises."""
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
