"""Arguments and options that several commands take.

typer reads these annotations at run time, on Python 3.10 too: Optional[...], not `| None`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Optional

import typer

from hexapod_pin.errors import ParameterError

OptionalFloat = Optional[float]  # noqa: UP045
OptionalText = Optional[str]  # noqa: UP045
OptionalPath = Optional[Path]  # noqa: UP045
OptionalPaths = Optional[list[Path]]  # noqa: UP045
OptionalTexts = Optional[list[str]]  # noqa: UP045

RobotName = Annotated[
    str, typer.Argument(help="kharagpur, athena, or the path of a URDF or xacro file.")
]
PackagePath = Annotated[
    OptionalPaths,
    typer.Option("--package-path", help="A folder with packages or meshes; repeatable."),
]
XacroArgs = Annotated[
    OptionalTexts, typer.Option("--xacro-arg", help="NAME=VALUE for a xacro file; repeatable.")
]
TracePath = Annotated[Path, typer.Argument(help="A file that `walk` left (walk.nc).")]
TraceOut = Annotated[
    Path,
    typer.Option(help="Trace file to write: .nc, .h5, .hdf5; or .csv, .csv.gz as a plain table."),
]
Record = Annotated[
    OptionalText,
    typer.Option(
        help="Samples to keep, separated by commas: torque, set_points, contacts, com, energy; "
        "motion alone for none of them. Default: all."
    ),
]
Feet = Annotated[
    OptionalText,
    typer.Option(help="Names of the foot links, separated by commas, where not found by name."),
]
NoHtml = Annotated[bool, typer.Option("--no-html", help="Write no playback.")]
Verdict = Annotated[
    bool,
    typer.Option(
        "--verdict",
        help="Compute the peaks again, finer and with stiffer contact and servos: which hold?",
    ),
]
Threads = Annotated[int, typer.Option(help="Runs at a time, of those that are repeated.")]
Force = Annotated[
    bool,
    typer.Option("--force", help="Run it whatever it needs: no limits of steps, memory or work."),
]
Quick = Annotated[
    bool,
    typer.Option(
        "--quick",
        help="Leave out the two runs that show how far peaks depend on assumed servo gains.",
    ),
]
FootRadius = Annotated[
    OptionalFloat,
    typer.Option(help="Radius of all foot spheres [m]; default: the URDF's own."),
]


def given(**fields: float | None) -> dict[str, float]:
    """Return the fields that are not None."""
    return {name: value for name, value in fields.items() if value is not None}


def comma_list(text: str | None) -> list[str] | None:
    """Return the parts of a comma-separated list; None of nothing."""
    return None if text is None else [part.strip() for part in text.split(",")]


def foot_names(text: str | None) -> list[str] | None:
    """Return the names in a comma-separated list.

    Raises:
        ParameterError: a name is empty or given twice.
    """
    names = comma_list(text)
    if names is None:
        return None
    if not all(names) or len(set(names)) < len(names):
        raise ParameterError("--feet", text, "different link names, separated by commas")
    return names
