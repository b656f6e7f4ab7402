"""Is an error stated an error kept? Scenes that nobody tuned to, drawn anew in every run."""

from __future__ import annotations

import secrets
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from random_scenes import KINDS, draw_scene
from random_scenes.real_drives import REAL_DRIVES

from hexapod_pin.text_table import Table
from studies.promise.rows import SceneResult, judge_scene, settings_of
from studies.promise.runner import read_results, run_scenes
from studies.promise.tables import (
    summary_tables,
    verdict,
    violations,
    without_truth,
)
from studies.study import StudyReport

ACCURACIES = "1e-3,1e-4,1e-5,1e-6,1e-7"
METHODS_JUDGED = "extrapolated-euler,ndf"


@dataclass(frozen=True)
class JudgeDrawn:
    """Draws the scene of a key "seed/index" and judges it."""

    methods: tuple[str, ...]
    accuracies: tuple[float, ...]
    kinds: tuple[str, ...]

    def __call__(self, key: str) -> SceneResult:
        """Return the result of a key."""
        seed, index = map(int, key.split("/"))
        known = {**KINDS, **REAL_DRIVES}
        scene = draw_scene(seed, index, {name: known[name] for name in self.kinds})
        return judge_scene(key, scene, settings_of(self.methods, self.accuracies))


def promise(
    *, scenes: int = 1000, seed: int = 0, only: int = -1, methods: str = METHODS_JUDGED,
    accuracies: str = ACCURACIES, kinds: str = ",".join(KINDS), file: str = "", processes: int = 1,
) -> StudyReport:  # fmt: skip
    """The true error of random scenes against the accuracy asked for.

    Seed 0: that of the file, else a fresh one, which the page tells. `--seed S --only INDEX` draws
    and judges one scene alone. `--file F` keeps a line for each scene and goes on where it ended.
    """
    path = Path(file) if file else None
    seed = seed or _seed_of(path) or secrets.randbelow(10**9)
    judge = JudgeDrawn(
        tuple(methods.split(",")), tuple(map(float, accuracies.split(","))),
        tuple(kinds.split(",")),
    )  # fmt: skip
    indices = range(scenes) if only < 0 else (only,)
    keys = [f"{seed}/{index}" for index in indices]
    results, whole = run_scenes(keys, judge, path=path, processes=processes)
    told, kept = verdict(results)
    parts: list[str | Table] = [
        f"Seed {seed}, {len(results)} of {len(keys)} scenes{'' if whole else ': interrupted'}. "
        "A run counts where the truth is sure to a tenth of the accuracy and the run did not say "
        "that it could not keep it. A scene is drawn again alone by its seed/index: "
        f"`--seed {seed} --only INDEX`.",
        _truths(results), told, *summary_tables(results), violations(results),
        without_truth(results),
    ]  # fmt: skip
    return StudyReport("An error stated is an error kept", parts, met=kept and whole)


def _seed_of(path: Path | None) -> int:
    """Return the seed of the scenes in a file; 0 without any."""
    kept = read_results(path)
    return int(kept[0].key.split("/")[0]) if kept else 0


def _truths(results: Sequence[SceneResult]) -> str:
    """Return by which pairs of methods the truths were found, in words."""
    counts = Counter(result.truth for result in results)
    pairs = ", ".join(f"{pair} in {count}" for pair, count in counts.most_common())
    seconds = sum(result.truth_seconds for result in results)
    rest = sum(run.seconds for result in results for run in result.runs)
    hundred = 100.0 * (seconds + rest) / max(len(results), 1)
    return (
        f"Truth and its check: {pairs}. Wall time: truths {seconds:.0f} s, runs {rest:.0f} s; "
        f"{hundred:.0f} s for 100 scenes on one core."
    )
