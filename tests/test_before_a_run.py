"""What is asked of a controller before a run is checked, and costs no other run."""

from __future__ import annotations

from dataclasses import dataclass, replace
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

    def broken(self, name: str, odd: Any, good: Any) -> Any:
        if self.wrong == name:
            raise RuntimeError(name)
        return odd if self.wrong == f"odd {name}" else good

    def to_dict(self) -> dict[str, Any]:
        return self.broken("to_dict", {}, {**super().to_dict(), "wrong": self.wrong})

    def start_key(self, scene: hp.Scene) -> Any:
        return self.broken("start_key", [], 0)

    def start(self, scene: hp.Scene, batch: int) -> Any:
        return self.broken("start", object(), super().start(scene, batch))

    def posture(self, scene: hp.Scene) -> Any:
        return self.broken("posture", [0.0], scene.robot.posture)


@pytest.mark.parametrize(
    "wrong",
    ["to_dict", "start_key", "odd start_key", "start", "odd start", "posture", "odd posture"],
)
def test_what_is_called_before_a_run_ends_no_other(wrong: str) -> None:
    cases = [hp.Case(SCENE, OddKey(wrong=word), duration=0.02) for word in ("", wrong, "")]
    one, error, other = hp.simulate_batch(cases)
    assert isinstance(one, hp.Trace) and isinstance(other, hp.Trace)
    assert isinstance(error, HexapodError) and error.trace is None
    if not wrong.startswith("odd"):
        assert isinstance(error, UserCodeError) and error.call == f"OddKey.{wrong}"


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
    plan = hp.HoldPosture().plan(ROBOT, 1.0)
    return replace(plan, q=plan.q[:, :2], v=plan.v[:, :2])


@pytest.mark.parametrize("planned", [None, narrow(), ValueError("no plan")])
def test_a_plan_that_is_none_is_refused(planned: Any) -> None:
    with pytest.raises(HexapodError) as caught:
        hp.simulate(SCENE, Planner(planned), duration=0.02)
    error = caught.value
    if isinstance(planned, Exception):
        assert isinstance(error, UserCodeError) and error.call == "Planner.plan"
    else:
        assert isinstance(error, ParameterError) and "Planner.plan" in error.name


@pytest.mark.parametrize("settings", [[], {"gain": None}, {1: 2.0}, {"gain": np.arange(3)}])
def test_settings_that_no_file_takes_are_refused_before_the_run(settings: Any) -> None:
    with pytest.raises(ParameterError) as caught:
        hp.simulate(SCENE, Planner(hp.HoldPosture().plan(ROBOT, 1.0), settings), duration=0.02)
    assert caught.value.name.startswith("Planner.to_dict")


@pytest.mark.parametrize(
    ("name", "value"),
    [("period", None), ("period", 1e-9), ("delay", -1.0), ("gait", "tripod"), ("sensors", 3)],
)
def test_attributes_of_a_controller_are_checked(name: str, value: Any) -> None:
    class Odd:
        period, delay, start, update = TICK, 0.0, Sway().start, Sway().update

    controller = Odd()
    setattr(controller, name, value)
    with refused(ParameterError, f"controller.{name}"):
        hp.simulate(SCENE, controller, duration=0.02)
