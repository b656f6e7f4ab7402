"""Motors put into a robot: what each kind of joint needs of them, as data, text and plain data."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from hexapod_pin.errors import UnknownNameError

if TYPE_CHECKING:
    from hexapod_pin.drive.catalog import MotorRecord

USES = ("peak_use", "continuous_use", "holding_use", "speed_use")
"""What a motor is judged by."""


COLUMNS = (
    ("peak_use", "peak [-]"),
    ("continuous_use", "continuous [-]"),
    ("holding_use", "holding [-]"),
    ("lost_leg_use", "holding, a leg lost [-]"),
    ("speed_use", "speed [-]"),
    ("outside_share", "share outside the line [-]"),
    ("inertia_ratio", "inertia ratio [-]"),
)
"""Field and heading of what stands in the CSV file for each kind of joint."""


@dataclass(frozen=True)
class KindUse:
    """What the worst joint of a kind needs over what the derated motor gives, of all walks.

    Attributes:
        kind: of the joints.
        peak_use: largest torque over the motor's line at that speed, derated [-].
        continuous_use: RMS torque over the continuous torque [-].
        holding_use: the larger of static torque on all feet over the continuous torque, and in the
            worst stance of the walk over the derated stall torque [-].
        lost_leg_use: the same with one leg lost, over the derated stall torque [-]; NaN where the
            robot cannot stand without a leg in some stance.
        speed_use: largest speed over the no-load speed at the voltage under load [-].
        outside_share: largest share of samples outside the derated line [-].
        inertia_ratio: load inertia over reflected rotor inertia [-]; NaN where it is not known.
        walk: in which walk each was largest, by the names of `USES`.
        reasons: why it does not pass; empty where it does.
        doubtful: whether passing or not depends on where in their spread the thermal constants are.
        winding: hottest winding at the best and at the worst of these constants [deg C]; NaN where
            nothing is known.
    """

    kind: str
    peak_use: float
    continuous_use: float
    holding_use: float
    lost_leg_use: float
    speed_use: float
    outside_share: float
    inertia_ratio: float
    walk: Mapping[str, str]
    reasons: tuple[str, ...]
    doubtful: bool = False
    winding: tuple[float, float] = (math.nan, math.nan)

    @property
    def passes(self) -> bool:
        """Whether the motor carries these joints."""
        return not self.reasons

    @property
    def mark(self) -> str:
        """What stands behind its numbers in tables: " *" where it does not pass, " ?" in doubt."""
        return " ?" if self.doubtful else "" if self.passes else " *"

    @property
    def worst(self) -> float:
        """The largest use [-]; NaN where nothing could be computed."""
        known = [getattr(self, name) for name in USES]
        return max((x for x in known if not math.isnan(x)), default=math.nan)


@dataclass(frozen=True)
class WalkRun:
    """A walk with the motors' lines in the simulation.

    Attributes:
        walk: name of the walk.
        walks: whether the robot does what was planned, on its feet.
        text: the verdict in one line, or why there is none.
    """

    walk: str
    walks: bool
    text: str


@dataclass(frozen=True)
class MotorCandidate:
    """A set of motors put into a robot: one for all joints, or one for each kind of joint.

    Attributes:
        motors: of each kind of joint.
        total_mass: of the robot with them [kg].
        motor_mass: of all motors [kg].
        uses: of each kind of joint.
        runs: of each walk, with the motors' lines acting.
        notes: what was assumed of the masses.
        battery_current_peak: largest current of all motors together [A]; NaN where it is not known.
        battery_current_mean: its mean [A].
        price: of all motors; None where one is not known.
    """

    motors: Mapping[str, MotorRecord]
    total_mass: float
    motor_mass: float
    uses: tuple[KindUse, ...]
    runs: tuple[WalkRun, ...]
    notes: tuple[str, ...] = ()
    battery_current_peak: float = math.nan
    battery_current_mean: float = math.nan
    price: float | None = None

    @property
    def name(self) -> str:
        """The motors' names: one, or one for each kind."""
        names = {kind: record.name for kind, record in self.motors.items()}
        if len(set(names.values())) == 1:
            return next(iter(names.values()))
        return ", ".join(f"{kind} {name}" for kind, name in names.items())

    @property
    def model(self) -> str:
        """The motors' model where they have one, else their names."""
        models = {record.model for record in self.motors.values()}
        return models.pop() if len(models) == 1 else self.name

    @property
    def passes(self) -> bool:
        """Whether the motors carry every joint and the robot walks every walk with them."""
        return all(use.passes for use in self.uses) and all(run.walks for run in self.runs)

    @property
    def doubtful(self) -> bool:
        """Whether it passes, or fails, by nothing but the spread of thermal constants."""
        failing = [use for use in self.uses if not use.passes]
        if failing:
            return all(u.doubtful for u in failing) and all(run.walks for run in self.runs)
        return any(use.doubtful for use in self.uses)

    @property
    def verdict(self) -> str:
        """The word of tables: "pass", "doubtful" or "FAIL"."""
        return "doubtful" if self.doubtful else "pass" if self.passes else "FAIL"

    @property
    def mixed(self) -> tuple[str, ...]:
        """A sentence where the motors have no common bus, and where they are of several makers."""
        found = []
        buses = {kind: record.buses for kind, record in self.motors.items()}
        known = [set(names) for names in buses.values() if names]
        if known and (len(known) < len(buses) or not set.intersection(*known)):
            each = ", ".join(f"{kind} {record.bus or 'unknown'}" for kind, record in
                             self.motors.items())  # fmt: skip
            found.append(f"the choice mixes buses: {each} (--bus holds it to one)")
        makers = {record.maker for record in self.motors.values()}
        if len(makers) > 1:
            each = ", ".join(f"{kind} {record.maker or 'unknown'}" for kind, record in
                             self.motors.items())  # fmt: skip
            found.append(f"the choice mixes makers: {each} (--maker holds it to one)")
        return tuple(found)

    @property
    def worst(self) -> float:
        """The largest use of any joint [-]."""
        return max((u.worst for u in self.uses if not math.isnan(u.worst)), default=math.inf)

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why they do not carry the robot; empty where they do."""
        found = [f"{use.kind}: {reason}" for use in self.uses for reason in use.reasons]
        return (*found, *(f"{run.walk}: {run.text}" for run in self.runs if not run.walks))

    def use(self, kind: str) -> KindUse:
        """Return the use of a kind of joint.

        Raises:
            UnknownNameError: there is no such kind.
        """
        for use in self.uses:
            if use.kind == kind:
                return use
        raise UnknownNameError("kind of joint", kind, [use.kind for use in self.uses])

    def to_dict(self) -> dict[str, Any]:
        """Return all numbers as plain data."""
        return {
            "name": self.name,
            "passes": self.passes,
            "verdict": self.verdict,
            "motors": {kind: record.name for kind, record in self.motors.items()},
            "total_mass": self.total_mass,
            "motor_mass": self.motor_mass,
            "price": self.price,
            "battery_current_peak": self.battery_current_peak,
            "battery_current_mean": self.battery_current_mean,
            "kinds": {
                use.kind: {
                    **{name: getattr(use, name) for name, _ in COLUMNS},
                    "walk": dict(use.walk), "passes": use.passes, "doubtful": use.doubtful,
                    "winding": list(use.winding), "reasons": list(use.reasons),
                }
                for use in self.uses
            },
            "runs": [{"walk": r.walk, "walks": r.walks, "text": r.text} for r in self.runs],
            "notes": list(self.notes),
        }  # fmt: skip


# Cells of tables.


def worst_text(use: KindUse) -> str:
    """Return the largest use of a kind, marked where it does not pass."""
    return f"{use.worst:.2f}{use.mark}"


def deciding_need(candidate: MotorCandidate) -> str:
    """Return what a motor is used most by: the kind of joint and of need."""
    uses = [(getattr(u, name), u.kind, name) for u in candidate.uses for name in USES]
    known = [row for row in uses if not math.isnan(row[0])]
    if not known:
        return "-"
    _, kind, name = max(known)
    return f"{kind} {name.removesuffix('_use')}"


def ranking_row(candidate: MotorCandidate) -> tuple[str, ...]:
    """Return name, mass, uses and verdict as cells of the full table."""
    mass = f"{candidate.total_mass:.2f} kg"
    return (candidate.name, mass, *map(_uses, candidate.uses), candidate.verdict)


def _uses(use: KindUse) -> str:
    values = (use.peak_use, use.continuous_use, use.holding_use, use.speed_use)
    return "/".join(f"{x:.2f}" if math.isfinite(x) else "-" for x in values) + use.mark
