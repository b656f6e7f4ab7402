"""Stairs, ramps, ledges and grooves: ground that changes along one heading only.

`heading` is the direction of the profile in the horizontal plane, from x to y [rad]; places along
it are measured from the world's origin [m].
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field

from hexapod_pin.ground.terrain.ground import MAX_FACE_ANGLE_RAD, Ground, Heading, Place, Size
from hexapod_pin.ground.terrain.polyline import Polyline

FaceAngle = Annotated[float, Field(gt=0.0, le=MAX_FACE_ANGLE_RAD)]


class Stairs(Ground):
    """Steps that go up along the heading; level before the first and after the last.

    Turn the heading round to walk down: `Stairs(..., start=-1.0, heading=pi)` puts the first step
    at x = 1 m, the top at its negative side.

    Attributes:
        rise: height of a step [m].
        run: depth of a tread [m].
        count: number of risers [-].
        start: place of the first riser along the heading [m].
        heading: [rad].
        height: z of the ground before the first step [m].
    """

    kind: Literal["stairs"] = "stairs"
    rise: Size
    run: Size
    count: Annotated[int, Field(ge=1, le=1000)]
    start: Place = 0.0
    heading: Heading = 0.0
    height: Place = 0.0

    def surface(self) -> Polyline:
        """Return the polyline of risers and treads."""
        places = [self.start + k * self.run for k in range(self.count)]
        levels = [self.height + k * self.rise for k in range(self.count + 1)]
        s = [place for place in places for _ in range(2)]
        z = [level for k in range(self.count) for level in (levels[k], levels[k + 1])]
        return Polyline(self.heading, tuple(s), tuple(z))


class Ramp(Ground):
    """Level ground, a slope, and level ground again.

    Attributes:
        angle: inclination [rad], positive: it rises along the heading. 60 degrees at most.
        run: level length of the slope [m].
        start: where the slope begins along the heading [m].
        heading: [rad].
        height: z of the ground before the slope [m].
    """

    kind: Literal["ramp"] = "ramp"
    angle: Annotated[float, Field(ge=-MAX_FACE_ANGLE_RAD, le=MAX_FACE_ANGLE_RAD)]
    run: Size
    start: Place = 0.0
    heading: Heading = 0.0
    height: Place = 0.0

    def surface(self) -> Polyline:
        """Return the polyline of the level parts and the slope."""
        top = self.height + self.run * math.tan(self.angle)
        return Polyline(self.heading, (self.start, self.start + self.run), (self.height, top))


class Ledge(Ground):
    """A shelf that ends at an edge; beyond it the ground lies at z = 0.

    Attributes:
        height: of the shelf [m].
        edge: place of the edge along the heading [m]; the shelf is before it.
        heading: [rad].
    """

    kind: Literal["ledge"] = "ledge"
    height: Size
    edge: Place = 0.0
    heading: Heading = 0.0

    def surface(self) -> Polyline:
        """Return the polyline of shelf, riser and ground."""
        return Polyline(self.heading, (self.edge, self.edge), (self.height, 0.0))


class Groove(Ground):
    """A V-shaped groove across the heading, in ground at z = 0.

    Attributes:
        angle_left: inclination of the face before the bottom, going down [rad], 60 degrees at most.
        angle_right: inclination of the face after the bottom, going up [rad].
        depth: of the bottom below the ground [m].
        bottom: place of the bottom along the heading [m].
        heading: [rad].
    """

    kind: Literal["groove"] = "groove"
    angle_left: FaceAngle
    angle_right: FaceAngle
    depth: Size = 0.05
    bottom: Place = 0.0
    heading: Heading = 0.0

    def surface(self) -> Polyline:
        """Return the polyline of the two faces."""
        left = self.bottom - self.depth / math.tan(self.angle_left)
        right = self.bottom + self.depth / math.tan(self.angle_right)
        return Polyline(self.heading, (left, self.bottom, right), (0.0, -self.depth, 0.0))
