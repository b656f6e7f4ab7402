"""The sticking assumption of S2 appendix eqs. 3-5: each foot's force against its friction cone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array

if TYPE_CHECKING:
    from hexapod_pin.formulations.rigid.model import RigidModel

ROUNDING_SHARE = 1e-9
"""Forces below this share of the largest count as zero [-]."""


@dataclass(frozen=True)
class StickingCheck:
    """The sticking assumption for one grounded foot.

    Attributes:
        foot: its name.
        normal: force (or impulse) along the ground's normal [N or N s]; negative pulls.
        tangential: size of the rest [N or N s].
        verdict: "sticks", "pulls" (the ground would have to hold it down) or "slides" (outside
            the friction cone).
        unique: whether all three components are determined; else they are one choice of many.
    """

    foot: str
    normal: float
    tangential: float
    verdict: str
    unique: bool

    @property
    def holds(self) -> bool:
        """Whether the assumption held."""
        return self.verdict == "sticks"

    @property
    def ratio(self) -> float:
        """Coefficient of friction it needs [-]; infinite where it is not pressed on."""
        if self.tangential == 0.0:
            return 0.0
        return self.tangential / self.normal if self.normal > 0.0 else float("inf")


def check_sticking(
    model: RigidModel, feet: Sequence[int], force: Array, unique: NDArray[np.bool_]
) -> tuple[StickingCheck, ...]:
    """Return one check per foot on the ground.

    Args:
        model: the robot and its ground.
        feet: indices of the feet on the ground.
        force: forces or impulses on all feet, world axes. Shape (F, 3).
        unique: which of their components are determined. Shape (F, 3).
    """
    names, small = model.foot_names, ROUNDING_SHARE * float(np.abs(force).max(initial=0.0))
    checks = []
    for k in feet:
        normal = float(force[k] @ model.normal)
        tangential = float(np.linalg.norm(force[k] - normal * model.normal))
        verdict = "sticks"
        if normal < -small:
            verdict = "pulls"
        elif tangential > model.ground.mu * max(normal, 0.0) + small:
            verdict = "slides"
        checks.append(StickingCheck(names[k], normal, tangential, verdict, bool(unique[k].all())))
    return tuple(checks)
