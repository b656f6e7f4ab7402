"""A motor selection lists the motors that can drive a robot, as data, text and rows."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

from hexapod_pin.errors import UnknownNameError
from hexapod_pin.immutable import Immutable
from hexapod_pin.results.result_files import without_non_finite
from hexapod_pin.shown import drawn
from hexapod_pin.text_table import Table, folded

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
        return selection_answer(self)

    def table(self) -> str:
        """Return everything as text."""
        return selection_table(self)


def _model(candidate: MotorCandidate) -> str:
    models = {record.model for record in candidate.motors.values()}
    return models.pop() if len(models) == 1 else candidate.name


# The ranking of motors as text: the answer in few lines, and everything.

ROWS = 4
"""Motors in the answer: those that pass, the lightest first; where none does, the nearest."""

SHOWN = 12
"""Motors of the full table that do not pass; all are in the CSV file."""


def selection_answer(selection: MotorSelection) -> list[str]:
    """Return what a user decides by, in ten lines at a terminal's width and more beyond them."""
    s = selection
    passing = [c for c in s.candidates if c.passes]
    shown = (passing or list(s.candidates))[:ROWS]
    lines = [line for text in _headline(s) for line in folded(text)]
    head = [
        "motor on all joints",
        "robot\n[kg]",
        *(f"{kind}\nuse" for kind in s.kinds),
        "needs\nmost",
    ]
    rows = [
        [c.name, f"{c.total_mass:.2f}", *(_worst(use) for use in c.uses), _deciding(c)]
        for c in shown
    ]
    title = f"{len(passing)} of {len(s.candidates)} motors pass all joints of {len(s.walks)} walks"
    title += "; the lightest:" if passing else "; the nearest:"
    lines += [title, *Table("", head, rows, "<>", rule=False).lines()]
    if s.confidence is not None:
        lines += folded(s.confidence.sentence)
    mixed = s.choice.mixed if s.choice is not None else ()
    lines += [line for text in mixed for line in folded(text)]
    others = [note for note in s.notes if note not in mixed]
    notes = [f"{len(s.assumed)} assumed", f"{len(s.unusable)} motors not compared"]
    kept = [note for note, parts in zip(notes, (s.assumed, s.unusable), strict=True) if parts]
    if any(use.doubtful for one in shown for use in one.uses):
        kept.insert(0, "? is too warm by the less favourable of the assumed thermal constants")
    lines += folded("; ".join([*others[:1], *kept, "--full has everything, --json, --csv all"]))
    return lines


def _headline(s: MotorSelection) -> list[str]:
    """Return the choice, or that there is none, in one sentence."""
    start = "so far: " if s.interrupted else ""
    best = s.best
    if s.choice is None and not best.passes:
        reason = best.reasons[0].partition(": ")[2] or best.reasons[0] if best.reasons else ""
        return [f"{start}{s.robot_name}: no motor carries every joint; {best.name}: {reason}"]
    mass = f"robot {best.total_mass:.3g} kg, motors {1e3 * best.motor_mass:.3g} g of it"
    return [f"{start}{s.robot_name}: {best.name}; {mass}"]


def _worst(use: KindUse) -> str:
    """Return the largest use of a kind, marked where it does not pass."""
    return f"{use.worst:.2f}" + (" ?" if use.doubtful else "" if use.passes else " *")


def _deciding(candidate: MotorCandidate) -> str:
    """Return what a motor is used most by: the kind of joint and of need."""
    uses = [(getattr(u, name), u.kind, name) for u in candidate.uses for name in USES]
    known = [row for row in uses if not math.isnan(row[0])]
    if not known:
        return "-"
    _, kind, name = max(known)
    return f"{kind} {name.removesuffix('_use')}"


# Everything.


def selection_table(selection: MotorSelection) -> str:
    """Return the ranking as text."""
    parts = [_heading(selection), _ranking(selection), _choice(selection), _notes(selection)]
    return "\n\n".join("\n".join(part) for part in parts if part)


def _heading(s: MotorSelection) -> list[str]:
    lines = [
        f"Motors for {s.robot_name}: {s.total_mass:.4g} kg as in its file, "
        f"motors of {1e3 * s.contained:.3g} g each among it",
        f"{len(s.walks)} walks: {'; '.join(s.walks)}",
        f"catalogue: {s.catalog}",
        f"derating: largest torque {s.derating.peak:.0%} of the line at that speed, continuous "
        f"torque {s.derating.continuous:.0%} of stall (by heat where thermal constants are "
        f"published); supply under load {s.derating.voltage:.0%} of the row's voltage",
        "Need over what the derated motor may give; a motor passes a joint at 1 or less of each.",
        "? doubtful: it passes at one end of the assumed thermal constants and fails at the other.",
    ]
    if s.interrupted:
        lines.append("INTERRUPTED: only what was done so far is listed.")
    return lines


def _ranking(s: MotorSelection) -> list[str]:
    passing = [c for c in s.candidates if c.passes]
    others = [c for c in s.candidates if not c.passes]
    head = ("motor on all joints", "robot", *(f"{k} peak/cont/hold/speed" for k in s.kinds), "")
    shown = Table("", head, [_row(c) for c in passing + others[:SHOWN]], rule=False).lines()
    lines = shown[: 1 + len(passing)]
    if not passing:
        lines.append("none carries every joint and every walk")
    lines += shown[1 + len(passing) :]
    if len(others) > SHOWN:
        lines.append(f"... and {len(others) - SHOWN} more that do not pass (--csv lists all)")
    rejected = [f"  {c.name}: {c.reasons[0]}" for c in others[:SHOWN] if c.reasons]
    if rejected:
        lines += ["", "Why not:", *rejected]
    if s.unusable:
        lines += ["", "Not compared:", *(f"  {n}: {why}" for n, why in s.unusable)]
    return lines


def _row(candidate: MotorCandidate) -> tuple[str, ...]:
    mass = f"{candidate.total_mass:.2f} kg"
    return (candidate.name, mass, *map(_uses, candidate.uses), candidate.verdict)


def _uses(use: KindUse) -> str:
    values = (use.peak_use, use.continuous_use, use.holding_use, use.speed_use)
    return "/".join(f"{x:.2f}" if math.isfinite(x) else "-" for x in values) + (
        " ?" if use.doubtful else "" if use.passes else " *"
    )


def _choice(s: MotorSelection) -> list[str]:
    if not s.iterations:
        return []
    lines = ["Lightest motors for each kind of joint, masses fed back:"]
    for number, step in enumerate(s.iterations, start=1):
        state = "passes" if step.passes else f"fails: {step.reasons[0]}"
        lines.append(f"  {number}. {step.name}: {step.total_mass:.3f} kg, {state}")
    if s.choice is None:
        return [*lines, "  no choice: " + "; ".join(s.notes)]
    use = s.choice
    battery = (
        f"; battery: {use.battery_current_peak:.3g} A peak, {use.battery_current_mean:.3g} A mean "
        "(estimate)"
        if math.isfinite(use.battery_current_peak)
        else "; battery current unknown"
    )
    lines.append(f"  choice: {use.name}, {1e3 * use.motor_mass:.4g} g of motors{battery}")
    if s.confidence is not None:
        lines += ["", s.confidence.sentence, *(f"  {text}" for text in s.confidence.inputs)]
    return lines


def _notes(s: MotorSelection) -> list[str]:
    lines = [f"note: {note}" for note in s.notes]
    lines += [f"evidence: {line}" for line in s.derating.evidence]
    return lines + [f"assumed: {line}" for line in s.assumed]


# The ranking as plain data.

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
        "verdict": c.verdict,
        "motors": {kind: record.name for kind, record in c.motors.items()},
        "total_mass": c.total_mass,
        "motor_mass": c.motor_mass,
        "price": c.price,
        "battery_current_peak": c.battery_current_peak,
        "battery_current_mean": c.battery_current_mean,
        "kinds": {
            use.kind: {
                **{name: getattr(use, name) for name, _ in COLUMNS},
                "walk": dict(use.walk), "passes": use.passes, "doubtful": use.doubtful,
                "winding": list(use.winding), "reasons": list(use.reasons),
            }
            for use in c.uses
        },
        "runs": [{"walk": r.walk, "walks": r.walks, "text": r.text} for r in c.runs],
        "notes": list(c.notes),
    }  # fmt: skip
