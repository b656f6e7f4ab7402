"""How sure is a walk: peak torque over uncertain friction, payload and servo stiffness.

Runs the study `friction_and_payload.toml` beside this file. Prints percentiles of the largest
torque of any joint, how likely it stays below a limit, and which input decides. Writes
`uncertain_walk.png`.
"""

import sys
from pathlib import Path

import numpy as np

import hexapod_pin as hp

STUDY = Path(__file__).with_name("friction_and_payload.toml")
LIMIT = 1.6  # N m
THREADS = 2


def main(folder: Path = Path(), study: Path = STUDY) -> hp.study.Uncertainty:
    """Return what the walks say of the peak torque."""
    sweep = hp.load_sweep(study)
    cases = [sweep.case(k) for k in range(len(sweep))]
    results = hp.simulate_batch(cases, threads=THREADS, keep="summary")
    peaks = [largest_torque(result) for result in results]

    found = hp.study.uncertainty(sweep, {"torque_peak": np.array(peaks)}, "torque_peak", LIMIT)
    for item in sweep.inputs:
        print(f"{item.name} [{item.unit}]: {item.text}")
    print(found.table())
    draw(peaks, folder / "uncertain_walk.png")
    return found


def draw(peaks: list[float], path: Path) -> None:
    """Draw how many walks stay below a torque, and the limit."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.subplots()
    axes.ecdf(peaks)
    axes.axvline(LIMIT, color="C3", label="limit")
    axes.set(xlabel="largest torque of any joint [N m]", ylabel="share of walks below")
    axes.legend()
    figure.savefig(path, dpi=120)


def largest_torque(result: hp.Summary | hp.Trace | Exception) -> float:
    """Return the largest torque of any joint [N m]; NaN of a run that failed or fell."""
    if not isinstance(result, hp.Summary):
        return float("nan")
    if any(event.kind == "trunk-contact" for event in result.events):
        return float("nan")
    return float(np.abs(result.torque_peak).max())


if __name__ == "__main__":
    main(Path(*sys.argv[1:2]))
