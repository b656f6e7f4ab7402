"""What draws an object where a notebook shows it: a room above its own, which the package names.

The rooms of robots, scenes and results know nothing of pictures. The package itself, above all
rooms, states here how its room of pictures is reached; it is loaded when something is drawn.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

_rooms: list[Callable[[], Any]] = []


def draw_with(room: Callable[[], Any]) -> None:
    """State how the room is reached that draws what notebooks show."""
    _rooms[:] = [room]


def drawn(name: str, thing: object) -> Any:
    """Return what a function or class of that room makes of a thing.

    Args:
        name: one of its public names.
        thing: to be shown.
    """
    return getattr(_rooms[0](), name)(thing)
