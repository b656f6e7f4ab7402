"""Load a URDF of your own: check it, name its feet, ask where a leg can put its foot.

Prints the report on the file, the legs and their feet, one inverse-kinematics answer, and why a
damaged copy of the file is refused. Writes `my_robot.urdf`,
`damaged.urdf` and `reach.png`.
"""

import shutil
import sys
from pathlib import Path

import numpy as np

import hexapod_pin as hp
from hexapod_pin.robot import LegKinematics, UrdfReport, inspect

FEET = ["lf_foot", "lm_foot", "lr_foot", "rf_foot", "rm_foot", "rr_foot"]
"""Foot links of the URDF; needed only where their names do not end in foot, tip or tarsus."""


def main(folder: Path = Path()) -> tuple[hp.Robot, UrdfReport]:
    """Return the robot, and the report on a file that cannot be used."""
    mine = Path(shutil.copy(hp.urdf_path("athena"), folder / "my_robot.urdf"))
    print(inspect(mine, feet=FEET))

    robot = hp.load_robot(mine, feet=FEET, foot_radius=0.015)
    print(f"\n{robot.name}: {robot.total_mass:.3f} kg, {len(robot.joint_names)} joints")
    for leg in robot.legs:
        print(f"  leg {leg.name}: {', '.join(leg.joints)} -> {leg.foot}")

    leg = LegKinematics.of(robot, "lf")
    target = leg.forward(leg.posture) + [0.03, 0.0, 0.02]  # m, base axes
    angles = leg.inverse(target)
    print(f"lf foot at {target.round(4)} m: joints at {angles.round(4)} rad")

    draw_reach(leg, folder / "reach.png")

    damaged = folder / "damaged.urdf"
    damaged.write_text(mine.read_text().replace('<mass value="0.225"', '<mass value="-0.225"', 1))
    report = inspect(damaged)
    print(f"\n{damaged.name}: {'accepted' if report.ok else report.findings}")
    return robot, report


def draw_reach(leg: LegKinematics, path: Path) -> None:
    """Draw where a foot comes when its leg's last two joints move, seen from behind [m]."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5, 4), layout="constrained")
    axes = figure.subplots()
    bends = np.linspace(-0.8, 0.8, 17)  # rad, from the posture
    angles = np.array([leg.posture + [0.0, femur, tibia] for femur in bends for tibia in bends])
    feet = leg.forward(angles)
    axes.plot(feet[:, 1], feet[:, 2], ".", label="reached")
    axes.plot(*leg.forward(leg.posture)[1:], "o", label="standing")
    axes.set(xlabel="to the left [m]", ylabel="up [m]", aspect="equal")
    axes.legend()
    figure.savefig(path, dpi=120)


if __name__ == "__main__":
    main(Path(*sys.argv[1:2]))
