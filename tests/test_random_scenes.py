"""Scenes of the study of accuracy: drawn alone, of every kind, and their truth is one."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from random_scenes import KINDS, draw_scene
from random_scenes.contacts import FRICTION_LAWS, NORMAL_LAWS, draw_contact
from random_scenes.draws import Draws
from random_scenes.grounds import TERRAINS, draw_terrain
from random_scenes.named import point_on_a_slope
from random_scenes.switching import SWITCHING
from studies.promise.promise_orders import OrderRow
from studies.promise.rows import PromiseRun, SceneResult
from studies.promise.runner import read_results, run_scenes
from studies.promise.tables import Shares
from studies.promise.truth import find_truth

from hexapod_pin.validation.position_error import PositionError


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
        [draw(Draws(1, k)) for k in range(400)] for draw in (draw_contact, draw_terrain)
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


def test_a_point_that_sticks_and_slides_is_known_by_hand() -> None:
    """Two methods come within what a switch that is not located leaves: 1e-4 m/s for 0.1 s.

    It slips within the first 10 ms; its way is about 0.5 (g sin - 0.3 g cos) t^2 = 0.39 m.
    """
    scene = point_on_a_slope()
    assert scene.answer is not None
    for method in ("ndf", "dop853"):
        found = replace(scene, duration=0.1).run(method=method, accuracy=1e-8).q
        assert PositionError.between(found, scene.answer[: len(found)]).q < 1e-5
    way = np.linalg.norm(scene.answer[-1, :3] - scene.answer[0, :3])
    pull = 9.81 * (math.sin(0.6) - 0.3 * math.cos(0.6))
    assert way == pytest.approx(0.5 * pull * 0.5**2, rel=5e-2)


@pytest.mark.parametrize("name", SWITCHING)
def test_switching_scenes_run(name: str) -> None:
    """Each ends by the default method, and something moves."""
    trace = replace(SWITCHING[name](), duration=0.04).run(accuracy=1e-3)
    assert np.isfinite(trace.q).all() and np.ptp(trace.q, axis=0).max() > 1e-5


def test_order_of_errors_that_follow_the_accuracy() -> None:
    asked = (1e-4, 1e-5, 1e-6, 1e-7)
    follows = OrderRow("a", "ndf", asked, tuple(0.3 * one for one in asked), 1e-12)
    assert follows.exponent == pytest.approx(1.0) and follows.worst == pytest.approx(0.3)
    by_chance = OrderRow("a", "ndf", asked, (1e-5,) * 4, 1e-12)
    assert by_chance.exponent == pytest.approx(0.0, abs=1e-9)
    assert math.isnan(OrderRow("a", "ndf", asked, (1e-5,) * 4, 1e-5).exponent)
    held = (1e-5, *asked[1:])  # one run under two names
    doubled = OrderRow("a", "ndf", asked, (7e-6, 7e-6, 3e-7, 3e-8), 1e-12, held)
    three = OrderRow("a", "ndf", asked[1:], (7e-6, 3e-7, 3e-8), 1e-12)
    assert doubled.exponent == three.exponent


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
