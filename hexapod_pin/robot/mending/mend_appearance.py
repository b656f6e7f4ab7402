"""Mends of shapes, mesh scales, colours and materials."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET

from hexapod_pin.robot.description.urdf_file import origin
from hexapod_pin.robot.mending.appearance_findings import (
    CHANNELS,
    bad_scale,
    bad_size,
    colour_of,
    repeated_materials,
)
from hexapod_pin.robot.mending.draft import Draft


def mend_appearance(draft: Draft) -> None:
    """Drop shapes, colours and materials that cannot be read; bring colours into their range."""
    for link in draft.file.links:
        for tag in ("visual", "collision"):
            for shape in link.element.findall(tag):
                _mend_shape(draft, link.element, shape)
    repeated = repeated_materials(draft.file)
    draft.drop(repeated)
    for material in repeated:
        draft.change(f"material {material.get('name')!r}", "a second definition dropped")
    _mend_colours(draft)


def _mend_shape(draft: Draft, link: ET.Element, shape: ET.Element) -> None:
    where = f"link {link.get('name')!r}"
    numbers = (*origin(shape)[0], *origin(shape)[1])
    bad = [text for geometry in shape.findall("geometry/*") if (text := bad_size(geometry))]
    if bad or not all(map(math.isfinite, numbers)):
        link.remove(shape)
        draft.change(where, f"<{shape.tag}> dropped: {bad[0] if bad else 'its origin is no place'}")
        return
    for mesh in shape.findall("geometry/mesh"):
        if bad_scale(mesh):
            draft.change(
                where,
                f"mesh scale {mesh.get('scale')!r} -> 1 1 1",
                "mesh scale 1, where the file's is no scale",
            )
            mesh.set("scale", "1 1 1")


def _mend_colours(draft: Draft) -> None:
    for material in list(draft.root.iter("material")):
        for element in material.findall("color"):
            colour = colour_of(element)
            where = f"material {material.get('name') or ''!r}"
            if len(colour) != CHANNELS or not all(map(math.isfinite, colour)):
                material.remove(element)
                draft.change(where, f"colour {element.get('rgba')!r} dropped")
            elif max(colour) > 1.0 or min(colour) < 0.0:
                before = element.get("rgba")
                element.set("rgba", " ".join(f"{value:.6g}" for value in _in_range(colour)))
                draft.change(where, f"colour {before} -> {element.get('rgba')}")


def _in_range(colour: tuple[float, ...]) -> list[float]:
    """Return red, green, blue from 0..255, opacity from 0..255 where it is above 1."""
    rgb, opacity = colour[:3], colour[3]
    byte = 255.0 if max(rgb) > 1.0 else 1.0
    values = [value / byte for value in rgb] + [opacity / 255.0 if opacity > 1.0 else opacity]
    return [min(max(value, 0.0), 1.0) for value in values]
