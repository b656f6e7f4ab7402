"""A motor selection lists the motors that can drive a robot, as data, text and rows."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.errors import UnknownNameError
from hexapod_pin.foreign_text import csv_cell, encoded
from hexapod_pin.immutable import Immutable
from hexapod_pin.results.result_files import check_ending, without_non_finite
from hexapod_pin.shown import drawn

if TYPE_CHECKING:
    from hexapod_pin.drive.catalog import MotorRecord
    from hexapod_pin.drive.catalog.motor_record import Derating
    from hexapod_pin.results.sizing import JointDemand


USES = ("peak_use", "continuous_use", "holding_use", "speed_use")
"""What a motor is judged by."""


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

    @property
    def passes(self) -> bool:
        """Whether the motor carries these joints."""
        return not self.reasons

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
    def passes(self) -> bool:
        """Whether the motors carry every joint and the robot walks every walk with them."""
        return all(use.passes for use in self.uses) and all(run.walks for run in self.runs)

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


@dataclass(frozen=True)
class Confidence:
    """How sure it is that the chosen motors pass.

    Attributes:
        sentence: the result in one sentence.
        walk: the walk that was varied: the one with the largest use.
        share: of the sampled walks that pass [-].
        low: lower end of its 95 % interval [-].
        high: upper end [-].
        walks: how many were run.
        indices: total Sobol index of each input [-], largest first; empty where there are none.
        percentiles: 5, 50, 95 and 99 % of the largest use [-].
        inputs: the distributions, as text.
        values: largest use of each sampled walk [-]; infinite where it fell.
    """

    sentence: str
    walk: str
    share: float
    low: float
    high: float
    walks: int
    indices: Mapping[str, float]
    percentiles: Mapping[str, float]
    inputs: tuple[str, ...]
    values: tuple[float, ...] = ()


@dataclass(frozen=True)
class MotorSelection(Immutable):
    """Motors ranked for a robot.

    Attributes:
        robot_name: its name.
        total_mass: of the robot as in its file [kg].
        contained: mass of each motor that the file contains [kg].
        walks: names of the walks that must be carried.
        candidates: every motor on all joints: those that pass first, the lightest first; then the
            others by their largest use.
        unusable: motors of the catalogue that could not be compared, with the reason.
        choice: the lightest motor that passes for each kind of joint; None where a kind has none.
        iterations: choices one after another, until masses and choice agree.
        confidence: of the choice; None where it was not computed.
        demands: what the joints need on each walk, by its name, with the motors of the choice (of
            the best candidate where there is none) in the robot and their lines not acting.
        derating: what a motor may be loaded with.
        catalog: source of the motors.
        assumed: what no source gives.
        notes: what else to know.
        interrupted: whether Ctrl-C ended it early.
        contact: laws of the feet on the ground, as text.
        accuracy: of the runs, and their method, as text.
    """

    robot_name: str
    total_mass: float
    contained: float
    walks: tuple[str, ...]
    candidates: tuple[MotorCandidate, ...]
    unusable: tuple[tuple[str, str], ...]
    choice: MotorCandidate | None
    iterations: tuple[MotorCandidate, ...]
    confidence: Confidence | None
    derating: Derating
    catalog: str
    assumed: tuple[str, ...] = ()
    notes: tuple[str, ...] = field(default=())
    interrupted: bool = False
    demands: Mapping[str, JointDemand] = field(default_factory=dict, repr=False)
    contact: str = field(default="", repr=False)
    accuracy: str = field(default="", repr=False)

    @property
    def best(self) -> MotorCandidate:
        """The choice; without one, the first candidate."""
        return self.candidates[0] if self.choice is None else self.choice

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of joints."""
        return tuple(use.kind for use in self.candidates[0].uses) if self.candidates else ()

    def candidate(self, model: str) -> MotorCandidate:
        """Return the candidate of a motor by its name, or its model where that has one voltage.

        Raises:
            UnknownNameError: there is none.
        """
        found = [c for c in self.candidates if model in (c.name, _model(c))]
        if len(found) != 1:
            raise UnknownNameError("motor", model, [c.name for c in self.candidates])
        return found[0]

    def passing(self, kind: str) -> tuple[MotorCandidate, ...]:
        """Return the motors that carry a kind of joint, in their order."""
        return tuple(c for c in self.candidates if c.use(kind).passes)

    def _repr_html_(self) -> str:
        """Return what a notebook shows: the verdict, and the ranking."""
        return str(drawn("notebook_html", self))

    def to_dict(self) -> dict[str, Any]:
        """Return all numbers as plain data; NaN and infinities as None."""
        return selection_to_dict(self)

    def lines(self) -> list[str]:
        """Return what a user decides by: the choice, and the first motors of the ranking."""
        from hexapod_pin.results.selection_text import selection_answer

        return selection_answer(self)

    def table(self) -> str:
        """Return everything as text."""
        from hexapod_pin.results.selection_text import selection_table

        return selection_table(self)


def _model(candidate: MotorCandidate) -> str:
    models = {record.model for record in candidate.motors.values()}
    return models.pop() if len(models) == 1 else candidate.name


# The ranking of motors as rows for other programs, and as plain data.

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


def selection_to_dict(selection: MotorSelection) -> dict[str, Any]:
    """Return all numbers as plain data; NaN and infinities as None."""
    plain = {
        "robot_name": selection.robot_name,
        "total_mass": selection.total_mass,
        "contained_motor_mass": selection.contained,
        "walks": list(selection.walks),
        "catalog": selection.catalog,
        "derating": selection.derating.model_dump(),
        "candidates": [_candidate(c) for c in selection.candidates],
        "unusable": [{"motor": name, "reason": why} for name, why in selection.unusable],
        "iterations": [_candidate(c) for c in selection.iterations],
        "choice": None if selection.choice is None else _candidate(selection.choice),
        "confidence": None if selection.confidence is None else asdict(selection.confidence),
        "assumed": list(selection.assumed),
        "notes": list(selection.notes),
        "interrupted": selection.interrupted,
    }
    finite: dict[str, Any] = without_non_finite(plain)
    return finite


def _candidate(c: MotorCandidate) -> dict[str, Any]:
    return {
        "name": c.name,
        "passes": c.passes,
        "motors": {kind: record.name for kind, record in c.motors.items()},
        "total_mass": c.total_mass,
        "motor_mass": c.motor_mass,
        "price": c.price,
        "battery_current_peak": c.battery_current_peak,
        "battery_current_mean": c.battery_current_mean,
        "kinds": {
            use.kind: {
                **{name: getattr(use, name) for name, _ in COLUMNS},
                "walk": dict(use.walk), "passes": use.passes, "reasons": list(use.reasons),
            }
            for use in c.uses
        },
        "runs": [{"walk": r.walk, "walks": r.walks, "text": r.text} for r in c.runs],
        "notes": list(c.notes),
    }  # fmt: skip


def write_selection_csv(selection: MotorSelection, path: str | Path) -> Path:
    """Write one row for each motor and kind of joint, wholly or not at all.

    Raises:
        TraceFileError: the ending is not .csv, or the file cannot be written.
    """
    check_ending(path, (".csv",))
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    for row in _rows(selection):
        writer.writerow([csv_cell(x) if isinstance(x, str) else x for x in row])
    return write_atomically(path, encoded(stream.getvalue()))


def _rows(selection: MotorSelection) -> Iterator[list[Any]]:
    yield [
        "rank", "motor", "voltage [V]", "kind of joint", "passes joint", "passes all",
        *(heading for _, heading in COLUMNS), "robot mass [kg]", "motor mass [kg]", "price",
        "battery peak [A]", "battery mean [A]", "walks in simulation", "reasons", "source",
    ]  # fmt: skip
    for rank, c in enumerate(selection.candidates, start=1):
        walked = f"{sum(run.walks for run in c.runs)} of {len(c.runs)}"
        for use in c.uses:
            record = c.motors[use.kind]
            numbers = [_number(getattr(use, name)) for name, _ in COLUMNS]
            yield [
                rank, record.model, record.voltage, use.kind, use.passes, c.passes, *numbers,
                c.total_mass, record.mass, "" if record.price is None else record.price,
                _number(c.battery_current_peak), _number(c.battery_current_mean), walked,
                "; ".join(use.reasons), record.source,
            ]  # fmt: skip


def _number(value: float) -> Any:
    return "" if math.isnan(value) else value
