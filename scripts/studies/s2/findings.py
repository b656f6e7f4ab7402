"""What the study finds beside S2's statements: trends, what 600 output steps miss, future work."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from hexapod_pin.arrays import Array
from hexapod_pin.results.gait_energy import GaitEnergy
from hexapod_pin.results.torque_budget import torque_budget
from hexapod_pin.results.torque_map import TorqueMap
from hexapod_pin.results.trace import Trace
from hexapod_pin.results.trace_file import StudyPart
from hexapod_pin.text_table import Table
from studies.s2.claims import FAILS, HOLDS, IN_PART, MOSTLY, Claim, s2_column, share_above
from studies.s2.runs import SAMPLES_PER_OUTPUT

COSTS = {
    "cost_of_transport_positive": "mechanical, positive power",
    "cost_of_transport_electrical": "electrical, with copper loss (*assumed*)",
    "torque_index": "torque index, integral of sum of torque^2 over distance",
}

COMPARED_SPEED = 0.09
"""At which costs are compared between contacts: all gaits walk it [m/s]."""


def findings(study: Mapping[str, StudyPart]) -> list[Claim]:
    """Return what is found beside S2's statements."""
    grid, paper = study["torque_map"], study["paper"]
    assert isinstance(grid, TorqueMap) and isinstance(paper, Trace)
    return [*trends(grid), slip_speeds(paper)]


def trends(grid: TorqueMap) -> list[Claim]:
    """Torque against stroke and against cycle time."""
    found = []
    for text, axis, sign in (
        ("torques grow with the stroke", 0, 1.0),
        ("torques fall with the cycle time", 1, -1.0),
    ):
        for quantity, name in (("torque_peak", "peak"), ("torque_rms", "RMS")):
            shares = {
                kind: share_above(sign * np.diff(grid.of_kind(quantity, kind), axis=axis))
                for kind in grid.kind_names
            }
            ends = ", ".join(_ends(grid, quantity, kind, axis) for kind in grid.kind_names)
            found.append(
                Claim(
                    f"{text}: {name}",
                    f"{ends} N m; share of steps of the grid in which it does: "
                    + ", ".join(f"{kind} {share:.0%}" for kind, share in shares.items()),
                    _trend(list(shares.values())),
                    "the femur carries the weight whatever the walk: it changes little",
                )
            )
    return found


def _trend(shares: list[float]) -> str:
    if min(shares) >= MOSTLY:
        return HOLDS
    return IN_PART if max(shares) >= MOSTLY else FAILS


def _ends(grid: TorqueMap, quantity: str, kind: str, axis: int) -> str:
    """Return the first and last value along an axis of the grid, the other being S2's."""
    values = grid.of_kind(quantity, kind)
    line = values[:, s2_column(grid)] if axis == 0 else values[-1]
    return f"{kind} {line[0]:.3f} to {line[-1]:.3f}"


def slip_speeds(paper: Trace) -> Claim:
    """How far up its curve S2's friction comes."""
    window = torque_budget(paper).window.samples
    moved = np.diff(paper.foot_position[window][..., :2], axis=0)
    speed = np.linalg.norm(moved, axis=-1) / np.diff(paper.time[window])[:, None]
    down = paper.contact[window]
    slipping = 1e3 * speed[down[1:] & down[:-1]]
    return Claim(
        "the friction stays on the rise to its static value: its dynamic one is never reached",
        f"feet on the ground slide at {np.percentile(slipping, 50.0):.0f} mm/s in the median, "
        f"{np.percentile(slipping, 99.0):.0f} mm/s for 99% of the time; the static coefficient is "
        "reached at 100, the dynamic one at 1000 mm/s",
        HOLDS if np.percentile(slipping, 99.0) < 1000.0 else FAILS,
        "the coefficients of S2's figure 4 look like the program's defaults",
    )


# What an output of 600 steps in 10 s shows of the peaks.


def output_table(traces: Mapping[str, Trace], walks: Mapping[str, str]) -> Table:
    """Return peaks of every step, of S2's 600 output steps, and the share that these miss.

    The cycle is a whole number of output steps, so that every cycle is met in the same instants:
    "worst" is the least that such steps see when they begin 3.3 to 13.3 ms later.
    """
    rows = []
    for name, text in walks.items():
        trace = traces[name]
        rows.append((text, *_missed(trace)))
    head = (
        "walk",
        "coxa: all / output / worst, missed",
        "femur",
        "tibia",
        "normal force of a foot",
    )
    return Table("", head, rows)


def _missed(trace: Trace) -> list[str]:
    window = torque_budget(trace).window.samples
    rows = np.arange(len(trace.time))[window]
    cells = []
    for kind in torque_budget(trace).kinds:
        own = [trace.joint(name) for name in kind.joints]
        cells.append(_cell(kind.peak.torque_peak, np.abs(trace.torque[rows][:, own]), rows, ".3f"))
    force = trace.normal_force[rows]
    cells.append(_cell(float(trace.summary.force_peak.max()), force, rows, ".1f"))
    return cells


def _cell(peak: float, sampled: Array, rows: NDArray[np.intp], digits: str) -> str:
    """Return a peak, what the output steps see of it, the least, and what they miss [%]."""
    seen = [
        float(sampled[rows % SAMPLES_PER_OUTPUT == first].max())
        for first in range(SAMPLES_PER_OUTPUT)
    ]
    unit = "N" if digits == ".1f" else "N m"
    return (
        f"{peak:{digits}} / {seen[0]:{digits}} / {min(seen):{digits}} {unit}, "
        f"{1.0 - seen[0] / peak:.1%} to {1.0 - min(seen) / peak:.1%}"
    )


# S2's future work: the energy of gaits.


def energy_claims(energy: GaitEnergy) -> list[Claim]:
    """Roy and Pratihar's finding as a test of sign, on every contact."""
    found = []
    for cost, name in COSTS.items():
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
                    f"{name}: {scene}",
                    f"cheapest at {best}",
                    HOLDS if test.low_is_cheaper else FAILS,
                    f"tested at {test.speed:.2f} m/s",
                )
            )
    return found


def contact_table(energy: GaitEnergy) -> Table:
    """Return the mechanical and electrical costs of every gait on every contact at one speed."""
    column = int(np.argmin(np.abs(energy.speed - COMPARED_SPEED)))
    costs = (energy.cost_of_transport_positive, energy.cost_of_transport_electrical)
    positive, electrical = (cost[:, :, column] for cost in costs)
    rows = [
        (scene, *(f"{x:.4f} / {y:.3f}" if np.isfinite(x) else "-" for x, y in
                  zip(positive[k], electrical[k], strict=True)))
        for k, scene in enumerate(energy.scenes)
    ]  # fmt: skip
    servo = [k for k, scene in enumerate(energy.scenes) if scene.startswith("servo")]
    ratio = [cost[servo].max(axis=0) / cost[servo].min(axis=0) for cost in (positive, electrical)]
    last = (
        "largest / smallest with servos",
        *(f"{x:.2f} / {y:.2f}" for x, y in zip(*ratio, strict=True)),
    )
    return Table("", ("drive, contact", *energy.gaits), [*rows, last])
