"""Arrows that show foot forces: their shape, and how they point and grow."""

from __future__ import annotations

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.view.meshcat_commands import Command, mesh_object
from hexapod_pin.view.robot_shapes import Y_TO_Z, DrawnShape, cylinder

HIDDEN_ARROW_SCALE = 1e-6  # scale of an arrow without force; 0 would have no inverse
LONGEST_ARROW = 1e6  # [m]; viewers compute in single precision
ARROW_COLOR = (0.9, 0.15, 0.1, 0.9)


def arrow_tracks(vector: Array) -> dict[str, Array]:
    """Return attitude and scale of a unit arrow along z that is to show `vector` (K, 3) [m]."""
    length = np.minimum(np.linalg.norm(vector, axis=1), LONGEST_ARROW)
    shown = length > 1e-4
    unit = np.where(shown[:, None], vector, (0.0, 0.0, 1.0))
    unit = unit / np.linalg.norm(unit, axis=1, keepdims=True)
    turn = np.column_stack([-unit[:, 1], unit[:, 0], np.zeros(len(unit)), 1.0 + unit[:, 2]])
    turn[unit[:, 2] < -1.0 + 1e-9] = (1.0, 0.0, 0.0, 0.0)
    scale = np.where(shown[:, None], np.column_stack([shown, shown, length]), HIDDEN_ARROW_SCALE)
    return {"quaternion": turn / np.linalg.norm(turn, axis=1, keepdims=True), "scale": scale}


def arrow(path: str, width: float) -> list[Command]:
    """Return an arrow of unit length along z that shows through the robot."""
    shaft = DrawnShape(cylinder(width, 0.75), Y_TO_Z, np.array([0.0, 0.0, 0.375]), ARROW_COLOR)
    point = cylinder(2.2 * width, 0.25, top_radius=0.0)
    head = DrawnShape(point, Y_TO_Z, np.array([0.0, 0.0, 0.875]), ARROW_COLOR)
    see_through = {"depthTest": False, "transparent": True}
    return [
        mesh_object(f"{path}/shaft", shaft, see_through),
        mesh_object(f"{path}/head", head, see_through),
    ]
