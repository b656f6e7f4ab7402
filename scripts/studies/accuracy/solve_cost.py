"""What solving S1's 204 equations once costs: block elimination, dense LU, sparse LU, the core."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.formulations import maximal
from hexapod_pin.text_table import Table
from hexapod_pin.validation.checks.maximal_checks import maximal_twin, pressed_states
from studies.cost.timing import interleaved

Index = NDArray[np.signedinteger[Any]]

CALLS = 40


def solve_costs(rounds: int) -> Table:
    """Return medians over interleaved rounds, microseconds of processor time."""
    jobs = solve_subjects()
    runs = {name: partial(_processor_time, job) for name, job in jobs.items()}
    rows = [(name, f"{np.median(x):.1f}") for name, x in interleaved(runs, rounds).items()]
    rows.append(("the core: an evaluation inside an RK4 run (wall time)", f"{core_run():.1f}"))
    return Table("One solve of the 204 equations", ("what", "processor time [us]"), rows)


def core_run() -> float:
    """Return microseconds of wall time an evaluation: 0.2 s of standing in steps of 0.1 ms."""
    scene = hp.Scene(hp.load_robot("kharagpur"), contact=hp.Contact.s1())
    trace = hp.simulate(scene, hp.HoldPosture(), duration=0.2, method="rk4", step=1e-4, sample=0.2)
    return float((trace.run.wall_time or 0.0) / trace.counters["evaluations"] * 1e6)


def solve_subjects() -> dict[str, Callable[[], object]]:
    """Return kharagpur on five or six feet, the same state for all."""
    from scipy.sparse import csc_matrix
    from scipy.sparse.linalg import splu

    from hexapod_pin import native
    from hexapod_pin.simulation.plant import native_plant

    scene = hp.Scene(hp.load_robot("kharagpur"), contact=hp.Contact.s1())
    twin, (q, v, torque) = maximal_twin(scene), pressed_states(scene, 1)[0]
    model, plant = twin.model, native_plant(scene)
    state = maximal.initial_state(model, twin.bodies_order(q, 7), twin.bodies_order(v, 6))
    at = model.kinematics(state)
    joints = model.constraints(state, at)
    force, none = np.ones((19, 6)), np.empty(0)
    full = full_matrix(model.bodies.parent, at.mass, joints.on_parent, joints.on_child)
    right = np.r_[force.ravel(), joints.gamma.ravel()]
    thin = csc_matrix(full)
    return {
        "whole evaluation: kinematics, contacts, elimination": lambda: maximal.derivative(
            model, state, torque
        ),
        "block elimination on the tree alone": lambda: model.solve_kkt(
            at.mass, force, joints, joints.gamma, none
        ),
        "dense LU, 204 x 204": lambda: np.linalg.solve(full, right),
        "SuperLU, the same matrix already in CSC": lambda: splu(thin).solve(right),
        "the core: whole evaluation with Jacobians, through Python": lambda: native.evaluate(
            plant, q, v, torque
        ),
    }


def full_matrix(parent: Index, mass: Array, up: Array, down: Array) -> Array:
    """Return [M -D'; D 0]."""
    bodies, joints = len(mass), len(parent)
    full = np.zeros((6 * bodies + 5 * joints,) * 2)
    for k in range(bodies):
        full[6 * k : 6 * k + 6, 6 * k : 6 * k + 6] = mass[k]
    across = full[6 * bodies :, : 6 * bodies]
    for j, i in enumerate(parent):
        across[5 * j : 5 * j + 5, 6 * i : 6 * i + 6] = up[j]
        across[5 * j : 5 * j + 5, 6 * j + 6 : 6 * j + 12] = down[j]
    full[: 6 * bodies, 6 * bodies :] = -across.T
    return full


def _processor_time(job: Callable[[], object]) -> float:
    """Return microseconds of processor time a call."""
    began = time.process_time()
    for _ in range(CALLS):
        job()
    return (time.process_time() - began) / CALLS * 1e6
