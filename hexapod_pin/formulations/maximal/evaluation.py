"""What solving the equations at one state gives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.formulations.maximal.constraints import Constraints
    from hexapod_pin.formulations.maximal.placement import Placement
    from hexapod_pin.formulations.maximal.touch import Touch


@dataclass(frozen=True, eq=False)
class Evaluation:
    """The solution at one state.

    Attributes:
        acceleration: (nb, 6) v', world axes [m/s^2], [rad/s^2].
        multipliers: (nj, 5) lambda [N, N, N, N m, N m].
        support: (h,) multipliers of the mount [N], [N m].
        torque: (nj,) of the servos [N m].
        passive: (nj,) of damping and stops [N m].
        placement: of the bodies.
        constraints: of the joints.
        touch: the contacts; None without feet.
    """

    acceleration: Array
    multipliers: Array
    support: Array
    torque: Array
    passive: Array
    placement: Placement
    constraints: Constraints
    touch: Touch | None
