"""Sessions: a run led from outside, against free fall, statics and the same run in one piece."""

from __future__ import annotations

import numpy as np
import pytest
from method_settings import METHODS
from refusals import refused
from scipy.interpolate import CubicHermiteSpline

import hexapod_pin as hp


@pytest.fixture(scope="module")
def scene() -> hp.Scene:
    return hp.Scene(hp.load_robot("kharagpur"))


def in_the_air(scene: hp.Scene) -> hp.State:
    """Return a state 0.5 m above standing, turning about z at 2 rad/s and rising at 1 m/s."""
    stand = scene.robot.stand()
    q, v = stand.q.copy(), stand.v.copy()
    q[2] += 0.5
    v[2], v[5] = 1.0, 2.0
    return scene.robot.check_state(q, v)


def test_sensors_in_free_fall(scene):
    session = hp.Session(scene, initial=in_the_air(scene), accuracy=1e-6)
    session.advance(0.1)
    m = session.measure()
    # the trunk turns about its own z: the accelerometer is off the centre of mass by less than 1 mm
    assert np.abs(m.acceleration).max() < 0.05
    assert m.angular_velocity == pytest.approx([0.0, 0.0, 2.0], abs=1e-2)
    angle = np.arctan2(m.rotation[1, 0], m.rotation[0, 0])
    assert angle == pytest.approx(0.2, abs=1e-3)  # trunk to world: positive about z
    assert not m.loaded.any() and not m.foot_force.any()
    height = session.trace().com[-1, 2] - session.trace().com[0, 2]
    assert height == pytest.approx(0.1 - 0.5 * 9.81 * 0.01, abs=1e-6)


def test_sensors_of_a_standing_robot(scene):
    session = hp.Session(scene, accuracy=1e-6)
    session.advance(3.0)
    m = session.measure()
    assert m.acceleration == pytest.approx([0.0, 0.0, 9.81], abs=1e-2)
    weight = scene.robot.total_mass * 9.81
    assert m.foot_force.sum(axis=0) == pytest.approx([0.0, 0.0, weight], abs=1e-3 * weight)
    assert m.loaded.all()
    assert m.q == pytest.approx(session.trace().q[-1, 7:])
    # the servos' law: kp times the sag
    sag = scene.robot.posture - m.q
    assert m.torque == pytest.approx(scene.servos.kp * sag, abs=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_time_ends_where_it_is_advanced_to(scene, method):
    session = hp.Session(scene, method=method, sample=2e-3, **METHODS[method])
    for end in (0.0007, 0.002, 0.0051, 0.0110003):
        session.advance(end)
        assert session.time == pytest.approx(end, abs=1e-15)
    time = session.trace().time
    assert time == pytest.approx(2e-3 * np.arange(len(time)), abs=1e-15)
    assert len(time) == 6


def test_pauses_between_samples_change_nothing_beyond_the_accuracy(scene):
    """Dropped 5 mm: contact, friction and servos are at work."""
    start = scene.robot.stand()
    initial = scene.robot.check_state(start.q + 0.005 * np.eye(25)[2], start.v)
    ends = np.cumsum(np.random.default_rng(3).uniform(1e-4, 7e-3, 60))
    for method in ("extrapolated-euler", "ndf"):
        how = {"method": method, "sample": 2e-3, **METHODS[method]}
        paused = hp.Session(scene, initial=initial, **how)
        for end in ends:
            paused.advance(float(end))
        trace, hold = paused.trace(), hp.HoldPosture()
        whole = hp.simulate(scene, hold, duration=trace.time[-1], initial=initial, **how)
        assert np.abs(trace.q - whole.q).max() < 20.0 * how["accuracy"], method


def test_a_command_moves_all_joints_together_no_faster_than_they_may(scene):
    robot = scene.robot
    target = robot.posture.copy()
    femur, tibia = robot.joint_index("lf_femur_joint"), robot.joint_index("lf_tibia_joint")
    target[[femur, tibia]] += [0.2, -0.1]
    session = hp.Session(scene, initial=in_the_air(scene), accuracy=1e-4, sample=1e-3)
    session.command(q=target)
    session.advance(0.2)
    trace = session.trace()
    arrival = 0.2 / robot.velocity_limit[femur]  # the longest travel at its limit
    for joint, travel in ((femur, 0.2), (tibia, -0.1)):
        line = robot.posture[joint] + travel * np.minimum(trace.time / arrival, 1.0)
        assert trace.q_ref[:, joint] == pytest.approx(line, abs=1e-12)
    assert not trace.v_ref.any()


def test_a_ramp_arrives_after_its_time(scene):
    robot = scene.robot
    target = robot.posture + 0.05
    session = hp.Session(scene, initial=in_the_air(scene), accuracy=1e-4, sample=1e-3)
    session.advance(0.01)
    session.command(q=target, ramp=0.1)
    session.advance(0.06)
    session.command(q=robot.posture, ramp=0.05)  # on the way there
    session.advance(0.2)
    trace = session.trace()
    first = CubicHermiteSpline([0.01, 0.11], [0.0, 0.05], [0.0, 0.5])  # it ends at its mean rate
    there, rate = float(first(0.06)), float(first(0.06, 1))
    second = CubicHermiteSpline([0.06, 0.11], [there, 0.0], [rate, -there / 0.05])
    pieces = [first(trace.time), second(trace.time), 0.0]
    begun = [trace.time <= 0.06, trace.time <= 0.11]
    expected = np.where(trace.time < 0.01, 0.0, np.select(begun, pieces[:2], pieces[2]))
    assert np.abs(trace.q_ref - robot.posture - expected[:, None]).max() < 1e-12
    assert not trace.v_ref[trace.time > 0.1105].any()


@pytest.mark.parametrize(
    ("command", "name", "value", "about"),
    [
        ({"q": np.full(18, 9.0)}, "Session.command.q[lf_coxa_joint]", 9.0, "rad"),
        ({"v": np.zeros((1, 18))}, "Session.command.v", (1, 18), "(18,)"),
        ({"v": np.full(18, 99.0)}, "Session.command.v[lf_coxa_joint]", 99.0, "rad/s"),
        ({"torque": np.full(18, np.inf)}, "Session.command.torque[lf_coxa_joint]", np.inf, "N m"),
    ],
)
def test_bad_commands_are_refused_and_change_nothing(scene, command, name, value, about):
    session = hp.Session(scene, accuracy=1e-4)
    with refused(hp.errors.ParameterError, name, value, about=(about,)):
        session.command(**command)
    session.advance(0.002)
    assert np.array_equal(session.trace().q_ref[-1], scene.robot.posture)
    with refused(hp.errors.ParameterError, "until", 0.001, allowed=(0.002, 2e8)):
        session.advance(0.001)


@pytest.mark.parametrize("method", ["extrapolated-euler", "dop853", "robust"])
def test_a_session_goes_on_from_its_checkpoint_to_the_same_bits(scene, method):
    def lead(session: hp.Session, ticks: range) -> hp.Session:
        for k in ticks:
            session.advance(k * 0.0037)
            offset = 0.02 * np.sin(0.3 * k)
            session.command(q=scene.robot.posture + offset, ramp=0.002 * (k % 3))
        return session

    how = {"method": method, "sample": 2e-3, **METHODS[method]}
    last = 20 if method == "dop853" else 60
    whole = lead(hp.Session(scene, **how), range(last))
    first = lead(hp.Session(scene, **how), range(last // 2))
    restored = hp.results.Checkpoint.from_dict(first.checkpoint().to_dict())
    second = lead(hp.Session(scene, initial=restored, **how), range(last // 2, last))
    a, b = whole.checkpoint(), second.checkpoint()
    assert a.time == b.time
    assert np.array_equal(a.q, b.q) and np.array_equal(a.v, b.v)
    rows = second.trace()
    same = np.isin(whole.trace().time, rows.time[1:])
    assert np.array_equal(whole.trace().foot_force[same], rows.foot_force[1:])


def test_noise_of_sensors_is_drawn_again_and_continues_from_checkpoints(scene):
    sensors = hp.sensors.Sensors(q=hp.sensors.Sensor(noise=1e-3), seed=3)
    session = hp.Session(scene, accuracy=1e-4, sensors=sensors)
    first, second = session.measure().q, session.measure().q
    error = np.concatenate([first, second]) - np.tile(scene.robot.posture, 2)
    assert 5e-4 < error.std() < 2e-3 and not np.array_equal(first, second)
    again = hp.Session(scene, accuracy=1e-4, sensors=sensors, initial=session.checkpoint())
    assert np.array_equal(again.measure().q, session.measure().q)
    with refused(hp.errors.ParameterError, "sensors.delay", 0.01):
        hp.Session(scene, sensors=hp.sensors.Sensors(delay=0.01))
