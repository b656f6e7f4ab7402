"""`python -m hexapod_pin` is `hexapod-pin`."""

from __future__ import annotations

import atexit
import contextlib
import gc
import os
import sys
import threading
from collections.abc import Sequence
from typing import NoReturn

from hexapod_pin import stop_signals

COLLECT_AFTER = 100_000
"""New objects after which Python collects garbage.

Libraries make some hundred thousand objects while they are imported and leave no garbage. With
Python's own 700, collections took 0.8 s of the 5.8 s of a first small `sweep --plot`.
"""


def main(argv: Sequence[str] | None = None) -> NoReturn:
    """Run a command as a process of its own, and exit; signals end it with what is done saved.

    Args:
        argv: arguments without the program's name; None takes those of the process.
    """
    gc.set_threshold(COLLECT_AFTER)
    # All matrices are small: threads of linear algebra would only wait for each other.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # Plugins of pydantic are looked for in every package that is installed; none is of use here.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    stop_signals.install()  # before more is read: until here Ctrl-C ends in Python's traceback
    from hexapod_pin.commands.resources import lack_of, open_streams
    from hexapod_pin.commands.terminal import announce_command

    open_streams()
    announce_command(sys.argv[1:] if argv is None else argv)
    try:
        from hexapod_pin.commands.process import run_process
    except (ImportError, MemoryError, OSError) as error:
        lack = lack_of(error)
        if lack is None:
            raise
        sys.stderr.write(f"hexapod-pin: {lack}\n")
        sys.exit(2)
    try:
        run_process(argv)
    except SystemExit as leaving:
        if leaving.code is not None and not isinstance(leaving.code, int):
            raise
        _leave(leaving.code or 0)


def _leave(status: int) -> NoReturn:
    """End the process once all is done and written, without taking the interpreter apart.

    That looks for garbage among all objects, 0.13 s, and what it does not find in cycles that hold
    native objects is then reported by nanobind as a leak. An error that nothing has caught does
    not come here: it ends in Python's traceback.
    """
    for thread in threading.enumerate():
        if thread is not threading.current_thread() and not thread.daemon:
            thread.join()
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError):  # closed, or a disk that is full: reported
            stream.flush()
    os._exit(status)


if __name__ == "__main__":
    main()
