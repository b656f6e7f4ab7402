"""Every study of the runner on short walks, as text of all its bits; and how one is killed."""

from __future__ import annotations

import json
import os
import signal
from collections.abc import Callable
from dataclasses import fields
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import hexapod_pin as hp
from hexapod_pin.control.foot_control import named_controls
from hexapod_pin.study import random_bumps
from hexapod_pin.study.judge_peaks import servo_stiffness
from hexapod_pin.study.runs.store import Store
from hexapod_pin.study.runs.store_schema import write_rows
from tests.sweep_studies import small_study

GAIT = hp.Gait.tripod(stroke=0.04, cycle_time=0.3)
FAST = GAIT.model_copy(update={"stroke": 0.05})
SHORT: dict[str, Any] = {"duration": 0.9, "accuracy": 1e-2}
ROBUST: dict[str, Any] = {"duration": 0.04, "method": "robust", "step": 2e-3}

MOTORS = """
schema = 1
[base]
robot = "kharagpur"
gait = {name = "tripod", cycle_time = 0.4, stroke = 0.04}
method = "robust"
step = 2e-3
duration = 1.2
[motors]
voltage = 12.0
models = ["XM430-W350", "XM540-W270"]
[[vary]]
input = "mu"
distribution = "uniform"
low = 0.6
high = 0.7
[design]
kind = "random"
samples = 2
seed = 3
"""


@cache
def scene() -> hp.Scene:
    return hp.Scene(hp.load_robot("kharagpur"))


def compared(**how: Any) -> str:
    walks = {
        "plain": hp.KinematicControl(GAIT),
        "fast": hp.KinematicControl(FAST),
        "far": hp.HoldPosture([9.0] * 18),
    }
    bumps = random_bumps(scene(), [1], amplitude=0.005, wavelength=0.3, length=0.4)
    steps = {**ROBUST, "duration": 0.9}
    return _comparison(hp.compare({"flat": scene(), "bumps": bumps}, walks, **steps, **how))


def in_lock_step(**how: Any) -> str:
    """Foot control over grounds: a resumed group has other members."""
    bumps = random_bumps(scene(), range(4), amplitude=0.005, wavelength=0.3, length=0.4)
    walks = named_controls(hp.KinematicControl(GAIT), ["slip"])
    return _comparison(hp.compare({"bumps": bumps}, walks, duration=0.3, step=2e-3, **how))


def _comparison(found: hp.study.Comparison) -> str:
    runs = [
        [run.to_dict(), None if run.summary is None else run.summary.data] for run in found.runs
    ]
    return json.dumps([runs, found.table()])


def judged(**how: Any) -> str:
    found = hp.study.judge_peaks(hp.Case(scene(), hp.KinematicControl(GAIT), **SHORT), **how)
    return json.dumps(found.to_dict())


@cache
def _walk() -> tuple[hp.Case, hp.Trace]:
    case = hp.Case(scene(), hp.KinematicControl(GAIT), **SHORT)
    return case, case.run()


def stiffness(**how: Any) -> str:
    return repr(servo_stiffness(*_walk(), **how))


def mapped(**how: Any) -> str:
    """A map with two points that are too fast to be walked, and a repeat."""
    found = hp.torque_map(
        scene(), "straight", gait=GAIT, strokes=[0.03, 0.05], cycle_times=[0.02, 0.4],
        accuracy=1e-2, check=1, **how,
    )  # fmt: skip
    return _grid(found)


def costed(**how: Any) -> str:
    gaits = {"tripod": hp.Gait.tripod(), "ripple": hp.Gait.ripple()}
    return _grid(
        hp.study.gait_energy(
            scene(), gaits, [0.1, 0.15], stroke=0.04, accuracy=1e-2, check=1, **how
        )
    )


def _grid(found: Any) -> str:
    texts = {}
    for one in fields(found):
        value = getattr(found, one.name)
        texts[one.name] = value.tobytes().hex() if _plain(value) else repr(value)
    change = None if found.check is None else found.check.change.tobytes().hex()
    return json.dumps([texts | {"check": change}, found.reason.tolist()])


def _plain(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.dtype != object


def tuned(**how: Any) -> str:
    def crouch(values: Any) -> hp.HoldPosture:
        q = np.array(scene().robot.posture)
        q[1::3] += values["angle"]
        return hp.HoldPosture(q)

    found = hp.tune(
        crouch, {"angle": 0.0}, {"angle": (-0.2, 0.2)}, {"flat": scene()},
        lambda found, baseline: (found[0].height_mean - baseline[0].height_mean + 5e-3) ** 2,
        held_out={"heavy": hp.Scene(scene().robot, gravity=(0.0, 0.0, -12.0))}, seed=3, budget=10,
        population=5, **ROBUST, **how,
    )  # fmt: skip
    return json.dumps(found.data)


def selected(**how: Any) -> str:
    return json.dumps(hp.select_motors(MOTORS, **how).to_dict())


def swept(**how: Any) -> str:
    store = how.pop("store", None)
    if store is None:
        store = Path(os.devnull)
    found = hp.run_sweep(small_study(1), store, **how)
    data = found.dataset
    return json.dumps({str(name): _bits(data[name].values) for name in sorted(data.variables)})


def _bits(values: Any) -> str:
    return values.tobytes().hex() if values.dtype != object else str(values.tolist())


STUDIES: dict[str, Callable[..., str]] = {
    one.__name__: one
    for one in (compared, in_lock_step, judged, stiffness, mapped, costed, tuned, selected, swept)
}
"""By their names; each takes the options of `run_study`."""


def kill(name: str, store: str, after: int, inside: bool) -> None:
    """Run a study and SIGKILL this process after some writes to the store, or inside the next."""
    write, count = Store._write, 0

    def killing(self: Store, rows: Any) -> None:
        nonlocal count
        if inside and count == after:
            self.connection.execute("BEGIN IMMEDIATE")
            write_rows(self.connection, rows, dict(self.texts))
            os.kill(os.getpid(), signal.SIGKILL)
        write(self, rows)
        count += 1
        if count == after and not inside:
            os.kill(os.getpid(), signal.SIGKILL)

    Store._write = killing  # type: ignore[method-assign]
    STUDIES[name](store=store, resume=True, threads=2)
