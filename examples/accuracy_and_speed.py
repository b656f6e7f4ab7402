"""What an accuracy costs on your scene: every method against a tight reference run.

Prints error (largest over all positions and samples), wall time and dynamics evaluations.
`hexapod_pin.benchmark.advice.advise(scene, control, 1e-4)` searches for the cheapest setting.
"""

import numpy as np

import hexapod_pin as hp

DURATION = 1.0  # s
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


def main() -> dict[str, float]:
    """Return the error of every setting [m and rad]."""
    scene = hp.Scene(hp.load_robot("kharagpur"))
    control = hp.KinematicControl(hp.Gait.tripod(stroke=0.08, cycle_time=0.8))

    def run(**how: object) -> hp.Trace:
        return hp.simulate(scene, control, duration=DURATION, sample=SAMPLE, **how)

    reference = run(**REFERENCE)
    errors = {}
    print("setting                                          error   wall [ms]   evaluations")
    for setting in SETTINGS:
        trace = run(**setting)
        name = ", ".join(f"{key} {value}" for key, value in setting.items())
        errors[name] = float(np.abs(trace.q - reference.q).max())
        wall, count = 1e3 * trace.run.wall_time, trace.counters["evaluations"]
        print(f"{name:40} {errors[name]:13.1e} {wall:11.1f} {count:13}")
    return errors


if __name__ == "__main__":
    main()
