"""Derating: how much of a motor's data sheet a lasting, reliable use may ask for."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from hexapod_pin.drive.catalog.motor_record import MotorRecord
from hexapod_pin.spec import Spec

Share = Annotated[float, Field(gt=0.0, le=1.0)]

STALL_FIFTH = (
    "continuous 0.2: ROBOTIS states for AX-12A, AX-18A and XL-320 that the stall torque is the "
    "largest instantaneous and static torque, and that motion is stable when a robot is designed "
    "for loads of 1/5 or less of it (e-Manual, emanual.robotis.com/docs/en/dxl/ax/ax-12a)"
)
FEETECH_TEST = (
    "continuous 0.2 is cautious for servos with metal gears: a Feetech STS3215 (30 kgf cm) held "
    "half of its stall torque for over an hour at 48 deg C, cut out at 0.67 of it, and came to "
    "71 deg C in 110 min of swinging (github.com/TheRobotStudio/SO-ARM100/issues/134)"
)
PEAK_CURVE = (
    "peak 0.8 *assumed*: ROBOTIS measures its performance graphs with a slowly rising load and "
    "states that their largest torque lies below the stall torque (e-Manual); by how much differs "
    "from model to model"
)
SAGGING_BATTERY = (
    "voltage 0.9 *assumed*: a lithium cell of 3.7 V nominal is at 3.3 to 3.4 V under load near "
    "the end of its charge"
)


class Derating(Spec):
    """Shares of a motor's published numbers that may be used; all defaults can be changed.

    Attributes:
        peak: largest torque over the torque of the motor's line at that speed [-].
        continuous: RMS torque over stall torque where no rated torque is published [-].
        voltage: supply under load over the record's voltage [-].
    """

    peak: Share = 0.8
    continuous: Share = 0.2
    voltage: Share = 0.9

    @property
    def evidence(self) -> tuple[str, ...]:
        """What the values rest on; of values that were changed: that the user stated them."""
        default = Derating()
        grounds = {
            "peak": (PEAK_CURVE,),
            "continuous": (STALL_FIFTH, FEETECH_TEST),
            "voltage": (SAGGING_BATTERY,),
        }
        lines: list[str] = []
        for name, texts in grounds.items():
            value = getattr(self, name)
            stated = (f"{name} {value:g}: stated by the user",)
            lines += texts if value == getattr(default, name) else stated
        return tuple(lines)

    def continuous_torque(self, record: MotorRecord) -> float:
        """Return the RMS torque that may last for ever [N m].

        The rated torque where the maker publishes one, else `continuous` of the stall torque. It is
        set by heat, so a sagging battery does not change it.
        """
        if record.rated_torque is not None:
            return record.rated_torque
        return self.continuous * record.stall_torque
