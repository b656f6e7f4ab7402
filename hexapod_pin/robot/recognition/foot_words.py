"""What is said of feet that were inferred: one sentence for the legs that share a rule."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hexapod_pin.robot.description.urdf_file import UrdfFile
from hexapod_pin.robot.recognition.feet import FoundFoot, off_tip
from hexapod_pin.robot.recognition.leg_choice import Legs


def feet_text(
    file: UrdfFile, legs: Legs, names: Sequence[str], feet: Sequence[FoundFoot]
) -> list[str]:
    """Return what is inferred about feet: rules, frames that are not at the tip, shapes lost."""
    rules: dict[str, list[int]] = {}
    frames: dict[str, list[int]] = {}
    lost: dict[str, list[int]] = {}
    called = []
    for k, (body, foot) in enumerate(zip(legs.bodies, feet, strict=True)):
        name, off = off_tip(file, legs.frames, body, foot)
        called.append(name)
        for text, group in ((foot.rule, rules), (off, frames)):
            group.setdefault(text, []).append(k)
        if body.lost and not body.empty:
            lost.setdefault(body.lost[0], []).append(k)
    who = {rule: ", ".join(names[k] for k in places) for rule, places in rules.items()}
    return [
        *(
            f"feet of {who[rule]}: {rule}, on {_listed([feet[k].link for k in places])};"
            f" {_sizes(legs, feet, places)}"
            for rule, places in rules.items()
            if rule
        ),
        *(
            f"frames of {_listed([called[k] for k in places])} are called feet but are {text}"
            for text, places in frames.items()
            if text
        ),
        *(
            f"a shape of leg {names[places[0]]} is not used: {text}"
            for text, places in lost.items()
        ),
    ]


def _listed(names: Sequence[str]) -> str:
    """Return names in a row, long rows by their first and last ones."""
    short = names if len(names) < 4 else (*names[:2], "...", names[-1])
    return ", ".join(short)


def _sizes(legs: Legs, feet: Sequence[FoundFoot], places: Sequence[int]) -> str:
    """Return the range of the feet's distances from the last joints and of their radii."""
    reach = [
        float(np.linalg.norm(legs.bodies[k].axis.arm(feet[k].centre))) + feet[k].radius
        for k in places
    ]
    far, size = _span(reach), _span([feet[k].radius for k in places])
    return f"end {far} mm from the last joint, radius {size} mm"


def _span(values: Sequence[float]) -> str:
    """Return the range of lengths [m] in millimetres."""
    low, high = (f"{1e3 * float(value):.1f}" for value in (min(values), max(values)))
    return low if low == high else f"{low} to {high}"
