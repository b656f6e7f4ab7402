"""What became of one case, as a store keeps it and as a worker sends it: text and bytes."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass

from hexapod_pin.results.summary import Summary
from hexapod_pin.results.summary_verdict import summary_verdict
from hexapod_pin.simulation.case import Case
from hexapod_pin.sweep.runs.case_numbers import case_numbers, labels_of

TEXTS = ("digest", "reason", "verdict", "labels", "assumed", "counters")
"""Text of an outcome."""


@dataclass(frozen=True)
class Outcome:
    """What became of one case.

    Attributes:
        index: of the case in its study.
        digest: of the case; empty where there is none.
        reason: why it failed; empty of a case that was run.
        verdict: why it does not walk; empty where it does.
        labels: of its joints and feet, as JSON.
        assumed: what it assumes, as JSON.
        counters: steps, evaluations, ... as JSON.
        numbers: its numbers, in the order of `case_numbers`, little-endian doubles.
        wall_time: from its planning to its end [s]; of a failed case 0.
    """

    index: int
    digest: str
    reason: str
    verdict: str = ""
    labels: str = ""
    assumed: str = ""
    counters: str = ""
    numbers: bytes = b""
    wall_time: float = 0.0


def outcome_of(index: int, case: Case | Exception, result: object) -> Outcome:
    """Return what became of a case: numbers of a summary, the reason of an error."""
    digest = case.digest if isinstance(case, Case) else ""
    if not isinstance(result, Summary):
        return Outcome(index, digest, failure(result))
    verdict = summary_verdict(result)
    return Outcome(
        index, digest, "", verdict.reason, labels_of(result),
        json.dumps(list(result.meta.get("assumed", ()))), json.dumps(dict(result.counters)),
        case_numbers(result, verdict).astype("<f8").tobytes(),
        float(result.meta.get("wall_time", 0.0)),
    )  # fmt: skip


def failure(error: object) -> str:
    """Return why a case failed, in one line."""
    return " ".join(f"{type(error).__name__}: {error}".split())


def to_bytes(outcomes: Iterable[Outcome]) -> bytes:
    """Return outcomes as a message: one line of JSON, then the numbers; texts stand in it once."""
    texts: dict[str, int] = {}
    rows, numbers = [], []
    for one in outcomes:
        places = [texts.setdefault(getattr(one, name), len(texts)) for name in TEXTS]
        rows.append([one.index, *places, one.wall_time, len(one.numbers)])
        numbers.append(one.numbers)
    head = json.dumps({"texts": list(texts), "rows": rows}).encode()
    return b"\n".join([head, b"".join(numbers)])


def from_bytes(message: bytes) -> list[Outcome]:
    """Return the outcomes of a message."""
    head, _, numbers = message.partition(b"\n")
    data = json.loads(head)
    found, place = [], 0
    for index, *texts, wall_time, size in data["rows"]:
        words = {name: data["texts"][k] for name, k in zip(TEXTS, texts, strict=True)}
        own = numbers[place : place + size]
        found.append(Outcome(index, **words, numbers=own, wall_time=wall_time))
        place += size
    return found
