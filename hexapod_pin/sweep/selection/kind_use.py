"""The worst use of a kind of joint over all walks."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from hexapod_pin.results.motor_selection import USES, KindUse

if TYPE_CHECKING:
    from hexapod_pin.results.sizing import MotorBudget, MotorUse


Uses = Mapping[str, "MotorUse"]
"""What the worst joints take of their motor, by kind of joint."""


def uses_of(budget: MotorBudget) -> Uses:
    """Return what of a budget is kept: it holds all samples of a walk."""
    return {row.kind: row for row in budget.kinds}


def kind_use(kind: str, budgets: Mapping[str, Uses], walks: tuple[str, ...]) -> KindUse:
    """Return the worst use of a kind of joint over all walks.

    Args:
        kind: of joint.
        budgets: uses on the walks that could be simulated.
        walks: names of all walks.
    """
    rows = {walk: uses[kind] for walk, uses in budgets.items()}

    def worst(name: str) -> tuple[float, str]:
        known = {walk: value for walk, row in rows.items()
                 if (value := getattr(row, name)) is not None}  # fmt: skip
        if not known:
            return math.nan, ""
        walk = max(known, key=lambda key: known[key])
        return float(known[walk]), walk

    found = {name: worst(f"{name}_use") for name in (*USES, "lost_leg")}
    found["holding"] = max(found["holding"], worst("standing_use"), key=_known)
    reasons = [f"{reason} ({walk})" for walk, row in rows.items() for reason in row.reasons]
    reasons += [f"{walk}: cannot be simulated" for walk in walks if walk not in budgets]
    return KindUse(
        kind=kind, **{name: found[name][0] for name in (*USES, "lost_leg")},
        outside=worst("outside_share")[0], inertia_ratio=worst("inertia_ratio")[0],
        walk={name: found[name][1] for name in USES}, reasons=tuple(dict.fromkeys(reasons)),
    )  # fmt: skip


def _known(use: tuple[float, str]) -> float:
    return -math.inf if math.isnan(use[0]) else use[0]
