"""What keeps links and joints from being one tree with unique names."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator

from hexapod_pin.robot.description.urdf_file import Joint, UrdfFile
from hexapod_pin.robot.mending.finding import Finding

MAX_MOVED_JOINTS = 300
"""Larger models are refused: the mass matrix and its workspace grow with the square."""

WORLD = "world"
"""A root link of this name bolts the robot to the ground in MuJoCo, Gazebo and others."""


def structure_findings(file: UrdfFile) -> list[Finding]:
    """Return every trouble of names and of the tree."""
    if not file.links:
        rule = "a robot needs at least one"
        way_out = "give the whole file"
        return [Finding("no link", "robot", "no <link>", rule, way_out, repairable=False)]
    found = [*_text(file), *_names(file), *_ends(file), *_parents(file), *_roots(file)]
    found += [*_loops(file), *_world(file)]
    moved = sum(joint.moves for joint in file.joints)
    if moved > MAX_MOVED_JOINTS:
        rule = f"at most {MAX_MOVED_JOINTS} are simulated"
        found.append(
            Finding(
                "too many joints",
                "robot",
                f"{moved} moved joints",
                rule,
                "make joints that do not matter fixed",
                repairable=False,
            )
        )
    return found


def _text(file: UrdfFile) -> Iterator[Finding]:
    for text in file.repairs:
        rule = "an XML declaration stands first; other parsers refuse this"
        yield Finding("text before XML", "file", text, rule, "dropped", "suspicious")

    for prefix in unbound_prefixes(file):
        rule = "prefixes are declared by xmlns; other parsers refuse this"
        yield Finding(
            "unbound prefix", "file", f"prefix {prefix!r}", rule, "declared", "suspicious"
        )


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
                    "this name is kept for the ground",
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
                yield Finding(
                    "duplicate name",
                    f"{kind} {name!r}",
                    f"{count} of that name",
                    "names must be unique",
                    "identical copies dropped, others numbered, joints follow",
                )


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
            kept = "the first joint from the root is kept, the others are dropped"
            yield Finding(
                "two parents",
                f"link {link!r}",
                f"child of {len(joints)} joints ({names})",
                "the links must form a tree",
                kept if on_tree else "remove the joint that closes the loop",
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


def _loops(file: UrdfFile) -> Iterator[Finding]:
    reached, queue = set(file.roots), list(file.roots)
    for name in queue:
        for joint in file.joints_below.get(name, ()):
            if joint.child in file.link_by_name and joint.child not in reached:
                reached.add(joint.child)
                queue.append(joint.child)
    lost = [name for name in file.link_by_name if name not in reached]
    if lost:
        yield Finding(
            "loop",
            f"links {', '.join(map(repr, lost))}",
            "on a loop of joints",
            "the links must form a tree",
            "remove the joint that closes the loop",
            repairable=False,
        )


def _world(file: UrdfFile) -> Iterator[Finding]:
    if len(file.roots) != 1 or file.base != WORLD:
        return
    link, joints = file.link_by_name[WORLD], file.joints_below[WORLD]
    bare = link.mass is None and not any(link.element.find(x) is not None for x in SHAPES)
    if bare and len(joints) == 1 and not joints[0].moves:
        yield Finding(
            "fixed to the world",
            f"link {WORLD!r}",
            f"joint {joints[0].name!r} bolts {joints[0].child!r} to it",
            "a walking robot's trunk is free: here it floats, elsewhere it does not",
            "link and joint are dropped",
            "suspicious",
        )


GROUND = "universe"
"""Name of the ground in Pinocchio's models."""

SHAPES = ("visual", "collision")
