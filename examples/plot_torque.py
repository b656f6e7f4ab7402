"""Plot the torque of one leg's joints over a gait cycle, with the effort limit and the stance.

Needs matplotlib (`pip install 'hexapod-pin[plot]'`). Writes `torque.png`.
"""

import sys
from pathlib import Path

import numpy as np

import hexapod_pin as hp

LEG = "lf"
DURATION = 9.6  # s, four cycles


def main(folder: Path = Path()) -> Path:
    """Return the path of the figure."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    robot = hp.load_robot("kharagpur")
    control = hp.KinematicControl(hp.Gait.tetrapod(stroke=0.14, cycle_time=2.4))
    trace = hp.simulate(hp.Scene(robot), control, duration=DURATION)
    window = hp.torque_budget(trace).window
    last = (trace.time >= window.end - control.gait.cycle_time) & (trace.time <= window.end)
    time, leg = trace.time[last], robot.leg(LEG)
    down = trace.contact[last, trace.foot(leg.foot)]

    figure, axes = plt.subplots(figsize=(8, 4))
    for joint in leg.joints:
        axes.plot(time, trace.torque[last, trace.joint(joint)], label=joint)
    low, high = axes.get_ylim()
    axes.fill_between(time, low, high, where=down, alpha=0.1, label="foot on the ground")
    limit = float(np.max(robot.effort_limit))
    axes.set(xlabel="time [s]", ylabel=f"torque [N m] (limit {limit:g})", ylim=(low, high))
    axes.legend(fontsize="small")
    figure.tight_layout()
    path = folder / "torque.png"
    figure.savefig(path, dpi=120)
    plt.close(figure)
    print(f"{path}: {', '.join(leg.joints)} over {time[-1] - time[0]:.3g} s")
    return path


if __name__ == "__main__":
    main(Path(*sys.argv[1:2]))
