"""A URDF is read into plain links and joints before any library parses it.

Files of other formats are recognised and refused with a remedy.
"""

from __future__ import annotations

import itertools
import math
import re
import xml.etree.ElementTree as ET
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path
from xml.parsers import expat

from hexapod_pin import user_file
from hexapod_pin.errors import UrdfError

MAX_BYTES = 50_000_000
"""Largest file that is read [bytes]."""

LARGEST = 1e15
"""Masses, moments and factors beyond count as no number [SI units]."""

LARGEST_LENGTH = 1e6
"""Places and sizes beyond count as no number [m]: there double precision resolves 0.1 nm."""

LARGEST_RADIUS = 100.0
"""Largest radius of a foot [m]."""

MAX_DEPTH = 100
"""Deepest nesting of elements that is read; URDFs have about six."""

MAX_LINKS = 2000
"""Most links, and most joints, of a file that is read."""

MOVED = ("revolute", "continuous", "prismatic", "planar", "floating")
JOINT_TYPES = (*MOVED, "fixed")
TURNING = ("revolute", "continuous")
"""Kinds of joints that legs walk with."""


@dataclass(frozen=True)
class Sphere:
    """A collision sphere: radius [m] and centre in the link's frame [m]."""

    radius: float
    centre: tuple[float, ...]


POINT = Sphere(0.0, (0.0, 0.0, 0.0))
"""The foot of a link that has no collision sphere."""

KEPT_TRIPLES = 4096
"""How many texts of three numbers are cached: a check reads each some twenty times."""


@dataclass(frozen=True)
class Link:
    """A <link> as it was when it was read; numbers that cannot be read are NaN.

    Its element keeps the rest. A repair that changes the element takes a new `UrdfFile` after it.
    """

    name: str
    element: ET.Element = field(repr=False, compare=False)

    @cached_property
    def mass(self) -> float | None:
        """Mass [kg]; None without an <inertial>."""
        if self.element.find("inertial") is None:
            return None
        return quantity(self.element.find("inertial/mass"), "value")

    @cached_property
    def com(self) -> tuple[float, ...]:
        """Centre of mass in the link's frame [m]."""
        return origin(self.element.find("inertial"))[0]

    @cached_property
    def inertia_rpy(self) -> tuple[float, ...]:
        """Roll, pitch, yaw from the link's axes to the inertia's axes [rad]."""
        return origin(self.element.find("inertial"))[1]

    @cached_property
    def moments(self) -> tuple[float, ...]:
        """(ixx, iyy, izz, ixy, ixz, iyz) about the centre of mass [kg m^2]."""
        names = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
        inertia = self.element.find("inertial/inertia")
        return tuple(quantity(inertia, name) for name in names)

    @cached_property
    def collision_sphere(self) -> Sphere | None:
        """The first collision sphere."""
        for collision in self.element.findall("collision"):
            sphere = collision.find("geometry/sphere")
            if sphere is not None:
                return Sphere(length(sphere, "radius"), origin(collision)[0])
        return None


@dataclass(frozen=True)
class Joint:
    """A <joint>; numbers that cannot be read are NaN. Its element keeps the rest."""

    name: str
    kind: str
    parent: str
    child: str
    element: ET.Element = field(repr=False, compare=False)

    @property
    def moves(self) -> bool:
        """Whether the joint lets its child move."""
        return self.kind in MOVED

    @property
    def xyz(self) -> tuple[float, ...]:
        """Origin of the child's frame in the parent's frame [m]."""
        return origin(self.element)[0]

    @property
    def rpy(self) -> tuple[float, ...]:
        """Roll, pitch, yaw of the child's frame in the parent's [rad]."""
        return origin(self.element)[1]

    @property
    def axis(self) -> tuple[float, ...]:
        """Axis as written; (1, 0, 0) where the file gives none."""
        element = self.element.find("axis")
        return (1.0, 0.0, 0.0) if element is None else triple(element.get("xyz"))

    def limit(self, name: str, default: float = math.nan) -> float:
        """Return lower, upper [rad], effort [N m] or velocity [rad/s] of <limit>."""
        return attribute(self.element.find("limit"), name, default)

    def dynamics(self, name: str) -> float:
        """Return damping [N m s/rad] or friction [N m] of <dynamics>; 0 where not given."""
        return attribute(self.element.find("dynamics"), name, 0.0)


@dataclass(frozen=True)
class UrdfFile:
    """The text of a URDF, its XML tree, and what was dropped to read it."""

    source: str
    text: str
    root: ET.Element = field(repr=False)
    repairs: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Name of the robot."""
        return self.root.get("name") or "unnamed"

    @cached_property
    def links(self) -> tuple[Link, ...]:
        """All links in file order."""
        return tuple(Link(e.get("name") or "", e) for e in self.root.findall("link"))

    @cached_property
    def joints(self) -> tuple[Joint, ...]:
        """All joints in file order."""
        return tuple(_joint(element) for element in self.root.findall("joint"))

    @cached_property
    def link_by_name(self) -> dict[str, Link]:
        """Links by name."""
        return {link.name: link for link in self.links}

    @cached_property
    def joints_below(self) -> dict[str, tuple[Joint, ...]]:
        """Joints whose parent is this link, for every link."""
        below: dict[str, list[Joint]] = {link.name: [] for link in self.links}
        for joint in self.joints:
            below.setdefault(joint.parent, []).append(joint)
        return {name: tuple(joints) for name, joints in below.items()}

    @cached_property
    def roots(self) -> tuple[str, ...]:
        """Links that are no joint's child; one in a sound file."""
        children = {joint.child for joint in self.joints}
        return tuple(dict.fromkeys(x.name for x in self.links if x.name not in children))

    @property
    def base(self) -> str:
        """The root link: the first one that is no joint's child."""
        return self.roots[0]

    def foot_sphere(self, link: str) -> Sphere | None:
        """Return the sphere with which a link touches the ground; None for a point at its frame.

        Raises:
            UrdfError: the numbers of the link's first collision sphere are impossible.
        """
        sphere = self.link_by_name[link].collision_sphere
        if sphere is None or (
            all(map(math.isfinite, (sphere.radius, *sphere.centre))) and sphere.radius >= 0
        ):
            return sphere
        text = f"link {link!r}: collision sphere of radius {sphere.radius:g} m at {sphere.centre}"
        allowed = f"must be numbers up to {LARGEST_LENGTH:g} m, the radius not negative"
        raise UrdfError(self.source, [f"{text}; {allowed}"])

    def rigid_group(self, link: str) -> list[str]:
        """Return `link` and every link fixed to it, directly or through other fixed joints."""
        return list(self._rigid_links(link))

    def moved_joints_below(self, link: str) -> list[Joint]:
        """Return the joints that move something relative to the rigid group of `link`."""
        return list(self._moved_joints(link))

    def branches_at(self, link: str) -> bool:
        """Whether more than one joint moves something relative to the rigid group of `link`."""
        return len(list(itertools.islice(self._moved_joints(link), 2))) > 1

    def _moved_joints(self, link: str) -> Iterator[Joint]:
        for name in self._rigid_links(link):
            yield from (joint for joint in self.joints_below[name] if joint.moves)

    def _rigid_links(self, link: str) -> Iterator[str]:
        """Yield the links of a rigid group, nearest first, each once."""
        queue, seen = deque([link]), {link}
        while queue:
            name = queue.popleft()
            yield name
            for joint in self.joints_below[name]:
                child = joint.child
                if not joint.moves and child not in seen and child in self.link_by_name:
                    seen.add(child)
                    queue.append(child)


def read_urdf(path: str | Path, *, max_bytes: int = MAX_BYTES) -> UrdfFile:
    """Read a URDF from disk; `check_urdf` then judges its content.

    Raises:
        UrdfError: the file is missing, too large, not UTF-8, not XML (with line and column), has
            a document type declaration, or is not a <robot>.
    """
    return parse_urdf(read_bytes(path, max_bytes=max_bytes), str(path), max_bytes=max_bytes)


def read_bytes(path: str | Path, *, max_bytes: int = MAX_BYTES) -> bytes:
    """Return what a file holds.

    Raises:
        UrdfError: the file is missing, no regular file, too large, or cannot be read.
    """
    try:
        return user_file.read_bytes(path, max_bytes)
    except (OSError, ValueError) as error:
        found = f"cannot be read: {user_file.reason_of(error)}; give the path of a URDF"
        raise UrdfError(str(path), [found]) from error


def parse_urdf(data: bytes, source: str, *, max_bytes: int = MAX_BYTES) -> UrdfFile:
    """Parse the bytes of a URDF; raises as `read_urdf`.

    Text before the XML declaration is dropped, which `UrdfFile.repairs` reports.
    """
    text, repairs = _decoded(data, source, max_bytes)
    root = parse_tree(text, source)
    if root.tag != "robot":
        finding = f"the outermost element is <{root.tag}>: must be <robot>"
        raise UrdfError(source, [finding + advice_on(root)])
    for kind in ("link", "joint"):
        if (count := len(root.findall(kind))) > MAX_LINKS:
            raise UrdfError(source, [f"{count} {kind}s: at most {MAX_LINKS} are read; leave out "
                                     "what no leg needs"])  # fmt: skip
    return UrdfFile(source, text, root, repairs)


def checked_text(data: bytes, source: str, max_bytes: int = MAX_BYTES) -> str:
    """Return bytes as text that is XML without a document type; raises as `read_urdf`."""
    text, _ = _decoded(data, source, max_bytes)
    parse_tree(text, source)
    return text


def _decoded(data: bytes, source: str, max_bytes: int) -> tuple[str, tuple[str, ...]]:
    """Return bytes as text from its XML declaration on, and what was dropped before it."""
    if len(data) > max_bytes:
        raise UrdfError(source, [f"more than {max_bytes} bytes: too large for a URDF"])
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise UrdfError(source, [f"not UTF-8 text (byte {error.start})"]) from error
    return _from_declaration(text)


def _from_declaration(text: str) -> tuple[str, tuple[str, ...]]:
    """Drop blanks and comments before the XML declaration."""
    before = re.match(r"(?:\s|<!--(?:(?!-->).)*-->)+(?=<\?xml\s)", text, re.S)
    if before is None:
        return text, ()
    return text[before.end() :], (f"{before.end()} characters before the XML declaration",)


def parse_tree(text: str, source: str, *, comments: bool = False) -> ET.Element:
    """Return the tree of an XML text; names keep their prefixes, bound to a namespace or not.

    Args:
        text: of the file.
        source: its path, for errors.
        comments: whether to include them, for writing the tree again.

    Raises:
        UrdfError: not XML, nested too deeply, or with a document type declaration.
    """

    def refuse(*_: object) -> None:
        raise UrdfError(source, [no_xml(text) or "has a <!DOCTYPE ...>, which is not read"])

    depth = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > MAX_DEPTH:
            raise UrdfError(source, [f"elements nested deeper than {MAX_DEPTH}: no URDF"])
        builder.start(tag, attributes)

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)

    builder, parser = ET.TreeBuilder(insert_comments=comments), expat.ParserCreate("utf-8")
    parser.StartDoctypeDeclHandler = refuse
    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler = builder.data
    parser.CommentHandler = lambda text: builder.comment(text) if comments and depth else None
    try:
        parser.Parse(text.encode(), True)
    except expat.ExpatError as error:
        where = f"{expat.ErrorString(error.code)} (line {error.lineno}, column {error.offset})"
        raise UrdfError(source, [no_xml(text) or f"not XML: {where}"]) from error
    return builder.close()


def attribute(element: ET.Element | None, name: str, default: float) -> float:
    """Return a numeric attribute; `default` where it is absent, NaN where it is no number."""
    text = None if element is None else element.get(name)
    if text is None:
        return default
    try:
        return _number(text)
    except ValueError:
        return math.nan


@lru_cache(maxsize=KEPT_TRIPLES)
def triple(text: str | None, largest: float = LARGEST) -> tuple[float, ...]:
    """Return three numbers from text such as "0 0 1"; zeros without text, else NaN."""
    if text is None:
        return (0.0, 0.0, 0.0)
    try:
        values = tuple(_bounded(_number(part), largest) for part in text.split())
    except ValueError:
        values = ()
    return values if len(values) == 3 else (math.nan,) * 3


def lengths(text: str | None) -> tuple[float, ...]:
    """Return three places or sizes [m], as `triple`; NaN beyond `LARGEST_LENGTH`."""
    return triple(text, LARGEST_LENGTH)


def mesh_scale(element: ET.Element) -> tuple[float, ...]:
    """Return the factors along the axes of a <mesh>; 1 without any, NaN for what is no number."""
    return triple(element.get("scale") or "1 1 1")


def quantity(element: ET.Element | None, name: str) -> float:
    """Return a mass or moment; NaN where it is absent, no number or beyond all measure."""
    return _bounded(attribute(element, name, math.nan), LARGEST)


def length(element: ET.Element | None, name: str) -> float:
    """Return a size [m]; NaN where it is absent, no number or beyond `LARGEST_LENGTH`."""
    return _bounded(attribute(element, name, math.nan), LARGEST_LENGTH)


def _number(text: str) -> float:
    """Return a number as parsers of URDFs read it: not 1_000, and no other digits than ASCII's."""
    if "_" in text or not text.isascii():
        raise ValueError(text)
    return float(text)


def _bounded(value: float, largest: float) -> float:
    """Return NaN for what would overflow in products of a few."""
    return value if abs(value) <= largest else math.nan


def origin(element: ET.Element | None) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return xyz [m] and rpy [rad] of an element's <origin>; zeros where it has none."""
    found = None if element is None else element.find("origin")
    if found is None:
        return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    return lengths(found.get("xyz")), triple(found.get("rpy"))


def _joint(element: ET.Element) -> Joint:
    """Read a <joint>."""
    ends = [element.find(tag) for tag in ("parent", "child")]
    parent, child = ("" if end is None else end.get("link") or "" for end in ends)
    return Joint(element.get("name") or "", element.get("type") or "", parent, child, element)


# What a file is that is no URDF, and how to make one of it.


def no_xml(text: str) -> str:
    """Return what a text is that is no XML, by how it begins; empty if unknown."""
    begin = text[:99].lstrip().lower()
    if begin.startswith("<!doctype html"):
        return "this is an HTML page: download the raw file"
    pointer = begin.startswith("version https://git-lfs")
    return "this is a pointer of Git LFS: run `git lfs pull`" if pointer else ""


_ADVICE = {
    "sdf": "an SDF (Gazebo) file: convert it with pysdf, or take the "
    "URDF or xacro file that it was made from",
    "mujoco": "an MJCF (MuJoCo) file, which is read where it is no xacro: name it .xml",
    "mujocoinclude": "a part of an MJCF (MuJoCo) file: a URDF is needed",
    "launch": "a launch file: give the URDF or xacro file that it loads (see its "
    "robot_description), its arguments by xacro_args=[...]",
    "package": "a package's manifest: give the URDF or xacro file, often in its folder urdf",
    "COLLADA": "a mesh: give the URDF that names it",
    "model": "a model of OpenSim or part of an SDF file: convert it to URDF",
    "openrave": "an OpenRAVE file: convert it to URDF",
}


def advice_on(root: ET.Element) -> str:
    """Return what a file with another outermost element is and what to do; empty if unknown."""
    tag = root.tag.rpartition("}")[2]
    robots = root.findall(".//robot")
    if tag in _ADVICE:
        return f" (this is {_ADVICE[tag]})"
    if len(robots) > 1:
        names = ", ".join(repr(robot.get("name", "")) for robot in robots[:5])
        return f" (it holds {len(robots)} robots, {names}: put one in a file of its own)"
    return " (put the <robot> in it in a file of its own)" if robots else ""
