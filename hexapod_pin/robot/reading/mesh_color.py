"""The mean colour of one geometry that trimesh has read."""

from __future__ import annotations

from typing import Any

import numpy as np

from hexapod_pin.arrays import Array

Rgba = tuple[float, float, float, float]


def mean_color(geometry: Any) -> Rgba | None:
    """Return the mean colour over a geometry's faces or texture, from 0 to 1; None without any."""
    visual = geometry.visual
    if getattr(visual, "material", None) is not None:
        return _of_material(visual.material)
    if getattr(visual, "kind", None) in ("face", "vertex"):
        areas = np.asarray(geometry.area_faces, dtype=np.float64)
        colors = np.asarray(visual.face_colors, dtype=np.float64) / 255.0
        weights = areas if areas.sum() > 0.0 else np.ones(len(areas))
        return _rgba(weights @ colors / weights.sum())
    return None


def _of_material(material: Any) -> Rgba | None:
    """Return the colour of a material: its texture's mean, or its diffuse or base colour."""
    factor = _factor(material)
    for name in ("baseColorTexture", "image"):
        image = getattr(material, name, None)
        if image is not None:
            pixels = np.asarray(image.convert("RGBA"), dtype=np.float64) / 255.0
            mean = pixels.reshape(-1, 4).mean(axis=0)
            return _rgba(
                mean * factor if name == "baseColorTexture" and factor is not None else mean
            )
    return None if factor is None else _rgba(factor)


def _factor(material: Any) -> Array | None:
    """Return a material's plain colour; None where it states none."""
    for name in ("baseColorFactor", "diffuse"):
        value = getattr(material, name, None)
        if value is not None:
            color = np.asarray(value)
            color = color / 255.0 if color.dtype.kind in "ui" else color.astype(np.float64)
            return np.append(color[:3], color[3] if len(color) > 3 else 1.0)
    return None


def _rgba(color: Array) -> Rgba:
    red, green, blue, alpha = (float(value) for value in color)
    return red, green, blue, alpha
