"""Drive the joints with set-points of your own: the body goes up and down on planted feet.

The set-points come at 50 Hz, each held until the next (`SampledTrajectory`). Prints the commanded
and the reached height of the trunk. Writes `own_controller.png`.
"""

import sys
from pathlib import Path

import numpy as np

import hexapod_pin as hp
from hexapod_pin.robot import LegKinematics

AMPLITUDE = 0.02  # m
PERIOD = 2.0  # s
RATE = 50.0  # 1/s
DURATION = 4.0  # s


def set_points(robot: hp.Robot, time: np.ndarray) -> np.ndarray:
    """Return the joint angles that lower the body by A (1 - cos(w t))/2. Shape (K, n) [rad]."""
    down = 0.5 * AMPLITUDE * (1.0 - np.cos(2.0 * np.pi * time / PERIOD))
    q = np.tile(robot.posture, (len(time), 1))
    for name in (leg.name for leg in robot.legs):
        leg = LegKinematics.of(robot, name)
        feet = np.tile(leg.forward(leg.posture), (len(time), 1))
        feet[:, 2] += down  # the feet come nearer to the body
        q[:, [robot.joint_index(joint) for joint in leg.joints]] = leg.inverse(feet)
    return q


def main(folder: Path = Path()) -> np.ndarray:
    """Return the height of the trunk above its start [m]. Shape (T,)."""
    robot = hp.load_robot("kharagpur")
    time = np.arange(0.0, DURATION, 1.0 / RATE)
    control = hp.motion.SampledTrajectory(time, set_points(robot, time))
    trace = hp.simulate(hp.Scene(robot), control, duration=DURATION)
    height = np.asarray(trace.q[:, 2] - trace.q[0, 2])
    print(f"commanded 0 to {-1e3 * AMPLITUDE:.1f} mm")
    print(f"reached {1e3 * height.max():.2f} to {1e3 * height.min():.2f} mm")
    print(f"feet moved by {1e3 * np.ptp(trace.foot_position[..., :2], axis=0).max():.3f} mm")
    draw(trace.time, height, folder / "own_controller.png")
    return height


def draw(time: np.ndarray, height: np.ndarray, path: Path) -> None:
    """Draw the commanded and the reached height."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.subplots()
    commanded = -0.5 * AMPLITUDE * (1.0 - np.cos(2.0 * np.pi * time / PERIOD))
    axes.plot(time, 1e3 * commanded, label="commanded")
    axes.plot(time, 1e3 * height, label="reached")
    axes.set(xlabel="time [s]", ylabel="height of the trunk above its start [mm]")
    axes.legend()
    figure.savefig(path, dpi=120)


if __name__ == "__main__":
    main(Path(*sys.argv[1:2]))
