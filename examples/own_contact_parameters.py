"""Give the feet your own material: stiffness from Hertz, restitution, friction.

Prints the laws' numbers, and how deep the feet of the standing robot press into the ground beside
Hertz' closed form d = (N/K)^(2/3). The law damps slow motion strongly: settling takes seconds.
Writes `own_contact_parameters.png`: an impact, restitution, friction.
"""

import sys
from pathlib import Path

import numpy as np

import hexapod_pin as hp

DURATION = 20.0  # s, long enough to come to rest


def main(folder: Path = Path()) -> tuple[np.ndarray, np.ndarray]:
    """Return the depths of the feet [m], simulated and from the closed form. Shape (6,) each."""
    robot = hp.load_robot("kharagpur")
    radius = robot.feet[0].radius  # m
    normal = hp.contact.Restitution.hertz(young=2e6, poisson=0.49, radius=radius, restitution=0.2)
    friction = hp.contact.StickSlip(
        mu=0.6, mu_dynamic=0.5, stiffness=1e4, damping=40.0
    )  # N/m, N s/m
    contact = hp.Contact(normal=normal, friction=friction)
    print(f"K = {normal.stiffness:.4g} N/m^1.5, restitution {normal.restitution}")
    print(f"a foot slips above {friction.limit} of its normal force")

    path = folder / "own_contact_parameters.png"
    hp.view.write_figure(contact, path, mass=robot.total_mass / 6, speed=0.2)  # kg, m/s
    scene = hp.Scene(robot, contact=contact)
    trace = hp.simulate(scene, hp.HoldPosture(), duration=DURATION, sample=0.1)
    depth, force = -trace.foot_gap[-1], trace.normal_force[-1]
    expected = (force / normal.stiffness) ** (1.0 / normal.exponent)
    for name, d, closed, f in zip(trace.foot_names, depth, expected, force, strict=True):
        print(f"{name}: {f:6.3f} N, {1e3 * d:.5f} mm deep (closed form {1e3 * closed:.5f} mm)")
    return depth, expected


if __name__ == "__main__":
    main(Path(*sys.argv[1:2]))
