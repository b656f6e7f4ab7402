"""Controllers: they plan a joint reference before a run."""

from hexapod_pin.control.hold_posture import Hold as Hold
from hexapod_pin.control.joint_trajectory import Controller as Controller
from hexapod_pin.control.joint_trajectory import Plan as Plan
from hexapod_pin.control.kinematic import KinematicControl as KinematicControl
from hexapod_pin.control.sampled_trajectory import Held as Held
