"""Foot control after S1: slip correction, virtual suspension, and what goes with them."""

from hexapod_pin.control.foot_control.controller import FootControl
from hexapod_pin.control.foot_control.foot_force_sensing import FootForceSensing
from hexapod_pin.control.foot_control.levelling import Levelling
from hexapod_pin.control.foot_control.named import named_controls
from hexapod_pin.control.foot_control.slip_pid import SlipPid
from hexapod_pin.control.foot_control.stable_range import stable_range
from hexapod_pin.control.foot_control.stance_loop import spectral_radius
from hexapod_pin.control.foot_control.touch_down import TouchDown
from hexapod_pin.control.foot_control.virtual_suspension import VirtualSuspension

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
