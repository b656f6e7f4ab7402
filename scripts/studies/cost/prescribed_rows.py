"""One walk with servos and with prescribed motion at one accuracy: times, evaluations, errors."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.simulation.open_loop import open_loop_run
from studies.cost.prescribed_torque import CYCLE, walk_of
from studies.cost.timing import Quartiles, interleaved

MAX_COST_RATIO = 0.7
"""Target: prescribed motion over servos at the same accuracy."""

TIGHTER = 0.01
"""Accuracy of the runs that errors are against, of the accuracy asked for."""

HEAD = (
    "robot", "contact", "walk", "method", "sample [ms]",
    "servo, prescribed [ms]", "ratio", "evaluations", "ratio", "whole call [ms]", "ratio",
    "error of the base [m]", "of torque RMS [%]", "of torque RMS [mN m]", "at most 0.7",
)  # fmt: skip


@dataclass(frozen=True)
class CostRow:
    """Servos and prescribed motion at one accuracy; pairs are (servo, prescribed).

    Attributes:
        scene: robot, contact, walk.
        method: by name.
        accuracy: asked for [m, rad].
        sample: [s].
        core: medians of the times in the core [s].
        core_ratio: median of the ratios, prescribed over servo, of each round.
        call: medians of the times of `hp.simulate`, planning included [s].
        call_ratio: as `core_ratio`.
        evaluations: of the equations of motion.
        base: largest distance of the base from the tighter run [m].
        rms: largest relative difference of a joint's torque RMS from the tighter run [-].
        torque: largest difference of a joint's torque RMS from the tighter run [N m].
    """

    scene: tuple[str, str, str]
    method: str
    accuracy: float
    sample: float
    core: tuple[float, float]
    core_ratio: float
    call: tuple[float, float]
    call_ratio: float
    evaluations: tuple[int, int]
    base: tuple[float, float]
    rms: tuple[float, float]
    torque: tuple[float, float]

    @property
    def met(self) -> bool:
        """Whether integration is cheap enough."""
        return self.core_ratio <= MAX_COST_RATIO

    def cells(self) -> list[str]:
        """Return its line."""
        evaluations = self.evaluations[1] / self.evaluations[0]
        return [
            *self.scene, f"{self.method} {self.accuracy:.0e}", f"{1e3 * self.sample:g}",
            _pair(self.core, 1e3, ".1f"), f"{self.core_ratio:.2f}",
            _pair(self.evaluations, 1, "d"), f"{evaluations:.2f}",
            _pair(self.call, 1e3, ".1f"), f"{self.call_ratio:.2f}",
            _pair(self.base, 1.0, ".1e"), _pair(self.rms, 100.0, ".2g"),
            _pair(self.torque, 1e3, ".2g"),
            "pass" if self.met else "FAIL",
        ]  # fmt: skip


def _pair(values: tuple[float, float], factor: float, form: str) -> str:
    return ", ".join(f"{factor * value:{form}}" for value in values)


def measure(
    scene: tuple[str, str, str], how: dict[str, Any], sample: float, cycles: int, rounds: int
) -> CostRow:
    """Time one walk in both ways, and compare each with a run at a hundredth of its accuracy."""
    pair = [_case(scene, on, cycles, sample=sample, **how) for on in (False, True)]
    exact = {"method": "ndf", "accuracy": TIGHTER * how["accuracy"]}
    tight = [_case(scene, on, cycles, sample=sample, **exact).run() for on in (False, True)]
    found = [case.run() for case in pair]
    subjects = {f"{kind} {k}": kind_of(pair[k]) for kind, kind_of in TIMES.items() for k in (0, 1)}
    times = interleaved(subjects, rounds)
    errors = [_errors(a, b) for a, b in zip(found, tight, strict=True)]
    spent = {name: Quartiles.of(values).median for name, values in times.items()}
    ratios = [Quartiles.of(times[f"{k} 1"] / times[f"{k} 0"]).median for k in TIMES]
    return CostRow(
        scene=scene,
        method=pair[0].settings.method_settings.method.name,
        accuracy=how["accuracy"],
        sample=sample,
        core=(spent["core 0"], spent["core 1"]),
        core_ratio=ratios[0],
        call=(spent["call 0"], spent["call 1"]),
        call_ratio=ratios[1],
        evaluations=(
            int(found[0].counters["evaluations"]),
            int(found[1].counters["evaluations"]),
        ),
        base=(errors[0][0], errors[1][0]),
        rms=(errors[0][1], errors[1][1]),
        torque=(errors[0][2], errors[1][2]),
    )


def _errors(found: hp.Trace, tight: hp.Trace) -> tuple[float, float, float]:
    """Return distance of the base [m] and differences of a joint's torque RMS [-, N m], largest."""
    distance = np.linalg.norm(found.q[:, :3] - tight.q[:, :3], axis=1).max()
    change, exact = np.abs(_rms(found) - _rms(tight)), _rms(tight)
    return float(distance), float((change / exact).max()), float(change.max())


def _case(scene: tuple[str, str, str], prescribed: bool, cycles: int, **how: Any) -> hp.Case:
    robot, contact, walk = scene
    laws = hp.Contact.preset(contact)
    built = hp.Scene(hp.load_robot(robot), contact=laws, prescribed=prescribed)
    return hp.Case(built, walk_of(robot, walk), duration=cycles * CYCLE, **how)


def _rms(trace: hp.Trace) -> Array:
    """Return the RMS torque of every joint over the samples behind the first cycle [N m]."""
    torque = trace.torque[trace.time > CYCLE]
    found: Array = np.sqrt((torque**2).mean(axis=0))
    return found


def _core(case: hp.Case) -> Callable[[], float]:
    def run() -> float:
        under_way = open_loop_run(case, case.settings)
        under_way.advance()
        return under_way.wall_time

    return run


def _call(case: hp.Case) -> Callable[[], float]:
    def run() -> float:
        begin = time.perf_counter()
        case.run()
        return time.perf_counter() - begin

    return run


TIMES: dict[str, Callable[[hp.Case], Callable[[], float]]] = {"core": _core, "call": _call}
