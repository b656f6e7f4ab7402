"""Names around a store that are somebody else's, rows that are damaged, sweeps that never began."""

from __future__ import annotations

import contextlib
import gc
import os
import socket
import sqlite3
import stat
import subprocess
import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import (
    OtherStudyError,
    ParameterError,
    StoreFullError,
    StoreLockedError,
    SweepStoreError,
    WorkersError,
)
from hexapod_pin.study.runs import SweepResult, run_sweep, store_file, store_guard, store_lock
from hexapod_pin.study.runs import runner as runner_module
from hexapod_pin.study.runs import store as store_module
from hexapod_pin.study.runs.outcome import Outcome
from hexapod_pin.study.runs.store import SweepStore
from hexapod_pin.study.runs.store_file import store_errors
from hexapod_pin.study.runs.store_lock import StoreLock
from hexapod_pin.study.runs.store_reading import DAMAGED, NOT_RUN
from hexapod_pin.study.runs.store_schema import MetaTexts, checksum, stored_rows, study_sum
from hexapod_pin.study.runs.task import case_outcomes
from tests.sweep_studies import require_same_bits, small_study

STUDY = small_study(1)
PATIENCE = 60.0
"""Longest wait for anything: a process that waits for a pipe would wait for ever [s]."""

SIDES = ("-wal", "-shm", "-journal")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> SweepResult:
    """The undisturbed sweep of three cases."""
    return run_sweep(STUDY, tmp_path_factory.mktemp("whole") / "a.db", threads=1)


@pytest.fixture(scope="module")
def outcomes() -> dict[int, Outcome]:
    """What becomes of its cases."""
    return {one.index: one for one in case_outcomes(STUDY, range(3), 1)}


def _raised(call: Callable[[], object]) -> BaseException | None:
    """Return what a call raises, and fail where it waits for ever."""
    found: list[BaseException | None] = []

    def run() -> None:
        try:
            call()
        except BaseException as error:
            found.append(error)
        else:
            found.append(None)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    thread.join(PATIENCE)
    assert found, "it waits for ever"
    return found[0]


class Precious:
    """A file of somebody's, beside the folder of a sweep."""

    def __init__(self, folder: Path, content: bytes) -> None:
        """Write it."""
        self.path = folder / "precious"
        self.path.write_bytes(content)
        self.content, self.inode = content, self.path.stat().st_ino

    def require_untouched(self, names: int) -> None:
        found = self.path.stat()
        assert self.path.read_bytes() == self.content
        assert (found.st_ino, found.st_nlink) == (self.inode, names)


def _socket(path: Path, _precious: Path) -> None:
    folder = os.open(path.parent, os.O_RDONLY)  # the name of a socket is at most 107 bytes long
    with socket.socket(socket.AF_UNIX) as one:
        one.bind(f"/proc/self/fd/{folder}/{path.name}")
    os.close(folder)


def _file_of_pages(path: Path, _precious: Path) -> None:
    path.write_bytes(b"keys" * 8192)


THINGS: dict[str, Callable[[Path, Path], object]] = {
    "link": lambda path, precious: path.symlink_to(precious),
    "dangling link": lambda path, precious: path.symlink_to(precious.with_name("nothing")),
    "hard link": lambda path, precious: path.hardlink_to(precious),
    "pipe": lambda path, precious: os.mkfifo(path),
    "folder": lambda path, precious: path.mkdir(),
    "device": lambda path, precious: path.symlink_to("/dev/zero"),
    "socket": _socket,
    "file": lambda path, precious: path.write_bytes(b"keys"),
    "file of pages": _file_of_pages,
}
"""What may stand at a name, made there."""


def _shown(folder: Path) -> dict[str, Any]:
    """Return all that a folder holds."""
    found = {}
    for path in folder.iterdir():
        state = path.lstat()
        content = path.read_bytes() if stat.S_ISREG(state.st_mode) else b""
        target = os.readlink(path) if path.is_symlink() else ""
        found[path.name] = (state.st_mode, state.st_ino, state.st_nlink, content, target)
    return found


NAMES = ("", "-lock", *SIDES)


@pytest.mark.parametrize(
    ("thing", "name", "begun"),
    [
        (thing, name, (i + k) % 2 == 1)  # each of them with each name, in pairs
        for i, thing in enumerate(THINGS)
        for k, name in enumerate(NAMES)
    ],
)
def test_what_is_somebody_elses_is_refused_and_left_alone(
    tmp_path: Path, whole: SweepResult, thing: str, name: str, begun: bool
) -> None:
    """Under each name of a store, whether its sweep is begun or gone on with."""
    precious = Precious(tmp_path, b"keys")
    folder = tmp_path / "sweep"
    folder.mkdir()
    store = folder / "a.db"
    if begun and name:
        store.write_bytes(whole.path.read_bytes())
    THINGS[thing](store.with_name(store.name + name), precious.path)
    before = _shown(folder)
    error = _raised(lambda: run_sweep(STUDY, store, resume=begun))
    assert isinstance(error, SweepStoreError), error
    assert str(store) in error.path
    assert _shown(folder) == before
    precious.require_untouched(2 if thing == "hard link" else 1)
    assert not precious.path.with_name("nothing").exists()


@pytest.mark.parametrize("thing", THINGS)
def test_an_empty_file_of_somebodys_is_not_written_through(tmp_path: Path, thing: str) -> None:
    """SQLite takes an empty file for a database of its own."""
    precious = Precious(tmp_path, b"")
    store = tmp_path / "a.db"
    THINGS[thing](store, precious.path)
    assert isinstance(_raised(lambda: run_sweep(STUDY, store)), SweepStoreError)
    precious.require_untouched(2 if thing == "hard link" else 1)


@pytest.mark.parametrize("name", ["", *SIDES])
@pytest.mark.parametrize("thing", THINGS)
def test_a_store_that_is_read_waits_for_nothing_and_changes_nothing(
    tmp_path: Path, whole: SweepResult, thing: str, name: str
) -> None:
    precious = Precious(tmp_path, b"keys")
    folder = tmp_path / "sweep"
    folder.mkdir()
    store = folder / "a.db"
    if name:
        store.write_bytes(whole.path.read_bytes())
    THINGS[thing](store.with_name(store.name + name), precious.path)
    before = _shown(folder)
    assert isinstance(_raised(lambda: hp.study.open_sweep(store)), SweepStoreError)
    assert _shown(folder) == before
    precious.require_untouched(2 if thing == "hard link" else 1)


def test_a_link_to_a_store_is_read(tmp_path: Path) -> None:
    """With what stands in the log beside the store itself."""
    path, link = tmp_path / "a.db", tmp_path / "link.db"
    link.symlink_to(path)
    with SweepStore(path, STUDY) as store:
        store.add(case_outcomes(STUDY, [1], 1))
        assert hp.study.open_sweep(link).done == 1
    assert hp.study.open_sweep(link).done == 1


@pytest.mark.parametrize("path", ["a\0b", "", ".", "..", "/", "x" * 300, "none/a.db", "/dev/null"])
def test_names_that_no_store_can_have(tmp_path: Path, monkeypatch: Any, path: str) -> None:
    monkeypatch.chdir(tmp_path)
    for call in (lambda: run_sweep(STUDY, path), lambda: hp.study.open_sweep(path)):
        assert isinstance(_raised(call), SweepStoreError | ParameterError)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("moment", ["before", "after"])
@pytest.mark.parametrize("thing", ["link", "dangling link", "hard link", "pipe", "file"])
def test_what_takes_the_name_of_the_lock_in_between_is_left_alone(
    tmp_path: Path, monkeypatch: Any, thing: str, moment: str
) -> None:
    """Between the look at the name and the creation, and between that and the opening."""
    precious = Precious(tmp_path, b"keys")
    write = store_lock.write_atomically

    def raced(path: Path, *rest: Any, **more: Any) -> Path:
        if moment == "after":
            write(path, *rest, **more)
            path.unlink()
        THINGS[thing](path, precious.path)
        return path if moment == "after" else write(path, *rest, **more)

    monkeypatch.setattr(store_lock, "write_atomically", raced)
    store = tmp_path / "a.db"
    assert isinstance(_raised(lambda: StoreLock(store)), SweepStoreError)
    precious.require_untouched(2 if thing == "hard link" else 1)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.db-lock", "precious"]


@pytest.mark.parametrize("thing", ["link", "dangling link", "hard link", "pipe", "file", "device"])
@pytest.mark.parametrize("content", [b"", b"keys"])
def test_what_takes_the_name_of_the_store_in_between_is_left_alone(
    tmp_path: Path, monkeypatch: Any, thing: str, content: bytes
) -> None:
    """After the store was created or looked at, as SQLite opens it."""
    precious = Precious(tmp_path, content)
    store = tmp_path / "a.db"
    connect = sqlite3.connect

    def raced(*rest: Any, **more: Any) -> sqlite3.Connection:
        monkeypatch.setattr(sqlite3, "connect", connect)
        store.unlink(missing_ok=True)
        THINGS[thing](store, precious.path)
        return connect(*rest, **more)

    monkeypatch.setattr(sqlite3, "connect", raced)
    assert isinstance(_raised(lambda: run_sweep(STUDY, store)), SweepStoreError)
    precious.require_untouched(2 if thing == "hard link" else 1)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.db", "precious"]


def test_a_dropped_connection_is_not_taken_for_an_open_one(tmp_path: Path) -> None:
    """Its inode's number is free for another file, which then was not held while it was opened."""
    store = tmp_path / "a.db"
    with SweepStore(store, STUDY):
        pass
    gc.collect()  # of other tests
    before = +store_file._open_here
    connection = store_file.connect(store, write=True)
    assert sum(store_file._open_here.values()) == sum(before.values()) + 1
    del connection
    gc.collect()
    assert +store_file._open_here == before


def test_what_takes_a_name_during_a_sweep_is_left_alone(tmp_path: Path) -> None:
    store = tmp_path / "a.db"
    with SweepStore(store, STUDY) as open_store:
        for name in ("-lock", "-journal"):
            other = store.with_name(store.name + name)
            other.unlink(missing_ok=True)
            other.write_bytes(b"keys")
        open_store.add(case_outcomes(STUDY, range(3), 1))
    for name in ("-lock", "-journal"):
        assert store.with_name(store.name + name).read_bytes() == b"keys"
        store.with_name(store.name + name).unlink()
    assert hp.study.open_sweep(store).done == 3


MARKS = {
    "-wal": bytes.fromhex("377f0682002de218"),
    "-shm": (3007000).to_bytes(4, sys.byteorder),
    "-journal": bytes.fromhex("d9d505f920a163d7"),
}


@pytest.mark.parametrize("name", SIDES)
def test_what_sqlite_leaves_when_it_is_killed_is_taken_for_its_own(
    tmp_path: Path, whole: SweepResult, name: str
) -> None:
    store = tmp_path / "a.db"
    contents = [b"", MARKS[name] + bytes(100), bytes(32768)]
    for content in [*contents, MARKS[name][:3]] if name == "-shm" else contents:
        store.write_bytes(whole.path.read_bytes())
        store.with_name(store.name + name).write_bytes(content)
        require_same_bits(hp.study.open_sweep(store).dataset, whole.dataset)
        store.with_name(store.name + name).write_bytes(content)
        require_same_bits(run_sweep(STUDY, store, resume=True).dataset, whole.dataset)


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_readers_of_this_process_keep_the_locks_of_sqlite(tmp_path: Path) -> None:
    """A look at its shared memory, once closed, would end them all: it is not looked at then."""
    path = tmp_path / "a.db"
    with SweepStore(path, STUDY) as store:
        store.add(case_outcomes(STUDY, [0], 1))
        locks = Path("/proc/locks")
        inode = f":{path.with_name('a.db-shm').stat().st_ino} "
        mine = [line for line in locks.read_text().splitlines() if inode in line + " "]
        assert hp.study.open_sweep(path).done == 1
        after = [line for line in locks.read_text().splitlines() if inode in line + " "]
        assert len(after) == len(mine) > 0


@pytest.fixture(scope="module")
def lock_elsewhere() -> Iterator[Callable[[Path], str]]:
    """What another process meets that wants to write to a store."""
    code = (
        "import sys; from pathlib import Path\n"
        "from hexapod_pin.study.runs.store_lock import StoreLock\n"
        "for line in sys.stdin:\n"
        "    try: StoreLock(Path(line[:-1])).release(); print('free', flush=True)\n"
        "    except Exception as error: print(type(error).__name__, flush=True)"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as other:
        assert other.stdin is not None and other.stdout is not None

        def met(store: Path) -> str:
            other.stdin.write(f"{store}\n")
            other.stdin.flush()
            return other.stdout.readline().strip()

        yield met


def test_one_lock_for_all_spellings_of_a_store(
    tmp_path: Path, monkeypatch: Any, lock_elsewhere: Callable[[Path], str]
) -> None:
    """A second lock of this process, once given back, would end the first."""
    folder = tmp_path / "folder"
    folder.mkdir()
    (tmp_path / "other").symlink_to(folder)
    monkeypatch.chdir(folder)
    lock = StoreLock(folder / "a.db")
    for spelling in (Path("a.db"), tmp_path / "other" / "a.db", folder / ".." / "folder" / "a.db"):
        with pytest.raises(StoreLockedError):
            StoreLock(spelling)
    assert lock_elsewhere(folder / "a.db") == "StoreLockedError"
    lock.release()
    lock.release()
    assert lock_elsewhere(folder / "a.db") == "free"
    assert not list(folder.iterdir())


def test_a_lock_where_no_file_can_have_two_names(
    tmp_path: Path, monkeypatch: Any, lock_elsewhere: Callable[[Path], str]
) -> None:
    def refuse(*_: Any) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "link", refuse)
    lock = StoreLock(tmp_path / "a.db")
    assert lock_elsewhere(tmp_path / "a.db") == "StoreLockedError"
    lock.release()
    assert not list(tmp_path.iterdir())


LOCK_AND_SIGNAL = """
import os, signal, sys
from pathlib import Path
from hexapod_pin import stop_signals
from hexapod_pin.study.runs.store_lock import StoreLock

stop_signals.install()
stop_signals.begin()
store, moment = Path(sys.argv[1]), sys.argv[2]
stop = lambda *_: os.kill(os.getpid(), signal.SIGTERM)
if moment == "while it is made":
    StoreLock._lock = stop
try:
    lock = StoreLock(store)
    if moment == "before it is given back":
        stop()
finally:
    print("lock", store.with_name(store.name + "-lock").exists())
"""
"""A process that SIGTERM meets while it takes a lock, or holds one that nobody gives back."""


@pytest.mark.parametrize("moment", ["while it is made", "before it is given back"])
def test_a_signal_leaves_no_lock(tmp_path: Path, moment: str) -> None:
    run = [sys.executable, "-c", LOCK_AND_SIGNAL, str(tmp_path / "a.db"), moment]
    done = subprocess.run(run, check=False, capture_output=True, text=True, timeout=PATIENCE)
    assert done.stdout == "lock True\n" and "StopSignal: SIGTERM" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_lock_that_is_lost_is_given_back(tmp_path: Path) -> None:
    lock = StoreLock(tmp_path / "a.db")
    assert [one.name for one in tmp_path.iterdir()] == ["a.db-lock"]
    del lock
    gc.collect()
    assert list(tmp_path.iterdir()) == []
    again = StoreLock(tmp_path / "a.db")
    again.release()
    again.release()
    assert list(tmp_path.iterdir()) == []


def test_a_forked_child_does_not_give_back_the_lock_of_its_parent(tmp_path: Path) -> None:
    lock = StoreLock(tmp_path / "a.db")
    child = os.fork()
    if child == 0:
        lock.release()
        os._exit(0)
    os.waitpid(child, 0)
    assert [one.name for one in tmp_path.iterdir()] == ["a.db-lock"]
    lock.release()
    assert list(tmp_path.iterdir()) == []


def test_an_empty_file_that_was_there_is_never_removed(tmp_path: Path, monkeypatch: Any) -> None:
    path = tmp_path / "a.db"
    path.touch()
    with pytest.raises(WorkersError):
        run_sweep(STUDY, path, executor=_refusing(monkeypatch))
    assert [one.name for one in tmp_path.iterdir()] == ["a.db"]
    monkeypatch.undo()
    assert run_sweep(STUDY, path, threads=1).done == 3  # the same sweep again is no refusal


# sweeps that end before their first case


def _refusing(monkeypatch: Any) -> Callable[[], ThreadPoolExecutor]:
    """Return what makes a pool whose workers refuse the study."""
    monkeypatch.setattr("hexapod_pin.study.runs.workers.run_task", lambda *task: b"!no")
    return lambda: ThreadPoolExecutor(1)


@pytest.mark.parametrize("address", ["", "  "])
def test_an_empty_address_is_refused_before_anything_is_opened(
    tmp_path: Path, address: str
) -> None:
    error = _raised(lambda: run_sweep(STUDY, tmp_path / "a.db", scheduler=address))
    assert isinstance(error, ParameterError)
    assert (error.name, error.value) == ("scheduler", address)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("address", ["tls://127.0.0.1:1", "x"])
def test_an_address_of_no_scheduler(tmp_path: Path, address: str) -> None:
    distributed = pytest.importorskip("distributed")
    error = _raised(lambda: run_sweep(STUDY, tmp_path / "a.db", scheduler=address))
    assert isinstance(error, WorkersError) and error.kept == 0
    assert not list(tmp_path.iterdir())
    assert not any(  # it would close itself when it is collected, in the midst of anything
        isinstance(one, distributed.Client) and one.status == "connecting"
        for one in gc.get_objects()
    )


def test_a_sweep_without_dask_leaves_no_store(tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    error = _raised(lambda: run_sweep(STUDY, tmp_path / "a.db", scheduler="tcp://127.0.0.1:1"))
    assert isinstance(error, ParameterError) and error.name == "scheduler"
    assert not list(tmp_path.iterdir())


def test_a_first_sweep_that_fails_can_be_begun_again(tmp_path: Path, monkeypatch: Any) -> None:
    path = tmp_path / "a.db"
    with pytest.raises(WorkersError) as error:
        run_sweep(STUDY, path, executor=_refusing(monkeypatch))
    assert error.value.kept == 0 and not list(tmp_path.iterdir())
    monkeypatch.undo()

    def none() -> ThreadPoolExecutor:
        raise OSError("no pool")

    with refused(OSError, about=("no pool",)):
        run_sweep(STUDY, path, executor=none)
    assert not list(tmp_path.iterdir())
    assert run_sweep(STUDY, path, threads=1).done == 3


def test_a_store_that_fails_later_is_kept(tmp_path: Path, monkeypatch: Any) -> None:
    path = tmp_path / "a.db"
    with pytest.raises(RuntimeError), SweepStore(path, STUDY) as store:
        store.add(case_outcomes(STUDY, [0], 1))
        raise RuntimeError
    assert hp.study.open_sweep(path).done == 1
    with pytest.raises(WorkersError):
        run_sweep(STUDY, path, executor=_refusing(monkeypatch), resume=True)
    assert hp.study.open_sweep(path).done == 1


def test_a_sweep_that_was_killed_before_its_first_case_can_be_begun_again(tmp_path: Path) -> None:
    """Its store holds nothing that could be lost; that of another study stays."""
    path = tmp_path / "a.db"
    with SweepStore(path, STUDY):
        pass
    with pytest.raises(OtherStudyError):
        run_sweep(small_study(1, seed=8), path)
    assert run_sweep(STUDY, path, threads=1).done == 3


def test_ctrl_c_before_anything_is_written_leaves_nothing(tmp_path: Path, monkeypatch: Any) -> None:
    def stop(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(store_module, "write_meta", stop)
    with pytest.raises(KeyboardInterrupt):
        run_sweep(STUDY, tmp_path / "a.db")
    assert not list(tmp_path.iterdir())


# full disks


def _sqlite_error(text: str, code: int | None) -> sqlite3.OperationalError:
    error = sqlite3.OperationalError(text)
    if code is not None:
        error.sqlite_errorcode = code
    return error


@pytest.mark.parametrize(
    ("text", "code", "free", "files", "full"),
    [
        ("database or disk is full", 13, 1 << 30, 9, True),
        ("database or disk is full", None, 1 << 30, 9, True),
        ("disk I/O error", 10, 4096, 9, True),
        ("disk I/O error", 4874, 4096, 9, True),  # its shared memory
        ("disk I/O error", None, 4096, 9, True),
        ("unable to open database file", 14, 1 << 30, 0, True),  # no room for the name of a file
        ("disk I/O error", 10, 1 << 30, 9, False),
        ("unable to open database file", 14, 1 << 30, 9, False),
        ("full of something else", 1, 4096, 9, False),
    ],
)
def test_a_full_disk_is_called_full(
    tmp_path: Path, monkeypatch: Any, text: str, code: int | None, free: int, files: int, full: bool
) -> None:
    disk = SimpleNamespace(f_bavail=free // 4096, f_frsize=4096, f_files=10, f_favail=files)
    monkeypatch.setattr(os, "statvfs", lambda _: disk)
    with pytest.raises(SweepStoreError) as error, store_errors(tmp_path / "a.db", 7):
        raise _sqlite_error(text, code)
    assert isinstance(error.value, StoreFullError) is full
    assert error.value.kept == 7


SIZES = (0, 60, 5_000, 40_000, 60_000)
"""Of files, as large as they may be [bytes]: from the lock to the log, what cannot be written."""

SHORT_FILES = """
import resource, sys
from tests.sweep_studies import small_study
from hexapod_pin.study.runs import run_sweep
for most in map(int, sys.argv[1:]):
    resource.setrlimit(resource.RLIMIT_FSIZE, (most, resource.RLIM_INFINITY))
    try: run_sweep(small_study(1), f"{most}/a.db", threads=1); print("done")
    except Exception as error: print(type(error).__name__)
"""


def test_a_file_that_may_not_grow_is_called_full_and_leaves_nothing(tmp_path: Path) -> None:
    """One process meets one limit after the other, each in a folder of its own."""
    sizes = [str(most) for most in SIZES]
    for size in sizes:
        (tmp_path / size).mkdir()
    root = str(Path(__file__).parents[1])
    done = subprocess.run(
        [sys.executable, "-c", SHORT_FILES, *sizes], check=True, text=True,
        capture_output=True, timeout=PATIENCE, cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": root,
             "PYTHONDONTWRITEBYTECODE": "1"},  # else modules are cut off at that size
    )  # fmt: skip
    assert done.stdout.split() == ["StoreFullError"] * len(SIZES), done
    assert [list((tmp_path / size).iterdir()) for size in sizes] == [[]] * len(SIZES)


# damaged rows


TABLES = {
    "meta": ("key", "value"),
    "inputs": ("place", "about", "numbers", "texts"),
    "texts": ("id", "text"),
    "cases": ("number", "digest", "state", "reason", "verdict", "labels", "assumed", "counters",
              "numbers", "sum", "wall_time"),
}  # fmt: skip

VALUES = ("NULL", "5", "-9223372036854775808", "9223372036854775807", "2.5", "9e999", "'5'",
          "'text'", "''", "'[]'", "'{}'", "x''", "CAST(x'fffe' AS TEXT)", "zeroblob(8)",
          "char(0)")  # fmt: skip
"""A value of every type that SQLite knows, and some that are read as others."""


def _damages(table: str, *, apart: bool = True) -> Iterator[str]:
    """Yield what may be done to a table: to one row, to all of them, and to their keys.

    Unless `apart`, each of the three cases gets a value of its own.
    """
    yield f"DELETE FROM {table}"
    yield f"DELETE FROM {table} WHERE rowid = (SELECT max(rowid) FROM {table})" * (table != "meta")
    for column in TABLES[table]:
        keyed = apart or table != "cases" or column == "number"
        for value in VALUES if keyed else ():
            yield f"UPDATE OR IGNORE {table} SET {column} = {value}"
        for k in () if keyed else range(0, len(VALUES), 3):
            whens = " ".join(f"WHEN {row} THEN {x}" for row, x in enumerate(VALUES[k : k + 3]))
            yield f"UPDATE OR IGNORE cases SET {column} = CASE number {whens} ELSE {column} END"
        if table != "meta":
            yield f"UPDATE OR IGNORE {table} SET {column} = {column} || 'x' WHERE rowid = 1"
    if table == "meta":
        for key in MetaTexts.model_fields:
            yield f"DELETE FROM meta WHERE key = '{key}'"
            for value in VALUES if apart else VALUES[::6]:  # the sum over all of them is wrong
                yield f"UPDATE OR IGNORE meta SET value = {value} WHERE key = '{key}'"
        yield "INSERT INTO meta VALUES ('more', 'x')"
    if table == "inputs":
        yield "UPDATE inputs SET place = 7 - place"
        yield "INSERT INTO inputs SELECT place + 9, about, numbers, texts FROM inputs"
    if table == "cases":
        yield "UPDATE cases SET number = number + 1 WHERE number = 2"
        yield "UPDATE cases SET number = -1 - number"
        yield "UPDATE cases SET digest = (SELECT digest FROM cases WHERE number = 2)"


def _damage(path: Path, statement: str, *, forged: bool) -> bool:
    """Damage a store; where `forged`, with checksums that fit. Return whether SQLite took it."""
    connection = sqlite3.connect(path)
    connection.text_factory = lambda data: data.decode("utf-8", "replace")
    connection.execute("PRAGMA synchronous = OFF")
    try:
        with connection:
            connection.execute(statement)
            if forged and "cases" in statement:
                sums = [(checksum(*row), row.number) for row, _ in stored_rows(connection)]
                connection.executemany("UPDATE cases SET sum = ? WHERE number = ?", sums)
            elif forged:
                total = study_sum(connection)
                connection.execute("UPDATE meta SET value = ? WHERE key = 'sum'", (total,))
    except sqlite3.IntegrityError:
        return False
    finally:
        connection.close()
    return True


def _recorded(outcomes: dict[int, Outcome]) -> Callable[..., Any]:
    """Return what stands for `case_outcomes`: the cases have been run before."""

    def again(_study: Any, indices: Iterable[int], _threads: int) -> Iterator[Outcome]:
        yield from (outcomes[index] for index in indices)

    return again


def _require_right(found: SweepResult, whole: SweepResult) -> None:
    """Fail unless a store tells nothing wrong: cases are right, or named as damaged or not run."""
    assert list(found.dataset.coords) == list(whole.dataset.coords)
    for key in ("study", "study_digest", "study_name", "inputs", "versions"):
        assert found.dataset.attrs[key] == whole.dataset.attrs[key]
    reasons = found.dataset["reason"].values
    assert {*reasons} <= {"", DAMAGED, NOT_RUN}
    right = np.flatnonzero(reasons == "")
    for name, array in whole.dataset.variables.items():
        if right.size and (array.dtype.kind == "f" or name == "verdict"):
            got, wanted = (one.isel(case=right) for one in (found.dataset.variables[name], array))
            np.testing.assert_array_equal(got.values, wanted.values)


@pytest.mark.slow
@pytest.mark.parametrize("table", TABLES)
def test_damage_of_any_kind_is_refused_named_or_run_again(
    tmp_path: Path, whole: SweepResult, outcomes: Any, monkeypatch: Any, table: str
) -> None:
    """Every column of every table, with values of every type; rows that are gone."""
    monkeypatch.setattr(runner_module, "case_outcomes", _recorded(outcomes))
    path, repaired = tmp_path / "a.db", 0
    for statement in filter(None, _damages(table, apart=False)):
        path.write_bytes(whole.path.read_bytes())
        if not _damage(path, statement, forged=False):
            continue
        with contextlib.suppress(SweepStoreError):
            _require_right(hp.study.open_sweep(path), whole)
        with contextlib.suppress(SweepStoreError):
            require_same_bits(run_sweep(STUDY, path, resume=True).dataset, whole.dataset)
            repaired += 1
    assert repaired > (20 if table != "texts" else 5)


@pytest.mark.slow
@pytest.mark.parametrize("table", TABLES)
def test_rows_whose_checksums_were_made_to_fit_raise_typed_errors(
    tmp_path: Path, whole: SweepResult, outcomes: Any, monkeypatch: Any, table: str
) -> None:
    monkeypatch.setattr(runner_module, "case_outcomes", _recorded(outcomes))
    path = tmp_path / "a.db"
    for statement in filter(None, _damages(table)):
        path.write_bytes(whole.path.read_bytes())
        if not _damage(path, statement, forged=True):
            continue
        with contextlib.suppress(SweepStoreError):
            assert hp.study.open_sweep(path).dataset is not None
        with contextlib.suppress(SweepStoreError):
            assert run_sweep(STUDY, path, resume=True).dataset is not None


def test_inputs_that_are_missing_are_refused_and_written_again(
    tmp_path: Path, whole: SweepResult
) -> None:
    path = tmp_path / "a.db"
    path.write_bytes(whole.path.read_bytes())
    assert _damage(path, "DELETE FROM inputs", forged=False)
    with pytest.raises(SweepStoreError):
        hp.study.open_sweep(path)
    require_same_bits(run_sweep(STUDY, path, resume=True).dataset, whole.dataset)


@pytest.mark.parametrize(
    "statements",
    [
        "DROP TABLE cases; CREATE VIEW cases AS WITH RECURSIVE n(k) AS (SELECT 1 UNION ALL SELECT "
        "k + 1 FROM n) SELECT k AS number FROM n",
        "CREATE TRIGGER t AFTER INSERT ON cases BEGIN DELETE FROM meta; END",
        "DROP TABLE inputs",
        "ALTER TABLE cases ADD COLUMN more",
    ],
)
def test_tables_of_another_make_are_refused(
    tmp_path: Path, whole: SweepResult, statements: str
) -> None:
    """Such as a view without end, which would be read for ever."""
    path = tmp_path / "a.db"
    path.write_bytes(whole.path.read_bytes())
    connection = sqlite3.connect(path)
    connection.executescript(statements)
    connection.close()
    before = path.read_bytes()
    assert isinstance(_raised(lambda: hp.study.open_sweep(path)), SweepStoreError)
    assert isinstance(_raised(lambda: run_sweep(STUDY, path, resume=True)), SweepStoreError)
    assert path.read_bytes() == before


def test_a_view_or_an_index_of_ones_own_does_no_harm(tmp_path: Path, whole: SweepResult) -> None:
    path = tmp_path / "a.db"
    path.write_bytes(whole.path.read_bytes())
    connection = sqlite3.connect(path)
    connection.executescript("CREATE VIEW mine AS SELECT number FROM cases; "
                             "CREATE INDEX own ON cases (state); ANALYZE")  # fmt: skip
    connection.close()
    require_same_bits(run_sweep(STUDY, path, resume=True).dataset, whole.dataset)


def test_marks_of_sqlite_are_those_that_it_writes(tmp_path: Path) -> None:
    """The files beside a database that is being written, and one in the middle of a change."""
    path = tmp_path / "a.db"
    connection = sqlite3.connect(path, isolation_level=None)
    connection.execute("CREATE TABLE t (a)")
    connection.execute("BEGIN IMMEDIATE")
    connection.execute("INSERT INTO t VALUES (zeroblob(9000000))")  # beyond its cache
    assert store_guard.require_own_sides(path, write=True) is None
    assert path.with_name("a.db-journal").read_bytes()[:8] == MARKS["-journal"]
    connection.execute("ROLLBACK")
    connection.execute("PRAGMA journal_mode = WAL")
    connection.execute("INSERT INTO t VALUES (1)")
    for name in ("-wal", "-shm"):
        head = path.with_name(f"a.db{name}").read_bytes()
        assert head.startswith(MARKS[name]) or head[3:8] == MARKS[name][3:8]
    connection.close()
