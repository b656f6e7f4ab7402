"""The same scene elsewhere, turned, mirrored, re-ordered: the same motion."""

from __future__ import annotations

import numpy as np
import pytest

from hexapod_pin.validation.cases.mirror import (
    SHIFT,
    SampledMotion,
    base_run,
    in_a_batch,
    mirror_map,
    mirrored,
    moved,
    reordered,
    reordered_robot,
    shifted,
    yawed,
)
from hexapod_pin.validation.solver_setting import SolverSetting

IMPLICIT, RK4, EXTRAPOLATED_EULER = (
    SolverSetting("implicit-euler", 1e-3),
    SolverSetting("rk4", 1e-5),
    SolverSetting("extrapolated-euler", 1e-6),
)
ROBUST = SolverSetting("robust", 1e-3)
FIXED = pytest.mark.parametrize("way", [IMPLICIT, ROBUST, RK4], ids=lambda way: way.method)
WAYS = pytest.mark.parametrize(
    "way", [IMPLICIT, ROBUST, EXTRAPOLATED_EULER], ids=lambda way: way.method
)


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


@WAYS
def test_shifted(way: SolverSetting, known) -> None:
    """Level ground has no place: all is the same but the rounding of x and y, 7e-15 m at 64 m.

    What does not contain the place has the same bits: heights, attitudes, joints, velocities.
    """
    found = shifted(base_run(), way)
    assert np.array_equal(found.v, known(way).v)
    assert np.array_equal(found.q[:, 2:], known(way).q[:, 2:])
    steps = 100  # at most; each rounds once
    assert np.abs(found.q[:, :2] - known(way).q[:, :2]).max() < steps * 7.2e-15


@FIXED
@pytest.mark.parametrize("angle", [2.0])
def test_yawed(angle: float, way: SolverSetting, known) -> None:
    assert known(way).apart(yawed(base_run(), angle, way)) < 1e-9


@WAYS
def test_mirrored(way: SolverSetting, known) -> None:
    """Mirroring keeps every component's size, so extrapolated-euler takes the same steps too."""
    assert known(way).apart(mirrored(base_run(), way)) < 1e-9


@WAYS
def test_legs_in_another_order(way: SolverSetting, known) -> None:
    """Not the same bits: the base's sums run over the legs in another order."""
    assert known(way).apart(reordered(base_run(), way)) < 1e-9


@WAYS
def test_beside_others_on_two_threads(way: SolverSetting, known) -> None:
    found = in_a_batch(base_run(), way)
    assert np.array_equal(found.q, known(way).q) and np.array_equal(found.v, known(way).v)


def test_reordered_robot_is_another_robot() -> None:
    first, second = base_run().scene.robot, reordered_robot()
    assert second.joint_names != first.joint_names or [
        first.model.jointPlacements[2].translation[0]
    ] != [second.model.jointPlacements[2].translation[0]]
    assert second.total_mass == pytest.approx(first.total_mass, rel=1e-15)


def test_mirror_map_is_its_own_inverse() -> None:
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
