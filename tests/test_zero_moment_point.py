"""The zero-moment point: statics, pushes by closed form, and forces against the bodies' motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from refusals import refused
from synthetic import synthetic_trace

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.stability_margins import (
    contact_points,
    ground_plane,
    zero_moment_point,
    zero_moment_point_of_motion,
)
from hexapod_pin.robot.static_margins import static_margin


@pytest.fixture(scope="module")
def walk() -> hp.Trace:
    gait = hp.Gait.tripod(stroke=0.1, cycle_time=0.8)
    scene = hp.Scene(hp.load_robot("kharagpur"))
    return hp.simulate(scene, hp.KinematicControl(gait), duration=2.4, accuracy=1e-5)


def difference(trace: hp.Trace) -> np.ndarray:
    return np.linalg.norm(zero_moment_point(trace) - zero_moment_point_of_motion(trace), axis=1)[1:]


def test_it_is_the_mean_of_contact_points_by_load() -> None:
    """On level ground, whatever the tangential forces: they act in the ground."""
    trace = synthetic_trace(speed=0.0)
    force = np.array(trace.foot_force)
    load = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    force[..., 2], force[..., 0], force[..., 1] = load, 0.5 * load[::-1], -0.2
    found = zero_moment_point(replace(trace, foot_force=force, foot_impulse=None))
    expected = load @ contact_points(trace)[0] / load.sum()
    assert found == pytest.approx(np.tile(expected, (len(trace.time), 1)), abs=1e-15)
    assert expected[2] == pytest.approx(0.0, abs=1e-15)  # radius 0.01 m below the centres
    force[3] = 0.0
    found = zero_moment_point(replace(trace, foot_force=force, foot_impulse=None))
    assert np.isnan(found[3]).all() and np.isfinite(found[4]).all()  # none in the air


def test_at_rest_it_is_below_the_centre_of_mass() -> None:
    """A robot that has come to rest, one leg lifted: both computations, without a difference."""
    robot = hp.load_robot("kharagpur")
    lifted = {"lf_femur_joint": -0.4}
    trace = hp.simulate(hp.Scene(robot), hp.HoldPosture(lifted), duration=3.0, accuracy=1e-8)
    assert trace.contact[-1].sum() == 5
    for point in (zero_moment_point(trace)[-1], zero_moment_point_of_motion(trace)[-1]):
        # what is left of the motion: accelerations below 1e-6 m/s^2, at height 0.1 m over g
        assert point[:2] == pytest.approx(trace.com[-1, :2], abs=1e-7)
        assert abs(point[2]) < 1e-3  # the feet are pressed in


def test_both_computations_agree_on_a_walk(walk: hp.Trace) -> None:
    """Impulses add up exactly in a trace; within 2 ms the lever arms of forces are not constant.

    A contact point that goes u while its force grows from nothing acts u/6 beside the middle:
    0.02 mm of a foot that lands at 0.05 m/s, with a tenth of the load, are 2e-6 m of the point.
    """
    off = difference(walk)
    assert off.max() < 5e-6
    assert np.percentile(off, 99.0) < 2e-6
    spread = np.ptp(zero_moment_point_of_motion(walk)[1:, :2], axis=0)
    assert spread.max() > 0.02  # so it is no constant that they agree on
    # on a plane the centre of pressure of forces that push cannot leave the polygon
    points = 0.5 * (contact_points(walk)[1:] + contact_points(walk)[:-1])
    margin = static_margin(points[..., :2], zero_moment_point(walk)[1:, :2], walk.contact[1:])
    assert margin.min() > -1e-9


def test_on_a_slope_it_is_in_the_ground() -> None:
    scene = hp.Scene(hp.load_robot("kharagpur"), terrain=hp.Slope(angle=0.15))
    trace = hp.simulate(scene, hp.HoldPosture(), duration=2.0, accuracy=1e-7)
    point, (origin, normal) = zero_moment_point(trace)[-1], (x[-1] for x in ground_plane(trace))
    assert np.dot(point - origin, normal) == pytest.approx(0.0, abs=1e-12)
    below = point - trace.com[-1]
    assert np.linalg.norm(np.cross(below, np.array(trace.run.gravity) / 9.81)) < 1e-6
    assert np.linalg.norm(np.cross(below, normal)) > 0.01
    assert difference(trace)[-1] < 1e-7


def test_a_push_moves_it() -> None:
    """F at height h over the ground moves the centre of pressure by F h / (m g) along F."""
    force, height = 6.0, 0.05
    push = hp.Push("base_link", (0, 0, height), force=(0.0, force, 0.0), start=0.0, duration=9.0)
    scene = hp.Scene(hp.load_robot("kharagpur"), loads=[push])
    trace = hp.simulate(scene, hp.HoldPosture(), duration=3.0, accuracy=1e-7)
    point = zero_moment_point(trace)[-1]
    # the base may lean: its turn is below 0.01 rad, so the height is known to 5e-4 m
    lever = trace.q[-1, 2] + height - point[2]
    moved = point[:2] - trace.com[-1, :2]
    weight = trace.run.robot.total_mass * 9.81
    assert moved == pytest.approx([0.0, force * lever / weight], abs=1e-4)
    # the motion alone does not know the push from the ground: that point stays below
    motion = zero_moment_point_of_motion(trace)[-1]
    assert motion[:2] == pytest.approx(trace.com[-1, :2], abs=1e-5)


def test_what_a_trace_must_tell() -> None:
    with refused(ParameterError, "Trace.run.robot.foot_radius", allowed=(6,)):
        zero_moment_point(synthetic_trace(foot_radius=[0.01]))
    with refused(ParameterError, "Trace.run.robot.urdf"):
        zero_moment_point_of_motion(synthetic_trace(urdf=None))
