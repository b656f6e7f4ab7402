"""`python -m hexapod_pin` is `hexapod-pin`."""

from __future__ import annotations

import gc
import os
import sys
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
    finally:
        gc.freeze()  # the process ends: what is left is no garbage to look for, which took 0.13 s


if __name__ == "__main__":
    main()
