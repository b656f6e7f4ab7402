"""`hexapod-pin contact`: print and draw a contact law."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Optional

import typer

from hexapod_pin.commands.options import OptionalPath, OptionalText
from hexapod_pin.commands.terminal import announce, echo
from hexapod_pin.errors import ParameterError


def contact(
    law: Annotated[
        OptionalText,
        typer.Argument(help="accurate, s1, s1-printed, s2, soil, or a kind such as kelvin-voigt."),
    ] = None,
    parameters: Annotated[
        Optional[list[str]],  # noqa: UP045
        typer.Argument(help="Of a kind: name=value, SI; assumed where not given."),
    ] = None,
    restitution: Annotated[
        bool, typer.Option("--restitution", help="Requested against delivered, all laws.")
    ] = False,
    mass: Annotated[float, typer.Option(help="Of the free impact [kg].")] = 0.5,
    speed: Annotated[float, typer.Option(help="Of the free impact [m/s].")] = 0.1,
    out: Annotated[
        OptionalPath,
        typer.Option(help="Figure to write: .png, .svg or .pdf; default contact.png."),
    ] = None,
) -> None:
    """Look at a contact law: its bounce, its restitution, its friction; print and draw them."""
    from hexapod_pin.commands.contact_report import (
        NO_FIGURE,
        answer,
        figure,
        named_law,
        report,
        restitution_table,
    )
    from hexapod_pin.commands.output_files import FIGURES, writable

    if restitution:
        echo(restitution_table())
    if law is None:
        if not restitution:
            raise ParameterError("LAW", law, "named, or --restitution given", "See --help.")
        return
    found = named_law(law, parameters or ())
    path = writable("--out", out or Path("contact.png"), FIGURES, drawn=out is not None)
    echo(answer(law, found, mass=mass, speed=speed))
    echo("\n" + report(found, mass=mass, speed=speed))
    announce(f"drawing {path}")
    if figure(found, path, mass=mass, speed=speed):
        echo(f"wrote {path}")
    else:
        echo(NO_FIGURE, err=True)
