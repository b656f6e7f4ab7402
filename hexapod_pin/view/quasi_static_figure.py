"""The figure of what speed adds to joint torques: a walk beside its quasi-static limit."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array
from hexapod_pin.errors import ParameterError
from hexapod_pin.results.joint_moments import joint_moments
from hexapod_pin.results.steady_window import steady_window
from hexapod_pin.view.figure_file import figure_format, save_figure
from hexapod_pin.view.leg_panels import (
    COLORS,
    Leg,
    add_legend,
    cycle_of,
    label_rows,
    leg_grid,
    legs_of,
)
from hexapod_pin.view.walk_figures import robot_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.figure import Figure

    from hexapod_pin.results.trace import Trace

COXA, FEMUR = 0, 1

LEAST_SWING = 1e-3
"""Of the first harmonics of all coxae below which these stand still [rad]."""

LEAST_OVERLAP = 0.95
"""Of the first harmonics of two walks of one gait, 1 where coxae move alike [-]; *assumed*."""


class Cycle(NamedTuple):
    """One cycle of a walk, the last of its window.

    Attributes:
        length: [s].
        phase: of the intervals' middles, 0 to 1 and ascending. Shape (K,).
        angle: of all joints, half-way [rad]. Shape (K, n).
        axis_torque: [N m]. Shape (K, n).
        moment: total [N m]. Shape (K, n).
    """

    length: float
    phase: Array
    angle: Array
    axis_torque: Array
    moment: Array

    def at(self, phase: Array, values: Array) -> Array:
        """Return periodic values at other phases, linear between the samples. Shape (P, n)."""
        columns = [np.interp(phase, self.phase, column, period=1.0) for column in values.T]
        return np.stack(columns, axis=1)


@checked
def write_quasi_static_figure(
    dynamic: Trace, slow: Trace, path: str | Path, legs: Sequence[str] | None = None
) -> Path:
    """Draw a walk's torques over its cycle beside those of a slow one, and return the file's path.

    For each leg the torque about the femur's axis and below it the total moment at joint 1, at
    both speeds, and their difference: what speed adds, and what else differs between the runs
    (contact laws, motions). The last cycle of each window is drawn; phase 0 is where that of
    `dynamic` begins, and the slow one is shifted until the coxae's first harmonics agree.

    Args:
        dynamic: of a run at some speed; must hold its URDF.
        slow: of the same gait on the same robot, much slower.
        path: ends in .png, .svg or .pdf.
        legs: names, as "lf"; None: all.

    Raises:
        ParameterError: another ending, other joints, a slow run that is no slower, coxae that do
            not move, or no whole cycle.
        UnknownNameError: there is no such leg.
        TraceFileError: the file cannot be written.
        MissingPackageError: matplotlib is not installed.
    """
    ending = figure_format(path)
    return save_figure(draw_quasi_static(dynamic, slow, legs), path, ending)


def draw_quasi_static(dynamic: Trace, slow: Trace, legs: Sequence[str] | None = None) -> Figure:
    """Return the figure; arguments and errors as `write_quasi_static_figure`."""
    if slow.joint_names != dynamic.joint_names:
        raise ParameterError("slow.joint_names", slow.joint_names, "those of `dynamic`")
    shown, fast, limit = legs_of(dynamic, legs), _last_cycle(dynamic), _last_cycle(slow)
    if not limit.length > fast.length:
        raise ParameterError("slow", limit.length, f"a cycle longer than {fast.length:.4g} s")
    limit = _aligned(limit, fast, legs_of(dynamic))
    figure, panels = leg_grid(shown, 2, 1.7)
    torque, moment = limit.at(fast.phase, limit.axis_torque), limit.at(fast.phase, limit.moment)
    for leg, (above, below) in zip(shown, panels, strict=True):
        rows = (
            (above, leg.joints[FEMUR], fast.axis_torque, torque),
            (below, leg.joints[COXA], fast.moment, moment),
        )
        for axes, j, quick, still in rows:
            axes.plot(fast.phase, quick[:, j], color=COLORS[1], lw=1.0,
                      label=f"{fast.length:.3g} s a cycle")  # fmt: skip
            axes.plot(fast.phase, still[:, j], color="black", lw=1.2,
                      label=f"{limit.length:.3g} s a cycle")  # fmt: skip
            axes.plot(fast.phase, quick[:, j] - still[:, j], color=COLORS[0], lw=0.9,
                      label="difference")  # fmt: skip
            axes.set_xlim(0.0, 1.0)
    label_rows(panels, ("femur, axis [N m]", "joint 1, total [N m]"), "phase of the cycle [-]")
    apart = float(np.degrees(np.abs(fast.angle - limit.at(fast.phase, limit.angle)).max()))
    title = f"{robot_of(dynamic)}: femur torque; below, total moment at joint 1\n"
    title += f"(joint angles of the two walks differ by {apart:.2g}° at most)"
    add_legend(figure, panels[0][0], title, shaded=False)
    return figure


def _last_cycle(trace: Trace) -> Cycle:
    """Return the last cycle of a trace's window.

    Raises:
        ParameterError: the run has no cycles, or is too short for one.
    """
    window, moments = steady_window(trace), joint_moments(trace)
    if window.cycles is None:
        raise ParameterError("trace.meta['cycle_time']", None, "of a walk that repeats [s]")
    length = cycle_of(window)
    since = moments.time - (window.end - length)
    kept = since > 0.0
    ends = moments.ends[kept]
    angle = 0.5 * (trace.q[ends, 7:] + trace.q[ends - 1, 7:])
    return Cycle(
        length, since[kept] / length, angle, moments.axis_torque[kept], moments.moment[kept]
    )


def _aligned(slow: Cycle, fast: Cycle, legs: Sequence[Leg]) -> Cycle:
    """Return the slow cycle in the phase of the fast one, by the coxae's first harmonics.

    Raises:
        ParameterError: the coxae stand still, or one is ahead of another by another phase.
    """
    coxae = [leg.joints[COXA] for leg in legs]
    first = [
        np.mean(np.exp(-2j * np.pi * cycle.phase)[:, None] * cycle.angle[:, coxae], axis=0)
        for cycle in (slow, fast)
    ]
    overlap, size = np.vdot(first[0], first[1]), np.linalg.norm(first, axis=1)
    if size.min() < LEAST_SWING or abs(overlap) < LEAST_OVERLAP * size.prod():
        raise ParameterError("slow", slow.length, "a walk of the same gait, whose coxae move")
    phase = np.mod(slow.phase - np.angle(overlap) / (2.0 * np.pi), 1.0)
    order = np.argsort(phase)
    return Cycle(
        slow.length, phase[order], slow.angle[order], slow.axis_torque[order], slow.moment[order]
    )
