"""S2's statements in numbers of the study: each with a verdict and, where it fails, the reason.

S2's text is known here by its abstract, its figures and what earlier notes on it say; statements
are put in our words. What the study finds beside them is in `findings`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.control.arc_walk import PAPER_AMPLITUDE, ArcWalk
from hexapod_pin.control.gait import Gait
from hexapod_pin.formulations.rigid.contact_events import plastic_impact
from hexapod_pin.formulations.rigid.model import RigidModel
from hexapod_pin.results.joint_moments import joint_moments
from hexapod_pin.results.phase_torque import PHASES
from hexapod_pin.results.stability import Stability, stability
from hexapod_pin.results.torque_budget import torque_budget
from hexapod_pin.results.torque_map import TorqueMap
from hexapod_pin.results.trace import Trace
from hexapod_pin.results.trace_file import StudyPart
from hexapod_pin.robot.leg_bodies import leg_bodies
from hexapod_pin.robot.robot import load_robot
from studies.s2.motors import chosen_motors

HOLDS, FAILS, IN_PART, DONE = "holds", "does not hold", "in part", "checked here, too"

MOSTLY = 0.9
"""Share of the points from which a trend holds [-]."""

ALONG = 1.0
"""Angle off the heading up to which a path is straight ahead [degrees]."""

LITTLE = 0.1
"""Share of the stroke up to which the centre of mass varies little [-]."""

LEVEL, SAME_HEIGHT = 0.1, 0.1
"""Largest roll or pitch [degrees] of a level trunk, and change of its height [mm]."""

PROPORTIONAL = 0.1
"""Largest spread of a ratio about its mean at which two quantities are proportional [-]."""

SIMULATED, S2_CYCLE = 10.0, 2.4
"""Time that S2 simulates, and its cycle time [s]."""

READINGS = ("paper", "ramp_25", "step", "constant")
"""Walks that are readings of S2's motion."""

LEG_NUMBERS = {"lf": 1, "rf": 2, "lm": 3, "rm": 4, "lr": 5, "rr": 6}
"""S2's numbers; that odd ones are left is *assumed*."""


class Claim(NamedTuple):
    """A statement, our numbers, the verdict, and why."""

    text: str
    numbers: str
    verdict: str
    reason: str


def claims(study: Mapping[str, StudyPart]) -> list[Claim]:
    """Return all statements of S2 that can be tested."""
    traces = {name: one for name, one in study.items() if isinstance(one, Trace)}
    grid, paper = study["torque_map"], traces["paper"]
    assert isinstance(grid, TorqueMap)
    return [
        total_mass(), *geometry_claims(grid), tetrapod(paper), level_trunk(paper), crossing(paper),
        straight_path(paper), *center_of_mass(stability(paper)), *joint_one(traces),
        *variations(grid), phases(grid), dissipated_power(paper), maximum_torque(paper),
        impact_equation(),
    ]  # fmt: skip


def total_mass() -> Claim:
    """The mass that S2 states, beside the sum of its table."""
    robot = load_robot("kharagpur")
    table = 0.65 + 6.0 * (0.15 + 0.041 + 0.11)
    return Claim(
        "the robot's mass is 3.08746 kg",
        f"the bodies of its table 1 have {table:.3f} kg, {robot.total_mass - table:.5f} kg less",
        IN_PART,
        "the rest is 'additional parts'; where they are is *assumed* (the trunk's centre of mass)",
    )


def geometry_claims(grid: TorqueMap) -> list[Claim]:
    """Stroke and number of cycles."""
    path = ArcWalk().path(load_robot("kharagpur"))
    needed = np.degrees(np.arcsin(0.07 / path.radius.mean()))
    few = SIMULATED / grid.cycle_time < 4.0
    return [
        Claim(
            "theta_1 = +-20 degrees is a stroke of 0.14 m",
            f"{1e3 * path.gait.stroke:.2f} mm; 0.14 m needs {needed:.2f} degrees, taken here",
            HOLDS,
            f"to its printed digits ({np.degrees(PAPER_AMPLITUDE):.0f} degrees, 2 R sin A)",
        ),
        Claim(
            "at most three complete cycles in 10 s, for the cycle times that are varied",
            f"three or fewer whole cycles fit for every cycle time above {SIMULATED / 4.0:.1f} s; "
            f"of our grid for {grid.cycle_time[few].min():.2f} to {grid.cycle_time.max():.2f} s, "
            f"not for {grid.cycle_time.min():.2f} to {grid.cycle_time[~few].max():.2f} s",
            IN_PART,
            f"the varied cycle times are not known here; {S2_CYCLE} s, of its figure 3, fits "
            f"{SIMULATED / S2_CYCLE:.2f} times: four, or three after one to start with",
        ),
    ]


def tetrapod(paper: Trace) -> Claim:
    """Whether legs (2, 3), (1, 6) and (4, 5) swing in turn while four legs stand."""
    window = torque_budget(paper).window.samples
    legs = [LEG_NUMBERS[name.split("_")[0]] for name in paper.foot_names]
    down = paper.contact
    middles = S2_CYCLE * (1.0 + np.array([1.0, 3.0, 5.0]) / 6.0)
    rows = np.searchsorted(paper.time, middles)
    pairs = [sorted(n for n, here in zip(legs, down[row], strict=True) if not here) for row in rows]
    share = (down[window].sum(axis=1) >= 4).mean()
    return Claim(
        "wave tetrapod gait: legs (2, 3), (1, 6), (4, 5) swing in turn, four legs support",
        f"in the air in the middle of the three stages: {', '.join(map(str, map(tuple, pairs)))}; "
        f"four feet or more on the ground in {share:.1%} of the samples",
        HOLDS if pairs == [[2, 3], [1, 6], [4, 5]] and share > 0.99 else FAILS,
        "as prescribed; that feet do not bounce or lift off is computed",
    )


def level_trunk(paper: Trace) -> Claim:
    """Assumption (b)."""
    x, y, z, w = paper.q[torque_budget(paper).window.samples, 3:7].T
    roll = np.degrees(np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)))
    pitch = np.degrees(np.arcsin(2.0 * (w * y - z * x)))
    tilt = max(np.abs(roll).max(), np.abs(pitch).max())
    rise = 1e3 * float(np.ptp(paper.q[torque_budget(paper).window.samples, 2]))
    return Claim(
        "assumption (b): the trunk is parallel to the ground and at constant height",
        f"tilt at most {tilt:.4f} degrees, height within {rise:.4f} mm",
        HOLDS if tilt < LEVEL and rise < SAME_HEIGHT else FAILS,
        "four feet or more stand on a contact that yields by about 0.01 mm",
    )


def crossing(paper: Trace) -> Claim:
    """Assumption (c)."""
    robot = load_robot("kharagpur")
    bodies = leg_bodies(robot)
    rows = paper.q[torque_budget(paper).window.samples][::4]
    distance, pair = bodies.distances(rows)
    worst = int(np.argmin(distance))
    feet = paper.foot_position[torque_budget(paper).window.samples, :, 0]
    place = {name.split("_")[0]: feet[:, k] for k, name in enumerate(paper.foot_names)}
    gap = min(float((place[a] - place[b]).min())
              for a, b in (("lf", "lm"), ("lm", "lr"), ("rf", "rm"), ("rm", "rr")))  # fmt: skip
    return Claim(
        "assumption (c): legs do not cross while they swing",
        f"feet of neighbours stay {1e3 * gap:.0f} mm or more apart along the course; links "
        f"{1e3 * distance[worst]:.0f} mm or more ({' and '.join(bodies.pairs[pair[worst]])})",
        HOLDS if distance[worst] > 0.0 and gap > 0.0 else FAILS,
        "hip positions and the widths of the links are *assumed*",
    )


def joint_one(traces: Mapping[str, Trace]) -> list[Claim]:
    """Whether joint 1 has the highest torque of all legs: by axis torque and by total moment."""
    paper = traces["paper"]
    axis = np.array([row.torque_peak for row in torque_budget(paper).joints]).reshape(6, 3)
    rms = np.array([row.torque_rms for row in torque_budget(paper).joints]).reshape(6, 3)
    text = "the torque of joint 1 is the highest in every leg"
    shares: dict[str, list[float]] = {"axis": [], "moment": []}
    ratios: list[Array] = []
    for name in READINGS:
        peaks = np.array([row.torque_peak for row in torque_budget(traces[name]).joints])
        moment = joint_moments(traces[name]).moment.max(axis=0).reshape(6, 3)
        one, two = peaks.reshape(6, 3)[:, :2].T
        shares["axis"].append(float((one > two).mean()))
        shares["moment"].append(float((moment[:, 0] > moment[:, 1]).mean()))
        ratios.append(moment[:, 0] / moment[:, 1])
    whole = joint_moments(paper).moment.max(axis=0).reshape(6, 3)
    return [
        Claim(
            f"{text}: axis torque, what a motor gives",
            f"peaks of joint 1 / 2: {_both(axis)} N m; RMS {_both(rms)} N m; so in "
            f"{sum(share > 0.0 for share in shares['axis'])} of {len(READINGS)} readings of the "
            "motion",
            _verdict(float(np.mean(shares["axis"]))),
            "joint 1 stands upright: the weight has no moment about it, friction alone loads it",
        ),
        Claim(
            f"{text}: total moment across the joint",
            f"peaks of joint 1 / 2: {_both(whole)} N m; ratio {min(r.min() for r in ratios):.2f} "
            f"to {max(r.max() for r in ratios):.2f} in {len(READINGS)} readings of the motion",
            _verdict(float(np.mean(shares["moment"]))),
            "it bends under the foot force at the lever L1 + L2, joint 2 at L2 (ratio 1.70 without "
            "the links' weights): figure 6 likely shows this moment",
        ),
    ]


def variations(grid: TorqueMap) -> list[Claim]:
    """The variations that S2 checks; what is found in them is no claim of S2."""
    return [
        Claim(
            f"the variation of joint torques with the {name} is checked",
            f"{len(values)} values from {values.min():.3g} to {values.max():.3g} {unit} "
            "(*assumed* range)",
            DONE,
            "S2 states no trend as known here; ours is among the findings",
        )
        for name, values, unit in (
            ("stroke", grid.stroke, "m"), ("cycle time", grid.cycle_time, "s"),
        )
    ]  # fmt: skip


def phases(grid: TorqueMap) -> Claim:
    """Retraction against protraction."""
    rows, worst = [], 1.0
    place = (-1, s2_column(grid))
    for kind in grid.kind_names:
        both = grid.of_kind("phase_torque_rms", kind)
        worst = min(worst, share_above(both[..., 0] - both[..., 1]))
        rows.append(f"{kind} {both[place][0]:.3f} / {both[place][1]:.3f}")
    return Claim(
        f"joints are loaded more in {PHASES[0]} (stance) than in {PHASES[1]} (swing)",
        f"RMS at 0.14 m and 2.4 s: {', '.join(rows)} N m; at {worst:.0%} of the points or more",
        HOLDS if worst >= MOSTLY else IN_PART,
        "a swing leg carries itself alone",
    )


def dissipated_power(paper: Trace) -> Claim:
    """Section 3.2: torques are proportional to the average power dissipated in the motors."""
    rows = torque_budget(paper).joints
    period = Gait.tetrapod().cycle_time
    numbers, spread = [], 0.0
    for kind in ("coxa", "femur", "tibia"):
        own = [row for row in rows if row.kind == kind]
        power = np.array([row.absolute_energy / period for row in own])
        ratio = power / np.array([row.torque_rms for row in own])
        numbers.append(f"{kind} {ratio.min():.3f} to {ratio.max():.3f}")
    power = np.array([row.absolute_energy / period for row in rows])
    torque = np.array([row.torque_rms for row in rows])
    spread = float((power / torque).std() / (power / torque).mean())
    alike = float(np.corrcoef(power, torque)[0, 1])
    return Claim(
        "(section 3.2) torques are proportional to the average power dissipated in the motors",
        f"mean of |torque * rate| over RMS torque: {', '.join(numbers)} W/(N m), spread "
        f"{spread:.0%} of the mean, correlation over the 18 joints {alike:.2f}; the loss in a "
        "winding is proportional to the square of the torque",
        HOLDS if spread < PROPORTIONAL else FAILS,
        "tibiae hold without turning, femora carry most and turn little, coxae turn most: power "
        "needs motion or a current, and neither grows in proportion to the torque",
    )


def maximum_torque(paper: Trace) -> Claim:
    """Whether the motor that follows from the maximum torque carries the walk."""
    choice = chosen_motors(paper)
    axis, moment, right = choice.by_axis_torque, choice.by_total_moment, choice.by_all_needs
    uses = axis.budget.robot
    return Claim(
        "the maximum torque is what motors are chosen by",
        f"largest axis torque {choice.axis_torque:.2f} N m: {axis.name}, whose RMS torque is then "
        f"{uses.continuous_use:.2f} and whose peak {uses.peak_use:.2f} of what is permitted; "
        f"largest total moment {choice.total_moment:.2f} N m: {moment.name} "
        f"({moment.budget.robot.verdict.lower()}); by RMS, speed, standing and peak: "
        f"{right.name}",
        HOLDS if axis.budget.passes else FAILS,
        "the femur's RMS torque (heat) decides, not its peak: see the section on motors",
    )


def impact_equation() -> Claim:
    """The appendix: equation 5 for a robot that comes down on all feet at once."""
    robot, speed = load_robot("kharagpur"), 0.1
    standing = robot.stand()
    falling = np.zeros_like(standing.v)
    falling[2] = -speed
    feet = range(len(robot.feet))
    impulse = plastic_impact(RigidModel(robot), standing.q, falling, [], feet).impulse[:, 2].sum()
    return Claim(
        "(appendix) eq. 5 gives the impulses of an impact, with eq. 4's multipliers",
        f"landing on six feet at {speed} m/s, joints free: in all {impulse:+.4f} N s on the feet, "
        f"up, with eq. 4's sign; {-impulse:+.4f} N s with eq. 5 as printed",
        IN_PART,
        "eq. 5 prints +lambda where eq. 4 has -lambda: its lambda is minus the impulse; the "
        "velocities after the impact are right either way",
    )


def straight_path(paper: Trace) -> Claim:
    """Whether the robot follows the straight path that its legs are driven for."""
    com = paper.com[torque_budget(paper).window.samples, :2]
    path = com[-1] - com[0]
    angle = float(np.degrees(np.arctan2(path[1], path[0])))
    return Claim(
        "the robot follows a straight path ahead",
        f"over {1e3 * path[0]:.0f} mm it goes {1e3 * abs(path[1]):.0f} mm "
        f"{'left' if path[1] > 0.0 else 'right'} ({abs(angle):.1f} degrees)",
        HOLDS if abs(angle) < ALONG else IN_PART,
        "straight, but aslant: the tetrapod's sides are 2/3 of a cycle apart, and feet on arcs "
        "scrub; straight lines with the same gait do not drift",
    )


def center_of_mass(found: Stability) -> list[Claim]:
    """Figure 5: the path of the aggregate centre of mass, and whether it stays over its feet."""
    along, sideways, height = 1e3 * np.ptp(found.excursion, axis=0)
    names = ("static_margin", "nesm", "zmp_margin")
    least = ", ".join(f"{name} {1e3 * found.least(name)[0]:.1f} mm" for name in names)
    stable = min(found.least(name)[0] for name in names) > 0.0
    return [
        Claim(
            "the aggregate centre of mass varies little about its line",
            f"about its mean line by {along:.1f} mm along, {sideways:.1f} mm sideways, "
            f"{height:.1f} mm in height (peak to peak)",
            HOLDS if max(along, sideways, height) < 1e3 * LITTLE * 0.14 else FAILS,
            "it surges because the groups of legs are driven at different speeds in stance",
        ),
        Claim(
            "the walk is statically stable",
            f"least {least}; {found.feet_down.min()} feet or more on the ground",
            HOLDS if stable else FAILS,
            "four feet at any time, the centre of mass well inside",
        ),
    ]


def _verdict(share: float) -> str:
    """Return the verdict of a share of the legs or points for which a claim is true."""
    return HOLDS if share == 1.0 else FAILS if share == 0.0 else IN_PART


def share_above(values: Array) -> float:
    """Return the share of the known values that are above 0 [-]."""
    known = values[np.isfinite(values)]
    return float(np.mean(known > 0.0)) if known.size else 0.0


def _both(values: Array) -> str:
    return f"{values[:, 0].max():.2f} / {values[:, 1].max():.2f}"


def s2_column(grid: TorqueMap) -> int:
    """Return the column whose cycle time is next to S2's 2.4 s."""
    return int(np.argmin(np.abs(grid.cycle_time - S2_CYCLE)))
