"""`python -m hexapod_pin` is `hexapod-pin`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NoReturn

from hexapod_pin import stop_signals


def main(argv: Sequence[str] | None = None) -> NoReturn:
    """Run a command as a process of its own, and exit; signals end it with what is done saved.

    Args:
        argv: arguments without the program's name; None takes those of the process.
    """
    stop_signals.install()
    from hexapod_pin.commands.process import run_process

    run_process(argv)


if __name__ == "__main__":
    main()
