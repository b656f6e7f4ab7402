"""Where motors sit, and what changes of a robot's masses when others are put in."""

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.scene.scene import loaded_model
from hexapod_pin.study.selection.motor_cases import (
    MOTOR_SHARE,
    assumed_motor_mass,
    mass_loads,
    motor_counts,
    motor_places,
)


@pytest.fixture(scope="module", params=["kharagpur", "athena"])
def robot(request):
    return hp.load_robot(request.param)


def test_a_motor_sits_on_the_axis_of_its_joint(robot):
    """Both frames that name the point agree, and it does not move when the joint turns."""
    model, data = robot.model, robot.model.createData()
    q = robot.stand().q
    for k, place in enumerate(motor_places(robot)):
        found = []
        for turned in (0.0, 0.3):
            turned_q = q.copy()
            turned_q[7 + k] += turned
            pin.framesForwardKinematics(model, data, turned_q)
            moved = data.oMf[model.getFrameId(place.moved, pin.FrameType.BODY)]
            carrier = data.oMf[model.getFrameId(place.carrier, pin.FrameType.BODY)]
            found += [moved.translation.copy(), carrier.act(place.position)]
        np.testing.assert_allclose(found, np.tile(found[0], (4, 1)), atol=1e-14)
    assert motor_counts(robot) == {"coxa": 6, "femur": 6, "tibia": 6}


@pytest.mark.parametrize("mass", [0.0167, 0.185])
def test_the_robot_is_heavier_by_the_difference(robot, mass):
    contained = assumed_motor_mass(robot)
    np.testing.assert_allclose(18 * contained, MOTOR_SHARE * robot.total_mass)
    masses = {"coxa": mass, "femur": 1.1 * mass, "tibia": mass}
    loads, notes = mass_loads(robot, masses, contained)
    total = hp.Scene(robot, loads=loads).total_mass
    wanted = robot.total_mass + 18 * (mass - contained) + 6 * 0.1 * mass
    np.testing.assert_allclose(total, wanted, rtol=1e-12)
    assert all("scaled down" in note for note in notes)


def test_a_heavier_motor_is_a_point_on_the_axis(robot):
    """Gravity torques against those by hand: 6 g times the lever arms, on either side the same."""
    loads, _ = mass_loads(robot, {"coxa": 0.0, "femur": 0.0, "tibia": 0.1}, 0.0)
    heavy = loaded_model(hp.Scene(robot, loads=loads))
    q = robot.stand().q
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    ours = pin.computeGeneralizedGravity(heavy, heavy.createData(), q)
    bare = pin.computeGeneralizedGravity(robot.model, robot.model.createData(), q)
    weight = 0.1 * 9.81
    for k, name in enumerate(robot.joint_names):
        own = data.oMi[robot.model.getJointId(name)]
        leg = name.split("_")[0]
        knee = data.oMi[robot.model.getJointId(f"{leg}_tibia_joint")].translation
        axis = np.array(robot.model.joints[robot.model.getJointId(name)].createData().S).ravel()[3:]
        moment = np.cross(knee - own.translation, [0.0, 0.0, -weight]) @ (own.rotation @ axis)
        np.testing.assert_allclose((ours - bare)[6 + k], -moment, atol=1e-12)


def test_masses_that_no_link_has_are_refused():
    robot = hp.load_robot("kharagpur")
    less, trunk = pytest.approx(6 * 0.29), ("base_link", "0")
    with refused(hp.errors.ParameterError, "motor_mass", less, allowed=(1.281,), about=trunk):
        mass_loads(robot, dict.fromkeys(("coxa", "femur", "tibia"), 0.01), 0.3)
