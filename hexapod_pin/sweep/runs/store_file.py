"""The SQLite file of a sweep: how it is opened and checked, and what its errors say."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from hexapod_pin.errors import ParameterError, StoreFullError, StoreLockedError, SweepStoreError

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
    sum INTEGER NOT NULL,        -- CRC-32 of digest, counters and numbers
    wall_time REAL NOT NULL      -- [s]
);
"""
DONE, FAILED = 1, 2


def connect(path: Path, *, write: bool) -> sqlite3.Connection:
    """Open a store's file and tell that it is one; an empty file may be written.

    Raises:
        SweepStoreError: missing, no store, damaged, of a newer schema, or not accessible.
    """
    if not write and not os.path.isfile(path):
        raise SweepStoreError(str(path), "no such file.")
    with store_errors(path):
        connection = _open(path, write)
        try:
            _check(connection, path, write)
        except BaseException:
            connection.close()
            raise
        return connection


def _open(path: Path, write: bool) -> sqlite3.Connection:
    if write:
        return _connection(path, "mode=rwc")
    connection = _connection(path, "mode=ro")
    try:
        connection.execute("SELECT count(*) FROM sqlite_master")
    except sqlite3.OperationalError:
        connection.close()
        log = path.with_name(path.name + "-wal")
        if log.exists() and log.stat().st_size:
            raise
        # a medium that cannot be written to, where SQLite cannot put its shared memory
        return _connection(path, "mode=ro&immutable=1")
    return connection


def _connection(path: Path, query: str) -> sqlite3.Connection:
    return sqlite3.connect(
        f"{path.absolute().as_uri()}?{query}", uri=True, timeout=PATIENCE, isolation_level=None
    )


def _check(connection: sqlite3.Connection, path: Path, write: bool) -> None:
    tables = connection.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]
    mark, version = (connection.execute(f"PRAGMA {name}").fetchone()[0]
                     for name in ("application_id", "user_version"))  # fmt: skip
    if tables == 0 and mark in (0, APPLICATION_ID):
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
    found = connection.execute("PRAGMA quick_check(1)").fetchone()[0]
    if found != "ok":
        raise _damaged(path, found)
    if write:
        _set_durable(connection)


def _create(connection: sqlite3.Connection) -> None:
    _set_durable(connection)
    connection.executescript(
        f"BEGIN IMMEDIATE; {SCHEMA} PRAGMA application_id = {APPLICATION_ID}; "
        f"PRAGMA user_version = {SCHEMA_VERSION}; COMMIT;"
    )


def _set_durable(connection: sqlite3.Connection) -> None:
    connection.execute("PRAGMA journal_mode = WAL")
    connection.execute("PRAGMA synchronous = FULL")


def make_single(connection: sqlite3.Connection) -> None:
    """Put everything into one file, readable from any medium; a reader of now may keep the log."""
    try:
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
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
    except (ParameterError, UnicodeDecodeError) as error:
        raise _damaged(path, str(error)) from error
    except sqlite3.Error as error:
        text = str(error)
        if "full" in text:
            have = "" if kept is None else f" {kept} finished cases are kept in it;"
            raise StoreFullError(
                str(path), f"the disk is full ({text}).{have} make room and go on with --resume "
                "(resume=True).", kept,
            ) from error  # fmt: skip
        if "locked" in text or "busy" in text:
            raise StoreLockedError(str(path), f"another connection holds it ({text}).") from error
        if "malformed" in text or "not a database" in text or "encrypted" in text:
            raise _damaged(path, text) from error
        raise SweepStoreError(str(path), f"cannot be used ({text}).", kept) from error


def nothing_yet(path: Path) -> SweepStoreError:
    """Return the error of a store whose sweep has not begun."""
    return SweepStoreError(str(path), "holds nothing yet: its sweep has not begun, or ended first.")


def _damaged(path: Path, what: str) -> SweepStoreError:
    return SweepStoreError(
        str(path), f"damaged, or no store ({what}). What SQLite can still read, "
        "`sqlite3 FILE .recover` prints; else remove it and run the study again.",
    )  # fmt: skip
