"""Drop the robot: peak forces and torques of a landing, and what becomes of its energy.

Prints touch-down, peaks and the energy balance. A peak after an impact depends on contact stiffness
and sampling: repeat with other numbers before sizing a part by it. Writes `drop_test.html`, the
playback.
"""

import sys
from pathlib import Path

import numpy as np

import hexapod_pin as hp

HEIGHT = 0.05  # m, feet above the ground
DURATION = 1.5  # s


def main(folder: Path = Path()) -> hp.Trace:
    """Return the trace of the fall and the landing."""
    robot = hp.load_robot("athena")
    standing = robot.stand()
    q = standing.q.copy()
    q[2] += HEIGHT
    start = robot.check_state(q, np.zeros(len(standing.v)))
    scene = hp.Scene(robot)
    control = hp.HoldPosture()
    trace = hp.simulate(scene, control, duration=DURATION, sample=1e-3, initial=start)

    touch = trace.time[trace.contact.any(axis=1)][0]
    sample, joint = np.unravel_index(np.abs(trace.torque).argmax(), trace.torque.shape)
    weight = robot.total_mass * 9.81
    force = trace.normal_force.sum(axis=1)
    print(f"touch-down at {touch:.3f} s (free fall: {np.sqrt(2 * HEIGHT / 9.81):.4f} s)")
    print(f"peak force {force.max():.1f} N, {force.max() / weight:.1f} times the weight")
    print(
        f"peak torque {abs(trace.torque[sample, joint]):.2f} N m of {robot.effort_limit[joint]:g}"
        f" N m in {trace.joint_names[joint]} at {trace.time[sample]:.3f} s"
    )
    for name in ("servo_work", "joint_damping_loss", "normal_loss", "friction_loss"):
        print(f"{name:20} {trace.energy[name][-1]:9.4f} J")
    print(f"{'energy residual':20} {trace.energy_residual[-1]:9.1e} J")
    hp.view.write_html(trace, folder / "drop_test.html")
    return trace


if __name__ == "__main__":
    main(Path(*sys.argv[1:2]))
