"""What was measured on: processor, versions, date, load. Names no host and no path."""

from __future__ import annotations

import os
import platform
from dataclasses import dataclass
from datetime import datetime, timezone
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

PACKAGES = ("hexapod-pin", "pin", "numpy", "scipy", "mujoco", "drake", "pybullet")


@dataclass(frozen=True)
class Machine:
    """The machine and the software, when the measurement began.

    Attributes:
        date: in UTC.
        cpu: the processor's name.
        cores: how many the system has.
        system: operating system and architecture.
        python: its version.
        packages: version by package; "not installed" where it is not.
        load: mean number of running processes in the last minute; nan where unknown.
    """

    date: str
    cpu: str
    cores: int
    system: str
    python: str
    packages: dict[str, str]
    load: float

    @classmethod
    def here(cls) -> Machine:
        """Describe this machine, now."""
        return cls(
            date=datetime.now(timezone.utc).strftime("%Y-%m-%d %H:%M UTC"),
            cpu=cpu_model(),
            cores=os.cpu_count() or 1,
            system=f"{platform.system()} {platform.machine()}",
            python=platform.python_version(),
            packages={name: installed(name) for name in PACKAGES},
            load=load(),
        )

    def __str__(self) -> str:
        """Return one paragraph for the head of a report."""
        packages = ", ".join(f"{name} {number}" for name, number in self.packages.items())
        return (
            f"{self.date}. {self.cpu}, {self.cores} cores, {self.system}; one thread. "
            f"Python {self.python}; {packages}. Load (1 min) at the start {self.load:.2f}."
        )


def cpu_model() -> str:
    """Return the processor's name, or its architecture where the system does not give it."""
    info = Path("/proc/cpuinfo")
    if info.is_file():
        for line in info.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def load() -> float:
    """Return the mean number of running processes in the last minute; nan where unknown."""
    return round(os.getloadavg()[0], 2) if hasattr(os, "getloadavg") else float("nan")


def installed(name: str) -> str:
    """Return the version of a package, or "not installed"."""
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"
