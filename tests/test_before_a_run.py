"""What is asked of a controller before a run is checked, and costs no other run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from refusals import refused
from test_run_ends_early import ROBOT, SCENE, TICK, Sway

import hexapod_pin as hp
from hexapod_pin.errors import HexapodError, ParameterError, UserCodeError


@dataclass(frozen=True)
class OddKey(Sway):
    """What a batch asks of a controller before it runs, broken in one way."""

    wrong: str = ""

    def to_dict(self) -> dict[str, Any]:
        if self.wrong == "to_dict":
            raise RuntimeError("no settings")
        return {**super().to_dict(), "wrong": self.wrong}

    def start_key(self, scene: hp.Scene) -> Any:
        if self.wrong == "start_key":
            raise RuntimeError("no key")
        return [] if self.wrong == "unhashable" else 0

    def start(self, scene: hp.Scene, batch: int) -> Any:
        if self.wrong == "start":
            raise RuntimeError("no start")
        return object() if self.wrong == "odd start" else super().start(scene, batch)

    def posture(self, scene: hp.Scene) -> Any:
        if self.wrong == "posture":
            raise RuntimeError("no posture")
        return [0.0] if self.wrong == "short posture" else scene.robot.posture


@pytest.mark.parametrize(
    "wrong",
    ["to_dict", "start_key", "unhashable", "start", "odd start", "posture", "short posture"],
)
def test_what_is_called_before_a_run_ends_no_other(wrong: str) -> None:
    cases = [hp.Case(SCENE, OddKey(wrong=word), duration=0.02) for word in ("", wrong, "")]
    one, error, other = hp.simulate_batch(cases)
    assert isinstance(one, hp.Trace) and isinstance(other, hp.Trace)
    assert isinstance(error, HexapodError) and error.trace is None
    if wrong in ("to_dict", "start_key", "start", "posture"):
        assert isinstance(error, UserCodeError) and error.call == f"OddKey.{wrong}"


def test_a_case_without_duration_is_a_result_of_its_own() -> None:
    error, good = hp.simulate_batch([
        hp.Case(SCENE, Sway()), hp.Case(SCENE, Sway(), duration=0.02),
    ])  # fmt: skip
    assert isinstance(error, ParameterError) and error.name == "Case.duration"
    assert isinstance(good, hp.Trace)


@dataclass(frozen=True)
class Planner:
    """Plans whatever it was given."""

    planned: Any
    settings: Any = None

    def plan(self, robot: hp.Robot, duration: float) -> Any:
        if isinstance(self.planned, Exception):
            raise self.planned
        return self.planned

    def to_dict(self) -> Any:
        return {"kind": "planner"} if self.settings is None else self.settings


def narrow() -> Any:
    """Return a plan of two joints."""
    plan = hp.HoldPosture().plan(ROBOT, 1.0)
    return type(plan)(
        plan.time, plan.q[:, :2], plan.v[:, :2], None, 0.0, 1.0, np.array([1.0, 0.0]), 0.0,
        kind=plan.kind,
    )  # fmt: skip


@pytest.mark.parametrize("planned", [None, "a walk", 1.0, narrow(), ValueError("no plan")])
def test_a_plan_that_is_none_is_refused(planned: Any) -> None:
    with pytest.raises(HexapodError) as caught:
        hp.simulate(SCENE, Planner(planned), duration=0.02)
    error = caught.value
    if isinstance(planned, Exception):
        assert isinstance(error, UserCodeError) and error.call == "Planner.plan"
    else:
        assert isinstance(error, ParameterError) and "Planner.plan" in error.name


@pytest.mark.parametrize(
    "settings", [[], "text", {"gain": None}, {"gain": object()}, {"gait": {"turn_rate": "fast"}},
                 {1: 2.0}, {"gain": np.arange(3)}],
)  # fmt: skip
def test_settings_that_no_file_takes_are_refused_before_the_run(settings: Any) -> None:
    """They ended the run when it was over."""
    plan = hp.HoldPosture().plan(ROBOT, 1.0)
    if settings == {"gait": {"turn_rate": "fast"}}:
        assert hp.simulate(SCENE, Planner(plan, settings), duration=0.02).time[-1] > 0.0
        return
    with pytest.raises(ParameterError) as caught:
        hp.simulate(SCENE, Planner(plan, settings), duration=0.02)
    assert caught.value.name.startswith("Planner.to_dict")


@pytest.mark.parametrize(
    ("name", "value"),
    [("period", "fast"), ("period", None), ("period", True), ("period", 0.0), ("period", np.nan),
     ("delay", "late"), ("delay", [0.0]), ("delay", -1.0), ("gait", "tripod"), ("sensors", 3)],
)  # fmt: skip
def test_attributes_of_a_controller_are_checked(name: str, value: Any) -> None:
    class Odd:
        period, delay, start, update = TICK, 0.0, Sway().start, Sway().update

    controller = Odd()
    setattr(controller, name, value)
    with refused(ParameterError, f"controller.{name}"):
        hp.simulate(SCENE, controller, duration=0.02)
