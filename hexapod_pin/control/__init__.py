"""Controllers: they plan a joint reference before a run."""

from hexapod_pin.control.held import Held as Held
from hexapod_pin.control.hold import Hold as Hold
from hexapod_pin.control.kinematic import KinematicControl as KinematicControl
from hexapod_pin.control.reference import Controller as Controller
from hexapod_pin.control.reference import Plan as Plan
