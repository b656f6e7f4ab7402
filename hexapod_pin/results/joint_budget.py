"""A joint, or a kind of joint, delivers torque and power within a window of a trace.

Rows of a budget can be printed.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

from hexapod_pin.results.summary import Summary
from hexapod_pin.text_table import Cell, Table

KINDS = ("coxa", "femur", "tibia")
"""Of joints of legs, from the trunk outwards."""

OTHER_KINDS = ("joint", "held", "slide")
"""Of joints of no leg: unknown, held, and held ones that slide (N, m/s for N m, rad/s)."""

GAP = "gap"
"""Of free play, which has no drive: no row among the kinds."""

LIMITED_TORQUE_SHARE = 0.999
"""Share of the effort limit from which a torque counts as limited [-]."""

_PATTERNS = (  # one per kind; OpenSHC, PhantomX and `L1_1` names included
    re.compile(r"coxa|(^|_)c1(_|$)|_1$", re.IGNORECASE),
    re.compile(r"femur|thigh|_2$", re.IGNORECASE),
    re.compile(r"tibia|_3$", re.IGNORECASE),
)


@dataclass(frozen=True)
class JointBudget:
    """What one joint delivers within the window; energies per cycle (or window)."""

    joint: str
    kind: str  # "coxa", "femur", "tibia", "held", "slide", or "joint" where it is unknown
    torque_peak: float  # largest |torque| [N m]
    torque_peak_time: float  # its time [s]
    effort_limit: float  # [N m]
    at_limit: float  # share of the time (of samples) at the effort limit, 0 to 1
    torque_p99: float  # 99th percentile of |torque| [N m]
    torque_rms: float  # square root of the time average of torque^2 [N m]
    speed_peak: float  # largest |rate| [rad/s]
    speed_rms: float  # [rad/s]
    power_peak: float  # largest |torque * rate| [W]
    driving_power_peak: float  # largest torque * rate that the joint gives [W]
    braking_power_peak: float  # largest torque * rate that it takes up [W]
    positive_energy: float  # work given by the joint [J], >= 0
    negative_energy: float  # work taken up by the joint [J], <= 0
    # How far they may be off for the run's own error [N m]; None where it is not known.
    torque_peak_error: float | None = None
    torque_p99_error: float | None = None
    torque_rms_error: float | None = None

    @property
    def absolute_energy(self) -> float:
        """Integral of |torque * rate| [J]."""
        return self.positive_energy - self.negative_energy


@dataclass(frozen=True)
class KindBudget:
    """The most that any joint of one kind delivers, and which joint that is; energies summed."""

    kind: str
    joints: tuple[str, ...]
    peak: JointBudget  # the joint with the largest peak torque
    p99: JointBudget  # ... with the largest 99th percentile
    rms: JointBudget  # ... with the largest RMS torque
    speed: JointBudget  # ... with the largest peak speed
    speed_rms: JointBudget  # ... with the largest RMS speed
    power: JointBudget  # ... with the largest peak power
    driving_power: JointBudget  # ... of those with the largest driving power
    braking_power: JointBudget  # ... with the largest braking power
    positive_energy: float  # of all joints of the kind, per cycle (or window) [J]
    negative_energy: float  # [J], <= 0

    @property
    def absolute_energy(self) -> float:
        """Integral of |torque * rate| of all joints of the kind [J]."""
        return self.positive_energy - self.negative_energy


def summary_rows(summary: Summary) -> tuple[JointBudget, ...]:
    """Return one row per joint, in the order of the summary."""
    robot = summary.run.robot
    kinds = joint_kinds(summary.joint_names, len(summary.foot_names), robot.joint_kinds)
    limits = robot.effort(len(kinds))
    peak, p99, rms = map(summary.error_of, ("torque_peak", "torque_p99", "torque_rms"))
    return tuple(
        JointBudget(
            joint=summary.joint_names[k],
            kind=kind,
            torque_peak=float(abs(summary.torque_peak[k])),
            torque_peak_time=float(summary.torque_peak_time[k]),
            effort_limit=float(limits[k]),
            at_limit=float(summary.at_limit[k]),
            torque_p99=float(summary.torque_p99[k]),
            torque_rms=float(summary.torque_rms[k]),
            speed_peak=float(abs(summary.speed_peak[k])),
            speed_rms=float(summary.speed_rms[k]),
            power_peak=float(abs(summary.power_peak[k])),
            driving_power_peak=float(summary.driving_power_peak[k]),
            braking_power_peak=float(summary.braking_power_peak[k]),
            positive_energy=float(summary.positive_energy[k]),
            negative_energy=float(summary.negative_energy[k]),
            torque_peak_error=_known(peak[k]),
            torque_p99_error=_known(p99[k]),
            torque_rms_error=_known(rms[k]),
        )
        for k, kind in enumerate(kinds)
    )


def _known(value: float) -> float | None:
    """Return a number, None for NaN."""
    return None if math.isnan(value) else float(value)


def kind_rows(joints: Sequence[JointBudget]) -> tuple[KindBudget, ...]:
    """Return one row per kind of joint, in the order of first appearance along a leg."""
    kinds = [kind for kind in (*KINDS, *OTHER_KINDS) if any(row.kind == kind for row in joints)]
    return tuple(_kind_row(kind, [row for row in joints if row.kind == kind]) for kind in kinds)


def _kind_row(kind: str, rows: Sequence[JointBudget]) -> KindBudget:
    """Return the row of one kind."""

    def worst(quantity: str) -> JointBudget:
        return max(rows, key=lambda row: getattr(row, quantity))

    worsts: dict[str, Any] = {
        "peak": worst("torque_peak"),
        "p99": worst("torque_p99"),
        "rms": worst("torque_rms"),
        "speed": worst("speed_peak"),
        "speed_rms": worst("speed_rms"),
        "power": worst("power_peak"),
        "driving_power": worst("driving_power_peak"),
        "braking_power": worst("braking_power_peak"),
    }
    return KindBudget(
        kind=kind,
        joints=tuple(row.joint for row in rows),
        positive_energy=sum(row.positive_energy for row in rows),
        negative_energy=sum(row.negative_energy for row in rows),
        **worsts,
    )


def joint_kinds(
    names: Sequence[str], feet: int, known: Sequence[str] | None = None
) -> tuple[str, ...]:
    """Return the kind of every joint: as `known`, else by name, else by its place in its leg.

    The place counts where there are three joints per foot, listed leg by leg from the trunk
    outwards (*assumed* of robots whose names do not show it); otherwise all are "joint".
    """
    if known is not None:
        return tuple(known)
    found = [_kind_of(name) for name in names]
    if all(found):
        return tuple(kind for kind in found if kind)
    if len(names) == 3 * feet:
        return KINDS * feet
    return ("joint",) * len(names)


@lru_cache(maxsize=1024)
def _kind_of(name: str) -> str | None:
    """Return the kind that a name contains, if it contains exactly one."""
    kinds = [kind for kind, pattern in zip(KINDS, _PATTERNS, strict=True) if pattern.search(name)]
    return kinds[0] if len(kinds) == 1 else None


# The rows of a torque budget as plain text.


class Column(NamedTuple):
    """A column of the tables: a number of each joint, and of a kind that of its worst joint.

    Attributes:
        head: name of the quantity.
        unit: its unit.
        number: field of `JointBudget` that holds it.
        worst: field of `KindBudget` with the joint of a kind that has the largest; empty: the
            number is a sum over the joints of the kind, in a field of `KindBudget` of its name.
        error: field of `JointBudget` with its error, if there is one.
    """

    head: str
    unit: str
    number: str
    worst: str = ""
    error: str = ""

    def of_kind(self, row: KindBudget) -> float:
        """Return the number of a kind."""
        return float(getattr(getattr(row, self.worst) if self.worst else row, self.number))

    def worst_leg(self, row: KindBudget) -> str:
        """Return the leg of the joint that has it."""
        return _leg(getattr(row, self.worst).joint, row.kind) if self.worst else "all"

    def error_text(self, row: KindBudget) -> str:
        """Return its error; empty where it is not known."""
        error = getattr(getattr(row, self.worst), self.error) if self.error else None
        return "" if error is None else f"±{error:.1g}"


COLUMNS = (
    Column("peak torque", "N m", "torque_peak", "peak", "torque_peak_error"),
    Column("p99", "N m", "torque_p99", "p99", "torque_p99_error"),
    Column("RMS torque", "N m", "torque_rms", "rms", "torque_rms_error"),
    Column("peak speed", "rad/s", "speed_peak", "speed"),
    Column("RMS speed", "rad/s", "speed_rms", "speed_rms"),
    Column("driving power", "W", "driving_power_peak", "driving_power"),
    Column("braking power", "W", "braking_power_peak", "braking_power"),
    Column("energy +", "J", "positive_energy"),
    Column("energy -", "J", "negative_energy"),
)
HEADS = tuple(f"{column.head}\n[{column.unit}]" for column in COLUMNS)


def kind_lines(kinds: Sequence[KindBudget], per: str) -> list[str]:
    """Return one line per kind of joint, and below each quantity the joint that sets it."""
    rows: list[list[Cell]] = []
    for row in kinds:
        name = f"{row.kind} (x{len(row.joints)})"
        rows.append([name, *(column.of_kind(row) for column in COLUMNS)])
        rows.append(["  worst leg", *(column.worst_leg(row) for column in COLUMNS)])
        errors = [column.error_text(row) for column in COLUMNS]
        if any(errors):
            rows.append(["  error of the run", *errors])
    title = f"Worst joint of each kind; energies of all joints of the kind, per {per}"
    return Table(title, ("", *HEADS), rows, "<>").lines()


def joint_lines(joints: Sequence[JointBudget], per: str) -> list[str]:
    """Return one line per joint; a star marks a peak at the effort limit."""
    rows = [
        [
            row.joint,
            f"{row.torque_peak:.4g}{'*' if row.at_limit else ' '}",
            *(getattr(row, column.number) for column in COLUMNS[1:]),
            f"{row.torque_peak_time:.3f}",
            None if math.isinf(row.effort_limit) else row.effort_limit,
            f"{100.0 * row.at_limit:.1f}",
        ]
        for row in joints
    ]
    head = ("joint", *HEADS, "peak at\n[s]", "limit\n[N m]", "at limit\n[%]")
    return Table(f"Every joint; energies per {per}", head, rows, "<>").lines()


def _leg(joint: str, kind: str) -> str:
    """Return what is left of a joint's name without its kind: `lf_femur_joint` -> `lf`."""
    short = joint.removesuffix("_joint").removesuffix(f"_{kind}")
    return short or joint
