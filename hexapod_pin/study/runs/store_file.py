"""The SQLite file of a sweep: how it is opened and checked, and what its errors say."""

from __future__ import annotations

import os
import resource
import sqlite3
import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import lru_cache
from pathlib import Path

from hexapod_pin.errors import ParameterError, StoreFullError, StoreLockedError, SweepStoreError
from hexapod_pin.study.runs.store_guard import (
    SIDES,
    is_same,
    pinned,
    replaced,
    require_own_file,
    require_own_sides,
)

APPLICATION_ID = 0x48585357
"""Of SQLite's header: "HXSW"."""

SCHEMA_VERSION = 1
"""Of SQLite's header (user_version)."""

PATIENCE = 10.0
"""Longest wait for another connection [s]."""

SCHEMA = """
CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE inputs (place INTEGER PRIMARY KEY, about TEXT NOT NULL, numbers BLOB, texts TEXT);
CREATE TABLE texts (id INTEGER PRIMARY KEY, text TEXT NOT NULL UNIQUE);
CREATE TABLE cases (
    number INTEGER PRIMARY KEY,  -- index of the case in its study
    digest TEXT NOT NULL,        -- of the case
    state INTEGER NOT NULL,      -- 1 done, 2 failed
    reason TEXT NOT NULL,        -- why it failed
    verdict TEXT NOT NULL,       -- why it does not walk
    labels INTEGER,              -- of joints and feet (texts)
    assumed INTEGER,             -- what it assumes (texts)
    counters TEXT NOT NULL,      -- JSON
    numbers BLOB NOT NULL,       -- little-endian doubles: meta "quantities", then the way (W, 4)
    sum INTEGER NOT NULL,        -- CRC-32 of all the row means, its texts included
    wall_time REAL NOT NULL      -- [s]
);
"""
"""The tables. Another text of it, comments included, needs another `SCHEMA_VERSION`."""

DONE, FAILED = 1, 2

BUSY, LOCKED, IOERR, CORRUPT, FULL, CANTOPEN, NOTADB = 5, 6, 10, 11, 13, 14, 26
"""SQLite's error codes."""

CODES = {
    "disk is full": FULL,
    "disk I/O error": IOERR,
    "unable to open": CANTOPEN,
    "is locked": BUSY,
    "malformed": CORRUPT,
    "not a database": NOTADB,
}
"""What SQLite's messages say, for releases of Python that do not give the code."""

ROOM = 1 << 16
"""Least that SQLite needs beside the database [bytes]: 32 KiB of shared memory, and its log."""


class StoreConnection(sqlite3.Connection):
    """A connection that is known in this process until it is closed."""

    key: tuple[int, int] | None = None

    def close(self) -> None:
        """Close the connection."""
        super().close()
        self._forget()

    def __del__(self) -> None:
        """Forget a connection that is dropped, whose inode's number another file may get."""
        self._forget()

    def _forget(self) -> None:
        with _guard:
            if self.key is not None:
                _open_here[self.key] -= 1
                self.key = None


_open_here: Counter[tuple[int, int]] = Counter()
_guard = threading.RLock()  # a connection may be dropped while another is opened


def connect(path: Path, *, write: bool) -> StoreConnection:
    """Open a store's file, which is there, and check that it is one; an empty file may be written.

    Raises:
        SweepStoreError: missing, no store, damaged, of a newer schema, or not accessible; or
            something else has the name of one of its files.
    """
    with store_errors(path):
        found = require_own_file(path, write=write)
        # beside the file itself, and not beside a link to it, SQLite puts its own
        file = path.absolute() if write else Path(os.path.realpath(path))
        connection = _open(file, found, write)
        try:
            _check(connection, path, write)
        except BaseException:
            connection.close()
            raise
        return connection


def _open(file: Path, found: os.stat_result, write: bool) -> StoreConnection:
    if write:
        return _connection(file, found, "mode=rw")
    connection = _connection(file, found, "mode=ro")
    try:
        connection.execute("SELECT count(*) FROM sqlite_master")
    except sqlite3.OperationalError:
        connection.close()
        log = file.with_name(file.name + "-wal")
        if log.exists() and log.stat().st_size:
            raise
        # a medium that cannot be written to, where SQLite cannot put its shared memory
        return _connection(file, found, "mode=ro&immutable=1")
    return connection


def _connection(file: Path, found: os.stat_result, query: str) -> StoreConnection:
    """Open a store with its own files beside it; nothing is read yet.

    Raises:
        SweepStoreError: another file has one of the names, or takes it before SQLite opens it.
    """
    key = found.st_dev, found.st_ino
    with _guard, ExitStack() as stack:
        if not _open_here[key]:
            require_own_sides(file, write=query == "mode=rw")
            stack.enter_context(pinned(file, found))
        connection = sqlite3.connect(
            f"{file.as_uri()}?{query}", uri=True, timeout=PATIENCE, isolation_level=None,
            factory=StoreConnection,
        )  # fmt: skip
        connection.key = key
        _open_here[key] += 1
        same = is_same(file, found)
    if not same:
        connection.close()
        raise replaced(file)
    connection.text_factory = _text
    return connection


def _text(data: bytes) -> str:
    """Return a text of the file; one that is damaged is found by the checksum of its row."""
    return data.decode("utf-8", "replace")


def _check(connection: sqlite3.Connection, path: Path, write: bool) -> None:
    tables = connection.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]
    mark, version = (connection.execute(f"PRAGMA {name}").fetchone()[0]
                     for name in ("application_id", "user_version"))  # fmt: skip
    if tables == 0 and (mark, version) in ((0, 0), (APPLICATION_ID, SCHEMA_VERSION)):
        if write:
            _create(connection)
            return
        raise nothing_yet(path)
    if mark != APPLICATION_ID:
        raise SweepStoreError(str(path), "an SQLite file, but no store of a sweep.")
    if version != SCHEMA_VERSION:
        raise SweepStoreError(
            str(path), f"schema version {version}; this release reads {SCHEMA_VERSION}."
        )
    if _tables(connection) != _own_tables():
        raise damaged(path, "its tables are not those of a store")
    found = connection.execute("PRAGMA quick_check(20)").fetchall()
    # newer releases of SQLite also name values of another type: their rows are run again
    faults = [text for (text,) in found if text != "ok" and " value in " not in text]
    if faults:
        raise damaged(path, faults[0])
    if write:
        _set_durable(connection)


def _tables(connection: sqlite3.Connection) -> list[tuple[str, str, str]]:
    """Return how the tables are defined, and triggers on them; indices do no harm."""
    return connection.execute(
        "SELECT type, name, sql FROM sqlite_master WHERE type != 'index' AND lower(tbl_name) IN "
        "('meta', 'inputs', 'texts', 'cases') ORDER BY name"
    ).fetchall()


@lru_cache(maxsize=1)
def _own_tables() -> list[tuple[str, str, str]]:
    connection = sqlite3.connect(":memory:")
    try:
        connection.executescript(SCHEMA)
        return _tables(connection)
    finally:
        connection.close()


def _create(connection: sqlite3.Connection) -> None:
    _set_durable(connection)
    connection.executescript(
        f"BEGIN IMMEDIATE; {SCHEMA} PRAGMA application_id = {APPLICATION_ID}; "
        f"PRAGMA user_version = {SCHEMA_VERSION}; COMMIT;"
    )


def _set_durable(connection: sqlite3.Connection) -> None:
    connection.execute("PRAGMA journal_mode = WAL")
    connection.execute("PRAGMA synchronous = FULL")


def make_single(connection: sqlite3.Connection, path: Path) -> None:
    """Put everything into one file, readable from any medium; a reader of now may keep the log."""
    try:
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        if not os.path.lexists(path.with_name(path.name + "-journal")):  # it would be overwritten
            connection.execute("PRAGMA busy_timeout = 100")
            connection.execute("PRAGMA journal_mode = DELETE")
    except sqlite3.Error:
        pass  # what is committed stands in the log, and is read from there


@contextmanager
def store_errors(path: Path, kept: int | None = None) -> Iterator[None]:
    """Turn SQLite's errors into those of this package.

    Raises:
        StoreFullError: the disk, or what the file may take of it, is full.
        StoreLockedError: another connection holds the file.
        SweepStoreError: anything else.
    """
    try:
        yield
    except (ParameterError, UnicodeDecodeError) as error:  # the latter: of a name in the schema
        raise damaged(path, str(error)) from error
    except sqlite3.Error as error:
        raise _store_error(path, kept, error) from error


def _store_error(path: Path, kept: int | None, error: sqlite3.Error) -> SweepStoreError:
    code = _code(error)
    full = "the disk is full" if code == FULL else ""
    if code in (IOERR, CANTOPEN):  # SQLite does not say why
        full = _lack_of_room(path)
    if full:
        have = f" {kept} finished cases are kept in it;" if kept else ""
        return StoreFullError(
            str(path), f"{full} ({error});{have} make room and continue with --resume "
            "(resume=True).", kept,
        )  # fmt: skip
    if code in (BUSY, LOCKED):
        return StoreLockedError(str(path), f"another connection holds it ({error}).")
    if code in (CORRUPT, NOTADB):
        return damaged(path, str(error))
    return SweepStoreError(str(path), f"cannot be used ({error}).", kept)


def _code(error: sqlite3.Error) -> int:
    """Return SQLite's primary error code; 0 where it is not known."""
    code = getattr(error, "sqlite_errorcode", None)  # from Python 3.11 on
    if code is None:
        return next((number for text, number in CODES.items() if text in str(error)), 0)
    return int(code) & 0xFF


def _lack_of_room(path: Path) -> str:
    """Return why no file of the store can grow; empty where each can."""
    try:
        disk = os.statvfs(path.parent)
    except OSError:
        return ""
    if disk.f_bavail * disk.f_frsize < ROOM or (disk.f_files and not disk.f_favail):
        return "the disk is full"
    most = resource.getrlimit(resource.RLIMIT_FSIZE)[0]
    if most == resource.RLIM_INFINITY:
        return ""
    files = (path.with_name(path.name + ending) for ending in ("", *SIDES))
    largest = max((file.lstat().st_size for file in files if os.path.lexists(file)), default=0)
    return "the limit on file sizes is reached (ulimit -f)" if largest + ROOM > most else ""


def nothing_yet(path: Path) -> SweepStoreError:
    """Return the error of a store whose sweep has not begun."""
    return SweepStoreError(str(path), "holds nothing yet: its sweep has not begun, or ended first.")


def damaged(path: Path, what: str) -> SweepStoreError:
    """Return the error of a store that holds what no sweep has written."""
    return SweepStoreError(
        str(path), f"damaged, or no store ({what}). What SQLite can still read, "
        "`sqlite3 FILE .recover` prints; else remove it and run the study again.",
    )  # fmt: skip
