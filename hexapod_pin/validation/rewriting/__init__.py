"""The same robot written in other conventions: what a reader of URDF must not depend on."""

from hexapod_pin.validation.rewriting.conventions import ConventionSet
from hexapod_pin.validation.rewriting.rewrite import JointChange, Rewritten, rewrite

__all__ = ["ConventionSet", "JointChange", "Rewritten", "rewrite"]
