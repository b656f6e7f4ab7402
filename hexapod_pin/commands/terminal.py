"""Commands print in one place, and end with an exit status.

Nothing is imported here that takes time: the first line of a command comes before its libraries.
"""

from __future__ import annotations

import os
import shlex
import sys
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from typing import ClassVar, NoReturn

from hexapod_pin.foreign_text import visible
from hexapod_pin.stop_signals import end, received


def echo(text: str = "", *, err: bool = False) -> None:
    """Print text and a newline; characters that a terminal would act on become visible escapes.

    Lines are folded between words where a terminal, or COLUMNS, is narrower; JSON is not.

    Args:
        text: what to print.
        err: whether on stderr; else on stdout.
    """
    import typer

    settle()
    shown, width = visible(text), columns(err)
    if width and not shown.startswith(("{", "[")):
        shown = "\n".join(part for line in shown.split("\n") for part in fitted(line, width))
    typer.echo(shown, err=err)


NARROWEST = 40
"""Lines are folded to no less than this [characters]."""

STANDS_IN = 4
"""How far what follows of a folded line stands in, beyond its first part [characters]."""


def fitted(line: str, width: int) -> list[str]:
    """Return a line in parts of at most a width, broken between words; columns stay apart."""
    if len(line) <= width:
        return [line]
    if not line.strip("-="):  # below the head of a table
        return [line[:width]]
    import textwrap

    begin = line[: len(line) - len(line.lstrip())]
    return textwrap.wrap(
        line.strip(), max(width, NARROWEST), initial_indent=begin,
        subsequent_indent=begin + STANDS_IN * " ", break_on_hyphens=False,
    )  # fmt: skip


def columns(err: bool = False) -> int:
    """Return the width that lines must fit, of the terminal or as COLUMNS has it; 0: any.

    Args:
        err: whether of stderr; else of stdout.
    """
    stream = sys.stderr if err else sys.stdout
    given = os.environ.get("COLUMNS", "")
    if given.isdigit():
        return int(given)
    try:
        return os.get_terminal_size(stream.fileno()).columns if stream.isatty() else 0
    except (OSError, ValueError):
        return 0


_arguments: list[str] = []


def remember_command(arguments: Sequence[str]) -> None:
    """Keep the arguments of the command that runs, for what it writes."""
    _arguments[:] = arguments


def typed_command() -> str:
    """Return the command that runs as one line, fit to be typed again."""
    return shlex.join(["hexapod-pin", *_arguments])


def announce(text: str) -> None:
    """Print what begins now and has no progress bar, on stderr, where that is a terminal.

    Below it the seconds are counted until something else is printed, see `settle`.
    """
    settle()
    with suppress(OSError):  # as of a terminal that was closed
        if sys.stderr.isatty():
            print(f"{visible(text)} ...", file=sys.stderr, flush=True)
            _Seconds.running = _Seconds()


def settle() -> None:
    """End the count of seconds below the last announcement, and clear its line."""
    if _Seconds.running is not None:
        _Seconds.running.end()
        _Seconds.running = None


class _Seconds:
    """Counts seconds in one line of stderr, from the first full one on."""

    running: ClassVar[_Seconds | None] = None

    def __init__(self) -> None:
        """Begin to count."""
        self._begin, self._stop = time.monotonic(), threading.Event()
        self._lock, self._shown, self._stream = threading.Lock(), False, sys.stderr
        threading.Thread(target=self._count, daemon=True).start()

    def _count(self) -> None:
        while not self._stop.wait(1.0):
            with self._lock, suppress(OSError, ValueError):
                if not self._stop.is_set():
                    seconds = time.monotonic() - self._begin
                    self._stream.write(f"\r  {seconds:.0f} s")
                    self._stream.flush()
                    self._shown = True

    def end(self) -> None:
        """Count no more, and clear the line."""
        with self._lock, suppress(OSError, ValueError):
            self._stop.set()
            if self._shown:
                self._stream.write("\r" + 12 * " " + "\r")
                self._stream.flush()


def announce_command(arguments: Sequence[str]) -> None:
    """Announce the command of a command line, before it is known whether it can be run.

    Libraries take longer to load than a user should wait for a sign: this comes before them. A
    request for help gets no line.
    """
    if arguments and not arguments[0].startswith("-") and "--help" not in arguments:
        announce(f"{arguments[0]}: loading libraries")


# Exit status: 0 done, 1 missed, 2 refused or failed, 3 ran with a bad result, 128 + n a signal.
#
# 1: a row of a table that was run missed its number, or met one registered as an expected failure.
# 3: a robot does not walk, or no motor passes. Each status but 0 leaves one message on stderr.

MISSED = 1
FAILED = 2
DOES_NOT_WALK = 3
NONE_PASSES = 3
INTERRUPTED = 130
"""By Ctrl-C; other signals have their own: see `interrupted_status`."""

INTERRUPTED_TEXT = "interrupted; what was written before is whole"

DONE_TEXT = "stop requested at the end of the command; its work is done"
"""Of a signal that came too late, or that a command took for its regular end."""


def interrupted_status() -> int:
    """Return 128 + n for the signal n that requested a stop."""
    number = received()
    return INTERRUPTED if number is None else 128 + number


def fail(message: str, status: int) -> NoReturn:
    """Print one message on stderr and exit."""
    end()
    echo(f"hexapod-pin: {message}", err=True)
    sys.exit(status)
