"""Patches and shaking, standing on any ground, refusals, TOML."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from grounds import ALL, HILLS, PATCHED, SHAKEN, SLOPE, STAIRS
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError
from hexapod_pin.ground.terrain import read_terrain
from hexapod_pin.ground.terrain.ground import FARTHEST_M
from hexapod_pin.native import evaluate
from hexapod_pin.simulation.plant import native_plant
from hexapod_pin.spec import read_toml

# --- overlays -----------------------------------------------------------------------------------


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


def test_patch_scales_friction_and_stiffness_in_a_run(tmp_path: Path) -> None:
    """A particle on a patch: a quarter of the stiffness, and it slides on where mu is a tenth."""
    import vehicles

    robot = vehicles.particle(tmp_path)
    contact = hp.Contact(
        normal=hp.contact.HuntCrossley(stiffness=1e6, dissipation=20.0),
        friction=hp.contact.TanhCoulomb(mu=0.5, slope=1e3),
    )
    patch = hp.terrain.Patch(low=(-5.0, -5.0), high=(5.0, 5.0), friction=0.1, stiffness=0.25)
    for terrain, mu, softness in (
        (hp.Flat(), 0.5, 1.0),
        (hp.terrain.PatchedGround(ground=hp.Flat(), patches=(patch,)), 0.05, 4.0 ** (2.0 / 3.0)),
    ):
        scene = hp.Scene(robot, terrain=terrain, contact=contact, servo=vehicles.LIMP)
        start = vehicles.state(robot, -softness * (9.81e-6) ** (2.0 / 3.0), (1.0, 0.0, 0.0))
        trace = hp.simulate(
            scene, hp.HoldPosture(), duration=0.1, method="rk4", step=1e-5, sample=0.1,
            initial=start,
        )  # fmt: skip
        assert trace.v[-1, 0] == pytest.approx(1.0 - mu * 9.81 * 0.1, rel=1e-9)
        depth = softness * (9.81e-6) ** (2.0 / 3.0)
        assert trace.foot_gap[-1, 0] == pytest.approx(-depth, rel=1e-9)


@pytest.mark.parametrize(
    "friction",
    [
        (hp.contact.TanhCoulomb(mu=0.5, slope=1e3), hp.contact.TanhCoulomb(mu=0.05, slope=1e3)),
        (hp.contact.SmoothStep(mu_static=0.5, mu_dynamic=0.3, speed=0.02),
         hp.contact.SmoothStep(mu_static=0.05, mu_dynamic=0.03, speed=0.02)),
        (hp.contact.StickSlip(mu=0.5, stiffness=2e4, damping=60.0),
         hp.contact.StickSlip(mu=0.05, stiffness=2e4, damping=60.0)),
    ],
)  # fmt: skip
@pytest.mark.parametrize("u", [(0.0, 0.0, 0.0), (1e-3, -2e-3, -0.1), (0.3, 0.1, 0.05)])
def test_a_patch_equals_ground_of_its_own_coefficients(
    tmp_path: Path, friction: tuple[object, object], u: tuple[float, float, float]
) -> None:
    """Force and both derivatives, a tenth of the friction and a quarter of the stiffness."""
    import vehicles

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


# --- clearance ----------------------------------------------------------------------------------


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


@pytest.mark.parametrize("name", ALL)
def test_a_robot_stands_on_any_ground(name: str) -> None:
    """A run without an initial state starts with the lowest foot touching."""
    scene = hp.Scene(hp.load_robot("kharagpur"), terrain=ALL[name])
    trace = hp.simulate(scene, hp.HoldPosture(), duration=0.0)
    assert trace.foot_gap.min() == pytest.approx(0.0, abs=1e-11)


@pytest.mark.parametrize(
    ("points", "radii", "name"),
    [
        ([[0, 0]], 0.0, "points"),
        ([[0, 0, math.nan]], 0.0, "points[0, 2]"),
        ([[0, 0, 0]], [1.0, 2.0], "radii"),
        ([[0, 0, 0]], -1.0, "radii"),
        ("abc", 0.0, "Ground.clearance.points"),
        ([[0, 0, 0], [0, 0]], 0.0, "Ground.clearance.points"),
        ([[0, 0, "x"]], 0.0, "Ground.clearance.points"),
    ],
)
def test_clearance_refuses_what_is_no_sphere(points, radii, name: str) -> None:
    with refused(ParameterError, name):
        STAIRS.clearance(points, radii)


# --- TOML ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ALL)
def test_toml_gives_the_same_ground_back(name: str) -> None:
    terrain = ALL[name]
    text = tomli_w.dumps(terrain.model_dump())
    assert read_terrain(read_toml(text)) == terrain


def test_scene_carries_its_ground() -> None:
    robot = hp.load_robot("athena")
    for terrain in (HILLS, SHAKEN):
        back = hp.Scene.from_toml(hp.Scene(robot, terrain=terrain).to_toml())
        assert back.terrain == terrain
    assert np.array_equal(read_terrain(HILLS.model_dump()).z, HILLS.z)  # every bit


def test_heights_do_not_flood_a_message() -> None:
    assert len(str(HILLS)) < 200


# Grounds from files, and what is refused: every message names its culprit.


# --- what is refused ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("data", "name", "value"),
    [
        ({"kind": "lava"}, "terrain.kind", "lava"),
        ({}, "terrain.kind", None),
        ({"kind": "flat", "height": math.nan}, "Flat.height", math.nan),
        ({"kind": "slope", "angle": 1.1}, "Slope.angle", 1.1),
        ({"kind": "slope", "angle": math.inf}, "Slope.angle", math.inf),
        ({"kind": "stairs", "rise": -0.1, "run": 0.3, "count": 1}, "Stairs.rise", -0.1),
        ({"kind": "stairs", "rise": 0.1, "run": 0.0, "count": 1}, "Stairs.run", 0.0),
        ({"kind": "stairs", "rise": 0.1, "run": 0.3, "count": 0}, "Stairs.count", 0),
        ({"kind": "ledge", "height": 0.0}, "Ledge.height", 0.0),
        ({"kind": "groove", "angle_left": 0.0, "angle_right": 0.5}, "Groove.angle_left", 0.0),
        ({"kind": "groove", "angle_left": 0.5, "angle_right": 1.2}, "Groove.angle_right", 1.2),
        ({"kind": "shaken", "amplitude": 0.1, "frequency": 0.0}, "ShakingGround.frequency", 0.0),
        ({"kind": "shaken", "amplitude": 0.1}, "ShakingGround.frequency", None),
        (
            {"kind": "patched", "ground": {"kind": "flat"}, "patches": []},
            "PatchedGround.patches",
            [],
        ),
        (
            {"kind": "patched", "ground": {"kind": "slope", "angle": 3.0}, "patches": []},
            "Slope.angle",
            3.0,
        ),
        ({**HILLS.model_dump(), "heights": "AAAA"}, "HeightField.heights", "AAAA"),
        ({**HILLS.model_dump(), "heights": "not base64!"}, "HeightField.heights", "not base64!"),
        ({**HILLS.model_dump(), "spacing": [0.1, 0.0]}, "HeightField.spacing[1]", 0.0),
    ],
)
def test_bad_parameters_are_named(data: dict, name: str, value: object) -> None:
    with refused(ParameterError, name, value):
        read_terrain(data)


def test_a_patch_must_have_an_area() -> None:
    with refused(ParameterError, "Patch", about=("(0.0, 0.0)", "(1.0, 0.0)")):
        hp.terrain.Patch(low=(0.0, 0.0), high=(1.0, 0.0))


@pytest.mark.parametrize(
    ("z", "name", "allowed", "about"),
    [
        ([[0.0, 1.0], [0.0]], "HeightField.z", (2,), ()),
        ([[0.0, 0.0]], "HeightField.z", (2,), ("(1, 2)",)),
        ([0.0, 1.0], "HeightField.z", (2,), ("(2,)",)),
        ([["a", 0.0], [0.0, 0.0]], "HeightField.z", (2,), ()),
        ([[0.0, 0.0], [0.0, math.nan]], "HeightField.z[1, 1]", (FARTHEST_M,), ("nan",)),
        ([[0.0, 0.0], [0.0, math.inf]], "HeightField.z[1, 1]", (FARTHEST_M,), ("inf",)),
        ([[0.0, 0.0, 0.2], [0.0, 0.0, 0.2]], "HeightField.z[0, 1]", (60,), ("63.4 deg",)),
    ],
)
def test_bad_heights_are_named(
    z, name: str, allowed: tuple[float, ...], about: tuple[str, ...]
) -> None:
    with refused(ParameterError, name, allowed=allowed, about=about):
        hp.HeightField.from_array(z, 0.1)


@pytest.mark.parametrize(
    "keywords", [{"wavelength": 0.0}, {"amplitude": -1.0}, {"size": math.nan}, {"wavelength": 1e-5}]
)
def test_bad_random_hills_are_refused(keywords: dict) -> None:
    with pytest.raises(ParameterError):
        hp.HeightField.random(1, **keywords)


# --- files --------------------------------------------------------------------------------------


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
        ("0,0\n0,nan\n", "row 2, column 2", "nan"),
        ("0,0\n0,\n", "row 2, column 2", ""),
        ("0,0\n\n0,0,0\n", "row 3", "3 columns"),
        ("0;0\n0;0\n", "row 1, column 1", "0;0"),
    ],
)
def test_bad_csv_names_row_and_column(text: str, place: str, value: str, tmp_path: Path) -> None:
    path = tmp_path / "ground.csv"
    path.write_text(text)
    with refused(ParameterError, f"{path}, {place}", value):
        hp.HeightField.from_csv(path, 0.1)


def test_an_empty_csv_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "ground.csv"
    path.touch()
    with refused(ParameterError, "path", str(path)) as caught:
        hp.HeightField.from_csv(path, 0.1)
    assert caught.value.__cause__ is None  # it could be read, as text


def test_unreadable_files_are_refused(tmp_path: Path) -> None:
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00\x01")
    (tmp_path / "text.png").write_text("no image")
    for reader in (hp.HeightField.from_csv, lambda p, d: hp.HeightField.from_image(p, d, 0.1)):
        for name in ("missing", "binary.csv", "text.png", "."):
            with pytest.raises(ParameterError):
                reader(tmp_path / name, 0.1)


def write_image(path: Path, pixels: np.ndarray) -> Path:
    from PIL import Image

    Image.fromarray(pixels).save(path)
    return path


@pytest.mark.parametrize("kind", ["8 bit", "16 bit", "colour"])
def test_image_brightness_is_height(kind: str, tmp_path: Path) -> None:
    """White is `height`, black 0; the top row of the image is the largest y."""
    pixels = np.array([[0, 51], [102, 255]], dtype=np.uint8)
    if kind == "16 bit":
        pixels = pixels.astype(np.uint16) * 257
    if kind == "colour":
        pixels = np.repeat(pixels[..., None], 3, axis=2)
    path = write_image(tmp_path / "ground.png", pixels)
    field = hp.HeightField.from_image(path, 0.1, 0.05, origin=(0.0, 0.0))
    assert field.z == pytest.approx(0.05 * np.array([[0.4, 1.0], [0.0, 0.2]]), abs=1e-9)
