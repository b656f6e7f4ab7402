"""Robots from the world: does `hexapod-pin walk FILE` walk them, as they are and repaired?"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from hexapod_pin.errors import HexapodError, ParameterError
from hexapod_pin.robot.robot import load_robot
from hexapod_pin.text_table import Table
from studies.study import StudyReport

WALKS, REFUSED = 0, 2
"""Exit status of a walk that keeps its speed and does not fall, and of a file that is refused."""


@dataclass(frozen=True)
class CommandResult:
    """What a command said: exit status, first line of its answer, and time taken [s]."""

    status: int
    words: str
    seconds: float

    @property
    def walks(self) -> bool:
        """Whether the robot walked."""
        return self.status == WALKS


@dataclass(frozen=True)
class RealRobot:
    """One file: the walk as downloaded and repaired, and what was found in it."""

    file: str
    as_it_is: CommandResult
    repaired: CommandResult
    mass: float | None
    inferred: tuple[str, ...]
    repairs: tuple[str, ...]


def real_robots(folder: Path = Path("urdfs"), duration: float = 10.0) -> StudyReport:
    """Walk every URDF and xacro file of a folder by the command line, with and without --repair."""
    if not folder.is_dir():
        raise ParameterError("folder", str(folder), "a folder with URDF files")
    files = sorted(p for p in folder.iterdir() if p.suffix in (".urdf", ".xacro"))
    rows = [walked(path, duration) for path in files]
    plain, repaired = (sum(run.walks for run in runs) for runs in
                     ([r.as_it_is for r in rows], [r.repaired for r in rows]))  # fmt: skip
    counts = (
        f"{plain} of {len(rows)} files walk as downloaded, {repaired} with `--repair`; default "
        f"gait, {duration:g} s, no other option. A robot walks that keeps 80 % of its nominal "
        "speed, does not fall and keeps its trunk off the ground ([verdict.md](../verdict.md)). "
        "Not walked: refused, with the reason in the last column. FAIL (3): does not walk, or its "
        "torques are not to be trusted. "
        "Sources: [robots' sources](robot_sources.md)."
    )
    return StudyReport(
        title="Robots from the world",
        parts=[counts, _verdicts(rows), _findings(rows)],
    )


def walked(path: Path, duration: float) -> RealRobot:
    """Walk one file both ways and load it for what is found in it."""
    as_it_is = walk_command(path, duration)
    repaired = walk_command(path, duration, "--repair")
    print(f"{path.name}: {as_it_is.status} {repaired.status} {repaired.words}", file=sys.stderr)
    try:
        robot = load_robot(path, repair=True)
    except HexapodError:
        return RealRobot(path.name, as_it_is, repaired, None, (), ())
    return RealRobot(
        path.name, as_it_is, repaired, robot.total_mass, robot.inferred, robot.repaired
    )  # fmt: skip


def walk_command(path: Path, duration: float, *options: str) -> CommandResult:
    """Run `hexapod-pin walk` on a file; return its status with the first line of its answer."""
    begin = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        words = ["walk", str(path), *options, "--quick", "--no-html", "--duration", f"{duration:g}"]
        command = [sys.executable, "-m", "hexapod_pin", *words, "--out", f"{folder}/walk.nc"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    lines = [*done.stdout.splitlines(), *done.stderr.splitlines()]
    first = next((line for line in lines if line.strip()), "")
    return CommandResult(done.returncode, first, time.perf_counter() - begin)


def _verdicts(rows: Iterable[RealRobot]) -> Table:
    """Return the table of verdicts."""
    cells = [
        (
            row.file, _word(row.as_it_is), _word(row.repaired),
            "-" if row.mass is None else f"{row.mass:.4g}", row.repaired.words,
        )
        for row in rows
    ]  # fmt: skip
    return Table("Verdicts", ("file", "as downloaded", "--repair", "mass [kg]", "verdict"), cells)


def _findings(rows: Iterable[RealRobot]) -> Table:
    """Return the table of what was inferred and repaired."""
    cells = [
        (row.file, "<br>".join(row.inferred) or "-", "<br>".join(row.repairs) or "-")
        for row in rows
    ]
    return Table("What was found", ("file", "inferred", "repaired"), cells)


def _word(result: CommandResult) -> str:
    words = {WALKS: "walks", REFUSED: "not walked: refused"}
    return words.get(result.status, f"FAIL ({result.status})")
