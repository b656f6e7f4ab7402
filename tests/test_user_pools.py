"""Code of a user's own in a user's own pool: data and errors go both ways, to the bit."""

from __future__ import annotations

import copy
import multiprocessing
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hexapod_pin as hp
from hexapod_pin.errors import HexapodError
from tests.same_content import differences, error_types, one_of

PATIENCE = 120.0
"""Longest wait for a worker [s]."""

SETTINGS: dict[str, Any] = {"duration": 0.2, "accuracy": 1e-3}


# ---- what a user's code may be -------------------------------------------------------------------


def given_back(thing: Any) -> Any:
    """The thing itself, which has been pickled twice when it is back."""
    return thing


def walked(scene: hp.Scene) -> tuple[hp.Robot, hp.Scene, hp.Case, hp.Trace, hp.Summary]:
    """A short walk on a scene, and what it is made of."""
    gait = hp.Gait.tripod(stroke=0.04, cycle_time=0.3)
    case = hp.Case(scene, hp.KinematicControl(gait), **SETTINGS)
    trace = case.run()
    return scene.robot, scene, case, trace, trace.summary


def used(robot: hp.Robot, scene: hp.Scene, case: hp.Case, trace: hp.Trace) -> dict[str, Any]:
    """Something that needs all of what was sent."""
    rest = hp.simulate(case.scene, case.controller, duration=0.3, initial=trace.checkpoint)
    return {
        "standing": robot.stand(trace.q[-1, 7:]),
        "mass": scene.total_mass,
        "again": case.run().digest,
        "rest": rest,
        "stability": hp.stability(trace, whole=True),
    }


class Breaks:
    """A controller that raises after some ticks."""

    period = 0.01

    def start(self, scene: hp.Scene, batch: int) -> None:
        """Nothing to remember."""

    def update(
        self, time: float, m: hp.feedback.Measurement, state: None
    ) -> tuple[hp.feedback.Command, None]:
        """Hold the angles, then fail."""
        if time > 0.055:
            raise ZeroDivisionError("a gain")
        return hp.feedback.Command(m.q), None


def failed(name: str, robot: hp.Robot, folder: Path) -> Any:
    """What a public call raises."""
    scene, still = hp.Scene(robot), hp.HoldPosture()
    loose = hp.Scene(robot, servo=hp.Servo(kp=1e7, kd=0.0, limited=False))
    broken, limits = folder / "broken.urdf", hp.simulation.WorkLimits(evaluations=300)
    calls: dict[str, Callable[[], Any]] = {
        "UnknownNameError": lambda: hp.load_robot("nope"),
        "UrdfError": lambda: hp.load_robot(broken),
        "ParameterError": lambda: hp.Flat(height="high"),
        "StateError": lambda: robot.check_state(np.zeros(3), np.zeros(3)),
        "GaitError": lambda: hp.KinematicControl(hp.Gait.tetrapod(cycle_time=0.3)).plan(robot, 1.0),
        "TraceFileError": lambda: hp.load_trace(broken),
        "NotRecordedError": lambda: (
            hp.simulate(scene, still, duration=0.01, record=["motion"]).torque
        ),
        "NotPicklableError": lambda: copy.copy(hp.Session(scene)),
        "DivergenceError": lambda: hp.simulate(
            loose, hp.HoldPosture([0.05] * 18), duration=0.5, method="rk4", step=5e-3
        ),
        "WorkLimitError": lambda: hp.simulate(
            scene, still, duration=2.0, accuracy=1e-7, estimate=False, limits=limits
        ),
        "UserCodeError": lambda: hp.simulate(scene, Breaks(), duration=0.1, accuracy=1e-3),
    }
    return calls[name]()


FAILURES = (
    "UnknownNameError", "UrdfError", "ParameterError", "StateError", "GaitError", "TraceFileError",
    "NotRecordedError", "NotPicklableError", "DivergenceError", "WorkLimitError", "UserCodeError",
)  # fmt: skip
WITH_TRACE = ("DivergenceError", "WorkLimitError", "UserCodeError")


def raised(name: str) -> None:
    """An error of the package, whichever."""
    raise next(one_of(kind) for kind in error_types() if kind.__name__ == name)


# ---- pools ---------------------------------------------------------------------------------------


@pytest.fixture(scope="module", params=["processes", "dask"])
def pool(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Executor]:
    """An executor with one worker process: Python's own, begun afresh, or that of a Dask client."""
    if request.param == "processes":
        fresh = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(1, mp_context=fresh) as processes:
            yield processes
        return
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        processes=True, n_workers=1, threads_per_worker=1, dashboard_address="127.0.0.1:0",
        host="127.0.0.1", local_directory=str(tmp_path_factory.mktemp("dask")),
    ) as cluster, distributed.Client(cluster, set_as_default=False) as client:  # fmt: skip
        yield client.get_executor()


@pytest.fixture(scope="module")
def scene() -> hp.Scene:
    """A scene whose parts are not all the default."""
    robot = hp.load_robot("kharagpur")
    hills = hp.HeightField.random(3, amplitude=5e-3)
    return hp.Scene(robot, terrain=hills, loads=[hp.Payload("base_link", mass=0.3)])


@pytest.fixture(scope="module")
def here(scene: hp.Scene) -> tuple[Any, ...]:
    """The walk in this process."""
    return walked(scene)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a file that is no robot."""
    (tmp_path / "broken.urdf").write_text("<robot name='a'><link name='b'/></robot>")
    return tmp_path


def test_data_goes_both_ways(pool: Executor, here: tuple[Any, ...]) -> None:
    """Robot, Scene, Case, Trace and Summary: sent and given back, every bit."""
    back = pool.submit(given_back, here).result(PATIENCE)
    assert not list(differences(here, back))
    assert back[1:] == here[1:] and back[3].digest == here[3].digest


def test_a_worker_computes_the_same_bits(
    pool: Executor, scene: hp.Scene, here: tuple[Any, ...]
) -> None:
    there = pool.submit(walked, scene).result(PATIENCE)
    robot, _, case, trace, summary = there
    assert there[1:4] == here[1:4] and summary.data == here[4].data  # wall times differ
    assert robot.digest == scene.robot.digest and hp.load_case(trace) == case
    wanted, found = used(*here[:4]), pool.submit(used, *there[:4]).result(PATIENCE)
    assert found["rest"].digest == wanted["rest"].digest
    assert not list(differences({**wanted, "rest": None}, {**found, "rest": None}))


@pytest.mark.parametrize("name", FAILURES)
def test_errors_of_a_worker_arrive_as_themselves(
    pool: Executor, name: str, scene: hp.Scene, folder: Path
) -> None:
    with pytest.raises(HexapodError) as alone:
        failed(name, scene.robot, folder)
    with pytest.raises(HexapodError) as there:
        pool.submit(failed, name, scene.robot, folder).result(PATIENCE)
    error, again = alone.value, there.value
    assert type(again) is type(error) and type(again).__name__ == name
    assert str(again) == str(error)
    attributes, found = ({**vars(one), "trace": None} for one in (error, again))
    assert not list(differences(attributes, {key: found[key] for key in attributes}))
    assert (again.trace is not None) == (name in WITH_TRACE)
    if name in WITH_TRACE:
        assert len(again.trace.time) >= 2 and again.trace.digest == error.trace.digest


def test_every_type_of_error_arrives_as_itself(pool: Executor) -> None:
    """And goes there as an argument."""
    errors = list(map(one_of, error_types()))
    back = pool.submit(given_back, errors).result(PATIENCE)
    names = [type(error).__name__ for error in errors]
    there = [one.exception(PATIENCE) for one in [pool.submit(raised, name) for name in names]]
    for error, *found in zip(errors, back, there, strict=True):
        for again in found:
            assert type(again) is type(error) and str(again) == str(error)
            held = {key: vars(again).get(key) for key in vars(error)}
            assert not list(differences(vars(error), held))


SCRIPT = """
import multiprocessing, sys
from concurrent.futures import ProcessPoolExecutor
import hexapod_pin as hp
from tests.test_user_pools import PATIENCE, given_back, walked

scene = hp.Scene(hp.load_robot("kharagpur"))
fork = multiprocessing.get_context("fork")
with ProcessPoolExecutor(1, mp_context=fork) as pool:
    there = pool.submit(walked, scene).result(PATIENCE)
    assert pool.submit(given_back, there).result(PATIENCE)[1:] == there[1:]
    try:
        pool.submit(hp.load_robot, "nope").result(PATIENCE)
    except hp.errors.UnknownNameError as error:
        assert error.name == "nope"
assert there[1:4] == walked(scene)[1:4]
"""


@pytest.mark.slow
@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="no fork")
def test_a_pool_of_forked_processes() -> None:
    """In a program of its own: threads of other tests do not survive a fork."""
    command = [sys.executable, "-c", SCRIPT]
    root = Path(__file__).resolve().parents[1]
    done = subprocess.run(
        command, cwd=root, capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
