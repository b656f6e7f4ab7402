"""Contact laws: native formulas against NumPy, their derivatives, impacts in closed form."""

from __future__ import annotations

import numpy as np
import pytest
import vehicles
from vehicles import HARD_CASES

import hexapod_pin as hp
from hexapod_pin import native as _native
from hexapod_pin.contact import hertz_stiffness, stiffness_from_mm
from hexapod_pin.errors import ParameterError, UnknownNameError

NORMAL = {
    "hertz": hp.HuntCrossley(stiffness=1.24e6, dissipation=20.0),
    "printed": hp.HuntCrossley(stiffness=1e4, exponent=1.0, dissipation=0.5),
    "adams": hp.Contact.s2().normal,
}
FRICTION = {
    "tanh": hp.TanhCoulomb(mu=0.7, slope=1e3),
    "adams": hp.Contact.s2().friction,
}


def cubic_step(x: float, x0: float, h0: float, x1: float, h1: float) -> float:
    """ADAMS' STEP, as its manual prints it."""
    d = min(max((x - x0) / (x1 - x0), 0.0), 1.0)
    return h0 + (h1 - h0) * d * d * (3.0 - 2.0 * d)


def numpy_normal(law: object, depth: float, rate: float) -> float:
    """The normal laws written again from the papers."""
    if depth <= 0.0:
        return 0.0
    spring = law.stiffness * depth**law.exponent
    if isinstance(law, hp.HuntCrossley):
        return max(0.0, spring * (1.0 + 1.5 * law.dissipation * rate))
    return max(0.0, spring + cubic_step(depth, 0.0, 0.0, law.damping_depth, law.damping) * rate)


def numpy_friction(law: object, speed: float) -> float:
    """The friction laws written again from the papers."""
    if isinstance(law, hp.TanhCoulomb):
        return law.mu * np.tanh(law.slope * speed)
    vs, vd = law.stiction_speed, law.transition_speed
    if speed < vs:
        return cubic_step(speed, -vs, -law.mu_static, vs, law.mu_static)
    return cubic_step(speed, vs, law.mu_static, vd, law.mu_dynamic)


@pytest.mark.parametrize("name", NORMAL)
def test_normal_law_equals_its_formula(name: str) -> None:
    law, rng = NORMAL[name], np.random.default_rng(1)
    for depth, rate in zip(rng.uniform(-1e-4, 5e-4, 200), rng.uniform(-0.3, 0.3, 200), strict=True):
        expected = numpy_normal(law, depth, rate)
        # one rounding per operation, about ten operations
        assert law.force(depth, rate) == pytest.approx(expected, rel=1e-14, abs=1e-300)


@pytest.mark.parametrize("name", NORMAL)
def test_normal_law_derivatives_equal_central_differences(name: str) -> None:
    law, native = NORMAL[name], NORMAL[name].native()
    for depth, rate in [(1e-5, 0.01), (5e-5, -0.005), (3e-4, 0.02), (3e-4, -0.01)]:
        force, d_depth, d_rate, _ = native(depth, rate)
        assert force > 0.0
        h = 1e-5
        by_depth = (law.force(depth * (1 + h), rate) - law.force(depth * (1 - h), rate)) / (
            2 * h * depth
        )
        by_rate = (law.force(depth, rate + h) - law.force(depth, rate - h)) / (2 * h)
        assert d_depth == pytest.approx(float(by_depth), rel=1e-7)  # h^2 truncation, eps/h rounding
        assert d_rate == pytest.approx(float(by_rate), rel=1e-7)


@pytest.mark.parametrize("name", NORMAL)
def test_elastic_energy_is_the_integral_of_the_elastic_force(name: str) -> None:
    native = NORMAL[name].native()
    depth = np.linspace(0.0, 3e-4, 20001)
    force = np.array([native(d, 0.0)[3] for d in depth])
    assert native.energy(depth[-1]) == pytest.approx(np.trapezoid(force, depth), rel=1e-7)


@pytest.mark.parametrize("name", FRICTION)
def test_friction_law_equals_its_formula(name: str) -> None:
    law = FRICTION[name]
    for speed in [1e-9, 1e-5, 1e-3, 0.05, 0.0999, 0.1001, 0.5, 0.9999, 1.5]:
        assert law.coefficient(speed) == pytest.approx(numpy_friction(law, speed), rel=1e-12)


@pytest.mark.parametrize("name", FRICTION)
def test_friction_slope_equals_central_differences(name: str) -> None:
    native = FRICTION[name].native()
    for speed in [1e-5, 3e-4, 0.02, 0.3, 2.0]:
        h = 1e-3 * speed
        slope = (native(speed + h)[0] - native(speed - h)[0]) / (2 * h) / speed
        assert native(speed)[1] == pytest.approx(slope, rel=1e-4, abs=1e-9 * native(speed)[0])


def test_adams_friction_passes_its_named_points() -> None:
    law = FRICTION["adams"]
    assert law.coefficient(0.1) == pytest.approx(0.3, rel=1e-15)
    assert law.coefficient(1.0) == pytest.approx(0.1, rel=1e-15)
    assert law.coefficient(5.0) == pytest.approx(0.1, rel=1e-15)


def test_laws_are_finite_where_numbers_are_denormal() -> None:
    """HC33: depth and speed of 1e-310 give no force and no NaN."""
    for law in NORMAL.values():
        assert 0.0 <= float(law.force(1e-310, 1e-310)) < 1e-300
        assert np.all(np.isfinite(law.native()(1e-310, 1e-310)))
    for law in FRICTION.values():
        assert np.all(np.isfinite(law.native()(1e-310)))
        assert np.all(np.isfinite(law.native()(0.0)))


def test_no_law_pulls() -> None:
    for law in NORMAL.values():
        assert float(law.force(1e-4, -10.0)) == 0.0


def test_units_of_the_second_paper() -> None:
    """1e5 N/mm^2.2 is 3.981e11 N/m^2.2; 7.57 N sink 0.01339 mm into it (physics 3.3)."""
    assert stiffness_from_mm(1e5, 2.2) == pytest.approx(3.98107170553497e11, rel=1e-12)
    assert float(NORMAL["adams"].force(0.01339e-3)) == pytest.approx(7.57, rel=2e-3)  # 4 digits


def test_hertz_stiffness_of_the_assumed_rubber_foot() -> None:
    assert hertz_stiffness(young=5e6, poisson=0.49, radius=0.02) == pytest.approx(1.24e6, rel=2e-3)


@pytest.mark.parametrize(
    ("case", "mass", "speed"),
    [("m=0.11kg,v0=100mm/s", 0.11, 0.1), ("m=0.11kg,v0=500mm/s", 0.11, 0.5)],
)
def test_hc01d_adams_impact_bounce(case: str, mass: float, speed: float, tmp_path) -> None:
    """HC01d: restitution and depth of ADAMS IMPACT on a free mass, through the simulator."""
    reference = HARD_CASES["HC01d_adams_impact_seed2"]["ref"][case]
    robot = vehicles.particle(tmp_path, mass)
    scene = hp.Scene(robot, contact=hp.Contact.s2(), servo=vehicles.LIMP, gravity=(0, 0, 0))
    trace = hp.simulate(
        scene,
        hp.Hold(),
        duration=2.2e-3,
        method="rk4",
        step=1e-6,
        sample=1e-6,
        initial=vehicles.state(robot, 0.0, (0.0, 0.0, -speed)),
    )
    assert trace.v[-1, 2] / speed == pytest.approx(reference["e"], rel=1e-6)
    deepest = int(trace.foot_gap.argmin())
    beyond = trace.v[deepest, 2] ** 2 / (2.0 * trace.foot_force[deepest, 0, 2] / mass)
    depth = beyond - trace.foot_gap[deepest, 0]
    assert depth * 1e3 == pytest.approx(reference["delta_max_mm"], rel=1e-6)


def test_presets_by_name() -> None:
    assert hp.Contact.preset("s2") == hp.Contact.s2()
    with pytest.raises(UnknownNameError, match="s3"):
        hp.Contact.preset("s3")


@pytest.mark.parametrize(
    ("build", "culprit"),
    [
        (lambda: hp.HuntCrossley(stiffness=-1.0), "HuntCrossley.stiffness"),
        (lambda: hp.HuntCrossley(stiffness=1e5, exponent=0.5), "HuntCrossley.exponent"),
        (lambda: hp.HuntCrossley(stiffness=float("nan")), "HuntCrossley.stiffness"),
        (lambda: hp.TanhCoulomb(mu=-0.1, slope=1.0), "TanhCoulomb.mu"),
        (lambda: hp.TanhCoulomb(mu=0.1, slope=0.0), "TanhCoulomb.slope"),
        (lambda: hp.TanhCoulomb(mu=0.1, slope=1.0, kt=3.0), "kt"),
        (
            lambda: hp.AdamsCoulomb(
                mu_static=0.3, mu_dynamic=0.1, stiction_speed=0.1, transition_speed=0.05
            ),
            "stiction_speed",
        ),
    ],
)
def test_bad_parameters_are_refused_by_name(build, culprit: str) -> None:
    with pytest.raises(ParameterError, match=culprit):
        build()


def test_native_kinds_match_the_python_laws() -> None:
    assert NORMAL["adams"].native().kind == _native.NormalKind.adams_impact
    assert FRICTION["tanh"].native().kind == _native.FrictionKind.tanh_coulomb
