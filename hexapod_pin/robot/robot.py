"""A robot has a model, legs, feet and a standing posture, loaded from a URDF.

Values that depend on the robot alone are computed once per robot.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache, wraps
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hexapod_pin.arguments import checked
from hexapod_pin.arrays import Array, digest, read_only
from hexapod_pin.errors import ParameterError, UnknownNameError, UrdfError
from hexapod_pin.immutable import Immutable, content_digest, rebuilt
from hexapod_pin.log import LOG
from hexapod_pin.robot.description.leg_names import LEG_NAMES
from hexapod_pin.robot.description.urdf_annotation import read_provenance
from hexapod_pin.robot.description.urdf_file import Joint, parse_urdf
from hexapod_pin.robot.loading.backlash import GAP, ROTOR
from hexapod_pin.robot.loading.load_options import KeyedOptions, LoadOptions
from hexapod_pin.robot.loading.load_urdf import LoadedUrdf, load_urdf
from hexapod_pin.robot.loading.pin_model import Foot, build_model, joints_in_order, place_feet
from hexapod_pin.robot.recognition.layout import RobotLayout
from hexapod_pin.robot.robot_source import PACKAGED, absolute, robot_path, urdf_path
from hexapod_pin.robot.state import (
    Posture,
    State,
    checked_state,
    joint_angles,
    plain_posture,
    standing_angles,
)
from hexapod_pin.shown import drawn

if TYPE_CHECKING:
    import pinocchio as pin


@dataclass(frozen=True)
class Leg(Immutable):
    """One leg.

    Attributes:
        name: lf, lm, lr, rf, rm or rr where there are six; else as the file states it.
        joints: names of the joints it walks with, proximal first: coxa, femur and tibia, or coxa
            and femur. Two or three; other joints between trunk and foot are held.
        foot: name of the foot link.
    """

    name: str
    joints: tuple[str, ...]
    foot: str


@dataclass(frozen=True, eq=False)
class Robot(Immutable):
    """A floating-base robot; frozen, its model is never changed afterwards.

    Attributes:
        name: name of the robot in the URDF.
        source: name of a packaged robot, else the absolute path of the file that was loaded.
        model: pin.Model with a free-flyer "root_joint"; q is base position, quaternion x, y, z, w,
            joint angles; v is the base's linear and angular velocity in base axes, joint rates.
        legs: six legs (lf lm lr rf rm rr), or the 4 to 8 that were found; empty for robots
            loaded with feet only.
        feet: the feet, in the order of the legs, or as given.
        joint_names: the actuated joints; joint k is q[7 + k] and v[6 + k].
        lower: (n_joints,) lower limits [rad]; of sliding joints [m], and so on below.
        upper: (n_joints,) upper limits [rad].
        effort_limit: (n_joints,) largest torques [N m]; of sliding joints largest forces [N].
        velocity_limit: (n_joints,) largest rates [rad/s].
        damping: (n_joints,) viscous damping from the URDF [N m s/rad] (Pinocchio's own
            algorithms ignore it).
        friction: (n_joints,) level of dry friction from the URDF [N m] (likewise).
        total_mass: mass of the whole robot [kg].
        posture: (n_joints,) default standing angles [rad].
        provenance: one line: where the numbers come from.
        assumed: statements of what is assumed.
        inferred: what was inferred from the file's geometry, and from what.
        repaired: what was changed to repair the file, before and after.
        notes: what the loader dropped or changed.
        options: how it was loaded (`LoadOptions` as plain data), what differs from the defaults.
        urdf: full text of the file.
        digest: SHA-256 of that text.
        held: joints that no leg walks with (head, arm, surplus leg joint, foot spring) and the
            places where they are held [rad, or m of sliding joints], those of `posture`.
        doubts: what in the file makes torques doubtful, such as inertias in the wrong unit.
        caution: what in the file speaks against the direction that is given; else empty.
    """

    name: str
    source: str
    model: pin.Model = field(repr=False)
    legs: tuple[Leg, ...] = field(repr=False)
    feet: tuple[Foot, ...] = field(repr=False)
    joint_names: tuple[str, ...] = field(repr=False)
    lower: Array = field(repr=False)
    upper: Array = field(repr=False)
    effort_limit: Array = field(repr=False)
    velocity_limit: Array = field(repr=False)
    damping: Array = field(repr=False)
    friction: Array = field(repr=False)
    total_mass: float
    posture: Array = field(repr=False)
    provenance: str
    assumed: tuple[str, ...] = field(repr=False)
    inferred: tuple[str, ...] = field(repr=False)
    repaired: tuple[str, ...] = field(repr=False)
    notes: tuple[str, ...] = field(repr=False)
    options: Mapping[str, Any] = field(repr=False)
    urdf: str = field(repr=False)
    digest: str = field(repr=False)
    held: Mapping[str, float] = field(default_factory=dict, repr=False)
    doubts: tuple[str, ...] = field(default=(), repr=False)
    caution: str = field(default="", repr=False)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the fields but Pinocchio's model, which is built again from the URDF's text.

        The text is that of the file with all that was inferred written into it: neither the file
        nor its meshes are read again, and the model is the same to the bit.
        """
        _, (_, held, protected) = super().__reduce__()
        del held["model"]
        return _robot_again, (held, protected)

    def _repr_html_(self) -> str:
        """Return what a notebook shows: its numbers, and the robot in its standing posture."""
        return str(drawn("notebook_html", self))

    @cached_property
    def turning(self) -> NDArray[np.bool_]:
        """Which joints turn; the others slide: their units are m, N and m/s. Shape (n_joints,)."""
        joints = [self.model.joints[self.model.getJointId(name)] for name in self.joint_names]
        return np.array([np.any(joint.createData().S[3:]) for joint in joints], dtype=bool)

    @cached_property
    def gaps(self) -> Mapping[str, str]:
        """Joints that are a gear's free play, with the joint behind whose motor each one is.

        They have no drive; see `LoadOptions.backlash`. A joint of the user's that has such a name,
        but no rotor's link before it, is none.
        """
        joints = (name for name in self.joint_names if self.model.existFrame(name + ROTOR))
        found = {joint + GAP: joint for joint in joints if joint + GAP in self.joint_names}
        return MappingProxyType(found)

    def leg(self, name: str) -> Leg:
        """Return a leg by name; UnknownNameError lists the known ones."""
        return _by_name("leg", name, {leg.name: leg for leg in self.legs})

    def foot(self, name: str) -> Foot:
        """Return a foot by its link's name; UnknownNameError lists the known ones."""
        return _by_name("foot", name, {foot.name: foot for foot in self.feet})

    def joint_index(self, name: str) -> int:
        """Return k such that the joint is joint_names[k], q[7 + k] and v[6 + k]."""
        return _by_name("joint", name, {joint: k for k, joint in enumerate(self.joint_names)})

    def stand(self, posture: Posture | None = None) -> State:
        """Return the state at rest with a level base and the lowest foot point at z = 0.

        Args:
            posture: (n_joints,) angles [rad], or joint name -> angle (others as in
                `self.posture`); None for `self.posture`.

        Raises:
            StateError: wrong shape or a value that is not finite.
            UnknownNameError: a joint that does not exist.
        """
        import pinocchio as pin

        angles = self.posture if posture is None else self.posture_from(posture)
        q = np.concatenate([[0, 0, 0, 0, 0, 0, 1], angles])
        state = self.check_state(q, np.zeros(self.model.nv))
        data = scratch_data(self)
        pin.forwardKinematics(self.model, data, state.q)
        q[2] = -min(
            float(data.oMi[self.model.getJointId(foot.joint)].act(foot.offset)[2]) - foot.radius
            for foot in self.feet
        )
        return self.check_state(q, state.v)

    def check_state(self, q: ArrayLike, v: ArrayLike) -> State:
        """Return q and v as a checked state; see `hexapod_pin.robot.state.checked_state`."""
        return checked_state(q, v, len(self.joint_names))

    def posture_from(self, posture: Posture) -> Array:
        """Return joint angles in joint_names order from an array or a mapping over the default."""
        return joint_angles(self.joint_names, self.posture, posture)


def _robot_again(held: dict[str, Any], protected: tuple[str, ...]) -> Robot:
    model = build_model(parse_urdf(held["urdf"].encode(), held["source"]))
    return rebuilt(Robot, {**held, "model": model}, protected)


@checked
def load_robot(
    source: str | Path,
    *,
    feet: Sequence[str] | None = None,
    foot_radius: float | None = None,
    posture: Posture | None = None,
    forward: str | float | None = None,
    legs: Mapping[str, Sequence[str]] | None = None,
    held: Mapping[str, float] | None = None,
    repair: bool = False,
    package_path: Sequence[str | Path] = (),
    options: LoadOptions | None = None,
) -> Robot:
    """Load a robot: a packaged one, one of an installed package, or a URDF, xacro or MJCF file.

    What the file does not state is inferred from its geometry and reported in `Robot.inferred`.
    Every argument goes before what is inferred, and before the hints file beside the URDF.

    Args:
        source: name of a packaged robot ("kharagpur", "athena"), or of one that an installed
            package adds; or path of a URDF or xacro file, or of an MJCF file, which MuJoCo reads
            (the extra `mujoco`).
        feet: names of the foot links; needed for robots that are no hexapods.
        foot_radius: radius of all foot spheres [m]; None takes it from each foot's shape.
        posture: standing angles [rad], in joint order or by name; None takes the file's own
            standing posture, and searches one where it has none.
        forward: direction of travel in the root link's frame: "x", "-y", ..., or an angle from its
            x axis [degrees].
        legs: leg name -> its joints from the trunk outwards, or one joint or link of it.
        held: where joints that do not walk are held, by name [rad or m].
        repair: repair what can be repaired first; `Robot.repaired` lists it.
        package_path: folders in which packages and meshes are looked for first.
        options: all of these and more, as one object; the arguments go before it.

    Raises:
        UnknownNameError: no such robot, foot link or joint.
        UrdfError: the file cannot be used; all findings at once, each naming its link or joint.
        ParameterError: an argument or a hint out of range.
        MissingPackageError: an MJCF file, and MuJoCo is not installed.

    Example:
        >>> robot = load_robot("kharagpur")
        >>> robot.leg("lf").joints
        ('lf_coxa_joint', 'lf_femur_joint', 'lf_tibia_joint')
    """
    named: dict[str, Any] = {
        "feet": feet, "foot_radius": foot_radius, "posture": plain_posture(posture), "held": held,
        "forward": forward, "legs": legs, "repair": repair or None,
        "package_path": [str(folder) for folder in package_path] or None,
    }  # fmt: skip
    arguments = LoadOptions(**{key: value for key, value in named.items() if value is not None})
    if options is not None:
        arguments = arguments.over(options)
    if source in PACKAGED:
        robot = _own_model(_packaged(str(source), arguments.keyed()))
    else:
        path = robot_path(source)
        robot = robot_of(load_urdf(path, arguments), absolute(path))
        for kind in ("repaired", "inferred", "notes", "doubts"):
            for text in getattr(robot, kind):
                LOG.info("%s: %s: %s", path, kind, text)
    if posture is not None:
        robot.posture_from(posture)  # refuses what is no posture: numbers that are not finite
    return robot


KEPT_ROBOTS = 16
"""How many packaged robots are cached, each with its options: their files do not change."""


@lru_cache(maxsize=KEPT_ROBOTS)
def _packaged(name: str, keyed: KeyedOptions) -> Robot:
    """Load a robot of the package."""
    return robot_of(load_urdf(urdf_path(name), keyed.options), name)


def _own_model(robot: Robot) -> Robot:
    """Return a cached robot with a model of its own: a user's change of one changes no other."""
    import pinocchio as pin

    _, (held, protected) = robot.__reduce__()
    return rebuilt(Robot, {**held, "model": pin.Model(robot.model)}, protected)


def robot_of(urdf: LoadedUrdf, source: str) -> Robot:
    """Return the robot of a URDF that is loaded: what walks is that of its layout.

    Feet are where the annotated text has them, as Pinocchio reads it.

    Args:
        urdf: as of `load_urdf` or `loaded_text`.
        source: name of a packaged robot, or absolute path of the file.

    Raises:
        UrdfError: Pinocchio refuses the text, or a foot's sphere is none.
        ParameterError: a foot radius or a standing angle out of range.
    """
    file, layout, options = urdf.file, urdf.layout, urdf.options
    model = build_model(file)
    joints = joints_in_order(file, model)
    legs = _legs(layout)
    links = {**dict.fromkeys(layout.feet), **{leg.foot: leg.name for leg in legs}}
    feet, foot_notes = place_feet(file, model, links, options.foot_radius)
    try:
        own = {**layout.posture, **layout.held}
        angles, posture_notes = standing_angles(joints, own, options.posture)
    except ParameterError as error:  # of the file's own: what is doubtful in it may be why
        if options.posture is not None:
            raise
        raise UrdfError(file.source, [*urdf.doubts, str(error)]) from error
    stated = read_provenance(file)
    robot = Robot(
        name=file.name, source=source, model=model, legs=legs, feet=feet,
        joint_names=tuple(joint.name for joint in joints),
        lower=read_only([joint.limit("lower", 0.0) for joint in joints]),
        upper=read_only([joint.limit("upper", 0.0) for joint in joints]),
        effort_limit=read_only([joint.limit("effort") for joint in joints]),
        velocity_limit=read_only([joint.limit("velocity") for joint in joints]),
        damping=read_only([joint.dynamics("damping") for joint in joints]),
        friction=read_only([joint.dynamics("friction") for joint in joints]),
        total_mass=math.fsum(link.mass or 0.0 for link in file.links),
        posture=angles, provenance=stated.line, assumed=stated.assumed, inferred=stated.inferred,
        repaired=urdf.repaired,
        notes=(*urdf.notes, *foot_notes, *posture_notes, *_further_notes(urdf, feet)),
        options=_given(options),
        urdf=file.text, digest=digest(file.text), held=_held(joints, angles, legs),
        doubts=urdf.doubts, caution=layout.caution,
    )  # fmt: skip
    return robot if urdf.doubts or options.mass is not None else _with_mass_doubts(robot)


def _with_mass_doubts(robot: Robot) -> Robot:
    """Return a robot with the doubt about its mass, where no legs of their length carry such."""
    from hexapod_pin.robot.repair.doubts import mass_doubts

    if not robot.legs:
        return robot
    found = mass_doubts(robot.total_mass, leg_length(robot), sum(len(x.joints) for x in robot.legs))
    return replace(robot, doubts=found) if found else robot


def _legs(layout: RobotLayout) -> tuple[Leg, ...]:
    """Return the legs of a layout: six with the usual names in the usual order."""
    legs = {leg.name: Leg(leg.name, leg.joints, leg.foot) for leg in layout.legs}
    return tuple(legs[name] for name in (LEG_NAMES if set(legs) == {*LEG_NAMES} else legs))


def _given(options: LoadOptions) -> dict[str, Any]:
    """Return the options that differ from the defaults, with folders by their absolute paths."""
    given = options.given()
    if options.package_path:
        given["package_path"] = [absolute(folder) for folder in options.package_path]
    return given


def _held(joints: Sequence[Joint], angles: Array, legs: Sequence[Leg]) -> Mapping[str, float]:
    """Return the standing places of the joints outside the legs; none of a robot without legs."""
    walking = {name for leg in legs for name in leg.joints}
    places = zip((joint.name for joint in joints), angles.tolist(), strict=True)
    return MappingProxyType({name: x for name, x in places if legs and name not in walking})


def _by_name(kind: str, name: str, items: Mapping[str, Value]) -> Value:
    """Return an item by name; UnknownNameError lists the known ones."""
    if name not in items:
        raise UnknownNameError(kind, name, list(items))
    return items[name]


def _further_notes(urdf: LoadedUrdf, feet: Sequence[Foot]) -> list[str]:
    """Return notes on the given direction, and on shapes that do not touch the ground as feet."""
    found = [urdf.layout.caution] if urdf.layout.caution else []
    shaped = {x.name for x in urdf.file.links if x.element.find("collision") is not None}
    unused = shaped - {foot.name for foot in feet}
    if unused:
        shapes = f"collision shapes of {len(unused)} links do not touch the ground"
        found.append(f"{shapes}: only feet do, and the trunk in a scene with body contact")
    return found


# Values computed once for each robot and dropped with it.

Value = TypeVar("Value")


def once_per_robot(build: Callable[[Robot], Value]) -> Callable[[Robot], Value]:
    """Make a function of a robot compute its value once per robot.

    Robots are frozen and compared by identity, and are referred to weakly: the value must not hold
    the robot. An exception is not stored.
    """
    values: WeakKeyDictionary[Robot, Value] = WeakKeyDictionary()

    @wraps(build)
    def value_of(robot: Robot) -> Value:
        if robot not in values:
            values[robot] = build(robot)
        return values[robot]

    return value_of


@once_per_robot
def leg_length(robot: Robot) -> float:
    """Return the length of the longest leg from its first joint to its foot, stretched [m]."""
    model, found = robot.model, 0.0
    for foot in robot.feet:
        chain = [j for j in model.supports[model.getJointId(foot.joint)] if j > 1]
        links = [model.jointPlacements[j].translation for j in chain[1:]] + [foot.offset]
        found = max(found, math.fsum(float(np.linalg.norm(link)) for link in links))
    return found


@once_per_robot
def robot_content(robot: Robot) -> bytes:
    """Return a digest of all that a robot holds, its model included: a key for caches.

    Robots that were loaded from one file have the same.
    """
    return content_digest((robot, robot.model))


# Working memory of Pinocchio for a robot, one per thread: making it costs more than using it.


class _ThreadData(threading.local):
    """The pin.Data of the running thread."""

    data: pin.Data | None = None


@once_per_robot
def _thread_data(robot: Robot) -> _ThreadData:
    return _ThreadData()


def scratch_data(robot: Robot) -> pin.Data:
    """Return a pin.Data of the robot's model; its content lasts until the thread's next use."""
    local = _thread_data(robot)
    if local.data is None:
        local.data = robot.model.createData()
    return local.data
