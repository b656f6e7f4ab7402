"""A scene as MJCF text, MuJoCo's own format: bodies, feet, ground, drives and keyframes.

The bodies are those of the model that is integrated here: what is fixed together is one body, with
the masses of the scene's loads, in the frames of `Robot.model`. Numbers are written so that they
read back as the same floats. Format: https://mujoco.readthedocs.io/en/stable/XMLreference.html
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple
from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

import numpy as np

from hexapod_pin.drive.drive_law import armature, dry_friction, torque_cap
from hexapod_pin.errors import ParameterError
from hexapod_pin.ground.terrain import HeightField, PatchedGround, Plane, ShakingGround
from hexapod_pin.robot.description.urdf_annotation import ANNOTATION
from hexapod_pin.robot.description.urdf_writer import number, numbers
from hexapod_pin.robot.link_shapes import urdf_of
from hexapod_pin.robot.reading.mjcf_urdf import LEAST_RADIUS, LIMIT
from hexapod_pin.scene.scene import loaded_model

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array
    from hexapod_pin.drive.servo import Servo
    from hexapod_pin.robot.robot import Robot
    from hexapod_pin.scene.scene import Scene

ROOT = "root_joint"
"""Name of the floating base's joint in `Robot.model`."""

FREE_JOINT = "root"
"""Name of the free joint in MJCF."""

PLANE_SIZE = (5.0, 5.0, 0.1)
"""Half lengths of the plane as it is drawn, and the spacing of its grid [m]; it has no end."""

SIDE = 5.0
"""Half length of a height field that stands for a profile, across and along it [m]."""

PROFILE_STEP = 0.005
"""Distance of its points along the profile: a vertical riser becomes a slope this wide [m]."""

MOST_POINTS = 1_000_000
"""Of a height field."""

FIELD_BASE = 0.1
"""Depth of the solid below the lowest point of a height field [m]."""

SPIN_FRICTION = (0.005, 0.0001)
"""MuJoCo's own torsional [m] and rolling [m] friction, without effect on contacts of 3 axes."""


class JointDrives(NamedTuple):
    """What acts in the joints, `Robot.joint_names` order; of sliding joints N and m.

    Attributes:
        kp: servo stiffness [N m/rad]. Shape (n,).
        kd: servo damping [N m s/rad]. Shape (n,).
        limit: largest servo torque [N m]; inf where there is none. Shape (n,).
        damping: viscous damping of joint, motor and gear [N m s/rad]. Shape (n,).
        friction: level of dry friction of joint and motor [N m]. Shape (n,).
        armature: what the rotors add to the joints' inertias [kg m^2]. Shape (n,).
    """

    kp: Array
    kd: Array
    limit: Array
    damping: Array
    friction: Array
    armature: Array

    @classmethod
    def of(cls, robot: Robot, servo: Servo) -> JointDrives:
        """Return the drives of a robot; a motor's torque is limited by its stall torque.

        Raises:
            ParameterError: gains or motors that do not fit the robot's joints.
        """
        motors = servo.motors(robot)
        stall = [x.stall_torque * x.voltage_ratio if x else np.inf for x in motors]
        viscous = [x.viscous_friction if x else 0.0 for x in motors]
        return cls(
            *servo.gains(robot), np.minimum(torque_cap(robot, servo), stall),
            np.array(robot.damping) + viscous, dry_friction(robot, servo), armature(robot, servo),
        )  # fmt: skip


@dataclass(frozen=True)
class MjcfOptions:
    """MuJoCo's own settings.

    Attributes:
        step: of its integration [s].
        integrator: "implicitfast", "Euler" or "RK4".
        cone: of friction, "pyramidal" (MuJoCo's default) or "elliptic".
        impratio: stiffness of friction over that of the normal force [-]; MuJoCo's default is 1.
        exact: contacts are solved to 1e-12, not to MuJoCo's default of 1e-8.
        joint_limits: whether the joints have the ranges of the robot.
        contact_time: time constant of a contact, the first number of `solref` [s]; None: MuJoCo's
            default, 0.02.
    """

    step: float
    integrator: str = "implicitfast"
    cone: str = "pyramidal"
    impratio: float = 1.0
    exact: bool = False
    joint_limits: bool = True
    contact_time: float | None = None

    @property
    def element(self) -> str:
        """The attributes of <option>."""
        more = ' tolerance="1e-12" iterations="200"' if self.exact else ""
        return (
            f'timestep="{number(self.step)}" integrator="{self.integrator}" cone="{self.cone}" '
            f'impratio="{number(self.impratio)}"{more}'
        )


class Keyframe(NamedTuple):
    """A posture of the robot with its set-points.

    Attributes:
        name: of the keyframe.
        time: [s].
        q: base position [m], quaternion x, y, z, w, joint angles [rad]. Shape (7 + n,).
        control: set-points of the position actuators, `Robot.joint_names` order [rad]. Shape (n,).
    """

    name: str
    time: float
    q: Array
    control: Array


class Drawn(NamedTuple):
    """What is drawn of a robot: <geom> elements by joint that moves them, and <mesh> elements."""

    geoms: Mapping[str, Sequence[str]] = {}
    meshes: Sequence[str] = ()


NOTHING_DRAWN = Drawn()


def mjcf_text(
    scene: Scene, drives: JointDrives, options: MjcfOptions, *, drawn: Drawn = NOTHING_DRAWN,
    keyframes: Sequence[Keyframe] = (), remarks: Sequence[str] = (),
) -> str:  # fmt: skip
    """Return a scene as MJCF.

    Args:
        scene: robot, masses, ground, coefficient of friction, gravity.
        drives: of its joints.
        options: settings of MuJoCo.
        drawn: shapes without contact, beside the feet's spheres.
        keyframes: in the order in which they are written.
        remarks: lines of a comment in front.
    """
    robot, mu = scene.robot, scene.contact.friction.limit
    bodies = _Bodies(scene, drives, options, drawn)
    body = bodies.text(1, "    ")
    field, ground = _ground(scene)
    touch = f'friction="{numbers((mu, *SPIN_FRICTION))}"'
    if options.contact_time is not None:
        touch += f' solref="{number(options.contact_time)} 1"'
    lines = [
        *_comment(remarks),
        f"<mujoco model={quoteattr(robot.name)}>",
        '  <compiler angle="radian" autolimits="true" inertiafromgeom="false"/>',
        f'  <option gravity="{numbers(scene.gravity)}" {options.element}/>',
        *_statements(robot),
        *_section("asset", [*field, *drawn.meshes]),
        "  <worldbody>",
        f'    <geom name="floor" {ground} contype="1" conaffinity="0" priority="1" {touch} '
        'rgba="0.75 0.78 0.8 1"/>',
        body.rstrip("\n"),
        "  </worldbody>",
        *_section("actuator", _actuators(robot, drives)),
        *_section("keyframe", [bodies.keyframe(key) for key in keyframes]),
        "</mujoco>",
    ]
    return "\n".join(lines) + "\n"


def body_name(robot: Robot, joint: str) -> str:
    """Return the name of the link that a joint moves; of the base that of the root link."""
    file = urdf_of(robot)
    if joint == ROOT:
        return file.base
    return next(one.child for one in file.joints if one.name == joint)


def _comment(lines: Sequence[str]) -> list[str]:
    """Return a comment; two hyphens would end it."""
    return [f"<!-- {line.replace('--', '- -')} -->" for line in lines]


def _section(name: str, parts: Sequence[str]) -> list[str]:
    """Return an element with its parts; nothing without parts."""
    return [f"  <{name}>", *(f"    {part}" for part in parts), f"  </{name}>"] if parts else []


def _statements(robot: Robot) -> list[str]:
    """Return what the robot's file states of legs and posture, and limits that MJCF does not have.

    The reader of MJCF takes it again.
    """
    own = urdf_of(robot).root.find(ANNOTATION)
    element = ElementTree.Element(ANNOTATION) if own is None else copy.deepcopy(own)
    for name, effort, velocity in zip(
        robot.joint_names, robot.effort_limit, robot.velocity_limit, strict=True
    ):
        limits = {"joint": name, "effort": number(effort), "velocity": number(velocity)}
        ElementTree.SubElement(element, LIMIT, limits)
    data = " ".join(ElementTree.tostring(element, encoding="unicode").split())
    return _section("custom", [f'<text name="{ANNOTATION}" data={quoteattr(data)}/>'])


def _actuators(robot: Robot, drives: JointDrives) -> list[str]:
    """Return a position actuator per joint, force = kp (control - q) - kd v."""
    found = []
    for name, kp, kd, limit in zip(
        robot.joint_names, drives.kp, drives.kd, drives.limit, strict=True
    ):
        force = f' forcerange="{numbers((-limit, limit))}"' if np.isfinite(limit) else ""
        label = quoteattr(name)
        found.append(
            f'<position name={label} joint={label} kp="{number(kp)}" kv="{number(kd)}"{force}/>'
        )
    return found


# The tree of bodies, in the frames of the joints that move them.


class _Bodies:
    """Writes the bodies of a robot, and remembers in which order MuJoCo will have its joints."""

    def __init__(
        self, scene: Scene, drives: JointDrives, options: MjcfOptions, drawn: Drawn
    ) -> None:
        self.robot, self.model = scene.robot, loaded_model(scene)
        self.friction = scene.contact.friction.limit
        self.drives, self.options, self.drawn = drives, options, drawn
        self.order: list[int] = []

    def text(self, joint: int, indent: str) -> str:
        """Return the body that a joint of the model moves, and those below it."""
        robot, name = self.robot, str(self.model.names[joint])
        place = self.model.jointPlacements[joint]
        at = "" if name == ROOT else f" {_pose(place)}"
        lines = [
            f"<body name={quoteattr(body_name(robot, name))}{at}>",
            f"  {_inertial(self.model.inertias[joint])}",
            f"  {self._joint(name, joint)}",
            *(f"  {geom}" for geom in self.drawn.geoms.get(name, ())),
            *(f"  {self._foot(foot)}" for foot in robot.feet if foot.joint == name),
        ]
        text = "".join(f"{indent}{line}\n" for line in lines)
        below = [child for child in range(1, self.model.njoints) if self._parent(child) == joint]
        text += "".join(self.text(child, indent + "  ") for child in below)
        return f"{text}{indent}</body>\n"

    def keyframe(self, key: Keyframe) -> str:
        """Return a <key>; MuJoCo has the quaternion's w first."""
        angles = key.q[7:][self.order]
        q = numbers([*key.q[:3], *key.q[[6, 3, 4, 5]], *angles])
        return (
            f'<key name={quoteattr(key.name)} time="{number(key.time)}" qpos="{q}" '
            f'ctrl="{numbers(key.control.tolist())}"/>'
        )

    def _parent(self, joint: int) -> int:
        return int(self.model.parents[joint])

    def _joint(self, name: str, joint: int) -> str:
        """Return the free joint of the base, or the hinge or slide of another body."""
        if name == ROOT:
            return f'<freejoint name="{FREE_JOINT}"/>'
        k = self.robot.joint_index(name)
        self.order.append(k)
        column = np.array(self.model.createData().joints[joint].S, dtype=float).reshape(6)
        turns = bool(self.robot.turning[k])
        axis = numbers((column[3:] if turns else column[:3]).tolist())
        low, high = float(self.robot.lower[k]), float(self.robot.upper[k])
        limited = self.options.joint_limits and low < high
        values = {
            "range": (low, high) if limited else (),
            "damping": (self.drives.damping[k],),
            "frictionloss": (self.drives.friction[k],),
            "armature": (self.drives.armature[k],),
        }
        more = "".join(f' {key}="{numbers(x)}"' for key, x in values.items() if any(x))
        kind = "hinge" if turns else "slide"
        return f'<joint name={quoteattr(name)} type="{kind}" axis="{axis}"{more}/>'

    def _foot(self, foot: Any) -> str:
        """Return the sphere of a foot, which touches the ground alone."""
        place = numbers(foot.offset.tolist())
        return (
            f'<geom name={quoteattr(foot.name)} type="sphere" pos="{place}" '
            f'size="{number(foot.radius or LEAST_RADIUS)}" contype="0" conaffinity="1" '
            f'friction="{numbers((self.friction, *SPIN_FRICTION))}" rgba="0.2 0.2 0.22 1"/>'
        )


def _pose(place: Any) -> str:
    """Return position and quaternion, w first, of a placement."""
    import pinocchio as pin

    x, y, z, w = pin.Quaternion(np.array(place.rotation)).coeffs().tolist()
    return f'pos="{numbers(place.translation)}" quat="{numbers((w, x, y, z))}"'


def _inertial(body: Any) -> str:
    """Return mass, centre of mass and inertia about it, along the body's axes."""
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = body.inertia.tolist()
    return (
        f'<inertial pos="{numbers(body.lever)}" mass="{number(body.mass)}" '
        f'fullinertia="{numbers((xx, yy, zz, xy, xz, yz))}"/>'
    )


# The ground: a plane, or a height field.


def _ground(scene: Scene) -> tuple[list[str], str]:
    """Return the <hfield> that the ground needs, if any, and the attributes of its <geom>."""
    surface = scene.terrain.surface()
    if isinstance(surface, Plane):
        import pinocchio as pin

        up = np.array([0.0, 0.0, 1.0])
        turn = pin.Quaternion.FromTwoVectors(up, np.array(surface.normal)).matrix()
        place = pin.SE3(turn, np.array(surface.point))
        return [], f'type="plane" size="{numbers(PLANE_SIZE)}" {_pose(place)}'
    heights, sides, place = _height_field(scene)
    low, span = float(heights.min()), float(np.ptp(heights))
    place.translation = place.translation + [0.0, 0.0, low]
    rows, columns = heights.shape
    share = (heights[::-1] - low) / (span or 1.0)  # in a file the row of the largest y is first
    size = numbers((*sides, span or 1.0, FIELD_BASE))
    field = (
        f'<hfield name="ground" nrow="{rows}" ncol="{columns}" size="{size}" '
        f'elevation="{numbers(share.ravel().tolist())}"/>'
    )
    return [field], f'type="hfield" hfield="ground" {_pose(place)}'


def _height_field(scene: Scene) -> tuple[Array, tuple[float, float], Any]:
    """Return heights (ny, nx) [m], the half lengths along x and y [m], and where the field is."""
    import pinocchio as pin

    ground: Any = scene.terrain
    while isinstance(ground, PatchedGround | ShakingGround):
        ground = ground.ground
    if isinstance(ground, HeightField):
        rows, columns = ground.shape
        half = 0.5 * ground.spacing[0] * (columns - 1), 0.5 * ground.spacing[1] * (rows - 1)
        middle = np.array([ground.origin[0] + half[0], ground.origin[1] + half[1], 0.0])
        heights, place = ground.z, pin.SE3(np.eye(3), middle)
    else:
        surface = ground.surface()  # a profile along its heading, the same sideways
        first, last = surface.s[0], surface.s[-1]
        half = 0.5 * (last - first) + SIDE, SIDE
        count = 2 * round(half[0] / PROFILE_STEP) + 1
        _require_points(scene, count)
        s = 0.5 * (first + last) + np.linspace(-half[0], half[0], count)
        row = surface.height_at(s * surface.along[0], s * surface.along[1])
        turn = pin.rpy.rpyToMatrix(0.0, 0.0, surface.heading)
        middle = np.append(0.5 * (first + last) * surface.along, 0.0)
        heights, place = np.stack([row, row]), pin.SE3(turn, middle)
    _require_points(scene, heights.size)
    return heights, half, place


def _require_points(scene: Scene, points: int) -> None:
    """Refuse a field that would make a file of tens of megabytes."""
    if points > MOST_POINTS:
        allowed = f"a ground of at most {MOST_POINTS} heights in MJCF, not {points}"
        raise ParameterError("Scene.terrain", scene.terrain.kind, allowed)
