"""Texts, numbers and tables of a motor selection, for its report and its figures."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

from hexapod_pin.results.motor_candidate import USES
from hexapod_pin.view.report import Cell, Column, Table

if TYPE_CHECKING:
    from hexapod_pin.drive.catalog import MotorRecord
    from hexapod_pin.results.motor_candidate import KindUse, MotorCandidate
    from hexapod_pin.results.motor_selection import MotorSelection

UNKNOWN = "unknown"
"""Text of every number that is unknown."""

USE_NAMES = {
    "peak_use": "peak torque",
    "continuous_use": "RMS torque",
    "holding_use": "holding torque",
    "speed_use": "speed",
}
"""What each use is of."""


HIGH_CONFIDENCE = 0.95
"""Share of sampled walks from which on a result is taken to be certain [-]."""


class Deciding(NamedTuple):
    """The largest use of a set of motors: what decides whether it passes.

    Attributes:
        use: need over what is allowed [-]; NaN where nothing is known.
        kind: of joint.
        name: of `results.motor_selection.USES`; empty where nothing is known.
        walk: in which it is reached; empty where that is not known.
    """

    use: float
    kind: str
    name: str
    walk: str

    @property
    def text(self) -> str:
        """What decides, as text."""
        if not self.name:
            return UNKNOWN
        return f"{USE_NAMES[self.name]} of the {self.kind} joints" + (
            f" ({self.walk})" if self.walk else ""
        )


def deciding(uses: tuple[KindUse, ...]) -> Deciding:
    """Return the largest of the known uses of some kinds of joints."""
    found = [
        Deciding(getattr(use, name), use.kind, name, use.walk.get(name, ""))
        for use in uses
        for name in USES
        if not math.isnan(getattr(use, name))
    ]
    return max(found, key=lambda item: item.use, default=Deciding(math.nan, "", "", ""))


def unknown_uses(candidate: MotorCandidate) -> list[str]:
    """Return which uses are unknown for some kind of joint, as text."""
    return [
        f"{USE_NAMES[name]} ({', '.join(kinds)})"
        for name in USES
        if (kinds := [u.kind for u in candidate.uses if math.isnan(getattr(u, name))])
    ]


def verdict_word(s: MotorSelection) -> str:
    """Return the result in short."""
    if not s.best.passes:
        word = "NO MOTOR PASSES"
    else:
        word = "PASSES WHAT COULD BE JUDGED" if unknown_uses(s.best) else "PASSES"
        if _doubtful(s):
            word += f", WITH {_share(s)} CONFIDENCE"
    return f"INTERRUPTED, {word} SO FAR" if s.interrupted else word


def verdict_level(s: MotorSelection) -> str:
    """Return how good the result is: "good", "open" where something is not known, or "bad"."""
    if not s.best.passes:
        return "bad"
    doubts = (s.interrupted, unknown_uses(s.best), voltages(s.best)[1:], _doubtful(s))
    return "open" if any(doubts) else "good"


def _share(s: MotorSelection) -> str:
    share = math.nan if s.confidence is None else s.confidence.share
    return UNKNOWN if math.isnan(share) else f"{100.0 * share:.0f} %"


def _doubtful(s: MotorSelection) -> bool:
    """Tell whether it was computed that the confidence is not high."""
    return s.confidence is not None and not s.confidence.share >= HIGH_CONFIDENCE


def voltages(candidate: MotorCandidate) -> list[float]:
    """Return the voltages that a set of motors needs, each once, rising [V]."""
    return sorted({record.voltage for record in candidate.motors.values()})


def verdict_texts(s: MotorSelection) -> tuple[str, ...]:
    """Return the verdict: the choice with its margin, its confidence, and what is missing."""
    best, most = s.best, deciding(s.best.uses)
    walks = "the walk" if len(s.walks) == 1 else f"all {len(s.walks)} walks"
    if best.passes:
        texts = [
            f"{_subject(s)}: {best.name}. They carry every joint on {walks}. The largest use of "
            f"what the derated motors may give is {use_text(most.use)}, a margin of "
            f"{margin_text(most.use)}; what decides is the {most.text}."
        ]
    else:
        texts = [
            f"No set of motors that was looked at carries every joint on {walks}. The nearest is "
            f"{best.name}: its largest use of what the derated motors may give is "
            f"{use_text(most.use)} (at most 1.00 is allowed), set by the {most.text}."
        ]
        texts += [f"Why it does not pass: {best.reasons[0]}."] if best.reasons else []
    texts.append(_certainty(s))
    if len(volts := voltages(best)) > 1:
        listed = " and ".join(f"{volt:g} V" for volt in volts)
        texts.append(f"These motors need {listed}: one battery alone does not serve them.")
    if missing := unknown_uses(best):
        texts.append(f"Not judged, because unknown: {'; '.join(missing)}.")
    if s.interrupted:
        texts.append("The run was interrupted: only what was done until then is reported.")
    return tuple(texts)


def _subject(s: MotorSelection) -> str:
    if s.choice is None:
        return "No choice for each kind of joint was reached; first in rank on all joints"
    return "Choice"


def _certainty(s: MotorSelection) -> str:
    if s.confidence is None:
        return "How uncertain inputs change this was not computed: no confidence is stated."
    return s.confidence.sentence


def mass_change(s: MotorSelection, candidate: MotorCandidate) -> str:
    """Return the robot's mass with motors, and by how much that differs from its file."""
    change = candidate.total_mass - s.total_mass
    return f"{number(candidate.total_mass)} kg ({change:+.2f} kg against its file)"


def price_text(candidate: MotorCandidate) -> str:
    """Return the price of all motors, where it is known in one currency."""
    currencies = {record.currency for record in candidate.motors.values()}
    if candidate.price is None or math.isnan(candidate.price):
        return UNKNOWN
    return f"{candidate.price:.0f} {currencies.pop()}" if len(currencies) == 1 else UNKNOWN


def number(value: float | None, digits: int = 3) -> str:
    """Return a number as text: `digits` significant ones, "unknown" of None and NaN."""
    if value is None or math.isnan(value):
        return UNKNOWN
    if math.isinf(value):
        return "∞" if value > 0.0 else "-∞"
    if value != 0.0 and 1.0 <= abs(value) < 1e6:
        return f"{value:.{max(0, digits - 1 - math.floor(math.log10(abs(value))))}f}"
    return f"{value:.{digits}g}"


def with_unit(value: float | None, unit: str, digits: int = 3) -> str:
    """Return a number with its unit; "unknown" alone of None and NaN."""
    text = number(value, digits)
    return text if text == UNKNOWN else f"{text} {unit}"


def use_text(use: float) -> str:
    """Return need over allowed: two decimals, none above 10, enough of them near 1."""
    if math.isnan(use) or math.isinf(use):
        return number(use)
    if use != 1.0 and abs(use - 1.0) < 0.01:  # never "1.00" of what is not 1
        return f"{use:.{min(-math.floor(math.log10(abs(use - 1.0))), 9)}f}"
    return f"{use:.2f}" if use < 10.0 else f"{use:.0f}"


def margin_text(use: float) -> str:
    """Return how much of what is allowed is left, 1 - use, as a percentage."""
    if math.isnan(use):
        return UNKNOWN
    if math.isinf(use):
        return "-∞"
    left = 100.0 * (1.0 - use)
    return f"{left:.1f} %" if abs(left) < 10.0 else f"{left:.0f} %"


# The tables of a motor selection's report: ranking, choice, iteration, data sheets.

SHORT = {
    "peak_use": "peak", "continuous_use": "RMS", "holding_use": "hold", "speed_use": "speed",
}  # fmt: skip
KINDS_ACROSS = 3
"""Kinds of joints side by side in a table."""

USE_NOTE = (
    "Uses are need over what the derated motor may give [-], the worst joint of the kind in the "
    "worst walk; above 1 (marked *) it does not pass. peak: largest torque over the torque-speed "
    "line at that speed; RMS: over the continuous torque; hold: static torque on all feet over the "
    "continuous torque, or in the worst stance of the walk over the derated stall torque; speed: "
    "over the no-load speed under load; ∞: beyond the no-load speed. Margin: 1 - largest use."
)


def use_cell(use: float) -> Cell:
    """Return a use; marked where it is above 1."""
    return Cell(f"{use_text(use)} *", "bad") if use > 1.0 else Cell(use_text(use))


def result_cell(passes: bool) -> Cell:
    """Return whether something passes."""
    return Cell("pass", "good") if passes else Cell("FAIL", "bad")


def choice_table(candidate: MotorCandidate) -> Table:
    """Return what each kind of joint takes of its motor, a column each."""
    columns = (
        Column("", wide=True),
        *(Column(f"{use.kind} joints", wide=True) for use in candidate.uses),
    )
    rows = tuple(
        (Cell(label), *(value(candidate, use) for use in candidate.uses))
        for label, value in _CHOICE
    )
    return Table(columns, rows, note=CHOICE_NOTE)


def _worst_walk(name: str) -> Callable[[MotorCandidate, KindUse], Cell]:
    def cell(_: MotorCandidate, use: KindUse) -> Cell:
        value = use_cell(getattr(use, name))
        walk = use.walk.get(name, "")
        return value._replace(text=f"{value.text} ({walk})" if walk else value.text)

    return cell


_CHOICE: tuple[tuple[str, Callable[[MotorCandidate, KindUse], Cell]], ...] = (
    ("Motor", lambda c, u: Cell(c.motors[u.kind].name)),
    ("Mass of one [g]", lambda c, u: Cell(_grams(c.motors[u.kind].mass))),
    ("Peak torque, use [-]", _worst_walk("peak_use")),
    ("RMS torque, use [-]", _worst_walk("continuous_use")),
    ("Holding torque, use [-]", _worst_walk("holding_use")),
    ("Speed, use [-]", _worst_walk("speed_use")),
    ("Margin", lambda c, u: Cell(margin_text(deciding((u,)).use))),
    ("Holding with a leg lost, use [-]", lambda c, u: Cell(use_text(u.lost_leg_use))),
    ("Time outside the derated line [%]", lambda c, u: Cell(number(100.0 * u.outside_share, 2))),
    ("Load over rotor inertia [-]", lambda c, u: Cell(number(u.inertia_ratio, 2))),
    ("Result", lambda c, u: result_cell(u.passes)),
)
"""Label and value of each row of the table of the choice."""

CHOICE_NOTE = (
    "Use: need over what the derated motor may give, of the worst joint, in the walk in brackets; "
    "above 1 (marked *) it does not pass. Margin: 1 - largest use. With a leg lost: static torque "
    "over the derated stall torque, for information; unknown where a stance of a walk cannot stand "
    "without a leg."
)


def iteration_table(steps: Sequence[MotorCandidate]) -> Table:
    """Return the choices one after another, until masses and motors agree."""
    columns = (
        Column("Step"), Column("Motors", wide=True), Column("All motors [kg]"),
        Column("Robot [kg]"), Column("Largest use [-]"), Column("Result", wide=True),
    )  # fmt: skip
    rows = tuple(
        (
            Cell(str(k)), Cell(step.name), Cell(number(step.motor_mass)),
            Cell(number(step.total_mass)), use_cell(deciding(step.uses).use),
            Cell("passes", "good") if step.passes else Cell(f"fails: {step.reasons[0]}", "bad"),
        )
        for k, step in enumerate(steps, start=1)
    )  # fmt: skip
    return Table(columns, rows)


def ranking_tables(
    s: MotorSelection, candidates: Sequence[MotorCandidate]
) -> Iterator[Table]:  # fmt: skip
    """Return candidates with all their uses, a table for every three kinds of joints."""
    for first in range(0, max(len(s.kinds), 1), KINDS_ACROSS):
        yield _ranking_table(s, candidates, s.kinds[first : first + KINDS_ACROSS], first == 0)


def _ranking_table(
    s: MotorSelection, candidates: Sequence[MotorCandidate], kinds: Sequence[str], whole: bool
) -> Table:
    """Return one table; uses that are unknown of all its motors are listed below it."""
    shown = {
        kind: [n for n in USES if any(not math.isnan(_use(c, kind, n)) for c in candidates)]
        for kind in kinds
    }
    places = {c.name: k for k, c in enumerate(s.candidates, start=1)}
    general = _GENERAL if whole else _GENERAL[-1:]
    priced = any(price_text(c) != UNKNOWN for c in candidates)
    general = [column for column in general if priced or column[0] != PRICE]
    columns = [Column("No."), Column("Motor on all joints", wide=True)]
    columns += [Column(SHORT[name]) for kind in kinds for name in shown[kind]]
    columns += [Column(title) for title, _ in general]
    rows = tuple(
        (
            Cell(str(places[c.name])), Cell(c.name),
            *(use_cell(_use(c, kind, name)) for kind in kinds for name in shown[kind]),
            *(value(c) for _, value in general),
        )
        for c in candidates
    )  # fmt: skip
    spans = [(f"{kind}: use [-]", len(shown[kind])) for kind in kinds if shown[kind]]
    missing = [f"{SHORT[n]} of the {k} joints" for k in kinds for n in USES if n not in shown[k]]
    missing += ["price"] if whole and not priced else []
    note = f"Unknown for every motor of this table: {', '.join(missing)}." if missing else ""
    return Table(tuple(columns), rows, (("", 2), *spans, ("", len(general))), note)


PRICE = "Price of all"
_GENERAL: list[tuple[str, Callable[[MotorCandidate], Cell]]] = [
    ("Margin", lambda c: Cell(margin_text(deciding(c.uses).use))),
    ("One [g]", lambda c: Cell(_grams(next(iter(c.motors.values())).mass))),
    ("Robot [kg]", lambda c: Cell(number(c.total_mass))),
    ("Battery peak [A]", lambda c: Cell(number(c.battery_current_peak))),
    (PRICE, lambda c: Cell(price_text(c))),
    ("Walks", lambda c: Cell(f"{sum(run.walks for run in c.runs)} of {len(c.runs)}")),
    ("Result", lambda c: result_cell(c.passes)),
]


def _use(candidate: MotorCandidate, kind: str, name: str) -> float:
    return float(getattr(candidate.use(kind), name))


def data_sheet_table(records: Sequence[MotorRecord]) -> Table:
    """Return what the data sheets give of motors, a column each."""
    columns = (Column("Quantity", wide=True), *(Column(r.name, wide=True) for r in records))
    rows = tuple(
        (Cell(label), *(Cell(_value(record, name, scale)) for record in records))
        for label, name, scale in DATA_SHEET
    )
    return Table(columns, rows)


DATA_SHEET = (
    ("Maker", "maker", 0.0), ("Type", "motor_type", 0.0), ("Voltage [V]", "voltage", 1.0),
    ("Allowed from [V]", "voltage_min", 1.0), ("Allowed to [V]", "voltage_max", 1.0),
    ("Stall torque [N m]", "stall_torque", 1.0), ("No-load speed [rad/s]", "no_load_speed", 1.0),
    ("Stall current [A]", "stall_current", 1.0), ("Standby current [A]", "standby_current", 1.0),
    ("Rated torque [N m]", "rated_torque", 1.0), ("Mass [g]", "mass", 1e3),
    ("Gear ratio [-]", "gear_ratio", 1.0),
    ("Rotor inertia at the joint, published [kg m²]", "armature", 1.0),
)  # fmt: skip
"""Label, attribute of `MotorRecord`, and factor; 0 of texts."""


def _value(record: MotorRecord, name: str, scale: float) -> str:
    value = getattr(record, name)
    if not scale:
        return value or UNKNOWN
    return UNKNOWN if value is None else f"{scale * value:.5g}"


def _grams(mass: float | None) -> str:
    return UNKNOWN if mass is None else f"{1e3 * mass:.4g}"
