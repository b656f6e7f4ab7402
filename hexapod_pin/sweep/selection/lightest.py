"""The lightest motor for each kind of joint, with the motors' masses fed back."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from hexapod_pin.results.sizing import motor_budget
from hexapod_pin.sweep.selection.kind_use import kind_use, uses_of

if TYPE_CHECKING:
    from hexapod_pin.drive.catalog import MotorRecord
    from hexapod_pin.results.motor_selection import MotorCandidate
    from hexapod_pin.results.sizing import JointDemand
    from hexapod_pin.sweep.selection.evaluation import Evaluation
    from hexapod_pin.sweep.selection.motor_cases import Motors


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
    for voltage in voltages:
        search = LightestChoice(evaluation, [r for r in records if r.voltage == voltage])
        search.run(kinds)
        found.append(search)
        if evaluation.interrupted:
            break
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

    It begins with what the walks ask of the robot as its file says, and chooses for each kind of
    joint the lightest motor that may give it. With these motors in the robot, the walks are
    simulated again; a motor that does not carry its joints there is not chosen again for them; and
    from what is asked now the next choice is made, until it is the same. Each step drops a motor
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

    def run(self, kinds: Sequence[str]) -> None:
        """Search; after Ctrl-C the last choice stays."""
        wanted = self._lightest(kinds, self.evaluation.demands(None))
        tried: dict[tuple[str, ...], MotorCandidate] = {}
        while wanted is not None:
            key = tuple(record.name for record in wanted.values())
            if key in tried:
                self.choice = tried[key] if tried[key].passes else None
                return
            found = self.evaluation.of([wanted])
            if not found or self.evaluation.interrupted:
                return
            tried[key] = found[0]
            self.steps.append(found[0])
            self._drop(found[0])
            wanted = self._lightest(kinds, self.evaluation.demands(wanted))

    def _lightest(self, kinds: Sequence[str], demands: Mapping[str, JointDemand]) -> Motors | None:
        """Return the lightest motor of each kind that may give what is asked for."""
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
