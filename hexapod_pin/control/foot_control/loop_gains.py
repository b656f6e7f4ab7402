"""Gains of the slip correction that follow from a bandwidth (*assumed* where none are given)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from hexapod_pin.control.foot_control.leg_model import foot_stiffness

if TYPE_CHECKING:
    from hexapod_pin.control.foot_control.controller import FootControl


def effective_delay(control: FootControl) -> float:
    """Return the delay of a loop, sampling, ramps to the next tick and force filter in it [s]."""
    return 1.5 * control.period + control.loop_delay + control.force.filter_time


def weight_of(scene: Any) -> float:
    """Return what a robot knows as its weight, payloads aside [N]."""
    return float(scene.robot.total_mass * np.linalg.norm(scene.gravity))


def slip_gains(control: FootControl, scene: Any) -> tuple[float, float, float]:
    """Return kp, ki and kd of a controller's slip correction; units as of `SlipPid`.

    Seen by the controller a standing foot is a gain s, a delay d and no lag of its own: the rule
    of internal model control then is ki = 1 / (s (1 / w + d)), kp = kd = 0 [Skogestad2003].
    """
    slip = control.slip
    assert slip is not None
    gain = 1.0
    if slip.signal == "force":
        gain = float(np.linalg.eigvalsh(foot_stiffness(scene)[:, :2, :2]).max())
    lag = 1.0 / (2.0 * math.pi * slip.bandwidth)
    integral = 1.0 / (gain * (lag + effective_delay(control)))
    return (
        0.0 if slip.kp is None else slip.kp,
        integral if slip.ki is None else slip.ki,
        0.0 if slip.kd is None else slip.kd,
    )
