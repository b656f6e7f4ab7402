"""An MJCF file, MuJoCo's own format, becomes a URDF: bodies, joints, shapes and what drives them.

MuJoCo itself reads the file (the package `mujoco`), so that defaults, included files and inertias
from shapes are as it has them. A link's frame is that of its body, moved to the joint's anchor.
"""

from __future__ import annotations

import os
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import MissingPackageError, UrdfError
from hexapod_pin.robot.description.urdf_annotation import ANNOTATION
from hexapod_pin.robot.description.urdf_writer import number, numbers
from hexapod_pin.robot.rotations import roll_pitch_yaw, rotations

LIMIT = "limit"
"""Element of the annotation for limits that MJCF has no place for, in files written here."""

LEAST_RADIUS = 1e-5
"""A foot's sphere that is not larger stands for a point [m]."""

FOOT_WORDS = ("foot", "tip", "toe", "tarsus")
"""A site with one of these in its name becomes a frame."""


def urdf_of_mjcf(path: str | Path) -> tuple[str, tuple[str, ...]]:
    """Return the URDF of the robot in an MJCF file, and a sentence on what it cannot have.

    The robot is the body with a free joint; of several the one with most joints.

    Raises:
        MissingPackageError: the package `mujoco` is not installed.
        UrdfError: MuJoCo refuses the file, or there is no such body, or a joint that is no hinge
            or slide.
    """
    spec, model = compiled_mjcf(path)
    return _Robot(str(path), spec, model).urdf()


def compiled_mjcf(path: str | Path) -> tuple[Any, Any]:
    """Return the specification and the model that MuJoCo makes of an MJCF file; raises as above."""
    if find_spec("mujoco") is None:
        raise MissingPackageError("mujoco", "mujoco", f"{path}: an MJCF file")
    import mujoco

    try:
        with _no_log(mujoco):
            spec = mujoco.MjSpec.from_file(os.path.abspath(path))
            return spec, spec.compile()
    except (ValueError, RuntimeError, mujoco.FatalError) as error:
        reason = " ".join(str(error).split())
        raise UrdfError(str(path), [f"MuJoCo cannot read it: {reason}"]) from error


@contextmanager
def _no_log(mujoco: Any) -> Iterator[None]:
    """Keep MuJoCo from writing its warnings into a file of the current folder."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda text: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


class _Robot:
    """The tree of links below a body of a compiled model."""

    def __init__(self, source: str, spec: Any, model: Any) -> None:
        import mujoco

        self.mujoco: Any = mujoco
        self.source, self.spec, self.model = source, spec, model
        self.root = ET.Element("robot", name=spec.modelname or Path(source).stem)
        self.notes: list[str] = []
        self.links: set[str] = set()
        self.anchors: dict[int, Array] = {}
        self.names: dict[int, str] = {}
        self.limits: dict[str, ET.Element] = {}
        self.joints: list[int] = []

    def urdf(self) -> tuple[str, tuple[str, ...]]:
        """Return the text, and what it does not have."""
        base = self._base()
        self._take_statements()
        self._body(base, None)
        for body in range(base + 1, self.model.nbody):
            parent = int(self.model.body_parentid[body])
            if parent in self.names:
                self._body(body, parent)
        self._state_posture()
        armature = self.model.dof_armature[self.model.jnt_dofadr[self.joints]]
        if armature.any():
            text = f"{numbers((armature.min(), armature.max()))}".replace(" ", " to ")
            self.notes.append(
                f"rotor inertia (armature) of {text} kg m^2 at {np.count_nonzero(armature)} joints "
                "is no part of a robot here: hp.interchange.read_mjcf returns it, and "
                "Motor(rotor_inertia=...) carries it"
            )
        ET.indent(self.root)
        return ET.tostring(self.root, encoding="unicode") + "\n", tuple(self.notes)

    def _base(self) -> int:
        """Return the body that floats."""
        model, free = self.model, self.mujoco.mjtJoint.mjJNT_FREE
        floating = [
            int(model.jnt_bodyid[k]) for k in range(model.njnt) if model.jnt_type[k] == free
        ]
        on_world = [body for body in range(1, model.nbody) if model.body_parentid[body] == 0]
        fixed = [body for body in on_world if model.body_jntnum[body] == 0]
        chosen = floating or fixed
        if not chosen:
            raise UrdfError(self.source, ["no body with a free joint: a robot's trunk has one"])

        def joints(body: int) -> int:
            return sum(model.body_rootid[model.jnt_bodyid[k]] == body for k in range(model.njnt))

        base = max(chosen, key=joints)
        if model.body_parentid[base] != 0:
            raise UrdfError(self.source, ["the body with a free joint is not below <worldbody>"])
        if not floating:
            self.notes.append(
                f"body {model.body(base).name!r} is fixed in the file; it floats here"
            )
        if len(on_world) > 1:
            self.notes.append(f"{len(on_world) - 1} other bodies of the file are left out")
        return base

    # Links and joints.

    def _body(self, body: int, parent: int | None) -> None:
        """Add a body's link, the joints between it and its parent, and its shapes."""
        model = self.model
        name = self.names[body] = self._free_name(model.body(body).name or f"body_{body}")
        self.anchors[body] = np.zeros(3)
        if parent is not None:
            self._connect(body, parent, name)
        link = ET.SubElement(self.root, "link", name=name)
        if model.body_mass[body] > 0.0:
            self._inertial(link, body)
        for geom in range(model.ngeom):
            if model.geom_bodyid[geom] == body:
                self._geom(link, name, geom)
        for site in range(model.nsite):
            label = model.site(site).name
            known = label in self.links
            if model.site_bodyid[site] == body and not known and _names_foot(label):
                self._frame(label, name, model.site_pos[site] - self.anchors[body])

    def _connect(self, body: int, parent: int, name: str) -> None:
        """Add the joints that move a body, from its parent outwards; a fixed one without any."""
        model = self.model
        place = model.body_pos[body] - self.anchors[parent]
        turn = _matrix(model.body_quat[body])
        first = int(model.body_jntadr[body])
        joints = list(range(first, first + int(model.body_jntnum[body])))
        if not joints:
            self._fix(name, self.names[parent], place, turn)
        above = self.names[parent]
        for k in joints:
            anchor = np.array(model.jnt_pos[k])
            moved = turn @ (anchor - self.anchors[body])
            below = name if k == joints[-1] else self._free_name(f"{name}_{k}")
            if below != name:
                ET.SubElement(self.root, "link", name=below)
            self._joint(k, above, below, place + moved, turn)
            place, turn, above, self.anchors[body] = np.zeros(3), np.eye(3), below, anchor

    def _joint(self, k: int, parent: str, child: str, place: Array, turn: Array) -> None:
        """Add a hinge or slide; its zero is where the file's joint is at its `ref`."""
        model, kinds = self.model, self.mujoco.mjtJoint
        name = model.joint(k).name or f"joint_{k}"
        kind = {kinds.mjJNT_HINGE: "revolute", kinds.mjJNT_SLIDE: "prismatic"}.get(
            kinds(model.jnt_type[k])
        )
        if kind is None:
            text = f"joint {name!r} is neither hinge nor slide: no robot here has such a joint"
            raise UrdfError(self.source, [text])
        if kind == "revolute" and not model.jnt_limited[k]:
            kind = "continuous"
        joint = ET.SubElement(self.root, "joint", name=name, type=kind)
        ET.SubElement(joint, "parent", link=parent)
        ET.SubElement(joint, "child", link=child)
        _origin(joint, place, turn)
        ET.SubElement(joint, "axis", xyz=numbers(model.jnt_axis[k]))
        limit = ET.SubElement(joint, "limit")
        if model.jnt_limited[k]:
            low, high = model.jnt_range[k] - model.qpos0[model.jnt_qposadr[k]]
            limit.set("lower", number(low))
            limit.set("upper", number(high))
        effort = self._effort(k)
        if effort is not None:
            limit.set("effort", number(effort))
        for key in ("lower", "upper", "effort", "velocity"):
            own = self.limits.get(name)
            if own is not None and own.get(key) is not None:
                limit.set(key, own.get(key, ""))
        dof = int(model.jnt_dofadr[k])
        damping, friction = model.dof_damping[dof], model.dof_frictionloss[dof]
        ET.SubElement(joint, "dynamics", damping=number(np.ravel(damping)[0]),
                      friction=number(friction))  # fmt: skip
        self.joints.append(k)

    def _effort(self, k: int) -> float | None:
        """Return the largest torque [N m] or force [N] that drives a joint; None: not stated."""
        model, found = self.model, []
        if model.jnt_actfrclimited[k]:
            found.append(float(np.abs(model.jnt_actfrcrange[k]).max()))
        for one in actuators_of(model, k):
            if model.actuator_forcelimited[one]:
                gear = abs(float(model.actuator_gear[one, 0]))
                found.append(gear * float(np.abs(model.actuator_forcerange[one]).max()))
        return min(found, default=None)

    def _inertial(self, link: ET.Element, body: int) -> None:
        """Add mass, centre of mass, and inertia along the link's axes."""
        model = self.model
        inertial = ET.SubElement(link, "inertial")
        turn = _matrix(model.body_iquat[body])
        matrix = turn @ np.diag(model.body_inertia[body]) @ turn.T
        _origin(inertial, model.body_ipos[body] - self.anchors[body], np.eye(3))
        ET.SubElement(inertial, "mass", value=number(model.body_mass[body]))
        moments = {"ixx": (0, 0), "iyy": (1, 1), "izz": (2, 2), "ixy": (0, 1), "ixz": (0, 2),
                   "iyz": (1, 2)}  # fmt: skip
        values = {key: number(matrix[at]) for key, at in moments.items()}
        ET.SubElement(inertial, "inertia", values)

    # Shapes.

    def _geom(self, link: ET.Element, name: str, geom: int) -> None:
        """Add a geom: what touches others as a collision shape, what is seen as a visual."""
        model, kinds = self.model, self.mujoco.mjtGeom
        touches = bool(model.geom_contype[geom] | model.geom_conaffinity[geom])
        label = model.geom(geom).name
        place = model.geom_pos[geom] - self.anchors[int(model.geom_bodyid[geom])]
        if touches and label and model.geom_type[geom] == kinds.mjGEOM_SPHERE:
            radius = float(model.geom_size[geom, 0])
            frame = self._frame(label, name, place)
            if radius > LEAST_RADIUS:
                _shape(frame, "collision", np.zeros(3), np.eye(3), "sphere", radius=number(radius))
            return
        turn = _matrix(model.geom_quat[geom])
        tag = "collision" if touches else "visual"
        seen = model.geom_group[geom] <= 2  # the groups that viewers show
        for part in self._primitives(geom, place, turn):
            _shape(link, tag, *part[:-1], **part[-1])
            if touches and seen:
                self._color(_shape(link, "visual", *part[:-1], **part[-1]), geom)
            elif not touches:
                self._color(link[-1], geom)

    def _primitives(self, geom: int, place: Array, turn: Array) -> list[tuple[Any, ...]]:
        """Return position, rotation, kind and sizes of the shapes that a geom is made of."""
        model, kinds = self.model, self.mujoco.mjtGeom
        kind, size = kinds(model.geom_type[geom]), model.geom_size[geom]
        if kind == kinds.mjGEOM_SPHERE:
            return [(place, turn, "sphere", {"radius": number(size[0])})]
        if kind == kinds.mjGEOM_BOX:
            return [(place, turn, "box", {"size": numbers(2.0 * size)})]
        if kind in (kinds.mjGEOM_CYLINDER, kinds.mjGEOM_CAPSULE):
            sizes = {"radius": number(size[0]), "length": number(2.0 * size[1])}
            rod = (place, turn, "cylinder", sizes)
            if kind == kinds.mjGEOM_CYLINDER:
                return [rod]
            ends = [place + sign * size[1] * turn[:, 2] for sign in (-1.0, 1.0)]
            ends.sort(key=lambda end: -float(np.linalg.norm(end)))  # a foot is the far one
            ball = {"radius": number(size[0])}
            return [*((end, np.eye(3), "sphere", ball) for end in ends), rod]
        if kind == kinds.mjGEOM_MESH:
            return self._mesh(int(model.geom_dataid[geom]), place, turn)
        self.notes.append(f"geom {model.geom(geom).name or geom}: a URDF has no such shape")
        return []

    def _mesh(self, mesh: int, place: Array, turn: Array) -> list[tuple[Any, ...]]:
        """Return a mesh in the frame of its file: MuJoCo moves it to its centre and turns it."""
        model = self.model
        name = model.mesh(mesh).name
        file = next((one.file for one in self.spec.meshes if one.name == name), "")
        file = file or next((x.file for x in self.spec.meshes if Path(x.file).stem == name), "")
        if not file:
            self.notes.append(f"mesh {name!r} is in no file of its own; it is left out")
            return []
        own = _matrix(model.mesh_quat[mesh])
        turn = turn @ own.T
        place = place - turn @ model.mesh_pos[mesh]
        sizes = {
            "filename": os.path.join(self.spec.meshdir, file),
            "scale": numbers(model.mesh_scale[mesh]),
        }
        return [(place, turn, "mesh", sizes)]

    def _color(self, visual: ET.Element, geom: int) -> None:
        """Give a visual the colour of its geom, or of the geom's material."""
        model = self.model
        material = int(model.geom_matid[geom])
        rgba = model.geom_rgba[geom] if material < 0 else model.mat_rgba[material]
        element = ET.SubElement(visual, "material", name=f"geom_{geom}")
        ET.SubElement(element, "color", rgba=numbers([round(float(x), 6) for x in rgba]))

    def _frame(self, label: str, parent: str, place: Array) -> ET.Element:
        """Add a link without mass, fixed to another."""
        name = self._free_name(label)
        link = ET.SubElement(self.root, "link", name=name)
        self._fix(name, parent, place, np.eye(3))
        return link

    def _fix(self, child: str, parent: str, place: Array, turn: Array) -> None:
        joint = ET.SubElement(self.root, "joint", name=f"{child}_fixed", type="fixed")
        ET.SubElement(joint, "parent", link=parent)
        ET.SubElement(joint, "child", link=child)
        _origin(joint, place, turn)

    def _free_name(self, name: str) -> str:
        """Return a name that no link has yet."""
        free, k = name, 1
        while free in self.links:
            free, k = f"{name}_{k}", k + 1
        self.links.add(free)
        return free

    # What a file written here states of the robot, and the posture of its first keyframe.

    def _take_statements(self) -> None:
        """Copy the annotation of a file written here; limits in it are taken out of it."""
        text = next((one.data for one in self.spec.texts if one.name == ANNOTATION), None)
        if text is None:
            return
        try:
            element = ET.fromstring(text)
        except ET.ParseError as error:
            finding = f"<text name={ANNOTATION!r}> is no XML ({error})"
            raise UrdfError(self.source, [finding]) from error
        for limit in element.findall(LIMIT):
            self.limits[limit.get("joint", "")] = limit
            element.remove(limit)
        self.root.append(element)

    def _state_posture(self) -> None:
        """State the joint angles of the first keyframe as the standing posture."""
        model = self.model
        if not model.nkey:
            return
        element = self.root.find(ANNOTATION)
        if element is None:
            element = ET.SubElement(self.root, ANNOTATION)
        known = {
            entry.get("joint"): (entry, key)
            for tag, key in (("posture", "angle"), ("held", "position"))
            for entry in element.findall(tag)
        }
        for k in self.joints:
            name, at = model.joint(k).name or f"joint_{k}", model.jnt_qposadr[k]
            place = number(model.key_qpos[0][at] - model.qpos0[at])
            if name in known:
                entry, key = known[name]
                entry.set(key, place)
            else:
                ET.SubElement(element, "posture", joint=name, angle=place)


def actuators_of(model: Any, joint: int) -> list[int]:
    """Return the actuators of a compiled model that drive a joint."""
    import mujoco

    kinds = mujoco.mjtTrn
    on_joint = (kinds.mjTRN_JOINT, kinds.mjTRN_JOINTINPARENT)
    return [
        one
        for one in range(model.nu)
        if kinds(model.actuator_trntype[one]) in on_joint and model.actuator_trnid[one, 0] == joint
    ]


def _matrix(quaternion: Array) -> Array:
    """Return the rotation (3, 3) of a quaternion w, x, y, z."""
    return np.asarray(rotations(quaternion[None, [1, 2, 3, 0]])[0])


def _names_foot(label: str) -> bool:
    return any(word in label.lower() for word in FOOT_WORDS)


def _origin(parent: ET.Element, place: Sequence[float] | Array, turn: Array) -> None:
    xyz, rpy = numbers(list(place)), numbers(roll_pitch_yaw(turn).tolist())
    ET.SubElement(parent, "origin", xyz=xyz, rpy=rpy)


def _shape(
    link: ET.Element, tag: str, place: Array, turn: Array, kind: str, **sizes: str
) -> ET.Element:
    """Add a collision or visual shape to a link."""
    element = ET.SubElement(link, tag)
    _origin(element, place, turn)
    ET.SubElement(ET.SubElement(element, "geometry"), kind, sizes)
    return element
