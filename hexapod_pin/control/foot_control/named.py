"""Foot control by name, as S1 compares it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from hexapod_pin.control.foot_control.controller import FootControl
from hexapod_pin.control.foot_control.levelling import Levelling
from hexapod_pin.control.foot_control.slip_pid import SlipPid
from hexapod_pin.control.foot_control.touch_down import TouchDown
from hexapod_pin.control.foot_control.virtual_suspension import VirtualSuspension
from hexapod_pin.errors import UnknownNameError

S1_PARTS: dict[str, dict[str, type]] = {
    "slip": {"slip": SlipPid},
    "suspension": {"suspension": VirtualSuspension},
    "both": {"slip": SlipPid, "suspension": VirtualSuspension},
    "all": {
        "slip": SlipPid, "suspension": VirtualSuspension,
        "touch_down": TouchDown, "levelling": Levelling,
    },
}  # fmt: skip
"""Parts of each kind of foot control, with their default (*assumed*) numbers."""

CONVENTIONAL = "conventional"
"""The walk as it is planned: S1's kinematic control."""


def named_controls(walk: Any, names: Sequence[str] = (CONVENTIONAL, *S1_PARTS)) -> dict[str, Any]:
    """Return controllers of one walk by name: "conventional", "slip", "suspension", "both", "all".

    "all" adds touch-down by what is felt, and levelling. For whatever walks without knowing the
    ground take that one.

    Args:
        walk: a gait or an open-loop walk, as of `FootControl`.
        names: which.

    Raises:
        UnknownNameError: there is no such controller.
    """
    found: dict[str, Any] = {}
    for name in names:
        if name != CONVENTIONAL and name not in S1_PARTS:
            raise UnknownNameError("controller", name, [CONVENTIONAL, *S1_PARTS])
        parts = {part: kind() for part, kind in S1_PARTS.get(name, {}).items()}
        control = FootControl(walk, **parts)
        found[name] = control if parts else control.walk
    return found
