"""The same robot in other conventions: what Pinocchio sees, and what the walk then costs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from rewriting import ConventionSet, rewrite
from rewriting.comparison import difference, reference_walk
from rewriting.rewrite import stripped
from rewriting.shape_files import mesh_of

from hexapod_pin.robot.leg_bodies import leg_bodies
from hexapod_pin.robot.robot import load_robot, urdf_path

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
def test_units_scale_their_quantities(units):
    """Inertias in kg mm^2, masses in g, lengths in mm: seen in total mass and a hip's place."""
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


def test_clearance_does_not_depend_on_where_frames_lie(tmp_path):
    """Joint frames slid along their axes leave the links' capsules where they are."""
    rng = np.random.default_rng(5)
    text = urdf_path("athena").read_text()
    rewritten = rewrite(text, ConventionSet(frames=True), rng)
    robots = []
    for name, content in (("old", stripped(text)), ("new", rewritten.text)):
        path = tmp_path / f"{name}.urdf"
        path.write_text(content)
        robots.append(load_robot(path))
    q = np.tile(pin.neutral(robots[0].model), (20, 1))
    q[:, 7:] = rng.uniform(robots[0].lower, robots[0].upper, (20, 18))
    first, second = (leg_bodies(robot).distances(q)[0] for robot in robots)
    assert second == pytest.approx(first, abs=1e-9)


@pytest.mark.parametrize(("robot", "seeds"), [("kharagpur", (3,)), ("athena", (12,))])
def test_the_walk_is_the_same_whatever_the_conventions(robot, seeds):
    """Found by its geometry, the robot stands and walks with the original's torques to 1e-6."""
    reference = reference_walk(robot)
    for seed in seeds:
        found = difference(robot, seed, reference)
        assert found.passed, found
    assert found.torque > 0.0  # another file: rounding must show
