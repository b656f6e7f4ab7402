"""What a user says about a robot that its URDF does not: it goes before everything inferred."""

from __future__ import annotations

from hexapod_pin.spec import Spec

Names = tuple[str, ...]


class RobotHints(Spec):
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

    forward: float | str | None = None
    legs: dict[str, Names] | None = None
    feet: Names | None = None
    foot_radius: float | None = None
    posture: dict[str, float] | tuple[float, ...] | None = None
    held: dict[str, float] | None = None
