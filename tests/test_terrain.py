"""Patches and shaking, standing on any ground, refusals, TOML."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from grounds import ALL, HILLS, PATCHED, SHAKEN, SLOPE, STAIRS
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError
from hexapod_pin.ground.terrain import read_terrain
from hexapod_pin.native import evaluate
from hexapod_pin.simulation.plant import native_plant
from hexapod_pin.spec import read_toml

# --- overlays -----------------------------------------------------------------------------------


def test_patches() -> None:
    """Native and NumPy agree on which patch counts: the first; outside, factors are 1."""
    native = PATCHED.native()
    expected = {
        (0.2, 0.2): (0.2, 1.0), (0.7, 0.7): (0.2, 1.0), (1.5, 1.5): (3.0, 0.1),
        (1.0, 1.0): (0.2, 1.0), (2.0, 0.5): (3.0, 0.1), (-0.1, 0.5): (1.0, 1.0),
        (1.5, 0.2): (1.0, 1.0),
    }  # fmt: skip
    for place, factors in expected.items():
        assert native.patch(*place) == factors
        assert tuple(PATCHED.factors_at(*place)) == factors
    assert PATCHED.height_at(0.3, 0.4) == SLOPE.height_at(0.3, 0.4)


def test_patch_scales_friction_and_stiffness_in_a_run(tmp_path: Path) -> None:
    """A particle on a patch: a quarter of the stiffness, and it slides on where mu is a tenth."""
    import vehicles

    robot = vehicles.particle(tmp_path)
    contact = hp.Contact(
        normal=hp.contact.HuntCrossley(stiffness=1e6, dissipation=20.0),
        friction=hp.contact.TanhCoulomb(mu=0.5, slope=1e3),
    )
    patch = hp.terrain.Patch(low=(-5.0, -5.0), high=(5.0, 5.0), friction=0.1, stiffness=0.25)
    for terrain, mu, softness in (
        (hp.Flat(), 0.5, 1.0),
        (hp.terrain.PatchedGround(ground=hp.Flat(), patches=(patch,)), 0.05, 4.0 ** (2.0 / 3.0)),
    ):
        scene = hp.Scene(robot, terrain=terrain, contact=contact, servo=vehicles.LIMP)
        start = vehicles.state(robot, -softness * (9.81e-6) ** (2.0 / 3.0), (1.0, 0.0, 0.0))
        trace = hp.simulate(
            scene, hp.HoldPosture(), duration=0.1, method="rk4", step=1e-5, sample=0.1,
            initial=start,
        )  # fmt: skip
        assert trace.v[-1, 0] == pytest.approx(1.0 - mu * 9.81 * 0.1, rel=1e-9)
        depth = softness * (9.81e-6) ** (2.0 / 3.0)
        assert trace.foot_gap[-1, 0] == pytest.approx(-depth, rel=1e-9)


@pytest.mark.parametrize(
    "friction",
    [
        (hp.contact.TanhCoulomb(mu=0.5, slope=1e3), hp.contact.TanhCoulomb(mu=0.05, slope=1e3)),
        (hp.contact.SmoothStep(mu_static=0.5, mu_dynamic=0.3, speed=0.02),
         hp.contact.SmoothStep(mu_static=0.05, mu_dynamic=0.03, speed=0.02)),
        (hp.contact.StickSlip(mu=0.5, stiffness=2e4, damping=60.0),
         hp.contact.StickSlip(mu=0.05, stiffness=2e4, damping=60.0)),
    ],
)  # fmt: skip
@pytest.mark.parametrize("u", [(0.0, 0.0, 0.0), (1e-3, -2e-3, -0.1), (0.3, 0.1, 0.05)])
def test_a_patch_equals_ground_of_its_own_coefficients(
    tmp_path: Path, friction: tuple[object, object], u: tuple[float, float, float]
) -> None:
    """Force and both derivatives, a tenth of the friction and a quarter of the stiffness."""
    import vehicles

    robot = vehicles.particle(tmp_path)
    patch = hp.terrain.Patch(low=(-5.0, -5.0), high=(5.0, 5.0), friction=0.1, stiffness=0.25)
    found = []
    for terrain, stiffness, law in (
        (hp.terrain.PatchedGround(ground=hp.Flat(), patches=(patch,)), 1e6, friction[0]),
        (hp.Flat(), 0.25e6, friction[1]),
    ):
        normal = hp.contact.HuntCrossley(stiffness=stiffness, dissipation=0.2)
        contact = hp.Contact(normal=normal, friction=law)
        plant = native_plant(hp.Scene(robot, terrain=terrain, contact=contact, servo=vehicles.LIMP))
        state = vehicles.state(robot, -1e-3, u)
        found.append(evaluate(plant, state.q, state.v, np.zeros(0)))
    for name in ("foot_force", "foot_damping", "foot_stiffness"):
        patched, own = (np.asarray(each[name]) for each in found)
        assert np.abs(own).max() > 1.0
        np.testing.assert_allclose(patched, own, rtol=1e-12, atol=1e-12 * np.abs(own).max())


def test_shaken_ground_moves_by_its_formula() -> None:
    table = hp.terrain.ShakingGround(amplitude=2e-3, frequency=12.0)
    time = np.array([0.0, 1.0 / 48.0, 1.0 / 24.0])
    assert table.lift_at(time) == pytest.approx([0.0, 2e-3, 0.0], abs=1e-15)
    assert table.height_at(1.0, 2.0) == 0.0


# --- clearance ----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ALL)
def test_lift_leaves_no_clearance(name: str) -> None:
    """After the lift the lowest sphere touches and none penetrates, wherever they started."""
    terrain, rng = ALL[name], np.random.default_rng(5)
    radii = np.array([0.02, 0.0, 0.03])
    for height in (-0.5, 0.0, 2.0):
        points = np.column_stack([rng.uniform(-1.0, 1.0, (3, 2)), np.full(3, height)])
        up = terrain.lift(points, radii)
        assert terrain.clearance(points + (0.0, 0.0, up), radii) == pytest.approx(0.0, abs=2e-12)
        lower = terrain.clearance(points + (0.0, 0.0, up - 1e-6), radii)
        assert lower <= 1e-12


@pytest.mark.parametrize("name", ALL)
def test_a_robot_stands_on_any_ground(name: str) -> None:
    """A run without an initial state starts with the lowest foot touching."""
    scene = hp.Scene(hp.load_robot("kharagpur"), terrain=ALL[name])
    trace = hp.simulate(scene, hp.HoldPosture(), duration=0.0)
    assert trace.foot_gap.min() == pytest.approx(0.0, abs=1e-11)


@pytest.mark.parametrize(
    ("points", "radii", "name"),
    [
        ([[0, 0]], 0.0, "points"),
        ([[0, 0, math.nan]], 0.0, "points[0, 2]"),
        ([[0, 0, 0]], [1.0, 2.0], "radii"),
        ([[0, 0, 0]], -1.0, "radii"),
        ("abc", 0.0, "Ground.clearance.points"),
        ([[0, 0, 0], [0, 0]], 0.0, "Ground.clearance.points"),
        ([[0, 0, "x"]], 0.0, "Ground.clearance.points"),
    ],
)
def test_clearance_refuses_what_is_no_sphere(points, radii, name: str) -> None:
    with refused(ParameterError, name):
        STAIRS.clearance(points, radii)


# --- TOML ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ALL)
def test_toml_gives_the_same_ground_back(name: str) -> None:
    terrain = ALL[name]
    text = tomli_w.dumps(terrain.model_dump())
    assert read_terrain(read_toml(text)) == terrain


def test_scene_carries_its_ground() -> None:
    robot = hp.load_robot("athena")
    for terrain in (HILLS, SHAKEN):
        back = hp.Scene.from_toml(hp.Scene(robot, terrain=terrain).to_toml())
        assert back.terrain == terrain
    assert np.array_equal(read_terrain(HILLS.model_dump()).z, HILLS.z)  # every bit


def test_heights_do_not_flood_a_message() -> None:
    assert len(str(HILLS)) < 200
