"""The parameter tables, the solids behind them, and the URDFs written from them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from refusals import refused

from hexapod_pin.errors import ParameterError
from hexapod_pin.robot.description.blueprint import Blueprint, Segment, six_hips
from hexapod_pin.robot.description.paper_robots import ATHENA, KHARAGPUR, PAPER_ROBOTS
from hexapod_pin.robot.description.solids import box_inertia, rod_inertia
from hexapod_pin.robot.description.urdf_file import Link, parse_urdf
from hexapod_pin.robot.robot import load_robot


def links(blueprint: Blueprint) -> dict[str, Link]:
    return parse_urdf(blueprint.urdf().encode(), blueprint.name).link_by_name


def test_solids_equal_a_cloud_of_points() -> None:
    axis = (np.arange(200) + 0.5) / 200 - 0.5
    x, y, z = 0.4 * axis, 0.24 * axis, 0.1 * axis
    squares = [np.mean(c**2) for c in (x, y, z)]
    sums = [squares[1] + squares[2], squares[0] + squares[2], squares[0] + squares[1]]
    # The midpoint rule of n cells misses 1/n^2 of the second moment: 2.5e-5.
    assert box_inertia(4.5, (0.4, 0.24, 0.1)) == pytest.approx(4.5 * np.array(sums), rel=3e-5)
    r = 0.015 * np.sqrt((np.arange(200) + 0.5) / 200)
    along, across = np.mean((0.2 * axis) ** 2), np.mean(r**2) / 2
    expected = 0.15 * np.array([2 * across, across + along, across + along])
    assert rod_inertia(0.15, 0.2, 0.015) == pytest.approx(expected, rel=3e-5)


def test_kharagpur_is_that_of_s2() -> None:
    """Table 1's y is forward, the tibia's x along it; the hip stands 98.79 mm above the foot."""
    expected = {
        "base_link": (1.28146, (0.0025185, 0.0166529, 0.0168972)),
        "lf_coxa": (0.15, (70.827e-6, 108.377e-6, 56.745e-6)),
        "rm_femur": (0.041, (20.188e-6, 86.698e-6, 100.265e-6)),
        "rr_tibia": (0.11, (20.777e-6, 87.515e-6, 98.446e-6)),
    }
    assert load_robot("athena").stand().q[2] == pytest.approx(0.156 + 0.020, abs=1e-4)
    printed = (7.55e-5, 3.333e-4, 3.422e-4)  # of the assumed set, to three or four digits
    assert links(ATHENA)["lf_femur"].moments[:3] == pytest.approx(printed, rel=2e-3)
    written = links(KHARAGPUR)
    for name, (mass, moments) in expected.items():
        assert written[name].mass == pytest.approx(mass, rel=1e-15)
        assert written[name].moments == pytest.approx((*moments, 0, 0, 0), rel=1e-14)
    robot = load_robot("kharagpur")
    assert robot.stand().q[2] == pytest.approx(0.09879 + 0.010, abs=1e-12)
    assert KHARAGPUR.coxa.length + KHARAGPUR.femur.length == pytest.approx(0.20284, abs=1e-15)
    assert robot.effort_limit.tolist() == [6.0] * 18
    for name, mass in (("kharagpur", 3.08746), ("athena", 8.25)):
        assert PAPER_ROBOTS[name].total_mass == pytest.approx(mass, rel=1e-12)
        assert load_robot(name).total_mass == pytest.approx(mass, rel=1e-12)


def test_additional_mass_at_the_joints() -> None:
    """18 point masses: same total; coxa and trunk by the parallel-axis theorem."""
    spread = KHARAGPUR.model_copy(update={"additional_mass_placement": "joints"})
    share, written = 0.63146 / 18, links(spread)
    total = math.fsum(link.mass or 0.0 for link in written.values())
    assert total == pytest.approx(3.08746, rel=1e-12)
    coxa, length = written["lf_coxa"], 0.0835
    reduced = 0.15 * share / (0.15 + share) * (length / 2) ** 2
    assert coxa.com[0] == pytest.approx((0.15 * length / 2 + share * length) / (0.15 + share))
    assert coxa.moments[:3] == pytest.approx((70.827e-6, 108.377e-6 + reduced, 56.745e-6 + reduced))
    trunk = written["base_link"]
    assert trunk.com == pytest.approx((0, 0, 0), abs=1e-17)
    arms = 6 * share * 0.1025**2, 4 * share * 0.2**2
    expected = 2518.5e-6 + arms[0], 16652.9e-6 + arms[1], 16897.2e-6 + sum(arms)
    assert trunk.moments[:3] == pytest.approx(expected)


def test_impossible_parts_are_refused() -> None:
    segment = KHARAGPUR.coxa.model_dump()
    for change, name, value, least in (
        ({"mass": 0.0}, "mass", 0.0, 0.0), ({"inertia": (1.0, 0.0, 1.0)}, "inertia[1]", 0.0, 0.0),
        ({"lower": 2.0, "upper": 1.0}, "lower", 2.0, 1.0),
    ):  # fmt: skip
        with refused(ParameterError, f"Segment.{name}", value, allowed=(least,)):
            Segment(**segment | change)
    fields = {name: getattr(KHARAGPUR, name) for name in Blueprint.model_fields}
    with refused(ParameterError, "Blueprint.posture", -0.1):
        Blueprint(**fields | {"posture": (0.0, 0.0, -0.1)})
    hips = six_hips(0.2, 0.1)
    del hips["rm"]
    with refused(ParameterError, "Blueprint.hips", ("lf", "lm", "lr", "rf", "rr")):
        Blueprint(**fields | {"hips": hips})
