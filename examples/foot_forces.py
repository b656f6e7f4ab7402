"""Read the foot forces of a walk: who carries what, and how near a foot is to slipping.

Forces act on the robot, in world axes; a sample is the mean over the interval that ends there.
Ratios of forces need a tighter accuracy than positions do. Prints mean and peak normal force and
the largest friction used per foot, and the mean vertical sum beside the weight. Writes
`foot_forces.csv` and `foot_forces.png`.
"""

import sys
from pathlib import Path

import numpy as np

import hexapod_pin as hp

CYCLE_TIME = 1.6  # s
DURATION = 6.4  # s
LOADED = 1.0  # N: the friction of a foot that carries less says nothing


def main(folder: Path = Path()) -> tuple[float, float]:
    """Return the mean sum of the vertical foot forces over whole cycles, and the weight [N]."""
    robot = hp.load_robot("kharagpur")
    control = hp.KinematicControl(hp.Gait.tetrapod(stroke=0.1, cycle_time=CYCLE_TIME))
    trace = hp.simulate(hp.Scene(robot), control, duration=DURATION, accuracy=1e-6)
    steady = hp.torque_budget(trace).window.samples
    normal = trace.normal_force[steady]
    friction = np.linalg.norm(trace.tangential_force[steady], axis=2)

    print("foot        mean [N]   peak [N]   largest friction / normal")
    for k, foot in enumerate(trace.foot_names):
        loaded = normal[:, k] > LOADED
        used = float((friction[loaded, k] / normal[loaded, k]).max())
        print(f"{foot:10} {normal[:, k].mean():9.3f} {normal[:, k].max():10.3f} {used:14.3f}")
    carried = float(trace.mean_foot_force[steady][:, :, 2].sum(axis=1).mean())
    weight = robot.total_mass * 9.81
    print(f"mean sum {carried:.3f} N, weight {weight:.3f} N")

    columns = np.column_stack([trace.time[steady], normal])
    head = ",".join(["time [s]", *(f"{foot} [N]" for foot in trace.foot_names)])
    np.savetxt(folder / "foot_forces.csv", columns, delimiter=",", header=head, comments="")
    trace.plot.foot_forces().savefig(folder / "foot_forces.png", dpi=100)
    return carried, weight


if __name__ == "__main__":
    main(Path(*sys.argv[1:2]))
