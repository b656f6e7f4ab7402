"""URDFs with faults drawn by a seed: what an edit by hand, `sed` or a bad exporter does to one."""

from __future__ import annotations

import copy
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

KINDS = ("revolute", "continuous", "prismatic", "planar", "floating", "fixed")
NO_KINDS = ("hinge", "", "Revolute ", "spherical")
ODD = (
    "0", "-1", "nan", "inf", "-inf", "", "x", "1e300", "-1e300", "1e-300", "1e12", "1e-12", "1e5",
    "0 0", "0 0 0", "1 2 3 4", "nan 0 0", "1e9 0 0",
)  # fmt: skip
FACTORS = (1e3, 1e-3, 1e6, 1e-6, -1.0, 0.0, 1e9, 100.0, 0.01)
NAMES = ("", "world", "universe", "root_joint", "base_link", "foot", "trunk_axes", "ß \u00e9")
TAGS = (
    "limit", "inertial", "axis", "origin", "visual", "collision", "mass", "inertia", "parent",
    "child", "geometry", "hexapod_pin", "mimic", "dynamics",
)  # fmt: skip
Mutation = Callable[[np.random.Generator, ET.Element], None]


def mutated(text: str, seed: int) -> str:
    """Return a URDF after one to three mutations that a seed draws."""
    rng = np.random.default_rng(seed)
    root = ET.fromstring(text)
    for _ in range(int(rng.integers(1, 4))):
        MUTATIONS[int(rng.integers(len(MUTATIONS)))](rng, root)
    return ET.tostring(root, encoding="unicode")


def _one(rng: np.random.Generator, items: Iterable[ET.Element]) -> ET.Element | None:
    found = list(items)
    return found[int(rng.integers(len(found)))] if found else None


def _pick(rng: np.random.Generator, texts: tuple[str, ...]) -> str:
    return texts[int(rng.integers(len(texts)))]


def _share(rng: np.random.Generator, items: list[ET.Element]) -> list[ET.Element]:
    """Return one, some or all of the elements."""
    share = (0.0, 0.3, 1.1)[int(rng.integers(3))]
    chosen = [item for item in items if rng.random() < share]
    return chosen or [items[int(rng.integers(len(items)))]] if items else []


def joint_types(rng: np.random.Generator, root: ET.Element) -> None:
    """`sed s/revolute/prismatic/`, of one, some or all joints."""
    before, after = _pick(rng, KINDS[:1] + KINDS), _pick(rng, KINDS + NO_KINDS)
    for joint in _share(rng, [x for x in root.findall("joint") if x.get("type") == before]):
        joint.set("type", after)


def odd_attributes(rng: np.random.Generator, root: ET.Element) -> None:
    """An attribute is no number, or an absurd one."""
    element = _one(rng, (x for x in root.iter() if x.attrib))
    if element is not None:
        name, value = _pick(rng, tuple(element.attrib)), _pick(rng, ODD)
        for other in _share(rng, [x for x in root.iter(element.tag) if name in x.attrib]):
            other.set(name, value)


def scaled_attributes(rng: np.random.Generator, root: ET.Element) -> None:
    """Numbers are in another unit, negative or zero."""
    element = _one(rng, (x for x in root.iter() if x.tag not in ("robot", "link", "joint")))
    if element is None or not element.attrib:
        return
    name, factor = _pick(rng, tuple(element.attrib)), FACTORS[int(rng.integers(len(FACTORS)))]
    for other in _share(rng, [x for x in root.iter(element.tag) if name in x.attrib]):
        try:
            numbers = [factor * float(text) for text in (other.get(name) or "").split()]
        except ValueError:
            continue
        other.set(name, " ".join(f"{number:.9g}" for number in numbers))


def lost_attributes(rng: np.random.Generator, root: ET.Element) -> None:
    """An attribute is missing."""
    element = _one(rng, (x for x in root.iter() if x.attrib))
    if element is not None:
        name = _pick(rng, tuple(element.attrib))
        for other in _share(rng, [x for x in root.iter(element.tag) if name in x.attrib]):
            del other.attrib[name]


def lost_elements(rng: np.random.Generator, root: ET.Element) -> None:
    """Elements of one kind are missing in one, some or all places."""
    tag = _pick(rng, TAGS)
    places = [(owner, x) for owner in root.iter() for x in owner.findall(tag)]
    chosen = {id(x) for x in _share(rng, [x for _, x in places])}
    for owner, element in places:
        if id(element) in chosen:
            owner.remove(element)


def lost_parts(rng: np.random.Generator, root: ET.Element) -> None:
    """Links or joints are missing."""
    for element in _share(rng, root.findall(_pick(rng, ("link", "joint"))))[:9]:
        root.remove(element)


def repeated_parts(rng: np.random.Generator, root: ET.Element) -> None:
    """A link, a joint or one of their elements stands there twice."""
    owner = _one(rng, (x for x in root.iter() if len(x)))
    element = None if owner is None else _one(rng, owner)
    if owner is not None and element is not None:
        owner.insert(int(rng.integers(len(owner) + 1)), copy.deepcopy(element))


def other_names(rng: np.random.Generator, root: ET.Element) -> None:
    """A part gets a reserved name, none, or that of another one; its joints follow or do not."""
    kind = _pick(rng, ("link", "joint"))
    element, other = _one(rng, root.findall(kind)), _one(rng, root.findall(kind))
    if element is None or other is None:
        return
    name = other.get("name") or "" if rng.random() < 0.5 else _pick(rng, NAMES)
    before = element.get("name")
    element.set("name", name)
    if kind == "link" and rng.random() < 0.6:
        for end in (*root.iter("parent"), *root.iter("child")):
            if end.get("link") == before:
                end.set("link", name)


def replaced_parts(rng: np.random.Generator, root: ET.Element) -> None:
    """`sed s/lf_/lm_/` in every name."""
    names = [x.get("name") or "" for x in (*root.findall("link"), *root.findall("joint"))]
    parts = tuple(sorted({part for name in names for part in name.split("_") if part})) or ("x",)
    before, after = _pick(rng, parts), _pick(rng, (*parts, "", "x"))
    for element in root.iter():
        for name, value in element.attrib.items():
            if name in ("name", "link", "joint", "joints", "foot"):
                element.set(name, value.replace(before, after))


def other_ends(rng: np.random.Generator, root: ET.Element) -> None:
    """A joint hangs on another link, on none, or with its ends swapped."""
    joint, link = _one(rng, root.findall("joint")), _one(rng, root.findall("link"))
    if joint is None or link is None:
        return
    parent, child = joint.find("parent"), joint.find("child")
    if parent is None or child is None:
        return
    if rng.random() < 0.3:
        parent.tag, child.tag = "child", "parent"
        return
    end = parent if rng.random() < 0.5 else child
    end.set("link", _pick(rng, (link.get("name") or "", link.get("name") or "", "nowhere")))


def other_limits(rng: np.random.Generator, root: ET.Element) -> None:
    """Limits are reversed, equal, or those of another motor."""
    for limit in _share(rng, list(root.iter("limit"))):
        lower, upper = limit.get("lower", "0"), limit.get("upper", "0")
        kind = int(rng.integers(4))
        if kind == 0:
            limit.attrib.update(lower=upper, upper=lower)
        elif kind == 1:
            limit.attrib.update(lower=lower, upper=lower)
        elif kind == 2:
            limit.attrib.update(lower="-10", upper="10")
        else:
            limit.attrib.update(effort=_pick(rng, ODD), velocity=_pick(rng, ODD))


def coupled(rng: np.random.Generator, root: ET.Element) -> None:
    """A joint is coupled, damped or rubbed."""
    for joint in _share(rng, root.findall("joint")):
        name = _pick(rng, ("mimic", "dynamics"))
        ET.SubElement(joint, name, joint="x", damping=_pick(rng, ODD), friction=_pick(rng, ODD))


def other_order(rng: np.random.Generator, root: ET.Element) -> None:
    """Links and joints stand in another order."""
    parts = list(root)
    for part in parts:
        root.remove(part)
    for k in rng.permutation(len(parts)):
        root.append(parts[int(k)])


def further_root(rng: np.random.Generator, root: ET.Element) -> None:
    """A link stands above the trunk, or beside it."""
    base = _one(rng, root.findall("link"))
    name = _pick(rng, ("world", "odom", "top"))
    root.insert(0, ET.Element("link", name=name))
    if base is not None and rng.random() < 0.8:
        joint = ET.SubElement(root, "joint", name="top_joint", type=_pick(rng, KINDS))
        ET.SubElement(joint, "parent", link=name)
        ET.SubElement(joint, "child", link=base.get("name") or "")


MUTATIONS: tuple[Mutation, ...] = (
    joint_types, odd_attributes, scaled_attributes, lost_attributes, lost_elements, lost_parts,
    repeated_parts, other_names, replaced_parts, other_ends, other_limits, coupled, other_order,
    further_root,
)  # fmt: skip


def texts_of(folder: Path) -> dict[str, str]:
    """Return the URDFs of a folder by name."""
    return {path.name: path.read_text(encoding="utf-8-sig") for path in folder.glob("*.urdf")}
