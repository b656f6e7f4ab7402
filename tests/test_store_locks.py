"""The lock of a store: one for all spellings and processes, given back whatever happens."""

from __future__ import annotations

import gc
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from hexapod_pin.errors import (
    StoreLockedError,
)
from hexapod_pin.study.runs.store_lock import StoreLock

PATIENCE = 60.0
"""Longest wait for anything: a process that waits for a pipe would wait for ever [s]."""


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
