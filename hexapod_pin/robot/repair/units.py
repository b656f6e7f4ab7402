"""Wrong units are found by size and density alone: millimetres, inches, grams, kg mm^2.

Lengths are repaired here.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import median

import numpy as np

from hexapod_pin.robot.description.solids import finite, inertia_matrix
from hexapod_pin.robot.description.urdf_file import Link, length, lengths, origin, triple
from hexapod_pin.robot.repair import rules
from hexapod_pin.robot.repair.finding import Draft, multiplied
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


LENGTH_UNITS = {"mm": 1e-3, "cm": 1e-2, "inches": 0.0254}
"""Units in which files have lengths, in metres."""

DRAWN = 1.6
"""Size of what is drawn of a link over the distance to its next joint: robots' medians are 1.2 to
2.0 (fifteen public ones)."""

CENTRE = 0.5
"""Distance of a link's centre of mass over that to its next joint, of a uniform rod."""

FAR_OFF = 6.0
"""Lengths over what is usual from which they are in another unit (the middle of 1 and an inch)."""

HEAVIEST_WALKER = 500.0
"""Mass of a file from which it is taken to be in another unit, and says nothing of lengths [kg]
(*assumed*)."""


def joint_length_slip(measures: Measures) -> UnitSlip | None:
    """Return the unit of the joints' origins, where they are not in metres.

    A robot's mass tells it, where it is one that its motors can have: of a length in another unit
    it is none. Without masses only millimetres show.
    """
    span, (low, high) = measures.span, rules.SPAN
    if span <= 0.0:
        return None
    value = f"joints span {span:.3g}"
    motors = sum(len(chain) for chain in measures.chains)
    total = measures.total_mass
    known = motors > 0 and rules.MOTOR_MASS[0] * motors <= total <= HEAVIEST_WALKER
    fitting = {unit: to for unit, to in LENGTH_UNITS.items() if low <= to * span <= high}
    if known and fitting and total < rules.MASS_PER_SPAN[0] * span**3:
        units = _units_of_mass(measures, fitting)
        if units:
            to = LENGTH_UNITS[units[0]]
            text = f"{value} {units[0]} ({to * span:.3g} m) for a robot of {total:.3g} kg"
            return UnitSlip("joints", " or ".join(units), to, text)
    if span > high and low <= 1e-3 * span <= high:
        return UnitSlip("joints", "mm", 1e-3, f"{value} m")
    return None


def _units_of_mass(measures: Measures, units: Mapping[str, float]) -> list[str]:
    """Return the unit in which legs and span fit the mass, and another that does so, too."""
    total, best = measures.total_mass, list[str]()
    for size, usual, (low, high) in (
        (measures.leg_length, rules.USUAL_MASS_PER_LEG, rules.MASS_PER_LEG),
        (measures.span, rules.USUAL_MASS_PER_SPAN, rules.MASS_PER_SPAN),
    ):
        bulk = {unit: total / (to * size) ** 3 for unit, to in units.items() if size > 0.0}
        for unit in sorted(bulk, key=lambda unit: abs(math.log(bulk[unit] / usual)))[:1]:
            best += [unit] if low <= bulk[unit] <= high else []
    low, high = rules.WALKERS_PER_SPAN
    also = [u for u, to in units.items() if low <= total / (to * measures.span) ** 3 <= high]
    return list(dict.fromkeys([*best, *also])) if best else []


def length_slips(measures: Measures) -> list[UnitSlip]:
    """Return other lengths that are not in metres; joints must be in metres already."""
    span, slips = measures.span, []
    if not 0.0 < span <= rules.SPAN[1]:
        return []
    centres = (math.hypot(*finite(link.com)) for link in measures.file.links)
    for kind, what, values in (
        ("inertials", "a centre of mass lies {:.3g} m from its link", centres),
        ("shapes", "a shape is {:.3g} m large", _shape_lengths(measures.file.links)),
    ):
        largest = max(values, default=0.0)
        text = f"{what.format(largest)}, the joints span {span:.3g} m"
        unit = "mm" if kind == "inertials" else _unit_drawn(_relative(measures, kind))
        if largest > rules.UNIT_SLIP * span and 1e-3 * largest < rules.UNIT_SLIP * span:
            slips.append(UnitSlip(kind, unit or "mm", LENGTH_UNITS[unit or "mm"], text))
        elif kind == "shapes" and unit is not None:
            slips.append(UnitSlip(kind, unit, LENGTH_UNITS[unit], text))
    sphere = max((radius for _, radius in _spheres(measures.file.links)), default=0.0)
    if sphere > span > SPHERES * 1e-3 * sphere and not any(x.kind == "shapes" for x in slips):
        text = f"a sphere has a radius of {sphere:.3g} m, the joints span {span:.3g} m"
        slips.append(UnitSlip("spheres", "mm", 1e-3, text))
    return slips


SPHERES = 5.0
"""Span of the joints over the radius of a foot, at least (*assumed*)."""


def _spheres(links: Iterable[Link]) -> Iterable[tuple[ET.Element, float]]:
    """Return the spheres of links with their radii [m]."""
    for link in links:
        for sphere in link.element.iter("sphere"):
            radius = length(sphere, "radius")
            yield sphere, abs(radius) if math.isfinite(radius) else 0.0


def mesh_slips(measures: Measures) -> dict[str, UnitSlip]:
    """Return the mesh scales (as written) with which meshes are much too large."""
    span, largest = measures.span, dict[str, float]()
    ratios: dict[str, list[float]] = {}
    for link in measures.file.links:
        for mesh in link.element.iter("mesh"):
            solid = measures.solids.mesh(mesh)
            scale = mesh.get("scale") or ""
            if solid is not None:
                largest[scale] = max(largest.get(scale, 0.0), solid.extent)
                ratios.setdefault(scale, []).extend(_over_reach(measures, link, solid.extent))
    found = {}
    for scale, size in largest.items():
        if not 0.0 < span <= rules.SPAN[1]:
            continue
        unit = _unit_drawn(ratios.get(scale, []))
        if unit is None and rules.UNIT_SLIP * span < size < 1e3 * 10 * span:
            unit = "mm"
        if unit is not None:
            text = f"a mesh is {size:.3g} m large, the joints span {span:.3g} m"
            found[scale] = UnitSlip("meshes", unit, LENGTH_UNITS[unit], text)
    return found


def _unit_drawn(ratios: Sequence[float]) -> str | None:
    """Return the unit of what is drawn, by sizes over distances to the next joints in metres."""
    if not ratios or (middle := median(ratios)) <= FAR_OFF * DRAWN:
        return None
    return min(LENGTH_UNITS, key=lambda unit: abs(math.log(LENGTH_UNITS[unit] * middle / DRAWN)))


def _relative(measures: Measures, kind: str) -> list[float]:
    """Return lengths of the inertials or shapes of links over the distances to their next joints.

    What lies at its link's origin, and has no size, is left out.
    """
    found = []
    for link in measures.file.links:
        values = [math.hypot(*finite(link.com))] if kind == "inertials" else _shape_lengths([link])
        size = max(values, default=0.0)
        found += _over_reach(measures, link, size) if size > 0.0 else []
    return found


def _over_reach(measures: Measures, link: Link, size: float) -> list[float]:
    """Return a size over the distance to a link's next joint, where that is part of the robot's."""
    reach = measures.reach(link)
    return [size / reach] if reach > LEAST_REACH * measures.span else []


LEAST_REACH = 0.05
"""Distance to the next joint over the span of all joints, from which sizes are compared with it."""


LARGEST_ANGLE = 4.0 * math.pi
"""Above two turns an angle of an <origin> is in degrees [rad] (*assumed*)."""


def angle_slip(measures: Measures) -> UnitSlip | None:
    """Return that angles of joints' origins are in degrees: they are turned many times round."""
    turned = [(max(map(abs, finite(joint.rpy))), joint) for joint in measures.file.joints]
    angle, joint = max(turned, key=lambda one: one[0], default=(0.0, None))
    if joint is None or angle <= LARGEST_ANGLE:
        return None
    text = f"joint {joint.name!r} is turned by {angle:.3g} rad"
    return UnitSlip("angles", "degrees", math.pi / 180.0, text)


MOST_OVER_MEDIAN = 10.0
"""Total mass over what it were if all links had the median one, at most (*assumed*)."""


def mass_slip(measures: Measures) -> UnitSlip | None:
    """Return whether all masses are in grams: the links are denser than any metal."""
    links = measures.file.links
    if uniform_mass(measures) is not None:
        return None  # a placeholder shows no unit
    pairs = [(link.mass or 0.0, solid.volume) for link in links if (solid := measures.solid(link))]
    known = [(m, volume) for m, volume in pairs if m > 0.0 and math.isfinite(m)]
    if known:
        mean = math.fsum(m for m, _ in known) / math.fsum(volume for _, volume in known)
        density = min(mean, median(m / volume for m, volume in known))  # few links show no unit
        if rules.HEAVIEST < density and rules.LIGHTEST < 1e-3 * density < rules.HEAVIEST:
            return UnitSlip("masses", "g", 1e-3, f"mean density {density:.3g} kg/m^3")
        return None
    span, masses = measures.span, [link.mass for link in links if link.mass]
    typical = MOST_OVER_MEDIAN * median(masses) * len(masses) if masses else 0.0
    total = min(measures.total_mass, typical)
    bulk = total / span**3 if 0.0 < span <= rules.SPAN[1] else 0.0
    if rules.MASS_PER_SPAN[1] < bulk < 1e3 * rules.MASS_PER_SPAN[1]:
        return UnitSlip("masses", "g", 1e-3, f"{total:.3g} kg on a span of {span:.3g} m")
    return None


def uniform_mass(measures: Measures) -> float | None:
    """Return the mass that all links with a mass have, the trunk and the feet [kg]; else None."""
    masses = [link.mass for link in measures.file.links if link.mass]
    return masses[0] if len(masses) > MOST_ALIKE and len(set(masses)) == 1 else None


MOST_ALIKE = 6
"""Links that may have one mass: legs of two parts that are alike, on a trunk without one."""


def inertia_slip(measures: Measures) -> UnitSlip | None:
    """Return the unit that all inertias are in, if it is not kg m^2; masses must be in kg."""
    decades = [ratio for link in measures.file.links if (ratio := _decades(measures, link))]
    if not decades or _same_everywhere(measures) or placeholder(measures):
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


PLACEHOLDER_SHARE = 0.8
"""Share of the links that have one inertia from which it is a placeholder, and ..."""

DIFFERENT_MASSES = 1.5
"""... largest over smallest mass of these."""


def placeholder(measures: Measures) -> tuple[float, ...] | None:
    """Return the moments that nearly all links have, whatever their mass; None where they differ.

    No unit shows in them: Gazebo and exporters write 1 kg m^2 where nothing is known.
    """
    links = [link for link in measures.file.links if readable(link)]
    counts = Counter(link.moments for link in links).most_common(1)
    if len(links) <= 2 or counts[0][1] < PLACEHOLDER_SHARE * len(links):
        return None
    moments = counts[0][0]
    masses = [link.mass or 0.0 for link in links if link.moments == moments]
    return moments if max(masses) > DIFFERENT_MASSES * min(masses) else None


def _shape_lengths(links: Iterable[Link]) -> Iterable[float]:
    """Return lengths of boxes, cylinders and spheres, and offsets of all shapes."""
    for link in links:
        for tag in ("visual", "collision"):
            for shape in link.element.findall(tag):
                yield math.hypot(*finite(origin(shape)[0]))
                for geometry in shape.findall("geometry/*"):
                    yield math.hypot(*finite(lengths(geometry.get("size"))))
                    for name in ("radius", "length"):
                        value = length(geometry, name)
                        yield abs(value) if math.isfinite(value) else 0.0


# Repairs of lengths: multiplied by what their unit is in metres, exactly as written.


def repair_lengths(draft: Draft) -> None:
    """Bring the joints to metres, with what is in the same unit, then what is not."""
    _repair_angles(draft)
    measures = draft.measures
    slip, like = joint_length_slip(measures), set[str]()
    if slip is not None:
        like = {kind for kind in ("inertials", "shapes") if _is_like_joints(measures, kind)}
        for joint in draft.root.findall("joint"):
            _scale_origin(joint, slip)
        _report(draft, slip, "origins of all joints")
        for kind in like:
            _scale(draft, replace(slip, kind=kind))
    for other in length_slips(draft.measures):
        if other.kind not in like:
            _scale(draft, other)
    _repair_meshes(draft)


def _repair_angles(draft: Draft) -> None:
    """Turn angles of joints' origins into radians: all, where most of them are in degrees."""
    slip = angle_slip(draft.measures)
    if slip is None:
        return
    origins = draft.root.findall("joint/origin")
    sizes = [max(map(abs, finite(triple(x.get("rpy"))))) for x in origins]
    large = sum(size > LARGEST_ANGLE for size in sizes)
    every = 2 * large > sum(size > 0.0 for size in sizes)
    for element, size in zip(origins, sizes, strict=True):
        if size > LARGEST_ANGLE or (every and size > 0.0):
            element.set("rpy", multiplied(element.get("rpy") or "", slip.factor))
    _report(draft, slip, f"angles of {'all joints' if every else f'{large} joints'}")


WHAT = {
    "inertials": "centres of mass", "shapes": "sizes and origins of all shapes",
    "spheres": "radii of spheres larger than the robot",
}  # fmt: skip
"""What is scaled, by kind."""


def _is_like_joints(measures: Measures, kind: str) -> bool:
    """Return whether lengths are in the unit of the joints; not where there are none."""
    ratios = _relative(measures, kind)
    usual = CENTRE if kind == "inertials" else DRAWN
    return bool(ratios) and usual / FAR_OFF < median(ratios) < usual * FAR_OFF


def _scale(draft: Draft, slip: UnitSlip) -> None:
    if slip.kind == "spheres":
        span = draft.measures.span
        for sphere, radius in _spheres(draft.file.links):
            if radius > span:
                sphere.set("radius", multiplied(sphere.get("radius") or "", slip.factor))
        _report(draft, slip, WHAT[slip.kind])
        return
    for link in draft.root.findall("link"):
        (_scale_inertial if slip.kind == "inertials" else _scale_shapes)(link, slip)
    _report(draft, slip, WHAT[slip.kind])


def _repair_meshes(draft: Draft) -> None:
    for written, slip in mesh_slips(draft.measures).items():
        for mesh in list(draft.root.iter("mesh")):
            if (mesh.get("scale") or "") == written:
                mesh.set("scale", multiplied(written or "1 1 1", slip.factor))
        _report(draft, slip, f"meshes of scale {written or '1 1 1'}")


def _report(draft: Draft, slip: UnitSlip, what: str) -> None:
    text = f"{what} multiplied by {slip.factor:g}: {slip.value}"
    draft.change("robot", text, f"{what} were in {slip.unit}")


def _scale_inertial(link: ET.Element, slip: UnitSlip) -> None:
    inertial = link.find("inertial")
    if inertial is not None:
        _scale_origin(inertial, slip)


def _scale_shapes(link: ET.Element, slip: UnitSlip) -> None:
    for shape in [*link.findall("visual"), *link.findall("collision")]:
        _scale_origin(shape, slip)
        for geometry in shape.findall("geometry/*"):
            for name in ("size", "radius", "length"):
                if geometry.tag != "mesh" and geometry.get(name) is not None:
                    geometry.set(name, multiplied(geometry.get(name) or "", slip.factor))


def _scale_origin(element: ET.Element, slip: UnitSlip) -> None:
    origin = element.find("origin")
    if origin is not None and origin.get("xyz") is not None:
        origin.set("xyz", multiplied(origin.get("xyz") or "", slip.factor))
