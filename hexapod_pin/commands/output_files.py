"""The files that a command writes: each refused before anything runs, none lost with another."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING

from hexapod_pin.atomic_file import require_own_name
from hexapod_pin.commands.terminal import echo, typed_command
from hexapod_pin.errors import HexapodError, TraceFileError
from hexapod_pin.stop_signals import unbroken
from hexapod_pin.user_file import declare_output, reason_of, user_path

if TYPE_CHECKING:
    from hexapod_pin.results.trace import Trace
    from hexapod_pin.simulation.case import Case

FIGURES = (".png", ".svg", ".pdf")
"""Endings of figures."""

PAGES = (".html", ".htm")
"""Endings of pages."""

PAGE_BYTES = 300_000
"""No playback page is smaller: the viewer stands in each of them [bytes]."""

LEAST_SHARE = 0.1
"""No trace takes less of what its samples take in memory [-]: they are compressed without loss."""


def report_marks() -> dict[str, str]:
    """Return what a report states of its making: today's date, and the command of this process."""
    return {"date": date.today().isoformat(), "command": typed_command()}


def writable(option: str, path: Path, endings: Sequence[str] = (), *, drawn: bool = False) -> Path:
    """Return the absolute path of a file to write, refused now rather than after the run.

    The file is none of the command's inputs: one of that name is refused when it is read.

    Args:
        option: that names the file.
        path: of the file.
        endings: of which its name must have one; empty: any.
        drawn: whether matplotlib draws what is in it.

    Raises:
        TraceFileError: the folder is missing or read-only; the path is a folder, a link, a pipe or
            a device; its ending is none of those; or the system takes no such name.
        FileConflictError: another option names the same file.
        MissingPackageError: matplotlib is not installed.
    """
    named = f"{option} {path}"
    try:
        path = user_path(path).absolute()
        require_own_name(path)
    except (FileNotFoundError, NotADirectoryError):
        pass
    except (OSError, ValueError) as error:
        text = f"{named}: cannot be written ({reason_of(error)}); name another file."
        raise TraceFileError(text) from error
    if endings:
        from hexapod_pin.results.result_files import check_ending

        check_ending(named, endings)
    folder = path.parent
    if not os.path.isdir(folder):
        raise TraceFileError(f"{named}: there is no folder {folder}.")
    if not os.access(folder, os.W_OK):
        raise TraceFileError(f"{named}: the folder {folder} is not writable.")
    if drawn:
        from hexapod_pin.view.figure_file import require_matplotlib

        require_matplotlib(named)
    declare_output(option, path)
    return path


def writable_trace(option: str, path: Path) -> Path:
    """Return the absolute path of a trace to write; raises as `writable`."""
    from hexapod_pin.results.result_files import CSV, NETCDF

    return writable(option, path, (*NETCDF, *CSV))


def writable_figure(option: str, path: Path) -> Path:
    """Return the absolute path of a figure to write; raises as `writable`."""
    return writable(option, path, FIGURES, drawn=True)


def require_room(least: Mapping[Path, float]) -> None:
    """Refuse to begin where the disk has less room than the smallest that files can come to.

    Args:
        least: size of each file at least [bytes].

    Raises:
        TraceFileError: there is too little room; it gives the bytes needed and those free.
    """
    needed: dict[int, float] = {}
    for path, size in least.items():
        try:
            device, free = path.parent.stat().st_dev, shutil.disk_usage(path.parent).free
        except OSError:  # the write itself reports what is wrong
            continue
        needed[device] = needed.get(device, 0.0) + size
        if free < needed[device]:
            raise TraceFileError(
                f"{path}: the disk has too little room: at least {needed[device]:.0f} bytes are "
                f"needed, {free} are free; make room, or write elsewhere."
            )


def least_sizes(case: Case, trace: Path, page: Path | None) -> dict[Path, float]:
    """Return how large the files of a run become at least [bytes]."""
    from hexapod_pin.simulation.run_settings import sample_bytes

    found = {trace: LEAST_SHARE * sample_bytes(case.settings, case.scene, case.record)}
    return found if page is None else {**found, page: PAGE_BYTES}


class WrittenFiles:
    """Writes files one after the other; one that is refused keeps none of the others back."""

    def __init__(self, quiet: bool = False) -> None:
        """Begin with no file and no refusal; `quiet`: nothing is printed."""
        self.written: list[Path] = []
        self.refusals: list[TraceFileError] = []
        self._quiet = quiet

    def _report(self, path: Path, err: bool = False) -> None:
        self.written.append(path)
        if not self._quiet:
            echo(f"wrote {path}", err=err)

    def note(self, path: Path, refusal: TraceFileError | None) -> None:
        """Print the path of a file that was written before, or keep its refusal in mind."""
        if refusal is None:
            self._report(path)
        else:
            self.refusals.append(refusal)

    def __call__(self, write: Callable[[], Path], *, err: bool = False) -> None:
        """Write a file and print its path, on stderr where `err`; keep in mind if it is refused."""
        try:
            path = write()
        except TraceFileError as error:
            self.refusals.append(error)
        else:
            self._report(path, err)


@contextmanager
def written_files(quiet: bool = False) -> Iterator[WrittenFiles]:
    """Give what writes files; at its end, report which were refused.

    Args:
        quiet: whether the paths of written files are not printed.

    Raises:
        TraceFileError: at the end, of all files that could not be written.
    """
    files = WrittenFiles(quiet)
    yield files
    if files.refusals:
        raise TraceFileError("\n".join(map(str, files.refusals))) from files.refusals[0]


def run_saving(job: Callable[[], Trace], out: Path) -> tuple[Trace, TraceFileError | None]:
    """Run a simulation and save its trace; of one that ends early, what there is.

    Signals wait for the progress of the job, and until the file is written.

    Returns:
        The trace, and why it could not be saved; None where it is saved.

    Raises:
        HexapodError: as the job does, the message with the file of what was done.
    """
    with unbroken():
        try:
            trace = job()
        except HexapodError as error:
            if error.trace is not None:
                error.args = (f"{error}\n{_saved(error.trace, out)}",)
            raise
        try:
            trace.save(out)
        except TraceFileError as error:
            return trace, error
    return trace, None


def _saved(trace: Trace, out: Path) -> str:
    """Save what a run has done that ended early; return what became of it."""
    try:
        return f"the {trace.time[-1]:g} s done so far are in {trace.save(out)}"
    except TraceFileError as refusal:
        return f"the {trace.time[-1]:g} s done so far could not be saved: {refusal}"
