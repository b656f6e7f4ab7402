"""Peaks of a torque budget are recomputed with other settings, and each has a verdict."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from types import MappingProxyType
from typing import Any

from hexapod_pin.immutable import Immutable
from hexapod_pin.results.result_files import without_non_finite
from hexapod_pin.results.schema import named
from hexapod_pin.results.steady_window import Window
from hexapod_pin.text_table import Cell, Table

# What the peaks of a run are computed again with, and how far their numbers spread.

RUN, ACCURACY, CONTACT, SERVO = "run", "accuracy", "contact stiffness", "servo stiffness"
"""What a peak is computed with: as the run was, and what is changed."""


@dataclass(frozen=True)
class Recomputation:
    """One change under which peaks were computed again.

    Attributes:
        name: "accuracy", "contact stiffness" or "servo stiffness".
        title: the change as text.
        change: the numbers before and after, with units.
        baseline: what its peaks are compared with: "run" or "accuracy".
        unneeded: why it does not apply; empty where it does.
        failure: why there is no result, details behind a colon; empty where there is one.
    """

    name: str
    title: str
    change: str
    baseline: str
    unneeded: str = ""
    failure: str = ""


@dataclass(frozen=True)
class Spread:
    """A number over all computations that ran.

    Attributes:
        value: its best estimate: at ten times the accuracy, where that ran.
        low: its least.
        high: its largest.
    """

    value: float
    low: float
    high: float

    @classmethod
    def of(cls, computed: Mapping[str, float]) -> Spread:
        """Return the spread of what was computed."""
        value = computed.get(ACCURACY, computed[RUN])
        return cls(value, min(computed.values()), max(computed.values()))

    @property
    def share(self) -> float:
        """From the least to the largest, over the value [-]; NaN where that is 0."""
        return (self.high - self.low) / self.value if self.value else float("nan")

    def to_dict(self) -> dict[str, float]:
        """Return all numbers as plain data."""
        return {**asdict(self), "share": self.share}


# Peaks of a torque budget that were computed again, and what became of them; pure data.

HOLDS_WITHIN = 0.05
"""Largest change of a peak that holds [-]."""

NEGLIGIBLE_SHARE = 0.01
"""Smaller peaks than this share of the robot's largest are compared with 5 % of that share [-]."""

PEAK, RANGE, AT_LIMIT, UNKNOWN = "peak", "range", "at the limit", "range unknown"
"""What a verdict may be."""


@dataclass(frozen=True)
class PeakVerdict(Immutable):
    """What became of one peak torque: of a joint, or the largest of a kind of joint.

    Attributes:
        name: of the joint or of the kind.
        kind: of joint: "coxa", "femur", "tibia" or "joint".
        verdict: "peak": it holds; "range": something moved it; "at the limit": a computation
            reached the torque limit, which cuts what it would have been; "range unknown": a
            computation failed.
        torque_peak: the peak [N m]: best estimate, least and largest of all that was computed.
        computed: the peak of each computation that ran [N m], the run's own among them.
        changes: by which share each change moved it [-]; only those that ran. Of a kind: the peak
            of all its joints or of the joint that had set it, whichever moved further.
        moved_by: changes that moved it by more than 5 %.
        effort_limit: of the joint, or of the kind's joint with the largest peak [N m].
        at_limit: largest share of the time at the torque limit [-].
        torque_p99: 99th percentile of |torque| [N m].
        torque_rms: RMS torque [N m].
        text: the verdict as a sentence.
    """

    name: str
    kind: str
    verdict: str
    torque_peak: Spread
    computed: Mapping[str, float]
    changes: Mapping[str, float]
    moved_by: tuple[str, ...]
    effort_limit: float
    at_limit: float
    torque_p99: Spread
    torque_rms: Spread
    text: str

    def __post_init__(self) -> None:
        """Make the mappings read-only."""
        for name in ("computed", "changes"):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))

    @property
    def holds(self) -> bool:
        """Whether every change left the peak where it was, within 5 %."""
        return self.verdict == PEAK

    def to_dict(self) -> dict[str, Any]:
        """Return all numbers as plain data."""
        plain = {key: getattr(self, key) for key in self.__dataclass_fields__}
        spreads = {
            key: getattr(self, key).to_dict() for key in ("torque_peak", "torque_p99", "torque_rms")
        }
        maps = {key: dict(getattr(self, key)) for key in ("computed", "changes")}
        return {**plain, **spreads, **maps, "moved_by": list(self.moved_by)}


@dataclass(frozen=True)
class FootImpulse:
    """Impulse of the normal force on one foot per cycle (or window) [N s]."""

    foot: str
    impulse: Spread


@dataclass(frozen=True)
class PeakVerdicts(Immutable):
    """The peaks of a whole robot with their verdicts; `table()` prints them.

    Attributes:
        robot_name: name of the robot.
        window: the time that peaks are taken from, of the run.
        recomputations: what was changed, and what came of it.
        joints: one verdict per joint, in the run's order.
        kinds: one verdict per kind of joint, of the largest peak of its joints.
        feet: impulse of every foot.
        sources: what was simulated, one line each.
        notes: what to know before using the numbers, one line each.
        assumed: statements of what is assumed rather than taken from a source.
    """

    robot_name: str
    window: Window
    recomputations: tuple[Recomputation, ...]
    joints: tuple[PeakVerdict, ...]
    kinds: tuple[PeakVerdict, ...]
    feet: tuple[FootImpulse, ...]
    sources: tuple[str, ...]
    notes: tuple[str, ...]
    assumed: tuple[str, ...]

    @property
    def hold(self) -> bool:
        """Whether the peak of every joint and of every kind holds."""
        return all(row.holds for row in (*self.joints, *self.kinds))

    def joint(self, name: str) -> PeakVerdict:
        """Return the verdict of one joint.

        Raises:
            UnknownNameError: there is no such joint.
        """
        return named("joint", name, {row.name: row for row in self.joints})

    def kind(self, name: str) -> PeakVerdict:
        """Return the verdict of one kind of joint: "coxa", "femur" or "tibia".

        Raises:
            UnknownNameError: there is no such kind.
        """
        return named("kind of joint", name, {row.name: row for row in self.kinds})

    def to_dict(self) -> dict[str, Any]:
        """Return all numbers as plain data [N m, N s, shares]; NaN and infinities as None."""
        plain: dict[str, Any] = without_non_finite(
            {
                "robot_name": self.robot_name,
                "window": asdict(self.window),
                "holds_within": HOLDS_WITHIN,
                "negligible_share": NEGLIGIBLE_SHARE,
                "hold": self.hold,
                "recomputations": [asdict(row) for row in self.recomputations],
                "kinds": [row.to_dict() for row in self.kinds],
                "joints": [row.to_dict() for row in self.joints],
                "feet": [{"foot": row.foot, "impulse": row.impulse.to_dict()} for row in self.feet],
                "sources": list(self.sources),
                "notes": list(self.notes),
                "assumed": list(self.assumed),
            }
        )
        return plain

    def to_json(self) -> str:
        """Return `to_dict` as JSON text."""
        return json.dumps(self.to_dict(), indent=2, allow_nan=False)

    def table(self) -> str:
        """Return the verdicts as plain text with units."""
        return verdict_text(self)


# Peaks with their verdicts as plain text.

LEGEND = (
    f'"peak": it moved by no more than {100 * HOLDS_WITHIN:g} % under any of the changes, and '
    "stands as computed at ten times the accuracy. Ranges hold all values computed, the run's own "
    "too. Columns in % give how far each change moved the peak; peaks below "
    f"{100 * NEGLIGIBLE_SHARE:g} % of the robot's largest are compared with that "
    f"{100 * NEGLIGIBLE_SHARE:g} %. p99, RMS, impulse: at ten times the accuracy, then the least "
    "and the largest of all.",
    "What was not changed, such as mass, friction or ground, may move a peak that holds here.",
)


def verdict_text(verdicts: PeakVerdicts) -> str:
    """Return the verdicts as plain text with units."""
    window, changes = verdicts.window, verdicts.recomputations
    per = "window" if window.cycles is None else "cycle"
    parts = (
        [
            f"Peaks with a verdict, {verdicts.robot_name}",
            f"window: {window.start:.4g} to {window.end:.4g} s{window.counted}",
            *verdicts.sources,
        ],
        ["Computed again with", *(f"  {_change_line(row)}" for row in changes)],
        ["Largest peak of each kind", *(f"  {row.name}: {row.text}" for row in verdicts.kinds)],
        ["Each kind", *_rows(verdicts.kinds, changes)],
        ["Every joint", *_rows(verdicts.joints, changes)],
        [f"Impulse of the normal force per {per}", *_feet(verdicts)],
        [*LEGEND, *verdicts.notes, *(f"assumed: {line}" for line in verdicts.assumed)],
    )
    return "\n\n".join("\n".join(part) for part in parts)


def _change_line(row: Recomputation) -> str:
    """Return what a change was, or why there is none."""
    if row.unneeded:
        return f"{row.title}: {row.unneeded}"
    failed = f"; {row.failure}" if row.failure else ""
    return f"{row.title}: {row.change}{failed}"


def _rows(rows: Sequence[PeakVerdict], changes: Sequence[Recomputation]) -> list[str]:
    tried = [row for row in changes if not row.unneeded]
    head = ["", "verdict", "torque\n[N m]", *(f"{row.name}\n[%]" for row in tried), "p99\n[N m]"]
    head += ["least to\nlargest", "RMS\n[N m]", "least to\nlargest", "limit\n[N m]"]
    cells = [
        [
            row.name,
            row.verdict,
            row.torque_peak.value if row.verdict == PEAK else _span(row.torque_peak),
            *(
                f"{100.0 * row.changes[one.name]:+.1f}" if one.name in row.changes else "?"
                for one in tried
            ),
            row.torque_p99.value,
            _span(row.torque_p99),
            row.torque_rms.value,
            _span(row.torque_rms),
            row.effort_limit,
        ]
        for row in rows
    ]
    return Table("", head, cells, "<>").lines()


def _span(spread: Spread) -> str:
    return f"{spread.low:.4g} to {spread.high:.4g}"


def _feet(verdicts: PeakVerdicts) -> list[str]:
    rows: list[list[Cell]] = [
        [row.foot, row.impulse.value, _span(row.impulse), f"{100 * row.impulse.share:.1f}"]
        for row in verdicts.feet
    ]
    head = ("foot", "impulse\n[N s]", "least to\nlargest", "spread\n[%]")
    return Table("", head, rows, "<>").lines()
