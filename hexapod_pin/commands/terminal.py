"""The one place through which commands print."""

from __future__ import annotations

import typer

from hexapod_pin.foreign_text import visible


def echo(text: str = "", *, err: bool = False) -> None:
    """Print a text and a newline; characters that a terminal would act on become visible escapes.

    Args:
        text: what to print.
        err: whether on stderr; else on stdout.
    """
    typer.echo(visible(text), err=err)
