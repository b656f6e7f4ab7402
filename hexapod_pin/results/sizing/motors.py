"""The motors of all joints are arrays of derated limits.

Their rotors are compared with the load, which gives the best gear ratio.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.drive.catalog import MotorRecord
from hexapod_pin.drive.catalog.identified import identified_for
from hexapod_pin.drive.catalog.motor_record import Derating
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.sizing.demand import JointDemand


@dataclass(frozen=True, eq=False)
class Motors:
    """Of n joints; NaN where a data sheet has no value.

    Attributes:
        records: row of the catalogue of each joint.
        name: of all rows in short.
        derating: what is allowed of them.
        stall: T0 at the rated voltage (n,) [N m].
        no_load: w0 at the rated voltage (n,) [rad/s].
        continuous: torque that is allowed for ever (n,) [N m].
        rated: the maker's own rating of it (n,) [N m].
        armature: rotor inertia at the joint, estimated where none is published (n,) [kg m^2].
        ratio: gear ratio (n,) [-].
        stall_current: I0 at the rated voltage (n,) [A].
        standby_current: of the electronics, *assumed* where none is published (n,) [A].
        rated_voltage: V (n,) [V].
        notes: what is assumed, doubtful or unknown of the rows.
    """

    records: tuple[MotorRecord, ...]
    name: str
    derating: Derating
    stall: Array
    no_load: Array
    continuous: Array
    rated: Array
    armature: Array
    ratio: Array
    stall_current: Array
    standby_current: Array
    rated_voltage: Array
    notes: tuple[str, ...]

    @property
    def heat_known(self) -> list[bool]:
        """Whether each motor's thermal constants, and what they need, are published."""
        return [all(getattr(row, name) for name in THERMAL) for row in self.records]

    @classmethod
    def of(
        cls,
        kinds: Sequence[str],
        record: MotorRecord | Mapping[str, MotorRecord],
        derating: Derating,
    ) -> Motors:
        """Return the motors of joints of these kinds.

        Raises:
            ParameterError: a row has no no-load speed.
        """
        by_kind = record if isinstance(record, Mapping) else dict.fromkeys(kinds, record)
        records = tuple(by_kind[kind] for kind in kinds)
        distinct = {row.name: row for row in records}
        for row in distinct.values():
            if row.no_load_speed is None:
                raise ParameterError(
                    "MotorRecord.no_load_speed", None, f"known of {row.name} [rad/s]",
                    "Without it there is no torque-speed line to hold a joint against.",
                )  # fmt: skip

        def column(value: Callable[[MotorRecord], float | None]) -> Array:
            found = {name: value(row) for name, row in distinct.items()}
            plain = {name: np.nan if v is None else float(v) for name, v in found.items()}
            return np.array([plain[row.name] for row in records])

        name = next(iter(distinct)) if len(distinct) == 1 else _names(kinds, records)
        return cls(
            records=records, name=name, derating=derating,
            stall=column(lambda r: r.stall_torque),
            no_load=column(lambda r: r.no_load_speed),
            continuous=column(derating.continuous_torque),
            rated=column(lambda r: r.rated_torque),
            armature=column(lambda r: r.joint_armature),
            ratio=column(lambda r: r.gear_ratio),
            stall_current=column(lambda r: r.stall_current),
            standby_current=column(standby_current),
            rated_voltage=column(lambda r: r.voltage),
            notes=tuple(note for row in distinct.values() for note in _notes(row, derating)),
        )  # fmt: skip

    def allowed(self, torque: Array, speed: Array, voltage: Array | None = None) -> Array:
        """Return the largest |torque| that is allowed at a speed, in the torque's direction [N m].

        The derating's share of the line of `hp.Motor`, U T0 - T0 v / v0 with v > 0 where the joint
        drives and v < 0 where it brakes, U the derated voltage; <= 0 where it cannot drive.

        Args:
            torque: its sign counts. Shape (..., n).
            speed: signed. Shape (..., n).
            voltage: U of the supply over the rated one [-]. Shape (..., n) or (..., 1); None: that
                of the derating.
        """
        supply = self.derating.voltage if voltage is None else voltage
        share = supply - np.sign(torque) * speed / self.no_load
        return np.asarray(self.derating.peak * self.stall * share)


THERMAL = (
    "winding_resistance", "torque_constant", "gear_ratio", "thermal_resistance_winding",
    "thermal_resistance_housing", "thermal_time_winding", "thermal_time_housing",
)  # fmt: skip
"""Columns without which a motor's temperatures are of assumed constants."""


def _names(kinds: Sequence[str], records: Sequence[MotorRecord]) -> str:
    rows = {kind: row.name for kind, row in zip(kinds, records, strict=True)}
    return ", ".join(f"{kind}: {name}" for kind, name in rows.items())


def _notes(row: MotorRecord, derating: Derating) -> list[str]:
    """Return what to know of a row of the catalogue, and what lasting torque it is given."""
    lasting = (
        f"continuous torque {derating.continuous_torque(row):.3g} N m, {derating.continuous:g} of "
        "the stall torque, as of every maker"
    )
    if row.rated_torque is not None:
        lasting += f"; the maker's own rating, not used: {row.rated_torque:.3g} N m"
    notes = [lasting, *row.flags, *(f"assumed: {text}" for text in row.assumed)]
    if drive := identified_for(row):
        notes.append(
            f"current and heat from the motor and gear as identified (friction {drive.form}, "
            f"{drive.source})"
        )
    elif row.stall_current is not None:
        low, high = SHEET_CURRENT
        notes.append(
            f"assumed: its gear takes what a data sheet says; identified servos draw {low:g} to "
            f"{high:g} times the current of theirs"
        )
    if row.standby_current is None:
        notes.append(
            f"assumed: standby current {1e3 * standby_current(row):g} mA, none is published"
        )
    return [f"{row.name}: {note}" for note in notes]


SHEET_CURRENT = 0.45, 2.2
"""RMS current with an identified gear over that by the data sheet, 5 and 95 % of the joints that
take 2 to 35 % of the stall torque (docs/results/motor_criterion.md; median 1.3)."""

STANDBY_BUS = 0.04
"""Standby current of a servo on a bus [A]: median of the catalogue's published ones (*assumed*)."""

STANDBY_PWM = 0.01
"""Of a servo with a pulse as its command [A]: Hitec's HS-311 draws 8 mA at rest (*assumed*)."""


def standby_current(row: MotorRecord) -> float:
    """Return the current of a motor's electronics alone [A], *assumed* where none is published."""
    if row.standby_current is not None:
        return row.standby_current
    return STANDBY_PWM if row.buses == ("PWM",) else STANDBY_BUS


# Rotor against load: reflected inertia, inertia ratio, and the gear ratio of least RMS torque.
#
# tau_motor,rms^2 (N) = A / N^2 + 2 B + C N^2 with A the mean of the squared load torque and C the
# mean of (J_rotor acceleration)^2 is least at N* = (A / C)^(1/4), whatever B: of a pure inertia
# sqrt(J_load / J_rotor), the matched inertia (Pasch & Seering 1984). Losses of the gear left out.


def gear_numbers(demand: JointDemand, motors: Motors) -> dict[str, Array]:
    """Return inertias and gear ratios by their names in `MotorUse`; NaN where unknown."""
    with np.errstate(divide="ignore", invalid="ignore"):
        limit = motors.ratio * motors.derating.voltage * motors.no_load / demand.speed_peak
        best = optimal_ratio(
            demand.torque_rms_with_armature(0.0), motors.armature / motors.ratio**2,
            demand.acceleration_rms,
        )  # fmt: skip
        ratio = demand.load_inertia / motors.armature
    return {
        "armature": motors.armature,
        "inertia_ratio": _finite(ratio),
        "optimal_ratio": _finite(np.minimum(best, limit)),
        "ratio_limit": _finite(limit),
        "torque_rms_with_armature": demand.torque_rms_with_armature(motors.armature),
    }


def optimal_ratio(load_rms: Array, rotor_inertia: Array, acceleration_rms: Array) -> Array:
    """Return the gear ratio N* = (A / C)^(1/4) at which the motor's RMS torque is least [-].

    Args:
        load_rms: root of A, RMS torque at the joint without the rotor's share [N m].
        rotor_inertia: of rotor and gear at the motor's shaft [kg m^2].
        acceleration_rms: of the joint [rad/s^2]; root of C is its product with the inertia.
    """
    return np.asarray(np.sqrt(load_rms / (rotor_inertia * acceleration_rms)))


def _finite(values: Array) -> Array:
    """Return NaN for what no motion or no rotor makes infinite."""
    return np.where(np.isfinite(values), values, np.nan)
