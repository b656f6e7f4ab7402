"""What MuJoCo draws of a robot: the shapes of its links, and meshes in files beside the model."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple
from xml.sax.saxutils import quoteattr

import numpy as np

from hexapod_pin.interchange.mjcf_text import Drawn
from hexapod_pin.robot.description.urdf_writer import number, numbers
from hexapod_pin.robot.link_shapes import resources_of
from hexapod_pin.view.mesh_store import MeshStore
from hexapod_pin.view.robot_shapes import Y_TO_Z, RobotShapes

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from hexapod_pin.robot.robot import Robot
    from hexapod_pin.view.robot_shapes import DrawnShape

MESH_FACES = (1, 200_000)
"""Triangles of an STL file that MuJoCo reads."""

LEAST_VERTICES = 4
"""Different vertices of a mesh that it reads."""

UNSEEN = 'contype="0" conaffinity="0" group="2"'
"""What is drawn has no contact; viewers show group 2."""


class DrawnRobot(NamedTuple):
    """What is drawn, the files that it needs, and what cannot be drawn.

    Attributes:
        drawn: elements of the model.
        files: content of each mesh file by its name.
        notes: a sentence on each mesh that is left out.
    """

    drawn: Drawn
    files: Mapping[str, bytes]
    notes: Sequence[str]


def drawn_robot(robot: Robot, prefix: str) -> DrawnRobot:
    """Return the shapes that a playback shows, as MuJoCo has them.

    Boxes, cylinders and spheres are as the robot's file has them; meshes are decimated as in a
    playback. A body without either is a rod from its joint to the next joint or foot.

    Args:
        robot: the robot.
        prefix: with which the names of the mesh files begin, which lie beside the model.
    """
    feet = {foot.name: foot.radius for foot in robot.feet}
    shapes = RobotShapes(robot.urdf, feet, finder=resources_of(robot), store=MeshStore())
    meshes = _Meshes(prefix)
    geoms = {
        body: [text for shape in drawn if (text := _geom(shape, meshes))]
        for body, drawn in shapes.bodies.items()
    }
    return DrawnRobot(
        Drawn(geoms, meshes.elements), meshes.files, tuple(dict.fromkeys(shapes.notes))
    )


class _Meshes:
    """The mesh files of a model, each geometry once."""

    def __init__(self, prefix: str) -> None:
        self.prefix, self.files = prefix, dict[str, bytes]()
        self.elements: list[str] = []
        self._names: dict[int, str | None] = {}

    def name(self, geometry: Any) -> str | None:
        """Return the name of a mesh; None of one that MuJoCo would refuse."""
        key = id(geometry)
        if key not in self._names:
            data = geometry["data"]
            vertices = data["attributes"]["position"]["array"].reshape(-1, 3)
            faces = data["index"]["array"].reshape(-1, 3)
            self._names[key] = self._add(vertices[faces.astype(np.int64)])
        return self._names[key]

    def _add(self, triangles: Any) -> str | None:
        low, high = MESH_FACES
        few = len(np.unique(triangles.reshape(-1, 3), axis=0)) < LEAST_VERTICES
        if few or not low <= len(triangles) <= high:
            return None
        name = f"mesh_{len(self.files)}"
        file = f"{self.prefix}{name}.stl"
        self.files[file] = stl(triangles)
        # a mesh that is not closed has no volume, of which MuJoCo would make its inertia
        self.elements.append(f'<mesh name="{name}" file={quoteattr(file)} inertia="shell"/>')
        return name


def stl(triangles: Any) -> bytes:
    """Return triangles (F, 3, 3) [m] as a binary STL file."""
    rows = np.zeros(
        len(triangles), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")]
    )
    rows["corners"] = triangles
    count = len(triangles).to_bytes(4, "little")
    return b"".join((bytes(80), count, rows.tobytes()))


def _geom(shape: DrawnShape, meshes: _Meshes) -> str:
    """Return a <geom> without contact; empty where MuJoCo has no such shape."""
    import pinocchio as pin

    geometry, turn = shape.geometry, shape.rotation
    kind = geometry["type"]
    if kind == "BoxGeometry":
        half = [0.5 * geometry[side] for side in ("width", "height", "depth")]
        body = f'type="box" size="{numbers(half)}"'
    elif kind == "SphereGeometry":
        body = f'type="sphere" size="{number(geometry["radius"])}"'
    elif kind == "CylinderGeometry":
        size = (geometry["radiusBottom"], 0.5 * geometry["height"])
        body, turn = f'type="cylinder" size="{numbers(size)}"', turn @ Y_TO_Z.T
    else:
        name = meshes.name(geometry)
        if name is None:
            return ""
        body = f'type="mesh" mesh="{name}"'
    x, y, z, w = pin.Quaternion(np.array(turn)).coeffs().tolist()
    place = f'pos="{numbers(shape.position.tolist())}" quat="{numbers((w, x, y, z))}"'
    return f'<geom {body} {place} {UNSEEN} rgba="{numbers(shape.color)}"/>'
