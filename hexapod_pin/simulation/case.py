"""A case: what is run, and from where."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hexapod_pin.control.joint_trajectory import Controller
    from hexapod_pin.results.checkpoint import Checkpoint
    from hexapod_pin.robot.state import State
    from hexapod_pin.simulation.scene import Scene


@dataclass(frozen=True)
class Case:
    """One run of a batch: a scene, its controller, and where it starts (None: standing)."""

    scene: Scene
    controller: Controller
    initial: State | Checkpoint | None = None
