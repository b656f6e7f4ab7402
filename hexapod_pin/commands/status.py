"""Exit status: 0 done, 2 refused or failed with one message on stderr, 130 interrupted."""

from __future__ import annotations

import sys
from typing import NoReturn

import typer

FAILED = 2
INTERRUPTED = 130


def fail(message: str, status: int) -> NoReturn:
    """Print one message on stderr and exit."""
    typer.echo(f"hexapod-pin: {message}", err=True)
    sys.exit(status)
