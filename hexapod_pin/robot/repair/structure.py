"""Links and joints must form one tree with unique names; what prevents it is found and repaired."""

from __future__ import annotations

import itertools
import xml.etree.ElementTree as ET
from bisect import bisect
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

from hexapod_pin.file_schema import is_name
from hexapod_pin.robot.description.urdf_file import Joint, UrdfFile
from hexapod_pin.robot.repair.finding import Draft, Finding
from hexapod_pin.robot.repair.joints import RESERVED_NAMES
from hexapod_pin.robot.repair.rules import MAX_MOVED_JOINTS

LONGEST_SHOWN = 40
"""Characters that a finding shows of a name."""

WORLD = "world"
"""A root link of this name bolts the robot to the ground in MuJoCo, Gazebo and others."""


def structure_findings(file: UrdfFile) -> list[Finding]:
    """Return every trouble of names and of the tree."""
    if not file.links:
        return [Finding.of("no link", "robot", "no <link>")]
    checks = (_text, _odd_names, _names, _ends, _parents, _roots, _loops, _world)
    found = [finding for check in checks for finding in check(file)]
    moved = sum(joint.moves for joint in file.joints)
    if moved > MAX_MOVED_JOINTS:
        found.append(Finding.of("too many joints", "robot", f"{moved} moved joints"))
    return found


def _text(file: UrdfFile) -> Iterator[Finding]:
    for text in file.repairs:
        yield Finding.of("text before XML", "file", text)
    for prefix in unbound_prefixes(file):
        yield Finding.of("unbound prefix", "file", f"prefix {prefix!r}")


def unbound_prefixes(file: UrdfFile) -> list[str]:
    """Return the namespace prefixes that no element declares, sorted."""
    used, bound = set[str](), {"xml", "xmlns"}
    for element in file.root.iter():
        for name in (str(element.tag), *element.attrib):
            prefix, colon, rest = name.partition(":")
            if prefix == "xmlns":
                bound.add(rest)
            elif colon:
                used.add(prefix)
    return sorted(used - bound)


def _odd_names(file: UrdfFile) -> Iterator[Finding]:
    """Names that no trace may hold: results name their robot, joints and feet."""
    for kind, names in (
        ("robot", [file.root.get("name") or ""]),
        ("link", [x.name for x in file.links]),
        ("joint", [x.name for x in file.joints]),
    ):
        for name in dict.fromkeys(names):
            if name and not is_name(name):
                yield Finding.of(
                    "name that cannot be printed",
                    f"{kind} {name[:LONGEST_SHOWN]!r}",
                    f"{len(name)} characters",
                )


def _names(file: UrdfFile) -> Iterator[Finding]:
    for kind, names in (
        ("link", [x.name for x in file.links]),
        ("joint", [x.name for x in file.joints]),
    ):
        for name, count in Counter(names).items():
            if kind == "link" and name == GROUND:
                yield Finding(
                    "reserved name",
                    f"link {name!r}",
                    "this name is reserved for the ground",
                    "another name",
                    "name it otherwise, in its joints too",
                    repairable=False,
                )
            if not name:
                yield Finding(
                    f"{kind} without name",
                    f"{count} <{kind}>",
                    f"a {kind} has no name",
                    "every one needs its own",
                    f"named {kind}_1, {kind}_2, ...",
                )
            elif count > 1:
                yield Finding.of("duplicate name", f"{kind} {name!r}", f"{count} of that name")


def _ends(file: UrdfFile) -> Iterator[Finding]:
    known = set(file.link_by_name)
    for joint in file.joints:
        for end, link in (("parent", joint.parent), ("child", joint.child)):
            if link not in known:
                gone = leads_nowhere(file, joint)
                yield Finding(
                    "unknown link",
                    f"joint {joint.name!r}",
                    f"its {end} link {link!r} does not exist",
                    "both ends must be links of the file",
                    "the joint is dropped" if gone else "name a link of the file",
                    repairable=gone,
                )


def leads_nowhere(file: UrdfFile, joint: Joint) -> bool:
    """Whether a joint can be dropped: without a child, or fixed without a parent."""
    known = file.link_by_name
    return joint.child not in known or (joint.parent not in known and not joint.moves)


def _parents(file: UrdfFile) -> Iterator[Finding]:
    parents: dict[str, list[Joint]] = {}
    for joint in file.joints:
        parents.setdefault(joint.child, []).append(joint)
    reached = {name for root in file.roots for name in tree_of(file, root)}
    for link, joints in parents.items():
        if len(joints) > 1 and link in file.link_by_name:
            names = ", ".join(repr(joint.name) for joint in joints)
            on_tree = all(x.parent in reached or leads_nowhere(file, x) for x in joints)
            repair = "all joints but the first one from the root are dropped"
            yield Finding(
                "two parents",
                f"link {link!r}",
                f"child of {len(joints)} joints ({names})",
                "the links must form a tree",
                repair if on_tree else "remove the joint that closes the loop",
                repairable=on_tree,
            )


def _roots(file: UrdfFile) -> Iterator[Finding]:
    if len(file.roots) > 1:
        moving = [root for root in file.roots if moved_joints(file, tree_of(file, root))]
        many = f"add the joints between {', '.join(map(repr, moving))}, which all carry moved ones"
        yield Finding(
            "several roots",
            f"links {', '.join(map(repr, file.roots))}",
            f"{len(file.roots)} roots",
            "must be one",
            many if len(moving) > 1 else "those without moved joints are dropped",
            repairable=len(moving) < 2,
        )


def tree_of(file: UrdfFile, root: str) -> list[str]:
    """Return the links that a link leads to, itself first."""
    names, seen = [root], {root}
    for name in names:
        for child in (joint.child for joint in file.joints_below.get(name, ())):
            if child not in seen and child in file.link_by_name:
                seen.add(child)
                names.append(child)
    return names


def moved_joints(file: UrdfFile, names: Iterable[str]) -> int:
    """Return how many moved joints lead from links to others."""
    joints = (joint for name in names for joint in file.joints_below.get(name, ()))
    return sum(joint.moves and joint.child in file.link_by_name for joint in joints)


def trunk_root(file: UrdfFile) -> str | None:
    """Return the root of the tree with most moved joints, then most links; None without a root."""
    trees = {root: tree_of(file, root) for root in file.roots}
    return max(trees, key=lambda x: (moved_joints(file, trees[x]), len(trees[x])), default=None)


def trunk_links(file: UrdfFile, root: str) -> list[str]:
    """Return the links that nothing moves relative to a root."""
    found = [root]
    for name in found:
        below = (x for x in file.joints_below.get(name, ()) if not x.moves)
        found += [x.child for x in below if x.child not in found]
    return found


def _loops(file: UrdfFile) -> Iterator[Finding]:
    reached = {name for root in file.roots for name in tree_of(file, root)}
    lost = [name for name in file.link_by_name if name not in reached]
    if lost:
        yield Finding.of("loop", f"links {', '.join(map(repr, lost))}", "on a loop of joints")


def _world(file: UrdfFile) -> Iterator[Finding]:
    joint = _above_trunk(file)
    if joint is not None and not joint.moves:
        value = f"joint {joint.name!r} bolts {joint.child!r} to it"
        yield Finding.of("fixed to the world", f"link {WORLD!r}", value)


def _above_trunk(file: UrdfFile) -> Joint | None:
    """Return the joint below an empty root link that floats, or bolts the robot to the world."""
    if len(file.roots) != 1:
        return None
    link, joints = file.link_by_name[file.base], file.joints_below[file.base]
    bare = link.mass is None and not any(link.element.find(x) is not None for x in SHAPES)
    if not bare or len(joints) != 1:
        return None
    bolted = link.name == WORLD and not joints[0].moves
    return joints[0] if bolted or joints[0].kind in ("floating", "planar") else None


GROUND = "universe"
"""Name of the ground in Pinocchio's models."""

SHAPES = ("visual", "collision")


# Repairs of the tree: joints without links, second parents and roots, what is above the trunk.


def repair_structure(draft: Draft) -> None:
    """Leave one tree: each step starts from what the one before left, until nothing is dropped."""
    before = None
    while before != len(draft.root):
        before = len(draft.root)
        _drop_joints_to_nowhere(draft)
        _drop_second_parents(draft)
        _keep_one_root(draft)
        _drop_above_trunk(draft)


def _drop_joints_to_nowhere(draft: Draft) -> None:
    """Drop joints without a child, and fixed ones without a parent; others carry what matters."""
    file = draft.file
    for joint in file.joints:
        unknown = [x for x in (joint.parent, joint.child) if x not in file.link_by_name]
        if leads_nowhere(file, joint):
            draft.drop([joint.element])
            draft.change(f"joint {joint.name!r}", f"dropped: no link {unknown[0]!r}")


def _drop_second_parents(draft: Draft) -> None:
    file = draft.file
    if not file.roots:
        return
    used, reached = set[str](), set(file.roots)
    for joint in _from_roots(file):
        if joint.child in reached:
            draft.drop([joint.element])
            draft.change(f"joint {joint.name!r}", f"dropped: {joint.child!r} has another parent")
        else:
            reached.add(joint.child)
            used.add(joint.name)


def _from_roots(file: UrdfFile) -> list[Joint]:
    """Return the joints that a root leads to, breadth first, each once."""
    queue, joints, seen = list(file.roots), list[Joint](), set(file.roots)
    for name in queue:
        for joint in file.joints_below.get(name, ()):
            joints.append(joint)
            if joint.child not in seen:
                seen.add(joint.child)
                queue.append(joint.child)
    return joints


def _keep_one_root(draft: Draft) -> None:
    """Drop trees without moved joints beside the one with most, then most links."""
    file = draft.file
    trunk = trunk_root(file)
    trees = [tree_of(file, root) for root in file.roots if root != trunk]
    gone = {name for tree in trees if not moved_joints(file, tree) for name in tree}
    lost = [link for link in file.links if link.name in gone]
    draft.drop(j.element for j in file.joints if j.parent in gone)
    draft.drop(link.element for link in lost)
    for link in lost:
        mass = f", {link.mass:g} kg" if link.mass else ""
        draft.change(f"link {link.name!r}", f"dropped: not part of the robot's tree{mass}")


def _drop_above_trunk(draft: Draft) -> None:
    """Drop empty root links with one joint that floats, or that bolts the robot to the world."""
    while (joint := _above_trunk(draft.file)) is not None:
        draft.drop([draft.file.link_by_name[joint.parent].element, joint.element])
        text = f"dropped with joint {joint.name!r}: {joint.child!r} floats by itself"
        draft.change(f"link {joint.parent!r}", text)


# Repairs of names: every link and joint gets its own, and joints follow their links.

NAMESPACE = "http://www.ros.org/wiki/"
"""Address of a prefix that no element declares."""


def repair_names(draft: Draft) -> None:
    """Declare prefixes, name what has no name, and make names unique."""
    for text in draft.repairs:
        draft.change("file", f"{text} dropped")
    for prefix in unbound_prefixes(draft.file):
        draft.root.set(f"xmlns:{prefix}", NAMESPACE + prefix)
        draft.change("file", f"prefix {prefix!r} declared")
    for kind in ("link", "joint"):
        _name_the_unnamed(draft, kind)
    repeated = Counter(link.name for link in draft.file.links)
    for name in [name for name, count in repeated.items() if count > 1]:
        _separate_links(draft, name)
    _separate_joints(draft)


def _name_the_unnamed(draft: Draft, kind: str) -> None:
    names = _free_names(draft, kind, kind, 1)
    for element in draft.root.findall(kind):
        if not element.get("name"):
            element.set("name", next(names))
            draft.change(f"{kind} {element.get('name')!r}", "had no name")


def _free_names(draft: Draft, kind: str, stem: str, first: int) -> Iterator[str]:
    """Yield `stem`_k with the numbers from `first` that no link or joint has."""
    taken = {element.get("name") for element in draft.root.findall(kind)}
    return (name for k in itertools.count(first) if (name := f"{stem}_{k}") not in taken)


def _separate_joints(draft: Draft) -> None:
    seen: set[str] = set()
    names: dict[str, Iterator[str]] = {}
    for element in draft.root.findall("joint"):
        name = element.get("name") or ""
        if name in seen or name in RESERVED_NAMES:
            if name not in names:
                names[name] = _free_names(draft, "joint", name, 2)
            new = next(names[name])
            element.set("name", new)
            draft.change(f"joint {name!r}", f"renamed to {new!r}: the name was taken")
        seen.add(element.get("name") or "")


def _separate_links(draft: Draft, name: str) -> None:
    """Drop identical copies of a link, number the others, and let joints follow."""
    links = [x for x in draft.root.findall("link") if x.get("name") == name]
    joints = draft.root.findall("joint")
    children = [j for j in joints if _end(j, "child").get("link") == name]
    parents = [j for j in joints if _end(j, "parent").get("link") == name]
    copies = [x for x in links[1:] if _same(x, links[0])] if len(children) <= 1 else []
    if copies:
        draft.drop(copies)
        draft.change(f"link {name!r}", f"{len(copies)} identical copies dropped")
    links = [link for link in links if link not in copies]
    owners = _owners(draft, links, parents)
    names, free = [name], _free_names(draft, "link", name, 2)
    for link in links[1:]:
        names.append(next(free))
        link.set("name", names[-1])
        draft.change(f"link {name!r}", f"another link of that name renamed to {names[-1]!r}")
    shift = 1 if len(children) == len(links) - 1 and _is_only_root(draft, name) else 0
    for k, joint in enumerate(children):
        _end(joint, "child").set("link", names[min(k + shift, len(names) - 1)])
    for joint, k in zip(parents, owners, strict=True):
        _end(joint, "parent").set("link", names[k])


def _owners(draft: Draft, links: Sequence[ET.Element], joints: Sequence[ET.Element]) -> list[int]:
    """Return which of the links is meant by each joint that has one of them as its parent.

    The last one before the joint, where the file mixes links and joints; else in equal shares.
    """
    order = {element: k for k, element in enumerate(draft.root)}
    every = draft.root.findall("joint")
    if any(order[links[0]] < order[joint] < order[links[-1]] for joint in every):
        places = [order[link] for link in links]
        return [max(bisect(places, order[joint]) - 1, 0) for joint in joints]
    share = max(len(joints) // len(links), 1)
    return [min(k // share, len(links) - 1) for k in range(len(joints))]


def _is_only_root(draft: Draft, name: str) -> bool:
    ends = {_end(joint, "child").get("link") for joint in draft.root.findall("joint")}
    others = {link.get("name") for link in draft.root.findall("link")} - {name}
    return others <= ends


def _end(joint: ET.Element, tag: str) -> ET.Element:
    """Return <parent> or <child> of a joint; an element apart where it has none."""
    found = joint.find(tag)
    return ET.Element(tag) if found is None else found


def _same(one: ET.Element, other: ET.Element) -> bool:
    texts = [ET.canonicalize(ET.tostring(x, "unicode"), strip_text=True) for x in (one, other)]
    return texts[0] == texts[1]
