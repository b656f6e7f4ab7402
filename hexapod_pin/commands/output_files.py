"""The files a command writes: refused before anything runs, kept when a run ends early."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from hexapod_pin.errors import DivergenceError, SimulationInterrupted, TraceFileError
from hexapod_pin.stop_signals import unbroken
from hexapod_pin.user_file import user_path

if TYPE_CHECKING:
    from hexapod_pin.results.trace import Trace


def writable(option: str, path: Path) -> Path:
    """Return the absolute path, refused now rather than after the simulation.

    Raises:
        TraceFileError: the folder is missing or read-only, the path is a folder, or the system
            takes no such name.
    """
    path = user_path(path).absolute()
    try:
        path.lstat()
    except (FileNotFoundError, NotADirectoryError):
        pass
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise TraceFileError(f"{option} {path}: no name for a file ({reason}).") from error
    folder = Path(os.path.realpath(path)).parent
    if not os.path.isdir(folder):
        raise TraceFileError(f"{option} {path}: there is no folder {folder}.")
    if os.path.isdir(path):
        raise TraceFileError(f"{option} {path}: is a folder; name a file in it.")
    if not os.access(folder, os.W_OK):
        raise TraceFileError(f"{option} {path}: the folder {folder} is not writable.")
    return path


def writable_trace(option: str, path: Path) -> Path:
    """Return the absolute path of a trace to write, as `writable`.

    Raises:
        TraceFileError: as `writable`; or the ending is none of a trace's.
    """
    from hexapod_pin.results.file_ending import CSV, NETCDF, check_ending

    path = writable(option, path)
    check_ending(f"{option} {path}", (*NETCDF, *CSV))
    return path


def distinct(first: Path, second: Path | None) -> None:
    """Refuse to write two results to one file.

    Raises:
        TraceFileError: the paths are the same.
    """
    if second is not None and os.path.realpath(first) == os.path.realpath(second):
        raise TraceFileError(f"--out and --html are the same file, {first}; name two.")


def run_saving(job: Callable[[], Trace], out: Path) -> Trace:
    """Run a simulation and save its trace; of one that ends early, what there is.

    Signals wait for the progress of the job, and until the file is written.

    Raises:
        DivergenceError, SimulationInterrupted: as the job does, the message telling the file.
    """
    with unbroken():
        try:
            trace = job()
        except (DivergenceError, SimulationInterrupted) as error:
            if error.trace is None:  # stopped before it began
                raise
            saved = error.trace.save(out)
            kept = f"the {error.trace.time[-1]:g} s done so far are in {saved}"
            raise type(error)(f"{error}\n{kept}", error.trace) from error
        trace.save(out)
    return trace
