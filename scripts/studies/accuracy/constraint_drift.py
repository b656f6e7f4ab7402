"""How far joints in maximal coordinates drift apart: Baumgarte's terms, the step, and projection.

The limp hexapod of HC14b flies for one second by RK4, every joint turning at up to 3 rad/s; errors
are against DOP853 at rtol 1e-11, projected.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.errors import DivergenceError
from hexapod_pin.formulations import maximal
from hexapod_pin.text_table import Table
from hexapod_pin.validation.cases.flight import flying
from hexapod_pin.validation.checks.maximal_checks import Twin, maximal_twin, position_difference
from hexapod_pin.validation.solver_setting import CaseRun
from hexapod_pin.view.figure_file import write_svg
from studies.accuracy.solve_cost import solve_costs
from studies.study import RESULTS, StudyReport

FIGURE = RESULTS / "constraint_drift.svg"
STEPS = (4e-3, 2e-3, 1e-3)
SAMPLE = 0.02

Preset = maximal.Baumgarte
STABILISATIONS: dict[str, Callable[[float], tuple[maximal.Baumgarte, bool]]] = {
    "nothing": lambda h: (Preset.off(), False),
    "alpha = beta = 5": lambda h: (Preset.constant(), False),
    "alpha = beta = 50": lambda h: (Preset.critical(50.0), False),
    "alpha = beta = 200": lambda h: (Preset.critical(200.0), False),
    "alpha = 1/h, beta = sqrt(2)/h": lambda h: (Preset.by_step(h), False),
    "projection": lambda h: (Preset.off(), True),
}


@dataclass(frozen=True)
class DriftRow:
    """One run.

    Attributes:
        stabilisation: of STABILISATIONS.
        step: [s]; 0 for DOP853.
        path: largest |Phi| at each sample [m, rad].
        drift: largest |Phi| over all steps.
        drift_rate: largest |Phi'| over all steps [m/s, rad/s].
        error: of the positions, base and joints [m, rad].
        energy: largest change over the kinetic energy at first.
        cost: processor time, the least of all rounds [s].
        evaluations: of the model.
    """

    stabilisation: str
    step: float
    path: Array
    drift: float
    drift_rate: float
    error: float
    energy: float
    cost: float
    evaluations: int


def measure(duration: float, rounds: int) -> list[DriftRow]:
    """Return the runs by RK4, then those by DOP853; the least cost of interleaved rounds."""
    reference = flown(0.0, Preset.off(), True, duration, rtol=1e-11)[0]
    jobs = [
        (stabilisation, step, *choose(step), 0.0)
        for stabilisation, choose in STABILISATIONS.items()
        for step in STEPS
    ]
    jobs += [
        (stabilisation, 0.0, Preset.off(), stabilisation == "projection", 1e-8)
        for stabilisation in ("nothing", "projection")
    ]
    turns = [
        [
            flown(step, terms, projected, duration, rtol)
            for stabilisation, step, terms, projected, rtol in jobs
        ]
        for _ in range(rounds)
    ]
    found = []
    for job, *tries in zip(jobs, *turns, strict=True):
        run, _, model = tries[0]
        cheapest = min(cost for _, cost, _ in tries)
        found.append(compared((run, cheapest, model), job[0], job[1], reference))
    return found


def flown(
    step: float, terms: maximal.Baumgarte, projected: bool, duration: float,
    rtol: float = 0.0,
) -> tuple[maximal.MaximalRun, float, maximal.MaximalModel]:  # fmt: skip
    """Return a run, its processor time and its model; a run that diverged ends early."""
    flight, twin = flight_of_bodies()
    model = maximal.MaximalModel(twin.model.bodies, baumgarte=terms)
    q, v = twin.bodies_order(flight.start.q, 7), twin.bodies_order(flight.start.v, 6)
    how: dict[str, Any] = {"step": step} if step else {"rtol": rtol, "atol": 1e-2 * rtol}
    began = time.process_time()
    try:
        with np.errstate(all="ignore"):
            start = maximal.initial_state(model, q, v)
            run = maximal.integrate(
                model, start, duration, sample=SAMPLE, projected=projected, **how
            )
    except DivergenceError as error:
        run = error.trace
    return run, time.process_time() - began, model


@cache
def flight_of_bodies() -> tuple[CaseRun, Twin]:
    """Return the flight and its robot in maximal coordinates."""
    _, flight = flying()
    return flight, maximal_twin(flight.scene)


def compared(
    flown: tuple[maximal.MaximalRun, float, maximal.MaximalModel],
    stabilisation: str,
    step: float,
    reference: maximal.MaximalRun,
) -> DriftRow:
    """Return a run beside the reference; errors are infinite where it diverged."""
    run, cost, model = flown
    whole = len(run.q) == len(reference.q)
    energy = [maximal.energy(model, s) for s in run.states]
    start = energy[0]
    return DriftRow(
        stabilisation=stabilisation,
        step=step,
        path=np.array([opening(model, state) for state in run.states]),
        drift=run.drift,
        drift_rate=run.drift_rate,
        error=position_difference(run.q, reference.q) if whole else np.inf,
        energy=max(abs(e.total - start.total) for e in energy) / start.kinetic,
        cost=cost,
        evaluations=run.counters["evaluations"],
    )


def opening(model: maximal.MaximalModel, state: maximal.MaximalState) -> float:
    """Return the largest |Phi| [m, rad]."""
    return float(np.abs(model.constraints(state, model.kinematics(state)).violation).max())


def constraint_drift(
    *, duration: float = 1.0, rounds: int = 3, solves: int = 7, figure: Path = FIGURE
) -> StudyReport:
    """Drift of joints in maximal coordinates.

    Args:
        duration: of the flight [s].
        rounds: in which each flight is timed.
        solves: rounds in which one solve is timed.
        figure: file of the figure.
    """
    rows = measure(duration, rounds)
    draw(rows, figure)
    head = (
        "stabilisation", "method", "largest Phi [m, rad]", "largest Phi'", "error [m, rad]",
        "energy", "evaluations", "processor time [s/s]",
    )  # fmt: skip
    cells = [
        (row.stabilisation, f"RK4, {1e3 * row.step:g} ms" if row.step else "DOP853, rtol 1e-8",
         *(f"{x:.1e}" for x in (row.drift, row.drift_rate, row.error, row.energy)),
         str(row.evaluations), f"{row.cost / duration:.2f}")
        for row in rows
    ]  # fmt: skip
    about = (
        f"The limp hexapod of HC14b in flight, {duration:g} s, 19 bodies, 90 constraints. Error: "
        "positions of the base and joint angles against DOP853 at rtol 1e-11. Processor time: the "
        "least of interleaved rounds."
    )
    return StudyReport(
        "Drift of joints in maximal coordinates",
        [about, Table("", head, cells), solve_costs(solves)],
    )


def draw(rows: Sequence[DriftRow], path: Path) -> None:
    """Draw drift against time at 2 ms, and drift and error against the step."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 4.0), layout="constrained")
    left, middle, right = figure.subplots(1, 3)
    for number, stabilisation in enumerate(STABILISATIONS):
        own = [row for row in rows if row.stabilisation == stabilisation and row.step]
        at = next(row for row in own if row.step == STEPS[1])
        steps = [1e3 * row.step for row in own]
        look = {"color": f"C{number}", "label": stabilisation}
        left.semilogy(SAMPLE * np.arange(len(at.path)), np.maximum(at.path, 1e-17), **look)
        middle.loglog(steps, [row.drift for row in own], "o-", **look)
        right.loglog(steps, [row.error for row in own], "o-", **look)
    left.set(xlabel="time [s]", ylabel="largest |Phi| [m, rad]", title="h = 2 ms")
    middle.set(xlabel="step [ms]", ylabel="largest |Phi| [m, rad]", title="drift")
    right.set(xlabel="step [ms]", ylabel="position error [m, rad]", title="error")
    for panel in (middle, right):
        panel.set_xticks([1e3 * step for step in STEPS], [f"{1e3 * step:g}" for step in STEPS])
        panel.minorticks_off()
    figure.legend(
        *right.get_legend_handles_labels(), loc="outside lower center", ncols=len(STABILISATIONS)
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    write_svg(figure, path)
