"""Oddities of files found in the world: rounded angles, a joint fixed in one leg, high knees."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from leg_robots import joint, legged, link
from rewritten_urdf import Rewritten

from hexapod_pin.robot.reading.resources import ResourceFinder
from hexapod_pin.robot.recognition.chains import Axis, axis_distance
from hexapod_pin.robot.recognition.layout import RobotHints, RobotLayout
from hexapod_pin.robot.recognition.recognise import recognise

FEMUR, TIBIA = 0.05, 0.09  # [m]


def found(text: str) -> RobotLayout:
    """Recognise a robot from its text, without what it states itself."""
    return recognise(Rewritten(text).file(), ResourceFinder(Path("none.urdf")), RobotHints())


@pytest.mark.parametrize("angle", [0.0, 3.1416 - math.pi, 1.57 - 0.5 * math.pi])
def test_axes_parallel_to_the_rounding_of_a_file_are_as_far_apart_as_parallel_ones(
    angle: float,
) -> None:
    a = Axis(np.zeros(3), np.array([0.0, 1.0, 0.0]))
    b = Axis(np.array([0.08, 0.0, -0.04]), np.array([math.sin(angle), math.cos(angle), 0.0]))
    # 0.08 m sideways and 0.04 m down; the common normal of skew lines would give 0.04 m
    assert axis_distance(a, b) == pytest.approx(math.hypot(0.08, 0.04), rel=1e-3)


def test_a_leg_whose_last_joint_is_fixed_is_a_leg_and_that_joint_is_held_in_the_others() -> None:
    text = legged(6, tarsus=0.0)
    one = r'(<joint name="rm_tarsus_joint" type=")revolute(".*?)<axis[^>]*/><limit[^>]*/>'
    text = re.sub(one, r"\1fixed\2", text, flags=re.DOTALL)
    text = re.sub(r'<held joint="rm_tarsus_joint"[^>]*/>', "", text)
    layout = found(text)
    assert [leg.name for leg in layout.legs] == ["lf", "lm", "lr", "rf", "rm", "rr"]
    assert {len(leg.joints) for leg in layout.legs} == {3}
    assert layout.legs[0].held == ("lf_tarsus_joint",)
    assert layout.legs[4].held == ()
    assert layout.held == {f"{n}_tarsus_joint": 0.0 for n in ("lf", "lm", "lr", "rf", "rr")}


def high_kneed(turned: str) -> str:
    """Return a robot of stretched legs whose femora swing far up and tibiae fold down.

    Args:
        turned: rpy of the trunk in the root link [rad].
    """
    text = link("root", 0.0, 0.0) + joint("fixed", "root", "body", (0.0, 0.0, 0.0), rpy=turned)
    text += link("body", 1.0, 0.1)
    for side in (1.0, -1.0):
        for row, x in enumerate((0.08, 0.0, -0.08)):
            n, axis = f"{'a' if side > 0 else 'b'}{row}", "0 -1 0"
            text += joint(
                f"{n}1", "body", f"{n}c", (x, 0.03 * side, 0.0), axis="0 0 1",
                rpy=f"0 0 {side * math.pi / 2!r}", limits=(-0.8, 0.8),
            )  # fmt: skip
            text += link(f"{n}c", 0.03, 0.02)
            text += joint(
                f"{n}2", f"{n}c", f"{n}f", (0.012, 0.0, 0.0), axis=axis, limits=(-0.25, 2.5)
            )
            text += link(f"{n}f", 0.03, 0.02)
            text += joint(
                f"{n}3", f"{n}f", f"{n}t", (FEMUR, 0.0, 0.0), axis=axis, limits=(-2.6, 0.5)
            )
            ball = f'<origin xyz="{TIBIA} 0 0"/><geometry><sphere radius="0.005"/></geometry>'
            text += f'<link name="{n}t"><collision>{ball}</collision></link>\n'
    return f'<robot name="high">{text}</robot>'


@pytest.mark.parametrize(
    ("turned", "up"), [("0 0 0", (0, 0, 1)), (f"{-math.pi / 2!r} 0 0", (0, 1, 0))]
)
def test_up_is_where_knees_do_not_fold_to_though_feet_are_above_hips_on_average(
    turned: str, up: tuple[float, ...]
) -> None:
    layout = found(high_kneed(turned))
    assert layout.turn[:, 2] == pytest.approx(up, abs=1e-12)
