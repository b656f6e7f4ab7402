"""Closed-loop controllers: measurements, commands, cuts, lock-step."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache

import numpy as np
import pytest
from method_settings import METHODS
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.simulation.case import Case
from hexapod_pin.simulation.session import lock_step_runs


@cache
def robot() -> hp.Robot:
    return hp.load_robot("kharagpur")


@dataclass(frozen=True)
class Yielding:
    """Feedback of everything: sinks under load, leans against tilt; remembers a filtered force."""

    period: float = 0.005
    delay: float = 0.0
    sensors: hp.sensors.Sensors = field(default_factory=hp.sensors.Sensors)

    def start(self, scene: hp.Scene, batch: int) -> dict:
        return {"force": np.zeros((batch, 6)), "ticks": 0}

    def update(self, time, m, state):
        load = np.linalg.norm(m.foot_force, axis=2) * m.loaded
        force = state["force"] + 0.1 * (load - state["force"])
        q = robot().posture + np.zeros_like(m.q)
        q[:, 1::3] += 0.004 * force + 0.3 * m.rotation[:, 2, 0:1]
        q[:, 2::3] += 0.002 * m.angular_velocity[:, 1:2] + 0.001 * (m.acceleration[:, 2:] - 9.81)
        q[:, 0::3] += 0.02 * m.torque[:, 0::3] - 0.001 * m.v[:, 0::3]
        return hp.feedback.Command(q, ramp=True), {"force": force, "ticks": state["ticks"] + 1}


def run(controller, duration, initial=None, sample=2e-3, **how) -> hp.Trace:
    return hp.simulate(
        hp.Scene(robot()), controller, duration=duration, initial=initial, sample=sample, **how
    )


@dataclass
class Spy:
    """Records the times of its ticks and of its measurements."""

    period: float
    delay: float = 0.0
    sensors: hp.sensors.Sensors = field(default_factory=hp.sensors.Sensors)
    calls: list = field(default_factory=list)

    def start(self, scene, batch):
        return None

    def update(self, time, measurement, state):
        self.calls.append((time, measurement.time, measurement.q[0, 1]))
        q = np.tile(robot().posture, (1, 1))
        q[:, 1] += 0.01 * len(self.calls)
        return hp.feedback.Command(q, v=np.zeros_like(q)), state


@pytest.mark.parametrize("method", METHODS)
def test_delays_of_sensors_and_of_commands(method):
    """The measurement is 3.3 ms old; the command acts 7 ms after its tick, and jumps there."""
    spy = Spy(0.005, delay=0.007, sensors=hp.sensors.Sensors(delay=0.0033))
    sample = 1e-3 if method in ("robust", "implicit-euler") else 1e-4
    trace = run(spy, 0.04, method=method, sample=sample, **METHODS[method])
    ticks = 0.005 * np.arange(len(spy.calls))
    assert [time for time, _, _ in spy.calls] == pytest.approx(list(ticks), abs=1e-15)
    expected = np.maximum(ticks - 0.0033, 0.0)
    assert [time for _, time, _ in spy.calls] == pytest.approx(list(expected), abs=1e-12)
    # set-points: none before 7 ms, the k-th acts from 5 k + 7 ms, within 0.01 rad / velocity limit
    reference = trace.q_ref[:, 1] - robot().posture[1]
    moving = 0.01 / robot().velocity_limit[1]
    for time, value in zip(trace.time, reference, strict=True):
        last = int(np.floor((time - 0.007) / 0.005 + 1e-9)) + 1
        since = time - 0.007 - 0.005 * (last - 1)
        if last <= 0:
            assert value == 0.0
        elif since > moving:
            assert value == pytest.approx(0.01 * last, abs=1e-12)
    measured = np.interp([m for _, m, _ in spy.calls], trace.time, trace.q[:, 8])
    # at samples, but between them where these are 1 ms apart
    tolerance = 2e-5 if sample == 1e-3 else 1e-9
    assert [q for _, _, q in spy.calls] == pytest.approx(list(measured), abs=tolerance)


NOISY = hp.sensors.Sensors(
    q=hp.sensors.Sensor(noise=1e-3, quantisation=1e-3), foot_force=hp.sensors.Sensor(noise=0.1),
    rotation=hp.sensors.Sensor(noise=1e-3), delay=0.0071, seed=5,
)  # fmt: skip


@pytest.mark.parametrize(
    ("method", "delay", "sensors"),
    [
        ("extrapolated-euler", 0.0123, NOISY), ("dop853", 0.0, hp.sensors.Sensors()),
        ("robust", 0.0123, NOISY),
    ],
)  # fmt: skip
def test_a_cut_at_any_time_changes_no_bit(method, delay, sensors):
    controller = Yielding(delay=delay, sensors=sensors)
    duration, how = 0.06 if method == "dop853" else 0.3, METHODS[method]
    whole = run(controller, duration, method=method, **how)
    for cut in (0.03, 0.02 + 0.002):
        first = run(controller, cut, method=method, **how)
        kept = hp.results.Checkpoint.from_dict(first.checkpoint.to_dict())
        second = run(controller, duration - cut, initial=kept, method=method, **how)
        assert np.array_equal(np.concatenate([first.q, second.q[1:]]), whole.q)
        assert np.array_equal(second.checkpoint.v, whole.checkpoint.v)
        assert second.checkpoint.loop["state"]["ticks"] == whole.checkpoint.loop["state"]["ticks"]


def test_lock_step_gives_every_case_its_bits():
    controller = Yielding(sensors=NOISY)
    contacts = [hp.Contact.accurate().with_mu(0.3 + 0.04 * k) for k in range(12)]
    scenes = [hp.Scene(robot(), contact=contact) for contact in contacts]
    cases = [Case(scene, controller, duration=0.05, accuracy=1e-4, sample=2e-3) for scene in scenes]
    how = cases[0].settings
    seven = [r.trace().q for r in lock_step_runs(cases[:7], how, threads=2)]
    many = [r.trace().q for r in lock_step_runs(cases, how)]
    simulated = hp.simulate(scenes[3], controller, duration=0.05, accuracy=1e-4, sample=2e-3).q
    assert np.array_equal(seven, many[:7])
    assert np.array_equal(simulated, many[3])
    assert not np.array_equal(many[0], many[11])


def test_one_that_diverges_leaves_the_others_alone():
    hard = hp.contact.HuntCrossley(stiffness=1e15, exponent=1.5, dissipation=0.0)
    friction = hp.contact.TanhCoulomb(mu=0.7, slope=100.0)
    stiff = hp.Scene(robot(), contact=hp.Contact(normal=hard, friction=friction))
    how = {"duration": 0.1, "method": "rk4", "step": 2e-4}
    cases = [Case(scene, Yielding(), **how) for scene in (hp.Scene(robot()), stiff)]
    runs = lock_step_runs([*cases, cases[0]], cases[0].settings)
    assert [r.good for r in runs] == [True, False, True]
    alone = lock_step_runs(cases[:1], cases[0].settings)[0].trace().q
    assert np.array_equal([runs[0].trace().q, runs[2].trace().q], [alone, alone])
    with pytest.raises(hp.errors.DivergenceError):
        runs[1].require_good()


def test_a_loop_may_begin_at_the_checkpoint_of_another_run():
    """Ticks before it are missed: the next is at a whole number of periods."""
    before = run(hp.HoldPosture(), 0.012, accuracy=1e-4)
    spy = Spy(0.005)
    run(spy, 0.02, initial=before.checkpoint, accuracy=1e-4)
    assert [time for time, _, _ in spy.calls] == pytest.approx([0.015, 0.02, 0.025, 0.03])


def test_what_is_no_controller_is_refused():
    with refused(hp.errors.ParameterError, "controller", "object"):
        run(object(), 0.01, accuracy=1e-4)
    with refused(hp.errors.ParameterError, "controller", "Spy") as caught:
        run(Spy, 0.01, accuracy=1e-4)
    assert "()" in caught.value.hint  # it is the class


# sessions: a run led from outside


@pytest.fixture(scope="module")
def scene() -> hp.Scene:
    return hp.Scene(robot())


def in_the_air(scene: hp.Scene) -> hp.State:
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
    assert m.torque == pytest.approx(scene.servos.kp * (scene.robot.posture - m.q), abs=1e-6)


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


@pytest.mark.parametrize(
    ("command", "name", "value", "about"),
    [
        ({"q": np.full(18, 9.0)}, "Session.command.q[lf_coxa_joint]", 9.0, "rad"),
        ({"v": np.zeros((1, 18))}, "Session.command.v", (1, 18), "(18,)"),
        ({"v": np.full(18, 99.0)}, "Session.command.v[lf_coxa_joint]", 99.0, "rad/s"),
        ({"ramp": -1.0}, "ramp", -1.0, "[s]"),
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
