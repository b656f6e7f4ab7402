"""Patches and shaking, standing on any ground, refusals, TOML."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import tomli_w
import vehicles
from grounds import ALL, HILLS, PATCHED, PROFILES, SLOPE, dense, nearest, places, world
from PIL import Image
from refusals import refused
from scipy.spatial.transform import Rotation

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError
from hexapod_pin.ground.terrain import Polyline, read_terrain
from hexapod_pin.native import evaluate
from hexapod_pin.simulation.plant import native_plant
from hexapod_pin.spec import read_toml


def test_patches() -> None:
    """Native and NumPy agree on which patch counts: the first; outside, factors are 1."""
    native = PATCHED.native()
    expected = {
        (0.2, 0.2): (0.2, 1.0), (0.7, 0.7): (0.2, 1.0), (1.5, 1.5): (3.0, 0.1),
        (1.0, 1.0): (0.2, 1.0), (2.0, 0.5): (3.0, 0.1), (-0.1, 0.5): (1.0, 1.0),
        (1.5, 0.2): (1.0, 1.0),
    }  # fmt: skip
    for place, factors in expected.items():
        assert native.patch(*place) == factors
        assert tuple(PATCHED.factors_at(*place)) == factors
    assert PATCHED.height_at(0.3, 0.4) == SLOPE.height_at(0.3, 0.4)


@pytest.mark.parametrize(
    "friction",
    [
        (hp.contact.TanhCoulomb(mu=0.5, slope=1e3), hp.contact.TanhCoulomb(mu=0.05, slope=1e3)),
        (hp.contact.StickSlip(mu=0.5, stiffness=2e4, damping=60.0),
         hp.contact.StickSlip(mu=0.05, stiffness=2e4, damping=60.0)),
    ],
)  # fmt: skip
@pytest.mark.parametrize("u", [(0.0, 0.0, 0.0), (0.3, 0.1, 0.05)])
def test_a_patch_equals_ground_of_its_own_coefficients(
    tmp_path: Path, friction: tuple[object, object], u: tuple[float, float, float]
) -> None:
    robot = vehicles.particle(tmp_path)
    patch = hp.terrain.Patch(low=(-5.0, -5.0), high=(5.0, 5.0), friction=0.1, stiffness=0.25)
    found = []
    for terrain, stiffness, law in (
        (hp.terrain.PatchedGround(ground=hp.Flat(), patches=(patch,)), 1e6, friction[0]),
        (hp.Flat(), 0.25e6, friction[1]),
    ):
        normal = hp.contact.HuntCrossley(stiffness=stiffness, dissipation=0.2)
        contact = hp.Contact(normal=normal, friction=law)
        plant = native_plant(hp.Scene(robot, terrain=terrain, contact=contact, servo=vehicles.LIMP))
        state = vehicles.state(robot, -1e-3, u)
        found.append(evaluate(plant, state.q, state.v, np.zeros(0)))
    for name in ("foot_force", "foot_damping", "foot_stiffness"):
        patched, own = (np.asarray(each[name]) for each in found)
        assert np.abs(own).max() > 1.0
        np.testing.assert_allclose(patched, own, rtol=1e-12, atol=1e-12 * np.abs(own).max())


@pytest.mark.parametrize("name", ALL)
def test_lift_leaves_no_clearance(name: str) -> None:
    terrain, radii = ALL[name], np.array([0.02, 0.0, 0.03])
    level = np.random.default_rng(5).uniform(-1.0, 1.0, (3, 2))
    for height in (-0.5, 2.0):
        points = np.column_stack([level, np.full(3, height)])
        up = terrain.lift(points, radii)
        assert terrain.clearance(points + (0.0, 0.0, up), radii) == pytest.approx(0.0, abs=2e-12)
        assert terrain.clearance(points + (0.0, 0.0, up - 1e-6), radii) <= 1e-12


def test_toml_gives_the_same_ground_back() -> None:
    for terrain in ALL.values():
        assert read_terrain(read_toml(tomli_w.dumps(terrain.model_dump()))) == terrain
    assert np.array_equal(read_terrain(HILLS.model_dump()).z, HILLS.z)  # every bit
    scene = hp.Scene(hp.load_robot("athena"), terrain=ALL["shaken"])
    assert hp.Scene.from_toml(scene.to_toml()).terrain == ALL["shaken"]


def field(z: object) -> hp.HeightField:
    return hp.HeightField.from_array(z, 0.1)


def clearance(points: object, radii: object = 0.0) -> float:
    return hp.Flat().clearance(points, radii)


@pytest.mark.parametrize(
    ("make", "given", "name", "about"),
    [
        (read_terrain, {"kind": "lava"}, "terrain.kind", "lava"),
        (read_terrain, {"kind": "slope", "angle": 1.1}, "Slope.angle", "1.1"),
        (read_terrain, {**HILLS.model_dump(), "heights": "AAAA"}, "HeightField.heights", "AAAA"),
        (lambda z: hp.terrain.PatchedGround(ground=z, patches=()), SLOPE,
         "PatchedGround.patches", ""),
        (lambda z: hp.terrain.Patch(low=z, high=(1.0, 0.0)), (0.0, 0.0), "Patch", "(1.0, 0.0)"),
        (field, [[0.0, 0.0]], "HeightField.z", "(1, 2)"),
        (field, [["a", 0.0], [0.0, 0.0]], "HeightField.z", ""),
        (field, [[0.0, 0.0], [0.0, math.nan]], "HeightField.z[1, 1]", "nan"),
        (field, [[0.0, 0.0, 0.2], [0.0, 0.0, 0.2]], "HeightField.z[0, 1]", "63.4 deg"),
        (lambda z: hp.HeightField.random(1, wavelength=z), 0.0, "wavelength", ""),
        (lambda z: hp.HeightField.random(1, amplitude=z), -1.0, "amplitude", ""),
        (lambda z: hp.HeightField.random(1, wavelength=z), 1e-5, None, ""),
        (clearance, [[0, 0, math.nan]], "points[0, 2]", ""),
        (clearance, [[0, 0, "x"]], "Ground.clearance.points", ""),
        (clearance, [[0, 0]], "points", "(N, 3)"),
        (lambda z: clearance([[0, 0, 0]], z), [1.0, 2.0], "radii", ""),
    ],
)  # fmt: skip
def test_bad_parameters_are_named(make, given: object, name: str | None, about: str) -> None:
    with refused(ParameterError, name, about=(about,)):
        make(given)


def test_csv_rows_are_y_and_columns_are_x(tmp_path: Path) -> None:
    path, binary = tmp_path / "ground.csv", tmp_path / "binary.csv"
    path.write_text("0.00, 0.01, 0.02\n\n0.03,0.04,5e-2\n")
    ground = hp.HeightField.from_csv(path, 0.1, origin=(0.0, 0.0))
    assert ground.height_at([0.0, 0.2, 0.1], [0.0, 0.0, 0.1]) == pytest.approx([0.0, 0.02, 0.04])
    for text, place, value in (
        ("0,0\n0,high\n", ", row 2, column 2", "high"),
        ("0,0\n\n0,0,0\n", ", row 3", "3 columns"),
    ):
        path.write_text(text)
        with refused(ParameterError, f"{path}{place}", value):
            hp.HeightField.from_csv(path, 0.1)
    path.write_text("")
    binary.write_bytes(b"\xff\xfe\x00\x01")
    for wrong in (path, binary):
        with refused(ParameterError, "path", str(wrong)):
            hp.HeightField.from_csv(wrong, 0.1)
        with refused(ParameterError, "path", str(wrong)):
            hp.HeightField.from_image(wrong, 0.1, 0.1)


@pytest.mark.parametrize("kind", ["8 bit", "16 bit", "colour"])
def test_image_brightness_is_height(kind: str, tmp_path: Path) -> None:
    """White is `height`, black 0; the top row of the image is the largest y."""
    pixels = np.array([[0, 51], [102, 255]], dtype=np.uint8)
    if kind == "16 bit":
        pixels = pixels.astype(np.uint16) * 257
    if kind == "colour":
        pixels = np.repeat(pixels[..., None], 3, axis=2)
    Image.fromarray(pixels).save(tmp_path / "ground.png")
    field = hp.HeightField.from_image(tmp_path / "ground.png", 0.1, 0.05, origin=(0.0, 0.0))
    assert field.z == pytest.approx(0.05 * np.array([[0.4, 1.0], [0.0, 0.2]]), abs=1e-9)


# heights, gaps and normals against closed forms and brute force


@pytest.mark.parametrize("terrain", [hp.Flat(height=-0.2), SLOPE], ids=["flat", "slope"])
@pytest.mark.parametrize("radius", [0.0, 0.02])
def test_plane_contact_is_its_closed_form(terrain, radius: float) -> None:
    slope = hp.Slope(angle=0.3, heading=math.pi / 2, point=(5.0, 1.0, 2.0))
    assert slope.height_at(-3.0, 2.0) == pytest.approx(2.0 + math.tan(0.3))
    assert slope.normal_at(0, 0) == pytest.approx([0.0, -math.sin(0.3), math.cos(0.3)], abs=1e-15)
    for x, y, gap in [(0.3, -0.4, 0.01), (-2.0, 1.0, -0.003), (1e3, 0.0, 0.0)]:
        normal = terrain.normal_at(x, y)
        center = np.array([x, y, terrain.height_at(x, y)]) + (radius + gap) * normal
        [(found, direction)] = terrain.native().contacts(center, radius)
        assert found == pytest.approx(gap, abs=1e-12)
        assert direction == pytest.approx(normal, abs=1e-15)


def test_heights_of_stairs_ledge_and_groove_and_of_shaken_ground() -> None:
    stairs = hp.Stairs(rise=0.1, run=0.3, count=2, start=0.5, height=1.0)
    x = [-9.0, 0.49, 0.5, 0.79, 0.8, 9.0]
    assert stairs.height_at(x, 0.0) == pytest.approx([1.0, 1.0, 1.1, 1.1, 1.2, 1.2])
    ledge = PROFILES["ledge"]
    assert ledge.height_at(*world(ledge.surface(), 0.19, 0.0, 3.0)[:2]) == pytest.approx(0.1)
    assert ledge.height_at(*world(ledge.surface(), 0.21, 0.0, -3.0)[:2]) == pytest.approx(0.0)
    table = hp.terrain.ShakingGround(amplitude=2e-3, frequency=12.0)
    assert table.lift_at(np.array([1.0 / 48.0, 1.0 / 24.0])) == pytest.approx([2e-3, 0.0])
    groove = hp.terrain.Groove(angle_left=math.pi / 4, angle_right=math.pi / 6, depth=0.1)
    x = np.array([-0.2, -0.1, -0.05, 0.0, 0.1, 0.2])
    expected = [0.0, 0.0, -0.05, -0.1, -0.1 + 0.1 * math.tan(math.pi / 6), 0.0]
    assert groove.height_at(x, 1.0) == pytest.approx(expected, abs=1e-15)
    left, right = groove.normal_at([-0.05, 0.1], 0.0)
    assert left == pytest.approx([math.sqrt(0.5), 0.0, math.sqrt(0.5)])
    assert right == pytest.approx([-0.5, 0.0, math.cos(math.pi / 6)])


@pytest.mark.parametrize("radius", [0.0, 0.02])
@pytest.mark.parametrize("name", PROFILES)
def test_profile_gap_is_the_distance_to_the_nearest_point(name: str, radius: float) -> None:
    """Brute force: spheres everywhere, inside and out, against the surface as a cloud of points."""
    terrain, spacing = PROFILES[name], 5e-5
    line = terrain.surface()
    cloud, native = dense(line, spacing), terrain.native()
    rng = np.random.default_rng(1)
    for _ in range(80):
        s, up, sideways = rng.uniform(-0.3, 0.3), rng.uniform(-0.05, 0.15), rng.uniform(-1, 1)
        s += rng.choice(line.s)
        ground = float(terrain.height_at(*world(line, s, 0.0, sideways)[:2]))
        away = np.hypot(cloud[:, 0] - s, cloud[:, 1] - ground - up).min()
        if away < 3.0 * spacing:
            continue
        touched = native.contacts(world(line, s, ground + up, sideways), radius)
        expected = math.copysign(away, up) - radius
        assert min(gap for gap, _ in touched) == pytest.approx(expected, abs=1e-6)
        for _, normal in touched:
            assert np.linalg.norm(normal) == pytest.approx(1.0, abs=1e-12)
            assert normal @ world(line, 0.0, 0.0, 1.0) == pytest.approx(0.0, abs=1e-12)


def test_sphere_at_faces_edges_and_corners_of_stairs() -> None:
    stairs = hp.Stairs(rise=0.1, run=0.3, count=1)
    native, r = stairs.native(), 0.02
    gap, normal = nearest(stairs, (0.2, 0.5, 0.125), r)
    assert (gap, *normal) == pytest.approx((0.005, 0.0, 0.0, 1.0))
    gap, normal = nearest(stairs, (-0.023, 0.0, 0.06), r)
    assert (gap, *normal) == pytest.approx((0.003, -1.0, 0.0, 0.0))
    gap, normal = nearest(stairs, (-0.03, 0.0, 0.14), r)  # 3-4-5 from the edge at z = 0.1
    assert (gap, *normal) == pytest.approx((0.03, -0.6, 0.0, 0.8))
    corner = native.contacts(np.array([-0.019, 0.0, 0.018]), r)
    found = sorted((round(gap, 12), *np.round(normal, 12)) for gap, normal in corner)
    assert found == [(-0.002, 0.0, 0.0, 1.0), (-0.001, -1.0, 0.0, 0.0)]
    # a point foot: inside, the nearest face pushes
    for x in (-0.004, 0.004):
        gap, normal = nearest(stairs, (x, 0.0, 0.05), 0.0)
        assert (gap, *normal) == pytest.approx((-x, -1.0, 0.0, 0.0))
    gap, normal = nearest(stairs, (0.003, 0.0, -0.004), 0.0)  # under the foot of the riser
    assert (gap, *normal) == pytest.approx((-0.005, -0.6, 0.0, 0.8))


def test_many_points_on_a_line_act_as_one_face() -> None:
    many = Polyline(0.0, tuple(np.linspace(-1.0, 1.0, 21)), tuple(np.linspace(-0.3, 0.3, 21)))
    slope = hp.Slope(angle=math.atan(0.3))
    for x in (0.0, 0.1, 0.13, 0.2):
        center = np.array([x, 0.0, 0.3 * x + 0.02])
        touched = many.native().contacts(center, 0.02)
        assert len(touched) == 1
        assert touched[0][0] == pytest.approx(nearest(slope, center, 0.02)[0], abs=1e-12)


@pytest.mark.parametrize("name", PROFILES)
def test_turning_the_heading_turns_the_contacts(name: str) -> None:
    terrain, extra = PROFILES[name], 1.1
    turned = terrain.model_copy(update={"heading": terrain.heading + extra})
    turn = Rotation.from_rotvec([0.0, 0.0, extra]).as_matrix()
    line = terrain.surface()
    for s in np.linspace(line.s[0] - 0.1, line.s[-1] + 0.1, 23):
        center = world(line, s, 0.03)
        plain = terrain.native().contacts(center, 0.02)
        beside = turned.native().contacts(turn @ center, 0.02)
        for (gap, normal), (other, aside) in zip(plain, beside, strict=True):
            assert other == pytest.approx(gap, abs=1e-12)
            assert aside == pytest.approx(turn @ normal, abs=1e-9)


def test_hills_pass_through_their_points_and_run_out_to_level() -> None:
    z = np.random.default_rng(0).uniform(-0.01, 0.01, (5, 7))
    field = hp.HeightField.from_array(z, (0.1, 0.2), origin=(3.0, -1.0))
    x, y = np.meshgrid(3.0 + 0.1 * np.arange(7), -1.0 + 0.2 * np.arange(5))
    assert field.height_at(x, y) == pytest.approx(z, abs=1e-15)
    far = field.height_at([2.9, 0.0, 3.7, 9.0], [-0.8, -0.8, -0.8, -0.8])
    assert far == pytest.approx([z[1, 0], z[1, 0], z[1, 6], z[1, 6]], abs=1e-15)
    edge = [field.normal_at(x, -0.7) for x in (2.9 - 1e-9, 2.9 + 1e-9, 3.0 - 1e-9, 3.0 + 1e-9)]
    assert edge[0] == pytest.approx(edge[1], abs=1e-7)  # no kink where the field begins
    assert edge[2] == pytest.approx(edge[3], abs=1e-7)


@pytest.mark.parametrize(("radius", "gap"), [(0.0, -1e-3), (0.02, 1e-3)])
def test_hills_push_along_the_gradient_of_the_gap(radius: float, gap: float) -> None:
    """A force along the normal stores energy in the gap: the normal is the gap's gradient."""
    native, step = HILLS.native(), 1e-6
    for x, y in places(20, reach=0.9):
        center = np.array([x, y, float(HILLS.height_at(x, y))])
        center += (radius + gap) * HILLS.normal_at(x, y)
        [(found, normal)] = native.contacts(center, radius)
        rise = [
            native.contacts(center + e, radius)[0][0] - native.contacts(center - e, radius)[0][0]
            for e in step * np.eye(3)
        ]
        # the search ends at 1e-14 m, seen through a difference of 2e-6 m
        assert np.array(rise) / (2.0 * step) == pytest.approx(normal, abs=1e-7)
        assert found == pytest.approx(gap, abs=1e-12)
