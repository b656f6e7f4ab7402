"""Contacts: force and 3x3 blocks of every pair of laws, presets, refusals, TOML."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import tomli_w
import vehicles
from contact_formulas import FRICTION, NORMAL, numpy_friction, numpy_normal
from refusals import ANY, refused

import hexapod_pin as hp
from hexapod_pin import native as _native
from hexapod_pin.errors import ParameterError, UnknownNameError
from hexapod_pin.ground.contact.contact import PRESETS
from hexapod_pin.simulation.plant import native_plant
from hexapod_pin.spec import read_toml

FRICTIONS = {**FRICTION, "stick-slip": hp.contact.StickSlip(mu=0.7, stiffness=2e4, damping=60.0)}
UP = np.array([0.0, 0.0, 1.0])


def numpy_force(contact: hp.Contact, gap: Any, u: Any, touch_speed: float) -> Any:
    slip = u - UP * u[2]
    normal = numpy_normal(contact.normal, -gap, -u[2], touch_speed)
    speed = np.sqrt(slip @ slip)  # not a norm: complex steps pass through it
    if speed == 0.0:
        return normal * UP
    if isinstance(contact.friction, hp.contact.StickSlip):
        bristle = contact.friction
        tangential = min(bristle.damping * speed, bristle.mu * normal, key=np.real)
    else:
        tangential = normal * numpy_friction(contact.friction, speed)
    return normal * UP - tangential * slip / speed


def slope_at_rest(contact: hp.Contact, gap: float, u: np.ndarray, touch_speed: float) -> float:
    normal = numpy_normal(contact.normal, -gap, -u[2], touch_speed)
    if isinstance(contact.friction, hp.contact.StickSlip):
        return contact.friction.damping if normal > 0.0 else 0.0
    return normal * np.imag(numpy_friction(contact.friction, 1e-200j)) / 1e-200


def states() -> list[tuple[float, np.ndarray]]:
    rng = np.random.default_rng(5)
    depth, u = rng.uniform(0.0, 4e-4, 60), rng.normal(size=(60, 3)) * 0.1
    u[40:] *= 0.01  # so slow that a bristle's damper holds
    found = list(zip(-depth, u, strict=True))
    still = np.array([0.0, 0.0, -0.01])
    found += [(-1e-12, np.array([0.01, -0.02, -0.1])), (-1e-4, still), (-1e-4, 0.0 * still)]
    return [*found, (1e-4, still)]


PAIRS = [("adams", "adams"), *((normal, "tanh") for normal in NORMAL)]
PAIRS += [("hertz", friction) for friction in FRICTIONS if friction != "tanh"]


@pytest.mark.parametrize(("normal", "friction"), PAIRS)
def test_force_and_blocks_of_every_pair(normal: str, friction: str, tmp_path) -> None:
    """The force equals NumPy's, its blocks -df/du (3x3) and -df/dgap (3) equal complex steps."""
    contact = hp.Contact(normal=NORMAL[normal], friction=FRICTIONS[friction])
    robot = vehicles.particle(tmp_path)
    plant = native_plant(hp.Scene(robot, contact=contact, servo=vehicles.LIMP))
    for gap, u in states():
        state = vehicles.state(robot, gap, u)
        found = _native.evaluate(plant, state.q, state.v, np.zeros(0))
        touch = max(0.0, -u[2])  # a foot never seen before takes the speed it has
        force = np.real(numpy_force(contact, gap, u + 0j, touch))
        size = 1e-300 + 1e-12 * np.abs(force).max()
        assert found["foot_force"][0] == pytest.approx(force, rel=1e-12, abs=size)
        damping, stiffness = found["foot_damping"], found["foot_stiffness"][0]
        # some ten roundings, on the scale of the largest entry
        size = 1e-300 + 1e-12 * np.abs(damping).max()
        for k in range(3):
            if u[:2].any() or k == 2:
                moved = numpy_force(contact, gap, u + 1e-30j * np.eye(3)[k], touch)
                column = -np.imag(moved) / 1e-30
            else:  # at rest the slip speed has a corner; m(s)/s has none
                column = slope_at_rest(contact, gap, u, touch) * np.eye(3)[k]
            assert damping[:, k] == pytest.approx(column, rel=1e-11, abs=size), (gap, u, k)
        moved = numpy_force(contact, gap + 1e-40j, u + 0j, touch)
        size = 1e-300 + 1e-12 * np.abs(stiffness).max()
        assert stiffness == pytest.approx(-np.imag(moved) / 1e-40, rel=1e-11, abs=size)


def test_laws_and_presets_survive_toml() -> None:
    laws = [hp.Contact(normal=NORMAL[one], friction=FRICTIONS[other]) for one, other in PAIRS]
    for contact in (*laws, *map(hp.Contact.preset, PRESETS)):
        assert hp.Contact(**read_toml(tomli_w.dumps(contact.model_dump()))) == contact


def test_presets() -> None:
    assert hp.Contact.preset("s2") == hp.Contact.s2()
    with refused(UnknownNameError, kind="contact preset", name="s3", known=list(PRESETS)):
        hp.Contact.preset("s3")
    assert [name for name in PRESETS if not hp.Contact.preset(name).assumed] == ["s2"]
    assert hp.Contact.accurate().normal.delivered == pytest.approx(0.3, rel=1e-14)
    # the first paper's equation, Hertzian and linear: both have 0.49 mm under 13.5 N
    for law, exponent in ((hp.Contact.s1().normal, 1.5), (hp.Contact.s1_printed().normal, 1.0)):
        assert law.exponent == exponent
        assert float(law.force(0.49e-3)) == pytest.approx(13.5, rel=5e-3)  # two digits given
        assert float(law.force(1e-3, 0.1) / law.force(1e-3)) == pytest.approx(4.0, rel=1e-12)


STATIC, STIFF = {"mu_static": 0.3, "mu_dynamic": 0.4}, {"stiffness": 1e5}
BRISTLE = {"mu": 0.3, "stiffness": 1.0, "damping": 0.0}
SPEEDS = {"stiction_speed": 0.1, "transition_speed": 0.05}
BAD = [
    ("HuntCrossley", {**STIFF, "exponent": 0.5}, ".exponent", 0.5, ()),
    ("KelvinVoigt", STIFF, ".damping", None, ()),
    ("Restitution", {**STIFF, "restitution": 2.0}, ".restitution", 2.0, (1.0,)),
    ("TanhCoulomb", {"mu": 0.1, "slope": 1.0, "kt": 3.0}, ".kt", 3.0, ()),
    ("SmoothStep", {**STATIC, "speed": 1e-3}, "", ANY, (0.4, 0.3)),
    ("BrownMcPhee", {**STATIC, "speed": 1e-3}, "", ANY, (0.4, 0.3)),
    ("StickSlip", {**BRISTLE, "mu_dynamic": 0.4}, "", ANY, (0.4, 0.3)),
    ("AdamsCoulomb", {**STATIC, "mu_dynamic": 0.1, **SPEEDS}, "", ANY, (0.1,)),
]


@pytest.mark.parametrize(("law", "parameters", "place", "value", "allowed"), BAD)
def test_bad_parameters_are_refused_by_name(law, parameters, place, value, allowed):
    with refused(ParameterError, law + place, value, allowed=allowed):
        getattr(hp.contact, law)(**parameters)
