"""Mends of the tree: joints without links, second parents and roots, what is above the trunk."""

from __future__ import annotations

from hexapod_pin.robot.description.urdf_file import Joint, UrdfFile
from hexapod_pin.robot.mending.draft import Draft
from hexapod_pin.robot.mending.structure_findings import (
    SHAPES,
    WORLD,
    leads_nowhere,
    moved_joints,
    tree_of,
    trunk_root,
)


def mend_structure(draft: Draft) -> None:
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
    kept = trunk_root(file)
    trees = [tree_of(file, root) for root in file.roots if root != kept]
    gone = {name for tree in trees if not moved_joints(file, tree) for name in tree}
    lost = [link for link in file.links if link.name in gone]
    draft.drop(j.element for j in file.joints if j.parent in gone)
    draft.drop(link.element for link in lost)
    for link in lost:
        mass = f", {link.mass:g} kg" if link.mass else ""
        draft.change(f"link {link.name!r}", f"dropped: not part of the robot's tree{mass}")


def _drop_above_trunk(draft: Draft) -> None:
    """Drop empty root links with one joint that floats, or that bolts the robot to the world."""
    while True:
        file = draft.file
        if len(file.roots) != 1:
            return
        link, joints = file.link_by_name[file.base], file.joints_below[file.base]
        bare = link.mass is None and not any(link.element.find(x) is not None for x in SHAPES)
        free = len(joints) == 1 and joints[0].kind in ("floating", "planar")
        bolted = len(joints) == 1 and link.name == WORLD and not joints[0].moves
        if not (bare and (free or bolted)):
            return
        draft.drop([link.element, joints[0].element])
        text = f"dropped with joint {joints[0].name!r}: {joints[0].child!r} floats by itself"
        draft.change(f"link {link.name!r}", text)
