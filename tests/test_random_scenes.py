"""Scenes of the study of accuracy, drawn alone and of every kind; its shares and its resumption."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from random_scenes import KINDS, draw_scene
from random_scenes.switching import SWITCHING
from studies.promise.rows import PromiseRun, SceneResult
from studies.promise.runner import read_results, run_scenes
from studies.promise.tables import Shares


@pytest.mark.parametrize("kind", KINDS)
def test_a_scene_is_that_of_its_seed_and_index(kind: str) -> None:
    own = {kind: KINDS[kind]}
    first, again, other = (draw_scene(5, index, own) for index in (2, 2, 3))
    assert first.labels.kind == kind
    assert first.labels == again.labels
    assert first.scene.to_dict() == again.scene.to_dict() != other.scene.to_dict() or (
        other.initial is not None and not np.array_equal(first.initial.q, other.initial.q)
    )
    if first.initial is not None:
        np.testing.assert_array_equal(first.initial.q, again.initial.q)
        np.testing.assert_array_equal(first.initial.v, again.initial.v)


@pytest.mark.parametrize("name", SWITCHING)
def test_switching_scenes_run(name: str) -> None:
    trace = replace(SWITCHING[name](), duration=0.04).run(accuracy=1e-3)
    assert np.isfinite(trace.q).all() and np.ptp(trace.q, axis=0).max() > 1e-5


def run(
    error: float, estimate: float, error_reported: bool = False, uncertainty: float = 1e-9
) -> PromiseRun:
    return PromiseRun("ndf", 1e-6, error, estimate, error_reported, "", uncertainty, 1, 0.0)


def test_shares_leave_out_what_was_said_or_is_not_known() -> None:
    runs = [
        run(5e-7, 1e-6),
        run(2e-6, 1e-6),
        run(1.0, 0.0, error_reported=True),
        run(1e-3, 0.0, uncertainty=1e-3),
    ]
    shares = Shares(runs)
    assert (shares.within, shares.within_beyond) == (0.5, 1.0)
    assert (len(shares.error_reported), shares.needless) == (1, 0)
    assert shares.covered == pytest.approx(1 / 3)  # an estimate is one whatever the run says
    assert shares.overestimate == pytest.approx(0.5)
    assert not shares.kept
    assert Shares(runs[:1]).kept
    assert not run(2e-6, 0.0, uncertainty=1e-6).judged
    assert run(1.0, 0.0, uncertainty=1e-2).judged  # a miss is a miss however unsure its size
    # below the truth's uncertainty nothing is known: neither a miss nor an overestimate
    assert run(9e-10, 1e-12).covered and run(1e-12, 2e-9).overestimate == pytest.approx(2.0)


def test_a_run_of_scenes_goes_on_where_it_ended(tmp_path) -> None:
    asked: list[str] = []

    def judge(key: str) -> SceneResult:
        asked.append(key)
        if key == "1/2":
            raise KeyboardInterrupt
        labels = dict.fromkeys(("kind", "robot", "normal", "friction", "terrain", "drive"), "x")
        return SceneResult(key, labels, 1.0, "a; b", 1e-9, 0.0, (), (run(5e-7, 1e-6),))

    path = tmp_path / "new" / "rows.jsonl"
    results, whole = run_scenes(["1/0", "1/1", "1/2"], judge, path=path)
    assert not whole and [r.key for r in results] == ["1/0", "1/1"] == [
        r.key for r in read_results(path)
    ]
    asked.clear()
    assert run_scenes(["1/0", "1/1"], judge, path=path) == (results, True)
    assert asked == []
    path.write_text(path.read_text()[:-9])  # killed while it wrote the second
    assert run_scenes(["1/0", "1/1"], judge, path=path) == (results, True)
    assert asked == ["1/1"] and read_results(path) == results
