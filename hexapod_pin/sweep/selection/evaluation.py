"""Candidates simulated on every walk: with their lines first, without them where those act."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from hexapod_pin.errors import HexapodError, SimulationInterrupted
from hexapod_pin.results.motor_selection import MotorCandidate, WalkRun
from hexapod_pin.results.sizing import joint_demand, motor_budget
from hexapod_pin.results.trace import Trace
from hexapod_pin.results.walk_verdict import walk_verdict
from hexapod_pin.simulation.batch import iterate_batch
from hexapod_pin.sweep.selection.kind_use import Uses, kind_use, uses_of
from hexapod_pin.sweep.selection.motor_cases import (
    Motors,
    motor_loads,
    with_motors,
    without_motors,
)
from hexapod_pin.sweep.selection.motor_places import motor_counts

if TYPE_CHECKING:
    from hexapod_pin.drive.derating import Derating
    from hexapod_pin.results.sizing import BatteryLoad, JointDemand
    from hexapod_pin.robot.robot import Robot
    from hexapod_pin.simulation.case import Case

POSTURES = 12
"""Postures of a cycle in which holding torque is looked at."""

LINE_ACTS = 0.999
"""Share of its line from which a motor is taken to have reached it [-]."""

Place = tuple[int, str]
"""Number of a set of motors, and name of a walk."""

Walks = Mapping[str, "Case"]
"""The walks that must be carried, by their names."""


@dataclass
class Evaluation:
    """Runs sets of motors on all walks, and holds their needs against what they may give.

    Attributes:
        walks: the walks, without motors.
        contained: mass of each motor that the robot's file contains [kg].
        derating: what motors may be asked for.
        threads: as of `simulate_batch`.
        interrupted: whether Ctrl-C ended the runs.
    """

    walks: Walks
    contained: float
    derating: Derating
    threads: int = 2
    interrupted: bool = False

    @property
    def robot(self) -> Robot:
        """The robot that walks."""
        return next(iter(self.walks.values())).scene.robot

    def of(
        self, candidates: Sequence[Motors], progress: Callable[[float], None] | None = None
    ) -> list[MotorCandidate]:
        """Return what each set of motors comes to; after Ctrl-C, of those that were done.

        Args:
            candidates: a motor for each kind of joint, each.
            progress: called with the finished fraction (0..1).
        """
        budgets: dict[Place, tuple[Uses, BatteryLoad]] = {}

        def take(place: Place, trace: Trace) -> None:
            motors = candidates[place[0]]
            demand = joint_demand(trace, postures=POSTURES)
            budget = motor_budget(demand, motors, self.derating)
            budgets[place] = uses_of(budget), budget.battery

        loads = [motor_loads(self.robot, motors, self.contained) for motors in candidates]
        runs = self._simulate(candidates, loads, take, progress)
        done = [k for k in range(len(candidates)) if all((k, w) in runs for w in self.walks)]
        return [
            self._candidate(
                candidates[k], loads[k][1], {w: runs[k, w] for w in self.walks},
                {w: budgets[k, w] for w in self.walks if (k, w) in budgets},
            )
            for k in done
        ]  # fmt: skip

    def demands(self, motors: Motors | None) -> dict[str, JointDemand]:
        """Return what the joints need on each walk with motors' masses and rotors.

        Args:
            motors: of each kind of joint; None: the robot as its file says. Walks that cannot be
                simulated are left out.
        """
        found: dict[str, JointDemand] = {}
        if motors is None:
            cases = [without_motors(case) for case in self.walks.values()]
        else:
            loads, _ = motor_loads(self.robot, motors, self.contained)
            voltage = self.derating.voltage
            cases = [
                with_motors(case, motors, loads, voltage, line=False)
                for case in self.walks.values()
            ]
        names = list(self.walks)
        for index, result in iterate_batch(cases, threads=self.threads):
            if isinstance(result, Trace):
                found[names[index]] = joint_demand(result, postures=POSTURES)
        return found

    def _simulate(
        self,
        candidates: Sequence[Motors],
        loads: Sequence[Any],
        take: Callable[[Place, Trace], None],
        progress: Callable[[float], None] | None,
    ) -> dict[Place, WalkRun]:
        """Run all with their lines; where a line acts, again without, for what is asked for."""
        runs: dict[Place, WalkRun] = {}
        again: list[Place] = []
        places = [(k, name) for k in range(len(candidates)) for name in self.walks]
        try:
            for line in (True, False):
                chosen = places if line else again
                for place, result in self._results(candidates, loads, chosen, line, progress):
                    if line:
                        runs[place] = _walk_run(place[1], result)
                    if line and not (isinstance(result, Trace) and not _line_acts(result)):
                        again.append(place)
                    elif isinstance(result, Trace):
                        take(place, result)
        except (KeyboardInterrupt, SimulationInterrupted):
            self.interrupted = True
        return runs

    def _results(
        self,
        candidates: Sequence[Motors],
        loads: Sequence[Any],
        places: Sequence[Place],
        line: bool,
        progress: Callable[[float], None] | None,
    ) -> Iterator[tuple[Place, Any]]:
        cases = [
            with_motors(self.walks[name], candidates[k], loads[k][0], self.derating.voltage,
                        line=line)
            for k, name in places
        ]  # fmt: skip
        runs = iterate_batch(cases, threads=self.threads)
        for done, (index, result) in enumerate(runs, start=1):
            yield places[index], result
            if progress is not None:
                progress((0.0 if line else 0.5) + 0.5 * done / len(cases))

    def _candidate(
        self,
        motors: Motors,
        notes: tuple[str, ...],
        runs: Mapping[str, WalkRun],
        budgets: Mapping[str, tuple[Uses, BatteryLoad]],
    ) -> MotorCandidate:
        count = motor_counts(self.robot)
        mass = sum(count[kind] * float(record.mass or 0.0) for kind, record in motors.items())
        prices = [None if m.price is None else count[k] * m.price for k, m in motors.items()]
        known = [price for price in prices if price is not None]
        battery = [load for _, load in budgets.values()]
        uses = {walk: found for walk, (found, _) in budgets.items()}
        return MotorCandidate(
            motors=dict(motors),
            robot_mass=self.robot.total_mass + mass - sum(count.values()) * self.contained,
            motor_mass=mass,
            uses=tuple(kind_use(kind, uses, tuple(self.walks)) for kind in motors),
            runs=tuple(runs.values()),
            notes=notes,
            battery_peak=_largest([b.peak_current for b in battery]),
            battery_mean=_largest([b.mean_current for b in battery]),
            price=sum(known) if len(known) == len(prices) else None,
        )


def _largest(values: Sequence[float | None]) -> float:
    """Return the largest number; NaN where one is not known, or there is none."""
    known = [value for value in values if value is not None]
    return max(known) if known and len(known) == len(values) else math.nan


def _line_acts(trace: Trace) -> bool:
    """Tell whether any motor reached its line: then the run is not what the walk asks for."""
    use = trace.summary.limit_use
    return bool(float(max(use)) >= LINE_ACTS)


def _walk_run(name: str, result: Any) -> WalkRun:
    if isinstance(result, Trace):
        verdict = walk_verdict(result)
        text = verdict.line if verdict.walks else verdict.reason
        return WalkRun(name, verdict.walks, text)
    kind = "refused" if isinstance(result, HexapodError) else type(result).__name__
    return WalkRun(name, False, f"{kind}: {str(result).splitlines()[0]}")
