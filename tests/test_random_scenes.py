"""Scenes of the study of accuracy: drawn alone, of every kind, and their truth is one."""

from __future__ import annotations

import numpy as np
import pytest

from hexapod_pin.benchmark.studies.promise_rows import PromiseRun, SceneResult
from hexapod_pin.benchmark.studies.promise_runner import read_results, run_scenes
from hexapod_pin.benchmark.studies.promise_tables import Shares
from hexapod_pin.benchmark.studies.promise_truth import find_truth
from hexapod_pin.validation.random_scenes import KINDS, draw_scene
from hexapod_pin.validation.random_scenes.contacts import FRICTION_LAWS, NORMAL_LAWS, draw_contact
from hexapod_pin.validation.random_scenes.dice import Dice
from hexapod_pin.validation.random_scenes.grounds import TERRAINS, draw_terrain


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


def test_every_law_and_ground_is_drawn() -> None:
    contacts, grounds = (
        [draw(Dice(1, k)) for k in range(400)] for draw in (draw_contact, draw_terrain)
    )
    assert {row[1] for row in contacts} >= {"default", "s1", "s1-printed", "s2", *NORMAL_LAWS}
    assert {row[2] for row in contacts} >= {"default", *FRICTION_LAWS}
    assert {row[1] for row in grounds} == {"flat", *TERRAINS}
    assert sum(row[1] == "default" for row in contacts) > 100  # 0.35 of 400, five deviations


def test_the_truth_of_a_spinning_body_conserves_its_angular_momentum() -> None:
    """World-axes momentum R I w, of a body that nothing touches, to what the truth is sure of."""
    import pinocchio as pin

    scene = draw_scene(1, 0, {"spinning 10 s": KINDS["spinning 10 s"]})
    truth = find_truth(scene, 1e-7)
    assert truth.judges(1e-7)
    trace = scene.run(method="dop853", accuracy=1e-10)
    inertia = scene.scene.robot.model.inertias[1].inertia
    momentum = [
        pin.Quaternion(q[3:7]).matrix() @ inertia @ v[3:6]
        for q, v in zip(trace.q, trace.v, strict=True)
    ]
    scale = float(np.linalg.norm(momentum[0]))
    np.testing.assert_allclose(
        momentum, np.tile(momentum[0], (len(momentum), 1)), atol=1e-7 * scale
    )


def run(error: float, estimate: float, said_so: bool = False, judged: bool = True) -> PromiseRun:
    return PromiseRun("ndf", 1e-6, error, estimate, said_so, "", 1e-9, judged, 1, 0.0)


def test_shares_leave_out_what_was_said_or_is_not_known() -> None:
    runs = [
        run(5e-7, 1e-6),
        run(2e-6, 1e-6),
        run(1.0, 0.0, said_so=True),
        run(1.0, 0.0, judged=False),
    ]
    shares = Shares(runs)
    assert (shares.within, shares.within_beyond, shares.covered) == (0.5, 1.0, 0.5)
    assert shares.overestimate == pytest.approx((2.0 + 0.5) / 2)
    assert not shares.kept
    assert Shares(runs[:1]).kept
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

    path = tmp_path / "rows.jsonl"
    results, whole = run_scenes(["1/0", "1/1", "1/2"], judge, path=path)
    assert not whole and [r.key for r in results] == ["1/0", "1/1"] == [
        r.key for r in read_results(path)
    ]
    asked.clear()
    assert run_scenes(["1/0", "1/1"], judge, path=path) == (results, True)
    assert asked == []
