"""Who wants to know how far planning has got: a walk without repetition takes long to plan."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

_listener: ContextVar[Callable[[float], None] | None] = ContextVar("listener", default=None)


@contextmanager
def planning_told_to(listener: Callable[[float], None] | None) -> Iterator[None]:
    """Call `listener` with the finished fraction, 0 to 1, of what is planned in this block."""
    token = _listener.set(listener)
    try:
        yield
    finally:
        _listener.reset(token)


def tell_planned(fraction: float) -> None:
    """Tell whoever listens how much is planned, 0 to 1."""
    listener = _listener.get()
    if listener is not None:
        listener(fraction)
