"""Scenes: robot, ground, contact, drives, gravity and loads as data."""

from hexapod_pin.scene.loads import LostLeg, MassFactor, Payload, Push, RemovedMass
from hexapod_pin.scene.scene import Scene, loaded_model
from hexapod_pin.scene.settings import SceneSettings

__all__ = [
    "LostLeg",
    "MassFactor",
    "Payload",
    "Push",
    "RemovedMass",
    "Scene",
    "SceneSettings",
    "loaded_model",
]
