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

HILLS = hp.HeightField.random(3, amplitude=0.02, wavelength=0.3, size=2.0)


# --- what is refused ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("data", "named"),
    [
        ({"kind": "lava"}, "terrain.kind"),
        ({}, "terrain.kind"),
        ({"kind": "flat", "height": math.nan}, "Flat.height"),
        ({"kind": "slope", "angle": 1.1}, "Slope.angle"),
        ({"kind": "slope", "angle": math.inf}, "Slope.angle"),
        ({"kind": "stairs", "rise": -0.1, "run": 0.3, "count": 1}, "Stairs.rise"),
        ({"kind": "stairs", "rise": 0.1, "run": 0.0, "count": 1}, "Stairs.run"),
        ({"kind": "stairs", "rise": 0.1, "run": 0.3, "count": 0}, "Stairs.count"),
        ({"kind": "ledge", "height": 0.0}, "Ledge.height"),
        ({"kind": "groove", "angle_left": 0.0, "angle_right": 0.5}, "Groove.angle_left"),
        ({"kind": "groove", "angle_left": 0.5, "angle_right": 1.2}, "Groove.angle_right"),
        ({"kind": "shaken", "amplitude": 0.1, "frequency": 0.0}, "ShakingGround.frequency"),
        ({"kind": "shaken", "amplitude": 0.1}, "ShakingGround.frequency"),
        ({"kind": "patched", "ground": {"kind": "flat"}, "patches": []}, "PatchedGround.patches"),
        ({"kind": "patched", "ground": {"kind": "slope", "angle": 3.0}, "patches": []}, "angle"),
        ({**HILLS.model_dump(), "heights": "AAAA"}, "HeightField.heights"),
        ({**HILLS.model_dump(), "heights": "not base64!"}, "HeightField.heights"),
        ({**HILLS.model_dump(), "spacing": [0.1, 0.0]}, "HeightField.spacing"),
    ],
)
def test_bad_parameters_are_named(data: dict, named: str) -> None:
    with pytest.raises(ParameterError, match=named):
        read_terrain(data)


def test_a_patch_must_have_an_area() -> None:
    with refused(ParameterError, "Patch"):
        hp.Patch(low=(0.0, 0.0), high=(1.0, 0.0))


@pytest.mark.parametrize(
    ("z", "named"),
    [
        ([[0.0, 1.0], [0.0]], "rectangle"),
        ([[0.0, 0.0]], "shape"),
        ([0.0, 1.0], "shape"),
        ([["a", 0.0], [0.0, 0.0]], "rectangle"),
        ([[0.0, 0.0], [0.0, math.nan]], r"z\[1, 1\]"),
        ([[0.0, 0.0], [0.0, math.inf]], r"z\[1, 1\]"),
        ([[0.0, 0.0, 0.2], [0.0, 0.0, 0.2]], r"after \[0, 1\].*deg"),
    ],
)
def test_bad_heights_are_named(z, named: str) -> None:
    with pytest.raises(ParameterError, match=named):
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
    ("text", "named"),
    [
        ("0,0\n0,high\n", "row 2, column 2"),
        ("0,0\n0,nan\n", "row 2, column 2"),
        ("0,0\n0,\n", "row 2, column 2"),
        ("0,0\n\n0,0,0\n", "row 3"),
        ("", "empty"),
        ("0;0\n0;0\n", "row 1, column 1"),
    ],
)
def test_bad_csv_names_row_and_column(text: str, named: str, tmp_path: Path) -> None:
    path = tmp_path / "ground.csv"
    path.write_text(text)
    with pytest.raises(ParameterError, match=named):
        hp.HeightField.from_csv(path, 0.1)


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
