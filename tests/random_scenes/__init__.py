"""Scenes drawn at random: robots and free bodies, all laws, all grounds, all ways to move."""

from random_scenes.generator import KINDS, draw_scene
from random_scenes.scene import PromiseScene, SceneLabels

__all__ = ["KINDS", "PromiseScene", "SceneLabels", "draw_scene"]
