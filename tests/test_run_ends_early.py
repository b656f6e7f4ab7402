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

import hexapod_pin as hp
from hexapod_pin.errors import (
    DivergenceError,
    HexapodError,
    ParameterError,
    SimulationInterrupted,
    UserCodeError,
    WorkLimitError,
)
from hexapod_pin.formulations import rigid
from hexapod_pin.formulations.rigid.contact_events import ContactEventLoop

ROBOT = hp.load_robot("kharagpur")
SCENE = hp.Scene(ROBOT)
END, TICK, DURATION = 0.06, 0.005, 0.1
ARRAYS = ("time", "q", "v", "torque", "q_ref", "v_ref", "foot_position", "foot_force", "com")


class OwnError(HexapodError):
    """An error that a user derives from the package's."""


def throw(error: BaseException) -> Any:
    raise error


@dataclass(frozen=True)
class Sway:
    """Sways the robot and leans against its tilt; at 0.06 s it has the fault `fault`."""

    fault: str = ""
    period: float = TICK
    delay: float = 0.0

    def start(self, scene: hp.Scene, batch: int) -> np.ndarray:
        return np.zeros((batch, 1))

    def update(self, time: float, m: hp.feedback.Measurement, state: np.ndarray) -> Any:
        q = ROBOT.posture + 0.02 * np.sin(40.0 * time) + 0.3 * m.rotation[:, 2, :1] + 0.0 * m.q
        if self.fault and time > END - 1e-9:
            return FAULTS[self.fault](q, state)
        return hp.feedback.Command(q, ramp=True), state + 1.0

    def to_dict(self) -> dict[str, Any]:
        return {"kind": "sway", "fault": self.fault}


JOINT, RAGGED = ROBOT.joint_names[4], [[1.0], [1.0, 2.0]]


def bad(q: np.ndarray, value: float) -> np.ndarray:
    changed = q.copy()
    changed[:, 4] = value
    return changed


RAISED = {"ValueError": ValueError, "SystemExit": SystemExit, "other run": WorkLimitError}
NAMED: dict[str, tuple[Callable[[np.ndarray, np.ndarray], Any], str, Any]] = {
    "nan": (lambda q, s: (hp.feedback.Command(bad(q, np.nan)), s), f".q[{JOINT}]", np.nan),
    "inf": (lambda q, s: (hp.feedback.Command(q, torque=bad(q, np.inf)), s),
            f".torque[{JOINT}]", np.inf),
    "range": (lambda q, s: (hp.feedback.Command(bad(q, 9.0)), s), f".q[{JOINT}]", 9.0),
    "shape": (lambda q, s: (hp.feedback.Command(q[:, :3]), s), ".q", (1, 3)),
    "text": (lambda q, s: (hp.feedback.Command("straight"), s), ".q", "straight"),  # type: ignore[arg-type]
    "ragged": (lambda q, s: (hp.feedback.Command(RAGGED), s), ".q", RAGGED),  # type: ignore[arg-type]
    "ramp": (lambda q, s: (hp.feedback.Command(q, ramp="yes"), s), ".ramp", "yes"),  # type: ignore[arg-type]
    "None": (lambda q, s: None, "", "NoneType"),
    "no command": (lambda q, s: (None, s), "", "NoneType"),
    "odd state": (lambda q, s: (hp.feedback.Command(q), {"memory": [object()]}),
                  ".state.memory[0]", "object"),
}  # fmt: skip
"""What is returned, the quantity that the error names, and its value."""

FAULTS: dict[str, Callable[[np.ndarray, np.ndarray], Any]] = {
    "ValueError": lambda q, s: throw(ValueError("no share")),
    "SystemExit": lambda q, s: throw(SystemExit(0)),
    "other run": lambda q, s: hp.simulate(
        SCENE, hp.HoldPosture(), duration=0.1, limits=hp.simulation.WorkLimits(evaluations=10)
    ),
    "own": lambda q, s: throw(OwnError("mine")),
    "Ctrl-C": lambda q, s: throw(KeyboardInterrupt()),
    "Ctrl-C elsewhere": lambda q, s: throw(SimulationInterrupted("of another run", None)),
    **{name: given[0] for name, given in NAMED.items()},
}


def assert_typed(error: HexapodError, fault: str) -> None:
    if fault in RAISED:
        assert isinstance(error, UserCodeError)
        assert (error.call, error.time) == ("Sway.update", pytest.approx(END))
        assert type(error.__cause__) is RAISED[fault]
    elif fault == "own":
        assert type(error) is OwnError
    else:
        assert isinstance(error, ParameterError) and "t = 0.06 s" in str(error)
        _, quantity, value = NAMED[fault]
        assert error.name == f"Sway.update{quantity}"
        assert error.value == value or (np.isnan(value) and np.isnan(error.value))


@cache
def undisturbed(**how: Any) -> hp.Trace:
    return hp.simulate(SCENE, Sway(), duration=DURATION, **how)


def assert_kept(error: HexapodError, whole: hp.Trace) -> None:
    done = error.trace
    assert isinstance(done, hp.Trace)
    assert END - TICK <= done.time[-1] <= END
    for name in ARRAYS:
        assert np.array_equal(getattr(done, name), getattr(whole, name)[: len(done.time)]), name


@pytest.mark.parametrize("fault", [*RAISED, "own", *NAMED])
def test_a_fault_of_a_controller_costs_nothing_that_was_done(fault: str) -> None:
    with pytest.raises(HexapodError) as caught:
        hp.simulate(SCENE, Sway(fault), duration=DURATION)
    assert_typed(caught.value, fault)
    assert_kept(caught.value, undisturbed())


def test_what_was_done_goes_on() -> None:
    with pytest.raises(HexapodError) as caught:
        hp.simulate(SCENE, Sway("nan"), duration=DURATION, sample=2e-3)
    start = hp.results.Checkpoint.from_dict(caught.value.trace.checkpoint.to_dict())
    rest = hp.simulate(SCENE, Sway(), duration=DURATION - END, initial=start, sample=2e-3)
    whole = undisturbed(sample=2e-3)
    assert np.array_equal(rest.q[-1], whole.q[-1])
    assert np.array_equal(rest.checkpoint.v, whole.checkpoint.v)


def test_an_error_at_the_first_tick_has_nothing_to_carry() -> None:
    class AtOnce(Sway):
        def update(self, time: float, m: hp.feedback.Measurement, state: Any) -> Any:
            raise ValueError("at once")

    with pytest.raises(UserCodeError) as caught:
        hp.simulate(SCENE, AtOnce(), duration=DURATION)
    assert (caught.value.trace, caught.value.time) == (None, 0.0)


def test_ctrl_c_in_a_controller_stays_an_interruption() -> None:
    for fault in ("Ctrl-C", "Ctrl-C elsewhere"):
        with pytest.raises(SimulationInterrupted) as caught:
            hp.simulate(SCENE, Sway(fault), duration=DURATION)
        assert_kept(caught.value, undisturbed())


@pytest.mark.parametrize("estimate", [None, True])
def test_in_a_batch_an_error_belongs_to_its_case(estimate: bool | None) -> None:
    faults = ["", "ValueError", "SystemExit", "nan", "own"]
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


@pytest.mark.parametrize(("controller", "estimate"), [(hp.HoldPosture(), True), (Sway(), False)])
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


def test_a_callback_of_a_batch_that_raises_costs_no_result() -> None:
    def progress(fraction: float) -> None:
        if fraction > 0.6:
            raise LookupError("the window is closed")

    cases = [hp.Case(SCENE, hp.HoldPosture(), duration=0.02 * (k + 1)) for k in range(3)]
    with pytest.raises(UserCodeError) as caught:
        hp.simulate_batch(cases, progress=progress)
    assert [type(one) for one in caught.value.results] == [hp.Trace, hp.Trace, type(None)]


def test_a_session_goes_on_after_a_command_that_is_refused() -> None:
    whole, session = hp.Session(SCENE), hp.Session(SCENE)
    for k in range(20):
        for one in (whole, session):
            one.advance(k * TICK)
            one.command(q=ROBOT.posture + 0.02 * np.sin(40.0 * k * TICK), ramp=TICK)
        with pytest.raises(ParameterError):
            session.command(**({"q": np.full(18, np.nan)} if k % 2 else {"q": np.zeros(3)}))
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

hp.register_controller("sway", lambda data: test_run_ends_early.Sway(data["fault"]))
"""


def test_a_case_that_ends_early_leaves_its_trace(run: Run, tmp_path: Path) -> None:
    (tmp_path / "sway.py").write_text(MODULE)
    text = hp.Case(SCENE, hp.HoldPosture(), duration=DURATION).to_toml()
    case = text.replace('kind = "hold"', 'kind = "sway"\nfault = "SystemExit"')
    (tmp_path / "case.toml").write_text(case)
    ended = run("run", "case.toml", "--import", "sway.py", "--no-html", "--quick")
    assert ended.status == 2
    assert "Sway.update" in ended.err and "0.06 s" in ended.err and "Traceback" not in ended.err
    whole = hp.Case.from_toml(case.replace('"SystemExit"', '""')).run()
    done = hp.load_trace(tmp_path / "run.nc")
    assert END - TICK <= done.time[-1] <= END
    assert np.array_equal(whole.q[: len(done.q)], done.q)
