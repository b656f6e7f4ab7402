"""A refused URDF as a few lines: faults of many parts as one, and the command that goes on."""

from __future__ import annotations

import textwrap

from hexapod_pin.errors import HexapodError, UrdfError

WIDTH = 80
"""Longest line [characters]."""

SHOWN = 4
"""Parts that are named for one fault; more are counted."""


def refusal_text(error: UrdfError, command: str, options: set[str]) -> str:
    """Return why a file is refused, and what to type next.

    Args:
        error: with several findings.
        command: that met it, such as "walk".
        options: that it has.
    """
    lines = [f"{error.source} is refused:"]
    for parts, fault in grouped(error.findings):
        lines += textwrap.wrap(
            f"{parts}: {fault}" if parts else fault, WIDTH, initial_indent="  ",
            subsequent_indent="    ", break_long_words=False, break_on_hyphens=False,
        )  # fmt: skip
    return "\n".join([*lines, _next_command(error.source, command, options)])


def grouped(findings: list[str]) -> list[tuple[str, str]]:
    """Return faults with the parts that have them, each once, in order.

    Args:
        findings: sentences "part: fault".
    """
    places: dict[str, list[str]] = {}
    for text in findings:
        place, separator, fault = text.partition(": ")
        places.setdefault(fault if separator else text, []).append(place if separator else "")
    return [(_parts([part for part in parts if part]), fault) for fault, parts in places.items()]


def _parts(parts: list[str]) -> str:
    """Return the names of parts, of which only some are written."""
    if len(parts) <= SHOWN:
        return ", ".join(parts)
    kind = parts[0].partition(" ")[0]
    names = ", ".join(part.partition(" ")[2] for part in parts[: SHOWN - 1])
    return f"{len(parts)} {kind}s ({names}, ...)"


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
