"""The commands of `hexapod-pin`, each in its own module.

Only what a command needs is imported, when it runs, so that `--help` is quick.
"""

from __future__ import annotations

import io
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from copy import copy
from functools import cache
from typing import Annotated, Any, NoReturn

import typer
import typer.main
from typer.core import TyperCommand, TyperGroup

from hexapod_pin.commands.compare import compare
from hexapod_pin.commands.contact import contact
from hexapod_pin.commands.evidence_commands import bench, verify
from hexapod_pin.commands.export import export
from hexapod_pin.commands.options import in_options, option_names
from hexapod_pin.commands.refusal import refusal_text
from hexapod_pin.commands.resources import require_resources
from hexapod_pin.commands.select import select
from hexapod_pin.commands.sweep import sweep
from hexapod_pin.commands.terminal import (
    FAILED,
    INTERRUPTED_TEXT,
    columns,
    echo,
    fail,
    interrupted_status,
    remember_command,
)
from hexapod_pin.commands.trace_commands import budget, stability, view
from hexapod_pin.commands.urdf_commands import check, repair
from hexapod_pin.commands.walk import run, walk
from hexapod_pin.errors import HexapodError, SimulationInterrupted, UrdfError
from hexapod_pin.stop_signals import begin, received
from hexapod_pin.text_table import fit_tables
from hexapod_pin.user_file import outputs_of_command

_ClickError: Any = next(x for x in typer.BadParameter.__mro__ if x.__name__ == "ClickException")
"""Of click, or of the copy of click that newer releases of typer contain."""


@contextmanager
def _usage_errors() -> Iterator[None]:
    """Print errors of a command line, which quote its arguments, as everything else is printed."""
    try:
        yield
    except _ClickError as error:
        _name_options(error)
        text = io.StringIO()
        error.show(file=text)
        echo(text.getvalue().removesuffix("\n"), err=True)
        sys.exit(error.exit_code)


def _name_options(error: Any) -> None:
    """Have an error of an unknown short option name those that begin with its letter."""
    name, context = getattr(error, "option_name", ""), getattr(error, "ctx", None)
    if context is not None and len(name) == len("-o") and hasattr(error, "possibilities"):
        options = [text for one in context.command.params for text in one.opts]
        error.possibilities = [text for text in options if text.startswith(f"-{name}")]


class _Commands(TyperGroup):
    """Turns errors into one message, and Ctrl-C differs from typer's own silent exit."""

    def make_context(self, *args: Any, **named: Any) -> Any:
        """Read what stands before the command's name."""
        with _usage_errors():
            return super().make_context(*args, **named)

    def invoke(self, ctx: Any) -> Any:
        """Run the command requested."""
        begin()
        try:
            with _usage_errors(), outputs_of_command(), fit_tables(columns()):
                return super().invoke(ctx)
        except KeyboardInterrupt:
            fail(INTERRUPTED_TEXT, interrupted_status())
        except HexapodError as error:
            command = self.get_command(ctx, ctx.invoked_subcommand or "")
            text = in_options(error, option_names(command))
            if isinstance(error, UrdfError) and len(error.findings) > 1:
                options = {name for one in getattr(command, "params", ()) for name in one.opts}
                text = refusal_text(error, ctx.invoked_subcommand or "", options)
            if isinstance(error, SimulationInterrupted) or received() is not None:
                fail(" ".join(text.split()), interrupted_status())
            fail(text, FAILED)


class _Command(TyperCommand):
    """A command that begins where the system gives what it needs."""

    def invoke(self, ctx: Any) -> Any:
        """Run the command."""
        require_resources()
        return super().invoke(ctx)


app = typer.Typer(
    cls=_Commands,
    help="Walk a hexapod's URDF on compliant feet: the torque of every joint, a trace, a playback. "
    "SI units, but angles are in degrees on the command line.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # units stand in square brackets, which rich would take for markup
)


def _version(requested: bool) -> None:
    if requested:
        from importlib.metadata import version

        echo(f"hexapod-pin {version('hexapod-pin')}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print and exit.")
    ] = False,
) -> None:
    pass


for _command in (
    walk, run, compare, sweep, view, budget, select, stability, check, repair, export, contact,
    bench, verify,
):  # fmt: skip
    app.command(cls=_Command)(_command)


START = """\
Walk a hexapod's URDF on compliant feet. What to type:

  walk my robot          hexapod-pin walk robot.urdf
  which motor            hexapod-pin select robot.urdf
  compare controllers    hexapod-pin compare a.toml b.toml    (walk --save-case)
  many walks             hexapod-pin sweep study.toml
  look at a run          hexapod-pin view walk.nc

Two robots are included: kharagpur and athena. All commands: hexapod-pin --help
"""
"""What is printed without a command."""


def main(argv: Sequence[str] | None = None) -> NoReturn:
    """Run a command and exit; every error of this package becomes one message.

    Args:
        argv: arguments without the program's name; None takes those of the process.
    """
    arguments = sys.argv[1:] if argv is None else list(argv)
    remember_command(arguments)
    if not arguments:
        echo(START)
        sys.exit(0)
    _commands(*arguments[:1])(args=arguments, prog_name="hexapod-pin")
    sys.exit(0)


@cache
def _commands(name: str = "") -> Any:
    """Return the commands with their options, made once per process.

    Args:
        name: of the only command that is needed: the options of all take 0.05 s to make. All are
            made where no command has that name.
    """
    needed = copy(app)
    found = [
        one for one in app.registered_commands if getattr(one.callback, "__name__", "") == name
    ]
    needed.registered_commands = found or app.registered_commands
    return typer.main.get_command(needed)
