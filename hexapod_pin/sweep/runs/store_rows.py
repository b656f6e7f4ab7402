"""The rows of a store: each carries a checksum of all that it means, its shared texts included."""

from __future__ import annotations

import sqlite3
import zlib
from collections.abc import Iterator
from typing import Any, NamedTuple

from hexapod_pin.sweep.runs.outcome import Outcome
from hexapod_pin.sweep.runs.store_file import DONE, FAILED


class CaseRow(NamedTuple):
    """What the row of a case means, in the order of its checksum."""

    number: int  # index of the case in its study
    digest: str
    state: int  # DONE or FAILED
    reason: str
    verdict: str
    labels: str | None  # JSON
    assumed: str | None  # JSON
    counters: str  # JSON
    numbers: bytes
    wall_time: float  # [s]


def row_of(outcome: Outcome) -> CaseRow:
    """Return the row of what became of a case."""
    return CaseRow(
        outcome.index, outcome.digest, FAILED if outcome.reason else DONE, outcome.reason,
        outcome.verdict, outcome.labels or None, outcome.assumed or None, outcome.counters,
        outcome.numbers, float(outcome.wall_time),
    )  # fmt: skip


def write_rows(connection: sqlite3.Connection, rows: list[CaseRow], known: dict[str, int]) -> None:
    """Insert rows within a transaction of the caller's.

    Args:
        connection: to the store.
        rows: none of which is there.
        known: numbers of texts that many cases share; new ones are added.
    """
    for row in rows:
        labels, assumed = (_text(connection, text, known) for text in (row.labels, row.assumed))
        connection.execute(
            f"INSERT INTO cases VALUES ({', '.join('?' * 11)})",
            (*row[:5], labels, assumed, row.counters, row.numbers, checksum(*row), row.wall_time),
        )


def _text(connection: sqlite3.Connection, text: str | None, known: dict[str, int]) -> int | None:
    """Return the number of a text that many cases share."""
    if text is None:
        return None
    if text not in known:
        connection.execute("INSERT OR IGNORE INTO texts (text) VALUES (?)", (text,))
        row = connection.execute("SELECT id FROM texts WHERE text = ?", (text,))
        known[text] = int(row.fetchone()[0])
    return known[text]


def stored_rows(connection: sqlite3.Connection) -> Iterator[tuple[CaseRow, bool]]:
    """Yield the rows in the order of their cases, and whether each is what was written."""
    texts = dict(connection.execute("SELECT id, text FROM texts"))
    rows = connection.execute(
        "SELECT number, digest, state, reason, verdict, labels, assumed, counters, numbers, "
        "wall_time, sum FROM cases ORDER BY number"
    )
    for *values, total in rows:
        row = CaseRow._make(values)
        row = row._replace(labels=texts.get(values[5]), assumed=texts.get(values[6]))
        yield row, checksum(*row) == total


def checksum(*values: Any) -> int:
    """Return the CRC-32 of values with their types."""
    total = 0
    for value in values:
        data = value if isinstance(value, bytes) else repr(value).encode()
        head = f"{type(value).__name__} {len(data)};".encode()
        total = zlib.crc32(data, zlib.crc32(head, total))
    return total
