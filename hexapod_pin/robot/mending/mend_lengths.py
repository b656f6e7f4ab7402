"""Mends of lengths in millimetres: multiplied by 1e-3, exactly as written."""

from __future__ import annotations

import xml.etree.ElementTree as ET

from hexapod_pin.robot.mending.draft import Draft, scaled
from hexapod_pin.robot.mending.units import (
    UnitSlip,
    joint_length_slip,
    length_slips,
    mesh_slips,
)

MILLI = -3
"""Power of ten from mm to m."""


def mend_lengths(draft: Draft) -> None:
    """Bring the joints to metres, then what is compared with them."""
    slip = joint_length_slip(draft.measures)
    if slip is not None:
        for joint in draft.root.findall("joint"):
            _scale_origin(joint)
        _say(draft, slip, "origins of all joints")
    for slip in length_slips(draft.measures):
        for link in draft.root.findall("link"):
            (_scale_inertial if slip.kind == "inertials" else _scale_shapes)(link)
        what = "centres of mass" if slip.kind == "inertials" else "sizes and origins of all shapes"
        _say(draft, slip, what)
    _mend_meshes(draft)


def _mend_meshes(draft: Draft) -> None:
    for written, slip in mesh_slips(draft.measures).items():
        for mesh in list(draft.root.iter("mesh")):
            if (mesh.get("scale") or "") == written:
                mesh.set("scale", scaled(written or "1 1 1", MILLI))
        _say(draft, slip, f"meshes of scale {written or '1 1 1'}")


def _say(draft: Draft, slip: UnitSlip, what: str) -> None:
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
