"""Exit status: 0 done, 1 missed, 2 refused or failed, 3 ran with a bad result, 130 interrupted.

1: a row of a table that was run missed its number, or met one registered as an expected failure.
3: a robot does not walk, or no motor passes. Each status but 0 leaves one message on stderr.
"""

from __future__ import annotations

import sys
from typing import NoReturn

import typer

MISSED = 1
FAILED = 2
DOES_NOT_WALK = 3
NONE_PASSES = 3
INTERRUPTED = 130


def fail(message: str, status: int) -> NoReturn:
    """Print one message on stderr and exit."""
    typer.echo(f"hexapod-pin: {message}", err=True)
    sys.exit(status)
