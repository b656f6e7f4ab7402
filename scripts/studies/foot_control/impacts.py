"""When the largest force of a stance comes, and how fast feet arrive."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import hexapod_pin as hp
from hexapod_pin.errors import HexapodError
from hexapod_pin.results.trace import Trace
from hexapod_pin.text_table import Table
from studies.foot_control.bounds import ALONE, WITH_TOUCH_DOWN
from studies.foot_control.scenes import Size, bumps, controllers, uneven

SAMPLE = 5e-4
"""Of the runs in which contacts are timed [s]."""

QUIET = 0.03
"""Time without load before a contact counts as a new one [s]."""

AT_ONCE = 0.005
"""What comes sooner after contact than this comes before control can act on it [s]."""


def touch_downs(trace: Trace) -> Iterator[tuple[float, float, float, float]]:
    """Return for each new contact: speed of arrival, its largest force, when, and the later one.

    Yields:
        Downward speed of the foot before contact [m/s], largest normal force in the stance [N],
        its time after contact [s], and the largest from AT_ONCE after contact on [N].
    """
    step = float(trace.time[1] - trace.time[0])
    quiet, at_once = round(QUIET / step), round(AT_ONCE / step)
    for foot in range(trace.normal_force.shape[1]):
        force, height = trace.normal_force[:, foot], trace.foot_position[:, foot, 2]
        loaded = np.flatnonzero(force > 0.0)
        for k, begin in enumerate(loaded):
            before = loaded[k - 1] if k else -1
            if begin - before < quiet or k == 0:
                continue
            gaps = np.flatnonzero(np.diff(loaded[k:]) > quiet)
            end = loaded[k + gaps[0]] if len(gaps) else loaded[-1]
            stance = force[begin : end + 1]
            peak = int(np.argmax(stance))
            speed = (height[begin - 2] - height[begin - 1]) / step
            later = float(stance[at_once:].max(initial=0.0))
            yield speed, float(stance[peak]), step * peak, later


def impact_table(size: Size) -> Table:
    """Return when the largest force of a stance comes, and how fast feet arrive, on bumps."""
    rows = []
    for robot in size.robots:
        gait = uneven(robot)
        scene = bumps(robot, 1, size.way)[0]
        for name, control in controllers(gait, (ALONE, WITH_TOUCH_DOWN)).items():
            try:
                trace = hp.simulate(scene, control, duration=size.way / gait.speed, sample=SAMPLE)
            except HexapodError as error:
                rows.append([robot, name, str(error).partition("\n")[0], *["-"] * 6])
                continue
            found = np.array(list(touch_downs(trace)))
            speed, peak, when, later = found.T
            top = peak >= np.quantile(peak, 0.9)
            rows.append([
                robot, name, f"{len(found)}",
                f"{np.median(speed):.2f}, {np.quantile(speed, 0.9):.2f}",
                f"{np.median(peak):.1f}, {peak.max():.1f}",
                f"{100.0 * np.mean(when < AT_ONCE):.0f}",
                f"{100.0 * np.mean(when[top] < AT_ONCE):.0f}",
                f"{np.median(later):.1f}, {later.max():.1f}",
                f"{np.corrcoef(speed, peak)[0, 1]:.2f}",
            ])  # fmt: skip
    return Table(
        f"When the largest force of a stance comes, on bumps; one ground, samples every "
        f"{1e3 * SAMPLE:g} ms",
        [
            "robot", "controller", "touch-downs", "arrival speed [m/s]: median, 90 %",
            "largest force [N]: median, largest", f"within {1e3 * AT_ONCE:g} ms of contact [%]",
            "the same of the highest tenth [%]", "force later than that [N]: median, largest",
            "correlation of speed and force",
        ],
        rows,
    )  # fmt: skip
