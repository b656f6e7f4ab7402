"""What the joints take of one motor: results, as data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from hexapod_pin.arguments import explain_methods
from hexapod_pin.results.plain_json import without_non_finite

UNKNOWN = "unknown"
"""Stands where a data sheet does not tell what a number needs."""

USES = (
    "peak_use", "continuous_use", "thermal_use", "standing_use", "holding_use", "lost_leg_use",
    "speed_use",
)  # fmt: skip
"""Need over what the derated motor allows."""


@explain_methods
@dataclass(frozen=True)
class MotorUse:
    """What one joint, or the worst of several, takes of a motor. A use passes at <= 1.

    None: unknown, because the data sheet or the run does not tell; never taken as passed silently,
    the budget's notes say it.

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
        current_peak: of the motor, from data-sheet currents, an estimate [A].
        current_rms: the same [A].
        reflected_inertia: of the rotor at the joint [kg m^2].
        inertia_ratio: load inertia over reflected inertia [-].
        optimal_ratio: gear ratio of least RMS torque of the motor, no higher than its speed
            allows [-].
        ratio_limit: the gear ratio at which its speed is all used [-].
        rms_with_rotor: RMS torque with this motor's rotor at the same motion, an estimate [N m].
        winding_temperature: hottest of the winding in lasting walking [deg C], or "unknown".
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
    reflected_inertia: float | None
    inertia_ratio: float | None
    optimal_ratio: float | None
    ratio_limit: float | None
    rms_with_rotor: float | None
    winding_temperature: float | str
    failures: Mapping[str, str] = field(default_factory=dict)
    worst: Mapping[str, str] = field(default_factory=dict)

    @property
    def passes(self) -> bool:
        """Whether every use that is asked for and known is <= 1, and the winding stays cool."""
        return not self.failures

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why it does not pass."""
        return tuple(self.failures.values())

    def to_dict(self) -> dict[str, Any]:
        """Return all numbers as plain data."""
        return asdict(self) | {"passes": self.passes, "deciding_use": self.deciding_use}

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


@explain_methods
@dataclass(frozen=True)
class BatteryLoad:
    """What all joints together draw at the same time; from data-sheet currents, an estimate.

    A motor at torque tau and speed w runs at the duty d = tau / T0 + w / w0 of its rated voltage V
    and takes the current i = I0 tau / T0 (T0 stall torque, w0 no-load speed, I0 stall current): its
    electrical power is V d i. Without regeneration, what a joint's motor would give back is
    lost in its drive. Standby currents are added. All None where a data sheet has no current.

    Attributes:
        voltage: of the supply under load [V].
        peak_current: largest sum of all joints, without regeneration [A].
        mean_current: [A].
        rms_current: [A].
        peak_power: largest sum without regeneration [W].
        mean_power: without regeneration [W].
        mean_power_regeneration: what is given back counts [W].
        energy: per cycle (or window) without regeneration [J].
        energy_regeneration: the same where what is given back counts [J].
        cost_of_transport: energy / (m g d) without regeneration [-]; None where it makes no way.
        cost_of_transport_regeneration: the same with it [-].
        sum_of_peaks: of the joints' own largest currents, for comparison [A].
        unknown: why there are no numbers; empty where there are.
    """

    voltage: float | None = None
    peak_current: float | None = None
    mean_current: float | None = None
    rms_current: float | None = None
    peak_power: float | None = None
    mean_power: float | None = None
    mean_power_regeneration: float | None = None
    energy: float | None = None
    energy_regeneration: float | None = None
    cost_of_transport: float | None = None
    cost_of_transport_regeneration: float | None = None
    sum_of_peaks: float | None = None
    unknown: str = ""

    def run_time(self, energy: float) -> float | None:
        """Return how long a battery lasts, nothing given back [s]; None where that is unknown.

        Args:
            energy: that the battery can give [J], such as 0.8 of its capacity; of 1 Wh 3600 J.
        """
        return energy / self.mean_power if self.mean_power else None


UNITS = {
    "margin": "N m", "current_peak": "A", "current_rms": "A", "reflected_inertia": "kg m^2",
    "rms_with_rotor": "N m", "winding_temperature": "deg C", "voltage": "V", "peak_current": "A",
    "mean_current": "A", "rms_current": "A", "peak_power": "W", "mean_power": "W",
    "mean_power_regeneration": "W", "energy": "J", "energy_regeneration": "J",
    "sum_of_peaks": "A", "duration": "s", "peak_torque": "N m", "p99_torque": "N m",
    "rms_torque": "N m", "standing": "N m", "holding": "N m", "holding_lost_leg": "N m",
    "peak_speed": "rad/s", "rms_speed": "rad/s", "positive_energy": "J", "negative_energy": "J",
    "load_inertia": "kg m^2",
    "acceleration_rms": "rad/s^2", "torque_acceleration": "N m rad/s^2",
}  # fmt: skip
"""Unit of every number of `MotorBudget.to_dict` that has one; the others are ratios [-]."""


def finite(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return plain data that JSON can hold: NaN and infinities as None."""
    found: dict[str, Any] = without_non_finite(dict(data))
    return found
