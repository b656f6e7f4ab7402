"""What a command needs of the system: its three streams, a working folder, threads, memory.

What is missing is found before anything is run, and named in one line.
"""

from __future__ import annotations

import contextlib
import errno
import os
import resource
import signal
import sys
from importlib.util import find_spec
from pathlib import Path
from threading import Event, Thread
from typing import NoReturn

from hexapod_pin.errors import ResourceError

LIMITS = {resource.RLIMIT_AS: "-v", resource.RLIMIT_DATA: "-d"}
"""Limits of memory that a shell can set, with the option of `ulimit`."""

SPARE = 20_000_000
"""Numbers that must have room beside the libraries, for a run and its files."""

MOST_THREADS = 64
"""Threads that linear algebra has at most, whatever the machine has."""

COPIES = 2
"""Copies of that library: NumPy and SciPy bring one each, with threads of its own."""

LONGEST_LOAD = 10
"""Processor time that loading the libraries takes at most, compiling them included [s]."""

LONGEST_OPENBLAS = 1.0
"""The same of one copy of OpenBLAS, which takes some milliseconds [s]."""

ROOM_HINT = "Raise the limit, or let fewer processes run beside it."


def open_streams() -> None:
    """Open what is closed of stdin, stdout and stderr on nothing: what is printed there is lost.

    Else the next file that is opened, a result for one, would get the number of such a stream, and
    what libraries print would go into it.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free, which is this
        if getattr(sys, name) is None:
            nothing = os.open(os.devnull, os.O_RDWR)  # of its own: open as long as the process is
            mode = "w" if number else "r"
            setattr(sys, name, open(nothing, mode, encoding="utf-8", closefd=False))


def require_resources() -> None:
    """Look for a working folder, for threads and for memory.

    Raises:
        ResourceError: one of them is missing.
    """
    try:
        os.getcwd()
    except OSError as error:
        reason = f"it is gone ({error.strerror})"
        raise ResourceError("working folder", reason, "Change to another one (cd).") from error
    if "numpy" not in sys.modules:  # else the libraries have what they need
        _require_room()
        _require_threads()


def lack_of(error: BaseException) -> ResourceError | None:
    """Return the error that names what is missing, of one that Python or the system has raised."""
    if isinstance(error, ResourceError):
        return error
    if isinstance(error, MemoryError) or _number(error) == errno.ENOMEM or _unmapped(error):
        return ResourceError("memory", f"there is too little{_limit_text()}", ROOM_HINT)
    if isinstance(error, RuntimeError) and "start new thread" in str(error):
        return ResourceError("threads", "the system starts no more of them", ROOM_HINT)
    if _number(error) in (errno.EMFILE, errno.ENFILE):
        return ResourceError("open files", "there are too many (ulimit -n)", ROOM_HINT)
    return None


def _number(error: BaseException) -> int | None:
    return error.errno if isinstance(error, OSError) else None


def _unmapped(error: BaseException) -> bool:
    """Tell whether a library could not be loaded for want of memory."""
    text = str(error).lower()
    refusals = ("failed to map segment", "cannot allocate memory", "cannot create shared object")
    return isinstance(error, ImportError) and any(part in text for part in refusals)


def _limit_text() -> str:
    """Return the limits that are set, in brackets; empty where none is."""
    found = {option: resource.getrlimit(limit)[0] for limit, option in LIMITS.items()}
    texts = [
        f"ulimit {option}: {size / 1e6:.0f} MB"
        for option, size in found.items()
        if size != resource.RLIM_INFINITY
    ]
    return f" ({', '.join(texts)})" if texts else ""


def _require_threads() -> None:
    """Start as many threads as the libraries of linear algebra do when they are loaded.

    Where they are refused, such a library sends this process SIGINT, as Ctrl-C does.

    Raises:
        ResourceError: the system refuses them.
    """
    done = Event()
    threads = [Thread(target=done.wait, daemon=True) for _ in range(COPIES * _workers())]
    try:
        for thread in threads:
            thread.start()
    except RuntimeError as error:
        reason = f"the system does not start {len(threads)} more of them"
        hint = "Raise its limit (ulimit -u), or set OPENBLAS_NUM_THREADS=1."
        raise ResourceError("threads", reason, hint) from error
    finally:
        done.set()
        for thread in threads:
            if thread.ident is not None:  # it was started
                thread.join()


def _workers() -> int:
    """Return how many threads linear algebra has besides the one that calls it."""
    threads = os.environ.get("OPENBLAS_NUM_THREADS") or os.environ.get("OMP_NUM_THREADS") or ""
    known = int(threads) if threads.isdecimal() and int(threads) else MOST_THREADS
    cores = len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1
    return min(known, cores, MOST_THREADS) - 1


def _require_room() -> None:
    """Where memory is limited, load the libraries in a process of their own, to see if they can be.

    Where they cannot, some of them end the process that loads them, and others (OpenBLAS) request
    memory again and again, for ever.

    Raises:
        ResourceError: they cannot.
    """
    if not _limit_text():
        return
    try:
        child = os.fork()
    except OSError as error:
        lack = lack_of(error) or ResourceError("processes", f"none starts ({error})", ROOM_HINT)
        raise lack from error
    if not child:
        _load_and_leave()
    if os.waitpid(child, 0)[1]:
        reason = f"there is too little to load the libraries{_limit_text()}"
        raise ResourceError("memory", reason, ROOM_HINT)


def _load_linear_algebra() -> None:
    """Load the copies of OpenBLAS that NumPy and SciPy bring, each in the time that it takes.

    One that requests memory for ever lets no Python run: SIGPROF ends this process then.
    """
    import ctypes

    signal.signal(signal.SIGPROF, signal.SIG_DFL)
    for package in ("numpy", "scipy"):
        spec = find_spec(package)
        folder = Path(spec.origin or "").parents[1] if spec is not None else Path()
        for library in sorted((folder / f"{package}.libs").glob("*openblas*")):
            signal.setitimer(signal.ITIMER_PROF, LONGEST_OPENBLAS)
            ctypes.CDLL(str(library))
            signal.setitimer(signal.ITIMER_PROF, 0.0)


def _load_and_leave() -> NoReturn:
    """Load what nearly every command does, and end: 0 where it was possible."""
    status = 1
    with contextlib.suppress(BaseException):
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        before, most = resource.getrlimit(resource.RLIMIT_CPU)
        if before == resource.RLIM_INFINITY or before > LONGEST_LOAD:
            resource.setrlimit(resource.RLIMIT_CPU, (LONGEST_LOAD, most))
        nothing = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nothing, 1)
        os.dup2(nothing, 2)
        _load_linear_algebra()
        import h5netcdf  # noqa: F401
        import h5py  # noqa: F401
        import numpy as np
        import pinocchio  # noqa: F401
        import scipy.linalg  # noqa: F401  # which brings a copy of OpenBLAS

        from hexapod_pin import native  # noqa: F401

        square, _ = np.ones((300, 300)), np.ones(SPARE)
        status = int((square @ square)[0, 0] != len(square))
    os._exit(status)
