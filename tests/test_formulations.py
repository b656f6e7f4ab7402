"""The rooms of the formulations: their names, and the verbs that two of them share."""

from __future__ import annotations

import inspect

import numpy as np
import pytest

import hexapod_pin as hp
from hexapod_pin.formulations import inverse, maximal, rigid
from hexapod_pin.formulations.conserved import ConservedQuantities

ROOMS = (inverse, maximal, rigid)
VERBS = ("initial_state", "derivative", "energy", "integrate")
LISTED = [(room, name) for room in ROOMS for name in room.__all__]


@pytest.mark.parametrize("room", ROOMS, ids=lambda room: room.__name__)
def test_names_are_listed_once_and_sorted(room) -> None:
    assert room.__all__ == sorted(set(room.__all__))


@pytest.mark.parametrize(("room", "name"), LISTED, ids=lambda part: getattr(part, "__name__", part))
def test_listed_names_exist_and_are_documented(room, name: str) -> None:
    found = getattr(room, name)
    assert callable(found)
    assert (inspect.getdoc(found) or "").strip()


@pytest.mark.parametrize("verb", VERBS)
def test_verbs_take_the_same_first_arguments(verb: str) -> None:
    """A reader can lay the formulations side by side."""
    signatures = [list(inspect.signature(getattr(room, verb)).parameters) for room in ROOMS[1:]]
    shared = {"initial_state": 3, "derivative": 3, "energy": 2, "integrate": 3}[verb]
    assert signatures[0][:shared] == signatures[1][:shared]


def test_one_state_in_both_formulations() -> None:
    """A limp hexapod in the air: the same acceleration, energy and momentum, then 20 ms of flight.

    Maximal coordinates read the URDF by another parser and share no formula with Pinocchio.
    """
    robot, rng = hp.load_robot("kharagpur"), np.random.default_rng(8)
    bodies = maximal.read_bodies(robot.urdf)
    order = [robot.joint_index(name) for name in bodies.joint_names]
    q, v = robot.stand().q.copy(), rng.normal(size=24)
    q[7:] += 0.2 * rng.normal(size=18)
    one, two = rigid.RigidModel(robot), maximal.MaximalModel(bodies)
    state = rigid.initial_state(one, q, v)
    turned = maximal.initial_state(two, np.r_[q[:7], q[7:][order]], np.r_[v[:6], v[6:][order]])

    found = rigid.derivative(one, state, np.zeros(18), feet=())
    other = maximal.derivative(two, turned, np.zeros(18))
    rates = maximal.reduced_acceleration(bodies, turned, other.acceleration)
    expected = np.r_[found.acceleration[:6], found.acceleration[6:][order]]
    assert np.abs(rates - expected).max() < 1e-10 * np.abs(expected).max()

    known, kept = rigid.energy(one, state), maximal.energy(two, turned)
    assert isinstance(known, ConservedQuantities) and isinstance(kept, ConservedQuantities)
    assert kept.total == pytest.approx(known.total, rel=1e-12)
    assert kept.angular_momentum == pytest.approx(known.angular_momentum, rel=1e-10)
    assert kept.center_of_mass == pytest.approx(known.center_of_mass, abs=1e-14)

    end = rigid.integrate(one, state, 0.02, accuracy=1e-10)
    run = maximal.integrate(two, turned, 0.02)
    assert run.q[-1, :3] == pytest.approx(end.q[:3], abs=1e-10)
    assert run.q[-1, 7:] == pytest.approx(end.q[7:][order], abs=1e-9)
