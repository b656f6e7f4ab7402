"""Legs of which some have one joint more than the others: a joint fixed in one leg alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hexapod_pin.robot.description.urdf_file import UrdfFile
from hexapod_pin.robot.recognition.chains import (
    LEG_COUNTS,
    Chain,
    axis_distance,
    links_below,
)
from hexapod_pin.robot.recognition.tree_frames import TreeFrames

FEWEST = 3
"""Joints that a leg must keep."""

SAME_LINKS = 0.05
"""Links of the same leg differ by less than this share of their sum (*assumed*)."""


def evened_chains(file: UrdfFile, frames: TreeFrames, chains: Sequence[Chain]) -> list[Chain]:
    """Return limbs of which those that only have one joint more than like ones hold that joint.

    It is done where it makes an even number of 4 to 8 legs that the limbs do not have already:
    a robot of whose six equal legs one has its last joint fixed is no robot of five legs.
    """
    counts = [len(chain.joints) for chain in chains]
    if any(counts.count(k) in LEG_COUNTS and not counts.count(k) % 2 for k in counts):
        return list(chains)
    for most in sorted(set(counts), reverse=True):
        both = [chain for chain in chains if len(chain.joints) in (most, most - 1)]
        mixed = most - 1 in counts and most > FEWEST
        if mixed and len(both) in LEG_COUNTS and not len(both) % 2:
            cut = [_without_last(file, c) if len(c.joints) == most else c for c in both]
            if _alike(frames, cut):
                short = {chain.label: chain for chain in cut}
                return [short.get(chain.label, chain) for chain in chains]
    return list(chains)


def _without_last(file: UrdfFile, chain: Chain) -> Chain:
    """Return a limb whose last walking joint is one of the others."""
    joints, last = chain.joints[:-1], chain.joints[-1]
    body = links_below(file, joints[-1])
    return replace(chain, joints=joints, others=(last, *chain.others), body=body)


def _alike(frames: TreeFrames, chains: Sequence[Chain]) -> bool:
    """Tell whether the distances of successive axes are the same in all limbs."""
    axes = [[frames.axes[joint.name] for joint in chain.joints] for chain in chains]
    links = np.array([[axis_distance(*p) for p in zip(a, a[1:], strict=False)] for a in axes])
    size = float(np.median(links.sum(axis=1)))
    return bool(np.abs(links - np.median(links, axis=0)).max() <= SAME_LINKS * size)
