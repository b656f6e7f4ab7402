"""Files written wholly or not at all, names that are somebody else's, locks of stores."""

from __future__ import annotations

import errno
import gc
import os
import signal
import sqlite3
import stat
import subprocess
import sys
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from refusals import ANY, refused

import hexapod_pin as hp
from hexapod_pin import atomic_file
from hexapod_pin.atomic_file import sweep, write_atomically
from hexapod_pin.errors import (
    OtherStudyError,
    ParameterError,
    StoreLockedError,
    SweepStoreError,
    TraceFileError,
    WorkersError,
)
from hexapod_pin.study.runs import SweepResult, run_sweep, store_file, store_lock
from hexapod_pin.study.runs import store as store_module
from hexapod_pin.study.runs.store import SweepStore
from hexapod_pin.study.runs.store_lock import StoreLock
from hexapod_pin.study.runs.task import case_outcomes
from tests.sweep_studies import require_same_bits, small_study

STUDY = small_study(1)

SIDES = ("-wal", "-shm", "-journal")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> SweepResult:
    return run_sweep(STUDY, tmp_path_factory.mktemp("whole") / "a.db", threads=1)


THINGS: dict[str, Callable[[Path, Path], object]] = {
    "link": lambda path, precious: path.symlink_to(precious),
    "hard link": lambda path, precious: path.hardlink_to(precious),
    "pipe": lambda path, precious: os.mkfifo(path),
    "file": lambda path, precious: path.write_bytes(b"keys" * 8192),
}
"""What may stand at a name, made there; some lead to a file of somebody's."""


def _shown(folder: Path) -> dict[str, Any]:
    """Return all that a folder holds."""
    found = {}
    for path in folder.iterdir():
        state = path.lstat()
        content = path.read_bytes() if stat.S_ISREG(state.st_mode) else b""
        found[path.name] = (state.st_mode, state.st_ino, state.st_nlink, content)
    return found


@pytest.mark.parametrize("name", ["", "-lock", *SIDES])
@pytest.mark.parametrize("thing", THINGS)
def test_what_is_somebody_elses_is_refused_and_left_alone(
    tmp_path: Path, whole: SweepResult, thing: str, name: str
) -> None:
    """Under each name of a store, whether its sweep is begun, gone on with, or only read."""
    store, precious = tmp_path / "a.db", tmp_path / "precious"
    precious.write_bytes(b"keys")
    THINGS[thing](store.with_name(store.name + name), precious)
    calls = [lambda: run_sweep(STUDY, store), lambda: run_sweep(STUDY, store, resume=True)]
    if name != "-lock":
        calls.append(lambda: hp.study.open_sweep(store))
    before = _shown(tmp_path)
    for call in calls:
        with pytest.raises(SweepStoreError) as caught:
            call()
        assert str(store) in caught.value.path and _shown(tmp_path) == before
        if name:  # what is gone on with or read is there
            store.write_bytes(whole.path.read_bytes())
            before = _shown(tmp_path)


@pytest.mark.parametrize("moment", ["lock is made", "lock is opened", "store is opened"])
@pytest.mark.parametrize("thing", ["link", "hard link", "file"])
def test_what_takes_a_name_in_between_is_left_alone(
    tmp_path: Path, monkeypatch: Any, thing: str, moment: str
) -> None:
    """SQLite takes an empty file for a database of its own."""
    store, precious, seen = tmp_path / "a.db", tmp_path / "precious", {}
    precious.touch()
    write, connect = store_lock.write_atomically, sqlite3.connect

    def place(path: Path) -> None:
        path.unlink(missing_ok=True)
        THINGS[thing](path, precious)
        seen.update(_shown(tmp_path))

    def made(path: Path, *rest: Any, **more: Any) -> Path:
        if moment == "lock is opened":
            write(path, *rest, **more)
        place(path)
        return path if moment == "lock is opened" else write(path, *rest, **more)

    def opened(*rest: Any, **more: Any) -> sqlite3.Connection:
        monkeypatch.setattr(sqlite3, "connect", connect)
        place(store)
        return connect(*rest, **more)

    if moment == "store is opened":
        monkeypatch.setattr(sqlite3, "connect", opened)
    else:
        monkeypatch.setattr(store_lock, "write_atomically", made)
    with pytest.raises(SweepStoreError):
        run_sweep(STUDY, store)
    assert _shown(tmp_path)["precious"] == seen["precious"]


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


def _refusing(monkeypatch: Any) -> Callable[[], ThreadPoolExecutor]:
    """Return what makes a pool whose workers refuse the study."""
    monkeypatch.setattr("hexapod_pin.study.runs.workers.run_task", lambda *task: b"!it has pin 3")
    return lambda: ThreadPoolExecutor(1)


@pytest.mark.parametrize("address", ["  ", "tcp://127.0.0.1:1"])
def test_no_address_and_no_dask_leave_no_store(
    tmp_path: Path, monkeypatch: Any, address: str
) -> None:
    if address.strip():
        monkeypatch.setitem(sys.modules, "distributed", None)
    with refused(ParameterError, "scheduler", address if not address.strip() else ANY):
        run_sweep(STUDY, tmp_path / "a.db", scheduler=address)
    assert not list(tmp_path.iterdir())


def test_a_first_sweep_that_fails_can_be_begun_again(tmp_path: Path, monkeypatch: Any) -> None:
    """An empty file that was there is never removed."""
    path, there = tmp_path / "a.db", tmp_path / "b.db"
    there.touch()
    for one in (path, there):
        with refused(WorkersError, kept=0, about=("pin 3",)):
            run_sweep(STUDY, one, executor=_refusing(monkeypatch))
    assert list(tmp_path.iterdir()) == [there]
    monkeypatch.undo()

    def none() -> ThreadPoolExecutor:
        raise OSError("no pool")

    with refused(OSError, about=("no pool",)):
        run_sweep(STUDY, path, executor=none)
    assert list(tmp_path.iterdir()) == [there]
    with SweepStore(there, STUDY) as store:
        store.add(case_outcomes(STUDY, [0], 1))
    with refused(WorkersError, kept=1, about=("1 finished cases are kept", "--resume")):
        run_sweep(STUDY, there, executor=_refusing(monkeypatch), resume=True)
    with refused(SweepStoreError, about=("cannot be written",)):
        run_sweep(STUDY, tmp_path / "none" / "a.db")


def test_a_sweep_that_ended_before_its_first_case_can_be_begun_again(
    tmp_path: Path, monkeypatch: Any
) -> None:
    """Its store holds nothing that could be lost; that of another study stays."""
    path = tmp_path / "a.db"
    with SweepStore(path, STUDY):
        pass
    with pytest.raises(OtherStudyError):
        run_sweep(small_study(1, seed=8), path)
    assert run_sweep(STUDY, path, threads=1).done == 3
    path.unlink()

    def stop(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(store_module, "write_meta", stop)
    with pytest.raises(KeyboardInterrupt):
        run_sweep(STUDY, tmp_path / "a.db")
    assert not list(tmp_path.iterdir())


def test_a_lock_that_is_lost_is_given_back_but_not_by_a_forked_child(tmp_path: Path) -> None:
    lock = StoreLock(tmp_path / "a.db")
    child = os.fork()
    if child == 0:
        lock.release()
        os._exit(0)
    os.waitpid(child, 0)
    assert [one.name for one in tmp_path.iterdir()] == ["a.db-lock"]
    del lock
    gc.collect()
    assert list(tmp_path.iterdir()) == []


def _met_elsewhere(store: Path) -> str:
    """Return what another process meets that wants to write to a store."""
    code = (
        "import sys; from pathlib import Path\n"
        "from hexapod_pin.study.runs.store_lock import StoreLock\n"
        "try: StoreLock(Path(sys.argv[1])).release(); print('free')\n"
        "except Exception as error: print(type(error).__name__)"
    )
    run = [sys.executable, "-c", code, str(store)]
    return subprocess.run(run, check=True, capture_output=True, text=True).stdout.strip()


@pytest.mark.parametrize("links", [True, False])
def test_one_lock_for_all_spellings_of_a_store(
    tmp_path: Path, monkeypatch: Any, links: bool
) -> None:
    """Also on a disk where no file can have two names."""
    (tmp_path / "other").symlink_to(tmp_path)
    monkeypatch.chdir(tmp_path)

    def refuse(*_: Any) -> None:
        raise PermissionError(1, "Operation not permitted")

    if not links:
        monkeypatch.setattr(os, "link", refuse)
    lock = StoreLock(tmp_path / "a.db")
    for spelling in (Path("a.db"), tmp_path / "other" / "a.db"):
        with pytest.raises(StoreLockedError):
            StoreLock(spelling)
    assert _met_elsewhere(tmp_path / "a.db") == "StoreLockedError"
    lock.release()
    lock.release()
    assert _met_elsewhere(tmp_path / "a.db") == "free"
    assert [one.name for one in tmp_path.iterdir()] == ["other"]


def left(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_files_are_replaced_or_new_and_have_the_usual_permissions(tmp_path: Path) -> None:
    path, plain = tmp_path / "a.txt", tmp_path / "plain"
    plain.touch()
    for content in (b"new", "new", memoryview(b"new")):
        assert write_atomically(path, content) == path
        assert (path.read_text(), path.stat().st_mode) == ("new", plain.stat().st_mode)
        path.unlink()
    plain.chmod(0o640)
    write_atomically(plain, "second")
    with pytest.raises(FileExistsError):
        write_atomically(plain, "third", replace=False)
    assert (plain.read_text(), plain.stat().st_mode & 0o777) == ("second", 0o640)
    assert left(tmp_path) == ["plain"]


@pytest.mark.parametrize("call", ["write", "replace", "fsync"])
def test_a_full_disk_leaves_the_earlier_file(tmp_path: Path, monkeypatch, call: str) -> None:
    path, real = tmp_path / "a.txt", os.write
    path.write_text("old")

    def full(*given: object, **_: object) -> int:
        if call == "write" and len(given[1]) > 4:
            return real(given[0], given[1][:4])
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(atomic_file.os, call, full)
    with refused(TraceFileError, about=(str(path), os.strerror(errno.ENOSPC), "8")) as caught:
        write_atomically(path, b"12345678")
    assert caught.value.__cause__.errno == errno.ENOSPC
    assert (path.read_text(), left(tmp_path)) == ("old", ["a.txt"])


@pytest.mark.parametrize(
    ("name", "number", "about"),
    [
        ("gone/a", errno.ENOENT, ("/gone ",)),  # the folder that is not there
        ("a\0b", None, ("NUL",)),
        (".", errno.EISDIR, ()),
        ("/dev/null", errno.EINVAL, ()),
        ("circle", errno.ELOOP, (" circle",)),  # where it leads to
        ("link", errno.ELOOP, ("there",)),  # which may be anybody's
    ],
)
def test_names_that_cannot_be_written(tmp_path, name, number, about):
    (tmp_path / "circle").symlink_to("circle")
    (tmp_path / "link").symlink_to(tmp_path / "there")
    (tmp_path / "there").write_text("old")
    shown = os.path.normpath(tmp_path / name.replace("\0", r"\x00"))
    with refused(TraceFileError, about=(shown, *about)) as caught:
        write_atomically(tmp_path / name, b"x")
    assert getattr(caught.value.__cause__, "errno", None) == number
    with refused(TraceFileError, about=(str(tmp_path / "a"), "UTF-8")):
        write_atomically(tmp_path / "a", "\udcff")
    assert left(tmp_path) == ["circle", "link", "there"]
    assert (tmp_path / "there").read_text() == "old" and (tmp_path / "link").is_symlink()


@pytest.mark.parametrize("kind", ["link", "pipe"])
def test_what_takes_the_name_in_between_is_not_written_through(kind, tmp_path, monkeypatch):
    """The finished file takes the name; what stood there in between keeps its content."""
    precious, target = tmp_path / "precious", tmp_path / "a"
    precious.write_text("keys")
    synchronize = os.fsync

    def put(stream: int) -> None:
        synchronize(stream)
        os.symlink(precious, target) if kind == "link" else os.mkfifo(target)

    monkeypatch.setattr(atomic_file.os, "fsync", put)
    write_atomically(target, "new")
    assert (precious.read_text(), target.read_text()) == ("keys", "new")
    assert not target.is_symlink()


def test_what_only_looks_left_behind_stays(tmp_path: Path, monkeypatch) -> None:
    """A pipe is not waited for; files of other machines and of other names are somebody's."""
    mine = atomic_file._prefix(tmp_path / "a")
    monkeypatch.setattr(atomic_file, "_system", lambda: "00000000")
    other = atomic_file._prefix(tmp_path / "a") + "1-0.tmp"
    monkeypatch.undo()
    same, pipe = atomic_file._prefix(tmp_path / "b") + "1-0.tmp", mine + "1-0.tmp"
    for name in (other, same):
        (tmp_path / name).touch()
    os.mkfifo(tmp_path / pipe)
    write_atomically(tmp_path / "a", "x")
    assert left(tmp_path) == sorted([other, same, pipe, "a"])


def test_writers_of_one_name_leave_one_whole_file(tmp_path: Path) -> None:
    path, contents = tmp_path / "a", [bytes([k]) * 200_000 for k in range(8)]
    threads = [threading.Thread(target=write_atomically, args=(path, c)) for c in contents]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert path.read_bytes() in contents
    assert left(tmp_path) == ["a"]


WRITER = """
import os, sys, time
from hexapod_pin import atomic_file
atomic_file._write = lambda *_: (print("writing", flush=True), time.sleep(60))
atomic_file.write_atomically(sys.argv[1], b"whole")
"""


def test_what_a_killed_writer_left_is_swept_and_a_living_one_is_not(tmp_path: Path) -> None:
    path = tmp_path / "a"
    run = [sys.executable, "-c", WRITER, str(path)]
    pipe = {"stdout": subprocess.PIPE, "text": True}
    with subprocess.Popen(run, **pipe) as dead, subprocess.Popen(run, **pipe) as living:
        assert dead.stdout.readline() == living.stdout.readline() == "writing\n"
        assert len(left(tmp_path)) == 2
        dead.send_signal(signal.SIGKILL)
        dead.wait()
        write_atomically(path, "new")
        assert path.read_text() == "new"
        assert [f"-{living.pid}-" in name for name in left(tmp_path) if name != "a"] == [True]
        living.kill()
    assert len(sweep(path)) == 1
    assert left(tmp_path) == ["a"]
