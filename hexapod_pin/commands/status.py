"""Exit status: 0 done, 2 refused or failed, 3 ran but does not walk, 130 interrupted.

Each but 0 leaves one message on stderr.
"""

from __future__ import annotations

import sys
from typing import NoReturn

import typer

FAILED = 2
DOES_NOT_WALK = 3
INTERRUPTED = 130


def fail(message: str, status: int) -> NoReturn:
    """Print one message on stderr and exit."""
    typer.echo(f"hexapod-pin: {message}", err=True)
    sys.exit(status)
