"""Compare contact laws: a robot that stands on a slope.

Friction that is a function of slip speed gives no force at rest, so the feet creep; stick-slip
holds them. Prints the measured creep speed of every pair beside the law's own exact number.
Writes `compare_two_laws.png`.
"""

import math
import sys
from pathlib import Path

import numpy as np

import hexapod_pin as hp

ANGLE = math.radians(10.0)  # of the slope
UPHILL = np.array([math.cos(ANGLE), 0.0, math.sin(ANGLE)])
DURATION = 20.0  # s; the second half is measured


def main(folder: Path = Path()) -> dict[str, tuple[float, float]]:
    """Return creep speeds [m/s] by pair of laws: simulated, and from the closed form."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.subplots()
    robot = hp.load_robot("athena")
    found = {}
    print("laws        simulated [m/s]   closed form [m/s]")
    for name in ("accurate", "s1", "s2"):
        contact = hp.Contact.preset(name)
        scene = hp.Scene(robot, terrain=hp.Slope(angle=ANGLE), contact=contact)
        trace = hp.simulate(scene, hp.HoldPosture(), duration=DURATION, sample=0.05, accuracy=1e-5)
        half = len(trace.time) // 2
        way = (trace.com[half] - trace.com[-1]) @ UPHILL
        speed = float(way / (trace.time[-1] - trace.time[half]))
        found[name] = speed, contact.friction.creep_speed(math.tan(ANGLE))
        print(f"{name:10} {speed:16.3e} {found[name][1]:19.3e}")
        axes.plot(trace.time, 1e3 * (trace.com[0] - trace.com) @ UPHILL, label=name)
    axes.set(xlabel="time [s]", ylabel="crept down a slope of 10 degrees [mm]")
    axes.legend()
    figure.savefig(folder / "compare_two_laws.png", dpi=120)
    return found


if __name__ == "__main__":
    main(Path(*sys.argv[1:2]))
