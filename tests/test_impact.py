"""S2 appendix eq. 5: HC18, Pinocchio, energy, the compliant limit, and feet that only push."""

from __future__ import annotations

import numpy as np
import pytest
from refusals import refused

from hexapod_pin.errors import ParameterError
from hexapod_pin.formulations.rigid import RigidModel, plastic_impact, unilateral_impact
from hexapod_pin.validation.checks import impact_checks
from hexapod_pin.validation.checks.impact_checks import ARRIVING, hc18_model
from hexapod_pin.validation.checks.limit_checks import damped_impact
from hexapod_pin.validation.checks.samples import rigid_robot

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
