"""What a user decides by after a run: the verdict and the need of each kind of joint, in few lines.

The first line says whether the robot walks, and whether its torques may be trusted. Numbers are
rounded to what the run's own error leaves of them.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.drive.catalog import MotorRecord
from hexapod_pin.drive.catalog.catalog import USUAL_VOLTAGE
from hexapod_pin.errors import HexapodError, NotRecordedError, ParameterError
from hexapod_pin.immutable import Immutable
from hexapod_pin.results.joint_budget import JointBudget, KindBudget
from hexapod_pin.results.result_files import without_non_finite
from hexapod_pin.results.sizing.motor_budget import MotorBudget, motor_budget
from hexapod_pin.results.sizing.motor_use import MotorUse
from hexapod_pin.results.sizing.ranking import LightestMotor, lightest_motors
from hexapod_pin.results.sizing.trace_demand import joint_demand
from hexapod_pin.results.stability import stability
from hexapod_pin.results.torque_budget import TorqueBudget, torque_budget
from hexapod_pin.results.trace import Trace
from hexapod_pin.results.walk_verdict import WalkVerdict, lost_text, walk_verdict
from hexapod_pin.text_table import WIDTH, Cell, Table, folded

DIGITS = 3
"""Significant digits of a number that is exact, at most."""

NOTHING = 1e-9
"""Size below which a torque or a rate is rounding [N m, rad/s]."""

NO_LIMIT = "nothing at a limit"
"""Left out where the line has no room for it."""

VAIN_LIMITS = "its limits are no motor's"
"""In its place where to be below them says nothing."""


@dataclass(frozen=True, eq=False)
class WalkAnswer(Immutable):
    """The verdict on a run, what its joints need, and which motors carry it.

    Attributes:
        verdict: on the run as a walk.
        budget: what the joints need; None of a run without a whole cycle.
        too_short: what a run without a whole cycle lacks; else empty.
        margin: least distance of the centre of mass from the edge of the support [m], where it is
            outside without what is over within `LASTING`; None where it is not known.
        motor: how the motor of the run fares; None of a run without one.
        lightest: the lightest motor that passes, by kind of joint, at `voltage`.
        voltage: of the battery [V].
        caution: on the walk that was asked for, in a few words, such as a short stroke.
    """

    verdict: WalkVerdict
    budget: TorqueBudget | None
    too_short: str
    margin: float | None
    motor: MotorBudget | None
    lightest: Mapping[str, LightestMotor | None]
    voltage: float
    caution: str = ""

    @property
    def good(self) -> bool:
        """Whether the robot walks, its torques may be trusted, and its motor, if any, passes."""
        motor_passes = self.motor is None or self.motor.passes
        return self.verdict.walks and not self.verdict.untrusted and motor_passes

    @property
    def headline(self) -> str:
        """The verdict in one line, its most important part first."""
        verdict = self.verdict
        name, doubts = verdict.robot_name, verdict.untrusted
        if doubts:
            more = f" and {len(doubts) - 1} more" if len(doubts) > 1 else ""
            besides = f"; {self.caution}" if self.caution else ""
            return f"{name}: torques are NOT to be trusted: {doubts[0]}{more}{besides}"
        if not verdict.walks:
            return f"{name} does not walk: {verdict.cause or verdict.reason}"
        if self.motor is not None and not self.motor.passes:
            return f"{name} {_motion(verdict, share=False)}, but {motor_failure(self.motor)}"
        start = f"so far: {name}" if self.budget is None else name
        parts = [f"{start} {_motion(verdict)}", *self._notable()]
        text = ", ".join(parts)
        return text if len(text) <= WIDTH else _shortened(parts)

    def _notable(self) -> list[str]:
        """Return slip, margin and limits, a few words each."""
        verdict = self.verdict
        slip = None if verdict.slip is None else verdict.slip.total
        parts = [self.caution] if self.caution else []
        parts += verdict.cautions
        parts += [] if slip is None else [f"slip {_percent(slip)}"]
        if self.margin is not None:
            parts.append(_margin_text(self.margin))
        if verdict.push is not None:
            parts.append(verdict.push.line)
        if verdict.lost_legs:
            parts.append(lost_text(verdict.lost_legs))
        torque, speed = verdict.at_torque_limit, verdict.at_speed_limit
        for what, share in (("torque", torque), ("speed", speed)):
            if share.joints and not verdict.prescribed:
                parts.append(
                    f"{share.joint} at its {what} limit {_percent(share.share)} of the time"
                )
        known = (
            slip is not None, self.margin is not None, verdict.push, verdict.lost_legs, self.caution
        )  # fmt: skip
        if len(parts) == sum(map(bool, known)) + len(verdict.cautions):
            vain = verdict.vain_limits
            free = f"{VAIN_LIMITS} ({vain})" if vain else NO_LIMIT
            parts.append("prescribed motion" if verdict.prescribed else free)
        return parts

    def _unsaid(self) -> list[str]:
        """Return what pushes and lost legs did, where the headline has no room for it."""
        verdict, found = self.verdict, list[str]()
        if verdict.push is not None and "push" not in self.headline:
            found.append(verdict.push.line)
        if verdict.lost_legs and "torque" not in self.headline.replace("torques", ""):
            found.append(lost_text(verdict.lost_legs))
        return found

    def lines(self) -> list[str]:
        """Return headline, what to change where that helps, and the table of the joints."""
        found = folded(self.headline)
        verdict = self.verdict
        found += folded(", ".join(self._unsaid()))
        if verdict.untrusted:
            why = ", ".join(filter(None, (verdict.cause, verdict.reason)))
            state = "walks with these numbers" if verdict.walks else f"does not: {why}"
            cure = "--repair mends what it can, `hexapod-pin check` explains"
            if not verdict.doubts:
                cure = "its accuracy was not kept: no motor can be sized by it"
            elif all(text.startswith("left and right ") for text in verdict.untrusted):
                cure = "no motor can be sized by it until that is decided"
            elif all(text.startswith("mass ") for text in verdict.untrusted):
                cure = "weigh it and state it: --repair --mass KG"
            found += folded(f"it {state}; {cure}")
        if not verdict.walks:
            reason = f"{verdict.reason}; " if verdict.cause and not verdict.untrusted else ""
            found += folded(f"{reason}{verdict.advice}")
        if self.motor is not None:
            found += self._motor_lines()
        if self.budget is None:
            return found + folded(self.too_short)
        push, start = verdict.push, self.budget.window.start
        if push is not None and push.torque is not None and push.start < start:
            found += folded(
                f"in the push and a cycle after it {push.joint} took up to "
                f"{rounded(push.torque)} N m; the table is of steady walking from {start:.3g} s"
            )
        return found + joint_table(self.budget.kinds, self.lightest, self.voltage).lines()

    def _motor_lines(self) -> list[str]:
        """Return whether the run's own motor passes, and the first reason why not."""
        motor = self.motor
        assert motor is not None
        heat = folded(motor.hour.line) if motor.hour.decides else []
        heat += [line for line in [motor.battery.sag_line] if line]
        if motor.passes:
            word = "passes, but is doubtful" if motor.robot.doubtful else "passes"
            use = f"{motor.robot.deciding_use:.2g}"
            return [f"{motor.motor} {word}: largest use {use} of allowed", *heat]
        failed = "; ".join(
            f"{row.kind} {', '.join(_failed(row))}" for row in motor.kinds if row.failures
        )
        return [*folded(f"need over what is allowed: {failed}"), *heat]

    def to_dict(self) -> dict[str, Any]:
        """Return all as plain data; NaN and infinities as None."""
        lightest = {
            kind: motor and {"motor": motor.motor, "mass": motor.mass, "use": motor.use}
            for kind, motor in self.lightest.items()
        }
        found: dict[str, Any] = without_non_finite(
            {
                "answer": self.lines(),
                "good": self.good,
                "margin": self.margin,
                "verdict": self.verdict.to_dict(),
                "budget": None if self.budget is None else self.budget.to_dict(),
                "motor": None if self.motor is None else self.motor.to_dict(),
                "lightest_motors": lightest,
                "voltage": self.voltage,
            }
        )
        return found


@checked
def walk_answer(
    trace: Trace, record: MotorRecord | None = None, *, voltage: float | None = None,
    pack_resistance: float = 0.0,
) -> WalkAnswer:  # fmt: skip
    r"""Return what a user decides by: whether a robot walks, what it needs, what carries it.

    Args:
        trace: of any run.
        record: a motor to judge for all joints: that of the run, or one thought of.
        voltage: of the battery, for the lightest motors that pass [V]; None: that of `record`,
            else 12 V, *assumed*.
        pack_resistance: of the battery [ohm], see `motor_budget`; of `record` alone.

    Example:
        >>> answer = walk_answer(trace)
        >>> print("\n".join(answer.lines()))
    """
    supply = voltage or (record.voltage if record is not None else None) or USUAL_VOLTAGE
    verdict, budget, too_short = walk_verdict(trace), None, ""
    try:
        budget = torque_budget(trace)
    except ParameterError as error:
        too_short = f"no torque table: {error}"
        if (needs := verdict.needs) is not None:
            too_short = (
                f"No cycle of steady walking is in it, so it is no verdict: simulate "
                f"{needs:.4g} s or more (--duration {needs:.4g})."
            )
    motor, lightest = None, dict[str, LightestMotor | None]()
    if budget is not None:
        motor, lightest = _motors(trace, record, supply, pack_resistance)
    return WalkAnswer(verdict, budget, too_short, _margin(trace), motor, lightest, supply)


def _motors(
    trace: Trace, record: MotorRecord | None, voltage: float, pack_resistance: float
) -> tuple[MotorBudget | None, dict[str, LightestMotor | None]]:
    """Return how a motor fares, and the lightest ones that pass; nothing of an unknown robot."""
    from hexapod_pin.drive.catalog import load_catalog

    try:
        demand = joint_demand(trace)
    except (NotRecordedError, ParameterError):
        if record is not None:
            raise
        return None, {}
    own = None
    if record is not None:
        own = motor_budget(demand, record, pack_resistance=pack_resistance)
    rows = [row for row in load_catalog() if row.voltage == voltage]
    return own, lightest_motors(demand, rows)


def _margin(trace: Trace) -> float | None:
    """Return the least static margin of the steady part [m]; None where it is not known.

    A negative one is what lasts: between two steps the feet that carry may be none for samples.
    """
    try:
        found = stability(trace)
    except HexapodError:
        return None
    margins, time = found.static_margin, found.time
    least = float(np.min(margins, initial=math.inf))
    if least < 0.0:
        count = 1 + round(LASTING * (len(time) - 1) / (time[-1] - time[0])) if len(time) > 1 else 1
        if len(margins) > count:
            least = float(np.lib.stride_tricks.sliding_window_view(margins, count).max(1).min())
    return least if math.isfinite(least) else None


LASTING = 0.02
"""How long a centre of mass is outside its feet before it counts [s], *assumed*: it falls 2 mm."""


# The answer as text.


NEED_WORDS = {
    "peak_use": "peak",
    "continuous_use": "RMS",
    "thermal_use": "RMS while hottest",
    "standing_use": "standing",
    "holding_use": "holding",
    "lost_leg_use": "with a leg lost",
    "speed_use": "speed",
}
"""What a motor's needs are called in one line."""


def motor_failure(motor: MotorBudget) -> str:
    """Return that a motor fails, and by which of its needs most, in a few words."""
    row = max((row for row in motor.kinds if row.failures), key=lambda row: row.deciding_use)
    word = "is doubtful" if motor.robot.doubtful else "FAILS"
    return f"{motor.motor} {word} ({row.kind} {_failed(row)[0]})"


def _failed(row: MotorUse) -> list[str]:
    """Return what of a kind is above what is allowed, as needs over it, the largest first.

    A motor that is to drive faster than it turns without a load has no torque for its peak.
    """
    uses = {name: float(getattr(row, name)) for name in row.failures}
    fast = uses.get("peak_use") == math.inf
    texts = [
        "beyond the no-load speed"
        if fast and name == "peak_use"
        else f"{NEED_WORDS[name]} {use:.2f}"
        for name, use in sorted(uses.items(), key=lambda item: -item[1])
        if name in NEED_WORDS
    ]
    heat = uses.get("winding_temperature")
    return texts if heat is None else [*texts, f"winding {heat:.0f} deg C"]


def _motion(verdict: WalkVerdict, share: bool = True) -> str:
    """Return how the robot moves, and what share of the plan that is."""
    path, parts = verdict.travel, []
    if path.speed_share is not None:
        of_plan = f" ({path.speed_share:.1%})" if share else ""
        parts.append(f"walks {path.measured_speed:.3g} m/s{of_plan}")
    if path.turn_share is not None:
        of_plan = f" ({path.turn_share:.1%})" if share else ""
        parts.append(f"turns {_turn_rate(verdict):.3g} deg/s{of_plan}")
    if parts:
        return " and ".join(parts)
    return "stands" if verdict.holds else "stays on its feet"


def _shortened(parts: Sequence[str]) -> str:
    """Return the parts of a headline in two lines where they fit: what matters least is left out.

    Args:
        parts: the motion, what to know of it, then numbers.
    """
    kept = [part for part in parts if part != NO_LIMIT]
    if sum(map(len, kept)) + 2 * len(kept) > 2 * WIDTH:
        kept = [MEANT.sub("", part) for part in kept]
    for start in ("margin ", "slip "):
        if sum(map(len, kept)) + 2 * len(kept) > 2 * WIDTH:
            kept = [part for part in kept if not part.startswith(start)]
    return ", ".join(kept)


MEANT = re.compile(r" (?:is|are) meant(?=\))")
"""Left out of "(90 if radians are meant)" where lines are short."""


def _margin_text(margin: float) -> str:
    """Return the static margin [m]; of a centre of mass that leaves the support, how far it is."""
    if margin < -LEAST_OUTSIDE:
        return f"centre of mass up to {-1e3 * margin:.0f} mm outside its feet"
    return f"margin {1e3 * margin:.0f} mm"


LEAST_OUTSIDE = 5e-4
"""Distance outside the support that is shown [m]: half a millimetre is rounded to none."""


def _percent(share: float) -> str:
    """Return a share in percent, with two digits or as an integer."""
    return f"{100.0 * share:.2g} %" if share < 1.0 else f"{100.0 * share:.0f} %"


def _turn_rate(verdict: WalkVerdict) -> float:
    """Return the mean yaw rate [deg/s]."""
    path = verdict.travel
    return math.degrees(path.turn) / (path.end - path.start)


def joint_table(
    kinds: Sequence[KindBudget], lightest: Mapping[str, LightestMotor | None], voltage: float
) -> Table:
    """Return the need of each kind of joint, that of its worst leg, and what carries it."""
    head = ["", "peak\n[N m]", "RMS\n[N m]", "speed\n[rad/s]", "of limit\n[%]"]
    if lightest:
        head.append(f"lightest motor that passes\nat {voltage:g} V")
    rows: list[list[Cell]] = []
    for kind in kinds:
        peak, rms = kind.peak, kind.rms
        cells: list[Cell] = [
            kind.kind,
            rounded(peak.torque_peak, peak.torque_peak_error),
            rounded(rms.torque_rms, rms.torque_rms_error),
            rounded(kind.speed.speed_peak),
            None if math.isinf(peak.effort_limit) else f"{_of_limit(peak):.0f}",
        ]
        rows.append(cells + [_motor_text(kind, lightest)] * bool(lightest))
    return Table("", head, rows, "<>>>><", rule=False)


def _of_limit(row: JointBudget) -> float:
    """Return the peak over the joint's limit [%]."""
    return 100.0 * row.torque_peak / row.effort_limit if row.effort_limit > 0.0 else math.inf


def _motor_text(kind: KindBudget, lightest: Mapping[str, LightestMotor | None]) -> str:
    """Return the lightest motor with its use; of a torque that a limit cuts off, so much."""
    if kind.kind not in lightest:
        return "-"
    motor = lightest[kind.kind]
    if motor is None:
        return "none of the catalogue"
    text = f"{motor.motor.partition(' at ')[0]} ({1e3 * motor.mass:.0f} g)"
    if _of_limit(kind.peak) > CUT_OFF:
        return f"at least {text}: torque is cut off"
    return f"{text}, use {motor.use:.2f}"


CUT_OFF = 99.9
"""Peak over the joint's limit from which more would have been needed [%]."""


def rounded(value: float, error: float | None = None) -> str:
    """Return a number with three digits, or as many as its error leaves.

    Args:
        value: the number.
        error: how far it may be off; None or 0: it is exact.
    """
    if abs(value) < NOTHING:
        return "0"
    if not math.isfinite(value):
        return f"{value:g}"
    places = DIGITS - 1 - math.floor(math.log10(abs(value)))
    if error is not None and error > 0.0 and math.isfinite(error):
        places = min(places, -math.floor(math.log10(error)))
    return f"{round(value, places):.{max(0, places)}f}"
