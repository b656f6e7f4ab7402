"""What a user says about a robot that its URDF does not: it goes before everything inferred."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class RobotHints:
    """Overrides of what would be inferred; None leaves it to be inferred.

    Attributes:
        forward: direction of travel in the root link's frame: "x", "-y", ... or an angle about the
            trunk's upward axis from the root link's x axis [degrees].
        legs: leg name -> its joints from the trunk outwards, or one joint or link of it.
        feet: foot links, one per leg.
        foot_radius: of all foot spheres [m].
        posture: standing angles by joint name, or in joint order [rad].
        held: places of joints that do not walk, by name [rad or m].
    """

    forward: str | float | None = None
    legs: Mapping[str, Sequence[str]] | None = None
    feet: Sequence[str] | None = None
    foot_radius: float | None = None
    posture: Sequence[float] | Mapping[str, float] | None = None
    held: Mapping[str, float] | None = None
