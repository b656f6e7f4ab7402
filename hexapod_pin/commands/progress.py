"""A progress bar on stderr, where that is a terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID


class ProgressBar:
    """Shows a finished fraction, 0 to 1, when it is called; `stage` is for what comes before."""

    def __init__(self, bar: Progress, title: str) -> None:
        """Begin at 0."""
        self._bar: Progress = bar
        self._task: TaskID = bar.add_task(title, total=1.0)
        self._show = self.stage(title)

    def __call__(self, fraction: float) -> None:
        """Show how much is finished."""
        self._show(fraction)

    def stage(self, title: str) -> Callable[[float], None]:
        """Return a callable that shows the finished fraction of something else."""
        return lambda fraction: self._bar.update(self._task, description=title, completed=fraction)


@contextmanager
def progress_bar(title: str) -> Iterator[ProgressBar]:
    """Give a callable that shows a finished fraction on stderr, where that is a terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn())
    with Progress(
        *columns, TimeElapsedColumn(), console=console, disable=not console.is_terminal
    ) as bar:
        yield ProgressBar(bar, title)
