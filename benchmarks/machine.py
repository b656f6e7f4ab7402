"""What a figure was measured on: processor, versions, date, load. Names no host and no path."""

from __future__ import annotations

import os
import platform
from datetime import datetime, timezone
from typing import Any

from hexapod_pin.benchmark.machine import cpu_model, installed, load

__all__ = ["as_text", "describe", "load"]

PACKAGES = ("hexapod-pin", "pin", "libpinocchio", "mujoco", "numpy", "scipy")


def describe() -> dict[str, Any]:
    """Return the machine and the software as JSON-able data."""
    return {
        "date": datetime.now(timezone.utc).strftime("%Y-%m-%d %H:%M UTC"),
        "cpu": cpu_model(),
        "cores": os.cpu_count(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "packages": {name: installed(name) for name in PACKAGES},
        "load": load(),
    }


def as_text(machine: dict[str, Any], load_after: float) -> str:
    """Return one paragraph for the head of a report."""
    packages = ", ".join(f"{name} {number}" for name, number in machine["packages"].items())
    return (
        f"{machine['date']}. {machine['cpu']}, {machine['cores']} cores, {machine['system']}; "
        f"Python {machine['python']}; {packages}. "
        f"Load (1 min) {machine['load']:.2f} before, {load_after:.2f} after."
    )
