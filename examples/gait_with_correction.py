"""A controller on top of a gait: the planned feet, and a correction of your own.

The robot walks onto a ramp. A plan alone leans with the ground; here every tick reads the plan, and
the feet of the side that hangs lower are put down until the trunk is level. Prints how far the
trunk leans in the end, with and without the correction. Writes
`gait_with_correction.png`.
"""

import sys
from pathlib import Path

import numpy as np

import hexapod_pin as hp

GAIT = hp.Gait.tripod(stroke=0.06, cycle_time=0.8)  # m, s
GROUND = hp.Slope(angle=0.08)  # rad, rising ahead
DURATION = 2.4  # s


class LevelWalk:
    """Walks a plan, the trunk held level by integral action on what the gyroscope reads."""

    period = 0.01  # s between ticks
    gain = 0.04  # of the tilt, per tick

    def __init__(self, robot: hp.Robot, gait: hp.Gait) -> None:
        """Plan the gait; it is refused here where the robot cannot walk it."""
        self.plan, self.gait = hp.motion.WalkPlan(robot, gait), gait

    def start(self, scene: hp.Scene, batch: int) -> np.ndarray:
        """Return roll and pitch put in at first. Shape (B, 2) [rad]."""
        return np.zeros((batch, 2))

    def update(self, time: float, m: hp.feedback.Measurement, tilt: np.ndarray):
        """Return the command that is reached at the next tick, and the tilt put in by then."""
        now = np.stack([m.rotation[:, 2, 1], -m.rotation[:, 2, 0]], axis=1)  # roll, pitch
        tilt = tilt + self.gain * now
        then = self.plan.at(time + self.period)
        feet = np.repeat(then.feet[None], len(tilt), axis=0)
        feet[..., 2] += tilt[:, :1] * then.feet[:, 1] - tilt[:, 1:] * then.feet[:, 0]
        return hp.feedback.Command(self.plan.joint_angles(feet), ramp=True), tilt


def main(folder: Path = Path()) -> dict[str, float]:
    """Return how far the trunk's axis leans from upright at the end, for each control [rad]."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.subplots()
    robot = hp.load_robot("kharagpur")
    scene = hp.Scene(robot, terrain=GROUND)
    controls = {"plan alone": hp.KinematicControl(GAIT), "corrected": LevelWalk(robot, GAIT)}
    lean = {}
    for name, control in controls.items():
        trace = hp.simulate(scene, control, duration=DURATION, accuracy=1e-3)
        x, y, z, w = trace.q[:, 3:7].T
        upright = 1.0 - 2.0 * (x**2 + y**2)  # z component of the trunk's z axis
        angle = np.arccos(np.clip(upright, -1.0, 1.0))
        lean[name] = float(angle[trace.time > DURATION - GAIT.cycle_time].mean())
        axes.plot(trace.time, np.degrees(angle), label=name)
        print(f"{name}: leans {np.degrees(lean[name]):.2f} degrees, went {trace.q[-1, 0]:.2f} m")
    axes.set(xlabel="time [s]", ylabel="trunk leans by [degrees]")
    axes.legend()
    figure.savefig(folder / "gait_with_correction.png", dpi=120)
    return lean


if __name__ == "__main__":
    main(Path(*sys.argv[1:2]))
