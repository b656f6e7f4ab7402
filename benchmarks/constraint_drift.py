"""How far joints in maximal coordinates drift apart: Baumgarte's terms, the step, and projection.

The limp hexapod of HC14b flies for one second by RK4, every joint turning at up to 3 rad/s; errors
are against DOP853 at rtol 1e-11, projected. Writes constraint_drift.md and a figure.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import machine
import numpy as np
from solve_cost import solve_costs

from hexapod_pin.errors import DivergenceError
from hexapod_pin.formulations import maximal
from hexapod_pin.validation.cases.flight import flying
from hexapod_pin.validation.checks.maximal_checks import maximal_twin, position_difference

RESULTS = Path(__file__).resolve().parent / "results"
FIGURE = Path(__file__).resolve().parent.parent / "docs" / "constraint_drift.svg"
STEPS = (4e-3, 2e-3, 1e-3)
SAMPLE = 0.02

Preset = maximal.Baumgarte
WAYS: dict[str, Callable[[float], tuple[maximal.Baumgarte, bool]]] = {
    "nothing": lambda h: (Preset.off(), False),
    "alpha = beta = 5": lambda h: (Preset.constant(), False),
    "alpha = beta = 50": lambda h: (Preset.critical(50.0), False),
    "alpha = beta = 200": lambda h: (Preset.critical(200.0), False),
    "alpha = 1/h, beta = sqrt(2)/h": lambda h: (Preset.by_step(h), False),
    "projection": lambda h: (Preset.off(), True),
}


@dataclass(frozen=True)
class Row:
    """One run.

    Attributes:
        way: of WAYS.
        step: [s]; 0 for DOP853.
        path: largest |Phi| at each sample [m, rad].
        drift: largest |Phi| over all steps.
        drift_rate: largest |Phi'| over all steps [m/s, rad/s].
        error: of the positions, base and joints [m, rad].
        energy: largest change over the kinetic energy at first.
        cost: processor time, the least of all rounds [s].
        evaluations: of the model.
    """

    way: str
    step: float
    path: np.ndarray
    drift: float
    drift_rate: float
    error: float
    energy: float
    cost: float
    evaluations: int


def main(argv: Sequence[str] | None = None) -> int:
    """Print the tables, write them to --out and the figure to --figure. Return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=RESULTS, help="folder of constraint_drift.md")
    parser.add_argument("--figure", type=Path, default=FIGURE)
    parser.add_argument("--duration", type=float, default=1.0, help="of the flight [s]")
    parser.add_argument("--rounds", type=int, default=3, help="of which the cheapest counts")
    options = parser.parse_args(argv)
    before = machine.describe()
    rows = measure(options.duration, options.rounds)
    text = page(rows, options.duration, machine.as_text(before, machine.load()))
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "constraint_drift.md").write_text(text, encoding="utf-8")
    draw(rows, options.figure)
    print(text)
    return 0


def measure(duration: float, rounds: int) -> list[Row]:
    """Return the runs by RK4, then those by DOP853; the least cost of interleaved rounds."""
    truth = flown(0.0, Preset.off(), True, duration, rtol=1e-11)[0]
    jobs = [(way, step, *choose(step), 0.0) for way, choose in WAYS.items() for step in STEPS]
    jobs += [
        (way, 0.0, Preset.off(), way == "projection", 1e-8) for way in ("nothing", "projection")
    ]
    turns = [
        [
            flown(step, terms, projected, duration, rtol)
            for way, step, terms, projected, rtol in jobs
        ]
        for _ in range(rounds)
    ]
    found = []
    for job, *tries in zip(jobs, *turns, strict=True):
        run, _, model = tries[0]
        cheapest = min(cost for _, cost, _ in tries)
        found.append(compared((run, cheapest, model), job[0], job[1], truth))
    return found


def flown(
    step: float, terms: maximal.Baumgarte, projected: bool, duration: float,
    rtol: float = 0.0,
) -> tuple[maximal.MaximalRun, float, maximal.MaximalModel]:  # fmt: skip
    """Return a run, its processor time and its model; a run that diverged ends early."""
    _, flight = flying()
    twin = maximal_twin(flight.scene)
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


def compared(
    flown: tuple[maximal.MaximalRun, float, maximal.MaximalModel],
    way: str,
    step: float,
    truth: maximal.MaximalRun,
) -> Row:
    """Return a run beside the reference; errors are infinite where it diverged."""
    run, cost, model = flown
    whole = len(run.q) == len(truth.q)
    energy = [maximal.energy(model, s) for s in run.states]
    start = energy[0]
    return Row(
        way=way,
        step=step,
        path=np.array([opening(model, state) for state in run.states]),
        drift=run.drift,
        drift_rate=run.drift_rate,
        error=position_difference(run.q, truth.q) if whole else np.inf,
        energy=max(abs(e.total - start.total) for e in energy) / start.kinetic,
        cost=cost,
        evaluations=run.counters["evaluations"],
    )


def opening(model: maximal.MaximalModel, state: maximal.MaximalState) -> float:
    """Return the largest |Phi| [m, rad]."""
    return float(np.abs(model.constraints(state, model.kinematics(state)).violation).max())


def page(rows: Sequence[Row], duration: float, where: str) -> str:
    """Return the results as Markdown."""
    lines = [
        "# Drift of joints in maximal coordinates",
        "",
        where,
        "",
        f"The limp hexapod of HC14b in flight, {duration:g} s, 19 bodies, 90 constraints. Error: "
        "positions of the base and joint angles against DOP853 at rtol 1e-11. Processor time: the "
        "least of interleaved rounds.",
        "",
        "| stabilisation | method | largest Phi [m, rad] | largest Phi' | error [m, rad] | "
        "energy | evaluations | processor time [s/s] |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for row in rows:
        method = f"RK4, {1e3 * row.step:g} ms" if row.step else "DOP853, rtol 1e-8"
        lines.append(
            f"| {row.way} | {method} | {row.drift:.1e} | {row.drift_rate:.1e} | {row.error:.1e} | "
            f"{row.energy:.1e} | {row.evaluations} | {row.cost / duration:.2f} |"
        )
    lines += ["", "## One solve of the 204 equations", "", *solve_costs()]
    return "\n".join(lines) + "\n"


def draw(rows: Sequence[Row], path: Path) -> None:
    """Draw drift against time at 2 ms, and drift and error against the step."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 4.0), layout="constrained")
    left, middle, right = figure.subplots(1, 3)
    for number, way in enumerate(WAYS):
        own = [row for row in rows if row.way == way and row.step]
        at = next(row for row in own if row.step == STEPS[1])
        steps = [1e3 * row.step for row in own]
        look = {"color": f"C{number}", "label": way}
        left.semilogy(SAMPLE * np.arange(len(at.path)), np.maximum(at.path, 1e-17), **look)
        middle.loglog(steps, [row.drift for row in own], "o-", **look)
        right.loglog(steps, [row.error for row in own], "o-", **look)
    left.set(xlabel="time [s]", ylabel="largest |Phi| [m, rad]", title="h = 2 ms")
    middle.set(xlabel="step [ms]", ylabel="largest |Phi| [m, rad]", title="drift")
    right.set(xlabel="step [ms]", ylabel="position error [m, rad]", title="error")
    for panel in (middle, right):
        panel.set_xticks([1e3 * step for step in STEPS], [f"{1e3 * step:g}" for step in STEPS])
        panel.minorticks_off()
    figure.legend(*right.get_legend_handles_labels(), loc="outside lower center", ncols=len(WAYS))
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, metadata={"Date": None})


if __name__ == "__main__":
    sys.exit(main())
