"""The same robot written in other conventions: what a reader of URDF must not depend on."""

from rewriting.conventions import ConventionSet
from rewriting.rewrite import JointChange, Rewritten, rewrite

__all__ = ["ConventionSet", "JointChange", "Rewritten", "rewrite"]
