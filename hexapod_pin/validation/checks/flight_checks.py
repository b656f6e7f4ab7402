"""What free flight and one fixed point keep: eqs. 1-4 under DOP853, and the core beside them."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.formulations.rigid import RigidModel, integrate
from hexapod_pin.robot.state import State
from hexapod_pin.validation.cases.bodies import body, state
from hexapod_pin.validation.cases.flight import flying
from hexapod_pin.validation.cases.robots import answers
from hexapod_pin.validation.checks.samples import worst
from hexapod_pin.validation.hard_case import Check
from hexapod_pin.validation.solver_setting import DOP853


def hc14b() -> float:
    """Return the largest error of energy, momentum and centre of mass after 0.5 s of flight."""
    model, _ = _flight_start()
    known, end = answers("HC14b"), _flight(0.5)
    energy, spin, com = _kept(model, end)
    return max(
        abs(energy / float(known["energy"]) - 1.0),
        worst(spin, np.array(known["angular_momentum_about_com"])),
        float(np.abs(com - np.array(known["com_0.5s"])).max()),
    )


def invariants() -> float:
    """Return the relative drift of energy and angular momentum over 1 s of flight."""
    model, start = _flight_start()
    (e0, l0, _), (e1, l1, _) = _kept(model, start), _kept(model, _flight(1.0))
    return max(abs(e1 / e0 - 1.0), worst(l1, l0))


def core_flight() -> float:
    """Return how far the core's DOP853 is from eqs. 1-4 after 0.5 s of flight [m, rad]."""
    import pinocchio as pin

    (model, _), (_, run) = _flight_start(), flying()
    trace = run.by(DOP853)
    return float(np.abs(pin.difference(model.model, _flight(0.5).q, trace.q[-1])).max())


def dzhanibekov() -> float:
    """Return the error of the rates of an unstable spin after 10 s, over the largest.

    Rounding of the energy, 1e-15, over (1e-3)^2 moves the flips: about 1e-7 after two of them.
    """
    known = answers("HC11")["seed_trunk_w2=10,eps=1e-3"]
    robot = body({"tip": (0.0, 0.0, -1.0)}, inertia=(0.0025185, 0.0166529, 0.0168972))
    model = RigidModel(robot, gravity=(0.0, 0.0, 0.0))
    spin = [float(x) for x in known["omega0"]]
    end = integrate(model, state(robot, (0.0, 0.0, 5.0), spin=spin), 10.0)
    wanted = np.array([float(x) for x in known["omega_body(10s)"]])
    return worst(end.v[3:6], wanted)


def pendulum() -> float:
    """Return the error of a quarter period of a mass on one stuck foot, 90 degrees [rad]."""
    period = float(answers("HC12")["point_mass_l0.1"]["90"])
    small = 1e-12  # moments of the body that models a point mass: 1e-10 of m l^2
    robot = body({"pivot": (0.0, 0.0, 0.1)}, inertia=(small, small, small))
    model, start = RigidModel(robot), state(robot)
    q = start.q.copy()
    q[3:7] = [np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)]
    end = integrate(model, robot.check_state(q, start.v), 0.25 * period, feet=[0])
    angle = 2.0 * np.arctan2(end.q[3], end.q[6])
    return abs(float(angle))


@lru_cache(maxsize=1)
def _flight_start() -> tuple[RigidModel, State]:
    robot, run = flying()
    return RigidModel(robot), run.initial


@lru_cache(maxsize=2)
def _flight(duration: float) -> State:
    model, start = _flight_start()
    return integrate(model, start, duration)


def _kept(model: RigidModel, now: State) -> tuple[float, Array, Array]:
    """Return energy [J], angular momentum about the centre of mass, centre of mass."""
    import pinocchio as pin

    energy = pin.computeMechanicalEnergy(model.model, model.data, now.q, now.v)
    momentum = pin.computeCentroidalMomentum(model.model, model.data, now.q, now.v)
    com = pin.centerOfMass(model.model, model.data, now.q)
    return float(energy), np.array(momentum.angular), np.array(com)


CHECKS = (
    Check("hc14b", "0.5 s of flight by eqs. 1-4: energy, momentum, centre of mass", hc14b, 1e-9,
          source="HC14b"),
    Check("flight", "1 s of flight by eqs. 1-4: energy and angular momentum", invariants, 1e-10,
          source="HC14b"),
    Check("core-flight", "0.5 s of flight: core against eqs. 1-4", core_flight, 1e-9, "m, rad",
          "HC14b"),
    Check("hc11", "unstable spin for 10 s: rates of the body", dzhanibekov, 1e-6, source="HC11"),
    Check("hc12", "pendulum on one stuck foot: angle after a quarter period", pendulum, 1e-8,
          "rad", "HC12"),
)  # fmt: skip
