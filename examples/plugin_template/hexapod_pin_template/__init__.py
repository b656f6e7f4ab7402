"""A robot, a controller, a contact and a ground under names of their own; all numbers *assumed*."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

import hexapod_pin as hp


def crawler() -> Path:
    """Return the robot's file: `hexapod-pin walk crawler`, `hp.load_robot("crawler")`."""
    return Path(__file__).with_name("crawler.urdf")


def wet_rubber() -> hp.Contact:
    """Return a contact: `hexapod-pin walk kharagpur --contact wet-rubber`."""
    return hp.Contact.accurate().with_mu(0.35)


def crater(depth: float = 0.02, radius: float = 0.6) -> hp.HeightField:
    """Return a round hollow around the start: `hexapod-pin walk kharagpur --terrain crater`.

    Args:
        depth: at the start [m]; on the command line `crater:depth=0.03,radius=0.8`.
        radius: where the ground is level again [m].
    """
    places = np.linspace(-2.0, 2.0, 81)
    distance = np.hypot(*np.meshgrid(places, places))
    hollow = 0.5 * (1.0 + np.cos(np.pi * np.minimum(distance / radius, 1.0)))
    return hp.HeightField.from_array(-depth * hollow, spacing=0.05, origin=(-2.0, -2.0))


class Bob:
    """A controller that lowers and raises the trunk; in a case file `kind = "bob"`.

    Attributes:
        amplitude: of the femur joints [rad].
        time: of a cycle [s].
    """

    period = 0.01  # s between ticks

    def __init__(self, amplitude: float = 0.1, time: float = 1.0) -> None:
        """Keep the settings."""
        self.amplitude, self.time = amplitude, time

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Bob:
        """Return the controller of a case file: what `to_dict` gave, with the key "kind"."""
        return cls(**{name: value for name, value in data.items() if name != "kind"})

    def to_dict(self) -> dict[str, Any]:
        """Return the settings as they stand in a case file."""
        return {"kind": "bob", "amplitude": self.amplitude, "time": self.time}

    def start(self, scene: hp.Scene, batch: int) -> np.ndarray:
        """Return which joints move, as factors. Shape (batch, n)."""
        moved = [float("femur" in name) for name in scene.robot.joint_names]
        return np.tile(np.stack([scene.robot.posture, moved]), (batch, 1, 1))

    def update(
        self, time: float, measurement: hp.feedback.Measurement, state: np.ndarray
    ) -> tuple[hp.feedback.Command, np.ndarray]:
        """Return the set-points of the next tick, and the state as it is."""
        phase = 2.0 * np.pi * (time + self.period) / self.time
        angle = 0.5 * self.amplitude * (1.0 - np.cos(phase))
        return hp.feedback.Command(state[:, 0] - angle * state[:, 1], ramp=True), state
