"""A page's size: the rate of pictures, and the triangles of meshes, that keep it small."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence

from hexapod_pin.view.mesh_store import MESH_BUDGET, TRIANGLE_BYTES
from hexapod_pin.view.meshcat_commands import Command
from hexapod_pin.view.page import still_bytes

PAGE_BYTES = 10_000_000
"""Largest HTML file [bytes]; long walks have fewer pictures per second to keep it."""
LEAST_MOTION_BYTES = 1_000_000
"""Left for the motion whatever the still picture takes [bytes]."""
LEAST_TRIANGLES = 10_000
"""Of all meshes of a page, whatever the ground takes."""
MARGIN = 0.98
"""Aimed at, over what there is room for: pictures differ in how many digits they take."""


def mesh_budget(ground: Sequence[Command]) -> int:
    """Return the triangles that meshes may have beside a ground, at most `MESH_BUDGET`."""
    room = PAGE_BYTES - still_bytes(ground, "") - 2 * LEAST_MOTION_BYTES
    return min(MESH_BUDGET, max(LEAST_TRIANGLES, room // TRIANGLE_BYTES))


def fitted_motion(
    motion: Callable[[float], Command], fps: float, scene: Sequence[Command], caption: str
) -> tuple[Command, str]:
    """Return a motion that leaves the page below `PAGE_BYTES`, and as HTML what that took.

    The motion takes the room that the still picture leaves, and `LEAST_MOTION_BYTES` if there is
    less.

    Args:
        motion: makes it at a rate of pictures [1/s].
        fps: the rate where there is room for it [1/s].
        scene: the still picture.
        caption: HTML.
    """
    still = still_bytes(scene, caption)
    room = max(PAGE_BYTES - still, LEAST_MOTION_BYTES)
    made, rate = motion(fps), fps
    while (size := _motion_bytes(made)) > room and _pictures(made) > 2:
        rate *= MARGIN * room / size
        made = motion(rate)
    if rate == fps:
        return made, ""
    limit = f"{1e-6 * max(PAGE_BYTES, still + room):.3g} MB"
    return made, f"<br>{rate:.3g} pictures per second instead of {fps:.4g}: a file below {limit}"


def _motion_bytes(motion: Command) -> int:
    """Return what a motion takes of a page, where all tracks share their times [bytes]."""
    clips = [clip["clip"] for clip in motion["animations"]]
    tracks = [{**track, "times": []} for clip in clips for track in clip["tracks"]]
    times = [clip["tracks"][0]["times"] for clip in clips[:1]]
    paths = sum(len(json.dumps(clip)) for clip in ({**c, "clip": 0} for c in motion["animations"]))
    return paths + len(json.dumps([tracks, times], separators=(",", ":"))) + 60 * len(clips)


def _pictures(motion: Command) -> int:
    return len(motion["animations"][0]["clip"]["tracks"][0]["times"])
