"""The yaw rate that a run's gait plans."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hexapod_pin.errors import ParameterError
from hexapod_pin.spec import parsed_toml


def gait_turn_rate(meta: Mapping[str, Any]) -> float:
    """Return the planned yaw rate of the gait that a run's controller names [rad/s], or 0."""
    if "gait_turn_rate" in meta:
        return float(meta["gait_turn_rate"])
    text = str(meta.get("controller", ""))
    try:
        gait = parsed_toml(text).get("gait", {}) if text else {}
    except ParameterError:
        return 0.0
    return float(gait.get("turn_rate", 0.0)) if isinstance(gait, Mapping) else 0.0
