"""Foot control after S1: slip correction, virtual suspension, and what goes with them."""

from hexapod_pin.control.foot_control.controller import FootControl, named_controls
from hexapod_pin.control.foot_control.parameters import (
    FootForceSensing,
    Levelling,
    SlipPid,
    TouchDown,
    VirtualSuspension,
)
from hexapod_pin.control.foot_control.stability import spectral_radius, stable_range

__all__ = [
    "FootControl",
    "FootForceSensing",
    "Levelling",
    "SlipPid",
    "TouchDown",
    "VirtualSuspension",
    "named_controls",
    "spectral_radius",
    "stable_range",
]
