"""The worst use of a kind of joint over all walks."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from hexapod_pin.results.motor_selection import USES, KindUse

if TYPE_CHECKING:
    from hexapod_pin.results.sizing import MotorBudget


def kind_use(kind: str, budgets: Mapping[str, MotorBudget], walks: tuple[str, ...]) -> KindUse:
    """Return the worst use of a kind of joint over all walks."""
    missing = [walk for walk in walks if walk not in budgets]
    rows = {walk: budget.kind(kind) for walk, budget in budgets.items()}

    def worst(name: str) -> tuple[float, str]:
        values = {walk: float(getattr(row, name)) for walk, row in rows.items()}
        if not values or any(math.isnan(x) for x in values.values()):
            return math.nan, next((w for w, x in values.items() if math.isnan(x)), "")
        walk = max(values, key=lambda key: values[key])
        return values[walk], walk

    found = {name: worst(f"{name}_use") for name in (*USES, "lost_leg")}
    reasons = [f"{r} ({walk})" for walk, row in rows.items() for r in row.reasons]
    reasons += [f"no torques known of {walk}: it cannot be simulated" for walk in missing]
    return KindUse(
        kind=kind, **{name: found[name][0] for name in (*USES, "lost_leg")},
        outside=max((row.outside_share for row in rows.values()), default=math.nan),
        inertia_ratio=max((row.inertia_ratio for row in rows.values()), default=math.nan),
        walk={name: found[name][1] for name in USES}, reasons=tuple(dict.fromkeys(reasons)),
    )  # fmt: skip
