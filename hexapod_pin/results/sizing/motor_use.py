"""Joints use a motor's torque, speed, heat and current, and all together load the battery."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.immutable import Immutable
from hexapod_pin.results.result_files import without_non_finite
from hexapod_pin.results.sizing.battery import Supply
from hexapod_pin.results.sizing.demand import JointDemand
from hexapod_pin.results.sizing.motor_current import current_numbers
from hexapod_pin.results.sizing.motors import Motors, gear_numbers
from hexapod_pin.results.sizing.winding import thermal_constant, winding_numbers

UNKNOWN = "unknown"
"""Value of a number whose input is missing in the data sheet."""

LASTING = frozenset(("continuous_use", "thermal_use", "standing_use", "winding_temperature"))
"""What is decided by heat."""

DOUBT = (
    "{joint}: the winding of {motor} comes to {cool} at best and {hot} at worst with assumed "
    "thermal constants, {limit:.0f} are allowed: doubtful"
)

USES = (
    "peak_use", "continuous_use", "thermal_use", "standing_use", "holding_use", "lost_leg_use",
    "speed_use",
)  # fmt: skip
"""Need over what the derated motor allows."""


@dataclass(frozen=True)
class MotorUse(Immutable):
    """What one joint, or the worst of several, takes of a motor. A use passes at <= 1.

    None: unknown, because the data sheet or the run does not contain it; it never counts as passed,
    and the budget's notes name it.

    Attributes:
        joint: the joint; of several, the one with the largest deciding use.
        kind: "coxa", "femur", "tibia", ...; "all" of the whole robot.
        motor: name of the catalogue's row.
        peak_use: largest |torque| over the derated torque-speed line at the speed of the same
            moment [-]; infinite where a joint drives beyond the no-load speed.
        margin: least distance of |torque| from the derated line [N m], < 0 outside.
        outside_share: share of the time outside the derated line [-].
        continuous_use: RMS torque over whole cycles over continuous torque [-].
        thermal_use: largest moving RMS over the winding's time constant, over the same [-].
        standing_use: torque at rest on all feet over the same: a robot may rest for ever [-].
        holding_use: torque at rest in the worst stance of the walk over the derated stall torque
            [-]: a stance lasts for part of a cycle, or until the legs in the air are put down.
        lost_leg_use: torque at rest with one leg lost over the same [-]: a fault.
        speed_use: largest speed over the no-load speed at the derated voltage [-].
        current_peak: of the motor; see `motor_current` [A].
        current_rms: the same [A].
        winding_heat: mean heat of its winding [W].
        armature: of the rotor at the joint [kg m^2].
        inertia_ratio: load inertia over reflected inertia [-].
        optimal_ratio: gear ratio of least RMS torque of the motor, no higher than its speed
            allows [-].
        ratio_limit: the gear ratio at which its speed is all used [-].
        torque_rms_with_armature: RMS torque with this motor's rotor at the same motion, an
            estimate [N m].
        winding_temperature: hottest of the winding in lasting walking [deg C], or "unknown".
        winding_cool: the same, or that of standing where it is higher, with the thermal constants
            at which the motor stays coolest [deg C].
        winding_hot: with those at which it gets hottest [deg C]; equal where they are published.
        winding_limit: highest temperature that is allowed [deg C].
        thermal_source: "published", "assumed" or "unknown".
        rated_use: RMS torque over the maker's own rating, for comparison: it decides nothing [-].
        failures: what is above what is allowed, by the number's name, one sentence each.
        worst: of several joints, which joint sets each number.
    """

    joint: str
    kind: str
    motor: str
    peak_use: float
    margin: float
    outside_share: float
    continuous_use: float
    thermal_use: float | None
    standing_use: float | None
    holding_use: float | None
    lost_leg_use: float | None
    speed_use: float
    current_peak: float | None
    current_rms: float | None
    winding_heat: float | None
    armature: float | None
    inertia_ratio: float | None
    optimal_ratio: float | None
    ratio_limit: float | None
    torque_rms_with_armature: float | None
    winding_temperature: float | str
    winding_cool: float | None = None
    winding_hot: float | None = None
    winding_limit: float | None = None
    thermal_source: str = UNKNOWN
    rated_use: float | None = None
    failures: Mapping[str, str] = field(default_factory=dict)
    worst: Mapping[str, str] = field(default_factory=dict)

    @property
    def passes(self) -> bool:
        """Whether every use that is required and known is <= 1, and the winding stays cool."""
        return not self.failures

    @property
    def doubtful(self) -> bool:
        """Whether the verdict depends on where in their spread the thermal constants are.

        A motor passes by its derating and is too hot with the worst constants, or fails by its
        lasting torque alone and stays cool enough with the best.
        """
        cool, hot, limit = self.winding_cool, self.winding_hot, self.winding_limit
        if cool is None or hot is None or limit is None:
            return False
        if self.passes:
            return hot > limit
        return self.failures.keys() <= LASTING and cool <= limit

    @property
    def verdict(self) -> str:
        """The word of tables: "passes", "doubtful" or "FAILS"."""
        return "doubtful" if self.doubtful else "passes" if self.passes else "FAILS"

    @property
    def doubt(self) -> str:
        """Why it is doubtful, in one sentence; empty where it is not."""
        if not self.doubtful:
            return ""
        return DOUBT.format(
            joint=self.joint, motor=self.motor, cool=_warmth(self.winding_cool),
            hot=_warmth(self.winding_hot), limit=self.winding_limit,
        )  # fmt: skip

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why it does not pass."""
        return tuple(self.failures.values())

    def to_dict(self) -> dict[str, Any]:
        """Return all numbers as plain data."""
        return asdict(self) | {
            "passes": self.passes, "verdict": self.verdict, "deciding_use": self.deciding_use
        }  # fmt: skip

    @property
    def deciding_use(self) -> float:
        """The largest of the uses that are known, a lost leg's left out [-]."""
        uses = (
            self.peak_use,
            self.continuous_use,
            self.thermal_use,
            self.standing_use,
            self.holding_use,
            self.speed_use,
        )
        return max(use for use in uses if use is not None)


UNITS = {
    "margin": "N m", "current_peak": "A", "current_rms": "A", "winding_heat": "W",
    "armature": "kg m^2",
    "torque_rms_with_armature": "N m", "winding_temperature": "deg C", "winding_cool": "deg C",
    "winding_hot": "deg C", "winding_limit": "deg C", "voltage": "V", "voltage_least": "V",
    "voltage_mean": "V", "pack_resistance": "ohm",
    "current_mean": "A", "power_peak": "W", "power_mean": "W",
    "power_mean_regeneration": "W", "energy": "J", "energy_regeneration": "J",
    "sum_of_peaks": "A", "duration": "s", "torque_peak": "N m", "torque_p99": "N m",
    "torque_rms": "N m", "standing": "N m", "holding": "N m", "holding_lost_leg": "N m",
    "speed_peak": "rad/s", "speed_rms": "rad/s", "positive_energy": "J", "negative_energy": "J",
    "load_inertia": "kg m^2",
    "acceleration_rms": "rad/s^2", "torque_acceleration": "N m rad/s^2",
}  # fmt: skip
"""Unit of every number of `MotorBudget.to_dict` that has one; the others are ratios [-]."""


def finite(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return plain data that JSON can hold: NaN and infinities as None."""
    found: dict[str, Any] = without_non_finite(dict(data))
    return found


# What each joint takes of its motor: torque, speed, heat, current, inertia.

Columns = dict[str, Array]


def joint_uses(
    demand: JointDemand, motors: Motors, lost_leg: bool, ambient: float,
    supply: Supply | None = None,
) -> tuple[MotorUse, ...]:  # fmt: skip
    """Return one row per joint; see `motor_budget`. `supply`: of a battery that sags."""
    columns = {
        **line_numbers(demand, motors, supply),
        **lasting_numbers(demand, motors),
        **gear_numbers(demand, motors),
        **current_numbers(demand, motors),
        **winding_numbers(demand, motors, ambient),
        "rated_use": demand.torque_rms / motors.rated,
    }
    judged = [name for name in USES if name != "lost_leg_use"]
    judged += ["lost_leg_use"] if lost_leg else []
    return tuple(_row(demand, motors, columns, judged, j) for j in range(len(motors.records)))


def line_numbers(demand: JointDemand, motors: Motors, supply: Supply | None = None) -> Columns:
    """Return the joints' place below the derated torque-speed line.

    Of samples, and at the largest torque of accepted steps with the speed sampled at that time. The
    line is that of the supply's voltage at that moment, where a battery sags.
    """
    size = np.abs(demand.torque)
    volts, then, least = None, None, motors.derating.voltage
    if supply is not None:
        volts = supply.voltage[:, None] / motors.rated_voltage
        then = np.interp(demand.torque_peak_time, demand.time, supply.voltage)
        then, least = then / motors.rated_voltage, volts.min(axis=0)
    allowed = motors.allowed(demand.torque, demand.speed, volts)
    top = motors.allowed(np.ones_like(demand.torque_peak), demand.torque_peak_speed, then)
    margin = np.minimum((allowed - size).min(axis=0), top - demand.torque_peak)
    use = np.maximum(share_used(size, allowed).max(axis=0), share_used(demand.torque_peak, top))
    return {
        "peak_use": use,
        "margin": margin,
        "outside_share": demand.weights @ (size > np.maximum(allowed, 0.0)),
        "speed_use": demand.speed_peak / (least * motors.no_load),
    }


def share_used(size: Array, allowed: Array) -> Array:
    """Return |torque| over what is allowed [-]; infinite where nothing is, 0 of no torque."""
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(allowed > 0.0, size / allowed, np.inf)
    return np.asarray(np.where(size > 0.0, share, 0.0))


def lasting_numbers(demand: JointDemand, motors: Motors) -> Columns:
    """Return lasting torques over those allowed for ever, a lost leg's included."""
    moving = np.full(len(demand.joint_kinds), np.nan)
    for constant in {thermal_constant(row) for row in motors.records} - {None}:
        own = [thermal_constant(row) == constant for row in motors.records]
        moving[own] = demand.thermal_rms(constant)[own]  # type: ignore[arg-type]
    at_stall = motors.allowed(np.ones_like(motors.stall), np.zeros_like(motors.stall))
    return {
        "continuous_use": demand.torque_rms / motors.continuous,
        "thermal_use": moving / motors.continuous,
        "standing_use": demand.standing / motors.continuous,
        "holding_use": demand.holding / at_stall,
        "lost_leg_use": demand.holding_lost_leg / at_stall,
    }


def _row(
    demand: JointDemand, motors: Motors, columns: Columns, judged: list[str], j: int
) -> MotorUse:  # fmt: skip
    numbers: dict[str, Any] = {
        name: None if np.isnan(values[j]) else float(values[j]) for name, values in columns.items()
    }
    names: dict[str, Any] = {"joint": demand.joint_names[j], "motor": motors.records[j].name}
    failures = {
        name: REASONS[name].format(**names, use=numbers[name], need=NEEDS[name](demand)[j])
        for name in judged
        if numbers[name] is not None and numbers[name] > 1.0
    }
    if numbers["peak_use"] == np.inf:
        failures["peak_use"] = BEYOND.format(**names)
    heat, hottest = numbers["winding_temperature"], numbers["winding_limit"]
    numbers["winding_temperature"] = UNKNOWN if heat is None else heat
    source = UNKNOWN if heat is None else "published" if motors.heat_known[j] else "assumed"
    if source == "published" and hottest is not None and heat > hottest:
        failures = {name: text for name, text in failures.items() if name not in LASTING}
        failures["winding_temperature"] = HOT.format(**names, heat=_warmth(heat), hottest=hottest)
    row = MotorUse(
        kind=demand.joint_kinds[j], thermal_source=source, **names, failures=failures, **numbers
    )
    if not row.doubtful or row.passes:
        return row
    cool, hot = _warmth(row.winding_cool), _warmth(row.winding_hot)
    spread = MARGIN.format(cool=cool, hot=hot, limit=row.winding_limit)
    return replace(row, failures={name: text + spread for name, text in failures.items()})


def _warmth(temperature: float | None) -> str:
    """Return a temperature [deg C] in words: a winding that makes more than it sheds has none."""
    if temperature is None:
        return UNKNOWN
    return "no finite temperature" if math.isinf(temperature) else f"{temperature:.0f} deg C"


REASONS = {
    "peak_use": "{joint}: torque up to {need:.3g} N m is {use:.2f} of what {motor} gives at the "
    "speed of the same moment, derated",
    "continuous_use": "{joint}: RMS torque {need:.3g} N m is {use:.2f} of the continuous torque "
    "of {motor}",
    "thermal_use": "{joint}: the RMS torque over the winding's time constant is {use:.2f} of the "
    "continuous torque of {motor}",
    "standing_use": "{joint}: standing on all feet takes {need:.3g} N m, {use:.2f} of the "
    "continuous torque of {motor}",
    "holding_use": "{joint}: holding {need:.3g} N m in the worst stance of the walk is {use:.2f} "
    "of the derated stall torque of {motor}",
    "lost_leg_use": "{joint}: holding {need:.3g} N m with one leg lost is {use:.2f} of the derated "
    "stall torque of {motor}",
    "speed_use": "{joint}: speed up to {need:.3g} rad/s is {use:.2f} of the no-load speed of "
    "{motor} at the derated voltage",
}
BEYOND = (
    "{joint}: is to drive beyond the no-load speed of {motor} at the derated voltage, where it can "
    "only brake"
)
MARGIN = (
    " (doubtful: winding at {cool} to {hot} with assumed thermal constants, {limit:.0f} allowed)"
)
HOT = "{joint}: the winding of {motor} comes to {heat}, {hottest:g} are allowed"
NEEDS = {
    "peak_use": lambda d: d.torque_peak,
    "continuous_use": lambda d: d.torque_rms,
    "thermal_use": lambda d: d.torque_rms,
    "standing_use": lambda d: d.standing,
    "holding_use": lambda d: d.holding,
    "lost_leg_use": lambda d: d.holding_lost_leg,
    "speed_use": lambda d: d.speed_peak,
}


# The worst of several joints, number by number.

LARGEST = (
    *USES, "outside_share", "current_peak", "current_rms", "winding_heat", "armature",
    "inertia_ratio", "torque_rms_with_armature", "winding_cool", "winding_hot", "rated_use",
)  # fmt: skip
SMALLEST = ("margin", "optimal_ratio", "ratio_limit", "winding_limit")


def worst_use(kind: str, rows: Sequence[MotorUse]) -> MotorUse:
    """Return the worst of each number, and in `worst` which joint sets it; see `MotorUse`.

    The largest of uses, currents and ratios of inertia, the smallest margin and gear ratio.
    """
    numbers: dict[str, Any] = {}
    worst: dict[str, str] = {}
    for names, pick in ((LARGEST, max), (SMALLEST, min)):
        for name in names:
            row = _pick(name, rows, pick)
            numbers[name] = None if row is None else getattr(row, name)
            if row is not None:
                worst[name] = row.joint
    heats = [r.winding_temperature for r in rows if not isinstance(r.winding_temperature, str)]
    numbers["winding_temperature"] = max(heats) if len(heats) == len(rows) else UNKNOWN
    decides = max(rows, key=lambda row: row.deciding_use)
    motor = ", ".join(dict.fromkeys(row.motor for row in rows))
    sources = dict.fromkeys(row.thermal_source for row in rows)
    source = next(name for name in (UNKNOWN, "assumed", "published") if name in sources)
    return MotorUse(
        joint=decides.joint, kind=kind, motor=motor, thermal_source=source, **numbers,
        failures=_failures(rows), worst=worst,
    )  # fmt: skip


def _pick(name: str, rows: Sequence[MotorUse], pick: Callable[..., MotorUse]) -> MotorUse | None:
    known = [row for row in rows if getattr(row, name) is not None]
    return pick(known, key=lambda row: getattr(row, name)) if known else None


def _failures(rows: Sequence[MotorUse]) -> dict[str, str]:
    """Return one sentence for each number that fails: that of the joint where it is largest."""
    found: dict[str, str] = {}
    for name in (*USES, "winding_temperature"):
        failing = [row for row in rows if name in row.failures]
        if failing:
            found[name] = max(failing, key=lambda row: getattr(row, name)).failures[name]
    return found
