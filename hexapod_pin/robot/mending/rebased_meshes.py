"""Mesh references that stay valid when a URDF is written into another folder."""

from __future__ import annotations

import os
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path

from hexapod_pin.robot.description.urdf_file import UrdfFile, parse_tree, parse_urdf
from hexapod_pin.robot.reading.resources import ResourceFinder

WITH_FILES = ("mesh", "texture")
"""Elements that name a file."""


def rebased(
    file: UrdfFile, finder: ResourceFinder, out: Path, package_path: Sequence[str | Path] = ()
) -> tuple[UrdfFile, tuple[str, ...]]:
    """Return the file as it must read at `out`, and a sentence on each reference that changed.

    A reference that means the same file from there stays; else it becomes a path relative to the
    folder of `out`. One that means no file stays.
    """
    there = ResourceFinder(out, package_path)
    root, changed = parse_tree(file.text, file.source, comments=True), dict[str, str]()
    for tag in WITH_FILES:
        for element in root.iter(tag):
            uri = element.get("filename") or ""
            found = finder.find(uri) if uri else None
            if found is not None and there.find(uri) != found:
                changed[uri] = Path(os.path.relpath(found, out.parent)).as_posix()
                element.set("filename", changed[uri])
    if not changed:
        return file, ()
    text = '<?xml version="1.0"?>\n' + ET.tostring(root, encoding="unicode") + "\n"
    sentences = tuple(f"mesh {old!r} -> {new!r}" for old, new in changed.items())
    return parse_urdf(text.encode(), file.source), sentences
