"""Closed-loop controllers: measurements, commands, cuts, lock-step."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache

import numpy as np
import pytest
from method_settings import METHODS
from refusals import refused
from scipy.interpolate import CubicHermiteSpline

import hexapod_pin as hp
from hexapod_pin.simulation.case import Case
from hexapod_pin.simulation.session import lock_step_runs

SHORT = ("dop853", "rk4")  # slow: 0.1 s of them


@cache
def robot() -> hp.Robot:
    return hp.load_robot("kharagpur")


@cache
def plan():
    gait = hp.Gait.tetrapod(stroke=0.06, cycle_time=1.2)
    return hp.KinematicControl(gait), hp.KinematicControl(gait).plan(robot(), 2.0)


@dataclass(frozen=True)
class Replay:
    """Sends the joint angles of a walk at ticks; counts them in its state."""

    period: float

    def posture(self, scene: hp.Scene) -> np.ndarray:
        return plan()[1].q[0]

    def start(self, scene: hp.Scene, batch: int) -> np.ndarray:
        return np.zeros((batch, 1))

    def update(self, time, measurement, state):
        knots = plan()[1]
        angles = CubicHermiteSpline(knots.time, knots.q, knots.v)
        return hp.feedback.Command(angles(time + self.period)[None], ramp=True), state + 1


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


@pytest.mark.parametrize("method", METHODS)
def test_a_plan_sent_at_ticks_converges_to_the_plan(method):
    """Cubics with mean rates between points of a smooth path: half the period, half the error."""
    duration = 0.1 if method in SHORT else 0.6
    open_loop = run(plan()[0], duration, method=method, **METHODS[method])
    errors = []
    for period in (0.01, 0.005):
        closed = run(Replay(period), duration, method=method, **METHODS[method])
        errors.append(np.abs(closed.q[:, 7:] - open_loop.q[:, 7:]).max())
    # methods of order 1 see the rate over a step in the place of that at its end: h a kd / kp
    floor = {"robust": 3e-4, "implicit-euler": 3e-4}.get(method, 1e-5)
    assert errors[1] < 0.5 * errors[0] + floor and errors[1] < 3e-4 + floor


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
    duration = 0.04
    sample = 1e-3 if method in ("robust", "implicit-euler") else 1e-4
    trace = run(spy, duration, method=method, sample=sample, **METHODS[method])
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
        joined = np.concatenate([first.q, second.q[1:]])
        assert np.array_equal(joined, whole.q)
        assert np.array_equal(second.checkpoint.v, whole.checkpoint.v)
        assert second.checkpoint.loop["state"]["ticks"] == whole.checkpoint.loop["state"]["ticks"]


def test_lock_step_gives_every_case_its_bits():
    controller = Yielding(sensors=NOISY)
    scenes = [
        hp.Scene(robot(), contact=hp.Contact.accurate().with_mu(0.3 + 0.04 * k)) for k in range(12)
    ]
    cases = [Case(scene, controller, duration=0.05, accuracy=1e-4, sample=2e-3) for scene in scenes]
    how = cases[0].settings
    seven = [r.trace().q for r in lock_step_runs(cases[:7], how, threads=2)]
    many = [r.trace().q for r in lock_step_runs(cases, how)]
    simulated = hp.simulate(scenes[3], controller, duration=0.05, accuracy=1e-4, sample=2e-3).q
    for k in range(7):
        assert np.array_equal(seven[k], many[k])
    assert np.array_equal(simulated, many[3])
    assert not np.array_equal(many[0], many[11])


def test_one_that_diverges_leaves_the_others_alone():
    """A step too long for hard contact blows one case up; its neighbours do not notice."""
    soft = hp.Scene(robot())
    hard = hp.contact.HuntCrossley(stiffness=1e15, exponent=1.5, dissipation=0.0)
    friction = hp.contact.TanhCoulomb(mu=0.7, slope=100.0)
    stiff = hp.Scene(robot(), contact=hp.Contact(normal=hard, friction=friction))
    how = {"duration": 0.1, "method": "rk4", "step": 2e-4}
    cases = [Case(scene, Yielding(), **how) for scene in (soft, stiff, soft)]
    runs = lock_step_runs(cases, cases[0].settings)
    assert [r.good for r in runs] == [True, False, True]
    alone = lock_step_runs(cases[:1], cases[0].settings)[0]
    assert np.array_equal(runs[2].trace().q, alone.trace().q)
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
