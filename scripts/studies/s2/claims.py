"""S2's claims in numbers of the study: each with a verdict and, where it fails, the likely reason.

S2's words are known here by its abstract, its figures and what earlier notes on it say; the claims
are put in our words.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.arc_walk import PAPER_AMPLITUDE, ArcWalk
from hexapod_pin.results.gait_energy import GaitEnergy
from hexapod_pin.results.joint_moments import joint_moments
from hexapod_pin.results.phase_torque import PHASES
from hexapod_pin.results.stability import Stability, stability
from hexapod_pin.results.torque_budget import torque_budget
from hexapod_pin.results.torque_map import TorqueMap
from hexapod_pin.results.trace import Trace
from hexapod_pin.results.trace_file import StudyPart
from hexapod_pin.robot.robot import load_robot

HOLDS, FAILS, IN_PART = "holds", "does not hold", "in part"

MOSTLY = 0.9
"""Share of the points from which a trend holds [-]."""

ALONG = 1.0
"""Angle off the heading up to which a path is straight ahead [degrees]."""

LITTLE = 0.1
"""Share of the stroke up to which the centre of mass varies little [-]."""

S2_SPEED, S2_CYCLES = 0.14 / (2.0 / 3.0 * 2.4), 10.0 / 2.4


class Claim(NamedTuple):
    """What S2 says, our numbers, the verdict, and why."""

    text: str
    numbers: str
    verdict: str
    reason: str


def claims(study: Mapping[str, StudyPart]) -> list[Claim]:
    """Return all claims of the study's parts."""
    paper, grid, energy = study["paper"], study["torque_map"], study["gait_energy"]
    assert isinstance(paper, Trace) and isinstance(grid, TorqueMap)
    assert isinstance(energy, GaitEnergy)
    return [
        *geometry_claims(), *joint_one(paper), *trends(grid), *phases(grid),
        straight_path(paper), *center_of_mass(stability(paper)), *energy_claims(energy),
    ]  # fmt: skip


def geometry_claims() -> list[Claim]:
    """Stroke and number of cycles."""
    path = ArcWalk().path(load_robot("kharagpur"))
    needed = np.degrees(np.arcsin(0.07 / path.radius.mean()))
    return [
        Claim(
            "theta_1 = +-20 degrees is a stroke of 0.14 m",
            f"{1e3 * path.gait.stroke:.2f} mm; 0.14 m needs {needed:.2f} degrees, taken here",
            HOLDS,
            f"to its printed digits ({np.degrees(PAPER_AMPLITUDE):.0f} degrees, 2 R sin A)",
        ),
        Claim(
            "at most three cycles in 10 s",
            f"{S2_CYCLES:.2f} cycles of 2.4 s at {1e3 * S2_SPEED:.1f} mm/s",
            FAILS,
            "four whole cycles fit; three are whole after one to start with",
        ),
    ]


def joint_one(paper: Trace) -> list[Claim]:
    """Whether joint 1 has the highest torque of all legs: by axis torque and by total moment."""
    axis = np.array([row.torque_peak for row in torque_budget(paper).joints]).reshape(6, 3)
    rms = np.array([row.torque_rms for row in torque_budget(paper).joints]).reshape(6, 3)
    moment = joint_moments(paper).moment.max(axis=0).reshape(6, 3)
    text = "the torque of joint 1 is the highest in every leg"
    ratio = moment[:, 0] / moment[:, 1]
    return [
        Claim(
            f"{text}: axis torque, what a motor gives",
            f"peaks of joint 1 / 2: {_both(axis)} N m; RMS {_both(rms)} N m",
            _verdict((axis[:, 0] > axis[:, 1]).mean()),
            "joint 1 stands upright: the weight has no moment about it, friction alone loads it",
        ),
        Claim(
            f"{text}: total moment across the joint",
            f"peaks of joint 1 / 2: {_both(moment)} N m, ratio {ratio.min():.2f} to "
            f"{ratio.max():.2f}",
            _verdict((moment[:, 0] > moment[:, 1]).mean()),
            "it bends under the foot force at the lever L1 + L2, joint 2 at L2 (ratio 1.70 without "
            "the links' weights): figure 6 likely shows this moment",
        ),
    ]


def trends(grid: TorqueMap) -> list[Claim]:
    """Torque against stroke and against cycle time."""
    found = []
    for text, axis, sign in (
        ("torques grow with the stroke", 0, 1.0),
        ("torques fall with the cycle time", 1, -1.0),
    ):
        for quantity, name in (("torque_peak", "peak"), ("torque_rms", "RMS")):
            shares = {
                kind: _share(sign * np.diff(grid.of_kind(quantity, kind), axis=axis))
                for kind in grid.kind_names
            }
            ends = ", ".join(_ends(grid, quantity, kind, axis) for kind in grid.kind_names)
            least = min(shares.values())
            found.append(
                Claim(
                    f"{text}: {name}",
                    f"{ends} N m; share of steps of the grid in which it does: "
                    + ", ".join(f"{kind} {share:.0%}" for kind, share in shares.items()),
                    HOLDS if least >= MOSTLY else IN_PART if max(shares.values()) >= MOSTLY
                    else FAILS,
                    "the femur carries the weight whatever the walk: it changes little",
                )
            )  # fmt: skip
    return found


def phases(grid: TorqueMap) -> list[Claim]:
    """Retraction against protraction."""
    rows, worst = [], 1.0
    place = (-1, s2_column(grid))
    for kind in grid.kind_names:
        both = grid.of_kind("phase_torque_rms", kind)
        worst = min(worst, _share(both[..., 0] - both[..., 1]))
        rows.append(f"{kind} {both[place][0]:.3f} / {both[place][1]:.3f}")
    return [
        Claim(
            f"joints are loaded more in {PHASES[0]} (stance) than in {PHASES[1]} (swing)",
            f"RMS at 0.14 m and 2.4 s: {', '.join(rows)} N m; at {worst:.0%} of the points or more",
            HOLDS if worst >= MOSTLY else IN_PART,
            "a swing leg carries itself alone",
        )
    ]


def straight_path(paper: Trace) -> Claim:
    """Whether the robot follows the straight path that its legs are driven for."""
    com = paper.com[torque_budget(paper).window.samples, :2]
    way = com[-1] - com[0]
    angle = float(np.degrees(np.arctan2(way[1], way[0])))
    return Claim(
        "the robot follows a straight path ahead",
        f"over {1e3 * way[0]:.0f} mm it goes {1e3 * abs(way[1]):.0f} mm "
        f"{'left' if way[1] > 0.0 else 'right'} ({abs(angle):.1f} degrees)",
        HOLDS if abs(angle) < ALONG else IN_PART,
        "straight, but aslant: the tetrapod's sides are 2/3 of a cycle apart, and feet on arcs "
        "scrub; straight lines with the same gait do not drift",
    )


def center_of_mass(found: Stability) -> list[Claim]:
    """Figure 5: the way of the aggregate centre of mass, and whether it stays over its feet."""
    span = 1e3 * np.ptp(found.excursion, axis=0)
    least = {name: found.least(name) for name in ("static_margin", "nesm", "zmp_margin")}
    numbers = ", ".join(f"{name} {1e3 * value:.1f} mm" for name, (value, _) in least.items())
    return [
        Claim(
            "the aggregate centre of mass varies little about its line",
            f"about its mean line by {span[0]:.1f} mm along, {span[1]:.1f} mm sideways, "
            f"{span[2]:.1f} mm in height (peak to peak)",
            HOLDS if span.max() <= 1e3 * LITTLE * 0.14 else FAILS,
            "it surges because a STEP in stance drives the groups of legs at different speeds",
        ),
        Claim(
            "the walk is statically stable",
            f"least {numbers}; {found.feet_down.min()} feet or more on the ground",
            _verdict(float(min(value for value, _ in least.values()) > 0.0)),
            "four feet at any time, the centre of mass well inside",
        ),
    ]


def energy_claims(energy: GaitEnergy) -> list[Claim]:
    """S2's future work, with Roy and Pratihar's finding as a test of sign."""
    found = []
    for cost, name in (
        ("cost_of_transport_positive", "mechanical, positive power"),
        ("cost_of_transport_electrical", "electrical, with copper loss (*assumed*)"),
        ("torque_index", "torque index, integral of sum of torque^2 over distance"),
    ):
        for scene in energy.scenes:
            best = "; ".join(
                f"{row.speed:.2f} m/s {' = '.join(row.gaits)}"
                for row in energy.cheapest(cost, scene)[::2] if row.gaits
            )  # fmt: skip
            test = energy.duty_test(cost, scene)
            if test is None:
                continue
            found.append(
                Claim(
                    "(future work; Roy and Pratihar 2012) low duty is cheaper at the highest "
                    f"speed all gaits walk: {name}, {scene}",
                    f"cheapest at {best}",
                    HOLDS if test.low_is_cheaper else FAILS,
                    f"tested at {test.speed:.2f} m/s; holding torque costs nothing mechanically, "
                    "and fewer feet carry more each",
                )
            )
    return found


def _verdict(share: float) -> str:
    """Return the verdict of a share of the legs or points for which a claim is true."""
    return HOLDS if share == 1.0 else FAILS if share == 0.0 else IN_PART


def _share(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.mean(known > 0.0)) if known.size else 0.0


def _both(values: Array) -> str:
    return f"{values[:, 0].max():.2f} / {values[:, 1].max():.2f}"


def _ends(grid: TorqueMap, quantity: str, kind: str, axis: int) -> str:
    """Return the first and last value along an axis of the grid, the other being S2's."""
    values = grid.of_kind(quantity, kind)
    line = values[:, s2_column(grid)] if axis == 0 else values[-1]
    return f"{kind} {line[0]:.3f} to {line[-1]:.3f}"


def s2_column(grid: TorqueMap) -> int:
    """Return the column whose cycle time is next to S2's 2.4 s."""
    return int(np.argmin(np.abs(grid.cycle_time - 2.4)))
