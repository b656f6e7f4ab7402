"""Faults of meshes, shapes, colours and materials are found and repaired."""

from __future__ import annotations

import math
import os
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

from hexapod_pin.robot.description.urdf_file import (
    Link,
    UrdfFile,
    length,
    lengths,
    origin,
    parse_tree,
    parse_urdf,
    triple,
)
from hexapod_pin.robot.reading.resources import ResourceFinder
from hexapod_pin.robot.repair.finding import Draft, Finding
from hexapod_pin.robot.repair.measures import Measures

GEOMETRIES = ("box", "cylinder", "sphere", "mesh", "capsule")

CHANNELS = 4
"""Red, green, blue, opacity."""


def appearance_findings(measures: Measures) -> list[Finding]:
    """Return every trouble of meshes, shapes, colours and materials."""
    file = measures.file
    shapes = [x for link in file.links for x in _of_link(measures, link)]
    return [*shapes, *_materials(file), *_colours(file)]


def bad_scale(mesh: ET.Element) -> bool:
    """Whether a mesh's scale is not three numbers other than 0."""
    factors = triple(mesh.get("scale")) if mesh.get("scale") is not None else (1.0,)
    return not all(map(math.isfinite, factors)) or not all(factors)


def colour_of(element: ET.Element) -> tuple[float, ...]:
    """Return the numbers of a <color>; empty where they are none."""
    try:
        return tuple(float(text) for text in (element.get("rgba") or "").split())
    except ValueError:
        return ()


def repeated_materials(file: UrdfFile) -> list[ET.Element]:
    """Return the materials of the robot whose name an earlier one has."""
    seen, found = set(), []
    for material in file.root.findall("material"):
        name = material.get("name") or ""
        if name in seen:
            found.append(material)
        seen.add(name)
    return found


def bad_size(geometry: ET.Element) -> str:
    """Return the sizes of a primitive where one is impossible, else ""; "" for meshes."""
    if geometry.tag == "box":
        sizes = lengths(geometry.get("size")) if geometry.get("size") else (math.nan,)
    elif geometry.tag in ("sphere", "cylinder", "capsule"):
        names = ("radius",) if geometry.tag == "sphere" else ("radius", "length")
        sizes = tuple(length(geometry, name) for name in names)
    else:
        return ""
    if all(size > 0.0 and math.isfinite(size) for size in sizes):
        return ""
    return f"{geometry.tag} of {' '.join(f'{size:g}' for size in sizes)} m"


def bad_shape(shape: ET.Element) -> str:
    """Return why a <visual> or <collision> is no shape; "" where it is one."""
    if not all(map(math.isfinite, (*origin(shape)[0], *origin(shape)[1]))):
        return "its origin is no place"
    geometries = [x for x in shape.findall("geometry/*") if x.tag in GEOMETRIES]
    if not geometries:
        return "no geometry"
    return next((text for geometry in geometries if (text := bad_size(geometry))), "")


def _of_link(measures: Measures, link: Link) -> Iterator[Finding]:
    where, seen = f"link {link.name!r}", set()
    for tag in ("visual", "collision"):
        for shape in link.element.findall(tag):
            if text := bad_shape(shape):
                value = f"{tag}: {text}"
                yield Finding.of("unreadable shape", where, value)
            for geometry in shape.findall("geometry/*"):
                uri = geometry.get("filename") or ""
                if geometry.tag == "mesh" and (uri, geometry.get("scale")) not in seen:
                    seen.add((uri, geometry.get("scale")))
                    yield from _of_mesh(measures, geometry, where, uri)


def _of_mesh(measures: Measures, mesh: ET.Element, where: str, uri: str) -> Iterator[Finding]:
    if bad_scale(mesh):
        yield Finding.of("mesh scale", where, f"scale {mesh.get('scale')!r}")
    finder = measures.solids.finder
    if finder is None:
        return
    if finder.find(uri) is None if uri else True:
        yield Finding.of("mesh not found", where, f"mesh {uri!r}")
    elif not bad_scale(mesh) and measures.solids.mesh(mesh) is None:
        yield Finding.of("mesh without volume", where, f"mesh {uri!r}")


def _materials(file: UrdfFile) -> Iterator[Finding]:
    count = Counter(material.get("name") or "" for material in repeated_materials(file))
    for name, more in count.items():
        yield Finding.of("material defined twice", f"material {name!r}", f"{more + 1} times")


def _colours(file: UrdfFile) -> Iterator[Finding]:
    elements = (x for material in file.root.iter("material") for x in material.findall("color"))
    for number, element in enumerate(elements, 1):
        if fault := _colour_fault(colour_of(element)):
            yield Finding.of(fault, f"colour {number}", f"rgba {element.get('rgba')!r}")


def _colour_fault(colour: tuple[float, ...]) -> str:
    if len(colour) != CHANNELS or not all(map(math.isfinite, colour)):
        return "unreadable colour"
    return "colour out of range" if max(colour) > 1.0 or min(colour) < 0.0 else ""


# Repairs of shapes, mesh scales, colours and materials.


def repair_appearance(draft: Draft) -> None:
    """Drop shapes, colours and materials that cannot be read; bring colours into their range."""
    for link in draft.file.links:
        for tag in ("visual", "collision"):
            for shape in link.element.findall(tag):
                _repair_shape(draft, link.element, shape)
    repeated = repeated_materials(draft.file)
    draft.drop(repeated)
    for material in repeated:
        draft.change(f"material {material.get('name')!r}", "a second definition dropped")
    _repair_colours(draft)


def _repair_shape(draft: Draft, link: ET.Element, shape: ET.Element) -> None:
    where = f"link {link.get('name')!r}"
    if text := bad_shape(shape):
        link.remove(shape)
        draft.change(where, f"<{shape.tag}> dropped: {text}")
        return
    for mesh in shape.findall("geometry/mesh"):
        if bad_scale(mesh):
            draft.change(
                where,
                f"mesh scale {mesh.get('scale')!r} -> 1 1 1",
                "mesh scale 1, where the file's is no scale",
            )
            mesh.set("scale", "1 1 1")


def _repair_colours(draft: Draft) -> None:
    for material in list(draft.root.iter("material")):
        for element in material.findall("color"):
            colour = colour_of(element)
            where = f"material {material.get('name') or ''!r}"
            fault, before = _colour_fault(colour), element.get("rgba")
            if fault == "unreadable colour":
                material.remove(element)
                draft.change(where, f"colour {before!r} dropped")
            elif fault:
                element.set("rgba", " ".join(f"{value:.6g}" for value in _in_range(colour)))
                draft.change(where, f"colour {before} -> {element.get('rgba')}")


def _in_range(colour: tuple[float, ...]) -> list[float]:
    """Return red, green, blue from 0..255, opacity from 0..255 where it is above 1."""
    rgb, opacity = colour[:3], colour[3]
    byte = 255.0 if max(rgb) > 1.0 else 1.0
    values = [value / byte for value in rgb] + [opacity / 255.0 if opacity > 1.0 else opacity]
    return [min(max(value, 0.0), 1.0) for value in values]


# Mesh references that stay valid when a URDF is written into another folder.

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
