"""Names around a store that are somebody else's, rows that are damaged, sweeps that never began."""

from __future__ import annotations

import gc
import os
import socket
import sqlite3
import stat
import sys
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from refusals import ANY, refused

import hexapod_pin as hp
from hexapod_pin.errors import (
    OtherStudyError,
    ParameterError,
    SweepStoreError,
    WorkersError,
)
from hexapod_pin.study.runs import SweepResult, run_sweep, store_file, store_guard, store_lock
from hexapod_pin.study.runs import store as store_module
from hexapod_pin.study.runs.store import SweepStore
from hexapod_pin.study.runs.store_lock import StoreLock
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
    """Under each name of a store, whether its sweep is begun or gone on with, or only read."""
    precious = Precious(tmp_path, b"keys")
    folder = tmp_path / "sweep"
    folder.mkdir()
    store = folder / "a.db"
    if begun and name:
        store.write_bytes(whole.path.read_bytes())
    THINGS[thing](store.with_name(store.name + name), precious.path)
    calls = [lambda: run_sweep(STUDY, store, resume=begun)]
    if name != "-lock":
        calls.append(lambda: hp.study.open_sweep(store))
    before = _shown(folder)
    for call in calls:
        error = _raised(call)
        assert isinstance(error, SweepStoreError) and str(store) in error.path, error
        assert _shown(folder) == before
        precious.require_untouched(2 if thing == "hard link" else 1)
        assert not precious.path.with_name("nothing").exists()
        if name:  # what is read is there
            store.write_bytes(whole.path.read_bytes())
            before = _shown(folder)


@pytest.mark.parametrize("thing", THINGS)
def test_an_empty_file_of_somebodys_is_not_written_through(tmp_path: Path, thing: str) -> None:
    """SQLite takes an empty file for a database of its own."""
    precious = Precious(tmp_path, b"")
    store = tmp_path / "a.db"
    THINGS[thing](store, precious.path)
    assert isinstance(_raised(lambda: run_sweep(STUDY, store)), SweepStoreError)
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
    monkeypatch.setattr("hexapod_pin.study.runs.workers.run_task", lambda *task: b"!it has pin 3")
    return lambda: ThreadPoolExecutor(1)


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


@pytest.mark.parametrize("address", ["", "  ", "tcp://127.0.0.1:1"])
def test_no_address_and_no_dask_leave_no_store(
    tmp_path: Path, monkeypatch: Any, address: str
) -> None:
    if address.strip():
        monkeypatch.setitem(sys.modules, "distributed", None)
    with refused(ParameterError, "scheduler", address if not address.strip() else ANY):
        run_sweep(STUDY, tmp_path / "a.db", scheduler=address)
    assert not list(tmp_path.iterdir())


def test_a_first_sweep_that_fails_can_be_begun_again(tmp_path: Path, monkeypatch: Any) -> None:
    path = tmp_path / "a.db"
    with refused(WorkersError, kept=0, about=("pin 3",)):
        run_sweep(STUDY, path, executor=_refusing(monkeypatch))
    assert not list(tmp_path.iterdir())
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
