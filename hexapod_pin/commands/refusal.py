"""A refused URDF as a few lines: faults of many parts as one, and the command that goes on."""

from __future__ import annotations

from hexapod_pin.errors import HexapodError, UrdfError

SHOWN = 3
"""Parts that are named for one fault."""


def refusal_text(error: UrdfError, command: str, options: set[str]) -> str:
    """Return why a file is refused, and what to type next.

    Args:
        error: with several findings.
        command: that met it, such as "walk".
        options: that it has.
    """
    from hexapod_pin.robot.urdf_report import folded_texts
    from hexapod_pin.text_table import folded

    lines = [line for text in folded_texts(error.findings, SHOWN) for line in folded(text, "  ")]
    return "\n".join(
        [f"{error.source} is refused:", *lines, _next_command(error.source, command, options)]
    )


def _next_command(source: str, command: str, options: set[str]) -> str:
    """Return the command that goes on: with a repair, where that makes the file usable."""
    from hexapod_pin.robot.urdf_report import inspect

    try:
        usable = not inspect(source).left
    except HexapodError:
        usable = False
    if not usable:
        return f"no repair changes that; next: hexapod-pin check {source}"
    if "--repair" in options:
        return f"next: hexapod-pin {command} {source} --repair"
    return f"next: hexapod-pin repair {source} -o repaired.urdf"
