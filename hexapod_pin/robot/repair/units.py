"""Wrong units are found by size and density alone: millimetres, grams, kg mm^2.

Lengths are repaired here.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterable
from dataclasses import dataclass
from statistics import median

import numpy as np

from hexapod_pin.robot.description.solids import finite, inertia_matrix
from hexapod_pin.robot.description.urdf_file import Link, length, lengths, origin
from hexapod_pin.robot.repair import rules
from hexapod_pin.robot.repair.finding import Draft, scaled
from hexapod_pin.robot.repair.measures import Measures

INERTIA_UNITS = {
    3: "g m^2", 4: "kg cm^2", 6: "kg mm^2", 7: "g cm^2", 9: "g mm^2",
}  # fmt: skip
"""Units by the power of ten that a number in them exceeds one in kg m^2."""

HALF_DECADE = 0.5
"""A unit is recognised when the median ratio lies within this many decades of it, and ..."""

SPREAD = 1.0
"""... the middle half of the links within this many decades of each other."""


@dataclass(frozen=True)
class UnitSlip:
    """Numbers of one kind that are in another unit.

    Attributes:
        kind: "joints", "inertials", "shapes", "meshes", "masses" or "inertias".
        unit: the unit they are in.
        factor: to SI.
        value: what shows it.
    """

    kind: str
    unit: str
    factor: float
    value: str


def joint_length_slip(measures: Measures) -> UnitSlip | None:
    """Return whether the origins of the joints are in millimetres."""
    span, (low, high) = measures.span, rules.SPAN
    if span > high and low <= 1e-3 * span <= high:
        return UnitSlip("joints", "mm", 1e-3, f"joints span {span:.3g} m")
    return None


def length_slips(measures: Measures) -> list[UnitSlip]:
    """Return other lengths in millimetres; joints must be in metres already."""
    span, slips = measures.span, []
    if not 0.0 < span <= rules.SPAN[1]:
        return []
    centres = (math.hypot(*finite(link.com)) for link in measures.file.links)
    for kind, what, values in (
        ("inertials", "a centre of mass lies {:.3g} m from its link", centres),
        ("shapes", "a shape is {:.3g} m large", _shape_lengths(measures)),
    ):
        largest = max(values, default=0.0)
        if largest > rules.UNIT_SLIP * span and 1e-3 * largest < rules.UNIT_SLIP * span:
            text = f"{what.format(largest)}, the joints span {span:.3g} m"
            slips.append(UnitSlip(kind, "mm", 1e-3, text))
    return slips


def mesh_slips(measures: Measures) -> dict[str, UnitSlip]:
    """Return the mesh scales (as written) with which meshes are 1000 times too large."""
    span, largest = measures.span, dict[str, float]()
    for link in measures.file.links:
        for mesh in link.element.iter("mesh"):
            solid = measures.solids.mesh(mesh)
            scale = mesh.get("scale") or ""
            if solid is not None:
                largest[scale] = max(largest.get(scale, 0.0), solid.extent)
    return {
        scale: UnitSlip(
            "meshes", "mm", 1e-3, f"a mesh is {size:.3g} m large, the joints span {span:.3g} m"
        )  # fmt: skip
        for scale, size in largest.items()
        if 0.0 < span <= rules.SPAN[1] and rules.UNIT_SLIP * span < size < 1e3 * 10 * span
    }


def mass_slip(measures: Measures) -> UnitSlip | None:
    """Return whether all masses are in grams: the links are denser than any metal."""
    links = measures.file.links
    pairs = [(link.mass or 0.0, solid.volume) for link in links if (solid := measures.solid(link))]
    known = [(m, volume) for m, volume in pairs if m > 0.0 and math.isfinite(m)]
    if known:
        density = math.fsum(m for m, _ in known) / math.fsum(volume for _, volume in known)
        if rules.HEAVIEST < density and rules.LIGHTEST < 1e-3 * density < rules.HEAVIEST:
            return UnitSlip("masses", "g", 1e-3, f"mean density {density:.3g} kg/m^3")
        return None
    total, span = measures.total_mass, measures.span
    bulk = total / span**3 if 0.0 < span <= rules.SPAN[1] else 0.0
    if rules.MASS_PER_SPAN[1] < bulk < 1e3 * rules.MASS_PER_SPAN[1]:
        return UnitSlip("masses", "g", 1e-3, f"{total:.3g} kg on a span of {span:.3g} m")
    return None


def inertia_slip(measures: Measures) -> UnitSlip | None:
    """Return the unit that all inertias are in, if it is not kg m^2; masses must be in kg."""
    decades = [ratio for link in measures.file.links if (ratio := _decades(measures, link))]
    if not decades or _same_everywhere(measures):
        return None
    middle, (low, high) = median(decades), np.percentile(decades, [25, 75])
    for power, unit in INERTIA_UNITS.items():
        if abs(middle - power) <= HALF_DECADE and high - low <= SPREAD:
            text = f"inertias are 1e{power} times those of bodies of that mass and size"
            return UnitSlip("inertias", unit, 10.0**-power, text)
    return None


def gyration(link: Link) -> float:
    """Return the largest radius of gyration of a link with mass [m]."""
    largest = float(np.linalg.eigvalsh(inertia_matrix(link))[-1])
    return math.sqrt(max(0.0, largest) / (link.mass or math.nan))


def readable(link: Link) -> bool:
    """Whether mass and inertia of a link are numbers, and the mass above 0."""
    numbers = (link.mass or 0.0, *link.com, *link.inertia_rpy, *link.moments)
    return all(map(math.isfinite, numbers)) and (link.mass or 0.0) > 0.0


def _decades(measures: Measures, link: Link) -> float | None:
    """Return log10 of a link's inertia over that of a body of its mass and size, if known."""
    solid = measures.solid(link)
    extent = solid.extent if solid is not None else measures.reach(link)
    if extent <= 0.0 or not readable(link) or (radius := gyration(link)) <= 0.0:
        return None
    return 2.0 * math.log10(radius / (rules.TYPICAL_GYRATION * extent))


def _same_everywhere(measures: Measures) -> bool:
    """Whether several links share one mass and one inertia: such dummies do not show a unit."""
    values = [(link.mass, *link.moments) for link in measures.file.links if readable(link)]
    return len(values) > 2 and len(set(values)) <= 2


def _shape_lengths(measures: Measures) -> Iterable[float]:
    """Return lengths of boxes, cylinders and spheres, and offsets of all shapes."""
    for link in measures.file.links:
        for tag in ("visual", "collision"):
            for shape in link.element.findall(tag):
                yield math.hypot(*finite(origin(shape)[0]))
                for geometry in shape.findall("geometry/*"):
                    yield math.hypot(*finite(lengths(geometry.get("size"))))
                    for name in ("radius", "length"):
                        value = length(geometry, name)
                        yield abs(value) if math.isfinite(value) else 0.0


# Repairs of lengths in millimetres: multiplied by 1e-3, exactly as written.

MILLI = -3
"""Power of ten from mm to m."""


def repair_lengths(draft: Draft) -> None:
    """Bring the joints to metres, then what is compared with them."""
    slip = joint_length_slip(draft.measures)
    if slip is not None:
        for joint in draft.root.findall("joint"):
            _scale_origin(joint)
        _report(draft, slip, "origins of all joints")
    for slip in length_slips(draft.measures):
        for link in draft.root.findall("link"):
            (_scale_inertial if slip.kind == "inertials" else _scale_shapes)(link)
        what = "centres of mass" if slip.kind == "inertials" else "sizes and origins of all shapes"
        _report(draft, slip, what)
    _repair_meshes(draft)


def _repair_meshes(draft: Draft) -> None:
    for written, slip in mesh_slips(draft.measures).items():
        for mesh in list(draft.root.iter("mesh")):
            if (mesh.get("scale") or "") == written:
                mesh.set("scale", scaled(written or "1 1 1", MILLI))
        _report(draft, slip, f"meshes of scale {written or '1 1 1'}")


def _report(draft: Draft, slip: UnitSlip, what: str) -> None:
    text = f"{what} multiplied by {slip.factor:g}: {slip.value}"
    draft.change("robot", text, f"{what} were in {slip.unit}")


def _scale_inertial(link: ET.Element) -> None:
    inertial = link.find("inertial")
    if inertial is not None:
        _scale_origin(inertial)


def _scale_shapes(link: ET.Element) -> None:
    for shape in [*link.findall("visual"), *link.findall("collision")]:
        _scale_origin(shape)
        for geometry in shape.findall("geometry/*"):
            for name in ("size", "radius", "length"):
                if geometry.tag != "mesh" and geometry.get(name) is not None:
                    geometry.set(name, scaled(geometry.get(name) or "", MILLI))


def _scale_origin(element: ET.Element) -> None:
    origin = element.find("origin")
    if origin is not None and origin.get("xyz") is not None:
        origin.set("xyz", scaled(origin.get("xyz") or "", MILLI))
