"""Patches and shaking, standing on any ground, refusals, TOML."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import tomli_w
import vehicles
from grounds import ALL, HILLS, PATCHED, SHAKEN, SLOPE, STAIRS
from PIL import Image
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError
from hexapod_pin.ground.terrain import read_terrain
from hexapod_pin.ground.terrain.ground import FARTHEST_M
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
    """Force and both derivatives, a tenth of the friction and a quarter of the stiffness."""
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


def test_shaken_ground_moves_by_its_formula() -> None:
    table = hp.terrain.ShakingGround(amplitude=2e-3, frequency=12.0)
    time = np.array([0.0, 1.0 / 48.0, 1.0 / 24.0])
    assert table.lift_at(time) == pytest.approx([0.0, 2e-3, 0.0], abs=1e-15)
    assert table.height_at(1.0, 2.0) == 0.0


@pytest.mark.parametrize("name", ALL)
def test_lift_leaves_no_clearance(name: str) -> None:
    """After the lift the lowest sphere touches and none penetrates, wherever they started."""
    terrain, rng = ALL[name], np.random.default_rng(5)
    radii = np.array([0.02, 0.0, 0.03])
    for height in (-0.5, 0.0, 2.0):
        points = np.column_stack([rng.uniform(-1.0, 1.0, (3, 2)), np.full(3, height)])
        up = terrain.lift(points, radii)
        assert terrain.clearance(points + (0.0, 0.0, up), radii) == pytest.approx(0.0, abs=2e-12)
        lower = terrain.clearance(points + (0.0, 0.0, up - 1e-6), radii)
        assert lower <= 1e-12


@pytest.mark.parametrize(
    ("points", "radii", "name"),
    [
        ([[0, 0, math.nan]], 0.0, "points[0, 2]"),
        ([[0, 0, 0]], [1.0, 2.0], "radii"),
        ([[0, 0, "x"]], 0.0, "Ground.clearance.points"),
    ],
)
def test_clearance_refuses_what_is_no_sphere(points, radii, name: str) -> None:
    with refused(ParameterError, name):
        STAIRS.clearance(points, radii)


def test_toml_gives_the_same_ground_back() -> None:
    for terrain in ALL.values():
        assert read_terrain(read_toml(tomli_w.dumps(terrain.model_dump()))) == terrain
    assert np.array_equal(read_terrain(HILLS.model_dump()).z, HILLS.z)  # every bit
    scene = hp.Scene(hp.load_robot("athena"), terrain=SHAKEN)
    assert hp.Scene.from_toml(scene.to_toml()).terrain == SHAKEN


@pytest.mark.parametrize(
    ("data", "name", "value"),
    [
        ({"kind": "lava"}, "terrain.kind", "lava"),
        ({"kind": "slope", "angle": 1.1}, "Slope.angle", 1.1),
        ({"kind": "stairs", "rise": 0.1, "run": 0.3, "count": 0}, "Stairs.count", 0),
        ({"kind": "ledge", "height": 0.0}, "Ledge.height", 0.0),
        ({"kind": "groove", "angle_left": 0.5, "angle_right": 1.2}, "Groove.angle_right", 1.2),
        (
            {"kind": "patched", "ground": {"kind": "flat"}, "patches": []},
            "PatchedGround.patches",
            [],
        ),
        ({**HILLS.model_dump(), "heights": "AAAA"}, "HeightField.heights", "AAAA"),
        ({**HILLS.model_dump(), "spacing": [0.1, 0.0]}, "HeightField.spacing[1]", 0.0),
    ],
)
def test_bad_parameters_are_named(data: dict, name: str, value: object) -> None:
    with refused(ParameterError, name, value):
        read_terrain(data)


def test_patches_without_area_and_hills_without_length_are_refused() -> None:
    with pytest.raises(ParameterError):
        hp.HeightField.random(1, wavelength=0.0)
    with pytest.raises(ParameterError):
        hp.HeightField.random(1, wavelength=1e-5)
    with refused(ParameterError, "Patch", about=("(0.0, 0.0)", "(1.0, 0.0)")):
        hp.terrain.Patch(low=(0.0, 0.0), high=(1.0, 0.0))


@pytest.mark.parametrize(
    ("z", "name", "allowed", "about"),
    [
        ([[0.0, 0.0]], "HeightField.z", (2,), ("(1, 2)",)),
        ([["a", 0.0], [0.0, 0.0]], "HeightField.z", (2,), ()),
        ([[0.0, 0.0], [0.0, math.nan]], "HeightField.z[1, 1]", (FARTHEST_M,), ("nan",)),
        ([[0.0, 0.0, 0.2], [0.0, 0.0, 0.2]], "HeightField.z[0, 1]", (60,), ("63.4 deg",)),
    ],
)
def test_bad_heights_are_named(
    z, name: str, allowed: tuple[float, ...], about: tuple[str, ...]
) -> None:
    with refused(ParameterError, name, allowed=allowed, about=about):
        hp.HeightField.from_array(z, 0.1)


def test_csv_rows_are_y_and_columns_are_x(tmp_path: Path) -> None:
    path = tmp_path / "ground.csv"
    path.write_text("0.00, 0.01, 0.02\n\n0.03,0.04,5e-2\n")
    field = hp.HeightField.from_csv(path, 0.1, origin=(0.0, 0.0))
    assert field.shape == (2, 3)
    assert field.height_at([0.0, 0.2, 0.1], [0.0, 0.0, 0.1]) == pytest.approx([0.0, 0.02, 0.04])


@pytest.mark.parametrize(
    ("text", "place", "value"),
    [
        ("0,0\n0,high\n", "row 2, column 2", "high"),
        ("0,0\n\n0,0,0\n", "row 3", "3 columns"),
    ],
)
def test_bad_csv_names_row_and_column(text: str, place: str, value: str, tmp_path: Path) -> None:
    path = tmp_path / "ground.csv"
    path.write_text(text)
    with refused(ParameterError, f"{path}, {place}", value):
        hp.HeightField.from_csv(path, 0.1)


def test_unreadable_files_are_refused(tmp_path: Path) -> None:
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00\x01")
    (tmp_path / "empty.csv").touch()
    for name in ("missing", "binary.csv", "empty.csv"):
        with refused(ParameterError, "path", str(tmp_path / name)):
            hp.HeightField.from_csv(tmp_path / name, 0.1)
        with refused(ParameterError, "path", str(tmp_path / name)):
            hp.HeightField.from_image(tmp_path / name, 0.1, 0.1)


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
