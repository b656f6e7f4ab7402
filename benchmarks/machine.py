"""What a figure was measured on: processor, versions, date, load. Names no host and no path."""

from __future__ import annotations

import os
import platform
from datetime import datetime, timezone
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

PACKAGES = ("hexapod-pin", "pin", "libpinocchio", "mujoco", "numpy", "scipy")


def describe() -> dict[str, Any]:
    """Return the machine and the software as JSON-able data."""
    return {
        "date": datetime.now(timezone.utc).strftime("%Y-%m-%d %H:%M UTC"),
        "cpu": cpu_model(),
        "cores": os.cpu_count(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "packages": {name: _version(name) for name in PACKAGES},
        "load": load(),
    }


def cpu_model() -> str:
    """Return the processor's name, or its architecture where the system does not tell."""
    info = Path("/proc/cpuinfo")
    if info.is_file():
        for line in info.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def load() -> float:
    """Return the mean number of running processes in the last minute."""
    return round(os.getloadavg()[0], 2)


def as_text(machine: dict[str, Any], load_after: float) -> str:
    """Return one paragraph for the head of a report."""
    packages = ", ".join(f"{name} {number}" for name, number in machine["packages"].items())
    return (
        f"{machine['date']}. {machine['cpu']}, {machine['cores']} cores, {machine['system']}; "
        f"Python {machine['python']}; {packages}. "
        f"Load (1 min) {machine['load']:.2f} before, {load_after:.2f} after."
    )


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"
