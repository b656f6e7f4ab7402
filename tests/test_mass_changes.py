"""Loads that change a robot's own masses: factors, and point masses taken away."""

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.scene.scene import loaded_model

LINK = "lf_tibia"


def body(scene, joint="lf_tibia_joint"):
    model = loaded_model(scene)
    return model.inertias[model.getJointId(joint)]


@pytest.fixture(scope="module")
def robot():
    return hp.load_robot("kharagpur")


def test_a_factor_scales_every_body_or_one_and_moves_none(robot):
    scene = hp.Scene(robot, loads=[hp.loads.MassFactor(1.25)])
    model = loaded_model(scene)
    for ours, theirs in zip(list(model.inertias)[1:], list(robot.model.inertias)[1:], strict=True):
        np.testing.assert_allclose(ours.mass, 1.25 * theirs.mass, rtol=1e-15)
        np.testing.assert_allclose(ours.inertia, 1.25 * theirs.inertia, rtol=1e-14)
        np.testing.assert_array_equal(ours.lever, theirs.lever)
    np.testing.assert_allclose(scene.total_mass, 1.25 * robot.total_mass, rtol=1e-14)
    scene = hp.Scene(robot, loads=[hp.loads.MassFactor(2.0, [LINK])])
    alone = robot.model.inertias[robot.model.getJointId("lf_tibia_joint")].mass
    np.testing.assert_allclose(scene.total_mass, robot.total_mass + alone, rtol=1e-14)
    np.testing.assert_allclose(body(scene).mass, 2.0 * alone, rtol=1e-15)


def test_what_was_put_on_can_be_taken_away(robot):
    place = (0.02, -0.01, -0.03)
    loads = [hp.Payload(LINK, 0.05, place), hp.loads.RemovedMass(LINK, 0.05, place)]
    ours, theirs = body(hp.Scene(robot, loads=loads)), body(hp.Scene(robot))
    np.testing.assert_allclose(ours.mass, theirs.mass, rtol=1e-14)
    np.testing.assert_allclose(ours.lever, theirs.lever, atol=1e-16)
    np.testing.assert_allclose(ours.inertia, theirs.inertia, rtol=1e-10, atol=1e-15)
    from hexapod_pin.robot.loading.pin_model import RemovedPoint, _without

    pair = pin.Inertia(2.0, np.zeros(3), np.diag([1e-3, 2.0 + 1e-3, 2.0 + 1e-3]))
    left = _without(pair, RemovedPoint("pair", 1.0, np.zeros(3)), np.array([1.0, 0.0, 0.0]))
    assert left.mass == 1.0
    np.testing.assert_allclose(left.lever, [-1.0, 0.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(left.inertia, 1e-3 * np.eye(3), atol=1e-15)


@pytest.mark.parametrize(
    ("mass", "place", "left"),
    [(5.0, (0.0, 0.0, 0.0), "kg are left"), (0.1, (0.2, 0.0, 0.0), "principal moments")],
)
def test_more_than_the_link_has_is_refused(robot, mass, place, left):
    with refused(hp.errors.ParameterError, "RemovedMass.mass[lf_tibia]", mass) as found:
        hp.Scene(robot, loads=[hp.loads.RemovedMass(LINK, mass, place)])
    assert LINK in str(found.value) and "other side of the joint" in str(found.value)


def test_what_cannot_be_is_named(robot):
    for factor in (0.0, float("inf")):
        with refused(hp.errors.ParameterError, "MassFactor.factor", factor):
            hp.loads.MassFactor(factor)
    for load in (hp.loads.MassFactor(1.1, ["nowhere"]), hp.loads.RemovedMass("nowhere", 0.1)):
        with refused(hp.errors.UnknownNameError, kind="link (Scene.loads[0].link)", name="nowhere"):
            hp.Scene(robot, loads=[load])


def test_a_case_keeps_them_and_its_trace_knows_the_masses(robot):
    """Text and back; the recorded robot, built from text alone, has the same masses."""
    from hexapod_pin.results.recorded_robot import RecordedRobot

    loads = [hp.loads.MassFactor(1.1, ["base_link"]), hp.loads.RemovedMass(LINK, 0.01)]
    case = hp.Case(hp.Scene(robot, loads=loads), hp.HoldPosture(), duration=0.2, accuracy=1e-4)
    assert hp.Case.from_toml(case.to_toml()) == case
    trace = case.run()
    model = loaded_model(case.scene)
    ours = [y.mass for y in RecordedRobot.of(trace).model.inertias]
    np.testing.assert_allclose(ours, [y.mass for y in model.inertias], rtol=1e-15)
    np.testing.assert_allclose(trace.run.robot.total_mass, sum(ours), rtol=1e-12)
