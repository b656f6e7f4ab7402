"""Runs the scenes of a study one after the other or in processes; resumable, and stops cleanly."""

from __future__ import annotations

import multiprocessing
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

from hexapod_pin.errors import SimulationInterrupted
from hexapod_pin.study.runs.worker_main import end_with_parent
from studies.promise.rows import SceneResult

Judge = Callable[[str], SceneResult]
"""Runs the scene of a key."""


def read_results(path: Path | None) -> list[SceneResult]:
    """Return the results kept in a file of JSON lines; none where there is no file."""
    if path is None or not path.exists():
        return []
    lines = path.read_text(encoding="utf-8").splitlines()
    return [SceneResult.from_json(line) for line in lines if line.endswith("}")]


def run_scenes(
    keys: Sequence[str], judge: Judge, *, path: Path | None = None, processes: int = 1
) -> tuple[list[SceneResult], bool]:
    """Run the scenes that a file does not hold yet, appending each as it ends.

    Args:
        keys: the scenes.
        judge: runs one; with several processes it must be one that can be pickled.
        path: JSON lines; None: nothing is kept.
        processes: how many at once.

    Returns:
        The results in the order of the keys, and whether all are there: Ctrl-C ends early, and
        keeps what is done.
    """
    done = {result.key: result for result in read_results(path)}
    missing = [key for key in keys if key not in done]
    try:
        for result in _each(missing, judge, processes):
            done[result.key] = result
            if path is not None:
                _append(path, result.to_json())
            left = sum(key not in done for key in keys)
            worst = max((run.ratio for run in result.runs if run.counted), default=None)
            told = "none counted" if worst is None else f"x{worst:.2g}"
            print(f"{result.name}: {told}; {left} left", file=sys.stderr, flush=True)
    except (KeyboardInterrupt, SimulationInterrupted):
        print("interrupted; what is done is kept", file=sys.stderr)
    return [done[key] for key in keys if key in done], all(key in done for key in keys)


def _append(path: Path, line: str) -> None:
    """Append a line, on one of its own where a killed writer has left half of one."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a+b") as file:
        if file.tell() > 0:
            file.seek(-1, os.SEEK_END)
            line = line if file.read(1) == b"\n" else f"\n{line}"
        file.write(f"{line}\n".encode())


def _each(keys: Sequence[str], judge: Judge, processes: int) -> Iterator[SceneResult]:
    """Yield results as they end."""
    if processes <= 1:
        yield from map(judge, keys)
        return
    with ProcessPoolExecutor(processes, initializer=end_with_parent) as pool:
        waiting = [pool.submit(judge, key) for key in keys]
        try:
            for future in as_completed(waiting):
                yield future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for child in multiprocessing.active_children():
                child.terminate()
            raise
