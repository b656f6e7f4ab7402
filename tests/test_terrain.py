"""Grounds: NumPy heights, native contacts, files, TOML; each against something independent."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import tomli_w

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError
from hexapod_pin.ground.terrain import Polyline, read_terrain
from hexapod_pin.spec import read_toml

STAIRS = hp.Stairs(rise=0.1, run=0.2, count=3, start=0.1, heading=0.7)
DOWN = hp.Stairs(rise=0.1, run=0.2, count=3, start=-1.2, heading=math.pi)
LEDGE = hp.Ledge(height=0.1, edge=0.2, heading=-2.0)
GROOVE = hp.Groove(angle_left=0.5, angle_right=1.0, depth=0.1, heading=2.2, bottom=0.3)
HILLS = hp.HeightField.random(3, amplitude=0.02, wavelength=0.3, size=2.0)
SLOPE = hp.Slope(angle=0.3, heading=-0.8, point=(0.1, 0.2, 0.3))
PATCHED = hp.PatchedGround(
    ground=SLOPE,
    patches=(
        hp.Patch(low=(0.0, 0.0), high=(1.0, 1.0), friction=0.2),
        hp.Patch(low=(0.5, 0.5), high=(2.0, 2.0), friction=3.0, stiffness=0.1),
    ),
)
SHAKEN = hp.ShakingGround(ground=PATCHED, amplitude=0.01, frequency=3.0)
PROFILES = {"stairs": STAIRS, "down": DOWN, "ledge": LEDGE, "groove": GROOVE}
ALL = {
    **PROFILES, "flat": hp.Flat(height=0.1), "slope": SLOPE, "hills": HILLS, "patched": PATCHED,
    "shaken": SHAKEN,
}  # fmt: skip


def world(line: Polyline, s: float, z: float, sideways: float = 0.0) -> np.ndarray:
    """The point at distance s along a profile, z above zero."""
    along = line.along
    return np.array([s * along[0] - sideways * along[1], s * along[1] + sideways * along[0], z])


def nearest(terrain, center, radius: float) -> tuple[float, np.ndarray]:
    return min(terrain.native().contacts(np.asarray(center, float), radius), key=lambda c: c[0])


# --- planes -------------------------------------------------------------------------------------


def test_slope_rises_along_its_heading() -> None:
    slope = hp.Slope(angle=math.radians(20.0), heading=math.radians(90.0), point=(5.0, 1.0, 2.0))
    assert slope.height_at(-3.0, 2.0) == pytest.approx(2.0 + math.tan(math.radians(20.0)))
    expected = [0.0, -math.sin(math.radians(20.0)), math.cos(math.radians(20.0))]
    assert slope.normal_at(0.0, 0.0) == pytest.approx(expected, abs=1e-15)


@pytest.mark.parametrize("terrain", [hp.Flat(height=-0.2), SLOPE], ids=["flat", "slope"])
@pytest.mark.parametrize("radius", [0.0, 0.02])
def test_plane_contact_is_its_closed_form(terrain, radius: float) -> None:
    """A sphere placed at a gap along the normal has that gap and that normal."""
    for x, y, gap in [(0.3, -0.4, 0.01), (-2.0, 1.0, -0.003), (1e3, 0.0, 0.0)]:
        normal = terrain.normal_at(x, y)
        center = np.array([x, y, terrain.height_at(x, y)]) + (radius + gap) * normal
        [(found, direction)] = terrain.native().contacts(center, radius)
        assert found == pytest.approx(gap, abs=1e-12)
        assert direction == pytest.approx(normal, abs=1e-15)


# --- profiles -----------------------------------------------------------------------------------


def test_stairs_heights() -> None:
    """Level, then a rise at each run, then level; at a riser the upper tread counts."""
    stairs = hp.Stairs(rise=0.1, run=0.3, count=2, start=0.5, height=1.0)
    x = [-9.0, 0.49, 0.5, 0.79, 0.8, 9.0]
    assert stairs.height_at(x, 0.0) == pytest.approx([1.0, 1.0, 1.1, 1.1, 1.2, 1.2])
    assert stairs.normal_at(x, 7.0) == pytest.approx(np.tile([0.0, 0.0, 1.0], (6, 1)))


def test_stairs_turned_round_go_down() -> None:
    """The docstring's recipe: the robot stands on top and the first step down is at x = 0.6."""
    stairs = hp.Stairs(rise=0.1, run=0.2, count=3, start=-1.0, heading=math.pi)
    assert stairs.height_at([0.0, 0.59, 0.61, 0.81, 1.01], 0.0) == pytest.approx(
        [0.3, 0.3, 0.2, 0.1, 0.0]
    )


def test_ledge_and_groove_heights() -> None:
    assert LEDGE.height_at(*world(LEDGE.surface(), 0.19, 0.0, 3.0)[:2]) == pytest.approx(0.1)
    assert LEDGE.height_at(*world(LEDGE.surface(), 0.21, 0.0, -3.0)[:2]) == pytest.approx(0.0)
    groove = hp.Groove(angle_left=math.pi / 4, angle_right=math.pi / 6, depth=0.1)
    x = np.array([-0.2, -0.1, -0.05, 0.0, 0.1, 0.2])
    expected = [0.0, 0.0, -0.05, -0.1, -0.1 + 0.1 * math.tan(math.pi / 6), 0.0]
    assert groove.height_at(x, 1.0) == pytest.approx(expected, abs=1e-15)
    left, right = groove.normal_at([-0.05, 0.1], 0.0)
    assert left == pytest.approx([math.sqrt(0.5), 0.0, math.sqrt(0.5)])
    assert right == pytest.approx([-0.5, 0.0, math.cos(math.pi / 6)])


def dense(line: Polyline, spacing: float) -> np.ndarray:
    """Points (N, 2) all along a profile, its level ends included."""
    s = np.concatenate([[line.s[0] - 1.0], line.s, [line.s[-1] + 1.0]])
    z = np.concatenate([line.z[:1], line.z, line.z[-1:]])
    pieces = []
    for k in range(len(s) - 1):
        length = math.hypot(s[k + 1] - s[k], z[k + 1] - z[k])
        t = np.linspace(0.0, 1.0, max(2, math.ceil(length / spacing)))[:, None]
        pieces.append((1.0 - t) * (s[k], z[k]) + t * (s[k + 1], z[k + 1]))
    return np.concatenate(pieces)


@pytest.mark.parametrize("radius", [0.0, 0.02, 0.05])
@pytest.mark.parametrize("name", PROFILES)
def test_profile_gap_is_the_distance_to_the_nearest_point(name: str, radius: float) -> None:
    """Brute force: spheres everywhere, inside and out, against the surface as a cloud of points.

    Points at spacing h find a distance d with an error of h^2/(8 d), at most h/2: kept below 1e-6
    by d > 3 h.
    """
    terrain, spacing = PROFILES[name], 5e-5
    line = terrain.surface()
    cloud, native = dense(line, spacing), terrain.native()
    dice = np.random.default_rng(1)
    for _ in range(150):
        s, up, sideways = dice.uniform(-0.3, 0.3), dice.uniform(-0.05, 0.15), dice.uniform(-1, 1)
        s += dice.choice(line.s)
        ground = float(terrain.height_at(*world(line, s, 0.0, sideways)[:2]))
        away = np.hypot(cloud[:, 0] - s, cloud[:, 1] - ground - up).min()
        if away < 3.0 * spacing:
            continue
        touched = native.contacts(world(line, s, ground + up, sideways), radius)
        expected = math.copysign(away, up) - radius
        assert min(gap for gap, _ in touched) == pytest.approx(expected, abs=1e-6)
        for _, normal in touched:
            assert np.linalg.norm(normal) == pytest.approx(1.0, abs=1e-12)
            assert normal @ world(line, 0.0, 0.0, 1.0) == pytest.approx(0.0, abs=1e-12)


def test_sphere_at_faces_edges_and_corners_of_stairs() -> None:
    """Closed forms: on a tread, before a riser, over a convex edge, in a concave corner."""
    stairs = hp.Stairs(rise=0.1, run=0.3, count=1)
    native, r = stairs.native(), 0.02
    gap, normal = nearest(stairs, (0.2, 0.5, 0.125), r)
    assert (gap, *normal) == pytest.approx((0.005, 0.0, 0.0, 1.0))
    gap, normal = nearest(stairs, (-0.023, 0.0, 0.06), r)
    assert (gap, *normal) == pytest.approx((0.003, -1.0, 0.0, 0.0))
    gap, normal = nearest(stairs, (-0.03, 0.0, 0.14), r)  # 3-4-5 from the edge at z = 0.1
    assert (gap, *normal) == pytest.approx((0.03, -0.6, 0.0, 0.8))
    corner = native.contacts(np.array([-0.019, 0.0, 0.018]), r)
    found = sorted((round(gap, 12), *np.round(normal, 12)) for gap, normal in corner)
    assert found == [(-0.002, 0.0, 0.0, 1.0), (-0.001, -1.0, 0.0, 0.0)]


def test_point_foot_at_a_riser() -> None:
    """Radius 0: outside a positive gap, inside the nearest face pushes, in no case upwards."""
    stairs = hp.Stairs(rise=0.1, run=0.3, count=1)
    for x in (-0.004, 0.004):
        gap, normal = nearest(stairs, (x, 0.0, 0.05), 0.0)
        assert gap == pytest.approx(-x)
        assert normal == pytest.approx([-1.0, 0.0, 0.0])
    gap, normal = nearest(stairs, (0.0, 0.0, 0.05), 0.0)  # on it
    assert gap == pytest.approx(0.0, abs=1e-15)
    gap, normal = nearest(stairs, (0.2, 0.0, 0.099), 0.0)  # under a tread
    assert (gap, *normal) == pytest.approx((-0.001, 0.0, 0.0, 1.0))
    gap, normal = nearest(stairs, (0.003, 0.0, -0.004), 0.0)  # under the foot of the riser
    assert (gap, *normal) == pytest.approx((-0.005, -0.6, 0.0, 0.8))


@pytest.mark.parametrize("radius", [0.0, 0.02])
@pytest.mark.parametrize("name", [*PROFILES, "hills"])
def test_gap_does_not_jump(name: str, radius: float) -> None:
    """Along any path the smallest gap changes by no more than the path is long."""
    terrain = ALL[name]
    native, dice = terrain.native(), np.random.default_rng(2)
    for _ in range(10):
        x, y = dice.uniform(-0.6, 0.6, 2)
        start = np.array([x, y, float(terrain.height_at(x, y)) + dice.uniform(-0.01, 0.05)])
        path = start + np.linspace(0.0, 0.3, 301)[:, None] * _unit(dice)
        gaps = np.array([min(g for g, _ in native.contacts(p, radius)) for p in path])
        step = 0.3 / 300.0
        # hills: the gap is along the normal at the foot of a perpendicular, a distance to 2nd order
        assert np.abs(np.diff(gaps)).max() <= step * (1.01 if name == "hills" else 1.0 + 1e-9)


def _unit(dice: np.random.Generator) -> np.ndarray:
    vector = dice.normal(size=3) * (1.0, 1.0, 0.1)
    return vector / np.linalg.norm(vector)


def test_normal_turns_steadily_over_a_convex_edge() -> None:
    """A sphere that rolls over a ledge's edge: its normal turns by path over distance, no jump."""
    ledge = hp.Ledge(height=0.1)
    radius = 0.02
    x = np.linspace(-0.005, 0.015, 401)
    normals = np.array([nearest(ledge, (p, 0.0, 0.1 + 0.0198), radius)[1] for p in x])
    turn = np.linalg.norm(np.diff(normals, axis=0), axis=1)
    assert turn.max() <= 1.01 * (x[1] - x[0]) / 0.0198
    assert normals[-1] @ (1.0, 0.0, 0.0) > 0.5


def test_faces_of_a_groove_are_slopes() -> None:
    """Away from its corners a face acts as the plane it lies in; a tread as level ground."""
    groove = hp.Groove(angle_left=0.4, angle_right=0.7, depth=0.2, heading=0.3)
    bottom = (0.0, 0.0, -0.2)
    for angle, sign in ((-0.4, -1.0), (0.7, 1.0)):
        plane = hp.Slope(angle=angle, heading=0.3, point=bottom)
        for s in (0.05, 0.1, 0.15):
            x, y, _ = world(groove.surface(), sign * s, 0.0, 0.4)
            assert groove.height_at(x, y) == pytest.approx(float(plane.height_at(x, y)))
            for up in (-0.01, 0.01, 0.04):
                center = (x, y, float(plane.height_at(x, y)) + up)
                gap, normal = nearest(groove, center, 0.02)
                flat_gap, flat_normal = nearest(plane, center, 0.02)
                assert gap == pytest.approx(flat_gap, abs=1e-12)
                assert normal == pytest.approx(flat_normal, abs=1e-12)


def test_many_points_on_a_line_act_as_one_face() -> None:
    """A polyline whose points lie on a plane gives one contact, also at its points."""
    many = Polyline(0.0, tuple(np.linspace(-1.0, 1.0, 21)), tuple(np.linspace(-0.3, 0.3, 21)))
    slope = hp.Slope(angle=math.atan(0.3))
    for x in (0.0, 0.1, 0.13, 0.2):
        center = np.array([x, 0.0, 0.3 * x + 0.02])
        touched = many.native().contacts(center, 0.02)
        assert len(touched) == 1
        assert touched[0][0] == pytest.approx(nearest(slope, center, 0.02)[0], abs=1e-12)


@pytest.mark.parametrize("name", PROFILES)
def test_turning_the_heading_turns_the_contacts(name: str) -> None:
    """Metamorphic: heading and centre turned together leave gaps and turn normals."""
    terrain, extra = PROFILES[name], 1.1
    turned = terrain.model_copy(update={"heading": terrain.heading + extra})
    turn = np.array(
        [[math.cos(extra), -math.sin(extra), 0], [math.sin(extra), math.cos(extra), 0], [0, 0, 1]]
    )
    line = terrain.surface()
    for s in np.linspace(line.s[0] - 0.1, line.s[-1] + 0.1, 23):
        center = world(line, s, 0.03)
        for (gap, normal), (other, aside) in zip(
            terrain.native().contacts(center, 0.02),
            turned.native().contacts(turn @ center, 0.02),
            strict=True,
        ):
            assert other == pytest.approx(gap, abs=1e-12)
            assert aside == pytest.approx(turn @ normal, abs=1e-9)


# --- height fields ------------------------------------------------------------------------------


def places(count: int = 60, reach: float = 1.15) -> np.ndarray:
    return np.random.default_rng(4).uniform(-reach, reach, (count, 2))


def test_hills_native_and_numpy_agree() -> None:
    """Two implementations (splines by rows in C++, Hermite weights in NumPy), inside and beyond."""
    native = HILLS.native()
    for x, y in places():
        z, normal = float(HILLS.height_at(x, y)), HILLS.normal_at(x, y)
        [(gap, direction)] = native.contacts(np.array([x, y, z]), 0.0)
        assert gap == pytest.approx(0.0, abs=1e-14)
        assert direction == pytest.approx(normal, abs=1e-12)


def test_hills_normals_are_the_gradient_of_the_heights() -> None:
    x, y = places().T
    step = 1e-6
    slope_x = (HILLS.height_at(x + step, y) - HILLS.height_at(x - step, y)) / (2.0 * step)
    slope_y = (HILLS.height_at(x, y + step) - HILLS.height_at(x, y - step)) / (2.0 * step)
    normals = HILLS.normal_at(x, y)
    # rounding of heights of 0.02 m over 2e-6 m: 1e-12; curvature jumps at grid lines: 1e-6
    assert -normals[:, 0] / normals[:, 2] == pytest.approx(slope_x, abs=1e-5)
    assert -normals[:, 1] / normals[:, 2] == pytest.approx(slope_y, abs=1e-5)


def test_hills_pass_through_their_points_and_run_out_to_level() -> None:
    z = np.random.default_rng(0).uniform(-0.01, 0.01, (5, 7))
    field = hp.HeightField.from_array(z, (0.1, 0.2), origin=(3.0, -1.0))
    x, y = np.meshgrid(3.0 + 0.1 * np.arange(7), -1.0 + 0.2 * np.arange(5))
    assert field.height_at(x, y) == pytest.approx(z, abs=1e-15)
    far = field.height_at([2.9, 0.0, 3.7, 9.0], [-0.8, -0.8, -0.8, -0.8])
    assert far == pytest.approx([z[1, 0], z[1, 0], z[1, 6], z[1, 6]], abs=1e-15)
    assert field.normal_at(-9.0, -9.0) == pytest.approx([0.0, 0.0, 1.0])
    edge = [field.normal_at(x, -0.7) for x in (2.9 - 1e-9, 2.9 + 1e-9, 3.0 - 1e-9, 3.0 + 1e-9)]
    assert edge[0] == pytest.approx(edge[1], abs=1e-7)  # no kink where the field begins
    assert edge[2] == pytest.approx(edge[3], abs=1e-7)


def test_field_of_a_plane_is_the_plane() -> None:
    """Away from the border, splines through a plane are that plane; x is the column."""
    slope = hp.Slope(angle=0.2, heading=0.5)
    grid = 0.1 * np.arange(-10, 11)
    field = hp.HeightField.from_array(slope.height_at(grid[None, :], grid[:, None]), 0.1)
    for x, y in places(20, reach=0.85):
        center = (x, y, float(slope.height_at(x, y)) + 0.015)
        gap, normal = nearest(field, center, 0.02)
        flat_gap, flat_normal = nearest(slope, center, 0.02)
        assert gap == pytest.approx(flat_gap, abs=1e-12)
        assert normal == pytest.approx(flat_normal, abs=1e-12)


@pytest.mark.parametrize("radius", [0.0, 0.02])
def test_hills_gap_is_the_distance_to_the_nearest_point(radius: float) -> None:
    """Brute force: the nearest of many surface points, for a penetration and a gap of 1 mm."""
    native, away = HILLS.native(), np.linspace(-0.012, 0.012, 121)
    dx, dy = np.meshgrid(away, away)
    for x, y in places(12, reach=0.9):
        for up in (-1e-3, 1e-3):
            center = np.array([x, y, float(HILLS.height_at(x, y)) + radius + up])
            cloud = HILLS.height_at(x + dx, y + dy) - center[2]
            distance = np.sqrt(dx**2 + dy**2 + cloud**2).min()
            side = 1.0 if radius + up > 0.0 else -1.0
            [(gap, _)] = native.contacts(center, radius)
            # points 0.2 mm apart: 1e-4^2 / 1e-3 for point feet
            assert gap == pytest.approx(side * distance - radius, abs=1.5e-5)


@pytest.mark.parametrize("gap", [-1e-3, 0.0, 1e-3])
@pytest.mark.parametrize("radius", [0.0, 0.02])
def test_hills_push_along_the_gradient_of_the_gap(radius: float, gap: float) -> None:
    """A force along the normal stores what the gap says: the normal is the gap's gradient."""
    native, step = HILLS.native(), 1e-6
    for x, y in places(20, reach=0.9):
        center = np.array([x, y, float(HILLS.height_at(x, y))])
        center += (radius + gap) * HILLS.normal_at(x, y)
        [(found, normal)] = native.contacts(center, radius)
        gradient = [
            (native.contacts(center + e, radius)[0][0] - native.contacts(center - e, radius)[0][0])
            / (2.0 * step)
            for e in step * np.eye(3)
        ]
        # the search ends at 1e-14 m, seen through a difference of 2e-6 m
        assert gradient == pytest.approx(normal, abs=1e-7)
        assert found == pytest.approx(gap, abs=1e-12)


def test_random_hills() -> None:
    """The same seed gives the same hills, another seed others; the amplitude is reached."""
    again = hp.HeightField.random(3, amplitude=0.02, wavelength=0.3, size=2.0)
    assert again == HILLS
    assert hp.HeightField.random(4, amplitude=0.02, wavelength=0.3, size=2.0) != HILLS
    assert np.abs(HILLS.z).max() == pytest.approx(0.02, rel=1e-12)
    rows, columns = HILLS.shape
    assert HILLS.origin == pytest.approx((-1.02, -1.02), abs=0.03)
    crossings = np.count_nonzero(np.diff(np.sign(HILLS.z), axis=1)) / rows / 2.0
    assert 0.15 < 2.0 / crossings < 0.6  # hills are about a wavelength apart
    assert columns == rows


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
        normal=hp.HuntCrossley(stiffness=1e6, dissipation=20.0),
        friction=hp.TanhCoulomb(mu=0.5, slope=1e3),
    )
    patch = hp.Patch(low=(-5.0, -5.0), high=(5.0, 5.0), friction=0.1, stiffness=0.25)
    for terrain, mu, softness in (
        (hp.Flat(), 0.5, 1.0),
        (hp.PatchedGround(ground=hp.Flat(), patches=(patch,)), 0.05, 4.0 ** (2.0 / 3.0)),
    ):
        scene = hp.Scene(robot, terrain=terrain, contact=contact, servo=vehicles.LIMP)
        start = vehicles.state(robot, -softness * (9.81e-6) ** (2.0 / 3.0), (1.0, 0.0, 0.0))
        trace = hp.simulate(
            scene,
            hp.HoldPosture(),
            duration=0.1,
            method="rk4",
            step=1e-5,
            sample=0.1,
            initial=start,
        )
        assert trace.v[-1, 0] == pytest.approx(1.0 - mu * 9.81 * 0.1, rel=1e-9)
        depth = softness * (9.81e-6) ** (2.0 / 3.0)
        assert trace.foot_gap[-1, 0] == pytest.approx(-depth, rel=1e-9)


def test_shaken_ground_moves_as_it_says() -> None:
    table = hp.ShakingGround(amplitude=2e-3, frequency=12.0)
    time = np.array([0.0, 1.0 / 48.0, 1.0 / 24.0])
    assert table.lift_at(time) == pytest.approx([0.0, 2e-3, 0.0], abs=1e-15)
    assert table.height_at(1.0, 2.0) == 0.0


# --- clearance ----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ALL)
def test_lift_leaves_no_clearance(name: str) -> None:
    """After the lift the lowest sphere touches and none penetrates, wherever they started."""
    terrain, dice = ALL[name], np.random.default_rng(5)
    radii = np.array([0.02, 0.0, 0.03])
    for height in (-0.5, 0.0, 2.0):
        points = np.column_stack([dice.uniform(-1.0, 1.0, (3, 2)), np.full(3, height)])
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
    ("points", "radii"),
    [([[0, 0]], 0.0), ([[0, 0, math.nan]], 0.0), ([[0, 0, 0]], [1.0, 2.0]), ([[0, 0, 0]], -1.0)],
)
def test_clearance_refuses_what_is_no_sphere(points, radii) -> None:
    with pytest.raises(ParameterError):
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
