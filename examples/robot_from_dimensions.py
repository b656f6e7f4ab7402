"""Describe a hexapod by its dimensions and masses, write its URDF, and walk it.

Links are solid boxes and rods, so inertias follow from size and mass. Prints the mass and the peak
torque per kind of joint. Writes `my_hexapod.urdf` and `my_hexapod.html`, the playback.
"""

import math
import sys
from pathlib import Path

import hexapod_pin as hp
from hexapod_pin.robot import Segment, Trunk

EFFORT, RATE = 3.0, 6.0  # N m, rad/s: of every servo
SWING, BEND = (-1.0, 1.0), (-1.4, 1.4)  # rad
KNEE = (0.2, 2.6)  # rad


def main(folder: Path = Path()) -> tuple[hp.Robot, hp.results.TorqueBudget]:
    """Return the robot and the torque budget of its walk."""
    plan = hp.Blueprint.from_dimensions(
        "my_hexapod",
        trunk=Trunk.solid(mass=1.2, size=(0.30, 0.16, 0.06)),  # kg, m
        coxa=Segment.box(0.08, (0.05, 0.04, 0.04), SWING, EFFORT, RATE),
        femur=Segment.box(0.10, (0.09, 0.03, 0.03), BEND, EFFORT, RATE),
        tibia=Segment.rod(0.06, 0.13, 0.008, KNEE, EFFORT, RATE),
        hip_x=0.12,
        hip_y=0.08,
        foot_radius=0.012,
        posture=(0.0, math.radians(-20.0), math.radians(110.0)),
        assumed=("all numbers are an example",),
    )
    path = folder / "my_hexapod.urdf"
    path.write_text(plan.urdf())
    robot = hp.load_robot(path)
    print(f"{path.name}: {robot.total_mass:.3f} kg")

    gait = hp.Gait.tripod(stroke=0.06, cycle_time=1.0, lift=0.02)
    trace = hp.simulate(hp.Scene(robot), hp.KinematicControl(gait), duration=5.0)
    budget = hp.torque_budget(trace)
    for kind in budget.kinds:
        print(f"{kind.kind}: peak {kind.peak.torque_peak:.3f} N m ({kind.peak.joint})")
    hp.view.write_html(trace, folder / "my_hexapod.html")
    return robot, budget


if __name__ == "__main__":
    main(Path(*sys.argv[1:2]))
