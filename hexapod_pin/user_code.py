"""Calls of code that a user gave: what it raises becomes an error of this package."""

from __future__ import annotations

from collections.abc import Callable

from hexapod_pin.errors import (
    DivergenceError,
    HexapodError,
    SimulationInterrupted,
    UserCodeError,
)


class UserCode:
    """A block that calls code of the user's: what it raises leaves it as a `UserCodeError`.

    An error of this package passes as it is, unless it belongs to another run, one that the code
    made. Ctrl-C passes. `sys.exit` is an error like others: it would end the program in silence.

    Raises:
        UserCodeError: the block has raised.
    """

    __slots__ = ("_call", "_time")

    def __init__(self, call: str, time: float | None = None) -> None:
        """Take what is called, and the simulated time [s]; None where no run is under way."""
        self._call, self._time = call, time

    def __enter__(self) -> None:
        """Begin the block."""

    def __exit__(self, kind: object, error: BaseException | None, frames: object) -> None:
        """Raise what is to leave the block."""
        if error is None or isinstance(error, SimulationInterrupted):
            return
        if isinstance(error, HexapodError):
            if error.trace is None and not isinstance(error, DivergenceError):
                return
        elif not isinstance(error, Exception | SystemExit):
            return
        raise UserCodeError(self._call, error, self._time) from error


def user_callback(
    name: str, callback: Callable[[float], None] | None
) -> Callable[[float], None] | None:
    """Return a callback that raises as a `UserCode` does; None of None."""
    if callback is None:
        return None

    def call(value: float) -> None:
        with UserCode(name):
            callback(value)

    return call
