"""React to a foot that finds no ground: it is lowered until the ground pushes.

The robot walks down a step that its plan does not know. A foot that should stand and does not carry
is lowered, and lands as much lower from then on; what all feet are lowered by is taken back slowly,
which lowers the trunk. Prints how far the trunk leans, with and without the reaction.
Writes `foot_finds_no_ground.html`, the playback of both.
"""

import sys
from pathlib import Path

import numpy as np

import hexapod_pin as hp

GAIT = hp.Gait.tetrapod(stroke=0.06, cycle_time=1.2, lift=0.04)  # m, s, m
GROUND = hp.Stairs(rise=0.02, run=1.0, count=1, start=-0.22, heading=np.pi, height=-0.02)  # m
DURATION = 4.0  # s


class Reaching:
    """Walks a plan; feet without ground reach down."""

    period = 0.01  # s between ticks
    down_speed, back_speed = 0.1, 0.02  # m/s
    deepest = 0.025  # m

    def __init__(self, robot: hp.Robot, gait: hp.Gait) -> None:
        """Plan the gait."""
        self.plan, self.gait = hp.motion.WalkPlan(robot, gait), gait

    def start(self, scene: hp.Scene, batch: int) -> np.ndarray:
        """Return how far each foot is lowered at first. Shape (B, L) [m]."""
        return np.zeros((batch, len(self.plan.legs)))

    def update(self, time: float, m: hp.feedback.Measurement, down: np.ndarray):
        """Return the command that is reached at the next tick, and how far feet are lowered."""
        then = self.plan.at(time + self.period)
        carries = m.loaded[:, self.plan.foot_index]
        reaching = then.stance & ~carries
        down = np.minimum(down + self.down_speed * self.period * reaching, self.deepest)
        down = down - np.minimum(down.min(axis=1, keepdims=True), self.back_speed * self.period)
        feet = then.feet - down[..., None] * np.array([0.0, 0.0, 1.0])
        return hp.feedback.Command(self.plan.joint_angles(feet), ramp=True), down


def main(folder: Path = Path()) -> dict[str, float]:
    """Return the largest tilt of the trunk, for each control [rad]."""
    robot = hp.load_robot("kharagpur")
    scene = hp.Scene(robot, terrain=GROUND)
    controls = {"plan alone": hp.KinematicControl(GAIT), "reaching": Reaching(robot, GAIT)}
    tilt, traces = {}, {}
    for name, control in controls.items():
        trace = traces[name] = hp.simulate(scene, control, duration=DURATION, accuracy=1e-3)
        x, y, z, w = trace.q[:, 3:7].T
        lean = np.arccos(np.clip(1.0 - 2.0 * (x**2 + y**2), -1.0, 1.0))
        tilt[name] = float(lean.max())
        went = trace.q[-1, 0]
        print(f"{name}: leans up to {np.degrees(tilt[name]):.2f} degrees, went {went:.2f} m")
    hp.view.write_side_by_side(traces, folder / "foot_finds_no_ground.html")
    return tilt


if __name__ == "__main__":
    main(Path(*sys.argv[1:2]))
