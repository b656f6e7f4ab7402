"""What an accuracy costs on your scene: every method against a tight reference run.

Prints error (largest over all positions and samples), wall time and dynamics evaluations. Writes
`accuracy_and_speed.png`.
`hexapod_pin.benchmark.advice.advise(scene, control, 1e-4)` searches for the cheapest setting.
"""

import sys
from pathlib import Path

import numpy as np

import hexapod_pin as hp

DURATION = 0.5  # s
SAMPLE = 0.01  # s
SETTINGS = (
    {"accuracy": 1e-4},  # the default method, ndf
    {"accuracy": 1e-6},
    {"accuracy": 1e-8},
    {"method": "extrapolated-euler", "accuracy": 1e-4},
    {"method": "implicit-euler", "step": 1e-3},
    {"method": "implicit-euler", "step": 1e-4},
    {"method": "robust", "step": 1e-3},
)
REFERENCE = {"method": "ndf", "accuracy": 1e-10}


def main(folder: Path = Path()) -> dict[str, float]:
    """Return the error of every setting [m and rad]."""
    scene = hp.Scene(hp.load_robot("kharagpur"))
    control = hp.KinematicControl(hp.Gait.tripod(stroke=0.08, cycle_time=0.8))

    def run(**how: object) -> hp.Trace:
        return hp.simulate(scene, control, duration=DURATION, sample=SAMPLE, **how)

    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.subplots()
    reference = run(**REFERENCE)
    errors = {}
    print("setting                                          error   wall [ms]   evaluations")
    for setting in SETTINGS:
        trace = run(**setting)
        name = ", ".join(f"{key} {value}" for key, value in setting.items())
        errors[name] = float(np.abs(trace.q - reference.q).max())
        wall, count = 1e3 * trace.run.wall_time, trace.counters["evaluations"]
        print(f"{name:40} {errors[name]:13.1e} {wall:11.1f} {count:13}")
        axes.loglog(wall, errors[name], "o", label=name)
    axes.set(xlabel=f"wall time of {DURATION:g} s [ms]", ylabel="error [m or rad]")
    axes.legend(fontsize="small")
    figure.savefig(folder / "accuracy_and_speed.png", dpi=120)
    return errors


if __name__ == "__main__":
    main(Path(*sys.argv[1:2]))
