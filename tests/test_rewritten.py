"""The same robot in other conventions: what Pinocchio sees, and what the walk then costs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from hexapod_pin.robot.robot import urdf_path
from hexapod_pin.validation.rewriting import ConventionSet, rewrite
from hexapod_pin.validation.rewriting.rewrite import stripped
from hexapod_pin.validation.rewriting.shape_files import mesh_of

EVERYTHING = ConventionSet(
    yaw=0.7, y_up=True, names="nonsense", signs=True, zeros=True, frames=True, fixed=True,
    feet="beyond the sphere", shapes="obj in mm", shuffled=True,
)  # fmt: skip


def model_of(text: str) -> pin.Model:
    """Return Pinocchio's model of a URDF with a free base."""
    return pin.buildModelFromXML(text, pin.JointModelFreeFlyer())


def configurations(old, new, rewritten, rng):
    """Return a random configuration and velocity of the original, and the same of the other."""
    q, v = pin.neutral(old), rng.normal(size=old.nv)
    q[7:] = rng.uniform(old.lowerPositionLimit[7:], old.upperPositionLimit[7:])
    p, u = pin.neutral(new), np.empty(new.nv)
    base = rewritten.base  # the old frame in the new one
    turned = base.r.T  # the new frame in the old one, which lies at the world's origin
    p[3:7] = pin.Quaternion(turned).coeffs()
    u[:3], u[3:6] = base.r @ v[:3], base.r @ v[3:6]
    for name, (other, sign, offset) in rewritten.joints.items():
        i, j = old.joints[old.getJointId(name)], new.joints[new.getJointId(other)]
        p[j.idx_q] = sign * q[i.idx_q] + offset
        u[j.idx_v] = sign * v[i.idx_v]
    return (q, v), (p, u)


@pytest.mark.parametrize("robot", ["kharagpur", "athena"])
@pytest.mark.parametrize("seed", range(4))
def test_pinocchio_sees_the_same_robot(robot, seed):
    """Kinetic energy, centre of mass and limits of a rewritten file are the original's to 1e-9."""
    rng = np.random.default_rng(seed)
    text = urdf_path(robot).read_text()
    conventions = EVERYTHING if seed == 0 else ConventionSet.draw(rng)
    rewritten = rewrite(text, conventions, rng)
    old, new = model_of(stripped(text)), model_of(rewritten.text)
    (q, v), (p, u) = configurations(old, new, rewritten, rng)
    data, other = old.createData(), new.createData()
    energy = pin.computeKineticEnergy(old, data, q, v)
    assert pin.computeKineticEnergy(new, other, p, u) == pytest.approx(energy, rel=1e-9)
    assert pin.centerOfMass(new, other, p) == pytest.approx(
        pin.centerOfMass(old, data, q), abs=1e-12
    )
    for name, (renamed, sign, offset) in rewritten.joints.items():
        i, j = old.joints[old.getJointId(name)].idx_q, new.joints[new.getJointId(renamed)].idx_q
        limits = sign * np.array([old.lowerPositionLimit[i], old.upperPositionLimit[i]]) + offset
        found = [new.lowerPositionLimit[j], new.upperPositionLimit[j]]
        assert found == pytest.approx(np.sort(limits), abs=1e-12)


def test_torques_of_gravity_map_with_the_signs():
    """A joint whose axis is turned round has the opposite torque."""
    rng = np.random.default_rng(3)
    text = urdf_path("athena").read_text()
    rewritten = rewrite(text, EVERYTHING, rng)
    old, new = model_of(stripped(text)), model_of(rewritten.text)
    (q, v), (p, u) = configurations(old, new, rewritten, rng)
    first = pin.rnea(old, old.createData(), q, v, 0.0 * v)
    second = pin.rnea(new, new.createData(), p, u, 0.0 * u)
    assert {change.sign for change in rewritten.joints.values()} == {-1.0, 1.0}
    for name, (renamed, sign, _) in rewritten.joints.items():
        i, j = old.joints[old.getJointId(name)].idx_v, new.joints[new.getJointId(renamed)].idx_v
        assert sign * second[j] == pytest.approx(first[i], abs=1e-9)


@pytest.mark.parametrize("units", ["kg mm2", "gram", "millimetre"])
def test_units_scale_what_they_say(units):
    """Inertias in kg mm^2, masses in g, lengths in mm: total mass and a hip's place say which."""
    text = urdf_path("athena").read_text()
    rewritten = rewrite(text, replace(ConventionSet(), units=units), np.random.default_rng(0))
    old, new = model_of(stripped(text)), model_of(rewritten.text)
    mass, length, inertia = {
        "kg mm2": (1.0, 1.0, 1e6), "gram": (1e3, 1.0, 1e3), "millimetre": (1.0, 1e3, 1e6),
    }[units]  # fmt: skip
    assert new.inertias[1].mass == pytest.approx(mass * old.inertias[1].mass, rel=1e-12)
    assert new.inertias[1].inertia == pytest.approx(inertia * old.inertias[1].inertia, rel=1e-9)
    place = new.jointPlacements[2].translation
    assert place == pytest.approx(length * old.jointPlacements[2].translation, abs=1e-12)


@pytest.mark.parametrize(
    ("kind", "size", "volume"),
    [
        ("box", {"size": "0.2 0.3 0.4"}, 0.024),
        ("cylinder", {"radius": "0.1", "length": "0.5"}, np.pi * 0.1**2 * 0.5),
        ("sphere", {"radius": "0.1"}, 4.0 / 3.0 * np.pi * 0.1**3),
    ],
)
def test_meshes_are_closed_and_face_outwards(kind, size, volume):
    """The volume by the divergence theorem is the primitive's, less what 24 sides leave out."""
    vertices, triangles = mesh_of(kind, size)
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    enclosed = float((a * np.cross(b, c)).sum() / 6.0)
    assert 0.95 * volume < enclosed <= volume * (1.0 + 1e-12)
    if kind == "sphere":
        assert np.linalg.norm(vertices, axis=1) == pytest.approx(0.1, rel=1e-12)
