"""Torques of servos that stiffen, beside those of prescribed motion, per kind of joint."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.control.feasible_gait import feasible_gait
from hexapod_pin.text_table import Table

CYCLE = 2.4
"""[s], as [S2]."""

MAX_DIFFERENCE, REACHED_BY = 0.02, 64.0
"""Target: difference of torque RMS from prescribed motion, and the stiffness that reaches it."""

EXACT: dict[str, Any] = {"method": "ndf", "accuracy": 1e-7}
"""Of these runs: torques of stiff servos make much of small errors."""


def walk_of(robot: str, name: str) -> Any:
    """Return a walk: "tetrapod", "arc constant" or "arc step"."""
    if name == "tetrapod":
        gait, _ = feasible_gait(hp.load_robot(robot), name, None, cycle_time=CYCLE)
        return hp.KinematicControl(gait)
    profile = name.partition(" ")[2]
    return hp.motion.ArcWalk(hp.Gait.tetrapod(cycle_time=CYCLE), profile=profile)  # type: ignore[arg-type]


def torque_table(
    scenes: Sequence[tuple[str, str, str]], cycles: int, factors: Sequence[float]
) -> tuple[Table, bool]:
    """Return differences of torque RMS for servos times `factors`, and whether all are small.

    Args:
        scenes: robot, contact, walk.
        cycles: of each walk.
        factors: on kp and kd of the default servos, rising [-].
    """
    rows, met = [], True
    for scene in scenes:
        names, exact = _rms(scene, cycles, prescribed=True)
        robot = hp.load_robot(scene[0])
        stiff = hp.Servo.from_effort(robot).model_copy(update={"limited": False})
        found = np.array(
            [_rms(scene, cycles, servo=stiff.stiffer(factor))[1] for factor in factors]
        )
        for k, name in enumerate(names):
            change = found[:, k] / exact[k] - 1.0
            good, verdict = _verdict(np.array(factors), change)
            met &= good
            cells = [f"{100.0 * value:+.2f}" for value in change]
            rows.append([*scene, name, f"{exact[k]:.4f}", *cells, verdict])
    head = ["robot", "contact", "walk", "kind", "prescribed [N m]"]
    head += [f"kp, kd x{factor:g} [%]" for factor in factors]
    title = "Torque RMS of servos that stiffen, difference from prescribed motion"
    return Table(title, [*head, f"2 % by x{REACHED_BY:g}"], rows), met


def _verdict(factors: Array, change: Array) -> tuple[bool, str]:
    """Return whether the target is met by its stiffness, and what the table says of it."""
    small = np.abs(change) <= MAX_DIFFERENCE
    if small[factors <= REACHED_BY][-1]:
        return True, "pass"
    at = 100.0 * change[factors <= REACHED_BY][-1]
    later = f"; pass at x{factors[-1]:g}" if small[-1] else ""
    return False, f"FAIL ({at:+.1f} %{later})"


def _rms(scene: tuple[str, str, str], cycles: int, **settings: Any) -> tuple[list[str], Array]:
    """Return kinds of joints, and the largest torque RMS of each in the steady cycles [N m]."""
    robot, contact, walk = scene
    built = hp.Scene(hp.load_robot(robot), contact=hp.Contact.preset(contact), **settings)
    trace = hp.simulate(built, walk_of(robot, walk), duration=cycles * CYCLE, **EXACT)
    kinds = hp.torque_budget(trace).kinds
    return [kind.kind for kind in kinds], np.array([kind.rms.torque_rms for kind in kinds])
