"""Which joints of a leg walk: all of two or three; of four or five the three that do most."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.robot.recognition.chains import Chain, axis_distance
from hexapod_pin.robot.recognition.tree_frames import Axis, TreeFrames

WALKING = 3
"""Joints that place a foot in space."""

PARALLEL = 0.98
"""Least |cosine| of axes that are taken for parallel (11 deg)."""


def walking_joints(
    chains: Sequence[Chain], frames: TreeFrames, tips: dict[str, Array], up: Array
) -> tuple[tuple[int, ...], str]:
    """Return the places of the joints that walk in every leg, and a sentence if some are held.

    Of more than three joints: the pair of parallel neighbours (hip pitch and knee) with the
    longest links between and beyond them, and before them the joint nearest to upright (yaw).
    Only distances of axes enter, so the choice is the same for any zero posture.
    """
    count = len(chains[0].joints)
    if count <= WALKING:
        return tuple(range(count)), ""
    axes = [[frames.axes[joint.name] for joint in chain.joints] for chain in chains]
    run = _parallel_run(axes[0])
    links = np.mean([_links(a, tips[c.label]) for a, c in zip(axes, chains, strict=True)], axis=0)
    pairs = [(i, j) for i in run for j in run if i < j]
    pair = max(pairs, key=lambda pair: _worth(pair, links), default=(1, 2))
    before = [k for k in range(pair[0]) if k not in run]
    upright = [(round(abs(float(axes[0][k].unit @ up)), 3), -k, k) for k in before]
    rest = [k for k in range(count) if k not in pair]
    first = max(upright)[2] if upright else rest[0]
    chosen = tuple(sorted((first, *pair)))
    walk, held = (
        ", ".join(joint.name for k, joint in enumerate(chains[0].joints) if (k in chosen) is yes)
        for yes in (True, False)
    )
    return chosen, (
        f"of {count} joints a leg the three with the longest links between them walk ({walk});"
        f" the others are held ({held})"
    )


def _parallel_run(axes: Sequence[Axis]) -> list[int]:
    """Return the longest run of neighbours whose axes are parallel; the first of equal ones."""
    runs, run = [], [0]
    for k in range(1, len(axes)):
        if abs(float(axes[k].unit @ axes[k - 1].unit)) >= PARALLEL:
            run.append(k)
        else:
            runs.append(run)
            run = [k]
    runs.append(run)
    return max(runs, key=len)


def _links(axes: Sequence[Axis], tip: Array) -> list[float]:
    """Return the distance of each axis to the next one, of the last one to the tip [m]."""
    between = [axis_distance(a, b) for a, b in zip(axes, axes[1:], strict=False)]
    return [*between, float(np.linalg.norm(axes[-1].arm(tip)))]


def _worth(pair: tuple[int, int], links: Array) -> tuple[float, int]:
    """Order pairs by the shorter of their two links (to 1 %), then the inner one first."""
    i, j = pair
    shorter = min(links[i:j].sum(), links[j:].sum())
    return round(float(shorter / links.sum()), 2), -i
