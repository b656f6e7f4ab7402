"""Candidate motors are simulated on every walk, and the lightest one is found per kind of joint."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.drive.catalog import MotorRecord
from hexapod_pin.drive.catalog.motor_record import Derating
from hexapod_pin.errors import HexapodError
from hexapod_pin.results.joint_budget import joint_kinds
from hexapod_pin.results.motor_candidate import USES, KindUse, MotorCandidate, WalkRun
from hexapod_pin.results.sizing import JointDemand, MotorUse, joint_demand, motor_budget
from hexapod_pin.results.sizing.battery import BatteryLoad
from hexapod_pin.results.sizing.winding import lasting_torque_of
from hexapod_pin.results.summary import Summary
from hexapod_pin.results.summary_verdict import summary_verdict
from hexapod_pin.results.trace import Trace
from hexapod_pin.results.walk_verdict import walk_verdict
from hexapod_pin.study.runs.measure import Measure
from hexapod_pin.study.runs.outcome import standing_width
from hexapod_pin.study.runs.runner import Runner
from hexapod_pin.study.selection.motor_cases import (
    Motors,
    motor_counts,
    motor_loads,
    with_motors,
    without_motors,
)

if TYPE_CHECKING:
    from hexapod_pin.results.sizing import MotorBudget
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


@dataclass(frozen=True)
class WalkUse:
    """What a walk takes of its motors.

    Attributes:
        walks: whether the robot does what was planned, on its feet.
        text: the verdict in one line.
        uses: of each kind of joint; None where a motor reached its line: then the run is not what
            the walk asks for.
        battery: what all motors draw; None likewise.
    """

    walks: bool
    text: str
    uses: dict[str, MotorUse] | None
    battery: BatteryLoad | None


def _walk_use(
    case: Case, trace: Trace, motors: Mapping[str, Any], derating: Mapping[str, Any]
) -> WalkUse:
    """Return what a walk takes of motors, given as plain data."""
    verdict = walk_verdict(trace)
    text = verdict.line if verdict.walks else verdict.reason
    if float(max(trace.summary.limit_use)) >= LINE_ACTS:
        return WalkUse(verdict.walks, text, None, None)
    budget = motor_budget(_demand(case, trace), *_given(motors, derating))
    return WalkUse(verdict.walks, text, dict(uses_of(budget)), budget.battery)


def _demand(case: Case, trace: Trace) -> JointDemand:
    return joint_demand(trace, postures=POSTURES)


def _largest_use(
    case: Case, summary: Summary, motors: Mapping[str, Any], derating: Mapping[str, Any]
) -> float:
    """Return the largest use of any motor; NaN of a robot that does not walk."""
    if not summary_verdict(summary, standing_width(case)).walks:
        return math.nan
    records, allowed = _given(motors, derating)
    kinds = joint_kinds(summary.joint_names, len(summary.foot_names), summary.run.robot.joint_kinds)
    peak = np.asarray(summary.limit_use) / allowed.peak
    found = []
    for j, kind in enumerate(kinds):
        if kind in records:
            lasting = lasting_torque_of(records[kind], allowed)
            found += [float(peak[j]), float(summary.torque_rms[j]) / lasting]
    return max(found)


def _given(
    motors: Mapping[str, Any], derating: Mapping[str, Any]
) -> tuple[dict[str, MotorRecord], Derating]:
    """Return motors and derating from plain data."""
    return {kind: MotorRecord(**data) for kind, data in motors.items()}, Derating(**derating)


def motor_settings(motors: Motors, derating: Derating) -> dict[str, Any]:
    """Return motors and derating as plain data."""
    plain = {kind: record.model_dump() for kind, record in motors.items()}
    return {"motors": plain, "derating": derating.model_dump()}


_HERE = "hexapod_pin.study.selection.evaluation"

WALK_USE = Measure(f"{_HERE}:WALK_USE", 2, "trace", WalkUse, _walk_use, (MotorUse, BatteryLoad))
"""What a walk takes of its motors; `motor_settings` are its settings."""

JOINT_DEMAND = Measure(f"{_HERE}:JOINT_DEMAND", 1, "trace", JointDemand, _demand)
"""What the joints need on a walk."""

LARGEST_USE = Measure(f"{_HERE}:LARGEST_USE", 2, "summary", float, _largest_use)
"""The largest use of any motor, of accepted steps; settings as of `WALK_USE`."""


@dataclass
class Evaluation:
    """Runs sets of motors on all walks, and holds their needs against what they may give.

    Attributes:
        walks: the walks, without motors.
        contained: mass of each motor that the robot's file contains [kg].
        derating: the fraction of their limits that may be used.
        run: runs the walks.
    """

    walks: Walks
    contained: float
    derating: Derating
    run: Runner = field(default_factory=Runner)

    @property
    def robot(self) -> Robot:
        """The robot that walks."""
        return next(iter(self.walks.values())).scene.robot

    def of(self, candidates: Sequence[Motors], *, report: bool = False) -> list[MotorCandidate]:
        """Return what each set of motors comes to; after Ctrl-C, of those that were done.

        All run with their lines; where a line acts, again without it, for what the walk requires.

        Args:
            candidates: a motor for each kind of joint, each.
            report: whether the runner reports its progress.
        """
        loads = [motor_loads(self.robot, motors, self.contained) for motors in candidates]
        places = [(k, name) for k in range(len(candidates)) for name in self.walks]
        spans = ((0.0, 0.5), (0.5, 1.0)) if report else (None, None)
        first = self._uses(candidates, loads, places, line=True, span=spans[0])
        again = [
            place for place, row in first.items()
            if isinstance(row, Exception) or row.uses is None
        ]  # fmt: skip
        second = self._uses(candidates, loads, again, line=False, span=spans[1])
        budgets = {
            place: (row.uses, row.battery)
            for place, row in {**first, **second}.items()
            if isinstance(row, WalkUse) and row.uses is not None and row.battery is not None
        }
        done = [k for k in range(len(candidates)) if all((k, w) in first for w in self.walks)]
        return [
            self._candidate(
                candidates[k], loads[k][1], {w: _walk_run(w, first[k, w]) for w in self.walks},
                {w: budgets[k, w] for w in self.walks if (k, w) in budgets},
            )
            for k in done
        ]  # fmt: skip

    def demands(self, motors: Motors | None) -> dict[str, JointDemand]:
        """Return what the joints need on each walk with motors' masses and rotors.

        Args:
            motors: of each kind of joint; None: the robot as in its file. Walks that cannot be
                simulated are left out.
        """
        if motors is None:
            cases = [without_motors(case) for case in self.walks.values()]
        else:
            loads, _ = motor_loads(self.robot, motors, self.contained)
            voltage = self.derating.voltage
            cases = [
                with_motors(case, motors, loads, voltage, line=False)
                for case in self.walks.values()
            ]
        rows = self.run.rows(cases, JOINT_DEMAND, span=None)
        pairs = zip(self.walks, rows, strict=True)
        return {name: row for name, row in pairs if isinstance(row, JointDemand)}

    def _uses(
        self,
        candidates: Sequence[Motors],
        loads: Sequence[Any],
        places: Sequence[Place],
        *,
        line: bool,
        span: tuple[float, float] | None,
    ) -> dict[Place, WalkUse | Exception]:
        """Return what walks take of motors; of those that were run."""
        cases = [
            with_motors(self.walks[name], candidates[k], loads[k][0], self.derating.voltage,
                        line=line)
            for k, name in places
        ]  # fmt: skip
        settings = [motor_settings(motors, self.derating) for motors in candidates]
        measures = [WALK_USE.with_settings(**settings[k]) for k, _ in places]
        rows = self.run.rows(cases, measures, span=span)
        return {p: row for p, row in zip(places, rows, strict=True) if row is not None}

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
            total_mass=self.robot.total_mass + mass - sum(count.values()) * self.contained,
            motor_mass=mass,
            uses=tuple(kind_use(kind, uses, tuple(self.walks)) for kind in motors),
            runs=tuple(runs.values()),
            notes=notes,
            battery_current_peak=_largest([b.current_peak for b in battery]),
            battery_current_mean=_largest([b.current_mean for b in battery]),
            price=sum(known) if len(known) == len(prices) else None,
        )


def _largest(values: Sequence[float | None]) -> float:
    """Return the largest number; NaN where one is not known, or there is none."""
    known = [value for value in values if value is not None]
    return max(known) if known and len(known) == len(values) else math.nan


def _walk_run(name: str, row: WalkUse | Exception) -> WalkRun:
    if isinstance(row, WalkUse):
        return WalkRun(name, row.walks, row.text)
    kind = "refused" if isinstance(row, HexapodError) else type(row).__name__
    return WalkRun(name, False, f"{kind}: {str(row).splitlines()[0]}")


# The worst use of a kind of joint over all walks.

Uses = Mapping[str, MotorUse]
"""What the worst joints take of their motor, by kind of joint."""


def uses_of(budget: MotorBudget) -> Uses:
    """Return the part of a budget that is kept: a budget holds all samples of a walk."""
    return {row.kind: row for row in budget.kinds}


def kind_use(kind: str, budgets: Mapping[str, Uses], walks: tuple[str, ...]) -> KindUse:
    """Return the worst use of a kind of joint over all walks.

    Args:
        kind: of joint.
        budgets: uses on the walks that could be simulated.
        walks: names of all walks.
    """
    rows = {walk: uses[kind] for walk, uses in budgets.items()}

    def worst(name: str) -> tuple[float, str]:
        known = {walk: value for walk, row in rows.items()
                 if (value := getattr(row, name)) is not None}  # fmt: skip
        if not known:
            return math.nan, ""
        walk = max(known, key=lambda key: known[key])
        return float(known[walk]), walk

    found = {name: worst(name) for name in (*USES, "lost_leg_use")}
    found["holding_use"] = max(found["holding_use"], worst("standing_use"), key=_known)
    reasons = [f"{reason} ({walk})" for walk, row in rows.items() for reason in row.reasons]
    reasons += [f"{walk}: cannot be simulated" for walk in walks if walk not in budgets]
    return KindUse(
        kind=kind, **{name: found[name][0] for name in (*USES, "lost_leg_use")},
        outside_share=worst("outside_share")[0], inertia_ratio=worst("inertia_ratio")[0],
        walk={name: found[name][1] for name in USES}, reasons=tuple(dict.fromkeys(reasons)),
        doubtful=_doubtful(list(rows.values()), len(walks)),
        winding=(worst("winding_cool")[0], worst("winding_hot")[0]),
    )  # fmt: skip


def _doubtful(rows: Sequence[MotorUse], walks: int) -> bool:
    """Return whether the verdict on all walks depends on the spread of thermal constants."""
    failing = [row for row in rows if not row.passes]
    if failing:
        return len(rows) == walks and all(row.doubtful for row in failing)
    return any(row.doubtful for row in rows)


def _known(use: tuple[float, str]) -> float:
    return -math.inf if math.isnan(use[0]) else use[0]


# The lightest motor for each kind of joint, with the motors' masses fed back.


def lightest_choice(
    evaluation: Evaluation, records: Sequence[MotorRecord], kinds: Sequence[str]
) -> tuple[LightestChoice, tuple[str, ...]]:
    """Return the lightest choice that one battery serves, and what other voltages come to.

    Args:
        evaluation: runs the walks.
        records: motors to choose from, of any voltages.
        kinds: of joint, each of which gets a motor.
    """
    voltages = sorted({record.voltage for record in records})
    found = []
    bare = evaluation.demands(None)
    for number, voltage in enumerate(voltages, start=1):
        search = LightestChoice(evaluation, [r for r in records if r.voltage == voltage])
        search.run(kinds, bare)
        found.append(search)
        if evaluation.run.interrupted:
            break
        if evaluation.run.progress is not None:
            evaluation.run.progress(number / len(voltages))
    best = min(found, key=lambda s: (s.choice is None, _mass(s), len(s.missing), -len(s.steps)))
    if len(voltages) == 1:
        return best, ()
    notes = [_voltage_note(v, s) for v, s in zip(voltages, found, strict=False)]
    return best, tuple(notes)


def _mass(search: LightestChoice) -> float:
    return math.inf if search.choice is None else search.choice.motor_mass


def _voltage_note(voltage: float, search: LightestChoice) -> str:
    if search.choice is not None:
        return f"{voltage:g} V: {search.choice.name}, {search.choice.motor_mass:.3f} kg of motors"
    missing = ", ".join(search.missing) or "all"
    return f"{voltage:g} V: no motor carries the {missing} joints"


@dataclass
class LightestChoice:
    """The search for the lightest motors that carry a robot made heavier by them.

    It begins with what the walks require of the robot as in its file, and chooses for each kind of
    joint the lightest motor that may give it. With these motors in the robot, the walks are
    simulated again; a motor that does not carry its joints there is not chosen again for them; and
    the next choice is made from the new requirement, until it is the same. Each step drops a motor
    or makes the robot lighter, so this ends.

    Attributes:
        evaluation: runs the walks.
        records: motors to choose from.
        steps: choices one after another, each simulated with its own masses, rotors and lines.
        choice: the last one where it passes; None where no motor is left for a kind of joint.
        missing: kinds of joints that no motor is left for.
    """

    evaluation: Evaluation
    records: Sequence[MotorRecord]
    steps: list[MotorCandidate] = field(default_factory=list)
    choice: MotorCandidate | None = None
    missing: tuple[str, ...] = ()
    _dropped: set[tuple[str, str]] = field(default_factory=set)

    def run(self, kinds: Sequence[str], bare: Mapping[str, JointDemand]) -> None:
        """Search; after Ctrl-C the last choice stays.

        Args:
            kinds: of joint, each of which gets a motor.
            bare: what each walk requires of the robot as in its file.
        """
        wanted = self._lightest(kinds, bare)
        tried: dict[tuple[str, ...], MotorCandidate] = {}
        while wanted is not None:
            key = tuple(record.name for record in wanted.values())
            if key in tried:
                self.choice = tried[key] if tried[key].passes else None
                return
            found = self.evaluation.of([wanted])
            if not found or self.evaluation.run.interrupted:
                return
            tried[key] = found[0]
            self.steps.append(found[0])
            self._drop(found[0])
            wanted = self._lightest(kinds, self.evaluation.demands(wanted))

    def _lightest(self, kinds: Sequence[str], demands: Mapping[str, JointDemand]) -> Motors | None:
        """Return the lightest motor of each kind that may give what is required."""
        chosen: dict[str, MotorRecord] = {}
        order = sorted(self.records, key=lambda record: (record.mass or 0.0, record.stall_torque))
        for kind in kinds:
            asked = {walk: demand.of_kinds((kind,)) for walk, demand in demands.items()}
            carrying = (r for r in order if self._carries(kind, r, asked))
            record = next(carrying, None)
            if record is None:
                self.missing = (*self.missing, kind)
                continue
            chosen[kind] = record
        return None if self.missing else chosen

    def _carries(self, kind: str, record: MotorRecord, asked: Mapping[str, JointDemand]) -> bool:
        if (kind, record.name) in self._dropped:
            return False
        walks = tuple(self.evaluation.walks)
        budgets = {
            walk: uses_of(motor_budget(demand, record, self.evaluation.derating))
            for walk, demand in asked.items()
        }
        return kind_use(kind, budgets, walks).passes

    def _drop(self, candidate: MotorCandidate) -> None:
        """Do not choose again what did not carry its joints; where all did, what is weakest."""
        if candidate.passes:
            return
        failing = [use.kind for use in candidate.uses if not use.passes]
        if not failing:
            failing = [max(candidate.uses, key=lambda use: use.worst).kind]
        self._dropped |= {(kind, candidate.motors[kind].name) for kind in failing}
