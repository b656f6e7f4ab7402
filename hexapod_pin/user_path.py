"""A path that a user gave."""

from __future__ import annotations

import os
from pathlib import Path


def user_path(path: str | Path) -> Path:
    """Return a path with its `~` or `~user` expanded; as it is where no such user is known.

    `Path.expanduser` ends in a RuntimeError there.
    """
    try:
        return Path(os.path.expanduser(path))
    except ValueError:  # no name of a user can be looked up that has a NUL in it
        return Path(path)
