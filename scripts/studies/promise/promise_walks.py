"""10 s and 60 s of every gait, both robots, all contact presets: is the accuracy kept?"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

from random_scenes.named import walk
from random_scenes.robots import WALKERS

from hexapod_pin.control.gait import GAITS
from hexapod_pin.ground.contact.contact import PRESETS
from hexapod_pin.text_table import Table
from studies.promise.rows import SceneResult, judge_scene, settings_of
from studies.promise.runner import run_scenes
from studies.promise.tables import (
    HEAD,
    Shares,
    all_runs,
    verdict,
    violations,
    without_truth,
)
from studies.promise.truth import (
    LONG_RUN_PAIRS,
    MAX_SECONDS,
    PAIRS,
    find_truth,
)
from studies.study import StudyReport

ACCURACIES = "1e-3,1e-4,1e-5,1e-6"


@dataclass(frozen=True)
class JudgeWalk:
    """Judges the walk of a key "robot gait preset seconds".

    Attributes:
        methods, accuracies: what is judged.
        explicit: CPU time that DOP853 may take for the truth [s]; 0: NDF and extrapolated Euler
            alone.
    """

    methods: tuple[str, ...]
    accuracies: tuple[float, ...]
    explicit: float

    def __call__(self, key: str) -> SceneResult:
        """Return the result of a key."""
        robot, gait, preset, seconds = key.split()
        scene = walk(robot, gait, float(seconds), preset=preset)
        pairs = PAIRS if self.explicit > 0.0 else LONG_RUN_PAIRS
        truth = find_truth(scene, min(self.accuracies), max_seconds=self.explicit, pairs=pairs)
        return judge_scene(key, scene, settings_of(self.methods, self.accuracies), truth)


def promise_walks(
    *, durations: str = "10,60", robots: str = ",".join(WALKERS), gaits: str = ",".join(GAITS),
    presets: str = ",".join(PRESETS), methods: str = "extrapolated-euler,ndf",
    accuracies: str = ACCURACIES, explicit_for: float = 10.0,
    explicit_seconds: float = 10 * MAX_SECONDS, file: str = "", processes: int = 1,
) -> StudyReport:  # fmt: skip
    """The true error of long walks against the accuracy asked for.

    Truth: NDF at 1e-12 held against extrapolated Euler at 1e-8, and DOP853 first in the tripods
    of up to `--explicit-for` seconds. `--file` keeps finished walks and goes on.
    """
    names = [  # the short ones first: what Ctrl-C leaves is of all robots, gaits and presets
        f"{robot} {gait} {preset} {seconds}"
        for seconds, preset, gait, robot in product(
            durations.split(","), presets.split(","), gaits.split(","), robots.split(",")
        )
    ]
    asked = tuple(map(float, accuracies.split(",")))
    path = Path(file) if file else None
    results: list[SceneResult] = []
    whole = True
    for checked in (True, False):
        keys = [name for name in names if _is_checked(name, explicit_for) == checked]
        judge = JudgeWalk(tuple(methods.split(",")), asked, explicit_seconds if checked else 0.0)
        found, ended = run_scenes(keys, judge, path=path, processes=processes)
        results += found
        whole &= ended
        if not ended:
            break
    told, kept = verdict(results)
    parts: list[str | Table] = [
        _about(results, len(names)), told, *_tables(results), violations(results),
        without_truth(results),
    ]  # fmt: skip
    return StudyReport("Long walks: error asked for, error got", parts, met=kept and whole)


def _is_checked(name: str, explicit_for: float) -> bool:
    _, gait, _, seconds = name.split()
    return gait == "tripod" and float(seconds) <= explicit_for


def _about(results: Sequence[SceneResult], wanted: int) -> str:
    by_explicit = sum("dop853" in result.truth for result in results)
    counts = Counter(result.key.split()[3] for result in results)
    done = ", ".join(f"{count} of {seconds} s" for seconds, count in counts.items())
    return (
        f"{len(results)} of {wanted} walks ({done}); truth by DOP853 in {by_explicit}, by NDF "
        "held against extrapolated Euler in the others. Strokes and cycles are the package's "
        "defaults."
    )


def _tables(results: Sequence[SceneResult]) -> list[Table]:
    tables = []
    for title, place in (("robot", 0), ("gait", 1), ("contact", 2), ("duration [s]", 3)):
        names = list(dict.fromkeys(result.key.split()[place] for result in results))
        rows = [
            Shares(all_runs([r for r in results if r.key.split()[place] == name])).cells(name)
            for name in names
        ]
        tables.append(Table(f"By {title}", HEAD, rows))
    runs = all_runs(results)
    settings = dict.fromkeys((run.method, run.accuracy) for run in runs)
    rows = [
        Shares([run for run in runs if (run.method, run.accuracy) == one]).cells(
            f"{one[0]} {one[1]:.0e}"
        )
        for one in settings
    ]
    return [Table("By method and accuracy", HEAD, rows), *tables]
