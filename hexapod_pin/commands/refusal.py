"""A refused URDF as a few lines: faults of many parts as one, and the command that goes on."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from hexapod_pin.errors import GaitError, HexapodError, UrdfError

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot

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
    head = folded(f"{PROGRAM}{error.source} is refused: {_kinds(error.findings)}")
    head[0] = head[0].removeprefix(PROGRAM)
    return "\n".join([*head, *lines, _next_command(error.source, command, options)])


PROGRAM = "hexapod-pin: "
"""What stands before a refusal in its first line."""


@contextmanager
def doubtful_file(robot: Robot, option: str = "") -> Iterator[None]:
    """Put what is doubtful in a robot's file first, where its walk is refused: it may be why.

    Args:
        robot: that is to walk.
        option: what is doubtful in an option, in a few words; goes before the file.

    Raises:
        GaitError: what was raised, behind the first doubt.
    """
    try:
        yield
    except GaitError as error:
        doubts = [option] if option else robot.doubts
        if not doubts:
            raise
        cure = "" if option or robot.options.get("repair") else " Try --repair."
        text = f"{robot.name}: {doubts[0]}. {error}{cure}"
        raise GaitError(text, error.quantity, error.limit) from error


MOST_KINDS = 3
"""Kinds of fault in the first line."""


def _kinds(findings: Sequence[str]) -> str:
    """Return the kinds of faults, each with the number of its places."""
    counts = Counter(_kind(text) for text in findings)
    named = [f"{kind} ({n})" if n > 1 else kind for kind, n in counts.most_common(MOST_KINDS)]
    more = len(counts) - len(named)
    return ", ".join(named) + (f" and {more} more" if more else "")


def _kind(text: str) -> str:
    """Return the kind of a finding: between the place and the value of one of `find_all`."""
    parts = text.split(": ")
    placed = len(parts) > 2 and parts[0].partition(" ")[0] in PLACES
    named = " " not in parts[0]  # of one part, as in "lf_tibia: mass 3 kg, 0.11 kg in other legs"
    kind = parts[1] if placed else ": ".join(parts[:2]) if named else parts[0]
    kind = kind.partition(". ")[0]
    return kind if len(kind) <= LONGEST_KIND else kind[: LONGEST_KIND - 3].rstrip() + "..."


PLACES = ("robot", "link", "links", "joint", "joints", "mesh", "material")
"""How the place of a finding begins."""

LONGEST_KIND = 50
"""Characters of a kind."""


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
        output = " OUT" if command == "export" else ""
        return f"next: hexapod-pin {command} {source}{output} --repair"
    return f"next: hexapod-pin repair {source} -o repaired.urdf"
