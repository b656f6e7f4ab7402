"""Tables and the page of what a million walks cost."""

from __future__ import annotations

from collections.abc import Sequence

from hexapod_pin.text_table import Table
from studies.sweeps.forecast import MESSAGES, Forecast, SweepCosts, forecast
from studies.sweeps.measurements import Measured
from studies.sweeps.simulated_workers import SimulatedSweep

FED = (1, 4, 16, 64, 256, 1024)
"""Cases of a task in the table of how many cores are fed."""

Check = tuple[SimulatedSweep, SweepCosts]


def cost_table(found: Measured, walks: int) -> Table:
    """Return what was measured."""
    costs = found.costs
    rows = [
        [f"a case on a core ({walks} cases)", f"{1e3 * costs.case:.1f} ms"],
        ["a worker process, resident", f"{costs.worker_memory / 1e6:.0f} MB"],
        ["a task's message", f"{costs.task_bytes:.0f} bytes, and {costs.task_case_bytes:.1f} a "
         "case"],
        ["a result in its message", f"{costs.result_bytes:.0f} bytes a case"],
        ["a result in the store", f"{costs.store_bytes:.0f} bytes a case"],
        ["messages of the scheduler", f"{MESSAGES} a task, by Dask's protocol"],
        ["scheduler, busy for", _line(costs.scheduler_task, costs.scheduler_case)],
        ["parent, busy for", _line(costs.parent_task, costs.parent_case)],
        *[[f"store alone, {chunk} rows a commit (WAL, synchronous FULL)", f"{rate:.0f} rows/s"]
          for chunk, rate in found.rows.items()],
        ["parent's memory, store opened", f"{found.opened_memory / 1e3:.1f} kB a case"],
        ["parent's memory, dataset built", f"{costs.dataset_memory / 1e3:.1f} kB a case, beside "
         f"{costs.parent_memory / 1e6:.0f} MB"],
    ]  # fmt: skip
    return Table("Measured", ["", ""], rows)


def _line(task: float, case: float) -> str:
    return f"{1e3 * task:.2f} ms a task, and {1e3 * case:.3f} ms a case"


def fed_table(costs: SweepCosts) -> Table:
    """Return how many cores one parent and one scheduler feed."""
    rows = []
    for chunk in FED:
        cores, limit = costs.cores_fed(chunk)
        rows.append([str(chunk), f"{chunk * costs.case:.2f}", f"{cores:.0f}", limit])
    return Table(
        "Cores that one parent and one scheduler can feed",
        ["cases of a task", "a task [s]", "cores", "what saturates first"], rows,
    )  # fmt: skip


def forecast_table(found: Sequence[Forecast], costs: SweepCosts) -> Table:
    """Return what the large sweep costs."""
    head = ["cores", "chunk", "hours", "core-hours", "store [GB]", "messages/s", "results [MB/s]",
            "scheduler busy", "parent busy", "waits for", "parent's memory [GB]"]  # fmt: skip
    rows = [
        [str(f.cores), str(f.chunk), f"{f.hours:.2f}", f"{f.core_hours:.1f}",
         f"{f.cases * costs.store_bytes / 1e9:.1f}", f"{f.messages:.0f}", f"{f.traffic / 1e6:.1f}",
         f"{f.scheduler_load:.0%}", f"{f.parent_load:.0%}", f.limit,
         f"{(costs.parent_memory + f.cases * costs.dataset_memory) / 1e9:.0f}"]
        for f in found
    ]  # fmt: skip
    return Table(f"Forecast of {found[0].cases} cases" if found else "Forecast", head, rows)


def check_table(checks: Sequence[Check]) -> Table:
    """Return measured sweeps on simulated workers beside their forecasts."""
    head = ["simulated cores", "chunk", "cases", "cases/s forecast", "cases/s measured", "off by",
            "scheduler busy, forecast and measured", "parent busy, forecast and measured",
            "waits for"]  # fmt: skip
    rows = []
    for run, costs in checks:
        said = forecast(costs, run.cases, run.cores, run.chunk)
        rows.append([
            str(run.cores), str(run.chunk), str(run.cases), f"{said.rate:.0f}", f"{run.rate:.0f}",
            f"{run.rate / said.rate - 1.0:+.0%}",
            f"{said.scheduler_load:.0%}, {run.scheduler / run.wall:.0%}",
            f"{said.parent_load:.0%}, {run.parent / run.wall:.0%}", said.limit,
        ])  # fmt: skip
    return Table("Checked with simulated workers", head, rows)


def scale_page(
    found: Measured, checks: Sequence[Check], tables: Sequence[Table], cases: int, memory: float,
    duration: float, machine: str,
) -> str:  # fmt: skip
    """Return the page for readers, as Markdown.

    Args:
        found: what was measured.
        checks: sweeps on simulated workers.
        tables: as of the functions above.
        cases: of the large sweep.
        memory: within which its dataset is to be built [GB].
        duration: of a walk [s].
        machine: what was measured on.
    """
    costs = found.costs
    hours = cases * costs.case / 3600.0
    small, large = costs.cores_fed(4), costs.cores_fed(256)
    most = costs.dataset_cases(1e9 * memory)
    parts = [
        "# A million cases",
        "Written by `python scripts/studies sweep_scale` from what it measures.",
        machine,
        f"A case is a walk of {duration:g} s of kharagpur at accuracy 1e-4; a core takes "
        f"{1e3 * costs.case:.0f} ms for it, so {cases} cases are {hours:.1f} core-hours whatever "
        f"the number of cores, and a store of {cases * costs.store_bytes / 1e9:.1f} GB. A worker "
        f"needs {costs.worker_memory / 1e6:.0f} MB. What differs is how many cores one parent "
        "(which hands out tasks and writes the store) and one Dask scheduler can feed.",
        _headed(tables[0]),
        "## What saturates first",
        f"The {small[1]}, at {small[0]:.0f} cores with the 4 cases of a task that are the "
        f"default; with 256 the {large[1]}, at {large[0]:.0f}. A core asks for a task every "
        "chunk x time of a case, and each task keeps parent and scheduler busy for a fixed time "
        "and one that grows with its results, which pass through both. So cores = chunk x case "
        "/ (a + b chunk), with a and b of the table above.",
        tables[1].markdown(),
        f"## {cases} cases",
        tables[2].markdown(),
        "Core-hours count cores that wait. The scheduler is taken to be one process with a core "
        "of its own, as is the parent.",
        "## What to do",
        "- Give `--chunk` so many cases that a task takes 10 s or more; the price is that the "
        "death of a worker loses up to so many cases, which are run again.\n"
        f"- Beyond about {large[0]:.0f} cores: several sweeps, each with a parent, a scheduler and "
        "a store, and a study file with a part of a grid axis; put their datasets together with "
        '`xarray.concat([...], "case")`. Each feeds as many cores as one. The package does not '
        "divide a study by itself.\n"
        "- One machine needs none of this: threads hand over no messages.",
        "## A limit: memory of the dataset",
        f"`SweepResult` reads a whole store, and `run_sweep` returns one. Opened it takes "
        f"{found.opened_memory / 1e3:.0f} kB a case, with `.dataset` or `.save` "
        f"{costs.dataset_memory / 1e3:.0f} kB: {cases} cases need "
        f"{(costs.parent_memory + cases * costs.dataset_memory) / 1e9:.0f} GB. Within "
        f"{memory:g} GB a dataset has {_rounded(most)} cases at most. Nothing "
        "reads it in parts. Where memory is short, sweep in several stores; all that was run is "
        "in its store already, and can be read from there by row (`SELECT numbers FROM cases "
        'WHERE number = ?`, doubles in the order of `meta` "quantities").',
        "## How it was checked",
        "Simulated workers are threads of Dask workers that sleep for the time of their cases and "
        "send real results; parent, scheduler and store are the real ones. All processes share "
        "this machine's cores, which a cluster's do not: where they are too few, a saturated "
        "sweep is slower than its forecast.",
        tables[3].markdown() if checks else "Nothing was checked in this run.",
    ]
    return "\n\n".join(part.strip() for part in parts) + "\n"


def _headed(table: Table) -> str:
    return f"## {table.title}\n\n{table.markdown()}"


def _rounded(count: float) -> str:
    """Return a number with two digits."""
    return f"{float(f'{count:.2g}'):.0f}"
