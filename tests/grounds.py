"""Grounds that several tests use, and points on and above them."""

from __future__ import annotations

import math

import numpy as np

import hexapod_pin as hp
from hexapod_pin.ground.terrain import Polyline

STAIRS = hp.Stairs(rise=0.1, run=0.2, count=3, start=0.1, heading=0.7)
DOWN = hp.Stairs(rise=0.1, run=0.2, count=3, start=-1.2, heading=math.pi)
LEDGE = hp.terrain.Ledge(height=0.1, edge=0.2, heading=-2.0)
GROOVE = hp.terrain.Groove(angle_left=0.5, angle_right=1.0, depth=0.1, heading=2.2, bottom=0.3)
RAMP = hp.terrain.Ramp(angle=0.4, run=0.5, start=0.1, heading=-1.1, height=0.05)
HILLS = hp.HeightField.random(3, amplitude=0.02, wavelength=0.3, size=2.0)
SLOPE = hp.Slope(angle=0.3, heading=-0.8, point=(0.1, 0.2, 0.3))
PATCHED = hp.terrain.PatchedGround(
    ground=SLOPE,
    patches=(
        hp.terrain.Patch(low=(0.0, 0.0), high=(1.0, 1.0), friction=0.2),
        hp.terrain.Patch(low=(0.5, 0.5), high=(2.0, 2.0), friction=3.0, stiffness=0.1),
    ),
)
SHAKEN = hp.terrain.ShakingGround(ground=PATCHED, amplitude=0.01, frequency=3.0)
PROFILES = {"stairs": STAIRS, "down": DOWN, "ledge": LEDGE, "groove": GROOVE, "ramp": RAMP}
ALL = {
    **PROFILES, "flat": hp.Flat(height=0.1), "slope": SLOPE, "hills": HILLS, "patched": PATCHED,
    "shaken": SHAKEN,
}  # fmt: skip


def world(line: Polyline, s: float, z: float, sideways: float = 0.0) -> np.ndarray:
    """The point at distance s along a profile, z above zero."""
    along = line.along
    return np.array([s * along[0] - sideways * along[1], s * along[1] + sideways * along[0], z])


def nearest(terrain, center, radius: float) -> tuple[float, np.ndarray]:
    """Return gap and normal of the nearest contact of a sphere."""
    return min(terrain.native().contacts(np.asarray(center, float), radius), key=lambda c: c[0])


def dense(line: Polyline, spacing: float) -> np.ndarray:
    """Points (N, 2) all along a profile, its level ends included."""
    s = np.concatenate([[line.s[0] - 1.0], line.s, [line.s[-1] + 1.0]])
    z = np.concatenate([line.z[:1], line.z, line.z[-1:]])
    pieces = []
    for k in range(len(s) - 1):
        length = math.hypot(s[k + 1] - s[k], z[k + 1] - z[k])
        t = np.linspace(0.0, 1.0, max(2, math.ceil(length / spacing)))[:, None]
        pieces.append((1.0 - t) * (s[k], z[k]) + t * (s[k + 1], z[k + 1]))
    return np.concatenate(pieces)


def places(count: int = 60, reach: float = 1.15) -> np.ndarray:
    """Return random points (count, 2) within a square."""
    return np.random.default_rng(4).uniform(-reach, reach, (count, 2))
