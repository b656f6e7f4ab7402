"""The process of a command line: its streams, its signals, and the status that it ends with."""

from __future__ import annotations

import io
import os
import select
import signal
import sys
from collections.abc import Sequence
from typing import Any, NoReturn, TextIO

from hexapod_pin import stop_signals
from hexapod_pin.commands.app import main
from hexapod_pin.commands.resources import lack_of
from hexapod_pin.commands.terminal import (
    DONE_TEXT,
    FAILED,
    INTERRUPTED_TEXT,
    fail,
    interrupted_status,
)


class _ForgivingFile(io.FileIO):
    """A stream that goes on into nothing where its reader has gone, as with `| head -1`.

    What a command does besides printing, its files above all, is done to the end, also where the
    system refuses what is printed, as on a full disk.

    Attributes:
        failure: why something could not be written; empty where its reader has gone.
    """

    failure = ""

    def write(self, content: Any) -> int:
        """Write bytes, waiting for a slow reader; returns how many."""
        try:
            while (written := super().write(content)) is None:  # a pipe that does not wait itself
                select.select([], [self], [])
            return written
        except BrokenPipeError:
            pass
        except OSError as error:
            self.failure = f"{self.name}: cannot be written ({error.strerror or error})."
        self._go_on_into_nothing()
        return len(content)

    def _go_on_into_nothing(self) -> None:
        nothing = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nothing, self.fileno())
        os.close(nothing)


def forgiving(stream: TextIO) -> TextIO:
    """Return a stream to the same place that survives its reader.

    Characters that its encoding does not have are written as escapes.
    """
    raw = _ForgivingFile(stream.fileno(), "w", closefd=False)
    raw.name = stream.name
    errors = "backslashreplace" if stream.errors == "strict" else stream.errors
    return io.TextIOWrapper(
        io.BufferedWriter(raw), encoding=stream.encoding, errors=errors,
        line_buffering=stream.isatty() or stream is sys.stderr,
    )  # fmt: skip


def run_process(argv: Sequence[str] | None = None) -> NoReturn:
    """Run a command and exit; its status reports a signal, whatever the signal cut short."""
    sys.stdout, sys.stderr = forgiving(sys.stdout), forgiving(sys.stderr)
    try:
        _run(argv)
    except stop_signals.StopSignal:  # while it was ending
        fail(DONE_TEXT, interrupted_status())


def _run(argv: Sequence[str] | None) -> NoReturn:
    try:
        main(argv)
    except SystemExit as leaving:
        if not leaving.code and stop_signals.received() not in (None, signal.SIGINT):
            fail(DONE_TEXT, interrupted_status())
        _end(leaving.code)
    except BaseException as error:
        if stop_signals.received() is not None:
            fail(INTERRUPTED_TEXT, interrupted_status())
        lack = lack_of(error)
        if lack is None:
            raise
        fail(str(lack), FAILED)


def _end(status: Any) -> NoReturn:
    """Print what is left, and exit."""
    sys.stdout.flush()
    failure = _failure(sys.stdout)
    if failure and not status:
        fail(failure, FAILED)
    stop_signals.end()
    sys.exit(status)


def _failure(stream: TextIO) -> str:
    """Return why a stream has lost something; empty where it has not."""
    raw = getattr(getattr(stream, "buffer", None), "raw", None)
    return getattr(raw, "failure", "")
