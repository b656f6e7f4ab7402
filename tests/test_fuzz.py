"""Odd inputs through every public door: used, or refused with an error of the package."""

from __future__ import annotations

from typing import Any

import pytest

from hexapod_pin.validation.fuzz import DOORS, attempt, run_campaign

INPUTS = 25
"""Of each door; `make fuzz` tries a million with seeds of the clock."""


@pytest.mark.parametrize("door", DOORS)
def test_odd_inputs_are_used_or_refused(door: str):
    outcomes = [attempt(door, seed) for seed in range(INPUTS)]
    assert [one for one in outcomes if one.kind == "FAULT"] == []
    assert any(one.kind == "refused" for one in outcomes)


PAST = [
    ("height_field", 1795422607063452),
    ("session", 1795422638361331),
    ("session", 1795422638361391),
    ("session", 1795422638361403),
    ("session", 1795422638361427),
    ("session", 1795422638362483),
    ("session", 1795423080303568),
    ("scene", 1795423080304482),
    ("arguments", 1795423080304678),
    ("case", 1795423080304807),
    ("settings", 1795423080307293),
    ("arguments", 1795423313172412),
    ("arguments", 1795423313175160),
]
"""Inputs that once ended in an exception that is none of the package's."""


@pytest.mark.parametrize(("door", "seed"), PAST)
def test_what_once_was_a_fault_is_refused(door: str, seed: int):
    assert attempt(door, seed).kind in ("refused", "used")


def test_what_dies_is_a_fault_and_another_process_goes_on(monkeypatch: pytest.MonkeyPatch):
    from hexapod_pin.validation.fuzz import campaign

    monkeypatch.setattr(campaign._Worker, "begin", kill_the_first(campaign._Worker.begin))
    found = run_campaign([("parameters", 1), ("parameters", 2)], processes=1)
    assert (found[0].kind, found[0].told) == ("FAULT", "the process died")
    assert found[1].kind in ("refused", "used")


def kill_the_first(begin: Any) -> Any:
    """Return `begin` of a worker that dies of its first input."""
    killed = []

    def killing(worker: Any, task: tuple[str, int]) -> None:
        begin(worker, task)
        if not killed:
            worker._process.kill()
            worker._process.join()
        killed.append(task)

    return killing
