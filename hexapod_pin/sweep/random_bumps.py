"""Scenes on random bumps, one per seed."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from hexapod_pin.ground.terrain import HeightField
from hexapod_pin.simulation.scene import Scene


def random_bumps(
    scene: Scene,
    seeds: Iterable[int],
    *,
    amplitude: float,
    wavelength: float,
    length: float,
    flat_radius: float = 0.0,
) -> list[Scene]:
    """Return the scene on a new random ground for each seed.

    Args:
        scene: the robot and all else; its terrain is replaced.
        seeds: one per scene; the same seed gives the same ground.
        amplitude: largest height and depth [m].
        wavelength: typical distance between bumps [m].
        length: way to be walked from the origin, in any direction [m]; the ground is 1 m larger.
        flat_radius: the ground is level up to this distance from the origin [m].

    Raises:
        ParameterError: a length is not positive, the bumps are steeper than 60 degrees, or the
            ground has too many points (a longer wavelength has fewer).
    """
    size = 2.0 * (length + 1.0)
    return [
        replace(
            scene,
            terrain=HeightField.random(
                seed, amplitude=amplitude, wavelength=wavelength, size=size, flat_radius=flat_radius
            ),
        )
        for seed in seeds
    ]
