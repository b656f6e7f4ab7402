"""Grounds from files, and what is refused: every message names its culprit."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError
from hexapod_pin.ground.terrain import read_terrain
from hexapod_pin.ground.terrain.ground import FARTHEST_M

HILLS = hp.HeightField.random(3, amplitude=0.02, wavelength=0.3, size=2.0)


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
