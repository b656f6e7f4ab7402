"""Compare contact laws: a robot that stands on a slope.

Friction that is a function of slip speed gives no force at rest, so the feet creep; stick-slip
holds them. Prints the measured creep speed of every pair beside the law's own exact number.
"""

import math

import numpy as np

import hexapod_pin as hp

ANGLE = math.radians(10.0)  # of the slope
UPHILL = np.array([math.cos(ANGLE), 0.0, math.sin(ANGLE)])
DURATION = 20.0  # s; the second half is measured


def main() -> dict[str, tuple[float, float]]:
    """Return creep speeds [m/s] by pair of laws: simulated, and from the closed form."""
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
    return found


if __name__ == "__main__":
    main()
