"""SIGINT, SIGTERM and SIGHUP on the command line: one exception, and sections that it never cuts.

Nothing here acts before `install`, which only the command line calls: in a library the handlers
are those of the program that uses it.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any, NoReturn

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

PATIENCE = 3.0
"""Time that a first signal is given to save what is done; others are ignored so long [s]."""

REPEAT = 0.02
"""Wait before a signal is sent again whose exception was swallowed, as in a destructor [s]."""

STARTING, RUNNING = "starting", "running"


class StopSignal(KeyboardInterrupt):
    """A signal that asks to stop; whatever handles Ctrl-C handles it.

    Attributes:
        number: of the signal.
    """

    def __init__(self, number: int) -> None:
        """Keep the number."""
        self.number = number
        super().__init__(signal.Signals(number).name)


class _State:
    """What is known of signals; `phase` is empty where the handlers are not installed."""

    def __init__(self) -> None:
        self.phase = ""
        self.first: int | None = None
        self.since = 0.0
        self.depth = 0
        self.pending = False


_state = _State()


def install() -> None:
    """Take the signals over; one that is ignored, as under `nohup`, stays ignored."""
    _state.phase = STARTING
    for number in SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _receive)
    sys.unraisablehook = _swallowed


def begin() -> None:
    """Raise `StopSignal` from now on; before, nothing is there to save, and the process ends."""
    if _state.phase == STARTING:
        _state.phase = RUNNING


def end() -> None:
    """Say that all is saved: what is left to be done takes no time, and no signal cuts it."""
    if not _state.phase:
        return
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)


def received() -> int | None:
    """Return the number of the first signal that asked to stop."""
    return _state.first


def is_stop(error: KeyboardInterrupt) -> bool:
    """Tell whether a signal has raised an exception, rather than some code of the user's.

    Where the handlers are not installed, as in a library, it is taken for Ctrl-C.
    """
    return isinstance(error, StopSignal) or not _state.phase


@contextmanager
def unbroken() -> Iterator[None]:
    """Hold signals back until the block has ended, or until `check_stop` asks for them.

    A second one raises at once where the first has waited for longer than `PATIENCE`.
    """
    if not _state.phase or threading.current_thread() is not threading.main_thread():
        yield
        return
    _state.depth += 1
    try:
        yield
    finally:
        _state.depth -= 1
    if not _state.depth:
        check_stop()


def check_stop() -> None:
    """Raise the signal that was held back, if there is one.

    Raises:
        StopSignal: there is one.
    """
    if _state.pending and threading.current_thread() is threading.main_thread():
        _state.pending = False
        raise StopSignal(_state.first or signal.SIGINT)


def _receive(number: int, _frame: FrameType | None) -> None:
    if _state.phase == STARTING:
        _leave(number)
    now, again = time.monotonic(), _state.first is not None
    if again and now - _state.since < PATIENCE:
        return
    _state.first, _state.since = _state.first or number, now
    if _state.depth and not again:
        _state.pending = True
        return
    raise StopSignal(_state.first)


def _leave(number: int) -> NoReturn:
    """End the process at once, with one line."""
    with suppress(OSError):  # there may be no stderr, or it may be full
        os.write(2, b"hexapod-pin: interrupted before anything was run\n")
    os._exit(128 + number)


def _swallowed(unraisable: Any) -> None:
    """Send a signal again whose exception was raised where nobody can catch it."""
    if not isinstance(unraisable.exc_value, StopSignal):
        sys.__unraisablehook__(unraisable)
        return
    number = unraisable.exc_value.number
    _state.first = None
    timer = threading.Timer(REPEAT, os.kill, (os.getpid(), number))
    timer.daemon = True
    timer.start()
