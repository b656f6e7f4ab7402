"""What the doors of calls leave out of what is public, each with its reason."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

from fuzz.public_names import CONSTRUCTOR, PublicCall, public_calls
from hexapod_pin.errors import HexapodError

RUN = "called by a run with what the run made itself"

LEFT_OUT: Mapping[str, str] = {
    "view.view": "opens a browser, and stays until Ctrl-C",
    "view.live_viewer": "starts a server that a browser connects to",
    "FeedbackController()": "a protocol: nothing is made of it",
    "TorqueMap.from_group": "takes what a file was read into: the files have doors of their own",
    "GaitEnergy.from_group": "takes what a file was read into: the files have doors of their own",
    "Summary.from_data": "takes what a run or a file was read into",
    "FootControl.update": RUN, "FeedbackController.update": RUN,
}  # fmt: skip
"""Public calls that no input goes to."""

SOUND_ONLY: Mapping[str, str] = {
    "run_sweep.scheduler": "waits for as long as Dask does for a scheduler that does not answer",
    "register_controller.kind": "a kind that is registered stays registered",
}
"""Parameters that are only given what they take."""

LONG_NUMBERS: Mapping[str, str] = {
    "tune.budget": "many runs are what a large number asks for",
    "tune.population": "many runs are what a large number asks for",
}
"""Parameters that are given anything odd but numbers: large ones are allowed, and take long."""


def reason_for_sound(call: PublicCall, parameter: str) -> str:
    """Return why a parameter is only given what it takes; empty where it is given anything."""
    if call.kind == CONSTRUCTOR and issubclass(call.owner, HexapodError):
        return "an error is made by the package itself"
    return SOUND_ONLY.get(f"{call.name}.{parameter}", "")


@cache
def walked() -> tuple[str, ...]:
    """Return the names of all public calls that inputs go to."""
    return tuple(name for name in public_calls() if name not in LEFT_OUT)
