"""The process of a command line: its streams, its signals, and the status that it ends with."""

from __future__ import annotations

import io
import os
import signal
import sys
from collections.abc import Sequence
from typing import Any, NoReturn, TextIO

from hexapod_pin import stop_signals
from hexapod_pin.commands.app import main
from hexapod_pin.commands.status import (
    DONE_TEXT,
    FAILED,
    INTERRUPTED_TEXT,
    fail,
    interrupted_status,
)
from hexapod_pin.errors import TraceFileError


class _ForgivingFile(io.FileIO):
    """A stream that goes on into nothing where its reader has gone, as with `| head -1`.

    What a command does besides printing, its files above all, is done to the end.
    """

    def write(self, content: Any) -> int:
        """Write bytes; returns how many.

        Raises:
            TraceFileError: the system refuses them, as on a full disk.
        """
        try:
            return super().write(content)
        except BrokenPipeError:
            self._go_on_into_nothing()
            return len(content)
        except BlockingIOError:
            raise
        except OSError as error:
            self._go_on_into_nothing()
            reason = error.strerror or str(error)
            raise TraceFileError(f"{self.name}: cannot be written ({reason}).") from error

    def _go_on_into_nothing(self) -> None:
        nothing = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nothing, self.fileno())
        os.close(nothing)


def forgiving(stream: TextIO) -> TextIO:
    """Return a stream to the same place that survives its reader."""
    raw = _ForgivingFile(stream.fileno(), "w", closefd=False)
    raw.name = stream.name
    return io.TextIOWrapper(
        io.BufferedWriter(raw), encoding=stream.encoding, errors=stream.errors,
        line_buffering=stream.isatty() or stream is sys.stderr,
    )  # fmt: skip


def run_process(argv: Sequence[str] | None = None) -> NoReturn:
    """Run a command and exit; its status tells of a signal, whatever the signal cut short."""
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
    except TraceFileError as error:
        fail(str(error), FAILED)
    except BaseException:
        if stop_signals.received() is None:
            raise
        fail(INTERRUPTED_TEXT, interrupted_status())


def _end(status: Any) -> NoReturn:
    """Print what is left, and exit."""
    try:
        sys.stdout.flush()
    except TraceFileError as error:
        if not status:
            fail(str(error), FAILED)
    stop_signals.end()
    sys.exit(status)
