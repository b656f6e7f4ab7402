"""The same scene elsewhere, turned, mirrored, re-ordered: the same motion."""

from __future__ import annotations

import numpy as np
import pytest

from hexapod_pin.validation.cases.mirror import (
    SHIFT,
    SampledMotion,
    base_run,
    mirror_map,
    moved,
    reordered_robot,
    shifted,
    transformed,
    yawed,
)
from hexapod_pin.validation.solver_setting import SolverSetting

IMPLICIT, RK4, EXTRAPOLATED_EULER = (
    SolverSetting("implicit-euler", 1e-3),
    SolverSetting("rk4", 1e-5),
    SolverSetting("extrapolated-euler", 1e-6),
)
ROBUST = SolverSetting("robust", 1e-3)


@pytest.fixture(scope="module")
def known():
    motions: dict[SolverSetting, SampledMotion] = {}

    def get(way: SolverSetting) -> SampledMotion:
        if way not in motions:
            motions[way] = SampledMotion.of(base_run().by(way))
        return motions[way]

    return get


def test_the_scene_has_all_that_could_break_a_symmetry(known) -> None:
    """It turns, all joints move, some feet touch and slip: otherwise the tests below say little."""
    trace = base_run().by(IMPLICIT)
    assert trace.contact.any(axis=0).sum() >= 3 and not trace.contact.all()
    assert (np.ptp(trace.q[:, 7:], axis=0) > 1e-3).all()
    assert np.linalg.norm(trace.tangential_force, axis=2).max() > 1.0


def test_what_does_not_contain_the_place_has_the_same_bits(known) -> None:
    """Shifted, level ground is the same: heights, attitudes, joints, velocities; x, y to rounding.

    That of x and y is 7e-15 m at 64 m.
    """
    found, here = shifted(base_run(), EXTRAPOLATED_EULER), known(EXTRAPOLATED_EULER)
    assert np.array_equal(found.v, here.v) and np.array_equal(found.q[:, 2:], here.q[:, 2:])
    steps = 100  # at most; each rounds once
    assert np.abs(found.q[:, :2] - here.q[:, :2]).max() < steps * 7.2e-15


def test_transformed_by_methods_that_a_quick_suite_leaves_out(known) -> None:
    """`implicit-euler` and `extrapolated-euler` are those of HC37, which is run with the others."""
    for value in transformed(ROBUST):
        assert value.error <= value.tolerance, value.what
    assert known(RK4).apart(yawed(base_run(), 2.0, RK4)) < 1e-9


def test_the_images_are_what_they_are_called() -> None:
    """The map of the mirror is its own inverse; the re-ordered robot is another robot."""
    first, second = base_run().scene.robot, reordered_robot()
    assert second.joint_names != first.joint_names or [
        first.model.jointPlacements[2].translation[0]
    ] != [second.model.jointPlacements[2].translation[0]]
    assert second.total_mass == pytest.approx(first.total_mass, rel=1e-15)
    joints, signs = mirror_map(base_run().scene.robot)
    assert np.array_equal(joints[joints], np.arange(18))
    assert np.array_equal(signs[joints], signs)
    assert set(signs) == {1.0, -1.0}


@pytest.mark.parametrize("broken", ["attitude", "sign"])
def test_a_wrong_mirror_is_seen(broken: str, known) -> None:
    """The comparison has teeth: half a mirror image differs by far more than the tolerance."""
    run = base_run()
    q, v = run.start.q.copy(), run.start.v.copy()
    if broken == "attitude":
        q[3:6] *= [1.0, 1.0, -1.0]
    else:
        v[6] = -v[6]
    q[:3] += SHIFT
    found = SampledMotion.of(moved(run, q, v).by(IMPLICIT))
    found.q[:, :3] -= SHIFT
    assert known(IMPLICIT).apart(found) > 1e-3
