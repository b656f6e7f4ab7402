"""Inputs at the edges: texts of scenes, cases and studies, late checkpoints, scales of pictures."""

from __future__ import annotations

import copy
import json
import math
import time
import warnings
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
from page_data import PageData
from refusals import ANY, refused
from synthetic import synthetic_trace

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError, StateError
from hexapod_pin.simulation.case_data import case_from_dict
from hexapod_pin.simulation.native_run import samples_before
from hexapod_pin.spec import read_toml

ROBOT = hp.load_robot("kharagpur")
SCENE = hp.Scene(ROBOT)
GAIT = hp.Gait.tripod(stroke=0.03)

# texts ----------------------------------------------------------------------------------------

DROPPED = object()


@cache
def texts() -> dict[str, dict[str, Any]]:
    loads = [hp.Payload("base_link", 1.0), hp.LostLeg("lf", 0.5)]
    stairs = hp.Stairs(rise=0.02, run=0.2, count=3)
    control = hp.FootControl(hp.KinematicControl(GAIT))
    start = hp.simulate(SCENE, control, duration=0.01).checkpoint
    arc = hp.Case(SCENE, hp.motion.ArcWalk(GAIT), ROBOT.stand(), duration=0.02)
    return {
        "scene": hp.Scene(ROBOT, terrain=stairs, loads=loads).to_dict(),
        "walk": read_toml(hp.Case(SCENE, control, start, duration=0.02).to_toml()),
        "arc": read_toml(arc.to_toml()),
    }


def changed(data: Any, path: tuple[Any, ...], value: Any) -> Any:
    data, (key, *rest) = copy.copy(data), path
    if rest:
        data[key] = changed(data[key], tuple(rest), value)
    elif value is DROPPED:
        del data[key]
    else:
        data[key] = value
    return data


@pytest.mark.parametrize(
    ("path", "value", "name"),
    [
        (("gravity",), [0.0, "x", 0.0], "scene.gravity[1]"), (("schema",), 2, "scene.schema"),
        (("robot", "feet"), [[1.0]], "robot.feet[0]"), (("terrain", "kind"), [], "terrain.kind"),
        (("loads",), {}, "scene.loads"), (("loads", 0, "kind"), "anchor", "loads[0].kind"),
        (("loads", 0, "mass"), DROPPED, "loads[0].mass"), (("servo",), DROPPED, "scene.servo"),
        (("gravitation",), [0.0, 0.0, 0.0], "scene.gravitation"),
        (("robot", "foot_radius"), [0.01, 0.02], "robot.foot_radius"),
        (("robot", "foot_radius"), [], "load_robot.foot_radius"),
    ],
)  # fmt: skip
def test_a_scene_names_what_is_wrong(path: tuple[Any, ...], value: Any, name: str) -> None:
    with refused(ParameterError, name):
        hp.Scene.from_toml(tomli_w.dumps(changed(texts()["scene"], path, value)))


@pytest.mark.parametrize(
    ("case", "path", "value", "name"),
    [
        ("arc", ("schema",), "", "case.schema"), ("arc", ("controller",), 3, "controller"),
        ("arc", ("controller", "kind"), 3, "controller.kind"),
        ("arc", ("controller", "gait"), 3, "controller.gait"),
        ("arc", ("controller", "gait"), DROPPED, "controller.gait"),
        ("arc", ("initial", "q"), [[1.0], []], "initial"),
        ("walk", ("initial", "q"), [math.nan], "initial"),
        ("walk", ("initial", "q"), [0.0] * 25, "initial"),
        ("walk", ("run", "duration"), [], "duration"), ("arc", ("run",), 3, "run"),
        ("arc", ("controller",), {"kind": "kinematic", "gait": 3}, "controller.gait"),
        ("arc", ("initial", "v"), DROPPED, "initial"), ("walk", ("initial", "q"), [0.0], "initial"),
    ],
)  # fmt: skip
def test_a_case_names_what_is_wrong(case: str, path: Any, value: Any, name: str) -> None:
    with pytest.raises((ParameterError, StateError)) as caught:
        case_from_dict(hp.Case, changed(texts()[case], path, value))
    assert name in caught.value.name


TEXTS = [
    None, b"schema = 1", "x", "\0", "[" * 100_000, "a = " + "{a=" * 300 + "1" + "}" * 300,
    "a = 1" + "0" * 10_000, "a." * 50_000 + "b = 1",
]  # fmt: skip


@pytest.mark.parametrize("text", TEXTS, ids=lambda text: repr(text)[:12])
def test_what_is_no_text_of_a_scene_is_refused(text: Any) -> None:
    """A key of 50 000 parts took 40 s."""
    begin = time.process_time()
    for read in (hp.Scene.from_toml, hp.Case.from_toml, hp.study.SweepStudy.from_toml):
        with pytest.raises(ParameterError):
            read(text)
    assert time.process_time() - begin < 10.0


# checkpoints ----------------------------------------------------------------------------------


@cache
def stood() -> hp.results.Checkpoint:
    return hp.simulate(SCENE, hp.HoldPosture(), duration=0.01).checkpoint


class Hold:
    """Commands the posture at its ticks, and remembers nothing."""

    period = 0.005

    def start(self, scene: hp.Scene, batch: int) -> None:
        pass

    def update(self, time: float, m: hp.feedback.Measurement, state: Any) -> Any:
        return hp.feedback.Command(np.tile(ROBOT.posture, (len(m.q), 1)), ramp=True), state


@pytest.mark.parametrize("late", [1e17, -1e-3, math.nan, "0"])
def test_no_checkpoint_is_at_such_a_time(late: Any) -> None:
    with refused(ParameterError, "Checkpoint.time", late):
        replace(stood(), time=late)
    with refused(ParameterError, "checkpoint.time"):
        hp.results.Checkpoint.from_dict({**stood().to_dict(), "time": late})


@pytest.mark.parametrize(
    ("controller", "late"),
    [(hp.HoldPosture(), 1e9), (hp.KinematicControl(GAIT), 1e9), (Hold(), 1e12)],
)
def test_a_run_does_not_begin_where_samples_do_not_advance_the_clock(controller, late):
    """It lost its samples, or was called diverged."""
    start = replace(stood(), time=late)
    with refused(ParameterError, "initial.time", late, allowed=(2e8, 0.002)):
        hp.simulate(SCENE, controller, duration=0.02, sample=2e-3, initial=start)
    with refused(ParameterError, "initial.time", late, allowed=(2e8, 0.002)):
        hp.Session(SCENE, initial=start)
    (result,) = hp.simulate_batch([hp.Case(SCENE, controller, start, duration=0.02)])
    assert isinstance(result, ParameterError)


def test_steps_and_ticks_count_too() -> None:
    start = replace(stood(), time=1e6)
    with refused(ParameterError, "initial.time", 1e6, allowed=(1e5, 1e-6)):
        hp.simulate(SCENE, hp.HoldPosture(), duration=0.01, initial=start, method="rk4", step=1e-6)

    class Fast(Hold):
        period = 1e-6

    with refused(ParameterError, "initial.time", 1e6, allowed=(1e5, 1e-6)):
        hp.simulate(SCENE, Fast(), duration=0.01, initial=start)
    with refused(ParameterError, "duration", 1e11, allowed=(1e10, 1.0)):
        hp.simulate(SCENE, hp.HoldPosture(), duration=1e11, sample=1.0, allow=True)
    for count in (0, 1, 7, 10**6, 10**9, 10**11):
        assert samples_before(count * 2e-3, 2e-3) == count
        assert samples_before((count + 0.5) * 2e-3, 2e-3) == count


@pytest.mark.parametrize("controller", [hp.HoldPosture(), Hold()])
def test_late_runs_have_all_their_samples(controller: Any) -> None:
    """A run from 1e8 s on had 50 samples too many, or all but the first too few."""
    start = replace(stood(), time=1e8)
    trace = hp.simulate(SCENE, controller, duration=0.1, sample=2e-3, initial=start)
    assert trace.time - 1e8 == pytest.approx(2e-3 * np.arange(51), abs=1e-6)
    session = hp.Session(SCENE, initial=start, sample=2e-3)
    session.advance(1e8 + 0.1)
    assert len(session.trace().time) == 51


@pytest.mark.parametrize(
    ("until", "name"),
    [(1e17, "until"), (-1.0, "until"), (math.nan, "Session.advance.until")],
)
def test_a_session_does_not_advance_beyond_its_clock(until: Any, name: str) -> None:
    session = hp.Session(SCENE)
    with refused(ParameterError, name, until):
        session.advance(until)
    session.advance(0.002)
    assert session.time == 0.002


def left(**given: Any) -> dict[str, Any]:
    return {"state": None, "measured": 1, "commanded": 0, **given}


@pytest.mark.parametrize(
    ("loop", "name", "value"),
    [
        ([], "Checkpoint.loop", "list"),
        ({"state": None}, "initial.loop.measured", None),
        (left(waiting=[]), "initial.loop.waiting", ANY),
        (left(measured=2, commanded=2, waiting=3), "initial.loop.waiting", "int"),
        (left(measured=3, commanded=2, waiting=[{}]), "initial.loop.waiting[0].q", ()),
        (left(measured=0, waiting=[]), "initial.loop", ANY),
        (left(measured=-1, commanded=-1, waiting=[]), "initial.loop.measured", -1),
        (left(measured=2**70, commanded=2**70, waiting=[]), "initial.loop.measured", 2**70),
    ],
)  # fmt: skip
def test_what_no_loop_has_left_is_refused(loop: Any, name: str, value: Any) -> None:
    with refused(ParameterError, name, value):
        start = replace(stood(), loop=loop)
        hp.simulate(SCENE, Hold(), duration=0.02, initial=start)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("q", np.full(25, np.inf)),
        ("v", 1.0),
        ("contacts", np.zeros((3, 4))),
        ("command", np.zeros((2, 2))),
    ],
)
def test_arrays_of_a_checkpoint_that_fit_no_scene_are_refused(name: str, value: Any) -> None:
    with pytest.raises((ParameterError, StateError)) as caught:
        start = replace(stood(), **{name: value})
        hp.simulate(SCENE, hp.HoldPosture(), duration=0.01, initial=start)
    assert getattr(caught.value, "name", "initial") != "method"


# pictures -------------------------------------------------------------------------------------

WALK = synthetic_trace(duration=1.0)
STILL = synthetic_trace(duration=0.0)


def assert_finite(page: Path) -> None:
    """Every number that the page holds is finite; what is drawn, also in single precision."""
    data = PageData(page.read_text(encoding="utf-8"))

    def number(digits: str) -> float:
        assert np.isfinite(np.float32(digits))
        return float(digits)

    json.dumps(data.plain, allow_nan=False)
    for run in data.runs:
        for name in ("tree", "ground", "reach", "eye", "force_scale"):
            json.loads(json.dumps(run[name]), parse_float=number, parse_constant=number)
    for values in data.arrays:
        assert np.isfinite(values).all()


@pytest.mark.parametrize(
    ("name", "value"),
    [("force_scale", 1e-10), ("speed", 0.0), ("speed", 1e7), ("port", -1), ("port", 70_000),
     ("duration", -1.0), ("duration", 1e300)],
)  # fmt: skip
def test_no_viewer_has_such_a_setting(name: str, value: Any) -> None:
    with refused(ParameterError, name, value):
        hp.view.view(WALK, open_browser=False, **{"duration": 0.0, name: value})


@pytest.mark.parametrize("scale", [1e3, 1e-9])
def test_pages_at_the_ends_of_the_ranges_are_finite(tmp_path: Path, scale: float) -> None:
    page, force = tmp_path / "page.html", np.full_like(WALK.foot_force, 1e150)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for trace in (STILL, replace(WALK, foot_force=force)):
            hp.view.write_html(trace, page, force_scale=scale)
            assert_finite(page)
        hp.view.write_side_by_side({"a": WALK, "b": STILL}, page, force_scale=scale)
        assert_finite(page)
