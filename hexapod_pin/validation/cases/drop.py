"""HC31, HC39, HC40: the hexapod that is set down tilted and moving."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from functools import lru_cache, partial
from typing import Any

import numpy as np

from hexapod_pin.benchmark.error import Distance
from hexapod_pin.benchmark.scenes import hc40
from hexapod_pin.benchmark.settings import Setting
from hexapod_pin.robot.robot import Robot
from hexapod_pin.robot.state import State
from hexapod_pin.simulation.scene import Scene
from hexapod_pin.validation.cases.bodies import FREE
from hexapod_pin.validation.cases.case_result import HardCase, HardRow
from hexapod_pin.validation.cases.robots import DATA
from hexapod_pin.validation.cases.solver_settings import Run, Wanted, measured, ways

EIGHT = (Setting("extrapolated-euler", 1e-8), Setting("ndf", 1e-8), Setting("dop853", 1e-8))


def drop(variant: str, *, duration: float = 0.25, sample: float | None = None) -> Run:
    """Return HC40 "soft", "mid" or "stiff", without joint stops as its references are."""
    task = hc40(variant)
    scene = Scene(task.scene.robot, contact=task.scene.contact, servo=task.scene.servo, stops=FREE)
    return Run(scene, task.initial, duration, sample, task.controller)


@lru_cache(maxsize=1)
def _answers() -> dict[str, Any]:
    data: dict[str, Any] = json.loads((DATA / "hc40_references.json").read_text(encoding="utf-8"))
    return data


def end_state(robot: Robot, variant: str) -> State:
    """Return HC40's state at 0.25 s, by SciPy's DOP853 over Pinocchio's ABA."""
    data = _answers()
    order = [data["joint_order"].index(name) for name in robot.joint_names]
    q, v = np.array(data[variant]["q"]), np.array(data[variant]["v"])
    return robot.check_state(np.r_[q[:7], q[7:][order]], np.r_[v[:6], v[6:][order]])


# --- HC40 ---------------------------------------------------------------------------------------


def hc40_rows(quick: bool) -> Iterator[HardRow]:
    """HC40 soft, mid and stiff at an accuracy of 1e-8."""
    for variant in ("soft", "mid", "stiff"):
        for way in ways(quick, EIGHT):
            if variant == "stiff" and way.method == "dop853":
                continue  # 1.7 million evaluations a second: independent truth up to mid
            yield from measured("HC40", variant, way, partial(_drop, variant))


def _drop(variant: str, way: Setting) -> Iterator[Wanted]:
    run = drop(variant)
    trace = run.by(way)
    known = end_state(run.scene.robot, variant)
    apart = Distance.between(trace.q[-1:], known.q[np.newaxis]).q
    yield Wanted(f"positions at 0.25 s, {variant}", apart, 1e-6, "m, rad")
    error = float(np.abs(trace.v[-1] - known.v).max())
    yield Wanted(f"velocities at 0.25 s, {variant}", error, 1e-4, "m/s, rad/s")
    if variant == "soft":
        answer = hc40("soft").answer
        assert answer is not None
        apart = Distance.between(trace.q[-1:], answer[np.newaxis]).q
        yield Wanted("positions against the catalogue, soft", apart, 1e-6, "m, rad")


# --- HC31 ---------------------------------------------------------------------------------------


def hc31(quick: bool) -> Iterator[HardRow]:
    """Energy account of HC40: nothing is made or lost, losses never shrink."""
    for variant in ("soft",) if quick else ("soft", "mid", "stiff"):
        for way in ways(quick, EIGHT[:2]):
            yield from measured("HC31", variant, way, partial(_audit, variant))


def _audit(variant: str, way: Setting) -> Iterator[Wanted]:
    trace = drop(variant, sample=2.5e-3).by(way)
    lost = trace.energy["normal_loss"][-1] + trace.energy["friction_loss"][-1]
    residual = float(np.abs(trace.energy_residual).max() / lost)
    yield Wanted(f"energy residual over contact losses, {variant}", residual, 1e-6)
    for name in ("friction_loss", "normal_loss"):
        back = float(-np.diff(trace.energy[name]).min())
        # a loss is work less stored energy: its round-off is that of the stored energy
        limit = 1e-8 * lost
        yield Wanted(f"{name.replace('_', ' ')} runs back, {variant}", max(0.0, back), limit, "J")


# --- HC39 ---------------------------------------------------------------------------------------


def hc39(quick: bool) -> Iterator[HardRow]:
    """Observed orders of the fixed-step methods before and after touch-down."""
    for method, order, step in (("implicit-euler", 1.0, 4e-5), ("rk4", 4.0, 2e-4)):
        look = partial(_order_in_flight, order)
        yield from measured("HC39", "order in flight", Setting(method, step), look)
    # the catalogue: the first order of the linear step stays, rk4 falls to 2 .. 2.5
    contact = (("implicit-euler", 1.0, 0.3, 4e-4), ("rk4", 2.25, 0.55, 2.5e-5))
    for method, order, band, step in contact[: 1 if quick else None]:
        look = partial(_order_through_contact, order, band)
        yield from measured("HC39", "order through contact", Setting(method, step), look)


def _order_in_flight(order: float, way: Setting) -> Iterator[Wanted]:
    run = drop("soft", duration=0.02)
    q = run.start.q.copy()
    q[2] += 0.5
    q[7:] += 0.05  # the servos pull
    start = run.scene.robot.check_state(q, run.start.v)
    found = _observed(Run(run.scene, start, 0.02, None, run.controller), way)
    yield Wanted("order before touch-down", abs(found - order), 0.2, note=f"order {found:.2f}")


def _order_through_contact(order: float, band: float, way: Setting) -> Iterator[Wanted]:
    found = _observed(drop("soft", sample=0.01), way)
    yield Wanted("order after touch-down", abs(found - order), band, note=f"order {found:.2f}")


def _observed(run: Run, way: Setting) -> float:
    """Return by how many halvings the error falls per halving of the step, over two."""
    known = run.by(Setting("dop853", 1e-12)).q
    errors = [
        Distance.between(run.by(Setting(way.method, way.value / n)).q, known).q for n in (1, 4)
    ]
    return 0.5 * math.log2(errors[0] / errors[1])


CASES = (
    HardCase("HC31", "energy account through contact", hc31),
    HardCase("HC39", "order of convergence, before and through contact", hc39),
    HardCase("HC40", "full drop: six stiff feet, friction, servos; 49 numbers", hc40_rows),
)
