"""An error that ends a run after its first step carries what was done, also from a user's code."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import Run
from fuzz import campaign

import hexapod_pin as hp
from hexapod_pin.control.foot_control import controller as ready_law
from hexapod_pin.errors import (
    DivergenceError,
    HexapodError,
    ParameterError,
    SensorError,
    SimulationInterrupted,
    UserCodeError,
    WorkLimitError,
)
from hexapod_pin.formulations import maximal, rigid
from hexapod_pin.formulations.rigid.contact_events import ContactEventLoop
from hexapod_pin.simulation.session import lock_step_runs

ROBOT = hp.load_robot("kharagpur")
SCENE = hp.Scene(ROBOT)
GAIT = hp.Gait.tripod(stroke=0.03)
END, TICK, DURATION = 0.06, 0.005, 0.1
ARRAYS = ("time", "q", "v", "torque", "q_ref", "v_ref", "foot_position", "foot_force", "com")


class OwnError(HexapodError):
    """An error that a user derives from the package's."""


def throw(error: BaseException) -> Any:
    """Raise, where only an expression fits."""
    raise error


def bad(q: np.ndarray, value: float) -> np.ndarray:
    """Return angles of which the fifth is a value."""
    changed = q.copy()
    changed[:, 4] = value
    return changed


@dataclass(frozen=True)
class Sway:
    """Sways the robot and leans against its tilt; at 0.06 s it has the fault `fault`."""

    fault: str = ""
    period: float = TICK
    delay: float = 0.0

    def start(self, scene: hp.Scene, batch: int) -> np.ndarray:
        """Return the ticks so far."""
        return np.zeros((batch, 1))

    def update(self, time: float, m: hp.feedback.Measurement, state: np.ndarray) -> Any:
        """Return angles on a sine, or whatever goes wrong."""
        q = ROBOT.posture + 0.02 * np.sin(40.0 * time) + 0.3 * m.rotation[:, 2, :1] + 0.0 * m.q
        if self.fault and time > END - 1e-9:
            return FAULTS[self.fault](q, state)
        return hp.feedback.Command(q, ramp=True), state + 1.0

    def to_dict(self) -> dict[str, Any]:
        """Return the settings."""
        return {"kind": "sway", "fault": self.fault}


FAULTS: dict[str, Callable[[np.ndarray, np.ndarray], Any]] = {
    "ValueError": lambda q, state: throw(ValueError("no share")),
    "StopIteration": lambda q, state: throw(StopIteration()),
    "SystemExit": lambda q, state: throw(SystemExit(0)),
    "KeyError": lambda q, state: {}["gain"],
    "other run": lambda q, state: hp.simulate(
        SCENE, hp.HoldPosture(), duration=0.1, limits=hp.simulation.WorkLimits(evaluations=10)
    ),
    "own": lambda q, state: throw(OwnError("mine")),
    "reach": lambda q, state: throw(hp.errors.ReachError("lf", "too far")),
    "nan": lambda q, state: (hp.feedback.Command(bad(q, np.nan)), state),
    "inf": lambda q, state: (hp.feedback.Command(q, torque=bad(q, np.inf)), state),
    "range": lambda q, state: (hp.feedback.Command(bad(q, 9.0)), state),
    "shape": lambda q, state: (hp.feedback.Command(q[:, :3]), state),
    "no axis": lambda q, state: (hp.feedback.Command(q[0]), state),
    "text": lambda q, state: (hp.feedback.Command("straight"), state),  # type: ignore[arg-type]
    "complex": lambda q, state: (hp.feedback.Command(q + 1j), state),
    "objects": lambda q, state: (hp.feedback.Command(np.full(q.shape, object())), state),
    "ragged": lambda q, state: (hp.feedback.Command([[1.0], [1.0, 2.0]]), state),  # type: ignore[arg-type]
    "no angles": lambda q, state: (hp.feedback.Command(None), state),  # type: ignore[arg-type]
    "ramp": lambda q, state: (hp.feedback.Command(q, ramp="yes"), state),  # type: ignore[arg-type]
    "None": lambda q, state: None,
    "no command": lambda q, state: (None, state),
    "no state": lambda q, state: hp.feedback.Command(q),
    "odd state": lambda q, state: (hp.feedback.Command(q), {"memory": [object()]}),
}  # fmt: skip

RAISED = {
    "ValueError": ValueError, "StopIteration": StopIteration, "SystemExit": SystemExit,
    "KeyError": KeyError, "other run": WorkLimitError,
}  # fmt: skip
PASSED = {"own": OwnError, "reach": hp.errors.ReachError}
JOINT = ROBOT.joint_names[4]
NAMED = {
    "nan": (f".q[{JOINT}]", np.nan), "inf": (f".torque[{JOINT}]", np.inf),
    "range": (f".q[{JOINT}]", 9.0), "shape": (".q", (1, 3)),
    "no axis": (".q", (18,)), "text": (".q", "straight"),
    "no angles": (".q", None), "ramp": (".ramp", "yes"),
    "None": ("update", "NoneType"), "no command": ("update", "NoneType"),
    "no state": ("update", "Command"), "odd state": (".state.memory[0]", "object"),
}  # fmt: skip
"""Of what is returned: the quantity that the error names, and its value."""


@cache
def undisturbed(**how: Any) -> hp.Trace:
    """Return the run without the fault, which is run once."""
    return hp.simulate(SCENE, Sway(), duration=DURATION, **how)


def assert_kept(error: HexapodError, whole: hp.Trace) -> None:
    """Its samples are those of the undisturbed run, up to a tick before the fault at least."""
    done = error.trace
    assert isinstance(done, hp.Trace)
    assert END - TICK <= done.time[-1] <= END
    for name in ARRAYS:
        assert np.array_equal(getattr(done, name), getattr(whole, name)[: len(done.time)]), name


def assert_typed(error: HexapodError, fault: str) -> None:
    """The error names the call, its fault and the time."""
    if fault in RAISED:
        assert isinstance(error, UserCodeError)
        assert (error.call, error.time) == ("Sway.update", pytest.approx(END))
        assert type(error.__cause__) is RAISED[fault]
    elif fault in PASSED:
        assert type(error) is PASSED[fault]
    else:
        assert isinstance(error, ParameterError)
        assert error.name.startswith("Sway.update") and "t = 0.06 s" in str(error)
        quantity, value = NAMED.get(fault, (".q", error.value))
        assert error.name.endswith(quantity) or quantity == "update"
        if fault in NAMED:
            assert error.value == value or (np.isnan(value) and np.isnan(error.value))


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_of_a_controller_costs_nothing_that_was_done(fault: str) -> None:
    with pytest.raises(HexapodError) as caught:
        hp.simulate(SCENE, Sway(fault), duration=DURATION)
    assert_typed(caught.value, fault)
    assert_kept(caught.value, undisturbed())


@pytest.mark.parametrize("how", [{"method": "robust", "step": 1e-3}, {"record": ("motion",)}])
def test_with_fixed_steps_and_few_samples_too(how: dict[str, Any]) -> None:
    with pytest.raises(UserCodeError) as caught:
        hp.simulate(SCENE, Sway("ValueError"), duration=DURATION, **how)
    whole, done = undisturbed(**how), caught.value.trace
    assert done.recorded == whole.recorded
    assert np.array_equal(done.q, whole.q[: len(done.q)]) and END - TICK <= done.time[-1] <= END


@pytest.mark.parametrize("fault", ["ValueError", "nan"])
def test_what_was_done_goes_on(fault: str) -> None:
    """From the error's checkpoint, with the fault repaired, to the bits of the undisturbed run."""
    with pytest.raises(HexapodError) as caught:
        hp.simulate(SCENE, Sway(fault), duration=DURATION, sample=2e-3)
    start = hp.results.Checkpoint.from_dict(caught.value.trace.checkpoint.to_dict())
    rest = hp.simulate(SCENE, Sway(), duration=DURATION - END, initial=start, sample=2e-3)
    whole = undisturbed(sample=2e-3)
    assert np.array_equal(rest.q[-1], whole.q[-1])
    assert np.array_equal(rest.checkpoint.v, whole.checkpoint.v)


def test_the_trace_is_that_of_the_run_that_ended() -> None:
    """Where the error is estimated, two runs of different accuracy are under way."""
    case = hp.Case(SCENE, Sway("ValueError"), duration=DURATION, estimate=True)
    with pytest.raises(UserCodeError) as caught:
        case.run()
    how = case.settings
    good = hp.Case(SCENE, Sway(), duration=DURATION, estimate=True)
    wholes = [
        lock_step_runs([good], how.at_level(level))[0].trace()
        for level in how.method_settings.first_levels
    ]
    done = caught.value.trace
    same = [one for one in wholes if np.array_equal(one.q[: len(done.q)], done.q)]
    assert len(same) == 1
    assert_kept(caught.value, same[0])


def test_an_error_at_the_first_tick_has_nothing_to_carry() -> None:
    class AtOnce(Sway):
        def update(self, time: float, m: hp.feedback.Measurement, state: Any) -> Any:
            raise ValueError("at once")

    with pytest.raises(UserCodeError) as caught:
        hp.simulate(SCENE, AtOnce(), duration=DURATION)
    assert (caught.value.trace, caught.value.time) == (None, 0.0)


def test_ctrl_c_in_a_controller_stays_an_interruption() -> None:
    """Also where a run that the controller makes has taken it."""
    for error in (KeyboardInterrupt(), SimulationInterrupted("of another run", None)):

        class Pressed(Sway):
            def update(self, time: float, m: hp.feedback.Measurement, state: Any) -> Any:
                if time > END - 1e-9:
                    raise error  # noqa: B023
                return super().update(time, m, state)

        with pytest.raises(SimulationInterrupted) as caught:
            hp.simulate(SCENE, Pressed(), duration=DURATION)
        assert_kept(caught.value, undisturbed())


def test_a_reading_that_is_no_number_costs_nothing_that_was_done() -> None:
    """`FootControl` refuses it; what it had done is there."""
    control = hp.FootControl(hp.KinematicControl(GAIT))

    @dataclass
    class Broken:
        broken: bool = True

        def __post_init__(self) -> None:
            self.period, self.start = control.period, control.start

        def update(self, time: float, m: hp.feedback.Measurement, state: Any) -> Any:
            if self.broken and time > END - 1e-9:
                m.q[0, 4] = np.nan
            return control.update(time, m, state)

        def posture(self, scene: hp.Scene) -> np.ndarray:
            return control.posture(scene)

    with pytest.raises(SensorError) as caught:
        hp.simulate(SCENE, Broken(), duration=DURATION)
    whole = hp.simulate(SCENE, Broken(False), duration=DURATION)
    done = caught.value.trace
    assert END - control.period <= done.time[-1] <= END
    assert np.array_equal(done.q, whole.q[: len(done.q)])


@pytest.mark.parametrize("estimate", [None, True])
def test_in_a_batch_an_error_belongs_to_its_case(estimate: bool | None) -> None:
    faults = ["", "ValueError", "", "SystemExit", "nan", "own", "None"]
    cases = [hp.Case(SCENE, Sway(fault), duration=DURATION, estimate=estimate) for fault in faults]
    cases.append(hp.Case(SCENE, hp.HoldPosture(), duration=DURATION))
    results = hp.simulate_batch(cases, threads=2)
    whole = undisturbed(estimate=estimate)
    for fault, result in zip(faults, results, strict=False):
        if fault:
            assert_typed(result, fault)
            assert END - TICK <= result.trace.time[-1] <= END
            if estimate is None:
                assert_kept(result, whole)
        else:
            assert np.array_equal(result.q, whole.q)
    assert isinstance(results[-1], hp.Trace)
    kept = hp.simulate_batch(cases[:2], keep="summary")
    assert isinstance(kept[0], hp.Summary) and isinstance(kept[1], UserCodeError)


def test_runs_in_lock_step_do_not_lose_each_other() -> None:
    """One controller of many scenes; the one of which it fails is alone with its error."""

    class Heavy(Sway):
        def update(self, time: float, m: hp.feedback.Measurement, state: Any) -> Any:
            if time > END - 1e-9 and (m.foot_force[..., 2].sum(axis=-1) > 60.0).any():
                raise ValueError("too heavy")
            return super().update(time, m, state)

    scenes = [hp.Scene(ROBOT, gravity=(0.0, 0.0, -g)) for g in (9.0, 9.81, 60.0)]
    cases = [hp.Case(scene, Heavy(), duration=DURATION) for scene in scenes]
    light, usual, heavy = hp.simulate_batch(cases)
    assert isinstance(light, hp.Trace) and np.array_equal(usual.q, undisturbed().q)
    assert isinstance(heavy, UserCodeError) and heavy.trace.time[-1] >= END - TICK


@pytest.mark.parametrize("controller", [hp.HoldPosture(), Sway()])
@pytest.mark.parametrize("estimate", [False, True])
def test_a_callback_that_raises_costs_nothing_that_was_done(
    controller: Any, estimate: bool
) -> None:
    def progress(fraction: float) -> None:
        if fraction > 0.5:
            raise LookupError("the window is closed")

    with pytest.raises(UserCodeError) as caught:
        hp.simulate(SCENE, controller, duration=1.0, estimate=estimate, progress=progress)
    error = caught.value
    assert error.call == "progress" and isinstance(error.__cause__, LookupError)
    assert error.trace.time[-1] == pytest.approx(error.time, abs=2.1e-3)
    assert 0.0 < error.time < 1.0
    case = hp.Case(SCENE, controller, duration=1.0, estimate=estimate)
    with pytest.raises(UserCodeError):
        case.run(progress)


def test_a_callback_of_a_batch_that_raises_costs_no_result() -> None:
    def progress(fraction: float) -> None:
        if fraction > 0.6:
            raise LookupError("the window is closed")

    cases = [hp.Case(SCENE, hp.HoldPosture(), duration=0.02 * (k + 1)) for k in range(3)]
    with pytest.raises(UserCodeError) as caught:
        hp.simulate_batch(cases, progress=progress)
    assert [type(one) for one in caught.value.results] == [hp.Trace, hp.Trace, type(None)]


def test_the_campaign_finds_bare_errors_of_the_controllers_of_the_package(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    control = hp.FootControl(hp.KinematicControl(GAIT))
    monkeypatch.setattr(ready_law.ReadyLaw, "set_points", lambda *_: {}["angles"])

    def of_the_package(_: Any) -> None:
        hp.simulate(SCENE, control, duration=0.01)

    def of_a_user(_: Any) -> None:
        hp.simulate(SCENE, Sway("KeyError"), duration=DURATION)

    for name, entry in (("package", of_the_package), ("user", of_a_user)):
        monkeypatch.setitem(campaign.DOORS, name, entry)
    assert campaign.attempt("package", 0).kind == campaign.FAULT
    assert campaign.attempt("user", 0).kind == campaign.REFUSED


def led(session: hp.Session, ticks: range) -> None:
    """Lead a session over ticks."""
    for k in ticks:
        session.advance(k * TICK)
        session.command(q=ROBOT.posture + 0.02 * np.sin(40.0 * k * TICK), ramp=TICK)


@pytest.mark.parametrize("value", [np.full(18, np.nan), np.zeros(3), "straight", None])
def test_a_session_goes_on_after_a_command_that_is_refused(value: Any) -> None:
    whole, session = hp.Session(SCENE), hp.Session(SCENE)
    led(whole, range(20))
    led(session, range(12))
    given = {"torque": np.full(18, np.inf)} if value is None else {"q": value}
    with pytest.raises(ParameterError):
        session.command(**given)
    led(session, range(12, 20))
    assert np.array_equal(whole.trace().q, session.trace().q)


def test_ctrl_c_in_a_session_carries_what_was_done() -> None:
    session = hp.Session(SCENE)
    timer = threading.Timer(0.1, signal.raise_signal, (signal.SIGINT,))
    timer.start()
    try:
        with pytest.raises(SimulationInterrupted) as caught:
            session.advance(1e5)
    finally:
        timer.join()
    done = caught.value.trace
    assert 0.0 < done.time[-1] <= session.time
    assert session.measure().time == session.time
    session.advance(session.time + 0.01)
    assert np.array_equal(session.trace().q[: len(done.q)], done.q)


def test_a_session_that_diverged_has_what_was_good() -> None:
    hard = hp.contact.HuntCrossley(stiffness=1e13, exponent=1.5, dissipation=0.0)
    contact = hp.Contact(normal=hard, friction=hp.contact.TanhCoulomb(mu=0.7, slope=100.0))
    session = hp.Session(hp.Scene(ROBOT, contact=contact), method="rk4", step=2e-4)
    with pytest.raises(DivergenceError) as caught:
        session.advance(0.1)
    assert np.array_equal(session.trace().q, caught.value.trace.q)
    with pytest.raises(DivergenceError):
        session.advance(0.2)


def test_maximal_coordinates_keep_what_was_done_too() -> None:
    body = (
        '<robot name="body"><link name="body"><inertial><mass value="1"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>'
    )
    model = maximal.MaximalModel(maximal.read_bodies(body))
    start = maximal.initial_state(model, np.array([0, 0, 1, 0, 0, 0, 1.0]), np.zeros(6))

    def set_points(time: float) -> Any:
        if time > END + 1e-9:
            raise LookupError("no angles")
        return np.zeros(0), np.zeros(0)

    with pytest.raises(UserCodeError) as caught:
        maximal.integrate(model, start, 0.1, sample=0.01, step=0.01, set_points=set_points)
    assert caught.value.call == "set_points" and caught.value.time > END
    assert caught.value.trace.time[-1] == pytest.approx(END)


def test_rigid_contact_keeps_what_was_done_too(monkeypatch: pytest.MonkeyPatch) -> None:
    advance = ContactEventLoop.advance

    def failing(self: ContactEventLoop, until: float, step: float) -> None:
        if until > 0.011:
            raise DivergenceError("feet come and go", None)
        advance(self, until, step)

    monkeypatch.setattr(ContactEventLoop, "advance", failing)
    model = rigid.RigidModel(ROBOT)
    with pytest.raises(DivergenceError) as caught:
        rigid.simulate(model, hp.HoldPosture(), duration=0.05, sample=0.005)
    assert caught.value.trace.time[-1] == pytest.approx(0.01)


MODULE = """
import hexapod_pin as hp
import test_run_ends_early


class Sway(test_run_ends_early.Sway):
    def to_dict(self):
        return {"kind": "sway-FAULT", "fault": self.fault}


hp.register_controller("sway-FAULT", lambda data: Sway(data["fault"]))
"""


@pytest.mark.parametrize("fault", ["ValueError", "SystemExit"])
def test_a_case_that_ends_early_leaves_its_trace(run: Run, tmp_path: Path, fault: str) -> None:
    (tmp_path / "sway.py").write_text(MODULE.replace("FAULT", fault))
    text = hp.Case(SCENE, hp.HoldPosture(), duration=DURATION).to_toml()
    control = f'kind = "sway-{fault}"\nfault = "{fault}"'
    case = text.replace('kind = "hold"', control)
    (tmp_path / "case.toml").write_text(case)
    ended = run("run", "case.toml", "--import", "sway.py", "--no-html", "--quick")
    assert ended.status == 2
    assert "Sway.update" in ended.err and "0.06 s" in ended.err and "Traceback" not in ended.err
    whole = hp.Case.from_toml(case.replace(f'fault = "{fault}"', 'fault = ""')).run()
    done = hp.load_trace(tmp_path / "run.nc")
    assert END - TICK <= done.time[-1] <= END
    assert np.array_equal(whole.q[: len(done.q)], done.q)
