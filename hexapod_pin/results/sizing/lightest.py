"""The lightest motor of a catalogue that carries each kind of joint of one run."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from hexapod_pin.arguments import checked
from hexapod_pin.drive.catalog import MotorRecord
from hexapod_pin.drive.catalog.motor_record import Derating
from hexapod_pin.immutable import Immutable
from hexapod_pin.results.sizing.demand import JointDemand
from hexapod_pin.results.sizing.motor_budget import NO_MOTOR, motor_budget


@dataclass(frozen=True)
class LightestMotor(Immutable):
    """The lightest motor that carries all joints of one kind.

    Attributes:
        kind: of joint.
        motor: its name and voltage.
        mass: of one motor [kg].
        use: largest need over what is allowed: torque, continuous torque, speed, holding [-].
    """

    kind: str
    motor: str
    mass: float
    use: float


@checked
def lightest_motors(
    demand: JointDemand, records: Iterable[MotorRecord], derating: Derating | None = None
) -> dict[str, LightestMotor | None]:
    """Return the lightest motor that passes, by kind of joint; None where none does.

    The criterion is that of `motor_budget`: peak against the derated line, continuous torque,
    speed, holding torque, and heat where its constants are known. Neither the motors' masses nor
    their rotors are in the run: `select_motors` simulates them.

    Args:
        demand: what the joints of a run need.
        records: rows of a catalogue; those without a mass or a torque-speed line are left out.
        derating: what of the data sheets is allowed; None: the default.
    """
    usable = [row for row in records if row.mass and row.stall_torque and row.no_load_speed]
    found: dict[str, LightestMotor | None] = {
        kind: None for kind in demand.joint_kinds if kind not in NO_MOTOR
    }
    for row in sorted(usable, key=lambda row: row.mass or math.inf):
        left = [kind for kind, motor in found.items() if motor is None]
        if not left:
            break
        for use in motor_budget(demand, row, derating, kinds=left).kinds:
            if use.passes:
                found[use.kind] = LightestMotor(
                    use.kind, row.name, row.mass or 0.0, use.deciding_use
                )
    return found
