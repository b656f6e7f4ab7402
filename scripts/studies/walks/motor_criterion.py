"""Which verdicts on motors change with one criterion for all makers, and by which part of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hexapod_pin.drive.catalog import MotorRecord, load_catalog
from hexapod_pin.drive.catalog.identified import identified_for
from hexapod_pin.drive.catalog.motor_record import Derating
from hexapod_pin.errors import HexapodError, ParameterError
from hexapod_pin.results.sizing import JointDemand, MotorUse, joint_demand, motor_budget
from hexapod_pin.study.selection.motor_cases import without_motors
from hexapod_pin.study.selection.selecting import required_walks
from hexapod_pin.text_table import Table
from studies.study import StudyReport

ADDED = frozenset(
    (
        "XL330-M077", "XC330-M181", "XH430-V210", "XH430-V350", "STS3032", "SCS0009", "SCS15",
        "STS3215 1:254", "LX-16A", "LX-224", "DS3225", "DS3218", "HS-645MG", "AK80-6", "AK80-9",
    )
)  # fmt: skip
"""Models that the catalogue did not have under the former criterion."""

VOLTAGES = (7.4, 12.0)
"""Of the batteries that a lightest motor is named for [V]."""

SHOWN = 4
"""Changed verdicts that are named; the others are counted."""

Verdicts = dict[tuple[str, str], MotorUse]
"""What the worst joint of a kind takes of a motor, by the motor's name and the kind."""


@dataclass(frozen=True)
class Part:
    """A part of the criterion: which rows it judges, and how.

    Attributes:
        name: of the part.
        rows: that it judges.
        record: what it takes a row for.
        derating: what it allows of a row.
        heat: whether the spread of thermal constants makes a verdict doubtful.
    """

    name: str
    rows: Callable[[MotorRecord], bool]
    record: Callable[[MotorRecord], MotorRecord]
    derating: Callable[[MotorRecord], Derating]
    heat: bool


def by_rating(row: MotorRecord) -> Derating:
    """Return the former derating: the maker's rating where there is one, else a fifth of stall."""
    if row.rated_torque is None:
        return Derating()
    return Derating(continuous=row.rated_torque / row.stall_torque)


def by_data_sheet(row: MotorRecord) -> MotorRecord:
    """Return a row whose current is that of its data sheet, identified or not."""
    return row.model_copy(update={"model": f"{row.model}, data sheet"})


def former(row: MotorRecord) -> bool:
    """Return whether a row was in the former catalogue, with its mass."""
    return row.model not in ADDED and row.name != "STS3215 at 7.4 V"


PARTS = (
    Part("before: maker's rating, else 0.2 of stall", former, by_data_sheet, by_rating, False),
    Part("0.2 of stall for all makers", former, by_data_sheet, lambda _: Derating(), False),
    Part("and windings by assumed constants", former, by_data_sheet, lambda _: Derating(), True),
    Part("and currents of identified gears", former, lambda row: row, lambda _: Derating(), True),
    Part("and the rows added: today", lambda _: True, lambda row: row, lambda _: Derating(), True),
)


def motor_criterion(
    *, folder: Path = Path("urdfs"), robots: str = "kharagpur,athena,phantomx.urdf,grasp.urdf",
    accuracy: float = 1e-4,
) -> StudyReport:  # fmt: skip
    """Judge the catalogue for walks of several robots, part by part of the criterion."""
    names = [name.strip() for name in robots.split(",") if name.strip()]
    rows, changes = [], []
    ratios: dict[str, list[float]] = {row.name: [] for row in load_catalog() if _compared(row)}
    for name in names:
        demand = _demand(name, folder, accuracy)
        last: Verdicts = {}
        for part in PARTS:
            found = _verdicts(demand, part)
            rows.append(_row(name, part, demand, found, last))
            last = found
        changes.append(_hour(name, demand))
        for motor, values in ratios.items():
            values.extend(_currents(demand, load_catalog().get(motor)))
    every = [value for one in ratios.values() for value in one]
    currents = [
        (motor, str(len(values)), *(f"{x:.2f}" for x in np.percentile(values, (5, 50, 95))))
        for motor, values in (*ratios.items(), ("all", every))
        if values
    ]
    head = (
        "robot", "criterion", "motors that pass, doubtful, do not", "lightest at 7.4 V",
        "lightest at 12 V", "verdicts that this part changes",
    )  # fmt: skip
    heats = ("robot", "motor", "hottest winding after an hour")
    return StudyReport(
        "One criterion for all makers, part by part",
        [
            "Each robot walks its default tripod with joints that give any torque, at an accuracy "
            f"of {accuracy:g}; the motors' masses and rotors are not in it. A motor is judged for "
            "each kind of joint. Each line adds one part to the line above. *Lightest*: of coxa, "
            "femur and tibia, of motors that pass, doubtful or not. Robots other than the "
            "packaged ones: [robot_sources](robot_sources.md). The parts and their reasons: "
            "[motors.md](../motors.md#what-may-last).",
            Table("", head, rows),
            "Temperatures after an hour of the same walk, with the middle of the thermal "
            "constants, and the ends of their spread:",
            Table("", heats, [row for group in changes for row in group]),
            "RMS current with the motor and gear as identified over that by the data sheet, of "
            f"joints whose torque RMS is {LOADED[0]:.0%} to {LOADED[1]:.0%} of the stall torque:",
            Table("", ("motor", "joints", "5 %", "median", "95 %"), currents),
        ],
    )


LOADED = 0.02, 0.35
"""Torque RMS over stall torque of joints whose currents are compared [-]."""


def _compared(row: MotorRecord) -> bool:
    return identified_for(row) is not None and row.stall_current is not None and not row.unusable


def _currents(demand: JointDemand, row: MotorRecord) -> list[float]:
    """Return the RMS current as identified over that by the data sheet, of each loaded joint."""
    own, sheet = (motor_budget(demand, one).joints for one in (row, by_data_sheet(row)))
    shares = demand.torque_rms / row.stall_torque
    return [
        a.current_rms / b.current_rms
        for a, b, share in zip(own, sheet, shares, strict=True)
        if LOADED[0] <= share <= LOADED[1] and a.current_rms and b.current_rms
    ]


def _demand(name: str, folder: Path, accuracy: float) -> JointDemand:
    path = folder / name
    if name.endswith((".urdf", ".xacro")) and not path.is_file():
        raise ParameterError("folder", str(folder), f"a folder with {name}")
    robot = str(path.resolve()) if path.is_file() else name
    base = {"robot": robot, "accuracy": accuracy, "repair": path.is_file()}
    (case,) = required_walks({"schema": 1, "base": base}, Path()).values()
    return joint_demand(without_motors(case).run(), postures=12)


def _verdicts(demand: JointDemand, part: Part) -> Verdicts:
    found: Verdicts = {}
    for row in load_catalog():
        if row.unusable or not part.rows(row):
            continue
        budget = motor_budget(demand, part.record(row), part.derating(row))
        found |= {(row.name, use.kind): use for use in budget.kinds}
    return found


def _word(part: Part, use: MotorUse) -> str:
    """Return "passes", "doubtful" or "no"."""
    if part.heat and use.doubtful:
        return "doubtful"
    return "passes" if use.passes else "no"


def _row(
    name: str, part: Part, demand: JointDemand, found: Verdicts, last: Verdicts
) -> tuple[str, ...]:
    kinds = tuple(dict.fromkeys(kind for _, kind in found))
    motors = dict.fromkeys(motor for motor, _ in found)
    words = [{_word(part, found[motor, kind]) for kind in kinds} for motor in motors]
    count = [
        sum(w == {"passes"} for w in words),
        sum("no" not in w and "doubtful" in w for w in words),
        sum("no" in w for w in words),
    ]
    rows = {row.name: row for row in load_catalog()}
    lightest = [_lightest(part, found, kinds, rows, volts) for volts in VOLTAGES]
    return (
        name, part.name, " / ".join(map(str, count)), *lightest, _changed(part, found, last),
    )  # fmt: skip


def _lightest(
    part: Part, found: Verdicts, kinds: Sequence[str], rows: dict[str, MotorRecord], volts: float
) -> str:
    texts = []
    for kind in kinds:
        passing = [
            rows[motor] for motor, k in found
            if k == kind and rows[motor].voltage == volts and found[motor, kind].passes
        ]  # fmt: skip
        best = min(passing, key=lambda row: row.mass or 0.0, default=None)
        if best is None:
            texts.append("none")
            continue
        use = found[best.name, kind]
        mark = " ?" if _word(part, use) == "doubtful" else ""
        texts.append(f"{best.model} {use.deciding_use:.2f}{mark}")
    return ", ".join(texts)


def _changed(part: Part, found: Verdicts, last: Verdicts) -> str:
    """Return the verdicts that are not those of the part before, the first ones by name."""
    if not last:
        return "-"
    before = PARTS[PARTS.index(part) - 1]
    both = [key for key in found if key in last]
    changed = [
        f"{motor} {kind}: {_word(before, last[motor, kind])} to {_word(part, found[motor, kind])}"
        for motor, kind in both
        if _word(before, last[motor, kind]) != _word(part, found[motor, kind])
    ]
    added = len({motor for motor, _ in found} - {motor for motor, _ in last})
    shown = changed[:SHOWN]
    more = [f"and {len(changed) - SHOWN} more"] if len(changed) > SHOWN else []
    extra = [f"{added} motors added"] if added else []
    return "; ".join([*shown, *more, *extra]) or "none"


def _hour(name: str, demand: JointDemand) -> list[tuple[str, ...]]:
    """Return what an hour does to two motors with a stall current, one of them identified."""
    rows: list[tuple[str, ...]] = []
    for model in ("STS3215-C018", "MX-64"):
        record = load_catalog().get(model, 12.0)
        try:
            heat = motor_budget(demand, record).hour
        except HexapodError as error:
            rows.append((name, record.name, str(error)))
            continue
        word = "identified gear" if identified_for(record) else "data sheet's current"
        rows.append((name, f"{record.name}, {word}", heat.line.removeprefix("after an hour: ")))
    return rows
