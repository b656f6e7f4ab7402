"""The fused pass against the Pinocchio path of the same core, in both of its builds."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import pinocchio as pin
import pytest
import vehicles
from test_simulation import quadruped

import hexapod_pin as hp
from hexapod_pin import native as _native
from hexapod_pin.simulation.plant import native_model, native_plant

BUILDS = {"best": {}, "baseline": {"baseline": True}}


def with_dynamics(**how: bool) -> Any:
    """Every plant made inside has these settings: `fused`, `baseline`."""
    return mock.patch.object(_native, "plant_settings", partial(_native.plant_settings, **how))


def plant_of(scene: hp.Scene, **how: bool) -> Any:
    with with_dynamics(**how):
        return native_plant(scene)


def robot_of(name: str) -> hp.Robot:
    if name in ("solo12", "anymal"):
        return quadruped(name)
    return vehicles.hexa_ref() if name == "hexa_ref" else hp.load_robot(name)


def random_state(robot: hp.Robot, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Any attitude and any joint angles, rates of a few rad/s."""
    bound = np.full(robot.model.nq, 3.0)
    return pin.randomConfiguration(robot.model, -bound, bound), 5.0 * rng.normal(
        size=robot.model.nv
    )


def assert_same(found: dict[str, Any], expected: dict[str, Any]) -> None:
    """Mass matrix, kinematics to 1e-13 of their size, bias to 1e-12: some hundred round-offs."""
    bounds = {"mass": 1e-13, "bias": 1e-12, "joint_axis": 1e-13, "joint_origin": 1e-13}
    for name, bound in {**bounds, "com": 1e-13, "foot_position": 1e-13}.items():
        size = max(np.abs(expected[name]).max(), 1e-3)
        assert np.abs(found[name] - expected[name]).max() < bound * size, name


def both(robot: hp.Robot, q: np.ndarray, v: np.ndarray, **how: bool) -> tuple[Any, Any]:
    """The state evaluated by the fused pass and by Pinocchio."""
    scene, torque = hp.Scene(robot), np.zeros(robot.model.nv - 6)
    fused, oracle = plant_of(scene, **how), plant_of(scene, fused=False)
    assert fused.dynamics.startswith("fused") and oracle.dynamics == "pinocchio"
    return tuple(_native.evaluate(plant, q, v, torque) for plant in (fused, oracle))


def leg_text(leg: int, rng: np.random.Generator, kind: str) -> str:
    """A leg of skew axes and turned frames with a massive fixed link in its middle."""

    def numbers(scale: float, size: int = 3) -> str:
        return " ".join(f"{x:.17g}" for x in scale * rng.normal(size=size))

    parts, parent = [], "base"
    for name, joint in (("a", kind), ("b", kind), ("m", "fixed"), ("c", kind), ("foot", "fixed")):
        ixx, iyy, izz = rng.uniform(2e-3, 3e-3, 3)  # any two exceed the third
        ixy, ixz, iyz = rng.uniform(-2e-4, 2e-4, 3)
        parts.append(
            f'<link name="{name}{leg}"><inertial>'
            f'<origin xyz="{numbers(0.1)}" rpy="{numbers(1.0)}"/>'
            f'<mass value="{rng.uniform(0.1, 1.0)}"/><inertia ixx="{ixx}" iyy="{iyy}" izz="{izz}" '
            f'ixy="{ixy}" ixz="{ixz}" iyz="{iyz}"/></inertial></link>'
            f'<joint name="{name}{leg}_joint" type="{joint}"><parent link="{parent}"/>'
            f'<child link="{name}{leg}"/><origin xyz="{numbers(0.3)}" rpy="{numbers(1.0)}"/>'
            f'<axis xyz="{numbers(1.0)}"/>'
            '<limit lower="-4" upper="4" effort="9" velocity="9"/></joint>'
        )
        parent = f"{name}{leg}"
    return "".join(parts)


def skew_text(tmp_path: Path, legs: int, kind: str) -> Path:
    rng = np.random.default_rng(legs)
    text = (
        '<robot name="skew"><link name="base"><inertial><origin xyz="0.1 -0.2 0.3"/>'
        '<mass value="2"/><inertia ixx="0.02" iyy="0.03" izz="0.04" ixy="0.001" ixz="-0.002" '
        'iyz="0.003"/></inertial></link>'
        + "".join(leg_text(leg, rng, kind) for leg in range(legs))
        + "</robot>"
    )
    path = tmp_path / "skew.urdf"
    path.write_text(text)
    return path


def skew_robot(tmp_path: Path, legs: int) -> hp.Robot:
    path = skew_text(tmp_path, legs, "revolute")
    return hp.load_robot(path, feet=[f"foot{leg}" for leg in range(legs)])


@pytest.mark.parametrize("build", BUILDS)
@pytest.mark.parametrize("name", ["kharagpur", "athena", "hexa_ref", "solo12", "anymal"])
def test_fused_pass_equals_pinocchio(name: str, build: str) -> None:
    """200 random states."""
    robot = robot_of(name)
    scene, torque = hp.Scene(robot), np.zeros(robot.model.nv - 6)
    fused, oracle = plant_of(scene, **BUILDS[build]), plant_of(scene, fused=False)
    assert fused.dynamics.startswith("fused")
    rng = np.random.default_rng(3)
    for _ in range(200):
        q, v = random_state(robot, rng)
        assert_same(_native.evaluate(fused, q, v, torque), _native.evaluate(oracle, q, v, torque))


@pytest.mark.parametrize("build", BUILDS)
@pytest.mark.parametrize("legs", range(1, 9))
def test_skew_axes_and_fixed_links(legs: int, build: str, tmp_path: Path) -> None:
    """Every number of legs: no lane spills into another, none is forgotten."""
    robot = skew_robot(tmp_path, legs)
    robot.model.armature[:] = np.linspace(0.1, 0.9, robot.model.nv)
    rng = np.random.default_rng(legs)
    for _ in range(10):
        assert_same(*both(robot, *random_state(robot, rng), **BUILDS[build]))


def test_what_is_left_to_pinocchio(tmp_path: Path) -> None:
    """Nine legs; sliding joints: robots have turning ones only, the core takes any model."""
    plant = native_plant(hp.Scene(skew_robot(tmp_path, 9)))
    assert plant.arrow and plant.dynamics == "pinocchio"
    robot = skew_robot(tmp_path, 2)
    skew_text(tmp_path, 2, "prismatic")
    model = pin.buildModelFromUrdf(str(tmp_path / "skew.urdf"), pin.JointModelFreeFlyer())
    with mock.patch.object(_native, "plant_settings") as call:
        native_plant(hp.Scene(robot))
    plant = _native.plant_settings(**{**call.call_args.kwargs, "model": native_model(model)})
    assert plant.arrow and plant.dynamics == "pinocchio"
    q, v = random_state(robot, np.random.default_rng(1))
    found = _native.evaluate(plant, q, v, np.zeros(6))
    expected = pin.nonLinearEffects(model, model.createData(), q, v)
    assert found["bias"] == pytest.approx(expected, rel=1e-11)


def test_gravity_of_any_direction() -> None:
    """At rest the bias is gravity's alone: its base force is minus the weight, in base axes."""
    robot = hp.load_robot("kharagpur")
    gravity = np.array([1.0, -2.0, -9.0])
    plant = plant_of(hp.Scene(robot, gravity=tuple(gravity)))
    q, v = random_state(robot, np.random.default_rng(2))
    bias = _native.evaluate(plant, q, 0.0 * v, np.zeros(18))["bias"]
    rotation = pin.Quaternion(q[3:7]).toRotationMatrix()
    assert rotation @ bias[:3] == pytest.approx(-robot.total_mass * gravity, rel=1e-13)


def test_far_away_nothing_changes() -> None:
    """The pass does not see the base's position: the same bits at 1e9 m."""
    robot = hp.load_robot("kharagpur")
    plant = plant_of(hp.Scene(robot))
    q, v = random_state(robot, np.random.default_rng(4))
    far = q.copy()
    far[:3] += [1e9, -1e9, 1e9]
    here, there = (_native.evaluate(plant, x, v, np.zeros(18)) for x in (q, far))
    for name in ("mass", "bias", "joint_axis", "joint_origin"):
        assert np.array_equal(here[name], there[name]), name


@pytest.mark.parametrize("build", BUILDS)
def test_large_rates_and_angles(build: str) -> None:
    """1e4 rad/s; angles of many turns, past 1e5 rad where libm takes over from the polynomials."""
    robot = hp.load_robot("kharagpur")
    rng = np.random.default_rng(6)
    for angle in (1e1, 1e3, 9e4, 1e7):
        q, v = random_state(robot, rng)
        q[7:] = angle * rng.uniform(-1.0, 1.0, 18)
        assert_same(*both(robot, q, 1e4 * v, **BUILDS[build]))


def test_zeros_between_legs_stay_zeros_and_nan_shows() -> None:
    robot = hp.load_robot("kharagpur")
    q, v = random_state(robot, np.random.default_rng(8))
    q[12] = np.nan
    found = _native.evaluate(plant_of(hp.Scene(robot)), q, v, np.zeros(18))
    assert np.isnan(found["bias"]).any() and np.isnan(found["mass"]).any()
    robot = hp.load_robot("kharagpur")
    q, v = random_state(robot, np.random.default_rng(9))
    mass = _native.evaluate(plant_of(hp.Scene(robot)), q, v, np.zeros(18))["mass"]
    own = np.kron(np.eye(6), np.ones((3, 3))) > 0
    assert (mass[6:, 6:][~own] == 0.0).all()
    assert all(mass[7 + leg, 8 + leg] != 0.0 for leg in range(0, 18, 3))  # femur with tibia


@pytest.mark.parametrize("build", BUILDS)
def test_sine_and_cosine_to_the_last_digits(build: str, tmp_path: Path) -> None:
    """Joint 2 along x carried round by joint 1 along z: its axis is (cos q, sin q, 0).

    The core's 0.8 ulp and NumPy's 0.5 to 1 round to neighbours at most.
    """
    names = ("base", "a", "b", "c")
    links = "".join(
        f'<link name="{name}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" '
        'ixy="0" ixz="0" iyz="0"/></inertial></link>'
        for name in names
    )
    joints = "".join(
        f'<joint name="{child}_joint" type="revolute"><parent link="{parent}"/>'
        f'<child link="{child}"/><axis xyz="{axis}"/>'
        '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
        for parent, child, axis in zip(names, names[1:], ("0 0 1", "1 0 0", "0 1 0"), strict=False)
    )
    path = tmp_path / "leg.urdf"
    path.write_text(f'<robot name="leg">{links}{joints}</robot>')
    robot = hp.load_robot(path, feet=["c"])
    plant = plant_of(hp.Scene(robot), **BUILDS[build])
    quarters = 0.5 * np.pi * np.arange(-50, 50) * (1.0 + 1e-9)
    wide = np.logspace(-10, 4.9, 300)
    q = pin.neutral(robot.model)
    for angle in np.concatenate([quarters, wide, -wide]):
        q[7] = angle
        axis = _native.evaluate(plant, q, np.zeros(9), np.zeros(3))["joint_axis"][1]
        expected = np.array([np.cos(angle), np.sin(angle)])
        assert (np.abs(axis[:2] - expected) <= 1.01 * np.spacing(np.abs(expected))).all()


@pytest.mark.parametrize("method", ["implicit-euler", "extrapolated-euler"])
def test_runs_do_not_depend_on_the_pass(method: str) -> None:
    """A falling robot with moving legs; X3 keeps and recalls evaluations. Round-off only."""
    robot = hp.load_robot("kharagpur")
    start = robot.stand(robot.posture)
    q = start.q.copy()
    q[2] += 0.2
    settings = {"step": 1e-3} if method == "implicit-euler" else {"accuracy": 1e-6}

    def final(**how: bool) -> np.ndarray:
        with with_dynamics(**how):
            trace = hp.simulate(
                hp.Scene(robot), hp.HoldPosture(robot.posture + np.tile([0.2, -0.1, 0.15], 6)),
                duration=0.1, sample=0.1, method=method, initial=robot.check_state(q, start.v),
                **settings,
            )  # fmt: skip
        return trace.q[-1]

    expected = final(fused=False)
    assert np.abs(final() - expected).max() < 1e-11
    assert np.abs(final(baseline=True) - expected).max() < 1e-11


def test_each_build_repeats_its_bits_and_the_two_differ_by_round_off() -> None:
    robot = hp.load_robot("athena")
    scene, q_v = hp.Scene(robot), random_state(robot, np.random.default_rng(12))
    best, base = plant_of(scene), plant_of(scene, baseline=True)
    assert base.dynamics == "fused"

    def bias(plant: Any) -> np.ndarray:
        return _native.evaluate(plant, *q_v, np.zeros(18))["bias"]

    assert np.array_equal(bias(best), bias(plant_of(scene)))
    assert np.array_equal(bias(base), bias(plant_of(scene, baseline=True)))
    assert np.abs(bias(best) - bias(base)).max() < 1e-13 * np.abs(bias(base)).max()
