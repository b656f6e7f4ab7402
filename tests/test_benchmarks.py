"""Benchmarks run, shortened; MuJoCo has our robot and servos; timed and checked runs agree."""

from __future__ import annotations

import dataclasses
import importlib
import json
import socket
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import mujoco
import numpy as np
import pinocchio as pin
import pytest

import hexapod_pin as hp
from hexapod_pin import native
from hexapod_pin.simulation.plant import native_plant

FOLDER = Path(__file__).resolve().parent.parent / "benchmarks"
STEP = 1e-3


@pytest.fixture(scope="module")
def bench() -> Iterator[dict[str, ModuleType]]:
    """Every module of benchmarks/, imported as its scripts import each other."""
    sys.path.insert(0, str(FOLDER))
    names = [path.stem for path in FOLDER.glob("*.py")]
    yield {name: importlib.import_module(name) for name in names}
    sys.path.remove(str(FOLDER))
    for name in names:
        del sys.modules[name]


@pytest.fixture(scope="module")
def walking(bench: dict[str, ModuleType]):
    """A tripod of half a second."""
    scene = hp.Scene(hp.load_robot("kharagpur"))
    return bench["motions"].Motion.of(scene, hp.KinematicControl(hp.Gait.tripod()), 0.5)


def test_step_cost_writes_speeds_with_errors(bench, tmp_path, capsys) -> None:
    """Quick form: both files, an error for every engine and motion, same bits, no host or path."""
    assert bench["step_cost"].main(["--quick", "--out", str(tmp_path)]) == 0
    page = (tmp_path / "step_cost.md").read_text()
    assert capsys.readouterr().out.strip() == page.strip()
    text = (tmp_path / "step_cost.json").read_text()
    found = json.loads(text)
    assert found["same_bits"] is True
    assert found["dense_difference"] < 1e-9
    for engine in ("step", "sampled", "pyramidal", "elliptic", "pinocchio"):
        for motion in ("stand", "tripod", "tetrapod"):
            for contact in ("s1", "s2"):
                values = found["samples"][f"{engine}/{motion}/{contact}"]
                assert len(values) == found["size"]["rounds"] and min(values) > 0.0
    timed = [name for name in found["samples"] if name.split("/")[0] in ("step", "pyramidal")]
    for name in timed:
        accuracy = found["accuracy"][name]
        # a 1 ms walk that lost the robot would be off by centimetres
        assert 0.0 < accuracy["first_second"] <= accuracy["whole"] < 5e-3
        assert accuracy["counters"]["steps"] == round(found["size"]["duration"] / STEP)
    assert len(found["targets"]) == 15
    hidden = (socket.gethostname(), str(FOLDER.parent), str(Path.home()), str(tmp_path))
    assert not [word for word in hidden if len(word) > 1 and (word in page or word in text)]


def test_mujoco_has_our_robot_and_servos(bench, walking) -> None:
    """In the air, at random states and set-points: the same joint and angular accelerations.

    The torques reach the limit in some joints and not in others. 1e-9 of the largest: both codes
    solve the same systems of condition number 1e5.
    """
    scene = dataclasses.replace(walking.scene, stops=hp.JointStops(stiffness=0.0))  # as the twin
    twin = bench["mujoco_scene"].MujocoScene(scene)
    plant, servo, effort = native_plant(scene), scene.servos, scene.robot.effort
    rng = np.random.default_rng(3)
    limited = 0
    for _ in range(50):
        quaternion = rng.normal(size=4)
        base = np.concatenate([[0.0, 0.0, 9.0], quaternion / np.linalg.norm(quaternion)])
        angles, rates = rng.uniform(-1.0, 1.0, 18), rng.normal(size=18)
        state = scene.robot.check_state(
            np.concatenate([base, angles]), np.concatenate([rng.normal(size=6), rates])
        )
        q_ref, v_ref = angles + rng.normal(size=18) * 0.02, rates + rng.normal(size=18)
        control = twin.controls(lambda t, q=q_ref, v=v_ref: (q[None], v[None]), 0, 1)[0]
        torque = servo.kp * (q_ref - angles) + servo.kd * (v_ref - rates)
        limited += int((np.abs(torque) > effort).sum())
        ours = native.evaluate(plant, state.q, state.v, np.clip(torque, -effort, effort))
        twin.put(state)
        twin.data.ctrl[:] = control
        mujoco.mj_forward(twin.model, twin.data)
        theirs = np.concatenate([twin.data.qacc[3:6], twin.data.qacc[twin.dof]])
        scale = np.abs(theirs).max()
        assert np.abs(ours["acceleration"][3:] - theirs).max() <= 1e-9 * scale
        rotation = pin.Quaternion(state.q[3:7]).toRotationMatrix()
        np.testing.assert_allclose(twin.data.qvel[:3], rotation @ state.v[:3], atol=1e-14)
    assert 0 < limited < 50 * 18


@pytest.mark.parametrize(("contact", "mu"), [("s1", 0.7), ("s2", 0.3)])
def test_mujoco_stands_on_its_feet_alone(bench, contact: str, mu: float) -> None:
    """Six contacts, all with the floor and our mu, carrying the weight; cheap choices made."""
    scene = hp.Scene(hp.load_robot("kharagpur"), contact=hp.Contact.preset(contact))
    twin = bench["mujoco_scene"].MujocoScene(scene)
    model, data = twin.model, twin.data
    assert (model.nbody, model.ngeom) == (20, 7)
    assert not model.jnt_limited.any() and not model.jnt_actfrclimited.any()
    assert model.body_mass.sum() == pytest.approx(scene.robot.total_mass, rel=1e-14)
    twin.put(scene.robot.stand())
    data.ctrl[:] = scene.robot.posture
    mujoco.mj_step(model, data, 2000)
    assert data.ncon == 6
    names = {model.geom(geom).name for pair in data.contact.geom for geom in pair}
    assert names == {"floor", *(foot.name for foot in scene.robot.feet)}
    np.testing.assert_allclose(data.contact.friction[:, :2], mu)
    total, force = 0.0, np.zeros(6)
    for k in range(data.ncon):
        mujoco.mj_contactForce(model, data, k, force)
        total += force[0]
    # at rest to the solver's tolerance of 1e-8 of the inertia's scale
    assert total == pytest.approx(scene.robot.total_mass * 9.81, rel=1e-4)


def test_timed_runs_are_the_checked_runs(bench, walking) -> None:
    """What is timed ends, bit for bit, where the run whose error is printed ends: both engines."""
    steps = 500
    checked = walking.positions(STEP, steps * STEP)[0]
    run = walking.rollout(STEP, steps)
    assert run.advance(1)
    np.testing.assert_array_equal(run.checkpoint().q[:3], checked[-1])
    assert len(run.record()["time"]) == 2
    for cone in bench["mujoco_scene"].CONES:
        twin = bench["mujoco_scene"].MujocoScene(walking.scene, cone=cone)
        twin.timed_run(walking.state, walking.setpoints, steps)()
        end = np.array(twin.data.qpos[:3])
        positions, _, _ = twin.positions(walking.state, walking.setpoints, steps * STEP)
        np.testing.assert_array_equal(end, positions[-1])


def test_interleaved_rounds(bench) -> None:
    """A warm-up round is dropped, and the order turns round every time."""
    order: list[str] = []

    def subject(name: str):
        return lambda: order.append(name) or {name: float(len(order))}

    found = bench["timing"].interleaved([subject("a"), subject("b")], 2)
    assert "".join(order) == "abbaab"
    assert {name: values.tolist() for name, values in found.items()} == {"a": [4, 5], "b": [3, 6]}
    quartiles = bench["timing"].Quartiles.of(np.arange(5.0))
    assert (quartiles.low, quartiles.median, quartiles.high) == (1.0, 2.0, 3.0)
