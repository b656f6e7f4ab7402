"""S1's equations in maximal coordinates at one state: against the core, dense algebra, statics."""

from __future__ import annotations

import itertools
import subprocess
import sys

import pytest
import vehicles
from contact_formulas import FRICTION, NORMAL

import hexapod_pin as hp
from hexapod_pin.formulations.maximal import initial_state
from hexapod_pin.formulations.maximal import model as equations
from hexapod_pin.validation.checks.maximal_checks import (
    compare_accelerations,
    maximal_twin,
    pressed_states,
)

TERRAINS = {
    "slope": hp.Slope(angle=0.2, heading=0.7),
    "stairs": hp.Stairs(rise=0.03, run=0.15, count=4, start=-0.3),
    "groove": hp.terrain.Groove(angle_left=0.4, angle_right=0.3, depth=0.04),
    "hills": hp.HeightField.random(3, amplitude=0.01),
    "patched": hp.terrain.PatchedGround(
        ground=hp.Slope(angle=0.1),
        patches=(hp.terrain.Patch(low=(-9, 0), high=(9, 9), friction=0.5, stiffness=2),),
    ),
    "shaken": hp.terrain.ShakingGround(amplitude=2e-3, frequency=12.0),
}


def robot_of(name: str) -> hp.Robot:
    return vehicles.hexa_ref() if name == "hexa_ref" else hp.load_robot(name)


# --- against the core ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "contact"), [("kharagpur", "s1"), ("athena", "s2"), ("hexa_ref", "s1")]
)
def test_accelerations_equal_the_core(name: str, contact: str) -> None:
    """200 random states with contacts over the six combinations.

    1e-9 is wanted; both sides are sums of some 1e3 terms of rounding 1e-16 and condition 1e1 to
    1e2, so 1e-12 is what a right formula keeps.
    """
    scene = hp.Scene(robot_of(name), contact=hp.Contact.preset(contact))
    states = pressed_states(scene, 34)
    assert compare_accelerations(scene, states) < 1e-12
    twin = maximal_twin(scene)
    q, v, _ = states[0]
    state = initial_state(twin.model, twin.bodies_order(q, 7), twin.bodies_order(v, 6))
    assert (twin.model.gaps(0.0, state) < 0.0).sum() >= 5  # the states do press on the ground


FRICTIONS = {**FRICTION, "stick-slip": hp.contact.StickSlip(mu=0.7, stiffness=2e4, damping=60.0)}


@pytest.mark.parametrize(
    ("normal", "friction"),
    [pair for k, pair in enumerate(itertools.product(NORMAL, FRICTIONS)) if k % 4 == 0],
)
def test_every_law_equals_the_core(normal: str, friction: str) -> None:
    """First touch: touch speed that of the state, bristles at rest."""
    contact = hp.Contact(normal=NORMAL[normal], friction=FRICTIONS[friction])
    scene = hp.Scene(hp.load_robot("kharagpur"), contact=contact)
    assert compare_accelerations(scene, pressed_states(scene, 2)) < 1e-11


@pytest.mark.parametrize("terrain", TERRAINS)
def test_every_ground_equals_the_core(terrain: str) -> None:
    scene = hp.Scene(hp.load_robot("kharagpur"), contact=hp.Contact.s1(), terrain=TERRAINS[terrain])
    assert compare_accelerations(scene, pressed_states(scene, 4)) < 1e-11


def test_joint_stops_and_damping_equal_the_core() -> None:
    """Joints beyond their limits, moving outwards and inwards."""
    robot = vehicles.hexa_ref()
    scene = hp.Scene(robot, contact=hp.Contact.s1())
    states = [(q.copy(), v, torque) for q, v, torque in pressed_states(scene, 4)]
    for k, (q, _, _) in enumerate(states):
        q[7:] = (robot.upper if k % 2 else robot.lower) + 0.01 * (1 if k % 2 else -1)
    assert compare_accelerations(scene, states) < 1e-12


# --- planted errors -----------------------------------------------------------------------------


def minus(function):
    return lambda *given: -function(*given)


@pytest.mark.parametrize(
    ("name", "wrong"),
    [
        ("gamma_row_1", minus(equations.gamma_row_1)),
        ("world_inertia", lambda turn, inertia: turn.transpose(0, 2, 1) @ inertia @ turn),
    ],
    ids=["sign of row 1", "transposed axes"],
)
def test_planted_error_is_seen(monkeypatch, name, wrong) -> None:
    """A hundred times the 1e-9 that is allowed, although contacts make the largest part of v'.

    Others are planted in the checks of `verify`.
    """
    scene = hp.Scene(hp.load_robot("kharagpur"), contact=hp.Contact.s1())
    states = pressed_states(scene, 3)
    monkeypatch.setattr(equations, name, wrong)
    assert compare_accelerations(scene, states) > 1e-7


def test_swapped_inertia_axes_are_seen(monkeypatch) -> None:
    """The tibia's moments about x and y exchanged in the URDF that one side reads."""
    scene = hp.Scene(vehicles.hexa_ref(), contact=hp.Contact.s1())
    states = pressed_states(scene, 3)
    old, new = '"9.8446e-05"', '"8.7515e-05"'
    text = scene.robot.urdf
    assert text.count(old) == 6
    swapped = text.replace(old, "OLD").replace(new, old).replace("OLD", new)
    object.__setattr__(scene.robot, "urdf", swapped)
    assert compare_accelerations(scene, states) > 1e-7


# --- nothing shared -----------------------------------------------------------------------------


def test_flat_ground_needs_neither_pinocchio_nor_the_core() -> None:
    """One evaluation with contacts in a fresh interpreter: neither is loaded."""
    script = """
import sys
from pathlib import Path
import numpy as np
from hexapod_pin.ground.contact import Contact
from hexapod_pin.formulations import maximal
from hexapod_pin.ground.terrain import Flat
bodies = maximal.read_bodies(Path(sys.argv[1]).read_text(), ["lf_foot"])
model = maximal.MaximalModel(bodies, contact=maximal.GroundContact(bodies, Contact.s1(), Flat()))
state = maximal.initial_state(model, np.r_[np.zeros(6), 1.0, np.zeros(18)], np.zeros(24))
found = maximal.derivative(model, state, np.zeros(18))
assert np.isfinite(found.acceleration).all()
print([name for name in ("pinocchio", "hexapod_pin.native") if name in sys.modules])
"""
    path = str(hp.urdf_path("kharagpur"))
    done = subprocess.run(
        [sys.executable, "-c", script, path], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"
