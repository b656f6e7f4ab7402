"""The fused pass against the Pinocchio path of the same core, in both of its builds."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import pinocchio as pin
import pytest
from leg_robots import joint, link
from test_simulation import quadruped

import hexapod_pin as hp
from hexapod_pin import native as _native
from hexapod_pin.simulation.plant import native_model, native_plant

BUILDS = {"best": {}, "baseline": {"baseline": True}}


def plant_of(scene: hp.Scene, **how: bool) -> Any:
    settings = partial(_native.plant_settings, **how)
    with mock.patch.object(_native, "plant_settings", settings):
        return native_plant(scene)


def random_state(robot: hp.Robot, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
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


def compare(
    robot: hp.Robot, build: str, count: int, angle: float = 0.0, speed: float = 1.0
) -> None:
    scene, torque = hp.Scene(robot), np.zeros(robot.model.nv - 6)
    fused, oracle = plant_of(scene, **BUILDS[build]), plant_of(scene, fused=False)
    assert fused.dynamics.startswith("fused") and oracle.dynamics == "pinocchio"
    rng = np.random.default_rng(3)
    for _ in range(count):
        q, v = random_state(robot, rng)
        if angle:
            q[7:] = angle * rng.uniform(-1.0, 1.0, len(q) - 7)
        found, known = (_native.evaluate(plant, q, speed * v, torque) for plant in (fused, oracle))
        assert_same(found, known)


def leg_text(leg: int, rng: np.random.Generator, kind: str) -> str:
    def numbers(scale: float, size: int = 3) -> str:
        return " ".join(f"{x:.17g}" for x in scale * rng.normal(size=size))

    parts, parent = [], "base"
    for name, moves in (("a", kind), ("b", kind), ("m", "fixed"), ("c", kind), ("foot", "fixed")):
        ixx, iyy, izz = rng.uniform(2e-3, 3e-3, 3)  # any two exceed the third
        ixy, ixz, iyz = rng.uniform(-2e-4, 2e-4, 3)
        parts.append(
            f'<link name="{name}{leg}"><inertial>'
            f'<origin xyz="{numbers(0.1)}" rpy="{numbers(1.0)}"/>'
            f'<mass value="{rng.uniform(0.1, 1.0)}"/><inertia ixx="{ixx}" iyy="{iyy}" izz="{izz}" '
            f'ixy="{ixy}" ixz="{ixz}" iyz="{iyz}"/></inertial></link>'
            f'<joint name="{name}{leg}_joint" type="{moves}"><parent link="{parent}"/>'
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


@pytest.mark.parametrize("build", BUILDS)
@pytest.mark.parametrize("name", ["kharagpur", "solo12", "anymal"])
def test_fused_pass_equals_pinocchio(name: str, build: str) -> None:
    compare(hp.load_robot(name) if name == "kharagpur" else quadruped(name), build, 50)


@pytest.mark.parametrize("build", BUILDS)
@pytest.mark.parametrize("legs", range(1, 9))
def test_skew_axes_and_fixed_links(legs: int, build: str, tmp_path: Path) -> None:
    """Every number of legs: no lane spills into another, none is forgotten."""
    path = skew_text(tmp_path, legs, "revolute")
    robot = hp.load_robot(path, feet=[f"foot{leg}" for leg in range(legs)])
    robot.model.armature[:] = np.linspace(0.1, 0.9, robot.model.nv)
    compare(robot, build, 10)


def test_what_is_left_to_pinocchio(tmp_path: Path) -> None:
    for legs in (9, 2):
        path = skew_text(tmp_path, legs, "revolute")
        robot = hp.load_robot(path, feet=[f"foot{leg}" for leg in range(legs)])
        plant = native_plant(hp.Scene(robot))
        assert plant.arrow and (plant.dynamics == "pinocchio") == (legs == 9)
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


@pytest.mark.parametrize("build", BUILDS)
def test_large_rates_and_angles(build: str) -> None:
    """1e4 rad/s; angles of many turns, past 1e5 rad where libm takes over from the polynomials."""
    for angle in (1e1, 9e4, 1e7):
        compare(hp.load_robot("kharagpur"), build, 1, angle, 1e4)


@pytest.mark.parametrize("build", BUILDS)
def test_sine_and_cosine_to_the_last_digits(build: str, tmp_path: Path) -> None:
    """Joint 2 along x carried round by joint 1 along z: its axis is (cos q, sin q, 0)."""
    path, text = tmp_path / "leg.urdf", link("base", 1.0, 1.0)
    for parent, child, axis in (("base", "a", "0 0 1"), ("a", "b", "1 0 0"), ("b", "c", "0 1 0")):
        text += link(child, 1.0, 1.0) + joint(f"{child}_joint", parent, child, (0, 0, 0), axis=axis)
    path.write_text(f'<robot name="leg">{text}</robot>')
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
