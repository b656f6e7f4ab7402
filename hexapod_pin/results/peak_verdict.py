"""Peaks of a torque budget that were computed again, and what became of them; pure data."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from types import MappingProxyType
from typing import Any, Protocol, TypeVar

from hexapod_pin.arguments import explain_methods
from hexapod_pin.errors import UnknownNameError
from hexapod_pin.immutable import Immutable
from hexapod_pin.results.plain_json import without_non_finite
from hexapod_pin.results.recomputation import Recomputation, Spread
from hexapod_pin.results.steady_window import Window

HOLDS_WITHIN = 0.05
"""Largest change of a peak that holds [-]."""

NEGLIGIBLE_SHARE = 0.01
"""Smaller peaks than this share of the robot's largest are held against 5 % of that share [-]."""

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
        torque: the peak [N m]: best estimate, least and largest of all that was computed.
        computed: the peak of each computation that ran [N m], the run's own among them.
        changes: by which share each change moved it [-]; only those that ran. Of a kind: the peak
            of all its joints or of the joint that had set it, whichever moved further.
        moved_by: changes that moved it by more than 5 %.
        effort_limit: of the joint, or of the kind's joint with the largest peak [N m].
        at_limit: largest share of the time at the torque limit [-].
        p99: 99th percentile of |torque| [N m].
        rms: RMS torque [N m].
        text: the verdict as a sentence.
    """

    name: str
    kind: str
    verdict: str
    torque: Spread
    computed: Mapping[str, float]
    changes: Mapping[str, float]
    moved_by: tuple[str, ...]
    effort_limit: float
    at_limit: float
    p99: Spread
    rms: Spread
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
        spreads = {key: getattr(self, key).to_dict() for key in ("torque", "p99", "rms")}
        maps = {key: dict(getattr(self, key)) for key in ("computed", "changes")}
        return {**plain, **spreads, **maps, "moved_by": list(self.moved_by)}


@dataclass(frozen=True)
class FootImpulse:
    """Impulse of the normal force on one foot per cycle (or window) [N s]."""

    foot: str
    impulse: Spread


@explain_methods
@dataclass(frozen=True)
class PeakVerdicts:
    """The peaks of a whole robot with their verdicts; `table()` prints them.

    Attributes:
        robot: name of the robot.
        window: the time that peaks are taken from, of the run.
        recomputations: what was changed, and what came of it.
        joints: one verdict per joint, in the run's order.
        kinds: one verdict per kind of joint, of the largest peak of its joints.
        feet: impulse of every foot.
        sources: what was simulated, one line each.
        notes: what to know before using the numbers, one line each.
        assumed: statements of what is assumed rather than taken from a source.
    """

    robot: str
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
        return _named("joint", name, self.joints)

    def kind(self, name: str) -> PeakVerdict:
        """Return the verdict of one kind of joint: "coxa", "femur" or "tibia".

        Raises:
            UnknownNameError: there is no such kind.
        """
        return _named("kind of joint", name, self.kinds)

    def to_dict(self) -> dict[str, Any]:
        """Return all numbers as plain data [N m, N s, shares]; NaN and infinities as None."""
        plain: dict[str, Any] = without_non_finite(
            {
                "robot": self.robot,
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
        from hexapod_pin.results.peak_table import verdict_text

        return verdict_text(self)


class _Named(Protocol):
    @property
    def name(self) -> str: ...


_Row = TypeVar("_Row", bound=_Named)


def _named(what: str, name: str, rows: Sequence[_Row]) -> _Row:
    found = {row.name: row for row in rows}
    if name not in found:
        raise UnknownNameError(what, name, list(found))
    return found[name]
