"""Mends of names: every link and joint gets its own, and joints follow their links."""

from __future__ import annotations

import itertools
import xml.etree.ElementTree as ET
from bisect import bisect
from collections import Counter
from collections.abc import Iterator, Sequence

from hexapod_pin.robot.mending.draft import Draft
from hexapod_pin.robot.mending.joint_findings import KEPT_NAMES
from hexapod_pin.robot.mending.structure_findings import unbound_prefixes

NAMESPACE = "http://www.ros.org/wiki/"
"""Address of a prefix that no element declares."""


def mend_names(draft: Draft) -> None:
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
        if name in seen or name in KEPT_NAMES:
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
