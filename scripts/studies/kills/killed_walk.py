"""A long walk from checkpoint to checkpoint, its process killed at random moments.

A child process walks on from the last trace file and saves the next; the parent kills it with
SIGKILL at moments drawn anew, starts another, and at the end holds the state against that of one
run without a stop, in a process of its own beside them.
"""

from __future__ import annotations

import random
import secrets
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import hexapod_pin as hp
from hexapod_pin.study.runs.worker_main import end_with_parent
from hexapod_pin.text_table import Table
from studies.study import StudyReport, verdict

CYCLE = 2.4
"""Of the gait [s]."""

FIRST_PIECE = 2.0
"""Time within which the process of the first piece is killed [s]."""

SCRIPTS = str(Path(__file__).resolve().parents[2])

WALK_ON = f"import sys; sys.path.append({SCRIPTS!r}); " + (
    "from studies.kills.killed_walk import walk_on; walk_on({!r}, {!r}, {})"
)


def walk_on(before: str, after: str, cycles: int) -> None:
    """Walk on from the end of a trace file, or from the start; save the next one."""
    end_with_parent()
    start = hp.load_trace(before).checkpoint if before else None
    control = hp.KinematicControl(hp.Gait.tetrapod(stroke=0.14, cycle_time=CYCLE))
    hp.simulate(
        hp.Scene(hp.load_robot("kharagpur")), control, duration=cycles * CYCLE, initial=start,
        method="implicit-euler", step=2e-3, sample=CYCLE, allow=True,
    ).save(after)  # fmt: skip


def killed_walk(*, hours: float = 24.0, pieces: int = 48, kills: int = 24) -> StudyReport:
    """A walk in pieces whose processes are killed, beside one without a stop; 168 h are a week."""
    cycles = round(hours * 3600.0 / CYCLE / pieces)
    seed = secrets.randbelow(10**9)
    with tempfile.TemporaryDirectory() as folder:
        begin = time.perf_counter()
        unstopped = str(Path(folder) / "whole.nc")
        with subprocess.Popen(_command("", unstopped, cycles * pieces)) as child:
            killed = _in_pieces(Path(folder), cycles, pieces, kills, random.Random(seed))
        if child.returncode != 0:
            raise RuntimeError(f"the walk without a stop ended with status {child.returncode}")
        last, whole = hp.load_trace(Path(folder) / f"{pieces}.nc"), hp.load_trace(unstopped)
        spent = time.perf_counter() - begin
        left = sorted(path.name for path in Path(folder).iterdir())
    bad = sum(int(np.count_nonzero(~np.isfinite(array))) for array in (whole.q, whole.v))
    same = np.array_equal(last.q[-1], whole.q[-1]) and np.array_equal(last.v[-1], whole.v[-1])
    norm = float(np.abs(np.linalg.norm(whole.q[:, 3:7], axis=1) - 1.0).max())
    orphans = [name for name in left if name.endswith(".tmp")]
    rows = [
        ("simulated [h]", f"{last.time[-1] / 3600.0:.4g}", "-"),
        ("pieces", str(pieces), "-"),
        ("processes killed", str(killed), "-"),
        ("same bits as without a stop", str(same), verdict(same)),
        ("numbers not finite, without a stop", str(bad), verdict(bad == 0)),
        ("quaternion norm less 1, without a stop", f"{norm:.1e}", verdict(norm <= 1e-12)),
        ("temporary files left", str(len(orphans)), verdict(not orphans)),
        ("computing, both at once [s]", f"{spent:.0f}", "-"),
    ]
    about = f"kharagpur, tetrapod, implicit-euler at 2 ms; kills by seed {seed}, drawn anew."
    return StudyReport("A walk that is killed and goes on", [about, Table("", HEAD, rows)])


HEAD = ("", "found", "result")


def _in_pieces(folder: Path, cycles: int, pieces: int, kills: int, rng: random.Random) -> int:
    """Walk piece by piece; kill so many of the processes that do it. Return how many."""
    doomed = rng.sample(range(pieces), min(kills, pieces))
    killed, longest = 0, FIRST_PIECE
    for piece in range(pieces):
        before = str(folder / f"{piece}.nc") if piece else ""
        after = str(folder / f"{piece + 1}.nc")
        command = _command(before, after, cycles)
        if piece in doomed:
            with subprocess.Popen(command) as child:
                time.sleep(rng.uniform(0.0, longest))
                child.kill()
            killed += child.returncode == -9
        begin = time.perf_counter()
        subprocess.run(command, check=True)
        longest = time.perf_counter() - begin
        print(f"piece {piece + 1} of {pieces}, {killed} killed", file=sys.stderr, flush=True)
    return killed


def _command(before: str, after: str, cycles: int) -> list[str]:
    """Return the command of a process that walks on."""
    return [sys.executable, "-c", WALK_ON.format(before, after, cycles)]
