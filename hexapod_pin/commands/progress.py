"""A progress bar on stderr, where that is a terminal; elsewhere rich is not even loaded.

Elsewhere, as in a job or a file, long work prints a line now and then.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any

from hexapod_pin.commands.terminal import echo, settle
from hexapod_pin.foreign_text import visible
from hexapod_pin.stop_signals import check_stop

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID


class _Hidden:
    """Stands for the bar of rich where none is shown."""

    def add_task(self, *_: Any, **__: Any) -> Any:
        """Return a number, as rich does."""
        return 0

    def update(self, *_: Any, **__: Any) -> None:
        """Show nothing."""

    def reset(self, *_: Any, **__: Any) -> None:
        """Show nothing."""


FIRST_LINE = 10.0
"""When long work has its first line of progress where there is no terminal [s], and ..."""

EVERY_LINE = 60.0
"""... how long after a line the next comes, at least [s]."""


class _Lines(_Hidden):
    """Stands for the bar where stderr is no terminal, and prints what is done of long work."""

    def __init__(self) -> None:
        """Begin to count the time."""
        self._next = time.monotonic() + FIRST_LINE
        self._text, self._begin, self._first = "", 0.0, 0.0

    def update(self, *_: Any, description: str = "", completed: float = 0.0) -> None:
        """Print the finished fraction and the time left, where it is time for a line."""
        now = time.monotonic()
        if not self._begin or description != self._text or completed < self._first:
            self._text, self._begin, self._first = description, now, completed
        if now < self._next:
            return
        self._next = now + EVERY_LINE
        left = ""
        if completed > self._first:
            seconds = (now - self._begin) * (1.0 - completed) / (completed - self._first)
            left = f", about {seconds:.0f} s left" if seconds < 100.0 else (
                f", about {seconds / 60.0:.0f} min left")  # fmt: skip
        with suppress(OSError):  # as of a pipe that was closed
            echo(f"{description}: {completed:.0%} done{left}", err=True)


class ProgressBar:
    """Shows a finished fraction, 0 to 1, when it is called; `stage` is for what comes before."""

    def __init__(self, bar: Progress | _Hidden, title: str) -> None:
        """Begin at 0."""
        self._bar = bar
        self._task: TaskID = bar.add_task(visible(title), total=1.0)
        self._show = self.stage(title)

    def __call__(self, fraction: float) -> None:
        """Show how much is finished; stop here where a signal requests it."""
        self._show(fraction)

    def stage(self, title: str) -> Callable[[float], None]:
        """Return a callable that shows the finished fraction of something else, from now on."""
        self._bar.reset(self._task, total=1.0, description=visible(title))

        def show(fraction: float) -> None:
            self._bar.update(self._task, description=visible(title), completed=fraction)
            check_stop()

        return show


class TimeLeftBar:
    """Shows a finished fraction and the time left; a sweep that goes on begins above 0."""

    def __init__(self, bar: Progress | _Hidden, title: str) -> None:
        """Begin at the fraction of the first call."""
        self._bar, self._title = bar, title
        self._task: TaskID | None = None
        self._first, self._last = 0.0, 0.0

    def __call__(self, fraction: float) -> None:
        """Show how much is finished."""
        if self._task is None:
            self._task = self._bar.add_task(visible(self._title), total=1.0)
            self._first = fraction
        self._last = fraction
        self._bar.update(self._task, description=visible(self._title), completed=fraction)
        check_stop()

    @property
    def moved(self) -> float:
        """Fraction that was finished since the first call."""
        return self._last - self._first


@contextmanager
def time_left_bar(title: str) -> Iterator[TimeLeftBar]:
    """Give a callable that shows a finished fraction and the time left; elsewhere, lines."""
    with _bar(left=True) as bar:
        yield TimeLeftBar(bar, title)


@contextmanager
def progress_bar(title: str, *, left: bool = False) -> Iterator[ProgressBar]:
    """Give a callable that shows a finished fraction on stderr, where that is a terminal.

    Args:
        title: of what is done.
        left: whether the work is long: the time left is shown, too, and elsewhere than at a
            terminal a line now and then.
    """
    with _bar(left=left) as bar:
        yield ProgressBar(bar, title)


TERMINALS = ("FORCE_COLOR", "TTY_COMPATIBLE")
"""Variables of the environment by which rich takes what is no terminal for one."""


@contextmanager
def _bar(*, left: bool = False) -> Iterator[Progress | _Hidden]:
    """Give rich's bar, with the time `left` or without, where it can be shown."""
    if not (sys.stderr.isatty() or any(map(os.environ.get, TERMINALS))):
        yield _Lines() if left else _Hidden()
        return
    settle()
    from rich import progress as rich
    from rich.console import Console

    console = Console(stderr=True)
    columns: list[rich.ProgressColumn] = [
        rich.TextColumn("{task.description}", markup=False), rich.BarColumn(),
        rich.TaskProgressColumn(), rich.TimeElapsedColumn(),
    ]  # fmt: skip
    if left:
        columns += [rich.TextColumn("left"), rich.TimeRemainingColumn()]
    with rich.Progress(
        *columns, console=console, disable=not console.is_terminal,
        speed_estimate_period=60.0 if left else 30.0,
    ) as bar:  # fmt: skip
        yield bar
